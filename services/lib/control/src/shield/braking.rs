//! How far a stop takes (FACTS 2).

/// The braking law d = v (`delay`) + v^2 / 2 a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Braking {
    /// From the moment that something could have been seen to the moment that the brakes bite, seconds: the
    /// time of a whole sonar sweep plus 0.35 s of processing, link and attitude response.
    pub delay_s: f32,
    /// Deceleration once they bite, m/s2.
    pub deceleration_m_s2: f32,
}

impl Braking {
    /// Way to a stop from `speed`, metres.
    #[must_use]
    pub fn distance(&self, speed_m_s: f32) -> f32 {
        let v = speed_m_s.max(0.0);
        v * self.delay_s + v * v / (2.0 * self.deceleration_m_s2)
    }

    /// The greatest speed that can still be stopped within `distance`; 0 for nothing or less.
    #[must_use]
    pub fn speed(&self, distance_m: f32) -> f32 {
        let (a, t) = (self.deceleration_m_s2, self.delay_s);
        // Of a number and none `max` takes the number: a way that is none, or far behind, is no way.
        (a * ((t * t + 2.0 * distance_m / a).sqrt() - t)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::Braking;
    use proptest::prelude::*;

    #[test]
    fn the_examples_of_the_facts() {
        // Eight one by one (0.48 s a sweep) and in pairs (0.24 s).
        for (sweep, speed, distance) in
            [(0.48, 0.5, 0.48), (0.24, 0.5, 0.36), (0.48, 1.0, 1.08), (0.24, 1.0, 0.84)]
        {
            let braking = Braking { delay_s: sweep + 0.35, deceleration_m_s2: 2.0 };
            assert!((braking.distance(speed) - distance).abs() < 0.006, "{}", braking.distance(speed));
        }
    }

    #[test]
    fn no_way_is_no_speed() {
        let braking = Braking { delay_s: 0.59, deceleration_m_s2: 2.0 };
        for way in [0.0, -0.0, -1e-6, -0.3, -10.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(braking.speed(way), 0.0, "{way} m");
        }
    }

    proptest! {
        #[test]
        fn the_speed_always_stops_in_time(d in -1.0f32..10.0, t in 0.0f32..2.0, a in 0.5f32..4.0) {
            let braking = Braking { delay_s: t, deceleration_m_s2: a };
            let v = braking.speed(d);
            prop_assert!(v >= 0.0 && braking.distance(v) <= d.max(0.0) * 1.0001 + 1e-4);
            // Nothing is given away: a little faster would not stop in time.
            prop_assert!(d <= 0.0 || braking.distance(v + 0.01) > d);
        }
    }
}
