//! Draws the figures of thesis chapter 3.1 from this code: `cargo xtask figures`, or this with a directory.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    unreachable_pub,
    dead_code,
    reason = "an example, shared with tests"
)]

mod drawings;
mod scenes;
mod svg;
mod world;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let directory = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("docs/figures"), PathBuf::from);
    std::fs::create_dir_all(&directory)?;
    for (name, drawn) in drawings::all() {
        let path = directory.join(name);
        println!("{} ({} KB)", path.display(), drawn.len().div_ceil(1024));
        std::fs::write(path, drawn)?;
    }
    Ok(())
}
