//! Orders and switches beside a hand: arming, stop, cut, and the automatic.

use crate::hand::{flying, on_a_round};
use crate::rig::Rig;
use ipc_types::{ArmSwitch, FailsafeAction, FailsafeCause, Phase, SticksState, Verb};

#[test]
fn the_arm_switch_takes_off_to_a_hover_and_lands() {
    let mut rig = Rig::new(6);
    rig.run(1.5);
    rig.take();
    let switch = |rig: &mut Rig, arm: ArmSwitch| rig.hand.as_mut().unwrap().arm = arm;
    switch(&mut rig, ArmSwitch::On);
    rig.run(1.0);
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Grounded, SticksState::Ready));
    switch(&mut rig, ArmSwitch::Off);
    rig.run(0.2);
    rig.push([0.0, 0.0, 1.0, 0.0]);
    // No rule against it: the sticks ask for nothing on the ground.
    rig.run(0.2);
    rig.push([0.0; 4]);
    switch(&mut rig, ArmSwitch::On);
    rig.run(0.1);
    assert_eq!(rig.phase(), Phase::Arming, "{}", rig.core.sentence());
    let mut steps = 0;
    while rig.phase() != Phase::Manual {
        rig.step();
        steps += 1;
        assert!(steps < 750, "{} {}", rig.phase(), rig.core.sentence());
    }
    rig.run(2.0);
    assert_eq!(rig.sticks_state(), SticksState::Following);
    assert!((rig.height - 1.2).abs() < 0.1, "{}", rig.height);
    switch(&mut rig, ArmSwitch::Absent);
    rig.run(0.5);
    assert_eq!(rig.phase(), Phase::Manual, "a switch that is gone says nothing");
    switch(&mut rig, ArmSwitch::Off);
    rig.run(0.1);
    assert_eq!(rig.phase(), Phase::Landing);
    rig.push([1.0, 0.0, 1.0, 0.0]);
    rig.until_grounded(14.0);
    // And up again: the sticks are still his, and must be let go first.
    switch(&mut rig, ArmSwitch::On);
    rig.run(0.5);
    assert_eq!(rig.phase(), Phase::Grounded, "{}", rig.core.sentence());
    assert!(rig.core.sentence().starts_with("refused"), "{}", rig.core.sentence());
    rig.push([0.0; 4]);
    switch(&mut rig, ArmSwitch::Off);
    rig.run(0.2);
    switch(&mut rig, ArmSwitch::On);
    rig.run(0.1);
    assert_eq!(rig.phase(), Phase::Arming);
    // Who falls silent before the skids are up does not take off.
    rig.hand = None;
    rig.run(1.3);
    assert_eq!((rig.phase(), rig.state.lease), (Phase::Grounded, 0), "{}", rig.core.sentence());
}

#[test]
fn a_device_that_comes_with_its_switch_off_does_not_land_the_drone() {
    let mut rig = flying();
    rig.take();
    rig.hand.as_mut().unwrap().arm = ArmSwitch::Off;
    rig.run(2.0);
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Manual, SticksState::Following));
    rig.hand.as_mut().unwrap().arm = ArmSwitch::On;
    rig.run(0.5);
    assert_eq!(rig.phase(), Phase::Manual, "on in the air is nothing");
    rig.hand.as_mut().unwrap().arm = ArmSwitch::Off;
    rig.run(0.1);
    assert_eq!(rig.phase(), Phase::Landing);
}

#[test]
fn a_switch_arms_nothing_that_a_take_off_would_refuse() {
    let mut rig = Rig::new(6);
    rig.run(1.5);
    rig.cell_volts = 3.4;
    rig.take();
    rig.hand.as_mut().unwrap().arm = ArmSwitch::Off;
    rig.run(1.0);
    rig.hand.as_mut().unwrap().arm = ArmSwitch::On;
    rig.run(0.5);
    assert_eq!(rig.phase(), Phase::Grounded);
    assert!(rig.core.sentence().starts_with("refused: battery"), "{}", rig.core.sentence());
}

#[test]
fn a_stop_brakes_and_lands_when_nobody_answers() {
    let mut rig = on_a_round(4);
    assert!(rig.guard(Verb::Stop, "ana", 7));
    assert_eq!(rig.phase(), Phase::Hover);
    rig.run(2.0);
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    let left_s = (rig.state.stop_lands_ns - rig.now) as f64 * 1e-9;
    assert!((27.5..28.5).contains(&left_s), "{left_s}");
    // A restart does not lose it.
    rig.restart(100);
    rig.run(27.0);
    assert_eq!(rig.phase(), Phase::Hover, "{}", rig.core.sentence());
    rig.run(1.2);
    assert_eq!((rig.phase(), rig.state.stop_lands_ns), (Phase::Landing, 0));
    assert!(rig.core.sentence().contains("stop"), "{}", rig.core.sentence());
    rig.until_grounded(12.0);

    let mut rig = flying();
    rig.follow();
    assert!(rig.guard(Verb::Stop, "luis", 9), "anybody may stop it");
    assert_eq!((rig.phase(), rig.state.lease), (Phase::Hover, 0));
    rig.hand = None;
    rig.run(5.0);
    rig.order(Verb::Hold);
    rig.run(30.0);
    assert_eq!((rig.phase(), rig.state.stop_lands_ns), (Phase::Hover, 0), "it was answered");
}

#[test]
fn a_stop_stops_a_drone_that_a_failsafe_sends_home_too() {
    let mut rig = on_a_round(4);
    rig.cell_volts = 3.45;
    rig.run(11.0);
    assert_eq!((rig.phase(), rig.state.action), (Phase::Autonomous, FailsafeAction::Return.code()));
    rig.order(Verb::Stop);
    rig.run(3.0);
    assert_eq!(rig.phase(), Phase::Hover);
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    rig.order(Verb::Home);
    rig.run(0.1);
    assert_eq!(rig.phase(), Phase::Autonomous);
}

#[test]
fn a_cut_stops_the_motors_in_the_next_frame() {
    for by_hand in [false, true] {
        let mut rig = flying();
        if by_hand {
            rig.follow();
        }
        assert_eq!(rig.channels.arm, 1);
        assert!(rig.guard(Verb::Cut, "ana", 7));
        assert!(rig.state.answer_text.as_str().contains("falls"), "{}", rig.state.answer_text);
        rig.step();
        assert_eq!((rig.channels.arm, rig.channels.channels_us[4]), (0, 1000));
        assert_eq!(rig.channels.channels_us[2], 1000);
        assert_eq!((rig.phase(), rig.state.lease), (Phase::Cut, 0));
        assert_eq!(
            (rig.state.cause, rig.state.action),
            (FailsafeCause::Operator.code(), FailsafeAction::Cut.code())
        );
        rig.restart(100);
        rig.step();
        assert_eq!((rig.phase(), rig.channels.arm), (Phase::Cut, 0), "final");
        assert!(!rig.guard(Verb::TakeOff, "ana", 7));
        rig.hand = None;
        rig.run(4.0);
        assert_eq!((rig.phase(), rig.state.cause), (Phase::Grounded, FailsafeCause::None.code()));
    }
    let mut rig = Rig::new(1);
    rig.run(1.5);
    assert!(!rig.guard(Verb::Cut, "ana", 7));
}

#[test]
fn with_the_automatic_off_nothing_automatic_begins_and_what_flies_holds() {
    let mut rig = on_a_round(5);
    assert_eq!(rig.state.automatic, 1);
    rig.order(Verb::AutomaticOff);
    rig.step();
    assert_eq!((rig.phase(), rig.state.automatic), (Phase::Hover, 0));
    for verb in [Verb::PatrolStart, Verb::GoTo] {
        assert!(!rig.guard(verb, "ana", 7));
        assert_eq!(rig.state.answer_text.as_str(), "refused: the automatic is switched off");
    }
    rig.restart(100);
    rig.run(2.0);
    assert_eq!((rig.phase(), rig.state.automatic), (Phase::Hover, 0), "kept over a restart");
    assert!(rig.velocity.norm() < 0.15);
    rig.follow();
    rig.push([0.5, 0.0, 0.0, 0.0]);
    rig.run(1.0);
    assert_eq!(rig.sticks_state(), SticksState::Following, "by hand it flies");
    rig.hand = None;
    rig.order(Verb::Hold);
    rig.order(Verb::AutomaticOn);
    rig.run(1.0);
    assert_eq!((rig.phase(), rig.state.automatic), (Phase::Hover, 1), "nothing begins by itself");
    rig.order(Verb::AutomaticOff);
    rig.order(Verb::Home);
    rig.run(0.1);
    assert_eq!(rig.phase(), Phase::Autonomous, "the way home is free");
}
