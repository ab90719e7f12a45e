//! The table of states, by the clock.

use super::*;
use manifest::Manifest;

const MS: Duration = Duration::from_millis(1);

fn life(restart: &str) -> (Life, Instant) {
    let text = format!(
        "[system]\nname='s'\nplan='p'\nvehicle='v'\n[service.a]\nrun='a'\ntick_hz=1\nheartbeat_ms=500\nrestart='{restart}'"
    );
    let m = Manifest::parse("m", &text).unwrap();
    let now = Instant::now();
    (Life::new(&m.services["a"], Duration::from_secs(10), Duration::from_secs(2), now), now)
}

/// Runs the clock for `span`, a process dying at once whenever one is started; returns the starts.
fn starts_while_crashing(life: &mut Life, from: Instant, span: Duration) -> u32 {
    let mut now = from;
    let before = life.incarnation();
    while now < from + span {
        if life.due(now) == Some(Action::Spawn) {
            life.spawned(now);
            now += MS;
            life.ended(false, now);
        }
        now += MS;
    }
    life.incarnation() - before
}

#[test]
fn a_crash_after_health_restarts_at_once() {
    let (mut life, mut now) = life("always");
    for _ in 0..3 {
        assert_eq!(life.due(now), Some(Action::Spawn));
        life.spawned(now);
        life.ready(now + 30 * MS);
        now += Duration::from_secs(6);
        life.ended(false, now);
    }
    assert_eq!(life.due(now), Some(Action::Spawn));
    assert_eq!((life.restarts(), life.word()), (2, "waiting"));
}

#[test]
fn a_service_that_always_dies_is_started_ever_more_rarely() {
    let (mut life, now) = life("always");
    // 0, 0, 50, 150, 350, 750, 1550, 3150, 5150, 7150, 9150 ms.
    assert_eq!(starts_while_crashing(&mut life, now, Duration::from_secs(10)), 11);
    assert_eq!(starts_while_crashing(&mut life, now + Duration::from_secs(10), Duration::from_secs(20)), 10);
    assert_eq!(life.word(), "failing");
}

#[test]
fn a_slow_start_that_fails_is_no_health() {
    let (mut life, t) = life("always");
    let mut now = t;
    // Each start works for 9 s and dies, or is killed at 10 s, without ever being ready.
    for (failures, ends) in [false, true, false, true, false].into_iter().enumerate() {
        let due = life.deadline().unwrap();
        assert_eq!(due, now + RestartPolicy::default().delay(failures as u32), "after {failures} failures");
        assert_eq!(life.due(due), Some(Action::Spawn));
        life.spawned(due);
        now = due + if ends { Duration::from_secs(9) } else { Duration::from_secs(10) };
        assert_eq!(life.due(now), (!ends).then_some(Action::KillLate));
        life.ended(false, now);
    }
    assert_eq!(life.word(), "failing");
    // Ready for too short a time is none either.
    let due = life.deadline().unwrap();
    life.spawned(due);
    life.ready(due + Duration::from_secs(9));
    now = due + Duration::from_secs(10);
    life.ended(false, now);
    assert!(life.deadline().unwrap() > now);
}

#[test]
fn policies_decide_what_a_clean_exit_means() {
    for (policy, success, word) in [
        ("always", true, "waiting"),
        ("always", false, "waiting"),
        ("on-failure", true, "ended"),
        ("on-failure", false, "waiting"),
        ("never", true, "ended"),
        ("never", false, "ended"),
    ] {
        let (mut life, now) = life(policy);
        life.spawned(now);
        life.ready(now);
        life.ended(success, now + MS);
        assert_eq!(life.word(), word, "{policy} {success}");
    }
}

#[test]
fn silence_is_killed_and_beats_prevent_it() {
    let (mut life, t) = life("always");
    life.spawned(t);
    assert_eq!(life.due(t + 9999 * MS), None);
    life.ready(t + 100 * MS);
    assert_eq!(life.due(t + 599 * MS), None);
    life.beat(t + 599 * MS);
    assert_eq!(life.due(t + 1098 * MS), None);
    assert_eq!(life.deadline(), Some(t + 1099 * MS));
    life.forgive(t + 1098 * MS);
    assert_eq!(life.due(t + 1597 * MS), None);
    assert_eq!(life.due(t + 1598 * MS), Some(Action::KillHung));
    assert_eq!(life.due(t + 1599 * MS), None, "said once");
    life.ended(false, t + 1600 * MS);
    assert_eq!(life.due(t + 1600 * MS), Some(Action::Spawn));
}

#[test]
fn a_start_that_never_becomes_ready_is_killed() {
    let (mut life, t) = life("always");
    life.spawned(t);
    life.beat(t + 9 * Duration::from_secs(1));
    assert_eq!(life.due(t + Duration::from_secs(10)), Some(Action::KillLate));
}

#[test]
fn hold_and_release() {
    let (mut life, t) = life("always");
    life.spawned(t);
    life.ready(t);
    assert_eq!(life.hold(t), Ok(Some(Action::Terminate)));
    assert!(life.hold(t).is_err() && life.restart(t).is_err());
    assert_eq!(life.due(t + 1999 * MS), None);
    assert_eq!(life.due(t + 2000 * MS), Some(Action::Kill));
    life.ended(false, t + 2001 * MS);
    assert_eq!((life.word(), life.deadline()), ("held", None));
    assert_eq!(life.due(t + 99_000 * MS), None);
    assert_eq!(life.release(t + 99_000 * MS), Ok(()));
    assert!(life.release(t + 99_000 * MS).is_err());
    assert_eq!(life.due(t + 99_000 * MS), Some(Action::Spawn));
}

#[test]
fn a_wanted_restart_is_immediate_and_forgets_failures() {
    let (mut life, t) = life("never");
    starts_while_crashing(&mut life, t, 10 * MS);
    assert_eq!(life.word(), "ended");
    assert_eq!(life.restart(t + 20 * MS), Ok(None));
    assert_eq!(life.due(t + 20 * MS), Some(Action::Spawn));
    life.spawned(t + 20 * MS);
    life.ready(t + 21 * MS);
    assert_eq!(life.restart(t + 30 * MS), Ok(Some(Action::Terminate)));
    life.ended(true, t + 31 * MS);
    assert_eq!(life.due(t + 31 * MS), Some(Action::Spawn));
}

#[test]
fn stopping_ends_everything_for_good() {
    for prepare in [0, 1, 2, 3] {
        let (mut life, t) = life("always");
        if prepare > 0 {
            life.spawned(t);
        }
        if prepare > 1 {
            life.ready(t);
        }
        if prepare > 2 {
            assert_eq!(life.restart(t), Ok(Some(Action::Terminate)));
        }
        let wanted = matches!(prepare, 1 | 2).then_some(Action::Terminate);
        assert_eq!(life.stop(500 * MS, t), wanted, "{prepare}");
        if prepare > 0 {
            assert_eq!(life.due(t + 500 * MS), Some(Action::Kill));
            life.ended(false, t + 501 * MS);
        }
        assert_eq!((life.word(), life.due(t + 9000 * MS)), ("ended", None));
    }
}
