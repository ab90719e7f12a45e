//! The stream process.
fn main() {}
