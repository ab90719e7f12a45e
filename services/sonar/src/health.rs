//! What the recent readings of a sensor say about it.

use ipc_types::{SonarHealth, SonarStatus};

/// When a sensor is no longer relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HealthRules {
    /// Faults in a row.
    pub silent_after: u32,
    /// Answers in a row that make it good again.
    pub good_after: u32,
    /// The same range in a row, while others see movement.
    pub stuck_after: u32,
}

/// Ranges that differ by less are the same, metres: a tenth of the sensor's quantum (FACTS 2).
const SAME_M: f32 = 0.000_3;
/// A change by more is movement, metres: several times the sensor's noise.
const MOVED_M: f32 = 0.03;
/// Movements that others must have seen while a sensor kept saying the same.
const OTHERS_MOVED: u32 = 10;

/// The record of one sensor.
#[derive(Clone, Copy, Debug)]
pub struct SensorHealth {
    faults: u32,
    answers: u32,
    silent: bool,
    last_m: f32,
    same: u32,
    moves: u32,
    /// What others had seen when the present run of equal readings began.
    others_at_start: u32,
    others_now: u32,
}

impl Default for SensorHealth {
    fn default() -> Self {
        Self {
            faults: 0,
            answers: 0,
            silent: false,
            last_m: f32::NAN,
            same: 0,
            moves: 0,
            others_at_start: 0,
            others_now: 0,
        }
    }
}

impl SensorHealth {
    /// Takes one reading. `all_moves` is the sum of [`Self::moves`] over all sensors.
    pub fn take(&mut self, status: SonarStatus, range_m: f32, all_moves: u32, rules: &HealthRules) {
        self.others_now = all_moves.wrapping_sub(self.moves);
        match status {
            SonarStatus::Fault => {
                self.faults += 1;
                self.answers = 0;
                self.silent |= self.faults >= rules.silent_after;
            }
            SonarStatus::Ok | SonarStatus::NoEcho => {
                self.answers += 1;
                self.faults = 0;
                self.silent &= self.answers < rules.good_after;
            }
        }
        if status != SonarStatus::Ok {
            // Hearing nothing again and again is what an open room sounds like.
            self.same = 0;
            return;
        }
        let change = (range_m - self.last_m).abs();
        if change <= SAME_M {
            self.same = self.same.saturating_add(1);
        } else {
            self.same = 0;
            self.others_at_start = self.others_now;
            if change > MOVED_M {
                self.moves = self.moves.wrapping_add(1);
            }
        }
        self.last_m = range_m;
    }

    /// How often the sensor has seen its range change.
    #[must_use]
    pub fn moves(&self) -> u32 {
        self.moves
    }

    /// The verdict.
    #[must_use]
    pub fn verdict(&self, rules: &HealthRules) -> SonarHealth {
        let others = self.others_now.wrapping_sub(self.others_at_start);
        if self.silent {
            SonarHealth::Silent
        } else if self.same >= rules.stuck_after && others >= OTHERS_MOVED {
            SonarHealth::Stuck
        } else {
            SonarHealth::Good
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: HealthRules = HealthRules { silent_after: 3, good_after: 2, stuck_after: 20 };

    #[test]
    fn faults_in_a_row_make_a_sensor_silent_and_answers_good_again() {
        let mut s = SensorHealth::default();
        let mut verdicts = Vec::new();
        use SonarStatus::{Fault, NoEcho, Ok};
        for status in [Fault, Fault, Ok, Fault, Fault, Fault, Ok, Fault, Ok, NoEcho] {
            s.take(status, 1.0, 0, &RULES);
            verdicts.push(s.verdict(&RULES).code());
        }
        assert_eq!(verdicts, [0, 0, 0, 0, 0, 1, 1, 1, 1, 0]);
    }

    /// Returns the verdict on a sensor that always says 1 m while another one's range grows by `change`
    /// each time.
    fn beside(change: f32) -> SonarHealth {
        let (mut still, mut other) = (SensorHealth::default(), SensorHealth::default());
        for i in 0..60 {
            let all = still.moves() + other.moves();
            still.take(SonarStatus::Ok, 1.0, all, &RULES);
            other.take(SonarStatus::Ok, 1.0 + change * i as f32, all, &RULES);
        }
        still.verdict(&RULES)
    }

    #[test]
    fn the_same_range_is_stuck_only_while_others_move() {
        assert_eq!(beside(0.05), SonarHealth::Stuck);
        assert_eq!(beside(0.0), SonarHealth::Good, "all stand still: the drone is on the ground");
    }

    #[test]
    fn a_range_that_changes_again_is_no_longer_stuck() {
        let mut s = SensorHealth::default();
        for i in 0..30 {
            s.take(SonarStatus::Ok, 1.0, i, &RULES);
        }
        assert_eq!(s.verdict(&RULES), SonarHealth::Stuck);
        s.take(SonarStatus::Ok, 1.2, 31, &RULES);
        assert_eq!(s.verdict(&RULES), SonarHealth::Good);
    }
}
