//! The examples in Python do what they say, over mutual TLS, with zenoh's own package from PyPI.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

#[path = "bridge/system.rs"]
#[allow(dead_code, reason = "the tests of the bridge need more of it")]
mod system;

use sereno_tests::checkout;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use system::{System, Way, free_endpoint};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A Python with zenoh. Without network, or without the system's `venv`, the test fails in a sentence.
fn python(directory: &Path, examples: &Path) -> PathBuf {
    let place = directory.join("venv");
    let made = Command::new("python3").args(["-m", "venv"]).arg(&place).output();
    let made = made.unwrap_or_else(|error| panic!("python3 is needed for the examples: {error}"));
    assert!(made.status.success(), "python3-venv is needed for the examples: {}", text(&made.stdout));
    let python = place.join("bin/python");
    let requirements = examples.join("requirements.txt");
    let installed = Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(requirements)
        .output()
        .unwrap();
    assert!(
        installed.status.success(),
        "pip cannot install eclipse-zenoh, PyPI must be reached for this test: {}",
        text(&installed.stderr)
    );
    python
}

#[test]
fn the_examples_follow_the_pose_save_a_picture_and_start_a_round() {
    let examples = checkout().join("deploy/examples");
    let directory = tempfile::tempdir().unwrap();
    let python = python(directory.path(), &examples);
    let endpoint = free_endpoint();
    let system = System::start(Way::Direct, &endpoint);
    system.wait_bridge(&endpoint);
    let run = |example: &str, client: &str, more: &str| -> Output {
        let config = system.authority.client_config(client);
        let mut command = Command::new(&python);
        command.arg(examples.join(example)).arg(config).arg(more).env("PYTHONDONTWRITEBYTECODE", "1");
        command.current_dir(directory.path()).output().unwrap()
    };

    let followed = run("follow_pose.py", "viewer", "5");
    let said = text(&followed.stdout);
    assert!(followed.status.success(), "{}", text(&followed.stderr));
    assert_eq!(said.lines().filter(|line| line.starts_with("sereno-1: x ")).count(), 5, "{said}");

    let saved = run("save_picture.py", "viewer", "seen.jpg");
    assert!(saved.status.success(), "{}", text(&saved.stderr));
    let said = text(&saved.stdout);
    assert!(said.starts_with("sereno-1: 640x480, ") && said.trim().ends_with("s old: seen.jpg"), "{said}");
    let file = std::fs::read(directory.path().join("seen.jpg")).unwrap();
    let picture = image::load_from_memory_with_format(&file, image::ImageFormat::Jpeg).unwrap().to_luma8();
    assert_eq!(picture.dimensions(), (640, 480));
    let (least, most) =
        picture.pixels().fold((255, 0), |(least, most), pixel| (pixel.0[0].min(least), pixel.0[0].max(most)));
    assert!(most - least > 60, "a room, not a grey wall: {least} to {most}");

    let refused = run("start_round.py", "viewer", "1");
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("refused: a viewer may not order"), "{}", text(&refused.stderr));

    // The pilot may still wait for its controller.
    let mut round = None;
    system::wait_until("the round is accepted", || {
        let output = run("start_round.py", "guard", "5");
        let accepted = output.status.success();
        round = Some(output);
        accepted
    });
    let said = text(&round.unwrap().stdout);
    assert!(said.starts_with("accepted: ") && said.contains("% seen"), "{said}");

    let stranger = run("follow_pose.py", "revoked", "1");
    assert_eq!(stranger.status.code(), Some(1));
    assert!(
        text(&stranger.stderr).contains("none that knows this certificate"),
        "{}",
        text(&stranger.stderr)
    );
}
