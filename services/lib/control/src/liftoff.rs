//! From standing motors to the air.

use crate::check::{RangeError, within};
use crate::climb::IDLE_US;

/// Settings of the spool-up.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LiftoffConfig {
    /// Share of the guessed collective that is reached quickly: the guess may be a quarter too high.
    pub quick_share: f32,
    /// Throttle a second up to there, microseconds.
    pub quick_us_s: f32,
    /// Throttle a second from there on, microseconds: the ramp overshoots hover by this times the 0.4 s that
    /// seeing the lift takes.
    pub ramp_us_s: f32,
    /// Most throttle tried, as a multiple of the guessed collective.
    pub most_collective: f32,
    /// Height by which the skids are off the ground, metres: four times the noise of the sonar.
    pub lifted_m: f32,
    /// For how long the most throttle is held before giving up, seconds.
    pub patience_s: f32,
}

impl Default for LiftoffConfig {
    fn default() -> Self {
        Self {
            quick_share: 0.7,
            quick_us_s: 500.0,
            ramp_us_s: 100.0,
            most_collective: 1.5,
            lifted_m: 0.04,
            patience_s: 1.0,
        }
    }
}

impl LiftoffConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("liftoff.quick_share", self.quick_share, 0.2, 0.85)?;
        within("liftoff.quick_us_s", self.quick_us_s, 50.0, 2000.0)?;
        within("liftoff.ramp_us_s", self.ramp_us_s, 20.0, 400.0)?;
        within("liftoff.most_collective", self.most_collective, 1.1, 2.5)?;
        within("liftoff.lifted_m", self.lifted_m, 0.02, 0.2)?;
        within("liftoff.patience_s", self.patience_s, 0.2, 5.0)
    }
}

/// How the lift-off stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Liftoff {
    /// Still on the ground, at this throttle.
    SpoolingUp {
        /// Throttle to command, microseconds.
        throttle_us: f32,
    },
    /// In the air.
    Lifted {
        /// Guess of the hover throttle, microseconds.
        hover_us: f32,
        /// Height when it was noticed, metres.
        height_m: f32,
        /// Climb rate when it was noticed, m/s.
        climb_m_s: f32,
    },
    /// Most throttle, and still on the ground.
    Stuck,
}

/// The spool-up of one take-off.
#[derive(Clone, Debug)]
pub struct SpoolUp {
    config: LiftoffConfig,
    guess_us: f32,
    throttle_us: f32,
    at_most_s: f32,
    first: Option<(u64, f32)>,
    lifted: Option<(f32, f32)>,
}

impl SpoolUp {
    /// From idle, with a guess of the hover throttle.
    #[must_use]
    pub fn new(config: LiftoffConfig, guess_us: f32) -> Self {
        Self { config, guess_us, throttle_us: IDLE_US, at_most_s: 0.0, first: None, lifted: None }
    }

    /// Goes on in the middle of a spool-up: from the throttle that is reached quickly.
    pub fn resume(&mut self) {
        self.throttle_us = IDLE_US + self.config.quick_share * (self.guess_us - IDLE_US);
    }

    /// Takes a height of the skids by the down sonar: two in a row off the ground are a lift-off.
    pub fn hear(&mut self, at_ns: u64, height_m: f32) {
        if height_m.is_nan() || height_m < self.config.lifted_m {
            self.first = None;
            return;
        }
        match self.first {
            None => self.first = Some((at_ns, height_m)),
            Some((then, before)) if at_ns > then => {
                let climb = (height_m - before) / (at_ns - then) as f32 * 1e9;
                // A drone does not leap: a reading far beyond the last is a stray echo.
                if (-0.5..=2.0).contains(&climb) && height_m < 0.6 {
                    self.lifted = Some((height_m, climb.clamp(0.0, 1.0)));
                } else {
                    self.first = Some((at_ns, height_m));
                }
            }
            Some(_) => {}
        }
    }

    /// One step of `dt` seconds.
    pub fn step(&mut self, dt: f32) -> Liftoff {
        let c = &self.config;
        let collective = self.guess_us - IDLE_US;
        if let Some((height_m, climb_m_s)) = self.lifted {
            // Climbing away at rate v under a throttle that rises at rate r: v = g r t^2 / collective since the
            // throttle passed hover, so that it passed it by r t = sqrt(v r collective / g).
            let over = (climb_m_s * c.ramp_us_s * collective / crate::GRAVITY_M_S2).max(0.0).sqrt();
            let hover_us = (self.throttle_us - over).max(IDLE_US + 0.4 * collective);
            return Liftoff::Lifted { hover_us, height_m, climb_m_s };
        }
        let quick = IDLE_US + c.quick_share * collective;
        let most = (IDLE_US + c.most_collective * collective).min(1900.0);
        let rate = if self.throttle_us < quick { c.quick_us_s } else { c.ramp_us_s };
        self.throttle_us = (self.throttle_us + rate * dt).min(most);
        if self.throttle_us >= most {
            self.at_most_s += dt;
            if self.at_most_s >= c.patience_s {
                return Liftoff::Stuck;
            }
        }
        Liftoff::SpoolingUp { throttle_us: self.throttle_us }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_stray_echo_is_no_lift_off() {
        let mut spool = SpoolUp::new(LiftoffConfig::default(), 1450.0);
        for k in 0..60u64 {
            spool.hear(k * 60_000_000, if k % 7 == 3 { 0.4 } else { 0.003 });
            assert!(!matches!(spool.step(0.02), Liftoff::Lifted { .. }));
        }
        spool.hear(3_600_000_000, 0.05);
        spool.hear(3_660_000_000, 0.07);
        let Liftoff::Lifted { hover_us, climb_m_s, .. } = spool.step(0.02) else { panic!("not lifted") };
        assert!((1200.0..1450.0).contains(&hover_us) && (climb_m_s - 0.33).abs() < 0.01, "{hover_us}");
    }

    #[test]
    fn a_drone_that_is_too_heavy_gives_up() {
        let mut spool = SpoolUp::new(LiftoffConfig::default(), 1450.0);
        let mut steps = 0;
        while let Liftoff::SpoolingUp { throttle_us } = spool.step(0.02) {
            assert!((1000.0..=1900.0).contains(&throttle_us));
            steps += 1;
            assert!(steps < 1000);
        }
        assert_eq!(spool.step(0.02), Liftoff::Stuck);
    }
}
