//! What sends the drone home, from whatever it was doing.

use crate::rig::Rig;
use control::Vector;
use ipc_types::{ChannelSource, FailsafeAction, FailsafeCause, Phase, SetpointKind, Verb};

/// Navigation stands ready with a way home that leads to the right.
fn with_a_way_home(rig: &mut Rig) {
    rig.navigate(SetpointKind::Velocity, Vector::new(0.2, 0.0), Vector { x: f32::NAN, y: f32::NAN });
}

#[test]
fn a_low_battery_in_the_hover_is_flown_home_by_navigation() {
    let mut rig = Rig::new(4);
    rig.take_off();
    with_a_way_home(&mut rig);
    rig.run(2.0);
    assert_eq!(rig.phase(), Phase::Hover, "navigation is not heeded in a hover");
    let from = rig.place;
    rig.cell_volts = 3.45;
    rig.run(9.0);
    assert_eq!(rig.phase(), Phase::Hover, "`failsafe.return_s` is 10 s");
    rig.run(2.0);
    assert_eq!((rig.phase(), rig.state.action), (Phase::Autonomous, FailsafeAction::Return.code()));
    assert_eq!(rig.channels.source, ChannelSource::Navigation.code());
    assert_eq!(rig.core.sentence(), "returning home: battery: return");
    rig.run(3.0);
    assert!(rig.place.x - from.x > 0.3, "{:?}", rig.place - from);
    // Neither a hold nor another errand leaves it in the air until it is empty; to come down at once does.
    for verb in [Verb::Hold, Verb::GoTo, Verb::PatrolStart, Verb::PatrolPause] {
        rig.order(verb);
        rig.step();
        assert_eq!(rig.phase(), Phase::Autonomous);
        assert!(rig.core.sentence().starts_with("refused: returning home"), "{}", rig.core.sentence());
    }
    rig.order(Verb::Land);
    assert_eq!(rig.phase(), Phase::Landing);
    rig.until_grounded(12.0);
}

#[test]
fn a_battery_that_is_low_in_the_take_off_turns_it_round_as_soon_as_it_is_up() {
    let mut rig = Rig::new(4);
    rig.run(1.5);
    with_a_way_home(&mut rig);
    rig.order(Verb::TakeOff);
    while rig.phase() != Phase::TakeOff {
        rig.step();
    }
    // The climb takes longer than the 3 s after which a charge that does not cover the way home acts.
    rig.drawn_mah = 3200.0;
    while rig.phase() == Phase::TakeOff {
        rig.step();
        assert!(rig.now < 40_000_000_000, "{}", rig.core.sentence());
    }
    assert_eq!(rig.state.action, FailsafeAction::Return.code());
    assert_eq!(rig.phase(), Phase::Autonomous, "{}", rig.core.sentence());
    assert_eq!(rig.state.cause, FailsafeCause::BatteryReturn.code());
    assert!((rig.height - 1.2).abs() < 0.3, "{}", rig.height);
}

#[test]
fn a_battery_of_which_nothing_is_known_any_more_sends_it_home() {
    type Change = fn(&mut Rig);
    // How it is lost, and how long until that is noticed: `failsafe.power_stale_s` when nothing is heard.
    let cases: [(Change, f32); 4] = [
        (|rig| rig.power_told = false, 2.0),
        (|rig| rig.cell_volts = 0.0, 0.0),
        (|rig| rig.cell_volts = f32::NAN, 0.0),
        (|rig| rig.drawn_mah = f32::NAN, 0.0),
    ];
    for (lose, noticed_s) in cases {
        let mut rig = Rig::new(4);
        rig.take_off();
        with_a_way_home(&mut rig);
        rig.run(1.0);
        lose(&mut rig);
        rig.run(noticed_s + 9.0);
        assert_eq!(rig.state.action, FailsafeAction::None.code(), "`failsafe.power_return_s` is 10 s");
        rig.run(2.0);
        assert_eq!((rig.phase(), rig.state.action), (Phase::Autonomous, FailsafeAction::Return.code()));
        assert_eq!(rig.state.cause, FailsafeCause::BatteryReturn.code());
        (rig.power_told, rig.cell_volts, rig.drawn_mah) = (true, 4.0, 100.0);
        rig.run(1.5);
        assert_eq!(rig.state.action, FailsafeAction::None.code(), "it is heard of again");
    }
}

#[test]
fn an_old_voltage_lets_nobody_take_off() {
    let mut rig = Rig::new(1);
    rig.run(1.5);
    rig.power_told = false;
    rig.run(2.6);
    rig.order(Verb::TakeOff);
    assert_eq!(rig.phase(), Phase::Grounded);
    assert!(rig.core.sentence().contains("does not tell the battery's voltage"), "{}", rig.core.sentence());
}

#[test]
fn a_charge_that_does_not_cover_the_way_home_is_remembered_while_the_place_is_not_known() {
    let mut rig = Rig::new(4);
    rig.take_off();
    rig.run(1.0);
    rig.pose_state = ipc_types::LocalizationState::Lost;
    rig.drawn_mah = 3200.0;
    rig.run(3.8);
    assert_eq!(rig.state.cause, FailsafeCause::BatteryReturn.code());
}
