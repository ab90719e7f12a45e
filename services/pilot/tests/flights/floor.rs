//! Landings whose place nobody chose: not on tables.

use crate::rig::Rig;
use control::Vector;
use ipc_types::{LocalizationState, Phase, SetpointKind, Verb};

const NAN: Vector = Vector { x: f32::NAN, y: f32::NAN };
const TABLE_M: f32 = 0.75;
/// Radius of the rig's disc, metres.
const RADIUS_M: f32 = 0.225;

/// Flies over a floor on which a table begins at `edge`, until `done` or for so many seconds.
fn fly(rig: &mut Rig, edge: f32, seconds: f32, done: impl Fn(&Rig) -> bool) -> bool {
    (0..(seconds * 50.0) as usize).any(|_| {
        rig.surface = if rig.place.x > edge { TABLE_M } else { 0.0 };
        rig.step();
        done(rig)
    })
}

/// Above a table, two metres of floor behind it; and where the table begins.
fn above_a_table(seed: u64) -> (Rig, f32) {
    let mut rig = Rig::new(seed);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.3, 0.0), NAN);
    rig.order(Verb::PatrolStart);
    let edge = rig.place.x + 1.6;
    assert!(fly(&mut rig, edge, 40.0, |rig| rig.place.x > edge + 0.3), "{:?}", rig.place);
    (rig, edge)
}

#[test]
fn who_is_lost_above_a_table_lands_beside_it() {
    for seed in 1..=4 {
        let (mut rig, edge) = above_a_table(seed);
        rig.pose_state = LocalizationState::Lost;
        assert!(fly(&mut rig, edge, 25.0, |rig| rig.phase() == Phase::EmergencyLanding), "seed {seed}");
        let least = |rig: &Rig| rig.phase() == Phase::Grounded || rig.height < TABLE_M + 0.1;
        assert!(fly(&mut rig, edge, 15.0, least), "seed {seed}: {} m", rig.height);
        assert!(
            rig.place.x < edge - RADIUS_M,
            "seed {seed}: the rim is over the table, {:?}",
            rig.place.x - edge
        );
        assert!(fly(&mut rig, edge, 8.0, |rig| rig.phase() == Phase::Grounded), "seed {seed}");
        assert!(rig.surface == 0.0 && rig.touched_at > -0.5, "seed {seed}: {} m/s", rig.touched_at);
    }
}

#[test]
fn the_operators_land_above_a_table_goes_back_to_the_floor_and_above_floor_stays() {
    let (mut rig, edge) = above_a_table(5);
    rig.order(Verb::Land);
    assert!(fly(&mut rig, edge, 20.0, |rig| rig.phase() == Phase::Grounded), "{} m", rig.height);
    assert!(rig.place.x < edge - RADIUS_M, "{:?}", rig.place.x - edge);

    let mut rig = Rig::new(5);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.3, 0.0), NAN);
    rig.order(Verb::PatrolStart);
    rig.run(9.0);
    let from = rig.place;
    rig.order(Verb::Land);
    rig.until_grounded(12.0);
    assert!((rig.place - from).norm() < 0.35, "{:?}", rig.place - from);
}

#[test]
fn a_pilot_that_forgot_the_way_lands_where_it_is() {
    let (mut rig, edge) = above_a_table(6);
    rig.pose_state = LocalizationState::Lost;
    assert!(fly(&mut rig, edge, 25.0, |rig| rig.phase() == Phase::EmergencyLanding));
    rig.restart(40);
    let from = rig.place;
    assert!(fly(&mut rig, edge, 12.0, |rig| rig.phase() == Phase::Grounded), "{} m", rig.height);
    assert!((rig.place - from).norm() < 0.5, "{:?}", rig.place - from);
}

#[test]
fn who_is_low_above_the_floor_is_not_sent_up_again() {
    let mut rig = Rig::new(7);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.3, 0.0), NAN);
    rig.order(Verb::PatrolStart);
    rig.run(9.0);
    // Nothing behind it was seen: from cruising height it would go back a little.
    let pad = rig.place + Vector::new(0.4, 0.0);
    rig.navigate(SetpointKind::Land, Vector::ZERO, pad);
    assert!(fly(&mut rig, f32::MAX, 12.0, |rig| rig.height < 0.9));
    rig.cell_volts = 3.2;
    assert!(fly(&mut rig, f32::MAX, 4.0, |rig| rig.phase() == Phase::EmergencyLanding));
    let from = rig.height;
    assert!((0.2..0.6).contains(&from), "{from} m");
    let up = |rig: &Rig| rig.height > from + 0.15 || rig.phase() == Phase::Grounded;
    assert!(fly(&mut rig, f32::MAX, 8.0, up) && rig.phase() == Phase::Grounded, "{} m", rig.height);
}
