//! Which directions the sonars watch: their cones, the gaps between living ones, and the holes that silent ones leave.
//!
//! A sonar hears for certain what stands within its nominal cone (FACTS 2). Between two cones large near things are
//! heard all the same, and the heading sweeps over what is left; but beside a sonar that is silent nobody looks.

use crate::held::seconds;
use crate::planar::wrap_angle;
use core::f32::consts::TAU;

/// How well a direction is watched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sight {
    /// Within the cone of a sonar that answers.
    Cone,
    /// Between the cones of two neighbours that both answer, and near enough to one of them.
    Gap,
    /// Nobody looks there. The nearest direction that is watched (body frame) and how far off it is, radians.
    Closed(Option<(f32, f32)>),
}

/// What `bearing` is for a ring of sonars: azimuth of each axis, and whether it answers. `cone` and `look` are the
/// half-angles of a cone and of what a sonar with an answering neighbour on that side joins to it, radians.
pub(super) fn sight(
    ring: &(impl Iterator<Item = (f32, bool)> + Clone),
    bearing: f32,
    cone: f32,
    look: f32,
) -> Sight {
    let mut best = Sight::Closed(None);
    for (axis, _) in ring.clone().filter(|(_, answers)| *answers) {
        let off = wrap_angle(bearing - axis);
        if off.abs() <= cone {
            return Sight::Cone;
        }
        let reach = |side: f32| if neighbour(ring.clone(), axis, side) { look.max(cone) } else { cone };
        if off.abs() <= reach(off) {
            best = Sight::Gap;
            continue;
        }
        for side in [off, -off] {
            // A hair inside, so that rounding does not put it outside again.
            let edge = axis + reach(side).copysign(side) * 0.999;
            let beyond = wrap_angle(bearing - edge).abs();
            let nearer = match best {
                Sight::Closed(Some((_, least))) => beyond < least,
                Sight::Closed(None) => true,
                _ => false,
            };
            if nearer {
                best = Sight::Closed(Some((edge, beyond)));
            }
        }
    }
    best
}

/// Whether the next sonar beside an axis, to the left for a positive `side`, answers.
fn neighbour(ring: impl Iterator<Item = (f32, bool)>, axis: f32, side: f32) -> bool {
    ring.map(|(other, answers)| ((other - axis) * side.signum(), answers))
        .map(|(turn, answers)| (turn.rem_euclid(TAU), answers))
        .filter(|(turn, _)| (1e-3..TAU - 1e-3).contains(turn))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .is_none_or(|(_, answers)| answers)
}

/// Directions that are told apart: 3 degrees, a third of the narrowest gap between two cones.
const SECTORS: usize = 120;
const SECTOR_RAD: f32 = TAU / SECTORS as f32;

/// When a cone last swept over each direction of the plan.
#[derive(Clone, Debug)]
pub(super) struct Glances {
    at_ns: [Option<u64>; SECTORS],
}

impl Glances {
    pub(super) fn new() -> Self {
        Self { at_ns: [None; SECTORS] }
    }

    /// A cone of this half-angle looked along `axis`: sectors count that lie in it wholly.
    pub(super) fn look(&mut self, at_ns: u64, axis: f32, cone: f32) {
        for (sector, at) in self.at_ns.iter_mut().enumerate() {
            let middle = (sector as f32 + 0.5) * SECTOR_RAD;
            if wrap_angle(middle - axis).abs() <= cone - 0.5 * SECTOR_RAD {
                *at = Some(at_ns);
            }
        }
    }

    /// For how long nobody has looked in a direction of the plan, seconds.
    pub(super) fn age_s(&self, now: u64, direction: f32) -> f32 {
        let sector = (direction.rem_euclid(TAU) / SECTOR_RAD) as usize;
        self.at_ns.get(sector).copied().flatten().map_or(f32::INFINITY, |at| seconds(at, now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONE: f32 = 15.0;
    const LOOK: f32 = 28.0;

    fn at(ring: &[(f32, bool)], degrees: f32) -> Sight {
        let ring = ring.iter().map(|(axis, answers)| (axis.to_radians(), *answers));
        sight(&ring, degrees.to_radians(), CONE.to_radians(), LOOK.to_radians())
    }

    #[test]
    fn a_hole_reaches_from_cone_to_cone_and_a_gap_does_not_close() {
        let mut ring = [(0.0, true), (35.0, true), (75.0, true), (125.0, true), (180.0, true), (-90.0, true)];
        assert_eq!(at(&ring, 40.0), Sight::Cone);
        assert_eq!(at(&ring, 55.0), Sight::Gap);
        let Sight::Closed(Some((edge, off))) = at(&ring, -45.0) else { panic!("nobody looks at -45") };
        assert!((edge.to_degrees() + 28.0).abs() < 0.1 && (off.to_degrees() - 17.0).abs() < 0.1);
        ring[2].1 = false;
        assert_eq!(at(&ring, 49.9), Sight::Cone);
        for degrees in [50.5, 60.0, 75.0, 95.0, 109.5] {
            let Sight::Closed(Some((edge, _))) = at(&ring, degrees) else { panic!("{degrees} is open") };
            let expected = if degrees < 80.0 { 50.0 } else { 110.0 };
            assert!((edge.to_degrees() - expected).abs() < 0.1, "{degrees}: out at {}", edge.to_degrees());
        }
        assert_eq!(at(&ring, 110.1), Sight::Cone);
        assert_eq!(at(&ring, 18.0), Sight::Gap, "the gap on the other side of its neighbour stays one");
        assert_eq!(at(&[(0.0, false)], 0.0), Sight::Closed(None));
        // One that looks the same way is no neighbour: nobody is beside it who could be silent.
        let twins = [(0.0, true), (0.01, false)];
        assert_eq!((at(&twins, 20.0), at(&twins, -20.0)), (Sight::Gap, Sight::Gap));
    }

    #[test]
    fn a_glance_counts_for_what_lay_in_the_cone_and_for_its_time() {
        let mut glances = Glances::new();
        let (axis, cone) = (359f32.to_radians(), CONE.to_radians());
        glances.look(1_000_000_000, axis, cone);
        let age = |degrees: f32| glances.age_s(2_500_000_000, degrees.to_radians());
        assert!(
            (age(0.0) - 1.5).abs() < 1e-6
                && (age(-10.0) - 1.5).abs() < 1e-6
                && (age(10.0) - 1.5).abs() < 1e-6
        );
        assert!(age(16.0).is_infinite() && age(-18.0).is_infinite() && age(180.0).is_infinite());
        // The cone covers -16 to 14 degrees; of what is told apart, -15 to 12 wholly.
        assert!(age(-14.5).is_finite() && age(-15.5).is_infinite());
        assert!(age(11.5).is_finite() && age(12.5).is_infinite());
    }
}
