//! From the width of a pulse to a distance.

use crate::Answer;
use ipc_types::SonarStatus;

/// Converts pulse widths at one air temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    speed_m_s: f64,
}

/// A reading: `range_m` is NaN unless `status` is ok.
#[derive(Clone, Copy, Debug)]
pub struct Converted {
    /// What came back.
    pub status: SonarStatus,
    /// Metres.
    pub range_m: f32,
}

impl Converter {
    /// Sound in air of `temperature_c` degrees Celsius: 343 m/s at 20, 0.6 m/s more a degree (FACTS 2).
    #[must_use]
    pub fn new(temperature_c: f64) -> Self {
        Self { speed_m_s: 343.0 + 0.6 * (temperature_c - 20.0) }
    }

    /// What an answer means for a sensor that hears from `min_m` to `max_m`.
    ///
    /// A pulse shorter than the blind range is something nearer than that: it is reported at `min_m`, for
    /// a wall at the nose is no reason to call the sensor broken. A pulse longer than the reach is how
    /// this class of sensor says that it heard nothing.
    #[must_use]
    pub fn convert(&self, answer: Answer, min_m: f32, max_m: f32) -> Converted {
        let pulse = match answer {
            Answer::Pulse(pulse) => pulse,
            Answer::NoEcho => return Converted { status: SonarStatus::NoEcho, range_m: f32::NAN },
            Answer::Silent => return Converted { status: SonarStatus::Fault, range_m: f32::NAN },
        };
        let range_m = (0.5 * f64::from(pulse) * self.speed_m_s) as f32;
        if !range_m.is_finite() || range_m <= 0.0 {
            Converted { status: SonarStatus::Fault, range_m: f32::NAN }
        } else if range_m > max_m {
            Converted { status: SonarStatus::NoEcho, range_m: f32::NAN }
        } else {
            Converted { status: SonarStatus::Ok, range_m: range_m.max(min_m) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speed_of_sound_follows_the_air() {
        let range = |c: f64| Converter::new(c).convert(Answer::Pulse(0.01), 0.02, 4.0).range_m;
        assert!((range(20.0) - 1.715).abs() < 1e-4);
        assert!((range(0.0) - 1.655).abs() < 1e-4);
    }

    #[test]
    fn every_answer_has_a_status() {
        let status = |a: Answer| Converter::new(20.0).convert(a, 0.02, 4.0).status;
        assert_eq!(status(Answer::NoEcho), SonarStatus::NoEcho);
        assert_eq!(status(Answer::Silent), SonarStatus::Fault);
        assert_eq!(status(Answer::Pulse(0.038)), SonarStatus::NoEcho, "38 ms is how HC-SR04 says nothing");
        for broken in [f32::NAN, f32::INFINITY, -0.01, 0.0] {
            assert_eq!(status(Answer::Pulse(broken)), SonarStatus::Fault, "{broken}");
        }
        let near = Converter::new(20.0).convert(Answer::Pulse(0.000_05), 0.02, 4.0);
        assert_eq!((near.status, near.range_m), (SonarStatus::Ok, 0.02));
    }
}
