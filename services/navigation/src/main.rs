//! The navigation process.

fn main() {}
