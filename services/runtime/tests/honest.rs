//! A service that does not open what the manifest lists for it does not start.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc_types::{Pose, Setpoint};
use manifest::Manifest;
use runtime::{Cache, ConfigError, Input, Lockstep, Output, Ports, Service, Start, StartError, Validate};

#[derive(Default, serde::Deserialize)]
struct Nothing {}
impl Validate for Nothing {
    fn validate(&self) -> Result<(), ConfigError> {
        Ok(())
    }
}

/// Reads poses and publishes setpoints.
struct Follower {
    poses: Input<Pose>,
    setpoints: Output<Setpoint>,
}
impl Service for Follower {
    const NAME: &'static str = "follower";
    type Config = Nothing;
    fn start(_: Nothing, ports: &mut Ports, _: &Start) -> Result<Self, StartError> {
        Ok(Self { poses: ports.input()?, setpoints: ports.output()? })
    }
    fn step(&mut self, _: u64) {
        if self.poses.latest().is_some() {
            self.setpoints.publish(&Setpoint::default());
        }
    }
}

fn started(lines: &str) -> Result<(), StartError> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("v.toml"), include_str!("../../../deploy/vehicles/watchman.toml"))
        .unwrap();
    let text = format!(
        "[system]\nname = \"t\"\nplan = \"p.yaml\"\nvehicle = \"v.toml\"\n[service.follower]\nrun = \"f\"\ntick_hz = 10\n\
         subscribes.'localization/pose' = {{ depth = 2 }}\npublishes.'navigation/setpoint' = {{ hz = 20 }}\n{lines}"
    );
    let manifest = Manifest::parse("t.toml", &text).unwrap();
    Lockstep::new(manifest, directory.path(), 1, Cache::default()).add::<Follower>()
}

#[test]
fn what_is_listed_and_not_opened_is_refused_by_name() {
    started("").unwrap();
    let unread = started("subscribes.'sonar/ranges' = { depth = 2 }").unwrap_err().to_string();
    assert_eq!(
        unread,
        "t.toml: service.follower.subscribes.\"sonar/ranges\": the service does not open it; the manifest must not list it"
    );
    let unpublished = started("publishes.'navigation/polar' = { hz = 20 }").unwrap_err().to_string();
    assert!(unpublished.contains("service.follower.publishes.\"navigation/polar\""), "{unpublished}");
}
