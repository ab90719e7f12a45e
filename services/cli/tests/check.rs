//! `sereno check` on a house that is spoiled in one place each: one sentence that names file, field and bound.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::Path;
use std::process::{Command, Output};

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (entry, name) = entry.map(|entry| (entry.path(), entry.file_name())).unwrap();
        if entry.is_dir() && name != "xtask" {
            copy(&entry, &to.join(name));
        } else if entry.is_file() {
            std::fs::copy(&entry, to.join(name)).unwrap();
        }
    }
}

/// The shipped house, with `from` replaced by `to` in one of its files.
fn checked(file: &str, from: &str, to: &str) -> Output {
    let directory = tempfile::tempdir().unwrap();
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy"), directory.path());
    let path = directory.path().join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{file} has no `{from}`");
    std::fs::write(&path, text.replace(from, to)).unwrap();
    Command::new(env!("CARGO_BIN_EXE_sereno"))
        .arg("check")
        .arg("--deploy")
        .arg(directory.path())
        .output()
        .unwrap()
}

#[test]
fn the_shipped_house_holds_together_and_every_room_can_be_reached() {
    let output = checked("plans/demo.yaml", "negate: 0", "negate: 0");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("9 of 9 rooms can be reached from the pad"), "{said}");
}

#[test]
fn what_is_wrong_is_said_in_one_sentence() {
    let cases = [
        (
            "plans/demo.rooms.yaml",
            "pad: {x: 2.4",
            "pad: {x: 0.0",
            "plans/demo.rooms.yaml: pad (0, 2.2) is 0.00 m from",
        ),
        ("plans/demo.yaml", "resolution: 0.05", "resolution: 0", "`resolution` is 0, allowed is 0.01 to 0.5"),
        ("plans/demo.yaml", "image: demo.png", "image: none.png", "none.png: No such file or directory"),
        (
            "config/navigation.toml",
            "wait_s = 16.0",
            "wait_s = -3",
            "wait_s = -3 is out of range: allowed is 0..=60",
        ),
        ("system.toml", "'sonar/ranges'", "'sonar/rangez'", "no such topic; did you mean sonar/ranges"),
        (
            "vehicles/watchman.toml",
            "mass_kg = 1.1",
            "mass_kg = 900",
            "body.mass_kg = 900: allowed is 0.1 to 5",
        ),
    ];
    for (file, from, to, sentence) in cases {
        let output = checked(file, from, to);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{file}: {to}");
        assert!(said.contains(sentence), "{file}: {to}: {said}");
        assert!(said.matches("os error").count() <= 1, "said twice: {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    }
}
