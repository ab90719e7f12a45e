//! A drone that knows nothing finds itself.

use super::*;
use floorplan::{ConeModel, Plan};
use mcl::Echo;

/// Two rooms that are told apart by a niche, a door between them.
fn plan() -> Plan {
    Plan::from_ascii(
        &[
            "############################",
            "#             #            #",
            "#             #            #",
            "#             #          ###",
            "#             #            #",
            "#                          #",
            "#                          #",
            "#             #            #",
            "###           #            #",
            "#             #            #",
            "#             ###          #",
            "############################",
        ],
        0.3,
    )
}

fn sweep(table: &ConeTable, x: f32, y: f32, heading: f32) -> Vec<Reading> {
    (0..8)
        .map(|k| {
            let bearing_rad = k as f32 * core::f32::consts::FRAC_PI_4;
            let range = table.range(x, y, heading + bearing_rad);
            let echo = if range.is_finite() { Echo::Range(range) } else { Echo::Nothing };
            Reading { echo, bearing_rad, elevation_rad: 0.0, mount_x: 0.0, mount_y: 0.0 }
        })
        .collect()
}

fn look(within: Option<usize>) -> (Option<Found>, (f32, f32, f32)) {
    let plan = Arc::new(plan());
    let table = ConeTable::new(Arc::clone(&plan), ConeModel::default()).unwrap();
    let lattice = Arc::new(Lattice::new(&plan, 0.25));
    let rooms = Arc::new(Rooms::segment(&plan));
    let (x0, y0) = plan.origin();
    let (x0, y0, turn) = (x0 + 1.5, y0 + 1.2, 2.0f32);
    let room = within.map(|other| {
        let here = rooms.room_at(x0, y0).unwrap();
        (Arc::clone(&rooms), (here + other) % rooms.len())
    });
    let mut seek = Seek::new(lattice, &SonarConfig::default(), room);
    seek.begin(Why::Start, 0.0);
    let mut truth = (x0, y0, turn);
    for step in 0..60u64 {
        // In its own frame it flies along x and turns to and fro.
        let here = TrailPose { x: 0.02 * step as f32, y: 0.0, heading_rad: (step as f32 * 0.2).sin() };
        truth = (x0 + here.x * turn.cos(), y0 + here.x * turn.sin(), turn);
        seek.hear(1, &here, &sweep(&table, truth.0, truth.1, here.heading_rad + turn), 0);
        for slice in 0..40 {
            let now = (step * 40 + slice) * 5_000_000;
            if let (_, Some(found)) = seek.work(&table, now, &here, None) {
                return (Some(found), truth);
            }
        }
    }
    (None, truth)
}

#[test]
fn a_drone_that_knows_nothing_is_found_and_the_frame_is_turned_back() {
    let (found, (x, y, turn)) = look(None);
    let found = found.unwrap();
    assert!((found.x - x).hypot(found.y - y) < 0.15, "{found:?} {x} {y}");
    assert!(wrap_angle(found.turn_rad - turn).abs() < 0.1 && found.doubt <= 0.05, "{found:?}");
    // Told the right room it finds the same place.
    let (in_room, _) = look(Some(0));
    assert!((in_room.unwrap().x - x).abs() < 0.3);
}

#[test]
fn who_hears_one_side_only_or_nothing_new_does_not_search() {
    let plan = Arc::new(plan());
    let table = ConeTable::new(Arc::clone(&plan), ConeModel::default()).unwrap();
    let mut seek = Seek::new(Arc::new(Lattice::new(&plan, 0.25)), &SonarConfig::default(), None);
    seek.begin(Why::Start, 0.0);
    let here = TrailPose::default();
    for _ in 0..100 {
        seek.hear(1, &here, &sweep(&table, 1.5, 1.2, 0.0)[..2], 0);
        assert_eq!(seek.work(&table, 1, &here, None), (false, None));
    }
    assert_eq!(seek.share(), 0.0);
}

/// What audits say of a place that is believed `off_m` beside the true one: whether it becomes suspected, and how far the
/// search took it from where it was believed.
fn audited(off_m: f32) -> (bool, f32) {
    let plan = Arc::new(plan());
    let table = ConeTable::new(Arc::clone(&plan), ConeModel::default()).unwrap();
    let mut seek = Seek::new(Arc::new(Lattice::new(&plan, 0.25)), &SonarConfig::default(), None);
    seek.begin(Why::Audit, 0.0);
    let (x0, y0) = plan.origin();
    let mut strayed = 0.0f32;
    for step in 0..400u64 {
        let now = step * 50_000_000;
        let (x, y) = (x0 + 1.5 + 0.005 * step as f32, y0 + 1.2);
        // The frame of an audit is the believed one.
        let here = TrailPose { x: x + off_m, y, heading_rad: (step as f32 * 0.05).sin() };
        seek.hear(now, &here, &sweep(&table, x, y, here.heading_rad), 0);
        let (ended, _) = seek.work(&table, now, &here, Some((here.x, here.y, 0.0)));
        if ended && let Some(of) = seek.search.suspect() {
            let (sx, sy, _) = carried(of, &seek.search.origin(), &here);
            strayed = strayed.max((sx - here.x).hypot(sy - here.y));
        }
        if seek.is_refuted() {
            return (true, strayed);
        }
    }
    (false, strayed)
}

#[test]
fn an_audit_suspects_a_place_that_is_off_and_weighs_it_where_it_is() {
    assert!(!audited(0.0).0);
    let (suspected, strayed) = audited(0.9);
    assert!(suspected && strayed < 0.3, "{strayed}");
}
