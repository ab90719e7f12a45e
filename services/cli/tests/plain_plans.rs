//! Rehearsals on plans as map_server writes them, with no word on pads, doors or rooms.
#![allow(clippy::unwrap_used, reason = "tests")]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy")
}

/// The two rooms without their side file, in a directory of their own.
fn plain(directory: &Path) -> PathBuf {
    for file in ["two-rooms.yaml", "two-rooms.png"] {
        std::fs::copy(deploy().join("plans").join(file), directory.join(file)).unwrap();
    }
    directory.join("two-rooms.yaml")
}

fn rehearse(plan: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sereno"))
        .arg("--deploy")
        .arg(deploy())
        .args(["rehearse", "--clutter", "none", "--json", "--plan"])
        .arg(plan)
        .args(more)
        .output()
        .unwrap()
}

fn refusal(plan: &Path, more: &[&str]) -> String {
    let output = rehearse(plan, more);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    said
}

#[test]
fn a_plain_plan_is_flown_from_its_widest_place_or_from_where_it_is_told() {
    let directory = tempfile::tempdir().unwrap();
    let plan = plain(directory.path());
    for (more, remark) in [(&[][..], "the widest free place"), (&["--pad", "1.2,1.0,90"][..], "as ordered")] {
        let output = rehearse(&plan, more);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let flight = &report["flights"][0];
        // Simulator, localization and navigation mean the same pad: it comes back there and knows its place.
        assert_eq!(flight["outcome"], "landed_on_pad", "{report}");
        assert!(flight["coverage"].as_f64().unwrap() > 0.9, "{report}");
        assert!(flight["loc_error_m"]["p95"].as_f64().unwrap() < 0.3, "{report}");
        let remarks = report["remarks"].to_string();
        assert!(remarks.contains(remark), "{remarks}");
        assert!(remarks.contains("no doors are known"), "{remarks}");
    }
}

#[test]
fn the_figures_go_to_the_file_and_the_table_to_people() {
    let directory = tempfile::tempdir().unwrap();
    let plan = plain(directory.path());
    let out = directory.path().join("figures.json");
    // JSON in a file is the last argument of the contract's line.
    let output = rehearse(&plan, &[out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    assert_eq!(report["total"]["flights"], 1);
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("1 flights:") && table.contains("no doors are known"), "{table}");
    assert!(!table.contains('{'), "{table}");
}

#[test]
fn a_pad_that_cannot_be_is_refused_in_one_sentence() {
    let directory = tempfile::tempdir().unwrap();
    let plan = plain(directory.path());
    let wall = refusal(&plan, &["--pad", "0.02,1.0,0"]);
    assert!(wall.contains("the pad at (0.02, 1.00) is inside a wall"), "{wall}");
    let tight = refusal(&plan, &["--pad", "0.3,1.0,0"]);
    assert!(tight.contains("from a wall, needed is 0.22 m"), "{tight}");
    let outside = refusal(&plan, &["--pad", "-90,1.0,0"]);
    assert!(outside.contains("outside the plan"), "{outside}");
    // The side file names one pad, the world file another one: the drone would be lost from the start.
    let world = directory.path().join("world.toml");
    std::fs::write(&world, "pad = { x_m = 1.5, y_m = 1.5 }\n").unwrap();
    let world = world.to_str().unwrap();
    let two = refusal(&deploy().join("plans/two-rooms.yaml"), &["--world", world]);
    assert!(
        two.contains("world.toml: pad is at (1.5, 1.5)") && two.contains("name it in one of the two"),
        "{two}"
    );
}
