//! By hand: taking over, flying, letting go, and everything that ends it.

use crate::rig::{HandOn, MS, Rig};
use control::Vector;
use ipc_types::{
    ChannelSource, Command, FailsafeAction, FailsafeCause, HEADING_HOLD, HEIGHT_HOLD, Phase, SetpointKind,
    Sticks, SticksState, Verb,
};
use pilot::PilotConfig;

/// A rig that hovers.
pub(crate) fn flying() -> Rig {
    let mut rig = Rig::new(3);
    rig.take_off();
    rig.run(2.0);
    rig
}

/// A rig in the middle of a round.
pub(crate) fn on_a_round(seed: u64) -> Rig {
    let mut rig = Rig::new(seed);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.45, 0.0), Vector { x: f32::NAN, y: f32::NAN });
    rig.setpoint.as_mut().unwrap().heading_rad = 0.0;
    rig.order(Verb::PatrolStart);
    while rig.phase() != Phase::Autonomous || rig.velocity.x < 0.35 {
        rig.step();
        assert!(rig.now < 30_000 * MS, "{}", rig.core.sentence());
    }
    rig
}

#[test]
fn a_take_over_in_a_round_stops_passes_neutral_and_follows() {
    let mut rig = on_a_round(3);
    rig.take();
    // The hand is at the stick already: nothing moves before it was let go.
    rig.push([1.0, 0.0, 0.0, 0.0]);
    rig.step();
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Manual, SticksState::Stopping));
    assert_eq!(rig.state.holder.as_str(), "ana");
    assert!(rig.state.lease > 0 && rig.state.holder_socket == 7 && rig.state.sticks_age_ms < 30.0);
    rig.run(2.0);
    assert_eq!(rig.sticks_state(), SticksState::AwaitingNeutral);
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    let stood = rig.place;
    rig.push([0.0; 4]);
    rig.run(0.1);
    assert_eq!(rig.sticks_state(), SticksState::Following);
    assert!((rig.place - stood).norm() < 0.1);
    // Forward is where the nose points, and left of it is left.
    for (axes, angle) in [([1.0, 0.0, 0.0, 0.0], 0.0), ([0.0, 1.0, 0.0, 0.0], 1.571f32)] {
        rig.push(axes);
        rig.run(1.6);
        assert_eq!(rig.channels.source, ChannelSource::Manual.code());
        let off = control::wrap_angle(rig.velocity.angle() - rig.heading - angle);
        assert!(rig.velocity.norm() > 0.25 && off.abs() < 0.25, "{:?} {off}", rig.velocity);
        assert!(rig.velocity.norm() < 0.6);
        rig.push([0.0; 4]);
        rig.run(1.5);
        assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    }
    // Whatever navigation wished goes on being wished, and nothing of it is flown.
    assert_eq!(rig.phase(), Phase::Manual);
    assert!(rig.guard(Verb::SticksRelease, "ana", 7), "{}", rig.state.answer_text);
    rig.hand = None;
    let let_go = rig.place;
    rig.run(4.0);
    assert_eq!((rig.phase(), rig.state.lease), (Phase::Hover, 0));
    assert_eq!((rig.state.holder.as_str(), rig.state.cause), ("", FailsafeCause::None.code()));
    assert!((rig.place - let_go).norm() < 0.4 && rig.state.sticks_age_ms.is_nan());
}

#[test]
fn a_hand_that_moves_or_lets_go_is_said_once_and_one_that_rests_is_not() {
    let mut rig = flying();
    rig.follow();
    rig.run(0.5);
    let said = |rig: &mut Rig, axes| {
        rig.push(axes);
        (0..10)
            .filter(|_| {
                rig.step();
                rig.channels.prompt == 1
            })
            .count()
    };
    assert_eq!(said(&mut rig, [0.0; 4]), 0);
    assert_eq!(said(&mut rig, [0.0, 0.0, 0.0, 0.09]), 0, "a tremble");
    assert_eq!(said(&mut rig, [0.0, 0.0, 0.0, 0.4]), 1);
    assert_eq!(said(&mut rig, [0.0, 0.0, 0.0, 0.4]), 0);
    rig.hand.as_mut().unwrap().held = false;
    assert_eq!(said(&mut rig, [0.0, 0.0, 0.0, 0.4]), 1, "let go");
}

#[test]
fn the_button_let_go_is_a_hover() {
    let mut rig = flying();
    rig.follow();
    rig.push([0.0, -1.0, 0.0, 0.0]);
    rig.run(1.5);
    let right = control::wrap_angle(rig.velocity.angle() - rig.heading + 1.571);
    assert!(rig.velocity.norm() > 0.25 && right.abs() < 0.25, "{right}");
    rig.hand.as_mut().unwrap().held = false;
    rig.run(1.5);
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Manual, SticksState::Ready));
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    assert_eq!(rig.channels.source, ChannelSource::Pilot.code());
}

#[test]
fn height_and_heading_are_held_where_they_were_reached_or_not_at_all() {
    let mut rig = flying();
    rig.follow();
    rig.push([0.0, 0.0, -1.0, 0.0]);
    rig.run(3.0);
    assert!((rig.height - 0.9).abs() < 0.06, "never lower by hand: {}", rig.height);
    rig.push([0.0, 0.0, 1.0, 0.0]);
    rig.run(0.8);
    rig.push([0.0; 4]);
    rig.run(1.0);
    let reached = rig.height;
    assert!((1.0..1.3).contains(&reached), "{reached}");
    rig.run(3.0);
    assert!((rig.height - reached).abs() < 0.05, "held: {} of {reached}", rig.height);
    rig.push([0.0, 0.0, 1.0, 0.0]);
    rig.run(6.0);
    assert!((rig.height - 1.6).abs() < 0.06, "never higher: {}", rig.height);

    rig.push([0.0, 0.0, 0.0, 1.0]);
    let before = rig.heading;
    rig.run(1.0);
    let turned = control::wrap_angle(rig.heading - before);
    assert!((0.5..0.9).contains(&turned), "{turned}");
    rig.push([0.0; 4]);
    rig.run(1.0);
    let held = rig.heading;
    // A gust turns it: with the switch it is turned back, without it is not.
    for (switches, back) in [(HEADING_HOLD, true), (0, false)] {
        let now = rig.heading;
        rig.hand.as_mut().unwrap().switches = switches | HEIGHT_HOLD;
        rig.run(0.1);
        rig.heading = control::wrap_angle(rig.heading + 0.3);
        rig.run(3.0);
        let off = control::wrap_angle(rig.heading - now);
        assert_eq!(off.abs() < 0.05, back, "{off}");
    }
    assert!(control::wrap_angle(held - rig.heading).abs() > 0.2);

    // The same of the height: whatever moved the drone, a stick in its middle asks for no climb and nothing more.
    rig.push([0.0, 0.0, -1.0, 0.0]);
    rig.run(1.0);
    rig.push([0.0; 4]);
    for (switches, back) in [(HEIGHT_HOLD, true), (0, false)] {
        rig.hand.as_mut().unwrap().switches = switches | HEADING_HOLD;
        rig.run(1.0);
        let before = rig.state.height_m;
        // A battery that gives less.
        rig.thrust *= 0.9;
        rig.run(8.0);
        let off = (rig.state.height_m - before).abs();
        assert_eq!(off < 0.06, back, "{switches}: {off}");
    }
}

#[test]
fn full_deflection_into_the_walls_touches_nothing() {
    for seed in 0..12 {
        let mut rig = Rig::new(seed);
        rig.gust_rms = 0.15;
        rig.take_off();
        rig.follow();
        let before = rig.place;
        let (mut far, mut changed) = (0f32, 0);
        for step in 0..1500u32 {
            // Into a wall, along it, to and fro, and round about.
            let turn = if seed % 3 == 0 { 0.4 } else { 0.0 };
            let angle = match seed % 4 {
                0 => 0.8 * seed as f32,
                1 => 0.8 * seed as f32 + 0.3 * (step as f32 * 0.02).sin(),
                2 => std::f32::consts::PI * (step / 40) as f32 + seed as f32,
                _ => step as f32 * 0.01,
            };
            let wish = Vector::along(angle - if seed % 3 == 0 { 0.0 } else { rig.heading });
            let up = if step % 400 < 200 { -1.0 } else { 1.0 };
            rig.push([wish.x.clamp(-1.0, 1.0), wish.y.clamp(-1.0, 1.0), up, turn]);
            rig.step();
            far = far.max((rig.place - before).norm());
            changed += u32::from(rig.sticks_state() == SticksState::Following);
        }
        assert_eq!(changed, 1500, "seed {seed}: it was flown by hand");
        // To and fro it does not get far.
        let least = if seed % 4 == 2 { 0.3 } else { 1.0 };
        assert!(far > least, "seed {seed}: a drone that does not move touches nothing: {far}");
        assert!(rig.least_clearance > 0.0, "seed {seed}: {}", rig.least_clearance);
        assert!(rig.height > 0.75 && rig.height < 1.7, "seed {seed}: {}", rig.height);
    }
}

#[test]
fn a_frozen_hand_is_a_hover_within_300_ms_and_nobodys_after_a_second() {
    let mut rig = flying();
    rig.follow();
    rig.push([1.0, 0.0, 0.0, 0.5]);
    rig.run(1.0);
    assert!(rig.velocity.norm() > 0.25);
    rig.hand.as_mut().unwrap().frozen = true;
    let began = rig.now;
    let (mut hovers, mut free) = (None, None);
    while free.is_none() {
        rig.step();
        let since_ms = (rig.now - began) / MS;
        if rig.channels.source != ChannelSource::Manual.code() {
            hovers.get_or_insert(since_ms);
        } else {
            // What is made of an old input ends with it.
            assert!(rig.channels.expiry_ns <= began + 245 * MS + 20 * MS, "{since_ms}");
        }
        if rig.state.lease == 0 {
            free = Some(since_ms);
        }
        assert!(since_ms < 1_500, "never dropped");
    }
    assert!(hovers.unwrap() <= 300, "{hovers:?}");
    assert!((980..=1_020).contains(&free.unwrap()), "{free:?}");
    rig.run(0.1);
    assert_eq!((rig.phase(), rig.state.cause), (Phase::Hover, FailsafeCause::OperatorSilent.code()));
    assert_eq!(rig.state.action, FailsafeAction::Hover.code());
    rig.run(2.0);
    assert!(rig.velocity.norm() < 0.15);
    // Until somebody says what next.
    rig.order(Verb::Hold);
    rig.step();
    assert_eq!(rig.state.cause, FailsafeCause::None.code());
    // The frozen hand comes back to life under a number that is nobody's.
    rig.hand.as_mut().unwrap().frozen = false;
    rig.run(1.0);
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Hover, SticksState::Free));
}

#[test]
fn what_is_done_of_a_lost_operator_is_what_the_policy_says() {
    use control::OperatorLost;
    let cases = [
        (OperatorLost::Hold, Phase::Hover, FailsafeAction::Hover),
        (OperatorLost::Return, Phase::Autonomous, FailsafeAction::Return),
        (OperatorLost::Land, Phase::EmergencyLanding, FailsafeAction::Land),
    ];
    for (lost, phase, action) in cases {
        let mut config = PilotConfig::default();
        config.failsafe.operator_lost = lost;
        let mut rig = Rig::with(3, config);
        rig.take_off();
        rig.follow();
        rig.hand = None;
        rig.run(0.6);
        assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Manual, SticksState::Silent));
        rig.run(0.6);
        assert_eq!((rig.phase(), rig.state.action), (phase, action.code()), "{lost:?}");
        assert_eq!(rig.state.cause, FailsafeCause::OperatorSilent.code());
    }
}

#[test]
fn who_is_heard_again_within_the_lease_passes_neutral_again() {
    let mut rig = flying();
    rig.follow();
    rig.push([1.0, 0.0, 0.0, 0.0]);
    rig.run(0.5);
    rig.hand.as_mut().unwrap().frozen = true;
    rig.run(0.6);
    assert_eq!(rig.sticks_state(), SticksState::Silent);
    rig.hand.as_mut().unwrap().frozen = false;
    rig.run(2.0);
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Manual, SticksState::AwaitingNeutral));
    assert!(rig.velocity.norm() < 0.15);
    rig.push([0.0; 4]);
    rig.run(0.1);
    assert_eq!(rig.sticks_state(), SticksState::Following);
}

#[test]
fn a_pilot_that_is_killed_while_it_is_flown_by_hand_hovers_and_nobody_holds_the_sticks() {
    let mut rig = flying();
    rig.follow();
    rig.push([1.0, 0.0, 0.0, 0.0]);
    rig.run(1.0);
    let number = rig.state.lease;
    rig.restart(100);
    rig.step();
    assert_eq!((rig.phase(), rig.state.lease), (Phase::Hover, 0));
    // The hand pushes on, under the lease that it had.
    rig.run(3.0);
    assert_eq!((rig.phase(), rig.sticks_state()), (Phase::Hover, SticksState::Free));
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    rig.follow();
    assert!(rig.state.lease > number, "{} after {number}", rig.state.lease);
}

#[test]
fn one_holds_the_sticks_and_the_other_is_told_who() {
    let mut rig = flying();
    rig.follow();
    assert!(!rig.guard(Verb::SticksTake, "luis", 9));
    assert_eq!(rig.state.answer_text.as_str(), "refused: ana holds the sticks");
    assert!(!rig.guard(Verb::SticksTake, "ana", 8), "another page of the same account");
    assert!(!rig.guard(Verb::SticksRelease, "luis", 9));
    assert_eq!(rig.state.answer_text.as_str(), "refused: you do not hold the sticks");
    assert!(!rig.guard(Verb::GoTo, "luis", 9));
    assert_eq!(rig.state.answer_text.as_str(), "refused: ana holds the sticks");
    assert!(!rig.guard(Verb::SticksTake, "luis", 0), "an order without a connection");
    assert_eq!(rig.sticks_state(), SticksState::Following);
    // Who has been silent for long enough is holder no more.
    rig.hand = None;
    rig.run(0.9);
    assert!(!rig.guard(Verb::SticksTake, "luis", 9));
    rig.run(0.1);
    assert!(rig.guard(Verb::SticksTake, "luis", 9), "{}", rig.state.answer_text);
    rig.step();
    assert_eq!((rig.phase(), rig.state.holder.as_str()), (Phase::Manual, "luis"));
    assert_eq!(rig.state.cause, FailsafeCause::None.code());
    // Whoever orders it to stand takes it out of his hand.
    assert!(rig.guard(Verb::Hold, "ana", 7));
    assert_eq!((rig.phase(), rig.state.lease), (Phase::Hover, 0));
}

#[test]
fn nobody_takes_over_when_what_the_sticks_are_flown_by_has_failed_and_who_holds_them_loses_them() {
    let mut rig = flying();
    rig.sides_dead = true;
    rig.run(1.5);
    assert!(!rig.guard(Verb::SticksTake, "ana", 7));
    assert!(
        rig.state.answer_text.as_str().contains("all side sonars are silent"),
        "{}",
        rig.state.answer_text
    );
    rig.sides_dead = false;
    rig.run(1.0);
    rig.follow();
    rig.sides_dead = true;
    rig.run(1.5);
    assert_eq!((rig.phase(), rig.state.lease), (Phase::Hover, 0), "{}", rig.core.sentence());
}

#[test]
fn sticks_that_make_no_sense_are_counted_and_never_flown() {
    let mut rig = flying();
    rig.follow();
    let HandOn { lease, sequence, .. } = rig.hand.take().unwrap();
    let good = Sticks { input_sequence: sequence, lease, age_ms: 5.0, held: 1, ..Sticks::default() };
    let bad: [fn(&mut Sticks); 14] = [
        |s| s.forward = f32::NAN,
        |s| s.left = 1.01,
        |s| s.up = -2.0,
        |s| s.turn = f32::INFINITY,
        |s| s.age_ms = -1.0,
        |s| s.age_ms = f32::NAN,
        |s| s.age_ms = 1e9,
        |s| s.age_ms = f32::INFINITY,
        |s| s.held = 2,
        |s| s.arm = 3,
        |s| s.arm = 999,
        |s| s.lease += 1,
        |s| s.lease = 0,
        |s| s.header.stamp_ns += 1_000 * MS,
    ];
    let before = rig.core.refused();
    for (k, spoil) in bad.iter().enumerate() {
        let mut message = Sticks { input_sequence: sequence + 1 + k as u64, ..good };
        message.header.stamp_ns = rig.now;
        message.forward = 1.0;
        spoil(&mut message);
        rig.core.sticks(rig.now, &message);
        rig.step();
        assert_eq!(rig.core.refused(), before + 1 + k as u64, "{k}");
    }
    assert_eq!(rig.sticks_state(), SticksState::Silent, "none of them was a sign of life");
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    // A command with an unknown verb and the sticks of nobody harm nobody either.
    rig.core.command(rig.now, &Command { verb: 77, ..Command::default() });
    assert_eq!(rig.phase(), Phase::Manual);
}
