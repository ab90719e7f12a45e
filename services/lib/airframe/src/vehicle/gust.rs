//! Moving air indoors: coloured noise on the acceleration, stronger near walls.

use super::noise::normal;
use nalgebra::Vector3;
use rand::Rng;

/// Rms of each horizontal component far from walls, m/s^2 (FACTS 8: the level that its flights had).
const HORIZONTAL_M_S2: f64 = 0.2;
/// Rms of the vertical component: downwash recirculates less upwards than sideways.
const VERTICAL_M_S2: f64 = 0.12;
/// Rms of the angular acceleration about roll and pitch, rad/s^2: shaken, not turned.
const ANGULAR_RAD_S2: f64 = 0.6;
/// Correlation time, seconds: the time a rotor-sized eddy takes to pass.
const CORRELATION_S: f64 = 0.6;
/// Share by which the wall's own recirculation adds at contact, and the distance over which it fades.
const WALL_SHARE: f64 = 0.6;
const WALL_FADE_M: f64 = 0.5;

/// An Ornstein-Uhlenbeck process in six components: the first-order Dryden shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gust {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
    strength: f64,
}

impl Gust {
    /// Moves on by `dt` seconds, `wall_m` away from the nearest wall.
    pub(crate) fn advance(&mut self, dt: f64, wall_m: f64, random: &mut impl Rng) {
        let keep = (-dt / CORRELATION_S).exp();
        let kick = (1.0 - keep * keep).sqrt();
        for i in 0..3 {
            self.linear[i] = self.linear[i] * keep + kick * normal(random);
            self.angular[i] = self.angular[i] * keep + kick * normal(random);
        }
        self.strength = 1.0 + WALL_SHARE * (-wall_m.max(0.0) / WALL_FADE_M).exp();
    }

    /// World frame, m/s^2.
    pub(crate) fn acceleration(&self) -> Vector3<f64> {
        Vector3::new(
            self.linear.x * HORIZONTAL_M_S2,
            self.linear.y * HORIZONTAL_M_S2,
            self.linear.z * VERTICAL_M_S2,
        ) * self.strength
    }

    /// Body frame, rad/s^2.
    pub(crate) fn angular_acceleration(&self) -> Vector3<f64> {
        Vector3::new(self.angular.x, self.angular.y, self.angular.z * 0.3) * (ANGULAR_RAD_S2 * self.strength)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn rms_is_as_stated_and_larger_at_a_wall() {
        // 2000 s = about 1700 independent draws a component: the rms is known within 2 %.
        let rms = |wall: f64| {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
            let mut gust = Gust::default();
            let mut sum = 0.0;
            for _ in 0..200_000 {
                gust.advance(0.01, wall, &mut random);
                sum += gust.acceleration().x.powi(2);
            }
            (sum / 200_000.0).sqrt()
        };
        let far = rms(10.0);
        assert!((far - 0.2).abs() < 0.02, "{far}");
        assert!(rms(0.1) > 1.4 * far);
    }
}
