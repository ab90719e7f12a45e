//! Random numbers whose state travels with the particle set.

use core::convert::Infallible;
use rand::{SeedableRng, TryRng};

/// xoshiro256++ (Blackman and Vigna, "Scrambled linear pseudorandom number generators", 2021). The state
/// is four words that can be stored and restored, so that a restarted filter draws what it would have
/// drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Generator([u64; 4]);

impl Generator {
    /// A generator whose state is expanded from `seed` by splitmix64, as its authors advise.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut z = seed;
        Self(core::array::from_fn(|_| {
            z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut word = z;
            word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            word ^ (word >> 31)
        }))
    }

    /// The state, for the message that carries the particle set.
    #[must_use]
    pub const fn state(&self) -> [u64; 4] {
        self.0
    }

    /// Goes on where [`Self::state`] was taken. All zeros, which the generator can never reach nor
    /// leave, stand for "no state" and give the generator of seed 0.
    #[must_use]
    pub fn from_state(state: [u64; 4]) -> Self {
        if state == [0; 4] { Self::new(0) } else { Self(state) }
    }

    #[inline]
    fn next(&mut self) -> u64 {
        let s = &mut self.0;
        let out = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        out
    }

    /// Uniform in 0..1 with 24 bits.
    #[inline]
    #[must_use]
    pub fn uniform(&mut self) -> f32 {
        (self.next() >> 40) as f32 * (1.0 / 16_777_216.0)
    }
}

impl TryRng for Generator {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok((self.next() >> 32) as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.next())
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(8) {
            let word = self.next().to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
        Ok(())
    }
}

impl SeedableRng for Generator {
    type Seed = [u8; 32];

    fn from_seed(seed: [u8; 32]) -> Self {
        let mut state = [0; 4];
        for (word, bytes) in state.iter_mut().zip(seed.chunks_exact(8)) {
            for (i, byte) in bytes.iter().enumerate() {
                *word |= u64::from(*byte) << (8 * i);
            }
        }
        Self::from_state(state)
    }

    fn seed_from_u64(seed: u64) -> Self {
        Self::new(seed)
    }
}

/// Generators side by side: one instruction serves several of them. So many that the compiler keeps the loops over
/// them, which it turns into vector instructions, instead of writing each lane out.
const LANES: usize = 32;

/// Many xoshiro128++ side by side, seeded from a [`Generator`] for the length of one update: only adds,
/// shifts and exclusive-ors on 32-bit words, which every vector unit has.
pub(crate) struct Lanes([[u32; LANES]; 4]);

impl Lanes {
    pub(crate) fn new(generator: &mut Generator) -> Self {
        let mut lanes = [[0; LANES]; 4];
        for row in &mut lanes {
            for word in row.iter_mut() {
                // Odd, so that no lane can be all zeros.
                *word = (generator.next() >> 32) as u32 | 1;
            }
        }
        Self(lanes)
    }

    /// Fills `out` with draws of mean 0 and variance 1: the sum of the four bytes of a word (Irwin and
    /// Hall). Bell-shaped, cut at 3.45 sigma, in steps of 0.007 sigma: as good as a Gaussian for process
    /// noise, which is a guess in itself, and ten times cheaper.
    #[inline]
    pub(crate) fn fill_normal(&mut self, out: &mut [f32]) {
        // A byte has variance (256² - 1) / 12; four of them have the mean 510.
        const SCALE: f32 = 0.006_765_814; // 1 / sqrt(4 · 65535 / 12)
        let draw = |word: u32| {
            let pairs = (word & 0x00ff_00ff) + ((word >> 8) & 0x00ff_00ff);
            (((pairs & 0xffff) + (pairs >> 16)).cast_signed() - 510) as f32 * SCALE
        };
        let (whole, rest) = out.as_chunks_mut::<LANES>();
        for chunk in whole {
            *chunk = self.next().map(draw);
        }
        if !rest.is_empty() {
            for (out, word) in rest.iter_mut().zip(self.next()) {
                *out = draw(word);
            }
        }
    }

    #[inline]
    fn next(&mut self) -> [u32; LANES] {
        let [s0, s1, s2, s3] = &mut self.0;
        let mut out = [0; LANES];
        for i in 0..LANES {
            out[i] = s0[i].wrapping_add(s3[i]).rotate_left(7).wrapping_add(s0[i]);
            let t = s1[i] << 9;
            s2[i] ^= s0[i];
            s3[i] ^= s1[i];
            s1[i] ^= s2[i];
            s0[i] ^= s3[i];
            s2[i] ^= t;
            s3[i] = s3[i].rotate_left(11);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::{Generator, Lanes};
    use rand::{Rng, SeedableRng};

    #[test]
    fn a_restored_generator_goes_on_where_it_was() {
        let mut a = Generator::new(5);
        a.next_u64();
        let mut b = Generator::from_state(a.state());
        assert_eq!([a.next_u64(), a.next_u64()], [b.next_u64(), b.next_u64()]);
        assert_eq!(Generator::from_state([0; 4]), Generator::new(0), "all zeros would stand still");
        assert_ne!(Generator::from_seed([7; 32]).next_u64(), Generator::from_seed([8; 32]).next_u64());
    }

    /// First outputs for state 1 2 3 4, computed by hand from the published algorithm.
    #[test]
    fn it_is_xoshiro256_plus_plus() {
        let mut g = Generator::from_state([1, 2, 3, 4]);
        assert_eq!(g.next_u64(), (5u64 << 23) + 1);
        assert_eq!(g.next_u64(), 58_720_359);
    }

    /// N = 800 000 draws, fixed seed. Standard errors: mean 0.0011, variance 0.0015, lag-one correlation
    /// 0.0011; bounds at about five of them.
    #[test]
    fn draws_have_the_moments_of_a_standard_normal() {
        let mut lanes = Lanes::new(&mut Generator::new(1));
        let mut draws = vec![0.0f32; 800_000];
        lanes.fill_normal(&mut draws);
        let n = draws.len() as f64;
        let mean = draws.iter().map(|d| f64::from(*d)).sum::<f64>() / n;
        let variance = draws.iter().map(|d| f64::from(*d).powi(2)).sum::<f64>() / n - mean * mean;
        let lag = draws.windows(2).map(|w| f64::from(w[0] * w[1])).sum::<f64>() / n;
        assert!(mean.abs() < 0.006, "{mean}");
        assert!((variance - 1.0).abs() < 0.008, "{variance}");
        assert!(lag.abs() < 0.006, "{lag}");
        let beyond_two = draws.iter().filter(|d| d.abs() > 2.0).count() as f64 / n;
        assert!((0.035..0.055).contains(&beyond_two), "{beyond_two} beyond two sigma, 0.0455 for a normal");
    }
}
