//! What a stick asks for in ANGLE: a tilt, or a turn rate. Each firmware has its own curve.

/// The curve of a firmware at its default rates. `x` is (channel - 1500) / 500, -1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StickLaw {
    /// Tilt and turn rate by one curve, (centre x + (largest - centre) x |x|) / largest: Betaflight's "actual" rates,
    /// measured on 4.5 to 2026.12 (FACTS 1).
    Actual {
        /// Degrees of tilt at full stick.
        angle_limit_deg: f64,
        /// Degrees a second a unit of stick at the centre, and at full stick.
        rates_deg_s: [f64; 2],
    },
    /// Tilt in proportion to the stick; turn rate 200 x / (1 - super |x|): Betaflight before 4.3 at rate 1.
    Linear {
        /// Degrees of tilt at full stick.
        angle_limit_deg: f64,
        /// The super rate.
        super_rate: f64,
    },
    /// Both by x (1 - expo + expo x^2): INAV.
    Expo {
        /// Degrees of tilt at full stick, and the expo of roll and pitch.
        angle: [f64; 2],
        /// Degrees a second at full stick, and the expo of yaw.
        yaw: [f64; 2],
    },
}

/// Degrees a second a unit of stick of Betaflight's old rates at rate 1.
const OLD_RATE_DEG_S: f64 = 200.0;

fn expo(x: f64, [full, expo]: [f64; 2]) -> f64 {
    full * x * (1.0 - expo + expo * x * x)
}

impl StickLaw {
    /// The stick's share of [`Self::largest_angle_deg`].
    pub(crate) fn angle_share(&self, x: f64) -> f64 {
        match *self {
            Self::Actual { rates_deg_s: [centre, largest], .. } => {
                (centre * x + (largest - centre) * x * x.abs()) / largest
            }
            Self::Linear { .. } => x,
            Self::Expo { angle: [_, curve], .. } => expo(x, [1.0, curve]),
        }
    }

    /// Tilt at full stick, degrees.
    pub(crate) fn largest_angle_deg(&self) -> f64 {
        match *self {
            Self::Actual { angle_limit_deg, .. } | Self::Linear { angle_limit_deg, .. } => angle_limit_deg,
            Self::Expo { angle: [full, _], .. } => full,
        }
    }

    /// The stick's share of [`Self::largest_rate_deg_s`].
    pub(crate) fn rate_share(&self, x: f64) -> f64 {
        match *self {
            Self::Actual { .. } => self.angle_share(x),
            Self::Linear { super_rate, .. } => x * (1.0 - super_rate) / (1.0 - super_rate * x.abs()),
            Self::Expo { yaw: [_, curve], .. } => expo(x, [1.0, curve]),
        }
    }

    /// Rate at full stick, degrees a second.
    pub(crate) fn largest_rate_deg_s(&self) -> f64 {
        match *self {
            Self::Actual { rates_deg_s: [_, largest], .. } => largest,
            Self::Linear { super_rate, .. } => OLD_RATE_DEG_S / (1.0 - super_rate),
            Self::Expo { yaw: [full, _], .. } => full,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::controller::Firmware;

    #[test]
    fn the_law_of_betaflight_since_4_5_is_the_measured_one() {
        // FACTS 1: 100 us gives 3.4, 200 gives 11.1, 300 gives 23.1 degrees.
        for firmware in [Firmware::Betaflight4_5, Firmware::Betaflight2025_12, Firmware::Betaflight2026_12] {
            let law = firmware.personality().stick;
            for (offset, degrees) in
                [(100.0, 3.4), (200.0, 11.1), (300.0, 23.1), (500.0, 60.0), (-200.0, -11.1)]
            {
                let angle = law.largest_angle_deg() * law.angle_share(offset / 500.0);
                assert!((angle - degrees).abs() < 0.25, "{offset}: {angle}");
            }
        }
    }

    #[test]
    fn the_others_by_hand() {
        let at = |firmware: Firmware, x: f64| {
            let law = firmware.personality().stick;
            (law.largest_angle_deg() * law.angle_share(x), law.largest_rate_deg_s() * law.rate_share(x))
        };
        // 55 x 0.4, and 200 x 0.4 / (1 - 0.7 x 0.4).
        let (angle, rate) = at(Firmware::Flip32, 0.4);
        assert!((angle - 22.0).abs() < 1e-9 && (rate - 111.11).abs() < 0.01, "{angle} {rate}");
        // 30 x 0.4 (0.3 + 0.7 x 0.16), and 200 x 0.4 (0.8 + 0.2 x 0.16).
        let (angle, rate) = at(Firmware::Inav9_1, -0.4);
        assert!((angle + 4.944).abs() < 1e-9 && (rate + 66.56).abs() < 1e-9, "{angle} {rate}");
    }
}
