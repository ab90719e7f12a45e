//! What the thrust does that nobody commanded: others fly, cells die, nothing is heard.

use crate::rig::Rig;
use ipc_types::{Ladder, Phase, SonarHealth, Verb};

#[test]
fn while_others_fly_nothing_is_learned() {
    for (seed, more_us) in [(1, 12.0), (2, -6.0)] {
        let mut rig = Rig::new(seed);
        rig.take_off();
        rig.run(4.0);
        let hover = rig.channels.hover_throttle_us;
        let learned = (rig.state.disturbance_x_m_s2, rig.state.disturbance_y_m_s2);
        // The line is silent, the controller's failsafe throttle is not quite that of a hover.
        rig.ladder = Ladder::Descend;
        rig.run(0.2);
        rig.other_us = Some(rig.hover_us + more_us);
        rig.run(1.2);
        let after = rig.channels.hover_throttle_us;
        assert!((after - hover).abs() < 3.0, "learned {hover} to {after} from what others flew");
        let now = (rig.state.disturbance_x_m_s2, rig.state.disturbance_y_m_s2);
        assert!((now.0 - learned.0).hypot(now.1 - learned.1) < 0.02, "{learned:?} {now:?}");
        rig.other_us = None;
        rig.ladder = Ladder::Following;
        let mut fastest = 0.0f32;
        for _ in 0..150 {
            rig.step();
            fastest = fastest.min(rig.climb);
        }
        assert!(fastest > -0.75, "seed {seed}: sinks at {fastest}");
        assert!((rig.height - 1.2).abs() < 0.15, "seed {seed}: {}", rig.height);
    }
}

#[test]
fn a_cell_that_dies_is_felt_and_it_lands_softly() {
    for seed in 0..4 {
        let mut rig = Rig::new(seed);
        rig.tells_force = true;
        // The accelerometer's scale is 3 % off.
        rig.one_g = 9.81 * if seed % 2 == 0 { 1.03 } else { 0.97 };
        rig.take_off();
        rig.run(4.0);
        assert!((rig.height - 1.2).abs() < 0.1, "seed {seed}: {}", rig.height);
        rig.thrust = 0.56;
        let mut lowest = f32::INFINITY;
        for _ in 0..150 {
            rig.step();
            lowest = lowest.min(rig.height);
        }
        assert!(lowest > 0.7, "seed {seed}: fell to {lowest}");
        rig.order(Verb::Land);
        rig.until_grounded(12.0);
        assert!(rig.touched_at > -0.5, "seed {seed}: {}", rig.touched_at);
    }
}

#[test]
fn blind_and_wrong_about_the_climb_the_motors_run_to_the_ground() {
    for seed in 0..4 {
        let mut rig = Rig::new(seed);
        rig.take_off();
        rig.run(4.0);
        rig.down_health = SonarHealth::Silent;
        // A little more thrust than was learned: 0.04 m/s2.
        rig.hover_us -= 1.0;
        rig.run(1.5);
        assert_eq!(rig.phase(), Phase::EmergencyLanding);
        rig.until_grounded(16.0);
        assert!(rig.touched_at > -0.7, "seed {seed}: {}", rig.touched_at);
    }
}
