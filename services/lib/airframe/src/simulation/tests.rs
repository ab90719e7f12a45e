use super::*;
use crate::controller::BYTE_NS;
use crate::world::AsBuilt;
use crate::world::ClutterLevel;
use std::f32::consts::FRAC_PI_2;

/// 8 m by 6 m, empty; 20 cm a cell.
const ROOM: [&str; 30] = [
    "########################################",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "#                                      #",
    "########################################",
];

fn flight(seed: u64, clutter: ClutterLevel) -> Simulation {
    let plan = Plan::from_ascii(&ROOM, 0.2);
    let file = WorldFile::parse(
        "room.toml",
        "name = \"room\"\npad = { x_m = 4.0, y_m = 3.0, heading_deg = 90.0 }\n",
    )
    .unwrap();
    let side = Sidecar::default();
    let world = World::build_as(&plan, &side, &file, clutter, seed, AsBuilt::exact()).unwrap();
    let options = Options { clutter, seed, ..Options::default() };
    Simulation::in_world(world, &crate::testing::watchman(), &options)
}

fn raw_rc(channels: [u16; 6]) -> Vec<u8> {
    let mut frame = vec![b'$', b'M', b'<', 12, 200];
    channels.iter().for_each(|c| frame.extend(c.to_le_bytes()));
    frame.push(frame[3..].iter().fold(0, |a, b| a ^ b));
    frame
}

/// Arms, climbs on a height loop over the truth, then holds the given pitch and roll sticks.
fn fly(flight: &mut Simulation, seconds: f64, mut sticks: impl FnMut(&TruthState) -> [f64; 3]) {
    let mut integral = 1500.0;
    let end = flight.now_ns() + (seconds * 1e9) as u64;
    let mut reply = [0; 512];
    while flight.now_ns() < end {
        let truth = flight.truth();
        let [roll, pitch, height] = sticks(&truth);
        let grounded = truth.time_s < 6.0;
        let climb = (0.8 * (height - f64::from(truth.z_m))).clamp(-0.4, 0.4);
        let error = climb - f64::from(truth.velocity_m_s[2]);
        if !grounded {
            integral += error * 3.0;
        }
        let throttle = if grounded { 1000.0 } else { (integral + 150.0 * error).clamp(1000.0, 1900.0) };
        let arm = if truth.time_s < 5.4 { 1000.0 } else { 2000.0 };
        let frame = raw_rc([roll, pitch, throttle, 1500.0, arm, 2000.0].map(|c: f64| c.round() as u16));
        flight.controller_write(&frame);
        let next = flight.now_ns() + 20_000_000;
        flight.advance_to(next);
        flight.controller_read(&mut reply);
    }
}

/// Sticks that hold place against drift, by truth.
fn hold(x: f64, y: f64) -> impl FnMut(&TruthState) -> [f64; 3] {
    move |truth| {
        let v = truth.velocity_m_s.map(f64::from);
        let ax = 0.5 * (x - f64::from(truth.x_m)) - 0.9 * v[0];
        let ay = 0.5 * (y - f64::from(truth.y_m)) - 0.9 * v[1];
        let (sin, cos) = f64::from(truth.yaw_rad).sin_cos();
        let (forward, left) = (cos * ax + sin * ay, cos * ay - sin * ax);
        let stick = |a: f64| 1500.0 + (220.0 * a).clamp(-150.0, 150.0);
        [stick(-left), stick(forward), 1.2]
    }
}

#[test]
fn the_same_seed_flies_the_same_flight_and_another_one_does_not() {
    let run = |seed: u64| {
        let mut sim = flight(seed, ClutterLevel::Full);
        let mut text = String::new();
        for i in 0..8 {
            fly(&mut sim, 1.0, hold(4.0, 3.0));
            sim.ping(1 << i, i);
            let mut flow = [0; 4096];
            let count = sim.flow_read(&mut flow);
            text += &format!("{:?} {:?}\n", sim.truth(), &flow[..count]);
            text += &format!("{:?}\n", sim.take_echo().map(|a| a.readings().collect::<Vec<_>>()));
        }
        text
    };
    let first = run(7);
    assert_eq!(first, run(7));
    assert_ne!(first, run(8));
}

#[test]
fn it_takes_off_hovers_and_nothing_is_touched() {
    for seed in 0..3 {
        let mut sim = flight(seed, ClutterLevel::None);
        fly(&mut sim, 20.0, hold(4.0, 3.0));
        let truth = sim.truth();
        assert!((truth.z_m - 1.2).abs() < 0.2, "seed {seed}: {truth:?}");
        assert!((truth.x_m - 4.0).hypot(truth.y_m - 3.0) < 1.0, "seed {seed}: {truth:?}");
        assert_eq!(truth.contacts, 0, "seed {seed}: {truth:?}");
        assert!(truth.armed && !truth.on_ground);
        // The walls are 2.5 m away and more: the clearance is at its cap most of the time.
        assert!(truth.min_clearance_m > 0.8, "{truth:?}");
    }
}

#[test]
fn a_wall_is_a_contact_and_pushes_back() {
    let mut sim = flight(1, ClutterLevel::None);
    fly(&mut sim, 14.0, hold(4.0, 3.0));
    // Straight to the wall above the pad, which the drone faces.
    fly(&mut sim, 12.0, |_| [1500.0, 1580.0, 1.2]);
    let truth = sim.truth();
    assert!(truth.contacts >= 1, "{truth:?}");
    assert!(truth.min_clearance_m < 0.0 && truth.min_clearance_m > -0.25, "{truth:?}");
    assert!((0.0..8.0).contains(&truth.x_m) && (0.0..6.0).contains(&truth.y_m), "{truth:?}");
}

#[test]
fn a_fall_is_one_contact_and_a_gentle_landing_none() {
    let mut sim = flight(2, ClutterLevel::None);
    fly(&mut sim, 14.0, hold(4.0, 3.0));
    let mut gentle = sim.clone();
    let mut to_ground = hold(4.0, 3.0);
    fly(&mut gentle, 8.0, move |truth| {
        let [roll, pitch, _] = to_ground(truth);
        [roll, pitch, f64::from(truth.z_m) - 0.3]
    });
    assert!(gentle.truth().on_ground, "{:?}", gentle.truth());
    assert_eq!(gentle.truth().contacts, 0, "{:?}", gentle.truth());
    // Frames stop: it falls from 1.2 m.
    let end = sim.now_ns() + 4_000_000_000;
    sim.advance_to(end);
    assert!(sim.truth().on_ground && !sim.truth().armed);
    assert!((1..=3).contains(&sim.truth().contacts), "{:?}", sim.truth());
}

#[test]
fn echoes_come_after_their_time_of_flight() {
    let mut sim = flight(3, ClutterLevel::None);
    fly(&mut sim, 14.0, hold(4.0, 3.0));
    // The down sonar is the ninth.
    sim.ping(1 << 8, 77);
    assert!(sim.take_echo().is_none(), "sound takes its time");
    let now = sim.now_ns();
    sim.advance_to(now + 3_000_000);
    assert!(sim.take_echo().is_none());
    sim.advance_to(now + 60_000_000);
    let answer = sim.take_echo().expect("an answer within a ping cycle");
    assert_eq!((answer.ping, answer.ping_ns), (77, now));
    let (echo, answered) = answer.readings().next().unwrap();
    assert!(answered && echo.sensor == 8);
    let range = echo.pulse_s * 343.0 / 2.0;
    // 5 cm under the centre of mass, which is 8 cm above the feet.
    assert!(range.is_nan() || (range - (sim.truth().z_m + 0.03)).abs() < 0.12, "{range} {:?}", sim.truth());
}

#[test]
fn dead_sonars_do_not_answer() {
    let plan = Plan::from_ascii(&ROOM, 0.2);
    let file = WorldFile::parse("room.toml", "pad = { x_m = 4.0, y_m = 3.0 }").unwrap();
    let options = Options { dead_sonars: 1, clutter: ClutterLevel::None, ..Options::default() };
    let vehicle = crate::testing::watchman();
    let mut sim = Simulation::new(&plan, &Sidecar::default(), &file, &vehicle, &options).unwrap();
    sim.ping(0b10001, 1);
    sim.advance_to(60_000_000);
    let answered: Vec<_> = sim.take_echo().unwrap().readings().map(|(e, a)| (e.sensor, a)).collect();
    assert_eq!(answered, [(0, false), (4, true)]);
}

/// Integrated flow over a flight forward is the way flown, wherever the sensor says that it sees well.
#[test]
fn flow_adds_up_to_the_way_flown() {
    let vehicle = crate::testing::watchman();
    let settings = vehicle.flow.unwrap();
    // The sensor's drawn scale error is up to 2 %, its mounting error up to 1.5 degrees, and 100 frames of
    // 2.4 mm noise add up to 2.4 cm: over about 1.5 m the sums agree within 12 cm.
    for seed in 0..6 {
        let mut sim = flight(seed, ClutterLevel::None);
        fly(&mut sim, 14.0, hold(4.0, 2.0));
        let mut bytes = [0; 8192];
        sim.flow_read(&mut bytes);
        let (mut way, mut flown) = (0.0, 0.0);
        for _ in 0..100 {
            let before = sim.truth();
            // One frame a period of 40 ms, and it is whole before the next begins.
            fly(&mut sim, 0.04, hold(4.0, 4.0));
            let truth = sim.truth();
            let count = sim.flow_read(&mut bytes);
            let mut frames = bytes[..count].windows(17).filter(|w| w.starts_with(b"$X<\x00\x02\x1f\x09\x00"));
            let Some(frame) = frames.next().filter(|frame| frame[8] >= 60) else { continue };
            let forward = i32::from_le_bytes([frame[9], frame[10], frame[11], frame[12]]);
            way += f64::from(forward as f32 * settings.count_rad * (truth.z_m + 0.08));
            // The nose that goes down looks like flying backwards.
            let (sin, cos) = f64::from(truth.yaw_rad).sin_cos();
            let (dx, dy) = (f64::from(truth.x_m - before.x_m), f64::from(truth.y_m - before.y_m));
            flown += cos * dx + sin * dy - f64::from(truth.pitch_rad - before.pitch_rad) * 1.28;
        }
        assert!(flown > 0.5, "seed {seed}: {flown}");
        assert!((way - flown).abs() < 0.12, "seed {seed}: flow {way}, flown {flown}");
    }
}

#[test]
fn a_start_in_a_room_is_clear_and_not_on_the_pad() {
    let plan = Plan::from_ascii(&ROOM, 0.2);
    let file = WorldFile::parse("room.toml", "pad = { x_m = 4.0, y_m = 3.0 }").unwrap();
    let vehicle = crate::testing::watchman();
    let mut headings = Vec::new();
    for seed in 0..5 {
        let options =
            Options { seed, start: StartPlace::Room, clutter: ClutterLevel::None, ..Options::default() };
        let mut sim = Simulation::new(&plan, &Sidecar::default(), &file, &vehicle, &options).unwrap();
        sim.advance_to(100_000_000);
        let truth = sim.truth();
        assert!(truth.clearance_m > 0.2, "{truth:?}");
        headings.push(truth.yaw_rad);
    }
    assert!(headings.iter().any(|h| (h - FRAC_PI_2).abs() > 0.2), "{headings:?}");
}

#[test]
fn a_silent_flight_controller_line_stays_silent() {
    let mut sim = flight(0, ClutterLevel::None);
    sim.advance_to(100 * BYTE_NS);
    assert_eq!(sim.controller_read(&mut [0; 64]), 0);
}

/// Two centimetres over the level airframe hangs a shelf. Leaning nine degrees away from it (ten would be a
/// contact with the floor it starts from) the rim on its side rises by three and a half centimetres and hits it.
#[test]
fn the_raised_rim_of_a_tilted_airframe_touches() {
    let plan = Plan::from_ascii(&ROOM, 0.2);
    let vehicle = crate::testing::watchman();
    let (radius, height) = (f64::from(vehicle.body.radius_m), f64::from(vehicle.body.height_m));
    let bottom = 1.2 + 0.5 * height + 0.02;
    let file = WorldFile::parse(
        "room.toml",
        &format!(
            "pad = {{ x_m = 4.0, y_m = 3.0 }}\n[[solid]]\nname = \"shelf\"\nshape = \"box\"\nx_m = 4.0\n\
             y_m = {}\nlength_m = 1.0\nwidth_m = 1.0\nbottom_m = {bottom}\ntop_m = 2.0\n",
            3.5 + 0.8 * radius
        ),
    )
    .unwrap();
    let side = Sidecar::default();
    let world = World::build_as(&plan, &side, &file, ClutterLevel::None, 1, AsBuilt::exact()).unwrap();
    let mut sim = Simulation::in_world(world, &vehicle, &Options::default());
    sim.craft.motion_mut().position = Vector3::new(4.0, 3.0, 1.2);
    let touched = |sim: &Simulation| {
        let mut touch = Touch::new();
        touch.look(&sim.world, &sim.craft, 0.0, 0);
        (touch.contacts(), touch.clearance_m())
    };
    let (contacts, clearance) = touched(&sim);
    assert!(contacts == 0 && (clearance - 0.02).abs() < 2e-3, "level: {contacts}, {clearance} m");
    for lean in [9.0_f64, -9.0] {
        sim.craft.motion_mut().attitude =
            nalgebra::UnitQuaternion::from_euler_angles(lean.to_radians(), 0.0, 0.0);
        let (contacts, clearance) = touched(&sim);
        assert!(contacts == 1 && clearance < 0.0, "{lean}: {contacts}, {clearance} m");
    }
}
