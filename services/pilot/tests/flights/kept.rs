//! What a failsafe has begun is ended by the ground, and whoever asks is told what a loss would end in.

use crate::rig::Rig;
use control::{Tilt, Vector};
use ipc_types::{ChannelSource, FailsafeAction, FailsafeCause, LocalizationState, Phase, SetpointKind, Verb};

fn with_navigation(rig: &mut Rig) {
    rig.navigate(SetpointKind::Velocity, Vector::new(0.2, 0.0), Vector { x: f32::NAN, y: f32::NAN });
}

#[test]
fn an_emergency_landing_is_not_called_back_by_the_place_found_nor_by_an_order_nor_by_a_restart() {
    let mut rig = Rig::new(2);
    rig.take_off();
    with_navigation(&mut rig);
    rig.run(5.0);
    rig.pose_state = LocalizationState::Lost;
    while rig.phase() != Phase::EmergencyLanding {
        rig.step();
        assert!(rig.now < 60_000_000_000, "{}", rig.core.sentence());
    }
    assert_eq!(rig.state.action, FailsafeAction::Descend.code());
    rig.pose_state = LocalizationState::Tracking;
    rig.run(0.8);
    assert_eq!(rig.state.causes, 0, "the place is known again");
    assert_eq!(
        (rig.state.action, rig.state.cause),
        (FailsafeAction::Land.code(), FailsafeCause::Lost.code())
    );
    assert_eq!(rig.channels.source, ChannelSource::Failsafe.code());
    let since_ns = rig.state.failsafe_since_ns;
    for verb in [Verb::Hold, Verb::PatrolStart, Verb::GoTo, Verb::TakeOff] {
        rig.order(verb);
        rig.step();
        assert_eq!(rig.phase(), Phase::EmergencyLanding, "{verb}");
    }
    rig.restart(100);
    rig.run(0.2);
    assert_eq!((rig.phase(), rig.state.cause), (Phase::EmergencyLanding, FailsafeCause::Lost.code()));
    assert_eq!((rig.state.action, rig.state.failsafe_since_ns), (FailsafeAction::Land.code(), since_ns));
    rig.until_grounded(12.0);
    assert_eq!(rig.core.sentence(), "landed: lost");
    assert_eq!(rig.state.action, FailsafeAction::None.code(), "the ground ends it");
}

#[test]
fn a_battery_that_recovers_on_the_way_home_goes_on_home() {
    let mut rig = Rig::new(4);
    rig.take_off();
    with_navigation(&mut rig);
    rig.run(1.0);
    rig.cell_volts = 3.45;
    rig.run(11.0);
    assert_eq!(rig.state.action, FailsafeAction::Return.code());
    rig.cell_volts = 3.7;
    rig.run(4.0);
    assert_eq!((rig.state.action, rig.state.causes), (FailsafeAction::Return.code(), 0));
    rig.restart(100);
    rig.run(0.2);
    assert_eq!((rig.phase(), rig.state.action), (Phase::Autonomous, FailsafeAction::Return.code()));
    rig.navigate(SetpointKind::Land, Vector::ZERO, rig.place);
    rig.until_grounded(12.0);
}

#[test]
fn a_cut_is_one_after_a_restart_too() {
    let mut rig = Rig::new(3);
    rig.take_off();
    rig.run(2.0);
    let mut attitude = ipc_types::Attitude { roll_rad: 1.2, sampled_ns: rig.now, ..Default::default() };
    // It lies on its side, as the controller sees it, between two of the rig's own attitudes.
    for _ in 0..30 {
        attitude.header.stamp_ns = rig.now;
        attitude.sampled_ns = rig.now;
        rig.sense();
        rig.core.attitude(&attitude);
        rig.core.step(rig.now);
        rig.core.write_channels(rig.now, &mut rig.channels);
        rig.core.write_state(&mut rig.state);
        rig.now += 20_000_000;
    }
    assert_eq!((rig.phase(), rig.channels.arm), (Phase::Cut, 0));
    assert_eq!((rig.state.action, rig.state.cause), (FailsafeAction::Cut.code(), FailsafeCause::Tilt.code()));
    (rig.height, rig.tilt) = (0.0, Tilt::default());
    rig.restart(20);
    rig.step();
    assert_eq!((rig.phase(), rig.state.action), (Phase::Cut, FailsafeAction::Cut.code()));
    rig.order(Verb::TakeOff);
    assert_eq!((rig.phase(), rig.channels.arm), (Phase::Cut, 0));
    rig.run(3.0);
    assert_eq!((rig.phase(), rig.state.action), (Phase::Grounded, FailsafeAction::None.code()));
}

#[test]
fn a_charge_that_does_not_reach_home_keeps_it_on_the_ground() {
    let mut rig = Rig::new(4);
    rig.take_off();
    rig.run(1.0);
    rig.order(Verb::Land);
    rig.until_grounded(12.0);
    rig.drawn_mah = 3200.0;
    rig.run(4.0);
    rig.order(Verb::TakeOff);
    assert_eq!(rig.phase(), Phase::Grounded);
    assert_eq!(rig.core.sentence(), "refused: a failsafe holds: battery: return");
    rig.drawn_mah = 200.0;
    rig.run(4.0);
    rig.order(Verb::TakeOff);
    assert_eq!(rig.phase(), Phase::Arming, "{}", rig.core.sentence());
}

#[test]
fn whoever_asks_is_told_what_a_loss_would_end_in() {
    let ends = |rig: &Rig| {
        let s = &rig.state;
        let codes = [
            s.if_pose_lost,
            s.if_height_lost,
            s.if_sonars_lost,
            s.if_navigation_lost,
            s.if_controller_lost,
            s.if_charge_lost,
            s.if_operator_lost,
        ];
        codes.map(|code| FailsafeAction::from_code(code).unwrap())
    };
    use FailsafeAction::{Descend, Hover, Land, None, Return};
    let mut rig = Rig::new(4);
    rig.run(1.0);
    assert_eq!(ends(&rig), [None; 7]);
    rig.take_off();
    assert_eq!(ends(&rig), [Descend, Descend, Land, None, Land, Return, None]);
    with_navigation(&mut rig);
    rig.order(Verb::PatrolStart);
    rig.step();
    rig.step();
    assert_eq!(ends(&rig), [Descend, Descend, Land, Land, Land, Return, None]);
    // Not sure of its place already, it could not land straight without sonars; it hovers whoever is lost.
    rig.pose_state = LocalizationState::Lost;
    rig.run(6.0);
    assert_eq!(ends(&rig), [Descend, Descend, Descend, Land, Descend, Return, Hover]);
}
