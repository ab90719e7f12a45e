//! The service on the lockstep bus, with a world of a few lines on the other end of `sim/ping`.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc_types::{Echo, EchoReading, Ping, SonarHealth, SonarRanges, SonarStatus};
use runtime::{Cache, Input, Lockstep, Output};
use std::path::Path;

const MANIFEST: &str = r#"
[system]
name = "test"
plan = "none.yaml"
vehicle = "vehicle.toml"
simulated = true
[service.sonar]
run = "sereno-sonar"
criticality = "flight"
tick_hz = 200
publishes.'sonar/ranges' = { hz = 16.7 }
publishes.'sim/ping' = { hz = 16.7 }
subscribes.'sim/echo' = { depth = 8, wake = true }
[service.world]
run = "world"
criticality = "flight"
tick_hz = 200
publishes.'sim/echo' = { hz = 16.7 }
subscribes.'sim/ping' = { depth = 8, wake = true }
subscribes.'sonar/ranges' = { depth = 16 }
"#;

const VEHICLE: &str = include_str!("../../../deploy/vehicles/watchman.toml");

struct Bench {
    system: Lockstep,
    pings: Input<Ping>,
    echoes: Output<Echo>,
    ranges: Input<SonarRanges>,
    _directory: tempfile::TempDir,
}

impl Bench {
    fn new(vehicle: &str) -> Result<Self, runtime::StartError> {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("vehicle.toml"), vehicle).unwrap();
        let manifest = manifest::Manifest::parse("test.toml", MANIFEST).unwrap();
        let mut system = Lockstep::new(manifest, Path::new(directory.path()), 3, Cache::default());
        let mut world = system.tool("world");
        let bench = (world.input().unwrap(), world.output().unwrap(), world.input().unwrap());
        system.add::<sonar::Sonar>()?;
        let (pings, echoes, ranges) = bench;
        Ok(Self { system, pings, echoes, ranges, _directory: directory })
    }

    /// Runs for `ms`, answering every ping by `answer(sensor)`; collects pings (time, sensors) and ranges.
    fn run(
        &mut self,
        ms: u64,
        answer: impl Fn(u8, &mut Echo) -> bool,
    ) -> (Vec<(u64, u32)>, Vec<SonarRanges>) {
        let (mut pings, mut ranges) = (Vec::new(), Vec::new());
        for _ in 0..ms {
            self.system.run_until(self.system.now() + 1_000_000);
            while let Some(ping) = self.pings.receive() {
                pings.push((ping.header.stamp_ns, ping.sensors));
                let mut echo = Echo { ping_ns: self.system.now(), ping: ping.ping, ..Echo::default() };
                let sensors = (0..16u8).filter(|s| ping.sensors >> s & 1 == 1);
                let answered = sensors.filter(|s| answer(*s, &mut echo)).count();
                if answered == ping.sensors.count_ones() as usize {
                    self.echoes.publish(&echo);
                }
            }
            while let Some(r) = self.ranges.receive() {
                ranges.push(*r);
            }
        }
        (pings, ranges)
    }
}

fn pulse(sensor: u8, pulse_s: f32, echo: &mut Echo) -> bool {
    echo.readings[echo.count as usize] = EchoReading { pulse_s, sensor, answered: 1, reserved: 0 };
    echo.count += 1;
    true
}

#[test]
fn groups_follow_each_other_and_every_sensor_has_its_turn() {
    let mut bench = Bench::new(VEHICLE).unwrap();
    let (pings, ranges) = bench.run(1_300, |s, echo| pulse(s, 0.005 + 0.001 * f32::from(s), echo));
    assert!(pings.len() > 19, "{} pings in 1.3 s", pings.len());
    assert!(
        pings.windows(2).all(|w| w[1].0 - w[0].0 >= 58_500_000),
        "the datasheet's 60 ms, less the tick's jitter"
    );
    let masks: Vec<u32> = pings.iter().take(5).map(|p| p.1).collect();
    assert_eq!(masks, [0b1_0010_1001, 0b1_0101_0010, 0b1_1000_0100, 0b1_0010_1001, 0b1_0101_0010]);
    let last = ranges.last().unwrap();
    let group = [4, 4, 3][last.group as usize];
    assert_eq!((last.count, last.sensors), (group, 9));
    assert!((last.sweep_s - 0.18).abs() < 1e-6);
    for reading in last.filled() {
        let expected = 343.0 * 0.5 * (0.005 + 0.001 * f32::from(reading.sensor));
        assert!((reading.range().unwrap() - expected).abs() < 1e-3);
    }
    assert!(last.filled()[last.count as usize - 1].looks_down());
}

#[test]
fn an_answer_that_is_lost_is_a_fault_and_the_schedule_goes_on() {
    let mut bench = Bench::new(VEHICLE).unwrap();
    bench.run(300, |s, echo| pulse(s, 0.01, echo));
    let (pings, ranges) = bench.run(1_000, |_, _| false);
    assert!(pings.len() >= 15);
    let last = ranges.last().unwrap();
    assert!(last.filled().iter().all(|r| r.status == SonarStatus::Fault.code() && r.range_m.is_nan()));
    assert!(last.filled().iter().all(|r| r.health == SonarHealth::Silent.code()));
    assert!(bench.system.status("sonar").contains("front silent"), "{}", bench.system.status("sonar"));
}

#[test]
fn one_dead_sensor_does_not_spoil_its_group() {
    let mut bench = Bench::new(VEHICLE).unwrap();
    let (_, ranges) = bench.run(1_500, |s, echo| {
        pulse(s, 0.01, echo);
        if s == 3 {
            echo.readings[echo.count as usize - 1].answered = 0;
        }
        true
    });
    let group = ranges.iter().rev().find(|r| r.group == 0).unwrap();
    let statuses: Vec<(u8, u8)> = group.filled().iter().map(|r| (r.sensor, r.status)).collect();
    assert_eq!(statuses, [(0, 1), (3, 3), (5, 1), (8, 1)]);
    assert_eq!(bench.system.status("sonar"), "rear-left silent");
}

#[test]
fn echoes_that_make_no_sense_are_refused_and_counted() {
    let mut bench = Bench::new(VEHICLE).unwrap();
    let (_, ranges) = bench.run(600, |s, echo| {
        pulse(s, 0.01, echo);
        // The down sonar is the last of every group.
        if s == 8 {
            echo.count = 99;
        }
        true
    });
    assert!(ranges.iter().all(|r| r.filled().iter().all(|r| r.status == SonarStatus::Fault.code())));
    assert!(bench.system.refused("sonar") > 5);
    let (_, ranges) = bench.run(600, |s, echo| pulse(s | 1, 0.01, echo));
    assert!(ranges.iter().skip(2).all(|r| r.filled().iter().all(|r| r.status == SonarStatus::Fault.code())));
}

#[test]
fn a_vehicle_that_would_hear_itself_is_refused() {
    let vehicle = VEHICLE.replacen("group = 1", "group = 0", 1);
    let error = Bench::new(&vehicle).err().unwrap().to_string();
    assert!(error.contains("front") && error.contains("35 degrees"), "{error}");
}

#[test]
fn the_shipped_configuration_is_the_default() {
    let text = include_str!("../../../deploy/config/sonar.toml");
    let config: sonar::SonarConfig = runtime::parse_config("sonar.toml", text).unwrap();
    assert_eq!(config, sonar::SonarConfig::default());
    let error = runtime::parse_config::<sonar::SonarConfig>("sonar.toml", "slot_ms = 30").unwrap_err();
    assert_eq!(error.to_string(), "sonar.toml: slot_ms = 30 is out of range: allowed is 60..=200");
}
