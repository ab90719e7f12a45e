//! From the places that explain well to hypotheses with their shares of the belief.

use super::Hypothesis;
use crate::maths::wrap_angle;

/// Two places are one when they are nearer than this, metres and radians.
const APART_M: f32 = 0.5;
const APART_RAD: f32 = 0.26;
/// Exponent on the likelihood of all readings together: neighbours hear the same thing, and what is wrong with one is
/// wrong with the next.
const TEMPER: f32 = 0.25;

/// A place that is being improved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mode {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) turn_rad: f32,
    pub(super) score: f32,
    pub(super) explained: f32,
}

impl Mode {
    /// Whether two modes are two places.
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        (self.x - other.x).hypot(self.y - other.y) > APART_M
            || wrap_angle(self.turn_rad - other.turn_rad).abs() > APART_RAD
    }

    fn weighed(&self, best: f32) -> Hypothesis {
        Hypothesis {
            x: self.x,
            y: self.y,
            turn_rad: wrap_angle(self.turn_rad),
            weight: (TEMPER * (self.score - best)).exp(),
            explained: self.explained,
        }
    }
}

/// Writes the hypotheses that `modes` stand for: like ones are one, the likeliest is the first, their weights sum to one. And
/// says what `suspect`, which need not be among them, weighs beside them.
pub(super) fn weigh(
    modes: &mut [Mode],
    suspect: Option<&Mode>,
    hypotheses: &mut Vec<Hypothesis>,
) -> Option<Hypothesis> {
    modes.sort_unstable_by(|a, b| b.score.total_cmp(&a.score));
    hypotheses.clear();
    let best = modes.first().map_or(0.0, |mode| mode.score);
    for (i, mode) in modes.iter().enumerate() {
        if modes[..i].iter().all(|better| better.is_apart(mode)) {
            hypotheses.push(mode.weighed(best));
        }
    }
    let mut suspect = suspect.map(|mode| mode.weighed(best));
    let sum: f32 = hypotheses.iter().map(|hypothesis| hypothesis.weight).sum();
    for hypothesis in hypotheses.iter_mut().chain(&mut suspect) {
        hypothesis.weight /= sum.max(f32::MIN_POSITIVE);
    }
    suspect
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(x: f32, score: f32) -> Mode {
        Mode { x, y: 0.0, turn_rad: 0.0, score, explained: 0.5 }
    }

    #[test]
    fn like_modes_are_one_and_the_suspect_is_weighed_beside_them() {
        let mut modes = [mode(3.0, -8.0), mode(0.2, -1.0), mode(0.0, 0.0)];
        let mut hypotheses = Vec::with_capacity(3);
        let suspect = weigh(&mut modes, Some(&mode(0.45, -8.0)), &mut hypotheses).unwrap();
        assert_eq!(hypotheses.len(), 2);
        assert!(hypotheses[0].x == 0.0 && hypotheses[1].x == 3.0);
        let sum: f32 = hypotheses.iter().map(|hypothesis| hypothesis.weight).sum();
        assert!((sum - 1.0).abs() < 1e-6);
        // Eight less of log likelihood, tempered to two.
        assert!((hypotheses[1].weight / hypotheses[0].weight - (-2.0f32).exp()).abs() < 1e-5);
        assert!((suspect.weight - hypotheses[1].weight).abs() < 1e-6, "as much as what explains as well");
    }
}
