//! How honest the drone is about not knowing where it is: P(lost) against the truth.

use super::report::rounded;
use serde::{Deserialize, Serialize};

/// An estimate farther from the truth than this is a wrong one, metres.
pub const WRONG_M: f32 = 1.0;
/// One nearer than this is a right one, metres.
const RIGHT_M: f32 = 0.5;
/// Below this P(lost) the drone says that it is sure.
pub const SURE: f32 = 0.01;
/// Above this it says that it may be lost: autonomy stops (DESIGN 4).
const ALARM: f32 = 0.05;
/// An alarm that is right this long before or after is none that is false, seconds: the truth of a displacement comes at
/// once, and what was right all along is wrong for nobody.
const ALARM_S: f64 = 1.0;
/// Edges of the classes of P(lost) in which the share of wrong time is compared with what was said.
pub const EDGES: [f32; 9] = [0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 0.7, 0.95, 1.0];
const CLASSES: usize = EDGES.len() - 1;

/// One class of P(lost).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Class {
    /// Of P(lost) in it.
    pub from: f64,
    /// Of P(lost) in it.
    pub to: f64,
    /// Time in the air with such a P(lost), seconds.
    pub time_s: f64,
    /// Of that with an estimate more than [`WRONG_M`] off, seconds.
    pub wrong_s: f64,
}

/// The figures of one flight, or of several together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Honesty {
    /// Time in the air with an estimate, seconds.
    pub time_s: f64,
    /// Of that more than 1 m off while P(lost) was under 1 %, seconds.
    pub wrong_while_sure_s: f64,
    /// The longest such time in a row, seconds.
    pub longest_wrong_while_sure_s: f64,
    /// Each time that an estimate became wrong in the air: seconds until P(lost) passed 5 %; `null` when it never did
    /// while it was wrong.
    pub noticed_s: Vec<Option<f64>>,
    /// Times that P(lost) passed 5 % with the estimate less than 0.5 m off.
    pub false_alarms: u32,
    /// How often what was said was so.
    pub calibration: Vec<Class>,
}

impl Honesty {
    /// Adds another flight's figures.
    pub fn add(&mut self, other: &Self) {
        self.time_s += other.time_s;
        self.wrong_while_sure_s += other.wrong_while_sure_s;
        self.longest_wrong_while_sure_s =
            self.longest_wrong_while_sure_s.max(other.longest_wrong_while_sure_s);
        self.noticed_s.extend_from_slice(&other.noticed_s);
        self.false_alarms += other.false_alarms;
        if self.calibration.is_empty() {
            self.calibration.clone_from(&other.calibration);
            return;
        }
        for (class, more) in self.calibration.iter_mut().zip(&other.calibration) {
            class.time_s += more.time_s;
            class.wrong_s += more.wrong_s;
        }
    }

    /// With figures rounded to a tenth of a millisecond: equal text on every machine.
    #[must_use]
    pub(crate) fn rounded(mut self) -> Self {
        let round = |value: &mut f64| *value = rounded(*value as f32);
        round(&mut self.time_s);
        round(&mut self.wrong_while_sure_s);
        round(&mut self.longest_wrong_while_sure_s);
        self.noticed_s.iter_mut().flatten().for_each(round);
        for class in &mut self.calibration {
            round(&mut class.time_s);
            round(&mut class.wrong_s);
        }
        self
    }
}

/// Follows P(lost) through one flight.
#[derive(Clone, Debug, Default)]
pub(crate) struct Confessor {
    time_s: f64,
    wrong_while_sure_s: f64,
    run_s: f64,
    longest_s: f64,
    noticed: Vec<Option<f64>>,
    /// When the estimate became wrong, while it is wrong and unnoticed.
    wrong_since: Option<f64>,
    was_wrong: bool,
    /// When the alarm began, while it may still turn out right.
    alarm_since: Option<f64>,
    alarmed: bool,
    false_alarms: u32,
    classes: [(f64, f64); CLASSES],
}

impl Confessor {
    /// One look in the air: the error of the estimate, metres, and P(lost).
    pub(crate) fn hear(&mut self, now_s: f64, dt_s: f64, error: f32, p_lost: f32) {
        let p = if p_lost.is_nan() { 1.0 } else { p_lost.clamp(0.0, 1.0) };
        // An error that is no number is as wrong as can be.
        let wrong = error.is_nan() || error > WRONG_M;
        self.time_s += dt_s;
        let class = EDGES[1..CLASSES].iter().take_while(|edge| p >= **edge).count();
        self.classes[class].0 += dt_s;
        if wrong {
            self.classes[class].1 += dt_s;
        }
        if wrong && p < SURE {
            self.wrong_while_sure_s += dt_s;
            self.run_s += dt_s;
            self.longest_s = self.longest_s.max(self.run_s);
        } else {
            self.run_s = 0.0;
        }
        if wrong && !self.was_wrong {
            self.wrong_since = Some(now_s);
        }
        if let Some(since) = self.wrong_since {
            if p > ALARM {
                self.noticed.push(Some(now_s - since));
                self.wrong_since = None;
            } else if !wrong {
                self.noticed.push(None);
                self.wrong_since = None;
            }
        }
        self.was_wrong = wrong;
        let alarmed = p > ALARM;
        if alarmed && !self.alarmed {
            self.alarm_since = Some(now_s);
        }
        self.alarmed = alarmed;
        if let Some(since) = self.alarm_since {
            if error.is_nan() || error > RIGHT_M {
                self.alarm_since = None;
            } else if now_s - since >= ALARM_S || !alarmed {
                self.false_alarms += 1;
                self.alarm_since = None;
            }
        }
    }

    pub(crate) fn finish(mut self) -> Honesty {
        if self.wrong_since.is_some() {
            self.noticed.push(None);
        }
        let calibration = EDGES
            .windows(2)
            .zip(self.classes)
            .map(|(edges, (time_s, wrong_s))| Class {
                from: rounded(edges[0]),
                to: rounded(edges[1]),
                time_s,
                wrong_s,
            })
            .collect();
        Honesty {
            time_s: self.time_s,
            wrong_while_sure_s: self.wrong_while_sure_s,
            longest_wrong_while_sure_s: self.longest_s,
            noticed_s: self.noticed,
            false_alarms: self.false_alarms,
            calibration,
        }
        .rounded()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flown(looks: &[(u32, f32, f32)]) -> Honesty {
        let mut confessor = Confessor::default();
        let mut tick = 0;
        for (ticks, error, p) in looks {
            for _ in 0..*ticks {
                tick += 1;
                confessor.hear(f64::from(tick) * 0.1, 0.1, *error, *p);
            }
        }
        confessor.finish()
    }

    #[test]
    fn being_wrong_and_sure_is_counted_and_noticing_it_is_timed() {
        let h =
            flown(&[(100, 0.1, 0.001), (30, 2.0, 0.005), (20, 2.0, 0.02), (50, 2.0, 0.9), (50, 0.1, 0.001)]);
        assert!((h.time_s - 25.0).abs() < 1e-3 && (h.wrong_while_sure_s - 3.0).abs() < 1e-3, "{h:?}");
        assert!((h.longest_wrong_while_sure_s - 3.0).abs() < 1e-3);
        assert_eq!(h.noticed_s.len(), 1);
        assert!((h.noticed_s[0].unwrap() - 5.0).abs() < 1e-3);
        assert_eq!(h.false_alarms, 0);
        let wrong: Vec<f64> = h.calibration.iter().map(|class| class.wrong_s).collect();
        assert!(
            (wrong[1] - 3.0).abs() < 1e-3 && (wrong[2] - 2.0).abs() < 1e-3 && (wrong[6] - 5.0).abs() < 1e-3
        );
        assert!((h.calibration[0].time_s - 15.0).abs() < 1e-3);
    }

    #[test]
    fn an_alarm_beside_a_right_estimate_is_false_and_one_that_comes_a_little_early_is_not() {
        assert_eq!(
            flown(&[(10, 0.1, 0.0), (30, 0.1, 0.2), (10, 0.1, 0.0), (2, 0.1, 0.2), (5, 0.1, 0.0)])
                .false_alarms,
            2
        );
        assert_eq!(flown(&[(10, 0.1, 0.0), (5, 0.3, 0.2), (30, 0.8, 0.2)]).false_alarms, 0);
        assert_eq!(flown(&[(10, 0.1, 0.0), (30, f32::NAN, 0.2)]).false_alarms, 0);
    }

    #[test]
    fn what_was_never_noticed_is_said_and_figures_add_up() {
        let never = flown(&[(10, 0.1, 0.0), (30, 3.0, 0.0), (10, 0.1, 0.0), (10, 3.0, f32::NAN)]);
        assert_eq!(never.noticed_s, [None, Some(0.0)]);
        let mut sum = Honesty::default();
        sum.add(&never);
        sum.add(&never);
        assert!((sum.time_s - 12.0).abs() < 1e-3 && sum.noticed_s.len() == 4);
        assert!((sum.calibration[0].wrong_s - 6.0).abs() < 1e-3);
        assert!((sum.longest_wrong_while_sure_s - never.longest_wrong_while_sure_s).abs() < 1e-9);
    }
}
