//! Vehicle files: what is read and what is refused, with which words.
#![allow(clippy::unwrap_used, reason = "tests")]

use manifest::Vehicle;
use std::f32::consts::{FRAC_PI_2, PI};

const GOOD: &str = r#"
name = "test"
[body]
radius_m = 0.225
height_m = 0.2
mass_kg = 1.1
[motors]
max_thrust_n = 5.5
[battery]
cells = 4
capacity_mah = 3000
resistance_ohm = 0.04
[limits]
cruise_m_s = 0.5
max_tilt_deg = 10
climb_m_s = 0.4
descend_m_s = 0.3
[flow]
rate_hz = 25
yaw_deg = 90
[[sonar]]
name = "front"
bearing_deg = 0
x_m = 0.1
group = 0
[[sonar]]
name = "left"
bearing_deg = 90
group = 1
[[sonar]]
name = "back"
bearing_deg = 180
group = 0
[[sonar]]
name = "down"
bearing_deg = 0
elevation_deg = -90
group = 2
"#;

fn refusal(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    Vehicle::parse("v.toml", &GOOD.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn degrees_become_radians_and_defaults_are_filled() {
    let v = Vehicle::parse("v.toml", GOOD).unwrap();
    assert!((v.sonars[2].bearing_rad - PI).abs() < 1e-6);
    assert!((v.sonars[3].elevation_rad + FRAC_PI_2).abs() < 1e-6);
    assert!((v.limits.max_tilt_rad - 10f32.to_radians()).abs() < 1e-6);
    assert!((v.flow.unwrap().yaw_rad - FRAC_PI_2).abs() < 1e-6);
    assert_eq!(v.down_sonar(), Some(3));
    assert_eq!((v.sonars[0].min_range_m, v.sonars[0].max_range_m), (0.02, 4.0));
    assert!((v.hover_fraction() - 1.1 * 9.80665 / 22.0).abs() < 1e-6);
    let front = v.sonars[0].axis();
    let left = v.sonars[1].axis();
    assert!((front[0] - 1.0).abs() < 1e-6 && (left[1] - 1.0).abs() < 1e-6, "bearing is counter-clockwise");
    assert_eq!(v.limits.height_m, None, "the configurations decide");
    let low = GOOD.replace("descend_m_s = 0.3", "descend_m_s = 0.3\nheight_m = 0.8");
    assert_eq!(Vehicle::parse("v.toml", &low).unwrap().limits.height_m, Some(0.8));
    let sonar_alone = GOOD.replace("[flow]\nrate_hz = 25\nyaw_deg = 90\n", "");
    assert_eq!(Vehicle::parse("v.toml", &sonar_alone).unwrap().flow, None);
}

#[test]
fn a_vehicle_without_a_down_sonar_is_refused() {
    assert!(refusal("elevation_deg = -90", "elevation_deg = 40").contains("no sonar looks down"));
}

#[test]
fn two_sonars_on_one_direction_are_refused() {
    let said = refusal("bearing_deg = 90", "bearing_deg = 357");
    assert_eq!(
        said,
        "v.toml: sonars front and left look in one direction (3 degrees apart): allowed is 5 degrees or more"
    );
    Vehicle::parse("v.toml", &GOOD.replacen("bearing_deg = 90", "bearing_deg = 350", 1)).unwrap();
    // Two that look down differ in bearing only: still one direction.
    let down = "[[sonar]]\nname = \"down2\"\nbearing_deg = 77\nelevation_deg = -88\ngroup = 3\n";
    let said = Vehicle::parse("v.toml", &format!("{GOOD}{down}")).unwrap_err().to_string();
    assert!(said.contains("sonars down and down2"), "{said}");
}

#[test]
fn absurd_values_are_refused_with_their_range() {
    for (from, to, says) in [
        ("mass_kg = 1.1", "mass_kg = 0", "body.mass_kg = 0: allowed is 0.1 to 5"),
        ("mass_kg = 1.1", "mass_kg = 1100", "body.mass_kg = 1100: allowed is 0.1 to 5"),
        ("mass_kg = 1.1", "mass_kg = nan", "body.mass_kg = NaN: allowed is 0.1 to 5"),
        ("mass_kg = 1.1", "mass_kg = 1.9", "four motors lift 1.18 times the weight: allowed is 1.5 or more"),
        ("radius_m = 0.225", "radius_m = -1", "body.radius_m = -1: allowed is 0.05 to 0.6"),
        ("cells = 4", "cells = 0", "battery.cells = 0: allowed is 1 to 8"),
        ("max_tilt_deg = 10", "max_tilt_deg = 80", "limits.max_tilt_deg = 80: allowed is 3 to 25"),
        ("descend_m_s = 0.3", "descend_m_s = inf", "limits.descend_m_s = inf: allowed is 0.1 to 0.7"),
        (
            "descend_m_s = 0.3",
            "descend_m_s = 0.3\nheight_m = 0.2",
            "limits.height_m = 0.2: allowed is 0.5 to 2.5",
        ),
        (
            "[limits]",
            "[camera]\nelevation_deg = 91\n[limits]",
            "camera.elevation_deg = 91: allowed is -90 to 90",
        ),
        (
            "[limits]",
            "[camera]\nfield_of_view_deg = 180\n[limits]",
            "field_of_view_deg = 180: allowed is 20 to 120",
        ),
        ("[limits]", "[camera]\nx_m = 1.0\n[limits]", "camera.x_m = 1: allowed is -0.225 to 0.225"),
        ("x_m = 0.1", "x_m = 1.0", "sonar front: x_m = 1: allowed is -0.225 to 0.225"),
        ("name = \"left\"", "name = \"front\"", "two sonars are called front"),
        ("mass_kg = 1.1", "weight = 1.1", "v.toml:6: unknown field `weight`"),
        ("mass_kg = 1.1\n", "\n", "missing field `mass_kg`"),
        ("cells = 4", "cells = -4", "v.toml:10: "),
    ] {
        let said = refusal(from, to);
        assert!(said.starts_with("v.toml:") && said.contains(says) && !said.contains('\n'), "{to}: {said}");
    }
    let few = GOOD.replacen("bearing_deg = 90", "bearing_deg = 90\nelevation_deg = 60", 1);
    let said = Vehicle::parse("v.toml", &few).unwrap_err().to_string();
    assert!(said.contains("2 sonars look around: at least 3"), "{said}");
}

proptest::proptest! {
    #[test]
    fn no_change_of_a_good_vehicle_panics(at in 0usize..700, text in "[ -~\n]{0,6}") {
        let mut broken = GOOD.to_owned();
        let at = at.min(broken.len());
        broken.insert_str(at, &text);
        let _ = Vehicle::parse("v.toml", &broken);
    }
}

#[test]
fn the_shipped_vehicles_can_be_flown() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../deploy/vehicles");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let vehicle =
            Vehicle::parse(path.to_str().unwrap(), &std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(path.file_stem().unwrap().to_str(), Some(vehicle.name.as_str()));
        assert!(vehicle.hover_fraction() < 0.6, "{}", vehicle.name);
        count += 1;
    }
    assert!(count >= 2, "{count}");
}

/// FACTS 7, with the thesis's clockwise angles (90 ahead) turned into ours.
#[test]
fn the_thesis_vehicle_is_the_one_of_the_thesis() {
    let text = include_str!("../../../../deploy/vehicles/thesis.toml");
    let v = Vehicle::parse("thesis.toml", text).unwrap();
    let around: Vec<f32> =
        v.sonars.iter().filter(|s| !s.looks_down()).map(|s| 90.0 - s.bearing_rad.to_degrees()).collect();
    assert_eq!(around.len(), 5);
    for (bearing, his) in around.iter().zip([0.0f32, 53.0, 90.0, 127.0, 180.0]) {
        assert!((bearing - his).abs() < 1e-3, "{around:?}");
    }
    assert_eq!(v.sonars[0].name, "left", "his 0 degrees are on the left");
    // One by one: no two share a group, the down sonar has its own.
    let mut groups: Vec<u32> = v.sonars.iter().map(|s| s.group).collect();
    groups.sort_unstable();
    groups.dedup();
    assert_eq!(groups.len(), 6);
    assert!(v.sonars.iter().all(|s| (s.min_range_m, s.max_range_m) == (0.05, 3.75)));
    assert!((v.limits.max_tilt_rad - 8f32.to_radians()).abs() < 1e-6);
    assert_eq!((v.limits.height_m, v.flow), (Some(0.8), None));
    assert!((4.0 * v.motors.max_thrust_n / 9.806_65 - 3.8).abs() < 0.02, "kilograms of thrust");
}

#[test]
fn names_can_be_shown() {
    assert!(
        refusal("name = \"front\"", "name = \"\"").contains("sonar.name = \"\": allowed is 1 to 32 bytes")
    );
    let said = refusal("name = \"front\"", r#"name = "a\nall is well""#);
    assert!(said.contains(r#"sonar.name = "a\nall is well""#) && !said.contains('\n'), "{said}");
    assert!(refusal("name = \"test\"", r#"name = "\u001b[2J""#).contains("name = \"\\u{1b}[2J\""));
    assert!(refusal("name = \"test\"", r#""a\nb" = 1"#).chars().all(|c| !c.is_control()));
}
