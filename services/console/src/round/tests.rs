use super::*;
use ipc_types::{FailsafeAction, FailsafeCause, PatrolState, Phase, RoomState};

const MINUTE: u64 = 60_000;

fn pilot(phase: Phase, cause: FailsafeCause) -> PilotView {
    let action = if cause == FailsafeCause::None { FailsafeAction::None } else { FailsafeAction::Land };
    PilotView { phase: phase.code(), cause: cause.code(), action: action.code(), holder: String::new() }
}

fn patrol(state: PatrolState, room: RoomState) -> PatrolView {
    PatrolView {
        started_ns: 5,
        state: state.code(),
        pad_x_m: Some(1.0),
        pad_y_m: Some(1.0),
        coverage: Some(0.5),
        rooms: vec![RoomView {
            name: "Hall".to_owned(),
            reason: String::new(),
            seen: Some(0.5),
            state: room.code(),
        }],
        text: "flying".to_owned(),
    }
}

fn at(x_m: f64, y_m: f64) -> PoseView {
    PoseView { x_m: Some(x_m), y_m: Some(y_m), heading_rad: Some(0.0), searching: 0 }
}

fn report(news: Vec<News>) -> Option<Report> {
    news.into_iter().find_map(|one| match one {
        News::Report(report) => Some(*report),
        News::Event(_) => None,
    })
}

/// Takes off, flies, and is somewhere when the last phase before the ground begins.
fn flown(last: Phase, x_m: f64) -> (Follower, u64) {
    let mut follower = Follower::new("north");
    for (now, phase) in [(0, Phase::Grounded), (1, Phase::Arming), (2, Phase::TakeOff)] {
        follower.pilot(&pilot(phase, FailsafeCause::None), now);
    }
    follower.patrol(&patrol(PatrolState::Flying, RoomState::Entered), 3);
    follower.pilot(&pilot(Phase::Autonomous, FailsafeCause::None), 4);
    follower.pose(at(x_m, 1.0));
    follower.pilot(&pilot(last, FailsafeCause::None), 5);
    (follower, 6)
}

#[test]
fn how_a_round_ended_is_told_by_its_last_phase_and_its_place() {
    for (last, x_m, outcome) in [
        (Phase::Landing, 1.3, "landed_on_pad"),
        (Phase::Landing, 1.6, "landed_elsewhere"),
        (Phase::EmergencyLanding, 1.0, "emergency_landing"),
        (Phase::Cut, 1.0, "cut"),
    ] {
        let (mut follower, now) = flown(last, x_m);
        assert!(report(follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), now)).is_none());
        let report = report(follower.patrol(&patrol(PatrolState::Done, RoomState::Seen), now + 400));
        let report = report.unwrap_or_else(|| unreachable!("{last:?}"));
        assert_eq!((report.outcome, report.landed_ms, report.started_ms), (outcome, now, 3), "{last:?}");
        assert_eq!((report.rooms[0].state, report.rooms[0].entered_ms), ("seen", Some(3)));
        // The same round is not reported twice.
        assert!(follower.patrol(&patrol(PatrolState::Flying, RoomState::Seen), now + 900).is_empty());
    }
}

#[test]
fn a_drone_whose_place_is_not_known_has_not_landed_on_the_pad() {
    let (mut follower, now) = flown(Phase::Landing, 1.0);
    follower.pose(PoseView { searching: 1, ..at(1.0, 1.0) });
    assert_eq!(follower.place(), None);
    follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), now);
    let report = report(follower.tick(now + 3_000));
    assert_eq!(report.map(|report| report.outcome), Some("landed_elsewhere"));
}

#[test]
fn the_last_word_of_the_route_is_waited_for_but_not_for_ever() {
    let (mut follower, now) = flown(Phase::Landing, 1.0);
    follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), now);
    assert!(follower.tick(now + 2_999).is_empty());
    assert!(report(follower.tick(now + 3_000)).is_some());
    assert!(follower.tick(now + 9_000).is_empty());
}

#[test]
fn a_touch_of_the_ground_on_the_way_up_is_no_landing() {
    let mut follower = Follower::new("north");
    follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), 0);
    follower.patrol(&patrol(PatrolState::Flying, RoomState::Waiting), 1);
    follower.pilot(&pilot(Phase::Arming, FailsafeCause::None), 2);
    follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), 3);
    assert!(follower.tick(MINUTE).is_empty(), "it never flew");
}

#[test]
fn failsafes_have_a_beginning_and_an_end() {
    let (mut follower, now) = flown(Phase::Autonomous, 1.0);
    for (at, cause) in
        [(10, FailsafeCause::PoseUncertain), (20, FailsafeCause::Lost), (30, FailsafeCause::None)]
    {
        let news = follower.pilot(&pilot(Phase::Autonomous, cause), now + at);
        assert!(
            matches!(&news[..], [News::Event(event)] if event.kind == "failsafe" && event.text == cause.word())
        );
        assert!(follower.pilot(&pilot(Phase::Autonomous, cause), now + at + 1).is_empty(), "said once");
    }
    follower.pilot(&pilot(Phase::Landing, FailsafeCause::None), now + 40);
    follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), now + 50);
    let spans = report(follower.tick(now + MINUTE)).map(|report| report.failsafes).unwrap_or_default();
    let spans: Vec<_> =
        spans.iter().map(|span| (span.text.as_str(), span.time_ms - now, span.ended_ms)).collect();
    assert_eq!(spans, [("position uncertain", 10, Some(now + 20)), ("lost", 20, Some(now + 30))]);
}

#[test]
fn a_drone_that_falls_silent_is_given_up_after_ten_minutes() {
    let (mut follower, now) = flown(Phase::Autonomous, 1.0);
    follower.link(false, now);
    assert!(follower.tick(now + 9 * MINUTE).is_empty());
    follower.link(true, now + 9 * MINUTE);
    assert!(follower.tick(now + 30 * MINUTE).is_empty(), "it came back");
    follower.link(false, now + 40 * MINUTE);
    let report = report(follower.tick(now + 50 * MINUTE));
    let report = report.map(|report| (report.outcome, report.landed_ms, report.silences.len()));
    assert_eq!(report, Some(("lost_contact", now + 40 * MINUTE, 2)));
}

#[test]
fn lists_are_bounded_whatever_a_drone_says() {
    let (mut follower, now) = flown(Phase::Autonomous, 1.0);
    for k in 0..2_000 {
        let cause = if k % 2 == 0 { FailsafeCause::Lost } else { FailsafeCause::None };
        let mut view = pilot(Phase::Autonomous, cause);
        view.holder = k.to_string();
        follower.pilot(&view, now + k);
        follower.link(k % 2 == 0, now + k);
    }
    let mut many = patrol(PatrolState::Flying, RoomState::Entered);
    many.rooms = vec![many.rooms[0].clone(); 10_000];
    follower.patrol(&many, now);
    follower.pilot(&pilot(Phase::Landing, FailsafeCause::None), now + 3_000);
    follower.pilot(&pilot(Phase::Grounded, FailsafeCause::None), now + 3_001);
    let report = report(follower.tick(now + MINUTE));
    let sizes = report.map(|r| [r.failsafes.len(), r.flown_by.len(), r.silences.len(), r.rooms.len()]);
    assert_eq!(sizes, Some([256, 256, 256, ipc_types::MAX_ROOMS]));
}

#[test]
fn codes_that_nobody_knows_change_nothing() {
    let (mut follower, now) = flown(Phase::Autonomous, 1.0);
    let view = PilotView { phase: 200, cause: 200, action: 200, holder: String::new() };
    assert!(follower.pilot(&view, now).is_empty());
    let mut view = patrol(PatrolState::Flying, RoomState::Entered);
    (view.state, view.rooms[0].state) = (200, 200);
    assert!(follower.patrol(&view, now).is_empty());
}
