//! Faults: what breaks on a flight, when, and for how long.
//!
//! Times count from the take-off (the first moment in the air), so that a list of faults is read without knowing how long
//! arming took. Faults draw from a random stream of their own, and a flight without faults draws nothing from it: it is
//! bit for bit the flight that it was before there were any.

mod active;
mod echoes;
mod file;
mod line;
#[cfg(test)]
mod tests;

pub use file::FaultError;

pub(super) use active::{Change, Effects, Faults};

use serde::Deserialize;

/// One fault and its time.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "file::Entry")]
pub struct Fault {
    /// Seconds after the take-off at which it begins; `None`: it is there from the start.
    pub from_s: Option<f64>,
    /// Seconds after the take-off at which it ends; `None`: never.
    pub until_s: Option<f64>,
    /// What breaks.
    pub kind: FaultKind,
}

/// What breaks.
#[derive(Clone, Debug, PartialEq)]
pub enum FaultKind {
    /// Sonars, by the names of the vehicle file; `all`, or `sides` for all that do not look up or down.
    Sonars {
        /// Which.
        sonars: Vec<String>,
        /// What they do instead.
        does: SonarFault,
    },
    /// The compass is off by so much, degrees counter-clockwise: a steel cabinet, a cable that carries current.
    CompassSwing {
        /// Added to what it shows.
        degrees: f64,
    },
    /// More resistance: an old pack, a loose plug, ohm.
    BatterySag {
        /// On top of the pack's own.
        ohm: f64,
    },
    /// The pack holds less than it should: its charge falls at once, and the controller's count knows nothing of it.
    BatteryCharge {
        /// Share of a full pack that is left, if there was more.
        charge: f64,
    },
    /// One cell gives nothing any more.
    BatteryCell,
    /// A motor has lost a part of its thrust: a chipped propeller, a worn bearing.
    MotorWeak {
        /// Index in the order rear right, front right, rear left, front left.
        motor: usize,
        /// Share of the thrust that is lost.
        share: f64,
    },
    /// A draught: a window, a ventilator.
    Gust {
        /// Acceleration, m/s^2.
        m_s2: f64,
        /// Where it blows to, degrees counter-clockwise from world x.
        degrees: f64,
    },
    /// The flight controller restarts: motors off, then it boots as it did at first, disarmed.
    ControllerReboot {
        /// Until it boots.
        seconds: f64,
    },
    /// The serial line of the flight controller.
    Serial {
        /// Which way.
        line: Direction,
        /// What happens to the bytes.
        does: LineFault,
    },
    /// The flow sensor sends nothing.
    FlowSilent,
    /// The flow sensor sees little: a dirty lens, a dark floor.
    FlowPoor {
        /// Share of the contrast that is left.
        share: f64,
    },
    /// The drone is suddenly elsewhere, and nothing on board has felt it; in the next direction round that is free.
    CarriedOff {
        /// How far, metres.
        metres: f64,
        /// Where to, degrees counter-clockwise from world x.
        degrees: f64,
    },
    /// A door of the plan is shut; at its end it opens again.
    DoorShuts {
        /// Name in the plan's side file.
        name: String,
    },
    /// A door of the plan that the world shuts is opened; at its end it is shut again.
    DoorOpens {
        /// Name in the plan's side file.
        name: String,
    },
    /// Somebody appears, walks straight up to the drone and follows it; at its end they are gone.
    PersonComes {
        /// Where they appear, world frame, metres.
        place: (f32, f32),
        /// Walking speed, m/s.
        m_s: f32,
        /// How near they come, centre to centre, metres.
        up_to_m: f32,
    },
}

/// What a sonar does instead of its work.
#[derive(Clone, Debug, PartialEq)]
pub enum SonarFault {
    /// No answer at all: a cable off.
    Dead,
    /// It answers and never hears an echo: a broken receiver.
    Deaf,
    /// Always the same range: this one, metres, or the last before the fault.
    Stuck {
        /// The range, if it is given.
        metres: Option<f64>,
    },
    /// Now and then any range from 2 cm to 4 m.
    Spikes {
        /// Share of the readings.
        share: f64,
    },
    /// It takes another sonar's echo for its own where that is nearer: a cracked mount conducts the sound.
    Crosstalk {
        /// Name of the other.
        hears: String,
    },
    /// Something sticks to it: 2 to 5 cm, always.
    Taped,
    /// Knocked askew: around the vertical, or forward for one that looks down.
    Turned {
        /// By so much, degrees counter-clockwise.
        degrees: f64,
    },
}

/// Which way a serial line carries bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the flight controller.
    To,
    /// From the flight controller.
    From,
    /// Both.
    Both,
}

/// What happens to bytes on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineFault {
    /// One bit of a byte turns over.
    Flipped {
        /// Share of the bytes.
        share: f64,
    },
    /// A byte never comes.
    Lost {
        /// Share of the bytes.
        share: f64,
    },
    /// A byte comes twice.
    Doubled {
        /// Share of the bytes.
        share: f64,
    },
    /// All come later.
    Delayed {
        /// By so much.
        seconds: f64,
    },
    /// Nothing comes.
    Silent,
}

impl Fault {
    /// Whether it holds `since_s` after the take-off; `None` before it.
    fn holds(&self, since_s: Option<f64>) -> bool {
        let reached = |at: f64| since_s.is_some_and(|since| since >= at);
        self.from_s.is_none_or(reached) && !self.until_s.is_some_and(reached)
    }
}
