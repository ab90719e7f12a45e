//! How well a place explains what was heard: one look-up table of log likelihoods a reading.

use super::trail::{Heard, MAX_HEARD};
use crate::SonarConfig;
use crate::map::RangeMap;
use crate::sonar::{Echo, SonarModel};
use core::ops::Range;

/// Log likelihoods are kept by expected range in steps of 1/255 of the reach (16 mm at 4 m).
const STEPS: usize = 255;
/// One entry more for "no echo expected".
const ENTRIES: usize = STEPS + 1;
/// No reading speaks against a place more strongly than this: things stand where the plan has none.
const LEAST: f32 = -4.0;

/// Readings as columns, relative to the place where the drone is now.
#[derive(Clone, Debug)]
pub(crate) struct Columns {
    pub(crate) x: [f32; MAX_HEARD],
    pub(crate) y: [f32; MAX_HEARD],
    pub(crate) angle: [f32; MAX_HEARD],
    pub(crate) cos: [f32; MAX_HEARD],
    pub(crate) sin: [f32; MAX_HEARD],
}

impl Default for Columns {
    fn default() -> Self {
        let zero = [0.0; MAX_HEARD];
        Self { x: zero, y: zero, angle: zero, cos: zero, sin: zero }
    }
}

impl Columns {
    /// The readings as they lie around (`x`, `y`) of the trail.
    pub(crate) fn around(&mut self, heard: &[Heard], x: f32, y: f32) {
        for (i, heard) in heard.iter().enumerate().take(MAX_HEARD) {
            (self.x[i], self.y[i], self.angle[i]) = (heard.x - x, heard.y - y, heard.axis_rad);
            (self.sin[i], self.cos[i]) = heard.axis_rad.sin_cos();
        }
    }

    /// `from` turned by an angle.
    pub(crate) fn turn(&mut self, from: &Self, count: usize, angle: f32) {
        let (sin, cos) = angle.sin_cos();
        for i in 0..count.min(MAX_HEARD) {
            self.x[i] = cos * from.x[i] - sin * from.y[i];
            self.y[i] = sin * from.x[i] + cos * from.y[i];
            self.angle[i] = from.angle[i] + angle;
            self.cos[i] = cos * from.cos[i] - sin * from.sin[i];
            self.sin[i] = sin * from.cos[i] + cos * from.sin[i];
        }
    }
}

/// The tables of all readings, and room to ask the map.
pub(crate) struct Tables {
    logs: Vec<[f32; ENTRIES]>,
    scale: f32,
    /// Places of the sensors, and what the map promises there.
    x: [f32; MAX_HEARD],
    y: [f32; MAX_HEARD],
    expected: [f32; MAX_HEARD],
}

impl Tables {
    pub(crate) fn new(reach: f32) -> Self {
        Self {
            logs: vec![[0.0; ENTRIES]; MAX_HEARD],
            scale: STEPS as f32 / reach,
            x: [0.0; MAX_HEARD],
            y: [0.0; MAX_HEARD],
            expected: [0.0; MAX_HEARD],
        }
    }

    /// Fills the tables; the sensor's own spread is widened by `slack_m` and by `slack_rad` times the range: the place
    /// and direction that are asked about are off by so much.
    pub(crate) fn prepare(&mut self, config: &SonarConfig, slack_m: f32, slack_rad: f32, heard: &[Heard]) {
        let config = SonarConfig {
            sigma: config.sigma.hypot(slack_m),
            sigma_per_m: config.sigma_per_m.hypot(slack_rad),
            ..config.clone()
        };
        let (reach, model) = (config.max_range, SonarModel::new(&config));
        for (logs, heard) in self.logs.iter_mut().zip(heard) {
            let echo = match heard.echo {
                Echo::Range(range) if range > reach => Echo::Nothing,
                echo => echo,
            };
            let mut most = f32::NEG_INFINITY;
            for (entry, log) in logs.iter_mut().enumerate() {
                let expected = if entry < STEPS { entry as f32 / self.scale } else { f32::INFINITY };
                *log = model.likelihood(echo, expected).ln();
                most = most.max(*log);
            }
            for log in logs {
                *log = (*log - most).max(LEAST);
            }
        }
    }

    /// Log likelihood of some of the readings from (`x`, `y`), `columns` being turned already; 0 is best.
    pub(crate) fn score<M: RangeMap>(
        &mut self,
        map: &M,
        (x, y): (f32, f32),
        columns: &Columns,
        which: Range<usize>,
    ) -> f32 {
        let which = which.start.min(MAX_HEARD)..which.end.min(MAX_HEARD);
        for i in which.clone() {
            self.x[i] = x + columns.x[i];
            self.y[i] = y + columns.y[i];
        }
        map.ranges(
            &self.x[which.clone()],
            &self.y[which.clone()],
            &columns.angle[which.clone()],
            &columns.cos[which.clone()],
            &columns.sin[which.clone()],
            &mut self.expected[which.clone()],
        );
        let mut sum = 0.0;
        for (logs, expected) in self.logs[which.clone()].iter().zip(&self.expected[which]) {
            // A cast saturates: infinite and NaN mean no echo.
            let step = expected * self.scale + 0.5;
            let entry = if step < STEPS as f32 { step as usize } else { STEPS };
            sum += logs[entry];
        }
        sum
    }

    /// Share of the readings that the last scored place explains within three sigma.
    pub(crate) fn explained(&self, config: &SonarConfig, heard: &[Heard]) -> f32 {
        let model = SonarModel::new(config);
        let fits = heard.iter().zip(&self.expected).filter(|(heard, expected)| match heard.echo {
            Echo::Nothing => **expected > config.max_range,
            Echo::Range(range) => (range - **expected).abs() < 3.0 * model.sigma(**expected),
        });
        fits.count() as f32 / heard.len().max(1) as f32
    }
}
