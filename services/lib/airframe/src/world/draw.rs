//! Random draws that the world, its acoustics and its people share.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};

/// A generator for one purpose: equal seeds give equal draws whatever else is drawn from other purposes.
pub(crate) fn stream(seed: u64, purpose: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed ^ purpose.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Uniform in `low..high`.
pub(crate) fn uniform<R: Rng + ?Sized>(rng: &mut R, low: f32, high: f32) -> f32 {
    low + (high - low) * rng.random::<f32>()
}

/// True with probability `p`.
pub(crate) fn chance<R: Rng + ?Sized>(rng: &mut R, p: f32) -> bool {
    rng.random::<f32>() < p
}

/// An index below `n`; 0 when `n` is 0.
pub(crate) fn index<R: Rng + ?Sized>(rng: &mut R, n: usize) -> usize {
    let drawn = (rng.random::<f64>() * n as f64) as usize;
    drawn.min(n.saturating_sub(1))
}

/// Standard normal by Box and Muller's transform; the second value is thrown away so that the number of
/// draws never depends on history.
pub(crate) fn normal<R: Rng + ?Sized>(rng: &mut R) -> f32 {
    let radius = (-2.0 * (1.0 - rng.random::<f32>()).max(1e-12).ln()).sqrt();
    radius * (std::f32::consts::TAU * rng.random::<f32>()).cos()
}
