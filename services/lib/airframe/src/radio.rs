//! A human with a radio beside the drone: the safety pilot of the `override` set-up (DESIGN 4).
//!
//! He arms when he is asked to, lends the sticks by the override switch, takes them back when what he sees is wrong or when
//! he is told to, and brings the drone down by sight. After a landing he disarms.

/// From seeing something to a finger on a switch, seconds: a simple reaction, and a person who was watching.
const REACTION_S: f64 = 0.7;
/// From armed to lending the sticks, seconds.
const LENDING_S: f64 = 0.5;
/// He takes them back from a drone that leans more than this, radians (30 degrees)...
const WRONG_TILT_RAD: f64 = 0.52;
/// ... or sinks faster, m/s.
const WRONG_SINK_M_S: f64 = 1.5;
/// Higher than this it has flown, metres; lower than the second it stands when it does not move.
const FLOWN_M: f64 = 0.3;
const STANDS_M: f64 = 0.08;
const STILL_M_S: f64 = 0.05;
/// He disarms what has stood for so long after a flight, and what has not left the floor for so long, seconds.
const STANDING_S: f64 = 2.0;
const PATIENCE_S: f64 = 20.0;
/// Where his own throttle stick waits while the sticks are lent: about a hover, so that a firmware that falls back to the
/// radio does not drop the drone.
const WAITING_US: f64 = 1450.0;
/// His landing: rate of descent, and how throttle and sticks answer to what he sees (us a m/s, us a metre).
const LANDING_M_S: f64 = 0.4;
const CLIMB_US: f64 = 150.0;
const TRIM_US: f64 = 100.0;
const DRIFT_US: f64 = 200.0;
const MOST_STICK_US: f64 = 150.0;

const LOW_US: u16 = 1000;
const CENTRE_US: u16 = 1500;
const HIGH_US: u16 = 2000;

/// What he sees and hears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Simulated time, seconds.
    pub time_s: f64,
    /// Feet above the floor, metres.
    pub height_m: f64,
    /// Up positive, m/s.
    pub climb_m_s: f64,
    /// Ahead and to the left of the drone's nose, m/s.
    pub velocity_m_s: [f64; 2],
    /// From the vertical, radians.
    pub tilt_rad: f64,
    /// The motors turn.
    pub armed: bool,
    /// The system asks him to arm.
    pub asked: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Hands {
    /// All switches down; since when he is asked to arm.
    Waiting(Option<f64>),
    /// The arm switch is up; since when it is armed.
    Arming(Option<f64>),
    /// The override switch is up.
    Lent { since_s: f64, flown: bool, stands_s: Option<f64>, wrong_s: Option<f64> },
    /// He flies it down; his feeling for the throttle.
    Flying { trim_us: f64, last_s: f64 },
    /// He has had to take it back: nothing goes on by itself after that.
    Done,
}

/// The safety pilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyPilot {
    hands: Hands,
    take_back_s: Option<f64>,
}

impl SafetyPilot {
    /// With the radio in his hands and all switches down. `take_back_s`: he takes the sticks back so long after he lent
    /// them, whatever he sees.
    #[must_use]
    pub fn new(take_back_s: Option<f64>) -> Self {
        Self { hands: Hands::Waiting(None), take_back_s }
    }

    /// Whether the sticks are lent to the drone's companion.
    #[must_use]
    pub fn lends(&self) -> bool {
        matches!(self.hands, Hands::Lent { .. })
    }

    /// What the radio sends now, in the order of [`Controller::radio`](crate::controller::Controller::radio).
    pub fn step(&mut self, sight: &Sight) -> [u16; 8] {
        self.hands = self.next(sight);
        let mut channels = [CENTRE_US, CENTRE_US, CENTRE_US, LOW_US, LOW_US, HIGH_US, LOW_US, LOW_US];
        match self.hands {
            Hands::Waiting(_) | Hands::Done => {}
            Hands::Arming(_) => channels[4] = HIGH_US,
            Hands::Lent { flown, .. } => {
                channels[4] = HIGH_US;
                channels[6] = HIGH_US;
                if flown {
                    channels[3] = WAITING_US as u16;
                }
            }
            Hands::Flying { trim_us, .. } => {
                let [ahead, left] = sight.velocity_m_s;
                let stick = |drift: f64| {
                    let us = (DRIFT_US * drift).clamp(-MOST_STICK_US, MOST_STICK_US);
                    (f64::from(CENTRE_US) + us).round() as u16
                };
                let throttle = trim_us + CLIMB_US * (-LANDING_M_S - sight.climb_m_s);
                channels[..4].copy_from_slice(&[
                    stick(left),
                    stick(-ahead),
                    CENTRE_US,
                    throttle.round().clamp(LOW_US.into(), 1900.0) as u16,
                ]);
                channels[4] = HIGH_US;
            }
        }
        channels
    }

    fn next(&self, sight: &Sight) -> Hands {
        let now = sight.time_s;
        let since = |at: Option<f64>, seen: bool| if seen { Some(at.unwrap_or(now)) } else { None };
        let for_s = |at: Option<f64>| at.map_or(0.0, |at| now - at);
        match self.hands {
            Hands::Waiting(asked) => {
                let asked = since(asked, sight.asked && !sight.armed);
                if for_s(asked) >= REACTION_S { Hands::Arming(None) } else { Hands::Waiting(asked) }
            }
            Hands::Arming(armed) => {
                let armed = since(armed, sight.armed);
                if for_s(armed) >= LENDING_S {
                    Hands::Lent { since_s: now, flown: false, stands_s: None, wrong_s: None }
                } else if armed.is_none() && !sight.asked {
                    // It was called off.
                    Hands::Waiting(None)
                } else {
                    Hands::Arming(armed)
                }
            }
            Hands::Lent { .. } if !sight.armed => Hands::Waiting(None),
            Hands::Lent { since_s, flown, stands_s, wrong_s } => {
                let flown = flown || sight.height_m > FLOWN_M;
                let stands = sight.height_m < STANDS_M && sight.climb_m_s.abs() < STILL_M_S;
                let stands_s = since(stands_s, stands);
                let wrong = sight.tilt_rad > WRONG_TILT_RAD || sight.climb_m_s < -WRONG_SINK_M_S;
                // What has looked wrong once he answers to, even if it looks right again by then.
                let wrong_s = since(wrong_s, wrong || wrong_s.is_some());
                let told = self.take_back_s.is_some_and(|wait_s| flown && now - since_s >= wait_s);
                if for_s(stands_s) >= if flown { STANDING_S } else { PATIENCE_S } {
                    Hands::Waiting(None)
                } else if told || for_s(wrong_s) >= REACTION_S {
                    Hands::Flying { trim_us: WAITING_US, last_s: now }
                } else {
                    Hands::Lent { since_s, flown, stands_s, wrong_s }
                }
            }
            Hands::Flying { trim_us, last_s } => {
                if !sight.armed || sight.height_m < STANDS_M && sight.climb_m_s.abs() < STILL_M_S {
                    return Hands::Done;
                }
                let error = -LANDING_M_S - sight.climb_m_s;
                let trim_us = (trim_us + TRIM_US * error * (now - last_s)).clamp(1200.0, 1800.0);
                Hands::Flying { trim_us, last_s: now }
            }
            Hands::Done => Hands::Done,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: Sight = Sight {
        time_s: 0.0,
        height_m: 0.0,
        climb_m_s: 0.0,
        velocity_m_s: [0.0; 2],
        tilt_rad: 0.0,
        armed: false,
        asked: false,
    };

    /// Steps of 20 ms with what `see` shows him at each time; the last channels.
    fn watch(pilot: &mut SafetyPilot, from: f64, seconds: f64, see: Sight) -> [u16; 8] {
        let mut channels = [0; 8];
        for step in 0..=(seconds * 50.0).round() as u32 {
            channels = pilot.step(&Sight { time_s: from + 0.02 * f64::from(step), ..see });
        }
        channels
    }

    #[test]
    fn he_arms_when_asked_lends_the_sticks_and_disarms_what_stands() {
        let mut pilot = SafetyPilot::new(None);
        assert_eq!(watch(&mut pilot, 0.0, 60.0, REST)[4], LOW_US, "nobody has asked");
        assert_eq!(
            watch(&mut pilot, 61.0, 0.6, Sight { asked: true, ..REST })[4],
            LOW_US,
            "nobody is that quick"
        );
        let arming = watch(&mut pilot, 61.62, 0.2, Sight { asked: true, ..REST });
        assert_eq!(
            arming,
            [1500, 1500, 1500, 1000, 2000, 2000, 1000, 1000],
            "throttle low, arm up, no override"
        );
        assert_eq!(watch(&mut pilot, 62.0, 0.4, Sight { armed: true, ..REST })[6], LOW_US);
        assert_eq!(watch(&mut pilot, 62.42, 0.2, Sight { armed: true, ..REST })[6], HIGH_US);
        let up = Sight { armed: true, height_m: 1.2, ..REST };
        assert_eq!(watch(&mut pilot, 63.0, 100.0, up)[3..7], [1450, 2000, 2000, 2000]);
        assert_eq!(watch(&mut pilot, 170.0, 1.9, Sight { armed: true, ..REST })[4], HIGH_US);
        assert_eq!(watch(&mut pilot, 171.92, 0.2, Sight { armed: true, ..REST })[4..7], [1000, 2000, 1000]);
    }

    #[test]
    fn he_takes_back_what_leans_or_falls_and_when_told() {
        let up = Sight { armed: true, height_m: 1.2, ..REST };
        let lent = |take_back_s| {
            let mut pilot = SafetyPilot::new(take_back_s);
            watch(&mut pilot, 0.0, 1.0, Sight { asked: true, ..REST });
            watch(&mut pilot, 1.02, 1.0, Sight { armed: true, ..REST });
            assert!(pilot.lends());
            pilot
        };
        for wrong in [Sight { tilt_rad: 0.6, ..up }, Sight { climb_m_s: -2.0, ..up }] {
            let mut pilot = lent(None);
            assert_eq!(watch(&mut pilot, 3.0, 0.6, wrong)[6], HIGH_US, "he is not that quick");
            let channels = watch(&mut pilot, 3.62, 0.2, wrong);
            assert_eq!(channels[4..7], [2000, 2000, 1000], "armed, ANGLE, his own sticks");
        }
        let mut pilot = lent(Some(10.0));
        assert_eq!(watch(&mut pilot, 3.0, 8.0, up)[6], HIGH_US);
        // Sinking at his rate and drifting ahead to the left: throttle as it waited, sticks against the drift.
        let sinking = Sight { climb_m_s: -0.4, velocity_m_s: [0.2, 0.1], ..up };
        assert_eq!(watch(&mut pilot, 13.0, 0.1, sinking)[..7], [1520, 1460, 1500, 1450, 2000, 2000, 1000]);
        // And off when it stands.
        assert_eq!(watch(&mut pilot, 14.0, 0.1, Sight { armed: true, ..REST })[4], LOW_US);
        assert_eq!(watch(&mut pilot, 15.0, 9.0, Sight { asked: true, ..REST })[4], LOW_US, "not again");
    }
}
