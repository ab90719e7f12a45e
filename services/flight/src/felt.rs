//! What the controller's accelerometer feels, in m/s2.

/// m/s2.
const GRAVITY_M_S2: f32 = 9.806_65;
/// What one g reads in MSP_RAW_IMU: 512, or 256 on boards with a coarse accelerometer.
const ONE_G: [f32; 2] = [512.0, 256.0];
/// A reading within this share of one of them may be one g: scale errors, vibration and the gusts of a hover together.
const NEAR: core::ops::Range<f32> = 0.8..1.25;
/// So many in a row say which it is: half a second at 30 Hz. A drone that falls as long falls deeper than it flies.
const AGREE: u8 = 15;
/// What is felt in a free fall is a rest of drag: less than this share of one g is a sensor that tells nothing.
const LEAST: f32 = 0.1;
/// More is a crash, no flight, in g.
const MOST: f32 = 4.0;

/// The scale, once it is known: a fall at half a g on a fine board reads as one g does on a coarse one, so that it cannot
/// be told by a single reading.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Felt {
    one_g: Option<f32>,
    candidate: f32,
    agreed: u8,
}

impl Felt {
    /// MSP_RAW_IMU to m/s2 along body x, y and z; `None` until the scale is known and for what is no flight.
    pub(crate) fn take(&mut self, accelerometer: [i16; 3]) -> Option<[f32; 3]> {
        let axes = accelerometer.map(f32::from);
        let all = axes.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
        let one_g = self.one_g.or_else(|| self.learn(all))?;
        (LEAST..MOST).contains(&(all / one_g)).then(|| axes.map(|axis| axis / one_g * GRAVITY_M_S2))
    }

    fn learn(&mut self, all: f32) -> Option<f32> {
        let near = ONE_G.into_iter().find(|one_g| NEAR.contains(&(all / one_g)));
        self.agreed = if near == Some(self.candidate) { self.agreed + 1 } else { 1 };
        self.candidate = near?;
        if self.agreed >= AGREE {
            self.one_g = near;
        }
        self.one_g
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(one_g: i16) -> Felt {
        let mut felt = Felt::default();
        assert!((0..14).all(|_| felt.take([0, 0, one_g]).is_none()), "a few readings are no scale");
        assert!(felt.take([0, 0, one_g]).is_some());
        felt
    }

    #[test]
    fn a_fall_at_half_a_g_is_no_coarse_accelerometer() {
        for one_g in [512, 256] {
            let mut felt = standing(one_g);
            for percent in [20u8, 50, 56, 70, 100, 140, 200] {
                let [x, y, z] = felt
                    .take([0, 0, (i32::from(one_g) * i32::from(percent) / 100) as i16])
                    .expect("it is told");
                let expected = GRAVITY_M_S2 * f32::from(percent) * 0.01;
                assert!(x == 0.0 && y == 0.0 && (z - expected).abs() < 0.05, "{one_g}: {percent} %: {z}");
            }
        }
    }

    #[test]
    fn a_dead_sensor_and_one_that_is_over_its_end_tell_nothing() {
        let mut felt = standing(512);
        assert_eq!(felt.take([0, 0, 0]), None);
        assert_eq!(felt.take([i16::MAX, 0, 0]), None);
        let mut never = Felt::default();
        assert!((0..100).all(|_| never.take([0, 0, 0]).is_none()));
        let mut wild = Felt::default();
        assert!((0..100).all(|k| wild.take([0, 0, if k % 2 == 0 { 512 } else { 256 }]).is_none()));
    }
}
