//! World, scenery and camera on the lockstep bus: wishes in, video out.
#![allow(clippy::unwrap_used, reason = "tests")]

use camera::{Camera, CameraConfig};
use ipc_types::{Format, LocalizationState, Pose, Still, Truth, Video, View, WISH_LIFE_NS, Wish};
use openh264::decoder::Decoder;
use openh264::formats::YUVSource;
use runtime::{Cache, Input, Lockstep, Output, load_manifest};
use simulator::{Config, Scenery, Simulator};
use std::path::Path;

const MS: u64 = 1_000_000;
const SMALL: Format = Format { width: 640, height: 480, fps: 30, bitrate: 1_000_000 };

struct Bench {
    bus: Lockstep,
    wishes: Output<Wish>,
    videos: Input<Video>,
    views: Input<View>,
    decoder: Decoder,
    key_requests: u32,
    poses: Option<Output<Pose>>,
}

/// What came within a while.
#[derive(Default, Debug)]
struct Seen {
    videos: Vec<(u32, bool, u64, u64)>,
    views: usize,
    decoded: usize,
    mean_luma: u64,
    /// Between the darkest and the brightest pixel of the last picture.
    spread: u8,
}

impl Bench {
    fn new(config: CameraConfig) -> Self {
        Self::of(config, &Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy"))
    }

    fn of(config: CameraConfig, deploy: &Path) -> Self {
        let (manifest, root) =
            load_manifest(&format!("{0}/system.toml:{0}/sim.toml", deploy.display())).unwrap();
        let mut bus = Lockstep::new(manifest, &root, 3, Cache::default());
        let mut ports = bus.tool("cli");
        let (wishes, videos, views) =
            (ports.output().unwrap(), ports.input().unwrap(), ports.input().unwrap());
        bus.add_with::<Simulator>(Config::default()).unwrap();
        bus.add_with::<Scenery>(Config::default()).unwrap();
        bus.add_with::<Camera>(config).unwrap();
        Self { bus, wishes, videos, views, decoder: Decoder::new().unwrap(), key_requests: 0, poses: None }
    }

    /// Runs on; with a format, somebody wishes for it all the time.
    fn run(&mut self, for_ms: u64, format: Option<Format>) -> Seen {
        let mut seen = Seen::default();
        for _ in 0..for_ms / 20 {
            if let Some(format) = format {
                let expiry_ns = self.bus.now() + 200 * MS;
                let wish = Wish { format, expiry_ns, key_requests: self.key_requests, ..Wish::default() };
                assert!(self.wishes.publish(&wish));
            }
            if let Some(poses) = &mut self.poses {
                let pose = Pose {
                    estimated_ns: self.bus.now(),
                    x_m: 2.4,
                    y_m: 2.2,
                    heading_rad: core::f32::consts::FRAC_PI_2,
                    variance_x_m2: 1e-3,
                    variance_y_m2: 1e-3,
                    heading_sigma_rad: 0.01,
                    state: u32::from(LocalizationState::Tracking.code()),
                    ..Pose::default()
                };
                assert!(poses.publish(&pose));
            }
            self.bus.run_until(self.bus.now() + 20 * MS);
            while let Some(video) = self.videos.receive() {
                seen.videos.push((
                    video.format.width,
                    video.key == 1,
                    video.capture_ns,
                    video.header.stamp_ns,
                ));
                if let Some(picture) = self.decoder.decode(video.access_unit()).unwrap() {
                    seen.decoded += 1;
                    let luma = picture.y();
                    let (least, most) = luma.iter().fold((255, 0), |(a, b), v| (a.min(*v), b.max(*v)));
                    seen.spread = most - least;
                    seen.mean_luma = luma.iter().map(|v| u64::from(*v)).sum::<u64>() / luma.len() as u64;
                }
            }
            while self.views.receive().is_some() {
                seen.views += 1;
            }
        }
        seen
    }
}

#[test]
fn nobody_wishes_nothing_is_rendered_and_a_wish_wakes_all() {
    let mut bench = Bench::new(CameraConfig::default());
    let asleep = bench.run(1000, None);
    assert_eq!((asleep.videos.len(), asleep.views), (0, 0));
    assert!(bench.bus.status("camera").starts_with("asleep"), "{}", bench.bus.status("camera"));
    let awake = bench.run(2000, Some(SMALL));
    assert!((54..=61).contains(&awake.videos.len()), "{} frames in 2 s at 30", awake.videos.len());
    assert_eq!(awake.decoded, awake.videos.len());
    assert!(awake.videos[0].1 && awake.videos.iter().filter(|video| video.1).count() == 1);
    assert!((40..220).contains(&awake.mean_luma), "a picture, not a black one: {}", awake.mean_luma);
    for (_, _, capture, sent) in &awake.videos {
        assert!(capture < sent && sent - capture < 30 * MS, "captured at {capture}, sent at {sent}");
    }
    // The wish expires: what was under way comes, and nothing after it.
    let _ = bench.run(240, None);
    let asleep = bench.run(2000, None);
    assert_eq!((asleep.videos.len(), asleep.views), (0, 0));
    assert_eq!(
        bench.bus.refused("camera") + bench.bus.refused("scenery") + bench.bus.refused("simulator"),
        0
    );
}

#[test]
fn key_frames_size_and_pace_change_in_flight() {
    let mut bench = Bench::new(CameraConfig::default());
    bench.run(500, Some(SMALL));
    bench.key_requests += 1;
    let asked = bench.run(500, Some(SMALL));
    assert_eq!(asked.videos.iter().filter(|video| video.1).count(), 1);
    // Ten requests at once are one key frame, and those of a second are limited by the pause of 300 ms.
    let mut keys = 0;
    for _ in 0..50 {
        bench.key_requests += 1;
        keys += bench.run(20, Some(SMALL)).videos.iter().filter(|video| video.1).count();
    }
    assert!((3..=5).contains(&keys), "{keys} key frames in a second");
    let large = bench.run(1000, Some(Format { width: 1280, height: 720, fps: 15, bitrate: 2_000_000 }));
    let first = large.videos.iter().position(|video| video.0 == 1280).unwrap();
    assert!(large.videos[first].1, "a new size begins with a key frame");
    assert!(
        first <= 2 && (13..=17).contains(&(large.videos.len() - first)),
        "{first}, {}",
        large.videos.len()
    );
    assert_eq!(large.decoded, large.videos.len());
}

#[test]
fn a_killed_camera_comes_back_with_a_key_frame() {
    let mut bench = Bench::new(CameraConfig::default());
    bench.run(500, Some(SMALL));
    bench.bus.kill("camera");
    assert!(bench.run(300, Some(SMALL)).videos.len() <= 2);
    bench.bus.add_with::<Camera>(CameraConfig::default()).unwrap();
    bench.decoder = Decoder::new().unwrap();
    let back = bench.run(300, Some(SMALL));
    assert!(back.videos.len() >= 6 && back.videos[0].1, "{:?}", back.videos);
    assert_eq!(back.decoded, back.videos.len());
}

#[test]
fn a_test_pattern_needs_no_simulator() {
    let mut bench = Bench::new(CameraConfig { source: "test-pattern".into(), ..CameraConfig::default() });
    let seen = bench.run(1000, Some(SMALL));
    assert!(
        (27..=31).contains(&seen.videos.len()) && seen.views == 0,
        "{} {}",
        seen.videos.len(),
        seen.views
    );
}

/// The same flight, whether it is filmed or not: the truth is equal, bit for bit.
#[test]
fn filming_changes_nothing() {
    let truths = |filmed: bool| {
        let mut bench = Bench::new(CameraConfig::default());
        let mut truths: Input<Truth> = bench.bus.tool("cli").input().unwrap();
        let mut all = Vec::new();
        for _ in 0..20 {
            bench.run(100, filmed.then_some(SMALL));
            while let Some(truth) = truths.receive() {
                // The header's stamp is that of the step, and a shutter wakes the simulator between its ticks.
                all.push(format!("{:?}", Truth { header: ipc_types::Header::default(), ..*truth }));
            }
        }
        all
    };
    let (alone, filmed) = (truths(false), truths(true));
    assert!(alone.len() > 90);
    let equal = alone.iter().zip(&filmed).filter(|(a, b)| a == b).count();
    assert!(equal * 10 >= alone.len() * 9, "{equal} of {}", alone.len());
    assert_eq!(alone.last(), filmed.last());
}

#[test]
fn a_wish_for_ever_or_for_an_odd_size_is_not_obeyed() {
    let mut bench = Bench::new(CameraConfig::default());
    let now = bench.bus.now();
    let forever = Wish { format: SMALL, expiry_ns: now + 10 * WISH_LIFE_NS, ..Wish::default() };
    bench.wishes.publish(&forever);
    assert_eq!(bench.run(300, None).videos.len(), 0);
    let odd =
        Wish { format: Format { width: 641, ..SMALL }, expiry_ns: bench.bus.now() + 500 * MS, ..forever };
    bench.wishes.publish(&odd);
    assert_eq!(bench.run(300, None).videos.len(), 0);
    assert_eq!(bench.bus.refused("camera"), 1);
}

/// Stills alone: one frame a second is drawn and no video encoded; beside video they come out of its frames.
#[test]
fn stills_come_once_a_second_with_and_without_video() {
    let mut bench = Bench::new(CameraConfig::default());
    let mut stills: Input<Still> = bench.bus.tool("cli").input().unwrap();
    let mut film = |bench: &mut Bench, format: Format, still: u32, seconds: u64| {
        let (mut taken, mut seen) = (Vec::new(), Seen::default());
        for _ in 0..seconds * 5 {
            let expiry_ns = bench.bus.now() + 400 * MS;
            assert!(bench.wishes.publish(&Wish { format, still, expiry_ns, ..Wish::default() }));
            let more = bench.run(200, None);
            seen.videos.extend(more.videos);
            seen.views += more.views;
            while let Some(still) = stills.receive() {
                let picture = image::load_from_memory_with_format(still.jpeg(), image::ImageFormat::Jpeg);
                let picture = picture.unwrap().to_luma8();
                assert_eq!(picture.dimensions(), (still.width, still.height));
                let mean = picture.pixels().map(|pixel| u64::from(pixel.0[0])).sum::<u64>()
                    / u64::from(still.width * still.height);
                assert!((20..240).contains(&mean), "a picture, not a black one: {mean}");
                taken.push((still.width, still.capture_ns));
            }
        }
        (taken, seen)
    };
    let (taken, seen) = film(&mut bench, Format::default(), 1, 6);
    assert!((5..=7).contains(&taken.len()), "{taken:?}");
    assert!(seen.videos.is_empty() && seen.views <= taken.len() + 1, "{} views", seen.views);
    assert!(taken.iter().all(|still| still.0 == 640) && taken.is_sorted_by(|a, b| a.1 < b.1), "{taken:?}");
    assert!(bench.bus.status("camera").starts_with("a still a second"), "{}", bench.bus.status("camera"));
    let hd = Format { width: 1280, height: 720, fps: 15, bitrate: 2_000_000 };
    let (taken, seen) = film(&mut bench, hd, 1, 4);
    assert!((3..=5).contains(&taken.len()) && seen.videos.len() >= 50, "{taken:?}, {}", seen.videos.len());
    assert_eq!(taken.last().unwrap().0, 640, "smaller than the video");
    let (taken, _) = film(&mut bench, hd, 0, 2);
    assert!(taken.is_empty(), "nobody asks for stills: {taken:?}");
    assert_eq!(bench.bus.refused("camera"), 0);
}

#[test]
fn what_no_camera_may_show_is_grey_and_all_of_it_while_the_place_is_not_known() {
    let directory = tempfile::tempdir().unwrap();
    let deploy = directory.path();
    for folder in ["config", "plans", "vehicles", "worlds"] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy").join(folder);
        std::fs::create_dir(deploy.join(folder)).unwrap();
        for entry in std::fs::read_dir(from).unwrap().flatten() {
            std::fs::copy(entry.path(), deploy.join(folder).join(entry.file_name())).unwrap();
        }
    }
    for file in ["system.toml", "sim.toml"] {
        std::fs::copy(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy").join(file),
            deploy.join(file),
        )
        .unwrap();
    }
    // The drone stands at (2.4, 2.2) and looks along y: the zone is all of the lobby before it, then a corner behind.
    let flat = |seen: &Seen| seen.spread;
    let film = |zone: &str, localized: bool| {
        let side = deploy.join("plans/demo.rooms.yaml");
        let text = std::fs::read_to_string(&side).unwrap();
        let shipped = text.split("privacy:").next().unwrap();
        std::fs::write(&side, format!("{shipped}privacy:\n  - {{name: Private, rectangle: {zone}}}\n"))
            .unwrap();
        let mut bench = Bench::of(CameraConfig::default(), deploy);
        // What localization says of a drone that waits on its pad.
        bench.poses = localized.then(|| bench.bus.tool("localization").output().unwrap());
        bench.run(1000, None);
        flat(&bench.run(1000, Some(SMALL)))
    };
    assert!(film("[0.2, 0.2, 1.0, 0.8]", true) > 60, "a zone behind the drone covers nothing");
    assert!(film("[0.2, 0.2, 1.0, 0.8]", false) < 8, "nobody knows the place: all is covered");
    assert!(film("[0.2, 2.5, 5.9, 5.9]", true) < 8, "before the drone: all is covered");
}
