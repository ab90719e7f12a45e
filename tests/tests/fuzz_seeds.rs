//! What the fuzzer starts from and what it found, through the same checks on stable Rust; see `tests/src/fuzz`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use sereno_tests::checkout;
use sereno_tests::fuzz::{BETWEEN, Peak, TARGETS, kept, peak_of, shipped};
use std::collections::BTreeSet;

#[global_allocator]
static ALLOCATOR: Peak = Peak;

#[test]
fn every_seed_and_every_kept_crash_keeps_the_promises() {
    for &(target, check) in TARGETS {
        let mut accepted = 0;
        for folder in kept(target) {
            let Ok(entries) = std::fs::read_dir(folder) else { continue };
            for entry in entries {
                let path = entry.unwrap().path();
                // Shown when it panics.
                println!("{}", path.display());
                accepted += usize::from(check(&std::fs::read(&path).unwrap()));
            }
        }
        assert!(
            accepted >= 3,
            "{target}: {accepted} seeds were accepted: the search would start from nothing"
        );
    }
}

#[test]
fn what_is_shipped_is_accepted_and_keeps_the_promises() {
    let mut tried = 0;
    for &(target, check) in TARGETS {
        for (name, bytes) in shipped(target).unwrap() {
            println!("{target}: {name}");
            assert!(check(&bytes), "{name} is refused");
            tried += 1;
        }
    }
    // Three plans, three sidecars, three worlds, three vehicles, two manifests, seven configurations.
    assert!(tried >= 21, "{tried}");
}

/// Ranges are checked field by field: this asks of every number in every shipped text file whether one was forgotten.
/// The checks themselves panic where such a number comes through.
#[test]
fn no_number_of_a_shipped_file_may_be_infinite_or_none() {
    let mut asked = 0;
    for &(target, check) in TARGETS {
        for (name, bytes) in shipped(target).unwrap() {
            let end = if target == "plan" { bytes.iter().position(|byte| *byte == BETWEEN) } else { None };
            for (from, to) in numbers(&bytes[..end.unwrap_or(bytes.len())]) {
                for word in
                    if name.ends_with(".toml") { ["nan", "inf", "-inf"] } else { [".nan", ".inf", "-.inf"] }
                {
                    println!("{target}: {name}: {word} at byte {from}");
                    check(&[&bytes[..from], word.as_bytes(), &bytes[to..]].concat());
                    asked += 1;
                }
            }
        }
    }
    assert!(asked > 1000, "{asked}");
}

/// Where numbers stand as values: after `=`, `:`, `[` or a comma.
fn numbers(text: &[u8]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut before = b' ';
    let mut at = 0;
    while let Some(byte) = text.get(at).copied() {
        let of_number = |byte: &u8| byte.is_ascii_digit() || b"-.e".contains(byte);
        let length = text[at..].iter().take_while(|byte| of_number(byte)).count();
        if b"=:[,".contains(&before) && length > 0 && byte != b'e' {
            found.push((at, at + length));
            at += length;
            before = b'0';
        } else {
            if byte != b' ' {
                before = byte;
            }
            at += 1;
        }
    }
    found
}

#[test]
fn memory_is_measured_and_every_target_has_a_fuzzer() {
    let (length, peak) = peak_of(|| std::hint::black_box(vec![0_u8; 1 << 20]).len());
    assert_eq!(length, 1 << 20);
    assert!((1 << 20..1 << 21).contains(&peak), "{peak}");
    let fuzzers: BTreeSet<String> = std::fs::read_dir(checkout().join("tests/fuzz/fuzz_targets"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().trim_end_matches(".rs").to_owned())
        .collect();
    assert_eq!(fuzzers, TARGETS.iter().map(|(target, _)| (*target).to_owned()).collect());
}
