//! What was expected against what was seen.

use super::file::action_of;
use super::{Scenario, Seen};
use ipc_types::FailsafeCause;

/// As near to the pad's middle it stands on the pad, metres (the scorer's bound).
const ON_PAD_M: f32 = 0.35;

/// Every expectation that was not met, as a sentence each.
#[must_use]
pub fn failures(scenario: &Scenario, seen: &Seen) -> Vec<String> {
    let mut told = Told::default();
    beginnings(scenario, seen, &mut told);
    ending(scenario, seen, &mut told);
    failsafes(scenario, seen, &mut told);
    quality(scenario, seen, &mut told);
    told.0
}

/// Sentences.
#[derive(Default)]
struct Told(Vec<String>);

impl Told {
    fn unless(&mut self, met: bool, sentence: impl FnOnce() -> String) {
        if !met {
            self.0.push(sentence());
        }
    }
}

fn or_never(time_s: Option<f64>) -> String {
    time_s.map_or_else(|| "never".to_owned(), |time| format!("{time:.1} s"))
}

/// A flight that is over before something breaks proves nothing about what comes of it.
fn beginnings(scenario: &Scenario, seen: &Seen, told: &mut Told) {
    for (index, fault) in scenario.faults.iter().enumerate() {
        let Some(from_s) = fault.from_s else { continue };
        told.unless(seen.begun.get(index) == Some(&true), || {
            let number = index + 1;
            let over = or_never(seen.ended_s);
            format!("the flight was over before fault {number} began at {from_s} s (down after {over})")
        });
    }
}

/// Where and how it ended.
fn ending(scenario: &Scenario, seen: &Seen, told: &mut Told) {
    let expect = &scenario.expect;
    let flew = seen.took_off_s.is_some();
    if let Some(flies) = expect.flies {
        told.unless(flew == flies, || {
            let word = |flew| if flew { "it flies" } else { "it stays on the ground" };
            format!("expected that {}, but {} (\"{}\")", word(flies), word(flew), seen.answer)
        });
    }
    if let Some(words) = &expect.refused {
        told.unless(seen.answer.starts_with("refused") && seen.answer.contains(words), || {
            format!("expected a refusal with \"{words}\", saw the answer \"{}\"", seen.answer)
        });
    }
    if let Some(landed) = expect.landed {
        told.unless(seen.landed == landed, || {
            let word = |landed| if landed { "landed and disarmed" } else { "not landed" };
            format!("expected {} at the end, saw {} ({})", word(landed), word(seen.landed), seen.phase)
        });
    }
    if let Some(on_pad) = expect.on_pad {
        told.unless((seen.landed && seen.off_pad_m <= ON_PAD_M) == on_pad, || {
            let word = if on_pad { "the end on the pad" } else { "the end off the pad" };
            format!("expected {word}, saw it {:.2} m from its middle ({})", seen.off_pad_m, seen.phase)
        });
    }
    if let Some(most) = expect.within_m_of_start {
        let away = (seen.place.0 - seen.start.0).hypot(seen.place.1 - seen.start.1);
        told.unless(flew && away <= most, || {
            format!("expected the end within {most} m of the start, saw it {away:.2} m away")
        });
    }
    if let Some(phase) = &expect.phase {
        told.unless(seen.phase == *phase, || {
            format!("expected the phase {phase} at the end, saw {}", seen.phase)
        });
    }
    if let Some(by) = expect.ends_by_s {
        told.unless(seen.ended_s.is_some_and(|ended| ended <= by), || {
            format!("expected it down by {by} s, saw it down after {}", or_never(seen.ended_s))
        });
    }
    if let Some(least) = expect.by_hand_s {
        told.unless(seen.by_hand_s >= least, || {
            format!("expected at least {least} s by hand, saw {:.1} s", seen.by_hand_s)
        });
    }
    if let Some(most) = expect.by_hand_at_most_s {
        told.unless(seen.by_hand_s <= most, || {
            format!("expected at most {most} s by hand, saw {:.1} s", seen.by_hand_s)
        });
    }
    if let Some(least) = expect.by_hand_m {
        told.unless(seen.by_hand_m >= least, || {
            format!("expected at least {least} m by hand, saw {:.2} m", seen.by_hand_m)
        });
    }
    if let Some(held) = expect.held {
        told.unless(seen.held == held, || {
            let word = |held| if held { "held" } else { "nobody's" };
            format!("expected the sticks to be {} at the end, saw them {}", word(held), word(seen.held))
        });
    }
    if let Some(most) = expect.armings {
        told.unless(seen.armings <= most, || {
            format!("expected at most {most} armings, saw {}", seen.armings)
        });
    }
}

/// Which failsafes acted.
fn failsafes(scenario: &Scenario, seen: &Seen, told: &mut Told) {
    let expect = &scenario.expect;
    let all = || {
        let told: Vec<String> =
            seen.failsafes.iter().map(|f| format!("{} after {:.1} s", f.text, f.at_s)).collect();
        if told.is_empty() { "none".to_owned() } else { told.join(", ") }
    };
    for wanted in &expect.failsafes {
        told.unless(seen.failsafes.iter().any(|failsafe| failsafe.text == *wanted), || {
            format!("expected the failsafe \"{wanted}\", saw {}", all())
        });
    }
    if let (Some(within), Some(wanted)) = (expect.failsafe_within_s, expect.failsafes.first()) {
        let first = seen.failsafes.iter().find(|failsafe| failsafe.text == *wanted);
        if let Some(first) = first {
            let late = first.at_s - scenario.trouble_s();
            told.unless(late <= within, || {
                format!("expected \"{wanted}\" within {within} s of the fault, saw it after {late:.2} s")
            });
        }
    }
    if let Some(most) = expect.no_failsafe_worse_than.as_deref().and_then(action_of) {
        let worse = seen.failsafes.iter().find(|failsafe| {
            failsafe.cause != FailsafeCause::Operator && failsafe.action.code() > most.code()
        });
        told.unless(worse.is_none(), || format!("expected no failsafe worse than {most}, saw {}", all()));
    }
}

/// How well it flew.
fn quality(scenario: &Scenario, seen: &Seen, told: &mut Told) {
    let expect = &scenario.expect;
    if let Some(most) = expect.contacts {
        told.unless(seen.contacts <= most, || {
            let first = seen.first_contact.map_or_else(String::new, |(at, x, y)| {
                format!(", the first after {at:.1} s at {x:.2} {y:.2}")
            });
            format!("expected at most {most} contacts, saw {}{first}", seen.contacts)
        });
    }
    if let Some(least) = expect.clearance_m {
        told.unless(seen.clearance_m >= least, || {
            format!("expected {least} m of clearance, saw {:.3} m", seen.clearance_m)
        });
    }
    if let Some(within) = expect.stopped_within_s {
        let late = seen.stopped_s.map(|at| at - scenario.trouble_s());
        told.unless(late.is_some_and(|late| late <= within), || {
            format!(
                "expected it to stop within {within} s of the fault, saw it stand after {}",
                or_never(late)
            )
        });
    }
    if let Some(most) = expect.touch_down_m_s {
        told.unless(seen.touch_down_m_s.is_some_and(|speed| speed <= most), || {
            let speed =
                seen.touch_down_m_s.map_or_else(|| "none".to_owned(), |s| format!("one at {s:.2} m/s"));
            format!("expected a touch-down at {most} m/s at most, saw {speed}")
        });
    }
    if let Some(within) = expect.found_again_within_s {
        let late = seen.wrong_until_s.map_or(0.0, |at| at - scenario.trouble_s());
        told.unless(seen.took_off_s.is_some() && late <= within, || {
            format!("expected its place known {within} s after the fault, saw it wrong by over 0.5 m until {late:.1} s")
        });
    }
    if let Some(most) = expect.error_m {
        told.unless(seen.error_m <= most, || {
            format!("expected its place known to {most} m, saw an error of {:.2} m", seen.error_m)
        });
    }
    if let Some(most) = expect.reaches_m {
        told.unless(seen.goal_m.is_some_and(|away| away <= most), || {
            let away = seen.goal_m.map_or_else(|| "no flight".to_owned(), |away| format!("{away:.2} m"));
            format!("expected it within {most} m of where it was sent, saw {away}")
        });
    }
    if let Some(most) = expect.height_m {
        told.unless(seen.height_m <= most, || {
            format!("expected it never over {most} m high, saw {:.2} m", seen.height_m)
        });
    }
}
