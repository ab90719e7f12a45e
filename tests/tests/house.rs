//! The rules of the house (DESIGN 2), over what cargo says of the workspace.
#![allow(clippy::unwrap_used, reason = "tests")]

use cargo_metadata::{DependencyKind, MetadataCommand};
use sereno_tests::checkout;
use std::collections::{BTreeMap, BTreeSet};

/// Crates of the house with what they depend on (without development dependencies), and where they live.
fn house() -> BTreeMap<String, (String, BTreeSet<String>)> {
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    let root = metadata.workspace_root.clone();
    metadata
        .packages
        .iter()
        .map(|package| {
            let place = package.manifest_path.parent().unwrap().strip_prefix(&root).unwrap().to_string();
            let needs = package
                .dependencies
                .iter()
                .filter(|dependency| dependency.kind == DependencyKind::Normal)
                .map(|dependency| dependency.name.clone())
                .collect();
            (package.name.to_string(), (place, needs))
        })
        .collect()
}

const LIBRARIES: [&str; 8] =
    ["floorplan", "mcl", "avoid", "patrol", "control", "msp", "manifest", "airframe"];
const SERVICES: [&str; 10] = [
    "sonar",
    "flow",
    "flight",
    "localization",
    "navigation",
    "pilot",
    "simulator",
    "camera",
    "console",
    "stream",
];
/// Who speaks to what is off the board.
const ZENOH: [&str; 4] = ["bridge", "console", "cli", "sereno-tests"];
/// Who has an async runtime of its own.
const TOKIO: [&str; 3] = ["console", "sereno-tests", "stream"];

#[test]
fn libraries_see_each_other_and_pure_crates_only() {
    let pure: BTreeSet<&str> = [
        "bytemuck",
        "nalgebra",
        "rand",
        "image",
        "serde",
        "serde-saphyr",
        "toml",
        "pathfinding",
        "thiserror",
    ]
    .into();
    let house = house();
    for library in LIBRARIES {
        let (place, needs) = &house[library];
        assert_eq!(place, &format!("services/lib/{library}"));
        for need in needs {
            assert!(
                pure.contains(need.as_str()) || LIBRARIES.contains(&need.as_str()),
                "{library} must not depend on {need}"
            );
        }
    }
}

#[test]
fn only_the_simulator_the_command_line_and_tests_see_the_airframe() {
    for (name, (_, needs)) in house() {
        if needs.contains("airframe") {
            assert!(
                ["simulator", "cli", "sereno-tests"].contains(&name.as_str()),
                "{name} sees the airframe"
            );
        }
    }
}

#[test]
fn the_simulator_and_the_filter_share_no_model() {
    let house = house();
    assert!(!house["airframe"].1.contains("mcl"));
    assert!(!house["mcl"].1.contains("airframe"));
    // The plan's casting belongs to the filter; the simulated world has its own.
    let sources = checkout().join("services/lib/airframe/src");
    let mut waiting = vec![sources];
    let mut looked = 0;
    while let Some(place) = waiting.pop() {
        for entry in std::fs::read_dir(&place).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let text = std::fs::read_to_string(&path).unwrap();
                // The bare words: neither a `use` nor a method call may hide one.
                for word in ["cast_ray", "cast_cone", "ConeTable", "DistanceField"] {
                    assert!(!text.contains(word), "{} uses {word}", path.display());
                }
                looked += 1;
            }
        }
    }
    assert!(looked > 10);
}

#[test]
fn shells_keep_to_their_family() {
    let allowed: BTreeMap<&str, &[&str]> = [
        ("sonar", &[][..]),
        ("flow", &["serialport", "rustix"][..]),
        ("flight", &["serialport", "rustix"][..]),
        ("localization", &[][..]),
        ("navigation", &[][..]),
        ("pilot", &[][..]),
        ("simulator", &["rustix"][..]),
        ("camera", &["image", "openh264", "openh264-sys2"][..]),
        ("stream", &["async-trait", "bytes", "rtc", "serde_json", "tokio", "webrtc"][..]),
        (
            "console",
            &[
                "argon2",
                "axum",
                "futures-util",
                "getrandom",
                "hyper",
                "hyper-util",
                "image",
                "qrcode",
                "ring",
                "rusqlite",
                "rustix",
                "rustls",
                "sd-notify",
                "serde_json",
                "shiguredo_mp4",
                "tokio",
                "tokio-rustls",
                "tracing",
                "tracing-subscriber",
                "zenoh",
            ][..],
        ),
    ]
    .into();
    let house = house();
    for service in SERVICES {
        let (place, needs) = &house[service];
        assert_eq!(place, &format!("services/{service}"));
        for need in needs {
            let common = ["ipc-types", "runtime", "serde", "thiserror", "toml"].contains(&need.as_str());
            let library = LIBRARIES.contains(&need.as_str());
            assert!(
                common || library || allowed[service].contains(&need.as_str()),
                "{service} must not depend on {need}"
            );
        }
    }
}

#[test]
fn one_crate_knows_iceoryx2_and_the_words_know_nobody() {
    let house = house();
    for (name, (_, needs)) in &house {
        assert_eq!(needs.contains("iceoryx2"), name == "runtime", "{name}");
        assert!(!needs.contains("zenoh") || ZENOH.contains(&name.as_str()), "{name} knows zenoh");
        assert!(!needs.contains("tokio") || TOKIO.contains(&name.as_str()), "{name} has an async runtime");
    }
    assert_eq!(house["ipc-types"].1, BTreeSet::from(["bytemuck".to_owned()]));
    for service in SERVICES {
        assert!(!house["supervisor"].1.contains(service), "the supervisor depends on no service");
    }
}

#[test]
fn the_top_level_is_as_designed() {
    let beside = [
        ".cargo",
        ".ci",
        ".git",
        ".gitignore",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "Cargo.lock",
        "LICENSE-APACHE",
        "LICENSE-MIT",
        "clippy.toml",
        "deny.toml",
        "docs",
        "rustfmt.toml",
        "target",
        "flight.svg",
    ];
    let rooms =
        ["Cargo.toml", "README.md", "bridge", "deploy", "ipc-types", "services", "supervisor", "tests"];
    let found: BTreeSet<String> = std::fs::read_dir(checkout())
        .unwrap()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    for name in &found {
        assert!(rooms.contains(&name.as_str()) || beside.contains(&name.as_str()), "{name} has no room");
    }
    for room in rooms {
        assert!(found.contains(room), "{room} is missing");
    }
}
