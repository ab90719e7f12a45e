//! Cheap draws for the inner loop.

use rand::{Rng, RngExt};

/// A standard normal draw from one 64-bit word: the sum of its four 16-bit lanes (Irwin-Hall, n = 4).
///
/// Bounded at 3.46 sigma, which is enough for inertial noise and gusts, and takes a few nanoseconds
/// where an exact draw takes tens: the inner loop needs six of them a millisecond.
pub(crate) fn normal(random: &mut impl Rng) -> f64 {
    let word = random.next_u64();
    let sum = (word & 0xffff) + (word >> 16 & 0xffff) + (word >> 32 & 0xffff) + (word >> 48);
    // Each lane is uniform on 0..65535: mean 32767.5, variance (65536^2 - 1) / 12.
    const MEAN: f64 = 4.0 * 32767.5;
    const SCALE: f64 = 1.0 / 37_837.227_3;
    (sum as f64 - MEAN) * SCALE
}

/// Uniform on `-bound..bound`.
pub(crate) fn within(random: &mut impl Rng, bound: f64) -> f64 {
    (random.random::<f64>() * 2.0 - 1.0) * bound
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn normal_has_mean_zero_and_variance_one() {
        // N = 200 000, fixed seed: standard error of the mean 0.0022, of the variance about 0.003.
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let n = 200_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let x = normal(&mut random);
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(n);
        assert!(mean.abs() < 0.01, "{mean}");
        let variance = squares / f64::from(n) - mean * mean;
        assert!((variance - 1.0).abs() < 0.015, "{variance}");
    }
}
