//! The pilot process.

fn main() {}
