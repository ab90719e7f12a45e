//! The drone on zenoh: what its topics say goes out, orders come in.
fn main() {}
