//! How many particles there are: every free cell at first, a quarter as many after each measurement.

use super::{Config, PosesMut};
use crate::generator::{Generator, Lanes};
use crate::resample::draw_ancestors;
use crate::{Start, wrap_angle};
use core::f32::consts::TAU;
use floorplan::{Cell, Plan};
use thiserror::Error;

/// A plan with more free cells than there is room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "{wanted} particles are wanted, {headings} for each free cell of the plan; allowed: at most {capacity}"
)]
pub struct CapacityError {
    /// Free cells times headings.
    pub wanted: usize,
    /// Headings of each cell.
    pub headings: usize,
    /// Room there is.
    pub capacity: usize,
}

/// Writes a particle for each free cell and heading, all of one weight.
pub(super) fn everywhere(
    config: &Config,
    plan: &Plan,
    next: PosesMut<'_>,
    capacity: usize,
) -> Result<usize, CapacityError> {
    let headings = config.headings;
    let capacity = next.capacity().min(capacity);
    let wanted = plan.cells().iter().filter(|cell| **cell == Cell::Free).count() * headings;
    if wanted > capacity {
        return Err(CapacityError { wanted, headings, capacity });
    }
    let next = next.first(wanted);
    let free = plan.cells().iter().enumerate().filter(|(_, cell)| **cell == Cell::Free);
    let places = free.flat_map(|(index, _)| {
        let (x, y) = plan.centre(index % plan.width(), index / plan.width());
        (0..headings).map(move |k| (x, y, wrap_angle(k as f32 * TAU / headings as f32)))
    });
    for (i, (x, y, heading)) in places.enumerate() {
        (next.x[i], next.y[i], next.heading[i]) = (x, y, heading);
    }
    next.weight.fill(1.0 / wanted.max(1) as f32);
    Ok(wanted)
}

/// Writes `count` particles around a known place.
pub(super) fn around(
    start: &Start,
    count: usize,
    next: PosesMut<'_>,
    generator: &mut Generator,
    scratch: &mut [f32],
) -> usize {
    let count = count.min(next.capacity()).min(scratch.len());
    let next = next.first(count);
    let mut lanes = Lanes::new(generator);
    let mut fill = |column: &mut [f32], mean: f32, sigma: f32| {
        lanes.fill_normal(&mut scratch[..count]);
        for (value, normal) in column.iter_mut().zip(&scratch[..count]) {
            *value = mean + sigma * normal;
        }
    };
    fill(next.x, start.x, start.sigma);
    fill(next.y, start.y, start.sigma);
    fill(next.heading, start.heading_offset, start.heading_sigma);
    for heading in next.heading.iter_mut() {
        *heading = wrap_angle(*heading);
    }
    next.weight.fill(1.0 / count.max(1) as f32);
    count
}

/// Discards the least alike of a weighed set, in place, and returns how many are left: a quarter, the heaviest, until
/// that would be fewer than [`Config::least`]; so many then, and once there are no more than that, as many drawn by weight.
/// Afterwards all weigh the same. Weights that are all equal say nothing: nobody goes.
pub(super) fn resample(
    config: &Config,
    mut set: PosesMut<'_>,
    generator: &mut Generator,
    scratch: &mut [f32],
    ancestors: &mut [u32],
) -> usize {
    let count = set.capacity();
    let bounds =
        set.weight.iter().fold((f32::INFINITY, 0.0f32), |(low, high), w| (low.min(*w), high.max(*w)));
    if count == 0 || bounds.0 >= bounds.1 {
        return count;
    }
    let kept = ((count as f32 * config.kept).ceil() as usize).max(config.least).min(count);
    if kept < count {
        keep_heaviest(kept, &set, scratch);
        compact(&mut set, scratch);
    } else {
        draw_ancestors(set.weight, generator.uniform(), &mut ancestors[..count]);
        for column in [set.x, set.y, set.heading] {
            for (slot, ancestor) in scratch.iter_mut().zip(&ancestors[..count]) {
                *slot = column[*ancestor as usize];
            }
            column.copy_from_slice(&scratch[..count]);
        }
        set.weight.fill(1.0 / count as f32);
    }
    kept
}

/// Marks in `scratch` (1 or 0) the `kept` heaviest; of those that weigh the same as the lightest of them, some evenly from
/// all over the set, so that no corner of the plan goes first.
fn keep_heaviest(kept: usize, set: &PosesMut<'_>, scratch: &mut [f32]) {
    let count = set.weight.len();
    let scratch = &mut scratch[..count];
    scratch.copy_from_slice(set.weight);
    let (_, lightest, heavier) = scratch.select_nth_unstable_by(count - kept, f32::total_cmp);
    let lightest = *lightest;
    let above = heavier.iter().filter(|w| **w > lightest).count();
    let equals = set.weight.iter().filter(|w| **w == lightest).count().max(1);
    let places = kept - above;
    let mut equal = 0;
    for (keep, weight) in scratch.iter_mut().zip(set.weight.iter()) {
        *keep = if *weight > lightest {
            1.0
        } else if *weight == lightest {
            equal += 1;
            f32::from(u8::from(equal * places / equals > (equal - 1) * places / equals))
        } else {
            0.0
        };
    }
}

/// Moves the marked to the front, in their order.
fn compact(set: &mut PosesMut<'_>, marks: &[f32]) {
    let mut to = 0;
    for (from, _) in marks.iter().take(set.weight.len()).enumerate().filter(|(_, mark)| **mark > 0.0) {
        set.x[to] = set.x[from];
        set.y[to] = set.y[from];
        set.heading[to] = set.heading[from];
        to += 1;
    }
    set.weight[..to].fill(1.0 / to.max(1) as f32);
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Set([Vec<f32>; 4]);

    impl Set {
        fn with(weights: &[f32]) -> Self {
            let x = (0..weights.len()).map(|i| i as f32).collect();
            let rest = vec![0.0; weights.len()];
            Self([x, rest.clone(), rest, weights.to_vec()])
        }

        fn write(&mut self) -> PosesMut<'_> {
            let [x, y, heading, weight] = &mut self.0;
            PosesMut { x, y, heading, weight }
        }

        fn resampled(&mut self, config: &Config) -> usize {
            let room = self.0[0].len();
            let (mut scratch, mut ancestors) = (vec![0.0; room], vec![0; room]);
            resample(config, self.write(), &mut Generator::new(1), &mut scratch, &mut ancestors)
        }
    }

    #[test]
    fn the_heaviest_quarter_is_kept_and_then_weighs_the_same() {
        let config = Config { least: 1, ..Config::default() };
        let mut set = Set::with(&[0.1, 0.0, 0.3, 0.02, 0.2, 0.0, 0.3, 0.08]);
        assert_eq!(set.resampled(&config), 2);
        assert_eq!(set.0[0][..2], [2.0, 6.0]);
        assert_eq!(set.0[3][..2], [0.5, 0.5]);
    }

    #[test]
    fn of_equals_some_from_everywhere_are_kept() {
        let config = Config { least: 1, ..Config::default() };
        let mut weights = vec![1.0; 16];
        weights[3] = 0.0;
        let mut set = Set::with(&weights);
        assert_eq!(set.resampled(&config), 4);
        let kept = &set.0[0][..4];
        assert!(kept[0] < 5.0 && kept[3] > 11.0, "{kept:?}");
        let mut equal = Set::with(&[0.25; 4]);
        assert_eq!(equal.resampled(&config), 4, "equal weights say nothing");
    }

    #[test]
    fn at_the_least_number_they_are_drawn_by_weight() {
        let config = Config { least: 6, ..Config::default() };
        let mut set = Set::with(&[0.0, 1.0, 0.0, 0.0]);
        assert_eq!(set.resampled(&config), 4, "never more than there were");
        assert_eq!(set.0[0], [1.0; 4]);
        let mut larger = Set::with(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]);
        assert_eq!(larger.resampled(&config), 6, "a quarter would be too few");
    }

    #[test]
    fn every_free_cell_has_a_particle_for_each_heading() {
        let plan = Plan::from_ascii(&["####", "# ?#", "#  #", "####"], 0.5);
        let mut set = Set::with(&[0.0; 40]);
        let config = Config::default();
        assert_eq!(everywhere(&config, &plan, set.write(), 40), Ok(36));
        let [x, y, heading, weight] = &set.0;
        assert_eq!((x[0], y[0], heading[0]), (0.75, 0.75, 0.0));
        assert!((heading[1] - TAU / 12.0).abs() < 1e-6);
        assert_eq!((x[35], y[35]), (0.75, 1.25), "unknown is not free");
        assert!((weight[..36].iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let error = everywhere(&config, &plan, set.write(), 35).map_err(|e| e.to_string());
        assert_eq!(
            error,
            Err("36 particles are wanted, 12 for each free cell of the plan; allowed: at most 35".into())
        );
    }
}
