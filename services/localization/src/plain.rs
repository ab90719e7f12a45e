//! The thesis's plain filter in the place of ours (`filter = "thesis"`), on the same topics.
//!
//! Its particles are places and headings. They share the sample's columns with ours: the heading is kept against the compass
//! (equation 2 then has nothing to turn, the compass has turned already), the velocity columns hold the one velocity that
//! all were moved by last, and the level columns what the ground said. What moves it is the velocity that is flown by, which
//! the service follows beside either filter: the thesis takes its way from what was commanded, which a hovering drone's is
//! not. Each ping group is an update.

use crate::LocalizationConfig;
use floorplan::Plan;
use ipc_types::{MAX_PARTICLES, Particles};
use mcl::thesis::{CentreRay, Config, Filter, Moved, PosesMut, PosesRef, Scan};
use mcl::{ConfigError, Generator, Memory, Motion, Start, Sweep, Update};
use std::sync::Arc;

/// The velocity that is flown by, plan frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flown {
    pub(crate) velocity: [f32; 2],
    pub(crate) sigma: f32,
    /// Heading in the plan less compass yaw that it was worked out with.
    pub(crate) heading_offset: f32,
}

/// The filter, and how many particles it begins with.
pub(crate) struct Plain {
    filter: Filter<CentreRay>,
    beginning: usize,
}

impl Plain {
    /// With the service's bounds of the population and its doubt. Allocates here and nowhere else.
    pub(crate) fn new(config: &LocalizationConfig, plan: &Arc<Plan>) -> Result<Self, ConfigError> {
        let ours = config.filter_config();
        let config = Config { least: ours.population.min, trust: ours.trust, ..Config::default() };
        let ray = CentreRay::new(Arc::clone(plan), config.max_range);
        let filter = Filter::new(config, ray, plan.resolution(), MAX_PARTICLES)?;
        Ok(Self { filter, beginning: ours.population.max })
    }

    /// Draws the first set around the start.
    pub(crate) fn begin(&mut self, start: &Start, next: &mut Particles, generator: &mut Generator) -> Update {
        let update = self.filter.start_around(start, self.beginning, poses_mut(next), generator);
        let still = Flown { velocity: [0.0; 2], sigma: 0.0, heading_offset: start.heading_offset };
        completed(update, next, &still, [start.level_roll, start.level_pitch])
    }

    /// Reads the set, writes the next one. Without a velocity that is flown by (after a restart) the set goes on as it was
    /// moved last.
    #[expect(clippy::too_many_arguments, reason = "those of the filter that it stands for")]
    pub(crate) fn update(
        &mut self,
        set: &Particles,
        memory: &Memory,
        motion: &Motion,
        flown: Option<Flown>,
        sweep: Option<&Sweep<'_>>,
        next: &mut Particles,
        generator: &mut Generator,
    ) -> Update {
        let flown = flown.unwrap_or(Flown {
            velocity: [set.velocity_x_m_s[0], set.velocity_y_m_s[0]],
            sigma: 0.0,
            heading_offset: set.heading_offset_rad[0],
        });
        let [x, y] = flown.velocity;
        let moved = Moved {
            distance_m: x.hypot(y) * motion.dt_s,
            direction_rad: y.atan2(x) - flown.heading_offset,
            turned_rad: 0.0,
        };
        let moved = (!motion.grounded).then_some(&moved);
        let scan = sweep.map(|s| Scan { readings: s.readings, reference_rad: s.yaw_rad });
        let level = [set.level_roll_rad[0], set.level_pitch_rad[0]];
        let next_poses = poses_mut(next);
        let update =
            self.filter.update(poses(set), memory, motion.dt_s, moved, scan.as_ref(), next_poses, generator);
        completed(update, next, &flown, level)
    }
}

/// Fills the columns and the part of the estimate that the plain filter does not have.
fn completed(mut update: Update, next: &mut Particles, flown: &Flown, level: [f32; 2]) -> Update {
    let n = update.count;
    next.velocity_x_m_s[..n].fill(flown.velocity[0]);
    next.velocity_y_m_s[..n].fill(flown.velocity[1]);
    next.level_roll_rad[..n].fill(level[0]);
    next.level_pitch_rad[..n].fill(level[1]);
    let e = &mut update.estimate;
    [e.velocity_x, e.velocity_y] = flown.velocity;
    e.velocity_sigma = flown.sigma;
    [e.level_roll, e.level_pitch] = level;
    update
}

fn poses(set: &Particles) -> PosesRef<'_> {
    let n = (set.count as usize).min(MAX_PARTICLES);
    PosesRef {
        x: &set.x_m[..n],
        y: &set.y_m[..n],
        heading: &set.heading_offset_rad[..n],
        weight: &set.weight[..n],
    }
}

fn poses_mut(set: &mut Particles) -> PosesMut<'_> {
    PosesMut {
        x: &mut set.x_m,
        y: &mut set.y_m,
        heading: &mut set.heading_offset_rad,
        weight: &mut set.weight,
    }
}
