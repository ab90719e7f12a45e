//! `sereno demo --kills N`: SIGKILL at random moments of the flight, and what came of it.

use anyhow::{Context, Result};
use cli::witness::Witness;
use ipc_types::{FailsafeAction, FailsafeCause, Phase};
use runtime::mix_seed;
use rustix::process::{Pid, Signal, kill_process};
use std::path::PathBuf;
use std::time::Duration;

/// Without these no flight goes on; each is to be no more than a hiccup.
const VICTIMS: [&str; 5] = ["localization", "navigation", "sonar", "pilot", "flight"];
/// The shortest and longest time from one kill to the next, seconds: longer than [`SETTLED`], so that what each leaves
/// behind is seen, and short enough for fifty in a round.
const GAP_S: [f64; 2] = [3.0, 9.0];
/// So long after a kill the place is to be known again.
const SETTLED: Duration = Duration::from_secs(2);
/// How well it is to be known then, metres.
const KNOWN_M: f32 = 0.3;

/// Kills still to come, and what was seen of those that were.
pub(crate) struct Kills {
    run_dir: PathBuf,
    seed: u64,
    to_come: Vec<&'static str>,
    done: Vec<(Duration, &'static str)>,
    next: Option<Duration>,
    worst_m: f32,
    worst: Option<(FailsafeAction, FailsafeCause)>,
}

impl Kills {
    /// `each` kills of every service, in an order and at moments drawn from `seed`.
    pub(crate) fn new(run_dir: PathBuf, each: u32, seed: u64) -> Self {
        let mut to_come: Vec<&str> = (0..each).flat_map(|_| VICTIMS).collect();
        // Fisher and Yates.
        for last in (1..to_come.len()).rev() {
            to_come.swap(last, (mix_seed(seed, last as u64) % (last as u64 + 1)) as usize);
        }
        Self { run_dir, seed, to_come, done: Vec::new(), next: None, worst_m: 0.0, worst: None }
    }

    fn draw_gap(&self) -> Duration {
        let share = (mix_seed(!self.seed, self.to_come.len() as u64) >> 11) as f64 / (1u64 << 53) as f64;
        Duration::from_secs_f64(GAP_S[0] + share * (GAP_S[1] - GAP_S[0]))
    }

    /// Notes what is to be seen `elapsed` after the start, and kills when it is time. The first one goes while the
    /// drone arms or climbs; none does on the ground after the flight.
    pub(crate) fn look(&mut self, elapsed: Duration, witness: &Witness) -> Result<()> {
        let phase = witness.last_pilot.and_then(|state| Phase::from_code(state.phase));
        if matches!(phase, None | Some(Phase::Grounded)) && self.done.is_empty() || witness.landed() {
            return Ok(());
        }
        self.note(elapsed, witness);
        let next = self.next.unwrap_or_else(|| elapsed + self.draw_gap() / 4);
        self.next = Some(next);
        if elapsed < next {
            return Ok(());
        }
        let Some(victim) = self.to_come.pop() else { return Ok(()) };
        let services = supervisor::Client::connect(&self.run_dir)?.ps()?.services;
        let pid = services.iter().find(|row| row.name == victim).and_then(|row| row.pid);
        // One that is just being started again is killed in its start the next time.
        if let Some(pid) = pid.and_then(|pid| Pid::from_raw(pid.cast_signed())) {
            kill_process(pid, Signal::KILL).with_context(|| format!("cannot kill {victim}"))?;
            self.done.push((elapsed, victim));
        } else {
            self.to_come.insert(0, victim);
        }
        self.next = Some(elapsed + self.draw_gap());
        Ok(())
    }

    fn note(&mut self, elapsed: Duration, witness: &Witness) {
        let Some((last, _)) = self.done.last() else { return };
        if let Some(state) = witness.last_pilot
            && let Some(action) = FailsafeAction::from_code(state.action)
            && let Some(cause) = FailsafeCause::from_code(state.cause)
            && action != FailsafeAction::None
            && may_follow_from_a_kill(cause)
            && self.worst.is_none_or(|(worst, _)| action.code() > worst.code())
        {
            self.worst = Some((action, cause));
        }
        let (Some(truth), Some(pose)) = (witness.last_truth, witness.last_pose) else { return };
        if elapsed > *last + SETTLED && truth.on_ground == 0 {
            // What is believed now against where it is now: an estimate that stands still is wrong.
            self.worst_m = self.worst_m.max((truth.x_m - pose.x_m).hypot(truth.y_m - pose.y_m));
        }
    }

    /// Whether all were done, and each was no more than a hover.
    pub(crate) fn shrugged_off(&self) -> bool {
        self.to_come.is_empty()
            && self.worst_m <= KNOWN_M
            && self.worst.is_none_or(|(action, _)| action.code() <= FailsafeAction::Hover.code())
    }

    /// For programs.
    pub(crate) fn report(&self) -> serde_json::Value {
        let of = |victim: &str| self.done.iter().filter(|(_, name)| *name == victim).count();
        let by_service: serde_json::Map<_, _> =
            VICTIMS.iter().map(|victim| ((*victim).to_owned(), of(victim).into())).collect();
        serde_json::json!({
            "done": self.done.len(),
            "to_come": self.to_come.len(),
            "by_service": by_service,
            "first_s": self.done.first().map(|(at, _)| at.as_secs_f64()),
            "last_s": self.done.last().map(|(at, _)| at.as_secs_f64()),
            "worst_error_m": self.worst_m,
            "worst_action": self.worst.map(|(action, _)| action.to_string()),
            "worst_cause": self.worst.map(|(_, cause)| cause.to_string()),
        })
    }

    /// For people.
    pub(crate) fn sentence(&self) -> String {
        let worst =
            self.worst.map_or_else(|| "nothing".to_owned(), |(action, cause)| format!("{cause}: {action}"));
        format!(
            "{} kills, {} to come; later than {} s after one the place was off by {:.1} cm at most; the worst that they led to: {worst}",
            self.done.len(),
            self.to_come.len(),
            SETTLED.as_secs(),
            100.0 * self.worst_m
        )
    }
}

/// No kill empties a battery: a long round ends on it with kills and without.
fn may_follow_from_a_kill(cause: FailsafeCause) -> bool {
    !matches!(cause, FailsafeCause::BatteryReturn | FailsafeCause::BatteryLand)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_battery_that_runs_low_is_not_the_kills_doing() {
        assert!(!may_follow_from_a_kill(FailsafeCause::BatteryReturn));
        assert!(!may_follow_from_a_kill(FailsafeCause::BatteryLand));
        for cause in [FailsafeCause::NavigationSilent, FailsafeCause::PoseUncertain, FailsafeCause::Lost] {
            assert!(may_follow_from_a_kill(cause), "{cause}");
        }
    }

    #[test]
    fn every_service_has_its_turns_in_an_order_of_the_seed() {
        let order = |seed| Kills::new(PathBuf::new(), 10, seed).to_come;
        let first = order(1);
        for victim in VICTIMS {
            assert_eq!(first.iter().filter(|name| **name == victim).count(), 10, "{victim}");
        }
        assert_eq!(first, order(1));
        assert_ne!(first, order(2));
    }

    #[test]
    fn gaps_are_long_enough_to_see_what_a_kill_leaves_behind() {
        let mut kills = Kills::new(PathBuf::new(), 40, 3);
        let mut gaps = Vec::new();
        while kills.to_come.pop().is_some() {
            gaps.push(kills.draw_gap());
        }
        assert!(gaps.iter().all(|gap| *gap > SETTLED && *gap <= Duration::from_secs(9)));
        gaps.sort();
        gaps.dedup();
        assert!(gaps.len() > 150, "they differ");
    }
}
