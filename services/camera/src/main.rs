//! The drone's picture: raw frames in, H.264 out, asleep while nobody watches.
fn main() {}
