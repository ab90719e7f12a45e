//! What the fuzz targets check: one function a target, that takes any bytes and panics when a promise is broken.
//!
//! The fuzzer (`tests/fuzz`, `cargo xtask fuzz`) looks for such bytes; `tests/fuzz_seeds.rs` runs the same functions
//! over what is shipped, over the kept seeds and over every crash that was ever found, on stable Rust.
//!
//! All loaders promise:
//! - no panic, whatever the bytes;
//! - an error is one line that names the file, and holds no control characters: it ends in a terminal or a log, and a
//!   file that somebody uploads must not write lines of its own there;
//! - memory within a bound that the input's own length gives, or the largest plan: never what a header claims;
//! - no number that came through is infinite or not a number.
#![allow(
    clippy::panic,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a target says what it has found by a panic"
)]

#[cfg(feature = "services")]
mod config;
mod manifest;
mod memory;
mod msp;
#[cfg(feature = "services")]
mod network;
mod plan;
#[cfg(feature = "services")]
mod signal;
mod vehicle;
mod world;

#[cfg(feature = "services")]
pub use config::config;
pub use manifest::manifest;
pub use memory::{Peak, peak_of};
pub use msp::msp_stream;
#[cfg(feature = "services")]
pub use network::network;
pub use plan::{plan, sidecar};
#[cfg(feature = "services")]
pub use signal::signal;
pub use vehicle::vehicle;
pub use world::world;

use crate::checkout;
use std::fmt::{Debug, Display};
use std::path::PathBuf;

/// A target: its name as in `tests/fuzz`, and what it checks. It returns whether the input was accepted.
pub type Target = (&'static str, fn(&[u8]) -> bool);

/// All targets.
pub const TARGETS: &[Target] = &[
    ("msp_stream", msp_stream),
    ("plan", plan),
    ("sidecar", sidecar),
    ("world", world),
    ("vehicle", vehicle),
    ("manifest", manifest),
    #[cfg(feature = "services")]
    ("config", config),
    #[cfg(feature = "services")]
    ("network", network),
    #[cfg(feature = "services")]
    ("signal", signal),
];

/// Services with a configuration, by selector: the target `config` takes `0` and the characters after it.
pub const SERVICES: [&str; 8] =
    ["flight", "flow", "sonar", "localization", "navigation", "pilot", "simulator", "bridge"];

/// Parts two texts of one input: neither yaml nor TOML may hold it.
pub const BETWEEN: u8 = 0;

/// How every loader is told that its file is called.
const FILE: &str = "the-file";

/// The input before and after [`BETWEEN`]; all of it is before when there is none.
fn halves(data: &[u8]) -> (&[u8], &[u8]) {
    let Some(at) = data.iter().position(|byte| *byte == BETWEEN) else { return (data, &[]) };
    let (before, after) = data.split_at(at);
    (before, after.get(1..).unwrap_or(&[]))
}

/// What `load` returns, when it took no more than `bytes` of memory at any moment.
fn within_memory<T>(bytes: usize, load: impl FnOnce() -> T) -> T {
    let (loaded, peak) = peak_of(load);
    assert!(peak <= bytes, "took {peak} bytes of memory, allowed is {bytes}");
    loaded
}

/// Memory that a text of this length may cost. A line of TOML or yaml becomes a tree of keys and values before it
/// becomes a structure, and an error quotes it; measured on the shipped files and in the fuzzer's corpus.
const fn text_memory(length: usize) -> usize {
    256 * 1024 + 400 * length
}

/// An error is one line without control characters, and says which file. Returns false: the input was not accepted.
fn refused(error: &impl Display) -> bool {
    let text = error.to_string();
    assert!(text.contains(FILE), "names no file: {text:?}");
    assert!(!text.chars().any(char::is_control), "not one plain line: {text:?}");
    false
}

/// No number is infinite or not a number, as far as `{:?}` shows: derived, so that no field is forgotten.
fn check_finite(loaded: &impl Debug) {
    let text = format!("{loaded:?}");
    let bare = outside_quotes(&text);
    for word in bare.split(|c: char| !c.is_alphanumeric()) {
        assert!(word != "NaN" && word != "inf", "a number is not finite: {text}");
    }
}

/// A derived debug text without its strings.
fn outside_quotes(text: &str) -> String {
    let mut bare = String::with_capacity(text.len());
    let mut inside = false;
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        match character {
            '"' => inside = !inside,
            '\\' if inside => {
                characters.next();
            }
            _ if !inside => bare.push(character),
            _ => {}
        }
    }
    bare
}

/// The shipped files as inputs of a target, each with its name: what must be accepted.
///
/// # Errors
/// What reading files reports.
pub fn shipped(target: &str) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let deploy = checkout().join("deploy");
    let read = |name: &str| std::fs::read(deploy.join(name));
    let joined = |first: &str, second: &str| -> std::io::Result<Vec<u8>> {
        Ok([read(first)?, vec![BETWEEN], read(second)?].concat())
    };
    let files = |folder: &str, ending: &str| -> std::io::Result<Vec<String>> {
        let mut names: Vec<String> = std::fs::read_dir(deploy.join(folder))?
            .map(|entry| Ok(format!("{folder}/{}", entry?.file_name().to_string_lossy())))
            .collect::<std::io::Result<_>>()?;
        names.retain(|name| name.ends_with(ending));
        names.sort();
        Ok(names)
    };
    let whole = |names: Vec<String>| names.into_iter().map(|name| Ok((name.clone(), read(&name)?))).collect();
    match target {
        "plan" => files("plans", ".png")?
            .into_iter()
            .map(|picture| Ok((picture.clone(), joined(&picture.replace(".png", ".yaml"), &picture)?)))
            .collect(),
        "sidecar" => whole(files("plans", ".rooms.yaml")?),
        "world" => whole(files("worlds", ".toml")?),
        "vehicle" => whole(files("vehicles", ".toml")?),
        "manifest" => Ok(vec![
            ("system.toml".to_owned(), read("system.toml")?),
            ("system.toml with sim.toml".to_owned(), joined("system.toml", "sim.toml")?),
        ]),
        "config" => (b'0'..)
            .zip(SERVICES)
            .map(|(selector, service)| {
                let name = format!("config/{service}.toml");
                Ok((name.clone(), [vec![selector], read(&name)?].concat()))
            })
            .collect(),
        _ => Ok(Vec::new()),
    }
}

/// Where the kept inputs of a target lie: what the search starts from, and what once broke a promise.
#[must_use]
pub fn kept(target: &str) -> [PathBuf; 2] {
    ["seeds", "crashes"].map(|folder| checkout().join("tests/fuzz").join(folder).join(target))
}
