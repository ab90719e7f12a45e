use super::*;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

const DT: f64 = 0.001;
const AROUND: Surroundings = Surroundings { surface_m: 0.0, wall_m: 10.0, push: None };

fn vehicle() -> manifest::Vehicle {
    crate::testing::watchman()
}

fn quadrotor(z: f64) -> (Quadrotor, Xoshiro256PlusPlus) {
    let (shape, pack) = Shape::new(&vehicle(), &Variation::NONE);
    let mut craft = Quadrotor::new(shape, pack, 0.0, 0.0, 0.0, 0.0);
    craft.motion.position.z += z;
    craft.touching = z <= 0.0;
    (craft, Xoshiro256PlusPlus::seed_from_u64(3))
}

#[test]
fn it_stands_still_on_its_feet() {
    let (mut craft, mut random) = quadrotor(0.0);
    for _ in 0..10_000 {
        craft.step(DT, &[0.0; 4], &AROUND, &mut random);
    }
    let m = craft.motion();
    assert!(craft.touching());
    assert!(m.position.x.hypot(m.position.y) < 0.02, "{:?}", m.position);
    assert!(m.tilt() < 0.005 && m.rates.norm() < 0.05, "{} {:?}", m.tilt(), m.rates);
    assert!(craft.lowest_m().abs() < 0.005, "{}", craft.lowest_m());
    assert!((m.specific_force.z - GRAVITY_M_S2).abs() < 0.5);
}

#[test]
fn it_falls_with_gravity_when_motors_are_off() {
    let (mut craft, mut random) = quadrotor(10.0);
    for _ in 0..500 {
        craft.step(DT, &[0.0; 4], &AROUND, &mut random);
    }
    // v = 4.9 m/s less some drag; gusts add a few centimetres a second.
    let fall = -craft.motion().velocity.z;
    assert!((4.4..5.0).contains(&fall), "{fall}");
}

/// Thrust minus weight is what accelerates, and the power at hover is what momentum theory says.
#[test]
fn thrust_power_and_weight_agree() {
    let (mut craft, mut random) = quadrotor(10.0);
    let file = vehicle();
    let hover = f64::from(file.hover_fraction()).sqrt();
    for _ in 0..300 {
        craft.step(DT, &[hover; 4], &AROUND, &mut random);
    }
    // Without battery sag this command would hover; with it, it sinks a little.
    let sink = -craft.motion().velocity.z;
    assert!((-0.1..0.8).contains(&sink), "{sink}");
    // A craft of this size hovers on 120 to 200 W per kilogram with guards around its propellers.
    let watts = craft.battery().volts() * craft.battery().amps();
    assert!((110.0..220.0).contains(&watts), "{watts}");
}

#[test]
fn each_motor_turns_the_craft_as_mounted() {
    // More thrust on the left rolls right (positive); on the rear, nose down (positive); on the two that
    // turn clockwise (rear right, front left), counter-clockwise (positive).
    for (commands, axis) in [([0.4, 0.4, 0.6, 0.6], 0), ([0.6, 0.4, 0.6, 0.4], 1), ([0.6, 0.4, 0.4, 0.6], 2)]
    {
        let (mut craft, mut random) = quadrotor(5.0);
        for _ in 0..100 {
            craft.step(DT, &commands, &AROUND, &mut random);
        }
        let rates = craft.motion().rates;
        assert!(rates[axis] > 0.1, "axis {axis}: {rates:?}");
        let largest = rates.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        assert!(rates[axis] >= largest, "axis {axis}: {rates:?}");
    }
}

#[test]
fn the_ground_carries_and_fades_with_height() {
    let near = ground_effect(0.08, 0.08);
    let low = ground_effect(0.08, 0.2);
    assert!(near > low && low > 1.0 && near <= 1.25);
    assert!((ground_effect(0.08, 2.0) - 1.0).abs() < 1e-3);
}

/// Whatever happens, numbers stay numbers and the craft stays in the room.
#[test]
fn a_crash_tumbles_and_does_not_explode() {
    let (mut craft, mut random) = quadrotor(1.0);
    for i in 0..20_000_u32 {
        let wild: [f64; 4] =
            std::array::from_fn(|m| f64::from(i.wrapping_mul(7919 + m as u32) % 1000) / 900.0);
        let mut around = AROUND;
        if i % 3 == 0 {
            let (sin, cos) = f64::from(i).sin_cos();
            around.push = Some(Push { normal: Vector3::new(cos, sin, 0.0), depth_m: 0.3 });
        }
        around.surface_m = if i % 4000 < 2000 { 0.0 } else { 0.75 };
        let commands = if i % 5 == 0 { [f64::NAN; 4].map(|_: f64| 2.0) } else { wild };
        craft.step(DT, &commands, &around, &mut random);
        let m = craft.motion();
        assert!(m.position.iter().chain(m.velocity.iter()).chain(m.rates.iter()).all(|v| v.is_finite()));
        assert!(m.position.z > -0.3, "{}", m.position.z);
    }
}

/// Flying forward with known speed, the decoded mean of the flow is that speed; a turning craft that stays
/// in place has exactly the rate terms.
#[test]
fn flow_is_unbiased_and_has_the_documented_signs() {
    let settings = FlowSettings::from(&vehicle().flow.expect("watchman has a flow sensor"));
    let ground = Ground { surface_m: 0.0, soft: false, moving: false, contrast: 1.0 };
    let decode = |velocity: Vector3<f64>, rates: Vector3<f64>| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut sensor = FlowSensor::exact(settings);
        let motion = Motion {
            position: Vector3::new(0.0, 0.0, 1.2),
            velocity,
            attitude: UnitQuaternion::identity(),
            rates,
            specific_force: Vector3::zeros(),
        };
        let mut bytes = Vec::new();
        let mut chunk = [0; 64];
        for step in 0..20_000_u64 {
            sensor.step(step * 1_000_000, DT, &motion, &ground, &mut random);
            let count = sensor.read(step * 1_000_000, &mut chunk);
            bytes.extend_from_slice(&chunk[..count]);
        }
        let (mut sum, mut squares, mut frames) = ([0.0; 2], 0.0, 0.0);
        for frame in bytes.windows(17).filter(|w| w.starts_with(&[b'$', b'X', b'<', 0, 0x02, 0x1F, 9, 0])) {
            assert!(frame[8] > 60, "quality {}", frame[8]);
            let value = |at: usize| {
                let count = i32::from_le_bytes([frame[at], frame[at + 1], frame[at + 2], frame[at + 3]]);
                f64::from(count) * settings.count_rad * settings.rate_hz
            };
            sum[0] += value(9);
            sum[1] += value(13);
            squares += (value(9) * 1.2).powi(2);
            frames += 1.0;
        }
        assert!((frames / 20.0 - settings.rate_hz).abs() < 0.1, "{frames}");
        let mean = [sum[0] / frames, sum[1] / frames];
        (mean, (squares / frames - (mean[0] * 1.2).powi(2)).sqrt())
    };
    // 20 s of frames with 0.06 m/s noise: the mean is known within 4 mm/s (three standard errors 8 mm/s).
    let (rate, noise) = decode(Vector3::new(0.5, -0.2, 0.0), Vector3::zeros());
    assert!((rate[0] * 1.2 - 0.5).abs() < 0.012, "{rate:?}");
    assert!((rate[1] * 1.2 + 0.2).abs() < 0.012, "{rate:?}");
    assert!((0.045..0.085).contains(&noise), "velocity noise {noise}");
    let (rate, _) = decode(Vector3::zeros(), Vector3::new(0.3, 0.2, 0.0));
    assert!((rate[0] + 0.2).abs() < 0.012 && (rate[1] - 0.3).abs() < 0.012, "{rate:?}");
}

/// Points all over the surface of the tilted cylinder lie in its cover, and one of them on each of its sides.
#[test]
fn the_tilted_airframe_just_fits_into_its_cover() {
    let (mut craft, _) = quadrotor(1.2);
    let (radius, half) = (craft.shape.radius_m, 0.5 * craft.shape.height_m);
    for degrees in [0.0, 3.0, 10.0, 25.0, 60.0, 100.0, 180.0] {
        craft.motion.attitude = UnitQuaternion::from_euler_angles(f64::to_radians(degrees), 0.0, 0.7);
        let (cover, centre) = (craft.cover(), craft.motion.position);
        let (mut low, mut high, mut wide) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for step in 0..360 {
            let (sin, cos) = f64::from(step).to_radians().sin_cos();
            for z in [-half, half] {
                let point = centre + craft.motion.attitude * Vector3::new(radius * cos, radius * sin, z);
                low = low.min(point.z);
                high = high.max(point.z);
                wide = wide.max((point.x - centre.x).hypot(point.y - centre.y));
            }
        }
        assert!((cover.bottom_m - low).abs() < 1e-4, "{degrees}: {cover:?}, lowest {low}");
        assert!(
            (cover.bottom_m + cover.height_m - high).abs() < 1e-4,
            "{degrees}: {cover:?}, highest {high}"
        );
        assert!(wide <= cover.radius_m + 1e-9, "{degrees}: {cover:?}, widest {wide}");
        assert!(cover.radius_m < radius.hypot(half) + 1e-9, "{degrees}: {cover:?}");
        assert!((craft.lowest_m() - low).abs() < 1e-4, "{degrees}");
    }
}
