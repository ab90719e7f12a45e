//! The front page says what is so.
#![allow(clippy::unwrap_used, reason = "tests")]

use manifest::Manifest;
use sereno_tests::checkout;

fn read(path: &str) -> String {
    std::fs::read_to_string(checkout().join(path)).unwrap()
}

#[test]
fn the_diagram_is_the_wiring_of_the_manifest() {
    let readme = read("README.md");
    let marker = "<!-- graph: checked by tests/tests/readme.rs -->\n```mermaid\n";
    let (_, after) = readme.split_once(marker).expect("README.md has lost the marker before its diagram");
    let (shown, _) = after.split_once("```\n").expect("README.md's diagram does not end");
    let wiring = Manifest::parse("system.toml", &read("deploy/system.toml")).unwrap().graph();
    assert_eq!(shown, wiring, "put what `sereno graph` prints into README.md");
}

#[test]
fn the_two_commands_stand_on_the_front_page_and_exist() {
    let readme = read("README.md");
    let tasks = read("deploy/xtask/src/main.rs");
    for (command, variant) in [("cargo xtask demo", "Task::Demo"), ("cargo xtask test", "Task::Test")] {
        assert!(readme.lines().any(|line| line.starts_with(command)), "README.md does not say {command}");
        assert!(tasks.contains(variant), "{command} is no task");
    }
    assert!(read(".cargo/config.toml").contains("xtask = "), "`cargo xtask` is no alias");
}

#[test]
fn what_the_front_page_points_at_is_there() {
    let readme = read("README.md");
    let mut looked = 0;
    for part in readme.split("](").skip(1) {
        let (target, _) = part.split_once(')').unwrap();
        if !target.contains("://") {
            assert!(checkout().join(target).exists(), "README.md points at {target}, which is missing");
            looked += 1;
        }
    }
    assert!(looked >= 3);
}
