//! Monte Carlo localization (thesis 2.1, equations 1 to 4): where a sonar-bearing quadrotor is on its plan.
//!
//! A particle is one hypothesis: position, velocity, the angle between compass zero and plan zero, and
//! the level error of the attitude it is told. [`Filter::update`] reads one particle set and writes the
//! next: it draws ancestors when the weights have become uneven, moves every particle by the measured
//! tilt (and by optical flow when there is any), weighs it by how well the sonar ranges fit what a cone
//! would hear from there, and sums the set up as an [`Estimate`] that also says how much to believe it.
//!
//! Columns in, columns out ([`ParticlesRef`], [`ParticlesMut`]): both sets may be samples in shared
//! memory. An update allocates nothing, reads no clock, and its result depends on its arguments alone.
//! What must survive a restart besides the set is the [`Generator`]'s state and the [`Memory`].
//!
//! ## The thesis's equations
//! * **1, 2** (motion): its `(ρ, θ)` odometry does not exist on a quadrotor, which measures tilt, so ρ and
//!   θ come from the particle's own velocity. Equation 2 writes `ρ = √(Δx²+Δy²) · N(0, σ²)`: a zero-mean
//!   factor, which on average does not move the particle at all. What is meant, and done here, is
//!   `ρ (1 + N(0, σ²))`; see [`noisy_distance`].
//! * **3** (Gaussian of the range error) is the *hit* part of the mixture in [`SonarModel`]: alone it
//!   lets a single unmapped chair rule out the truth.
//! * **4** (normalisation) as it stands.
//!
//! The thesis's filter as it stands, for comparison, is [`thesis::Filter`].
#![forbid(unsafe_code)]

mod beams;
mod config;
mod estimate;
mod filter;
mod generator;
mod map;
mod maths;
mod memory;
mod motion;
mod particles;
mod resample;
mod search;
mod sonar;
pub mod thesis;
mod trust;

pub use config::{Config, ConfigError, PopulationConfig, ResampleConfig, SonarConfig};
pub use estimate::{Estimate, State};
pub use filter::{Filter, Start, Update};
pub use generator::Generator;
pub use map::RangeMap;
pub use maths::wrap_angle;
pub use memory::Memory;
pub use motion::{Flow, Motion, MotionConfig, noisy_distance};
pub use particles::{ParticlesError, ParticlesMut, ParticlesRef};
pub use resample::draw_ancestors;
pub use search::{Hypothesis, Lattice, MAX_HEARD, Search, Trail, TrailPose, Turns};
pub use sonar::{Echo, MAX_READINGS, Reading, SonarModel, Sweep};
pub use trust::TrustConfig;
