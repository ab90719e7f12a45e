//! `sereno`, the command an operator or developer types.

fn main() {}
