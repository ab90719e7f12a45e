//! Whether the set still fits what is heard.

use crate::config::{ConfigError, within};

/// What the readings of a drone that stands say of being lost: what stands beside it is on no plan each time again.
const STALE: f32 = 0.1;

/// What a reading says of being lost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    /// Its likelihood by the set.
    pub(crate) by_set: f32,
    /// Its likelihood to one who does not know the place.
    pub(crate) blind: f32,
    /// Whether it is shorter than the plan has it.
    pub(crate) short: bool,
    /// Whether something was heard there before.
    pub(crate) familiar: bool,
}

/// How doubt grows and fades.
#[derive(Clone, Debug, PartialEq)]
pub struct TrustConfig {
    /// Exponent on each reading's evidence: readings of one second resemble each other.
    pub temper: f32,
    /// Most that one reading can raise the log odds.
    pub raise: f32,
    /// The same for a reading that is shorter than the plan has it at the set's place: there may stand something that
    /// the plan does not show, and beside it a drone is not lost. Where nothing stands, walls hide nothing: what
    /// is too long speaks for itself.
    pub raise_short: f32,
    /// Most that one reading can lower them. Less than `raise`: a place that is not the true one still
    /// fits about half of the readings, and the true one fits more than three in five among clutter.
    pub lower: f32,
    /// Chance of getting lost unnoticed, per second: keeps doubt from falling to nothing.
    pub hazard_per_s: f32,
    /// Chance of having come right again, per second: keeps doubt from becoming certainty.
    pub recovery_per_s: f32,
}

impl Default for TrustConfig {
    fn default() -> Self {
        Self {
            temper: 0.25,
            raise: 0.4,
            raise_short: 0.15,
            lower: 0.2,
            hazard_per_s: 0.005,
            recovery_per_s: 0.01,
        }
    }
}

impl TrustConfig {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        within("trust.temper", self.temper, 0.01..=1.0)?;
        within("trust.raise", self.raise, 0.01..=5.0)?;
        within("trust.raise_short", self.raise_short, 0.0..=5.0)?;
        within("trust.lower", self.lower, 0.01..=5.0)?;
        within("trust.hazard_per_s", self.hazard_per_s, 1e-6..=0.5)?;
        within("trust.recovery_per_s", self.recovery_per_s, 1e-6..=0.5)
    }

    /// P(lost) after `dt` seconds and readings: a two-state hidden Markov chain. Where the readings fit the set
    /// better than they fit any place, doubt falls; unmapped things raise it by a bounded amount each, and those that were
    /// heard before not at all. Readings that are hardly `news` (0..=1) say little, and where nothing moves nobody gets lost.
    pub(crate) fn step(
        &self,
        p_lost: f32,
        dt: f32,
        news: f32,
        evidence: impl Iterator<Item = Evidence>,
    ) -> f32 {
        let p = if (0.0..=1.0).contains(&p_lost) { p_lost } else { 0.5 };
        let dt = dt.clamp(0.0, 5.0);
        let (fresh, news) = (news, news.max(STALE));
        let p = p + (1.0 - p) * (self.hazard_per_s * news * dt).min(0.5)
            - p * (self.recovery_per_s * dt).min(0.5);
        let p = p.clamp(1e-6, 1.0 - 1e-6);
        let mut odds = (p / (1.0 - p)).ln();
        for Evidence { by_set, blind, short, familiar } in evidence {
            let raise = match (short, familiar) {
                (false, _) => self.raise,
                (true, false) => self.raise_short,
                (true, true) => 0.0,
            };
            let ratio = (blind.max(1e-6) / by_set.max(1e-6)).ln() * self.temper;
            // What stands beside a drone that stands has had its say.
            let news = if short && ratio > 0.0 { fresh } else { news };
            // NaN (a broken set) counts as the worst reading.
            odds += news * if ratio.is_nan() { self.raise } else { ratio.clamp(-self.lower, raise) };
        }
        1.0 / (1.0 + (-odds).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::{Evidence, TrustConfig};

    /// One pair of readings each 60 ms, .
    fn after(seconds: f32, pair: [Evidence; 2]) -> f32 {
        let t = TrustConfig::default();
        (0..(seconds / 0.06) as usize).fold(0.01, |p, _| t.step(p, 0.06, 1.0, pair.into_iter()))
    }

    const HIT: Evidence = Evidence { by_set: 4.0, blind: 0.3, short: false, familiar: false };
    const WRONG: Evidence = Evidence { by_set: 0.05, ..HIT };
    const SHORT: Evidence = Evidence { short: true, ..WRONG };
    const FAMILIAR: Evidence = Evidence { familiar: true, ..SHORT };

    #[test]
    fn doubt_follows_the_readings() {
        assert!(after(10.0, [HIT, HIT]) < 0.005);
        let clutter = after(10.0, [HIT, HIT]).max((0..80).fold(0.01, |p, i| {
            let second = if i % 5 < 3 { WRONG } else { HIT };
            TrustConfig::default().step(p, 0.06, 1.0, [HIT, second].into_iter())
        }));
        assert!(clutter < 0.05, "three in ten readings hit unmapped things: {clutter}");
        assert!(after(3.0, [WRONG, WRONG]) > 0.9, "nothing fits for three seconds");
        assert!(after(60.0, [HIT, SHORT]) < 0.01, "half of the readings hit unmapped things for a minute");
        assert!(after(10.0, [SHORT, SHORT]) > 0.9, "nothing fits for ten seconds");
        assert!(
            after(60.0, [FAMILIAR, FAMILIAR]) < 0.4,
            "nothing says that it is lost, and nothing that it is not"
        );
        assert!(after(60.0, [FAMILIAR, WRONG]) > 0.9, "what is too long counts whatever stands beside");
        assert!(after(0.3, [WRONG, WRONG]) < 0.5, "a third of a second is a person passing");
    }

    #[test]
    fn a_drone_that_waits_beside_something_unmapped_is_not_lost() {
        let t = TrustConfig::default();
        let waited = |seconds: f32, pair: [Evidence; 2]| {
            (0..(seconds / 0.06) as usize).fold(0.005, |p, _| t.step(p, 0.06, 0.0, pair.into_iter()))
        };
        assert!(waited(4.0, [SHORT, SHORT]) < 0.05, "{}", waited(4.0, [SHORT, SHORT]));
        assert!(waited(30.0, [HIT, SHORT]) < 0.01);
        assert!(waited(20.0, [WRONG, WRONG]) > 0.9, "carried off, it notices all the same");
    }

    #[test]
    fn broken_evidence_is_doubt() {
        let t = TrustConfig::default();
        assert!(t.step(0.1, 0.06, 1.0, [Evidence { by_set: f32::NAN, ..HIT }].into_iter()) > 0.1);
        assert!((0.0..=1.0).contains(&t.step(f32::NAN, f32::NAN, f32::NAN, [HIT].into_iter())));
    }
}
