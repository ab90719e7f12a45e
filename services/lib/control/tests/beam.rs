//! The height by a narrow beam: floors, carpets, tables, and the drone's own motion.

use control::{HeightConfig, HeightEcho, HeightEstimator};

/// Uniform noise from a seed, of standard deviation 1.
struct Noise(u64);
impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 12.0_f32.sqrt()
    }
}

const REST_M: f32 = 0.08;

/// Flies `height(t)` over `surface(t)` for `seconds` at 50 Hz with 25 ranges a second of noise `sigma_m`; what the
/// estimate errs by at worst and rms from the third second on, and how many steps were found.
fn fly(
    seconds: f32,
    sigma_m: f32,
    height: impl Fn(f32) -> f32,
    surface: impl Fn(f32) -> f32,
) -> (f32, f32, u32) {
    let mut noise = Noise(7);
    let mut estimate = HeightEstimator::new(HeightConfig::default(), 0.06);
    estimate.set(1, height(0.0), 0.0, 0.0);
    let (mut worst, mut sum, mut count, mut steps) = (0.0f32, 0.0f32, 0, 0);
    for i in 1..(seconds * 50.0) as u64 {
        let (now, t) = (1 + i * 20_000_000, i as f32 * 0.02);
        estimate.predict(now, 0.0);
        if i % 2 == 0 {
            let range = height(t) - surface(t) + REST_M + sigma_m * noise.next();
            steps += u32::from(estimate.measure_beam(now, range, REST_M, 0.0) == HeightEcho::Step);
        }
        if t > 3.0 {
            let error = estimate.height_m() - height(t);
            worst = worst.max(error.abs());
            sum += error * error;
            count += 1;
        }
    }
    (worst, (sum / count as f32).sqrt(), steps)
}

/// Noise of a laser range finder at 1.2 m: 1 % and 6 mm over floors, four times that over carpets.
const FLOOR_M: f32 = 0.018;
const CARPET_M: f32 = 0.072;

#[test]
fn it_holds_the_height_over_floors_and_carpets() {
    let (worst, rms, steps) = fly(60.0, FLOOR_M, |_| 1.2, |_| 0.0);
    assert!(worst < 0.06 && rms < 0.02 && steps == 0, "{worst} {rms} {steps}");
    let (worst, rms, steps) = fly(60.0, CARPET_M, |_| 1.2, |_| 0.0);
    assert!(worst < 0.15 && rms < 0.05 && steps == 0, "{worst} {rms} {steps}");
}

#[test]
fn tables_and_chairs_flown_over_are_levels_and_no_motion() {
    // A table of 0.75 m for two seconds, a chair for half a second, again and again.
    let surface = |t: f32| match t % 6.0 {
        s if s < 2.0 => 0.75,
        s if (3.0..3.5).contains(&s) => 0.45,
        _ => 0.0,
    };
    let (worst, rms, steps) = fly(60.0, FLOOR_M, |_| 1.2, surface);
    assert!(worst < 0.15 && rms < 0.06, "{worst} {rms}");
    assert!((30..=50).contains(&steps), "four edges each six seconds: {steps}");
}

#[test]
fn the_rim_of_a_trolley_is_no_motion() {
    // A bed of 0.18 m that is seen for 0.3 s before and after a load of 0.6 m: less than what a carpet's ranges
    // scatter by, far more than a floor's.
    let surface = |t: f32| match t % 6.0 {
        s if (2.0..2.3).contains(&s) || (4.3..4.6).contains(&s) => 0.18,
        s if (2.3..4.3).contains(&s) => 0.6,
        _ => 0.0,
    };
    let (worst, rms, _) = fly(60.0, FLOOR_M, |_| 1.2, surface);
    assert!(worst < 0.1 && rms < 0.04, "{worst} {rms}");
}

#[test]
fn a_height_that_was_wrong_comes_right() {
    // 0.15 m too low at the start, no step, no rim.
    let (worst, rms, steps) = fly(30.0, FLOOR_M, |t| if t < 0.1 { 1.05 } else { 1.2 }, |_| 0.0);
    assert!(worst < 0.06 && rms < 0.03 && steps == 0, "{worst} {rms} {steps}");
}

#[test]
fn it_follows_a_climb_that_the_thrust_model_does_not_know() {
    // Sways by 0.3 m in 3 s: 1.3 m/s2 at most, which the estimator is not told.
    let (worst, rms, steps) = fly(30.0, FLOOR_M, |t| 1.2 + 0.15 * (t * 2.1).sin(), |_| 0.0);
    assert!(worst < 0.12 && rms < 0.05 && steps == 0, "{worst} {rms} {steps}");
}

#[test]
fn a_fall_that_is_felt_is_no_floor_that_rises() {
    // 1.5 m/s2 down for half a second, which the thrust model does not know, over a carpet; 40 seeds, the errors of
    // height and climb rate at its end, rms.
    let sunk = |felt: bool| {
        let (mut off, mut slow) = (0.0f32, 0.0f32);
        for seed in 0..40 {
            let mut noise = Noise(seed);
            let mut estimate = HeightEstimator::new(HeightConfig::default(), 0.06);
            estimate.set(1, 1.2, 0.0, 0.0);
            let (mut height, mut climb) = (1.2f32, 0.0f32);
            for i in 1..125u64 {
                let (now, t) = (1 + i * 20_000_000, i as f32 * 0.02);
                let falls = if t >= 2.0 { -1.5 } else { 0.0 };
                climb += falls * 0.02;
                height += climb * 0.02;
                if felt && i % 2 == 1 {
                    estimate.feel(now, falls);
                }
                estimate.predict(now, 0.0);
                if i % 2 == 0 {
                    let range = height + REST_M + CARPET_M * noise.next();
                    estimate.measure_beam(now, range, REST_M, 0.0);
                }
            }
            off += (estimate.height_m() - height).powi(2) / 40.0;
            slow += (estimate.climb_m_s() - climb).powi(2) / 40.0;
        }
        (off.sqrt(), slow.sqrt())
    };
    let ((blind, fast), (off, slow)) = (sunk(false), sunk(true));
    assert!(off < 0.7 * blind && slow < 0.5 * fast, "unfelt {blind} m, {fast} m/s; felt {off} m, {slow} m/s");
}

#[test]
fn nonsense_is_refused() {
    let mut estimate = HeightEstimator::new(HeightConfig::default(), 0.06);
    estimate.set(1, 1.2, 0.0, 0.0);
    for (range, tilt) in [(f32::NAN, 0.0), (-1.0, 0.0), (0.0, 0.0), (1e9, 0.0), (1.2, 1.0)] {
        assert_eq!(estimate.measure_beam(2, range, REST_M, tilt), HeightEcho::Refused, "{range} {tilt}");
    }
}
