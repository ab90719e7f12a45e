//! Commands and the pilot's phases.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc_types::{Answer, COMMAND_LIFE_NS, Command, FailsafeAction, PatrolState, Phase, PilotState, Verb};
use navigation::mission::{Event, Goal, Heard, Intent, Mission, Nonsense};
use navigation::place::Place;

const PAD: (f32, f32) = (1.0, 1.0);

fn place(x: f32, y: f32) -> Place {
    Place { stamp_ns: 1, x, y, sigma: 0.03, tracking: true, ..Place::default() }
}

struct Story {
    mission: Mission,
    number: u32,
}

impl Story {
    fn new() -> Self {
        Self { mission: Mission::new(Some(PAD)), number: 0 }
    }
    fn order(&mut self, verb: Verb) -> Result<Option<Event>, Nonsense> {
        self.order_to(verb, f32::NAN, f32::NAN)
    }
    fn order_to(&mut self, verb: Verb, x_m: f32, y_m: f32) -> Result<Option<Event>, Nonsense> {
        self.number += 1;
        let command = Command {
            verb: u32::from(verb.code()),
            expiry_ns: COMMAND_LIFE_NS,
            command_sequence: self.number,
            x_m,
            y_m,
            ..Command::default()
        };
        self.mission.obey(0, &command, Some(&place(3.0, 3.0)))
    }
    fn pilot(&mut self, phase: Phase, action: FailsafeAction) -> Option<Event> {
        let state =
            PilotState { phase: phase.code(), action: action.code(), automatic: 1, ..PilotState::default() };
        self.mission.hear(&state, Some(&place(3.0, 3.0))).unwrap()
    }
    fn fly(&mut self) {
        for phase in [Phase::Grounded, Phase::Arming, Phase::TakeOff, Phase::Autonomous] {
            assert_eq!(self.pilot(phase, FailsafeAction::None), None);
        }
    }
    fn intent(&mut self, x: f32, y: f32, planned: bool) -> Intent {
        self.mission.intent(Some(&place(x, y)), planned, 0.12, 0.05)
    }
}

#[test]
fn a_round_from_the_command_to_the_pad() {
    let mut story = Story::new();
    assert_eq!(story.order(Verb::PatrolStart), Ok(Some(Event::NewRound)));
    assert_eq!(story.mission.state(), PatrolState::Planning);
    story.mission.route_ready();
    assert_eq!(story.intent(1.0, 1.0, true), Intent::Hover(None), "not before the pilot has taken off");
    story.fly();
    assert_eq!(story.intent(1.0, 1.0, true), Intent::Follow);
    story.mission.homeward();
    assert_eq!(story.mission.state(), PatrolState::Returning);
    story.mission.arrived(PAD);
    assert_eq!(story.mission.state(), PatrolState::Landing);
    assert_eq!(story.intent(1.3, 1.0, false), Intent::Hover(Some(PAD)), "not over the pad yet");
    for _ in 0..19 {
        assert_eq!(story.intent(1.05, 1.0, false), Intent::Hover(Some(PAD)));
    }
    story.intent(1.05, 1.0, false);
    story.intent(1.05, 1.0, false);
    assert_eq!(story.intent(1.05, 1.0, false), Intent::Land(PAD));
    assert_eq!(story.intent(1.3, 1.0, false), Intent::Land(PAD), "asked is asked");
    story.pilot(Phase::Landing, FailsafeAction::None);
    assert_eq!(story.pilot(Phase::Grounded, FailsafeAction::None), Some(Event::Drop));
    assert_eq!(story.mission.state(), PatrolState::Done);
}

#[test]
fn a_pause_keeps_the_round_and_a_start_goes_on_with_it() {
    let mut story = Story::new();
    story.order(Verb::PatrolStart).unwrap();
    story.fly();
    story.mission.route_ready();
    assert_eq!(story.order(Verb::PatrolPause), Ok(Some(Event::Drop)));
    assert_eq!(story.mission.state(), PatrolState::Paused);
    assert_eq!(story.intent(3.0, 3.0, false), Intent::Hover(Some((3.0, 3.0))));
    assert_eq!(story.order(Verb::PatrolStart), Ok(Some(Event::Plan)), "not a new round");
    assert_eq!(story.mission.goal(), Goal::Round);
}

#[test]
fn a_command_is_obeyed_once() {
    let mut story = Story::new();
    story.order(Verb::PatrolStart).unwrap();
    story.number -= 1;
    assert_eq!(story.order(Verb::PatrolStop), Ok(None));
    assert_eq!(story.mission.state(), PatrolState::Planning);
}

#[test]
fn stop_home_goto_hold_and_land() {
    let mut story = Story::new();
    story.fly();
    assert_eq!(story.order_to(Verb::GoTo, 5.0, 6.0), Ok(Some(Event::Plan)));
    assert_eq!(story.mission.goal(), Goal::There((5.0, 6.0)));
    story.mission.arrived((5.0, 6.0));
    assert_eq!(story.mission.state(), PatrolState::Idle);
    assert_eq!(story.intent(5.1, 6.0, false), Intent::Hover(Some((5.0, 6.0))));
    assert_eq!(story.order(Verb::Home), Ok(Some(Event::Plan)));
    assert_eq!(story.mission.state(), PatrolState::Returning);
    assert_eq!(story.order(Verb::Hold), Ok(Some(Event::Drop)));
    assert_eq!(story.mission.state(), PatrolState::Idle);
    story.order(Verb::PatrolStart).unwrap();
    assert_eq!(story.order(Verb::PatrolStop), Ok(Some(Event::Plan)));
    assert_eq!(story.mission.goal(), Goal::Home);
    assert_eq!(story.order(Verb::Land), Ok(Some(Event::Drop)));
    assert_eq!(story.mission.state(), PatrolState::Idle);
}

#[test]
fn a_stop_a_take_over_and_the_automatic_off_pause_the_round_and_end_everything_else() {
    for verb in [Verb::Stop, Verb::SticksTake, Verb::AutomaticOff] {
        let mut story = Story::new();
        story.order(Verb::PatrolStart).unwrap();
        story.fly();
        story.mission.route_ready();
        assert_eq!(story.order(verb), Ok(Some(Event::Drop)), "{verb}");
        assert_eq!((story.mission.state(), story.mission.goal()), (PatrolState::Paused, Goal::Round));
        assert_eq!(story.mission.heard().answer, Answer::Accepted);
        assert_eq!(story.intent(3.0, 3.0, false), Intent::Hover(Some((3.0, 3.0))));
        let mut story = Story::new();
        story.fly();
        story.order_to(Verb::GoTo, 5.0, 6.0).unwrap();
        assert_eq!(story.order(verb), Ok(Some(Event::Drop)), "{verb}");
        assert_eq!((story.mission.state(), story.mission.goal()), (PatrolState::Idle, Goal::None));
    }
    for verb in [Verb::Cut, Verb::SticksRelease, Verb::AutomaticOn] {
        let mut story = Story::new();
        story.fly();
        story.order_to(Verb::GoTo, 5.0, 6.0).unwrap();
        assert_eq!(story.order(verb), Ok(None), "{verb} is the pilot's");
        assert_eq!(story.mission.goal(), Goal::There((5.0, 6.0)));
    }
}

#[test]
fn with_the_automatic_off_no_flight_begins_but_home_and_a_restart_is_told_by_the_pilot() {
    let off = PilotState { phase: Phase::Hover.code(), automatic: 0, ..PilotState::default() };
    let mut told = Story::new();
    told.fly();
    told.mission.hear(&off, None).unwrap();
    let mut ordered = Story::new();
    ordered.fly();
    ordered.order(Verb::AutomaticOff).unwrap();
    for mut story in [told, ordered] {
        for verb in [Verb::PatrolStart, Verb::GoTo] {
            assert_eq!(story.order_to(verb, 1.0, 2.0), Ok(None), "{verb}");
            assert_eq!(story.mission.heard().answer, Answer::Refused);
            assert_eq!(story.mission.goal(), Goal::None);
        }
        assert_eq!(story.order(Verb::Home), Ok(Some(Event::Plan)));
        story.order(Verb::AutomaticOn).unwrap();
        assert_eq!(story.order_to(Verb::GoTo, 1.0, 2.0), Ok(Some(Event::Plan)));
    }
}

#[test]
fn nonsense_changes_nothing() {
    let mut story = Story::new();
    assert_eq!(story.order_to(Verb::GoTo, f32::NAN, 1.0), Err(Nonsense));
    assert_eq!(story.order_to(Verb::GoTo, 1.0, f32::INFINITY), Err(Nonsense));
    let unknown = Command { verb: 99, command_sequence: 77, ..Command::default() };
    assert_eq!(story.mission.obey(0, &unknown, None), Err(Nonsense));
    assert_eq!(
        story.mission.hear(&PilotState { phase: 200, automatic: 1, ..PilotState::default() }, None),
        Err(Nonsense)
    );
    assert_eq!((story.mission.state(), story.mission.heard().sequence), (PatrolState::Idle, 0));
}

#[test]
fn nothing_resumes_by_itself_after_manual_control() {
    let mut story = Story::new();
    story.order(Verb::PatrolStart).unwrap();
    story.fly();
    story.mission.route_ready();
    assert_eq!(story.pilot(Phase::Manual, FailsafeAction::None), Some(Event::Drop));
    assert_eq!(story.mission.state(), PatrolState::Paused);
    story.pilot(Phase::Autonomous, FailsafeAction::None);
    assert!(matches!(story.intent(3.0, 3.0, false), Intent::Hover(_)));
}

#[test]
fn failsafes_send_home_hold_or_end_the_round() {
    let mut story = Story::new();
    story.order(Verb::PatrolStart).unwrap();
    story.fly();
    story.mission.route_ready();
    story.pilot(Phase::Autonomous, FailsafeAction::Hover);
    assert!(matches!(story.intent(3.0, 3.0, true), Intent::Hover(_)), "the pilot flies on its own");
    assert_eq!(story.pilot(Phase::Autonomous, FailsafeAction::None), None);
    assert_eq!(story.intent(3.0, 3.0, true), Intent::Follow);
    assert_eq!(story.pilot(Phase::Autonomous, FailsafeAction::Return), Some(Event::Plan));
    assert_eq!(story.mission.goal(), Goal::Home);
    assert_eq!(story.pilot(Phase::Autonomous, FailsafeAction::Return), None, "once");
    assert_eq!(story.intent(3.0, 3.0, true), Intent::Follow);
    story.pilot(Phase::EmergencyLanding, FailsafeAction::Land);
    assert_eq!(story.mission.state(), PatrolState::Failed);
}

#[test]
fn what_sends_home_is_answered_whenever_it_began_and_whatever_is_ordered() {
    // It began in the take-off of a plain hover: navigation had nothing to do with that.
    let mut story = Story::new();
    story.order(Verb::TakeOff).unwrap();
    assert_eq!(story.pilot(Phase::TakeOff, FailsafeAction::Return), None);
    assert_eq!(story.pilot(Phase::Autonomous, FailsafeAction::Return), Some(Event::Plan));
    assert_eq!((story.mission.goal(), story.mission.state()), (Goal::Home, PatrolState::Returning));
    for verb in [Verb::Hold, Verb::PatrolPause, Verb::PatrolStart] {
        story.order(verb).unwrap();
        story.pilot(Phase::Autonomous, FailsafeAction::Return);
        assert_eq!(story.mission.goal(), Goal::Home, "after {verb:?}");
    }
    // No way home: it is not planned again with every message, but when it is asked for anew.
    story.mission.no_way(Some(&place(3.0, 3.0)));
    assert_eq!(story.pilot(Phase::Autonomous, FailsafeAction::Return), None);
    assert_eq!(story.pilot(Phase::Autonomous, FailsafeAction::None), None);
    assert_eq!(story.pilot(Phase::Hover, FailsafeAction::Return), Some(Event::Plan));
}

#[test]
fn a_take_off_that_never_comes_ends_the_mission() {
    let mut story = Story::new();
    story.order(Verb::PatrolStart).unwrap();
    story.pilot(Phase::Grounded, FailsafeAction::None);
    let waited = (0..10_000).take_while(|_| !story.mission.waited_on_the_ground(0.05)).count();
    assert!((850..950).contains(&waited), "{waited}");
    assert_eq!(story.mission.state(), PatrolState::Idle);
}

#[test]
fn a_restart_goes_on_where_it_was_and_obeys_no_command_twice() {
    for (state, goal, after) in [
        (PatrolState::Flying, Goal::Round, PatrolState::Planning),
        (PatrolState::Returning, Goal::Home, PatrolState::Returning),
        (PatrolState::Landing, Goal::Home, PatrolState::Returning),
        (PatrolState::GoingThere, Goal::There((4.0, 4.0)), PatrolState::GoingThere),
        (PatrolState::Paused, Goal::Round, PatrolState::Paused),
        (PatrolState::Done, Goal::None, PatrolState::Done),
    ] {
        let mut mission = Mission::new(None);
        let second = 1_000_000_000;
        let heard = Heard { sequence: 7, stamp_ns: 10 * second, answer: Answer::Accepted };
        mission.restore(state, PAD, Some((4.0, 4.0)), heard);
        assert_eq!((mission.state(), mission.goal(), mission.pad()), (after, goal, Some(PAD)));
        let mut again = Command {
            expiry_ns: 10 * second + COMMAND_LIFE_NS,
            verb: u32::from(Verb::PatrolStart.code()),
            command_sequence: 7,
            ..Command::default()
        };
        again.header.stamp_ns = 10 * second;
        assert_eq!(mission.obey(10 * second, &again, None), Ok(None));
        // Somebody else's order, given a moment earlier, is still in his channel's history.
        again.command_sequence = 6;
        again.header.stamp_ns -= 1;
        again.expiry_ns -= 1;
        assert_eq!(mission.obey(10 * second, &again, None), Err(Nonsense), "overtaken");
        again.header.stamp_ns += 1;
        assert_eq!(mission.obey(13 * second, &again, None), Err(Nonsense), "expired");
        assert_eq!((mission.state(), mission.heard()), (after, heard));
    }
}
