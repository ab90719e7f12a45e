//! A Kalman filter of fixed size: no allocation, one scalar measurement at a time. In double precision: variances of
//! squares of millimetres beside such of metres lose their symmetry, and then their sign, in single.

/// A state of N quantities and how they err.
#[derive(Clone, Debug)]
pub(crate) struct Kalman<const N: usize> {
    pub(crate) state: [f64; N],
    pub(crate) variance: [[f64; N]; N],
}

impl<const N: usize> Default for Kalman<N> {
    fn default() -> Self {
        Self { state: [0.0; N], variance: [[0.0; N]; N] }
    }
}

impl<const N: usize> Kalman<N> {
    /// Sets one quantity anew, as one that has nothing to do with the others.
    pub(crate) fn set(&mut self, index: usize, value: f32, sigma: f32) {
        self.state[index] = f64::from(value);
        for row in &mut self.variance {
            row[index] = 0.0;
        }
        self.variance[index] = [0.0; N];
        self.variance[index][index] = f64::from(sigma).powi(2);
    }

    /// Carries the variances on by a linear motion: F P F'.
    pub(crate) fn carry(&mut self, motion: &[[f64; N]; N]) {
        let half: [[f64; N]; N] = core::array::from_fn(|i| {
            let mut row = [0.0; N];
            for (share, from) in motion[i].iter().zip(&self.variance) {
                // Most of a motion is zeros.
                if *share != 0.0 {
                    for (sum, value) in row.iter_mut().zip(from) {
                        *sum += share * value;
                    }
                }
            }
            row
        });
        for (i, from) in half.iter().enumerate() {
            for (j, to) in motion.iter().enumerate().skip(i) {
                let value = from.iter().zip(to).map(|(a, b)| a * b).sum();
                (self.variance[i][j], self.variance[j][i]) = (value, value);
            }
        }
    }

    /// Takes a measurement of `along` times the state that misses it by `miss`, and returns what each quantity was moved
    /// by; `None` when it made no sense.
    pub(crate) fn measure(&mut self, along: &[f64; N], miss: f32, sigma: f32) -> Option<[f64; N]> {
        let column: [f64; N] =
            core::array::from_fn(|i| self.variance[i].iter().zip(along).map(|(v, a)| v * a).sum());
        let noise = column.iter().zip(along).map(|(c, a)| c * a).sum::<f64>() + f64::from(sigma).powi(2);
        if !(noise > 0.0 && miss.is_finite()) {
            return None;
        }
        let moved = column.map(|c| c / noise * f64::from(miss));
        for (value, moved) in self.state.iter_mut().zip(moved) {
            *value += moved;
        }
        for (row, a) in self.variance.iter_mut().zip(&column) {
            for (value, b) in row.iter_mut().zip(&column) {
                *value -= a * b / noise;
            }
        }
        Some(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_is_measured_twice_shows_a_velocity() {
        // Place and velocity, a second apart: 0 and then 1, each known to a centimetre.
        let mut filter = Kalman::<2>::default();
        filter.set(0, 0.0, 1.0);
        filter.set(1, 0.0, 10.0);
        filter.measure(&[1.0, 0.0], 0.0, 0.01).unwrap();
        filter.carry(&[[1.0, 1.0], [0.0, 1.0]]);
        let moved = filter.measure(&[1.0, 0.0], 1.0, 0.01).unwrap();
        assert!((filter.state[1] - 1.0).abs() < 1e-3 && moved[1] > 0.99, "{:?}", filter.state);
        assert!((filter.variance[1][1].sqrt() - 0.014).abs() < 1e-3, "{:?}", filter.variance);
        assert_eq!(filter.variance[0][1], filter.variance[1][0]);
        assert_eq!(filter.measure(&[1.0, 0.0], f32::NAN, 0.01), None);
        assert_eq!(filter.measure(&[0.0, 0.0], 1.0, 0.0), None, "nothing is measured, exactly");
        filter.set(0, 5.0, 0.5);
        assert_eq!((filter.state[0], filter.variance[0]), (5.0, [0.25, 0.0]));
        assert_eq!(filter.variance[1][0], 0.0);
    }
}
