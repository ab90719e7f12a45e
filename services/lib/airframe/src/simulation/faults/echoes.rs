//! Sonars that are dead, deaf, stuck, spiking, cross-talking or taped over.

use super::SonarFault;
use crate::acoustics::{Echo, MAX_SENSORS, RANGE_M, SOUND_M_S};
use rand::{Rng, RngExt};

/// What a strip of tape or a leaf in front of the sensor answers, metres.
const TAPED_M: core::ops::Range<f32> = 0.02..0.05;

/// One fault with the sensors that have it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spoilt {
    /// Bit = index in the vehicle's list.
    pub(super) sensors: u32,
    pub(super) does: Does,
}

/// [`SonarFault`] with names resolved.
#[derive(Clone, Copy, Debug)]
pub(super) enum Does {
    Dead,
    Deaf,
    Stuck(Option<f32>),
    Spikes(f64),
    Crosstalk(usize),
    Taped,
    Turned(f32),
}

impl Does {
    /// `None` when a name is not the vehicle's.
    pub(super) fn new(fault: &SonarFault, index: impl Fn(&str) -> Option<usize>) -> Option<Self> {
        Some(match fault {
            SonarFault::Dead => Self::Dead,
            SonarFault::Deaf => Self::Deaf,
            SonarFault::Stuck { metres } => Self::Stuck(metres.map(|m| pulse_s(m as f32))),
            SonarFault::Spikes { share } => Self::Spikes(*share),
            SonarFault::Crosstalk { hears } => Self::Crosstalk(index(hears)?),
            SonarFault::Taped => Self::Taped,
            SonarFault::Turned { degrees } => Self::Turned(degrees.to_radians() as f32),
        })
    }
}

fn pulse_s(range_m: f32) -> f32 {
    2.0 * range_m / SOUND_M_S
}

/// What each sensor heard last while nothing held it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    heard: [f32; MAX_SENSORS],
}

impl Default for Memory {
    fn default() -> Self {
        Self { heard: [f32::NAN; MAX_SENSORS] }
    }
}

impl Memory {
    /// Spoils what a group has heard; answers the sensors that say nothing at all.
    pub(super) fn spoil<R: Rng + ?Sized>(
        &mut self,
        echoes: &mut [Echo],
        faults: &[Spoilt],
        random: &mut R,
    ) -> u32 {
        let mut silent = 0;
        for echo in echoes.iter_mut() {
            let sensor = usize::from(echo.sensor);
            let mine = || faults.iter().filter(move |fault| fault.sensors & (1 << sensor) != 0);
            if !mine().any(|fault| matches!(fault.does, Does::Stuck(_)))
                && let Some(place) = self.heard.get_mut(sensor)
            {
                *place = echo.pulse_s;
            }
            for fault in mine() {
                match fault.does {
                    Does::Dead => silent |= 1 << sensor,
                    Does::Deaf => echo.pulse_s = f32::NAN,
                    Does::Stuck(pulse) => {
                        let last = self.heard.get(sensor).copied().unwrap_or(f32::NAN);
                        echo.pulse_s = pulse.unwrap_or(last);
                    }
                    Does::Spikes(share) => {
                        let outlier = random.random_range(RANGE_M.0..RANGE_M.1);
                        if random.random::<f64>() < share {
                            echo.pulse_s = pulse_s(outlier);
                        }
                    }
                    Does::Crosstalk(other) => {
                        let other = self.heard.get(other).copied().unwrap_or(f32::NAN);
                        // `min` takes the one that is a number.
                        echo.pulse_s = echo.pulse_s.min(other);
                    }
                    Does::Taped => echo.pulse_s = pulse_s(random.random_range(TAPED_M)),
                    // The sensor itself is turned.
                    Does::Turned(_) => {}
                }
            }
        }
        silent
    }
}
