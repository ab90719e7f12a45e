//! The localization process.

fn main() {}
