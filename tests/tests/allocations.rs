//! What keeps the drone in the air allocates nothing while it flies.
//!
//! The exception is the planning of navigation, which comes after everything else in its step and allocates in
//! bounded slices. It is told from the rest by its call stack, so that a round is flown with all its planning.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use cli::flight::{Flight, Setup};
use ipc_types::{PatrolState, Phase, Trace, Verb};
use sereno_tests::checkout;
use sereno_tests::counting::{Allocation, Noting, noted, watch};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

#[global_allocator]
static ALLOCATOR: Noting = Noting;

/// Services with the steps a second that the manifest promises.
const CRITICAL: [(&str, u64); 5] =
    [("flight", 200), ("pilot", 50), ("navigation", 20), ("localization", 50), ("sonar", 200)];
static STEPS: [AtomicU64; 5] = [const { AtomicU64::new(0) }; 5];
/// Where the bounded slices of planning begin.
const PLANNING: &str = "plan_on at services/navigation/";

fn watch_critical(service: Option<&'static str>) {
    let index = service.and_then(|name| CRITICAL.iter().position(|(critical, _)| *critical == name));
    if let Some(index) = index {
        STEPS[index].fetch_add(1, Ordering::Relaxed);
    }
    watch(index.and(service));
}

/// The demo building with everything in the way that may be: the drone gives way, plans again and shortens its
/// route, and none of that is known when it starts.
fn setup(vehicle: &str) -> Setup {
    let deploy = checkout().join("deploy");
    let (mut manifest, root) =
        runtime::load_manifest(&format!("{0}/system.toml:{0}/sim.toml", deploy.display())).unwrap();
    manifest.system.vehicle = format!("vehicles/{vehicle}.toml");
    Setup {
        manifest,
        root,
        simulator: simulator::Config { clutter: "full".to_owned(), ..simulator::Config::default() },
        navigation: None,
        begin: cli::flight::Begin::default(),
        localization: None,
        patience_s: 120.0,
        cache: runtime::Cache::default(),
    }
}

fn phase(flight: &Flight) -> Option<Phase> {
    flight.witness.last_pilot.and_then(|state| Phase::from_code(state.phase))
}

fn fly_until(flight: &mut Flight, reached: impl Fn(&Flight) -> bool) {
    let patience = flight.bus.now() + 40_000_000_000;
    while !reached(flight) {
        flight.run_for(0.02);
        assert!(
            flight.bus.now() < patience,
            "in vain: {} {}",
            flight.witness.phase(),
            flight.witness.round.text
        );
    }
}

/// Call stacks with how often each allocated.
fn by_place(allocations: &[Allocation]) -> BTreeMap<String, usize> {
    let mut places = BTreeMap::new();
    for allocation in allocations {
        *places.entry(allocation.places().join("\n      in ")).or_default() += 1;
    }
    places
}

#[test]
fn steps_in_flight_allocate_nothing() {
    // With flow and without: where the particles lie along a corridor, inside walls too, is another matter without.
    for (vehicle, watched_s, seen) in [("watchman", 60, 0.1), ("watchman-sonar", 30, 0.02)] {
        watch_round(vehicle, watched_s, seen);
    }
}

/// Watches the first seconds of a round, which is to see at least that share of the building meanwhile.
fn watch_round(vehicle: &str, watched_s: u64, seen: f32) {
    for steps in &STEPS {
        steps.store(0, Ordering::Relaxed);
    }
    let mut flight = Flight::start(&setup(vehicle), 1).unwrap();
    // Journals are written where somebody reads them; that the oldest entries are dropped is nothing to the writers.
    let mut ports = flight.bus.tool("cli");
    let _journals =
        CRITICAL.map(|(service, _)| ports.input_of::<Trace>(&format!("trace/{service}")).unwrap());
    flight.run_for(6.0);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    fly_until(&mut flight, |flight| matches!(phase(flight), Some(Phase::Hover | Phase::Autonomous)));
    flight.bus.watch_steps(watch_critical);
    fly_until(&mut flight, |flight| flight.witness.round.state == Some(PatrolState::Flying));
    flight.run_for(watched_s as f64);
    flight.bus.watch_steps(|_| {});
    // What was watched was a round.
    assert_eq!(flight.witness.contacts(), 0, "{vehicle}");
    assert_eq!(phase(&flight), Some(Phase::Autonomous), "{vehicle}");
    let coverage = flight.witness.round.coverage;
    assert!(coverage > seen, "{vehicle} saw {coverage}");

    let mut report = String::new();
    for ((service, rate), steps) in CRITICAL.iter().zip(&STEPS) {
        let steps = steps.load(Ordering::Relaxed);
        assert!(steps >= rate * watched_s, "{vehicle}, {service}: only {steps} steps were watched");
        let (planning, other): (Vec<_>, Vec<_>) = noted(service)
            .into_iter()
            .partition(|one| one.places().iter().any(|place| place.contains(PLANNING)));
        println!(
            "{vehicle}, {service}: {steps} steps, {} allocations, {} in planning",
            other.len(),
            planning.len()
        );
        if *service == "navigation" {
            assert!(!planning.is_empty(), "a round was planned without {PLANNING}?");
        } else {
            assert!(planning.is_empty(), "{service} plans?");
        }
        for (place, count) in by_place(&other) {
            report += &format!("  {service}: {count} times {place}\n");
        }
    }
    assert!(report.is_empty(), "{vehicle}: allocations in {watched_s} s of a round:\n{report}");
}
