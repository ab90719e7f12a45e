//! The service on the lockstep bus, alone.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc_types::Truth;
use runtime::{Cache, Lockstep, Start, load_manifest};
use simulator::{Config, Simulator};
use std::path::Path;

fn deploy() -> String {
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    format!("{0}/system.toml:{0}/sim.toml", deploy.display())
}

fn truths(seed: u64, seconds: u64) -> Vec<Truth> {
    truths_of(Config::default(), seed, seconds)
}

fn truths_of(config: Config, seed: u64, seconds: u64) -> Vec<Truth> {
    let (manifest, root) = load_manifest(&deploy()).unwrap();
    let mut bus = Lockstep::new(manifest, &root, seed, Cache::default());
    let mut ports = bus.tool("cli");
    let mut truth = ports.input::<Truth>().unwrap();
    bus.add_with::<Simulator>(config).unwrap();
    let mut all = Vec::new();
    let begin = bus.now();
    // More often than an input's depth of samples.
    for tenth in 1..=10 * seconds {
        bus.run_until(begin + tenth * 100_000_000);
        while let Some(sample) = truth.receive() {
            all.push(*sample);
        }
    }
    assert_eq!(bus.refused("simulator"), 0);
    assert!(bus.status("simulator").contains("0 contacts"), "{}", bus.status("simulator"));
    all
}

#[test]
fn the_truth_comes_at_50_hz_and_the_drone_waits_on_the_pad() {
    let all = truths(3, 2);
    assert!((99..=101).contains(&all.len()), "{}", all.len());
    let last = all.last().unwrap();
    assert_eq!((last.armed, last.on_ground, last.contacts), (0, 1, 0));
    assert!(last.z_m.abs() < 0.05 && last.volts > 15.0 && last.charge > 0.99, "{last:?}");

    // A scorer builds the same world and finds the drone on its pad.
    let (manifest, root) = load_manifest(&deploy()).unwrap();
    let seed = Start::service_seed(3, "simulator");
    let start = Start::new(manifest.system.clone(), &root, seed, 0, true, Cache::default()).unwrap();
    let pad = simulator::build_world(&Config::default(), &start).unwrap().pad();
    assert!((last.x_m - pad.x).hypot(last.y_m - pad.y) < 0.05, "{last:?} {pad:?}");
}

/// The safety pilot reads `flight/state`, which the manifest must allow, and does nothing while nobody asks him.
#[test]
fn a_radio_beside_it_changes_nothing_on_the_ground() {
    let beside = Config { receiver: "radio".to_owned(), ..Config::default() };
    let (alone, beside) = (truths(3, 2), truths_of(beside, 3, 2));
    assert_eq!(format!("{alone:?}"), format!("{beside:?}"));
}

#[test]
fn equal_seeds_give_equal_bytes() {
    let bytes = |seed| {
        let all = truths(seed, 1);
        all.iter().map(|truth| format!("{truth:?}")).collect::<Vec<_>>()
    };
    assert_eq!(bytes(5), bytes(5));
    assert_ne!(bytes(5), bytes(6));
}

#[test]
fn what_is_placed_for_one_plan_stands_on_no_other() {
    let (manifest, root) = load_manifest(&deploy()).unwrap();
    let start = |plan: &str| {
        let system = manifest::System { plan: plan.to_owned(), ..manifest.system.clone() };
        Start::new(system, &root, 1, 0, true, Cache::default()).unwrap()
    };
    let config = Config { clutter: "none".to_owned(), ..Config::default() };
    let own = start("plans/demo.yaml");
    let said = format!("the demo's plan has the hash {:016x}", own.plan().unwrap().hash());
    let desk = |start: &Start| {
        let world = simulator::build_world(&config, start).unwrap();
        world.nearest(4.9, 4.9, 0.72, 0.02, 0.05).name == "reception desk"
    };
    assert!(desk(&own), "deploy/worlds/demo.toml: plan_hash is another plan's: {said}");
    assert!(!desk(&start("plans/hall.yaml")));
}
