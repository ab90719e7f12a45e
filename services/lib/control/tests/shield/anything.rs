//! The shield over arbitrary readings and wishes.

use super::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn what_is_let_through_can_always_be_stopped(
        ranges in proptest::collection::vec(prop_oneof![Just(None), (0.03f32..4.0).prop_map(Some)], 8),
        ages in proptest::collection::vec(0u64..900, 8),
        heading in -PI..PI,
        wish in (-2.0f32..2.0, -2.0f32..2.0),
        flown in (-2.0f32..2.0, -2.0f32..2.0),
        sweep in 0.1f32..1.0,
        clearance_m in prop_oneof![Just(0.0f32), Just(1.0)],
    ) {
        let mut shield = eight();
        shield.set_sweep(sweep);
        let now = 10_000_000_000u64;
        for (k, (range, age)) in ranges.iter().zip(&ages).enumerate() {
            let echo = range.map_or(Echo::Nothing, Echo::Range);
            shield.hear(k, Look { at_ns: now - age * 1_000_000, heading, place: None, echo });
        }
        let flown = Vector::new(flown.0, flown.1);
        let footing = Footing { heading, velocity: flown, clearance_m, ..somewhere() };
        let wish = Vector::new(wish.0, wish.1);
        let v = shield.guard(now, Wish::to(wish), &footing, &Surroundings::default()).velocity;
        let speed = v.norm();
        // Push and brake at their most.
        prop_assert!(speed <= wish.norm() + 0.71);
        if speed > 1e-3 {
            // Who slides along a thing has it exactly abreast, and rounding says whether it is ahead: a hair to either side.
            let free = [-1e-4f32, 0.0, 1e-4]
                .map(|hair| shield.heard_way(now, Vector::along(v.angle() + hair), flown, RADIUS + 0.03))
                .into_iter()
                .fold(0.0, f32::max);
            prop_assert!(shield.braking().distance(speed) <= free + 1e-3, "{speed} in {free}");
        }
        if speed > 0.101 {
            // Somebody looks there, and not long ago.
            let looked = (0..8).any(|k| {
                let off = control::wrap_angle(v.angle() - heading - k as f32 * FRAC_PI_4).abs();
                off < 28.2f32.to_radians() && (ages[k] as f32) * 1e-3 <= 2.0 * sweep + 1e-3
            });
            prop_assert!(looked);
        }
    }

    #[test]
    fn nonsense_does_no_harm(bits in proptest::collection::vec(any::<u32>(), 12)) {
        let f = |k: usize| f32::from_bits(bits[k]);
        let mut shield = eight();
        shield.set_sweep(f(0));
        for k in 0..20 {
            shield.hear(k, Look { at_ns: u64::from(bits[1]), heading: f(2), place: Vector::new(f(7), f(8)).known(), echo: Echo::Range(f(3 + k % 4)) });
        }
        let wish = Vector::new(f(10), f(11));
        let footing = Footing {
            place: Vector::new(f(7), f(8)).known(),
            sigma_m: f(9),
            heading: f(2),
            velocity: wish,
            clearance_m: f(6),
        };
        let walls = DistanceField::new(&door(), 2.0);
        let v = shield.guard(u64::from(bits[1]), Wish::to(wish), &footing, &among(&walls)).velocity;
        prop_assert!(v.is_finite());
    }
}
