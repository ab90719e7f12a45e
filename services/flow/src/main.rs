//! The flow process.

fn main() {}
