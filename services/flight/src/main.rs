//! The flight process.

fn main() {}
