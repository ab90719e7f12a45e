//! Draws what the drone's camera sees in the demo building, as PNG files, and says what a picture costs.
//!
//! `cargo run --release -p airframe --example look -- FOLDER`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example")]

use airframe::acoustics::Pose6;
use airframe::camera::{Camera, Canvas, Figure, Lens, Light, Moment};
use airframe::world::{ClutterLevel, World, WorldFile};
use floorplan::{Plan, PlanHeader, Sidecar};
use std::path::Path;
use std::time::Instant;

/// Name, place, heading and tilt in degrees, night, somebody ahead (distance and heading).
type Shot = (&'static str, [f32; 3], f32, [f32; 2], Light, Option<(f32, f32)>);

const SHOTS: [Shot; 8] = [
    ("corridor", [1.2, 7.0, 1.2], 0.0, [0.0, 0.0], Light::Day, Some((4.0, 160.0))),
    ("door", [8.85, 7.2, 1.2], -100.0, [0.0, 3.0], Light::Day, None),
    ("person", [5.0, 7.0, 1.2], 5.0, [0.0, 2.0], Light::Day, Some((2.0, 150.0))),
    ("meeting", [1.0, 9.0, 1.2], 42.0, [-6.0, 4.0], Light::Day, None),
    ("lobby", [2.4, 2.2, 1.2], 50.0, [5.0, -3.0], Light::Day, Some((3.0, 0.0))),
    ("night-corridor", [1.2, 7.0, 1.2], 0.0, [0.0, 0.0], Light::Night, Some((3.0, 160.0))),
    ("night-office", [11.4, 5.4, 1.2], -70.0, [0.0, 3.0], Light::Night, None),
    ("ground", [2.4, 2.2, 0.1], 90.0, [0.0, 0.0], Light::Day, None),
];

fn world(seed: u64) -> World {
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../deploy");
    let read = |name: &str| std::fs::read(deploy.join(name)).unwrap();
    let header = PlanHeader::parse("demo.yaml", &read("plans/demo.yaml")).unwrap();
    let plan = Plan::load("demo.yaml", &header, &read("plans/demo.png")).unwrap();
    let side = Sidecar::parse("demo.rooms.yaml", &read("plans/demo.rooms.yaml")).unwrap();
    let file = WorldFile::parse("demo.toml", &String::from_utf8(read("worlds/demo.toml")).unwrap()).unwrap();
    World::build(&plan, &side, &file, ClutterLevel::Full, seed).unwrap()
}

fn save(path: &Path, width: usize, height: usize, planes: &[Vec<u8>; 3]) {
    let image = image::RgbImage::from_fn(width as u32, height as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let luma = (f32::from(planes[0][y * width + x]) - 16.0) * 255.0 / 219.0;
        let chroma = y / 2 * (width / 2) + x / 2;
        let (b, r) = (f32::from(planes[1][chroma]) - 128.0, f32::from(planes[2][chroma]) - 128.0);
        image::Rgb(
            [luma + 1.596 * r, luma - 0.392 * b - 0.813 * r, luma + 2.017 * b]
                .map(|v| v.clamp(0.0, 255.0) as u8),
        )
    });
    image.save(path).unwrap();
}

fn main() {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    let world = world(7);
    let vehicle =
        manifest::Vehicle::parse("watchman.toml", include_str!("../../../../deploy/vehicles/watchman.toml"))
            .unwrap();
    let lens = Lens::from(&vehicle.camera.unwrap());
    let began = Instant::now();
    let mut day = Camera::new(&world, lens, Light::Day);
    println!("lamps baked in {:.0} ms", began.elapsed().as_secs_f64() * 1e3);
    let mut night = Camera::new(&world, lens, Light::Night);
    for (width, height) in [(640, 480), (1280, 720)] {
        for (name, [x, y, z], heading, [roll, pitch], light, person) in SHOTS {
            let pose = Pose6 {
                x,
                y,
                z,
                roll: roll.to_radians(),
                pitch: pitch.to_radians(),
                yaw: heading.to_radians(),
            };
            let people: Vec<Figure> = person
                .map(|(ahead, turn): (f32, f32)| Figure {
                    x: x + ahead * heading.to_radians().cos(),
                    y: y + ahead * heading.to_radians().sin() - 0.2,
                    height: 1.75,
                    heading: (heading + turn).to_radians(),
                })
                .into_iter()
                .collect();
            let shut = world.doors().iter().enumerate().filter(|(_, d)| d.shut).map(|(i, _)| 1 << i).sum();
            let moment = Moment { pose, time_s: 1.3, people: &people, doors_shut: shut, noise: 1 };
            let camera = if light == Light::Day { &mut day } else { &mut night };
            let mut planes =
                [vec![0; width * height], vec![0; width * height / 4], vec![0; width * height / 4]];
            let [luma, blue, red] = &mut planes;
            let mut canvas = Canvas { width, height, stride: width, planes: [luma, blue, red] };
            assert!(camera.draw(&moment, &mut canvas));
            let rounds = 30;
            let mut costs: Vec<f64> = (0..rounds)
                .map(|_| {
                    let began = Instant::now();
                    camera.draw(&moment, &mut canvas);
                    began.elapsed().as_secs_f64() * 1e3
                })
                .collect();
            costs.sort_by(f64::total_cmp);
            println!("{name} {width}x{height}: least {:.2} ms, median {:.2} ms", costs[0], costs[rounds / 2]);
            save(&Path::new(&folder).join(format!("{name}-{width}.png")), width, height, &planes);
        }
    }
}
