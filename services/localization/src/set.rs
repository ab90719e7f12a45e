//! The particle set where it lies: in a sample of our own topic, or in what the keeper gave back.

use ipc_types::{MAX_PARTICLES, Particles};
use mcl::{ParticlesMut, ParticlesRef};
use runtime::Guard;

/// Entry of [`Particles::memory`], after those of [`mcl::Memory`]: 1 while the skids were on the ground.
pub(crate) const MEMORY_GROUNDED: usize = 15;

/// And the one before: how far the place was found, one of [`Seeking`].
pub(crate) const MEMORY_SEEKING: usize = 14;

/// How far the place was found: what must survive a restart, or a place that nobody has checked would be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seeking {
    /// It is not in question.
    No,
    /// The set is what competes in a search.
    Hypotheses,
    /// Found, and not checked yet by what was heard after.
    Unchecked,
    /// Refuted by its check, or suspected by the audits.
    Suspected,
}

impl Seeking {
    /// As it stands in the memory.
    pub(crate) fn code(self) -> f32 {
        match self {
            Self::No => 0.0,
            Self::Hypotheses => 1.0,
            Self::Unchecked => 2.0,
            Self::Suspected => 3.0,
        }
    }

    /// What stands in a memory; anything else that is there says no.
    pub(crate) fn of(code: f32) -> Self {
        let all = [Self::Hypotheses, Self::Unchecked, Self::Suspected];
        all.into_iter().find(|seeking| seeking.code() == code).unwrap_or(Self::No)
    }
}

/// The last set.
pub(crate) enum Set {
    /// None yet: the first one is drawn around the start.
    None,
    /// From the keeper, after a restart.
    Kept(Box<Particles>),
    /// From our own subscription.
    Live(Guard<Particles>),
}

impl Set {
    pub(crate) fn get(&self) -> Option<&Particles> {
        match self {
            Self::None => None,
            Self::Kept(set) => Some(set),
            Self::Live(set) => Some(set),
        }
    }
}

/// Columns of a set, to be read. A count beyond the capacity reads as the capacity.
pub(crate) fn columns(set: &Particles) -> ParticlesRef<'_> {
    let n = (set.count as usize).min(MAX_PARTICLES);
    ParticlesRef {
        x: &set.x_m[..n],
        y: &set.y_m[..n],
        velocity_x: &set.velocity_x_m_s[..n],
        velocity_y: &set.velocity_y_m_s[..n],
        heading_offset: &set.heading_offset_rad[..n],
        level_roll: &set.level_roll_rad[..n],
        level_pitch: &set.level_pitch_rad[..n],
        weight: &set.weight[..n],
    }
}

/// Columns of a loan, to be written.
pub(crate) fn columns_mut(set: &mut Particles) -> ParticlesMut<'_> {
    ParticlesMut {
        x: &mut set.x_m,
        y: &mut set.y_m,
        velocity_x: &mut set.velocity_x_m_s,
        velocity_y: &mut set.velocity_y_m_s,
        heading_offset: &mut set.heading_offset_rad,
        level_roll: &mut set.level_roll_rad,
        level_pitch: &mut set.level_pitch_rad,
        weight: &mut set.weight,
    }
}

/// The plan's hash as sets carry it.
pub(crate) fn fold(hash: u64) -> u32 {
    (hash ^ (hash >> 32)) as u32
}
