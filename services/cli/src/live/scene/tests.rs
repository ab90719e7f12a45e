use super::*;
use serde_json::json;

fn at() -> Timestamp {
    timestamp(1_800_000_000_250_000_000)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

fn cones(readings: &Value) -> (Vec<SceneEntity>, Option<f64>) {
    let (update, height_m) = sonar(&json!({ "count": 2, "readings": readings }), at()).expect("ranges");
    (update.entities, height_m)
}

fn reading(sensor: u8, status: u8, bearing_rad: f64, elevation_rad: f64) -> Value {
    json!({ "sensor": sensor, "status": status, "range_m": 2.0, "bearing_rad": bearing_rad, "elevation_rad": elevation_rad,
        "mount_x_m": 0.1, "mount_y_m": 0.0, "mount_z_m": -0.05 })
}

#[test]
fn a_time_is_seconds_and_nanoseconds() {
    assert_eq!((at().sec(), at().nsec()), (1_800_000_000, 250_000_000));
}

#[test]
fn a_place_that_is_none_is_not_shown() {
    let mut pose =
        json!({ "x_m": 1.0, "y_m": 2.0, "heading_rad": 0.5, "heading_offset_rad": 0.2, "searching": 0 });
    let place = Place::of(&pose, 0.8).expect("a pose").expect("a place");
    assert!(near(place.compass_rad, 0.3) && near(place.z_m, 0.8));
    let shown = pose_in_frame(&place, at()).pose.expect("a pose");
    let turn = shown.orientation.expect("a turn");
    assert!(near(2.0 * turn.z.atan2(turn.w), 0.5));
    pose["searching"] = json!(1);
    assert_eq!(Place::of(&pose, 0.8), Ok(None), "in a frame of its own");
    let nowhere = json!({ "searching": 0, "x_m": null, "y_m": 1.0, "heading_rad": 0.0 });
    assert_eq!(Place::of(&nowhere, 0.8), Err("x_m is no number"));
    assert_eq!(Place::of(&json!("junk"), 0.8), Err("searching is no whole number"));
}

#[test]
fn an_ellipse_lies_along_what_is_least_known() {
    let place = Place { x_m: 3.0, y_m: 4.0, z_m: 0.0, heading_rad: 1.0, compass_rad: 0.0 };
    // Standard deviations of 0.5 m along the diagonal and 0.1 m across it.
    let message = json!({ "variance_x_m2": 0.13, "variance_y_m2": 0.13, "covariance_xy_m2": 0.12 });
    let ring = uncertainty(&message, &place, at()).expect("an ellipse");
    let points = &ring.entities[0].lines[0].points;
    let along = |point: &Point3| ((point.x - 3.0) + (point.y - 4.0)).abs() / 2f64.sqrt();
    let across = |point: &Point3| ((point.x - 3.0) - (point.y - 4.0)).abs() / 2f64.sqrt();
    let most = |of: &dyn Fn(&Point3) -> f64| points.iter().map(of).fold(0.0, f64::max);
    assert!(near(most(&along), 1.0) && near(most(&across), 0.2), "{} {}", most(&along), most(&across));
    assert!(uncertainty(&json!({ "variance_x_m2": null }), &place, at()).is_err());
}

#[test]
fn particles_are_as_many_as_their_weights_deserve() {
    let mut set = bytemuck::allocation::zeroed_box::<Particles>();
    set.count = 4000;
    for k in 0..4000 {
        set.x_m[k] = if k < 400 { 1.0 } else { 2.0 };
        set.weight[k] = if k < 400 { 0.75 / 400.0 } else { 0.25 / 3600.0 };
    }
    set.heading_offset_rad[0] = 0.1;
    let shown = particles(&set, 0.4, at()).poses;
    assert_eq!(shown.len(), 1000);
    let first = shown.iter().filter(|pose| pose.position.is_some_and(|place| place.x < 1.5)).count();
    assert!((748..=752).contains(&first), "{first}");
    let turn = shown[0].orientation.expect("a turn");
    assert!((2.0 * turn.z.atan2(turn.w) - 0.5).abs() < 1e-6);
    set.weight.fill(f32::NAN);
    assert!(particles(&set, 0.0, at()).poses.is_empty(), "weights that are none");
    set.count = 0;
    assert!(particles(&set, 0.0, at()).poses.is_empty());
}

#[test]
fn a_cone_lies_where_its_sensor_looks() {
    let ok = SonarStatus::Ok.code();
    let left = std::f64::consts::FRAC_PI_2;
    let (shown, height_m) = cones(&json!([reading(2, ok, left, 0.0), reading(8, ok, 0.0, -left)]));
    assert!(near(height_m.expect("one looks down"), 2.05), "{height_m:?}");
    assert_eq!(shown.iter().map(|cone| cone.id.as_str()).collect::<Vec<_>>(), ["sonar 2", "sonar 8"]);
    for (cone, axis) in shown.iter().zip([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]) {
        assert_eq!(cone.frame_id, DRONE);
        for corner in
            cone.triangles[0].points.iter().filter(|corner| !near(corner.x, 0.1) || !near(corner.z, -0.05))
        {
            let ray = [corner.x - 0.1, corner.y, corner.z + 0.05];
            let length = ray.iter().map(|part| part * part).sum::<f64>().sqrt();
            let along: f64 = ray.iter().zip(axis).map(|(part, axis)| part * axis).sum();
            assert!(near(length, 2.0) && along > 2.0 * HALF_CONE.cos() - 1e-6, "{ray:?} along {axis:?}");
        }
    }
    let fault = SonarStatus::Fault.code();
    let (shown, height_m) = cones(&json!([reading(0, fault, 0.0, 0.0), { "status": ok, "range_m": null }]));
    assert!(shown.is_empty() && height_m.is_none());
    for (junk, reason) in [
        (json!({ "count": 1 }), "readings is no list"),
        (json!({ "count": -1, "readings": [] }), "count is no whole number"),
        (json!([]), "readings is no list"),
    ] {
        assert_eq!(sonar(&junk, at()).err(), Some(reason), "{junk}");
    }
    let (shown, _) = sonar(&json!({ "count": u64::MAX, "readings": [1, null, {}] }), at()).expect("ranges");
    assert!(shown.entities.is_empty(), "no reading among these");
}

#[test]
fn a_round_is_what_was_flown_and_what_is_ahead() {
    let message = json!({ "next": 1, "waypoints": [{ "x_m": 0.0, "y_m": 0.0 }, { "x_m": 1.0, "y_m": 0.0 }, { "x_m": 1.0, "y_m": 2.0 }] });
    let lines = route(&message, at()).expect("a round").entities.remove(0).lines;
    assert_eq!(lines.iter().map(|line| line.points.len()).collect::<Vec<_>>(), [2, 2]);
    assert!(near(lines[1].points[1].y, 2.0));
    let none = route(&json!({ "waypoints": [] }), at()).expect("a round");
    assert!(none.entities[0].lines.is_empty(), "and an old one goes away");
    assert_eq!(route(&json!({ "waypoints": 7 }), at()).err(), Some("waypoints is no list"));
}

#[test]
fn a_plan_stands_on_its_lower_left_corner() {
    let drawn = Plan::from_ascii(&["##?", "#.."], 0.5);
    let shown = plan(&drawn, at());
    assert_eq!((shown.column_count, shown.data.as_ref()), (3, &[255, 0, 0, 255, 255, 128][..]));
}

#[test]
fn a_picture_that_ends_early_is_none() {
    let mut unit = bytemuck::allocation::zeroed_box::<Video>();
    unit.length = 3;
    unit.bytes.as_mut_slice()[..3].copy_from_slice(&[0, 0, 1]);
    let whole = std::mem::offset_of!(Video, bytes) + 3;
    assert_eq!(video(&unit, whole, at()).map(|shown| shown.data.to_vec()), Some(vec![0, 0, 1]));
    assert!(video(&unit, whole - 1, at()).is_none());
    unit.length = u32::MAX;
    assert!(video(&unit, whole, at()).is_none());
}
