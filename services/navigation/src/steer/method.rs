//! Which method of avoidance is asked, chosen at start.

use crate::config::Method;
use avoid::{
    Avoider, ConfigError, Decision, Histogram, PotentialConfig, PotentialField, Situation, Vfh, VfhConfig,
};

/// A method, made.
#[derive(Clone, Debug)]
pub(super) enum Chosen {
    Vfh(Vfh),
    Potential(PotentialField),
}

/// What is asked first, and what is asked for a way with less room where that finds none. The thesis and the potential
/// field know one room only.
pub(super) fn build(method: Method, radius_m: f32) -> Result<(Chosen, Option<Vfh>), ConfigError> {
    Ok(match method {
        Method::Vfh => {
            (Chosen::Vfh(Vfh::new(VfhConfig::flight(radius_m))?), Some(Vfh::new(VfhConfig::tight(radius_m))?))
        }
        Method::Thesis => (Chosen::Vfh(Vfh::new(VfhConfig::thesis())?), None),
        Method::Potential => {
            (Chosen::Potential(PotentialField::new(PotentialConfig::flight(radius_m))?), None)
        }
    })
}

impl Avoider for Chosen {
    fn name(&self) -> &'static str {
        match self {
            Self::Vfh(vfh) => vfh.name(),
            Self::Potential(field) => field.name(),
        }
    }

    fn decide(&mut self, situation: &Situation<'_>, histogram: &mut Histogram<'_>) -> Decision {
        match self {
            Self::Vfh(vfh) => vfh.decide(situation, histogram),
            Self::Potential(field) => field.decide(situation, histogram),
        }
    }

    fn forget(&mut self) {
        match self {
            Self::Vfh(vfh) => vfh.forget(),
            Self::Potential(field) => field.forget(),
        }
    }
}
