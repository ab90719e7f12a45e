//! The system in lockstep: it takes off, stands and lands, and the same seed gives the same flight.
#![allow(clippy::unwrap_used, reason = "tests")]

use cli::flight::{Flight, Setup};
use ipc_types::{Grid, Polar, Verb};
use std::path::Path;

fn setup(clutter: &str) -> Setup {
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    let (manifest, root) =
        runtime::load_manifest(&format!("{0}/system.toml:{0}/sim.toml", deploy.display())).unwrap();
    Setup {
        manifest,
        root,
        simulator: simulator::Config { clutter: clutter.to_owned(), ..simulator::Config::default() },
        navigation: None,
        begin: cli::flight::Begin::default(),
        localization: None,
        patience_s: 120.0,
        cache: runtime::Cache::default(),
    }
}

/// Seeds 1 to 3, each with its own mass, motors, level error, compass and gusts. The bounds are three times what
/// was seen.
#[test]
fn it_takes_off_stands_and_lands() {
    let setup = setup("none");
    for seed in 1..=3 {
        let mut flight = Flight::start(&setup, seed).unwrap();
        flight.run_for(6.0);
        let pad = flight.world.pad();
        flight.order(Verb::TakeOff, f32::NAN, f32::NAN);
        flight.run_for(12.0);
        for _ in 0..50 {
            flight.run_for(0.2);
            let truth = flight.witness.last_truth.unwrap();
            assert!((truth.z_m - 1.2).abs() < 0.25, "seed {seed}: height {}", truth.z_m);
            let aside = (truth.x_m - pad.x).hypot(truth.y_m - pad.y);
            assert!(aside < 0.6, "seed {seed}: {aside} m from the pad");
        }
        flight.order(Verb::Land, f32::NAN, f32::NAN);
        flight.run_for(10.0);
        assert!(flight.witness.landed(), "seed {seed}: {}", flight.witness.phase());
        assert_eq!(flight.witness.contacts(), 0, "seed {seed}");
    }
}

/// Three metres from the pad it holds, and the charge runs out of what the way home takes: 0.23 leaves half a minute.
/// And with 0.15 it does in the take-off already.
#[test]
fn a_hover_with_little_charge_comes_home_and_lands_on_the_pad() {
    for (charge, aside) in [(0.23, true), (0.15, false)] {
        let mut setup = setup("none");
        setup.simulator.charge = charge;
        let mut flight = Flight::start(&setup, 1).unwrap();
        flight.run_for(6.0);
        let pad = flight.world.pad();
        flight.order(Verb::TakeOff, f32::NAN, f32::NAN);
        let off = |flight: &Flight| {
            let truth = flight.witness.last_truth.unwrap();
            (truth.x_m - pad.x).hypot(truth.y_m - pad.y)
        };
        if aside {
            flight.run_for(8.0);
            flight.order(Verb::GoTo, pad.x + 3.0, pad.y);
            flight.run_for(9.0);
            flight.order(Verb::Hold, f32::NAN, f32::NAN);
            flight.run_for(2.0);
            assert_eq!(flight.witness.phase(), "hover");
            assert!(off(&flight) > 2.0, "{} m from the pad", off(&flight));
        }
        let since = flight.bus.now();
        while !flight.witness.landed() {
            flight.run_for(0.5);
            let waited = (flight.bus.now() - since) as f64 * 1e-9;
            assert!(
                waited < 90.0,
                "charge {charge}: {}, {} m from the pad",
                flight.witness.phase(),
                off(&flight)
            );
        }
        assert_eq!(flight.witness.contacts(), 0);
        assert!(off(&flight) < 0.35, "charge {charge}: landed {} m from the pad's middle", off(&flight));
    }
}

/// Half a minute of a round in a cluttered building, twice, while somebody else watches, and with another seed.
#[test]
fn the_same_seed_is_the_same_flight_byte_for_byte() {
    let fly = |seed: u64, watched: bool| {
        // Nothing is shared between the two flights: a cache filled by the first must not matter.
        let setup = setup("full");
        let mut flight = Flight::start(&setup, seed).unwrap();
        let mut bytes = Vec::new();
        let mut tool = flight.bus.tool("cli");
        let _grids = watched.then(|| tool.input::<Grid>().unwrap());
        let _polars = watched.then(|| tool.input::<Polar>().unwrap());
        flight.run_for(6.0);
        flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
        for _ in 0..60 {
            flight.run_for(0.5);
            bytes.extend_from_slice(bytemuck::bytes_of(&flight.witness.last_truth.unwrap()));
            bytes.extend_from_slice(bytemuck::bytes_of(&flight.witness.last_pose.unwrap()));
        }
        (bytes, flight.bus.steps())
    };
    let first = fly(5, false);
    assert!(first == fly(5, false), "the second flight differs from the first");
    assert!(first == fly(5, true), "watching changes the flight");
    assert!(first != fly(6, false));
}

/// While nobody estimates, the flight is scored on: an error every 60 ms of the time in the air.
#[test]
fn a_silent_localization_does_not_stop_the_scoring() {
    let setup = setup("none");
    let scored = |silent: bool| {
        let mut flight = Flight::start(&setup, 2).unwrap();
        flight.run_for(6.0);
        flight.order(Verb::TakeOff, f32::NAN, f32::NAN);
        flight.run_for(12.0);
        if silent {
            flight.bus.kill("localization");
        }
        flight.run_for(3.0);
        let last = flight.witness.last_truth.unwrap();
        assert!(last.armed != 0 && last.on_ground == 0, "in the air");
        flight.finish()
    };
    let (spoken, silent) = (scored(false), scored(true));
    assert!(spoken.errors.len() > 100, "{}", spoken.errors.len());
    let missing = spoken.errors.len().abs_diff(silent.errors.len());
    assert!(missing <= 2, "{} errors and {}", spoken.errors.len(), silent.errors.len());
    assert!((spoken.report.time_s - silent.report.time_s).abs() < 0.1, "{:?}", silent.report);
}
