//! The sonar process.

fn main() {}
