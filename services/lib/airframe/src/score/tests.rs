use super::*;
use crate::world::{AsBuilt, ClutterLevel, PadEntry, WorldFile};
use floorplan::{Plan, Sidecar};

fn room() -> World {
    let mut rows = vec!["#".repeat(42)];
    rows.extend((0..30).map(|_| format!("#{}#", " ".repeat(40))));
    rows.push("#".repeat(42));
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let pad = Some(PadEntry { x_m: 2.0, y_m: 1.5, heading_deg: 0.0 });
    let file = WorldFile { pad, ..WorldFile::default() };
    let plan = Plan::from_ascii(&rows, 0.1);
    World::build_as(&plan, &Sidecar::default(), &file, ClutterLevel::None, 1, AsBuilt::exact())
        .expect("a room")
}

fn ending(place: (f32, f32)) -> Ending {
    Ending {
        seed: 7,
        contacts: 0,
        min_clearance_m: 0.213_46,
        landed: true,
        place,
        failsafes: Vec::new(),
        skipped: vec!["Store 2: door closed".into()],
        stalled_s: 0.25,
        digest: 0xcbf2_9ce4_8422_2325,
    }
}

/// A flight of 20 s at 0.1 m/s along x, with an estimate that is wrong by `error` after 10 s.
fn flown(world: &World, error: f32) -> Scorer {
    let mut scorer = Scorer::new(world, 0.225);
    for tick in 0..=600 {
        let time_s = f64::from(tick) * 0.05;
        let x = 1.0 + 0.1 * (time_s as f32 - 5.0).clamp(0.0, 20.0);
        let off = if time_s > 15.0 { error } else { 0.04 };
        scorer.observe(
            world,
            &Observation {
                time_s,
                x,
                y: 1.5,
                yaw: 3.1,
                airborne: (5.0..25.0).contains(&time_s),
                estimate: Some((x, 1.5 + off, -3.1)),
                p_lost: Some(0.001),
            },
        );
    }
    scorer
}

#[test]
fn figures_are_of_the_time_in_the_air() {
    let world = room();
    let score = flown(&world, 0.2).finish(&world, ending((2.1, 1.5)));
    let r = &score.report;
    assert_eq!(r.outcome, Outcome::LandedOnPad);
    assert!((r.time_s - 19.95).abs() < 0.01 && (r.distance_m - 2.0).abs() < 0.02, "{r:?}");
    assert!((r.loc_error_m.median.expect("errors") - 0.04).abs() < 1e-3);
    assert!((r.loc_error_m.max.expect("errors") - 0.2).abs() < 1e-3);
    // -3.1 and 3.1 are 0.083 apart, not 6.2.
    assert!((r.heading_error_rad.median.expect("errors") - 0.0832).abs() < 1e-3);
    assert_eq!(r.first_fix_s, Some(0.0));
    assert!(r.lost_s == 0.0 && r.coverage > 0.99);
    assert_eq!(r.min_clearance_m, 0.2135);
}

#[test]
fn being_lost_is_what_the_truth_says() {
    let world = room();
    let score = flown(&world, 0.8).finish(&world, ending((1.0, 1.0)));
    assert!((score.report.lost_s - 10.0).abs() < 0.1, "{}", score.report.lost_s);
    assert_eq!(score.report.outcome, Outcome::LandedElsewhere);
    let late = Ending { landed: false, ..ending((2.0, 1.5)) };
    assert_eq!(flown(&world, 0.0).finish(&world, late).report.outcome, Outcome::Timeout);
    let touched = Ending { contacts: 1, ..ending((2.0, 1.5)) };
    assert_eq!(flown(&world, 0.0).finish(&world, touched).report.outcome, Outcome::Contact);
}

#[test]
fn the_first_claim_is_the_first_time_that_it_says_to_know_its_place() {
    let world = room();
    let claimed = |says: &dyn Fn(f64) -> Option<f32>, off: f32| {
        let mut scorer = Scorer::new(&world, 0.2);
        for k in 0..200u32 {
            let time_s = f64::from(k) * 0.05;
            let estimate = Some((2.0 + off, 1.5, 0.0));
            let seen = Observation {
                time_s,
                x: 2.0,
                y: 1.5,
                yaw: 0.0,
                airborne: time_s >= 2.0,
                estimate,
                p_lost: says(time_s),
            };
            scorer.observe(&world, &seen);
        }
        scorer.finish(&world, ending((2.0, 1.5)))
    };
    let after_5 = |time_s: f64| (time_s >= 4.0).then_some(if time_s >= 5.0 { 0.03 } else { 0.2 });
    let claim = claimed(&after_5, 0.7).report.first_claim.expect("it said so");
    assert!((claim.time_s - 3.0).abs() < 0.06 && (claim.error_m - 0.7).abs() < 1e-3, "{claim:?}");
    assert_eq!(claimed(&|_| Some(0.06), 0.0).report.first_claim, None, "what is doubted is no claim");
    let report =
        Report::of(vec![claimed(&after_5, 0.7), claimed(&|_| None, 0.0), claimed(&|_| Some(0.0), 0.1)], 1.0);
    let claims = report.total.first_claims;
    assert_eq!((claims.made, claims.right), (2, 1));
    assert!(
        (claims.p95_s.expect("two claims") - 3.0).abs() < 0.06 && claims.median_s == Some(0.0),
        "{claims:?}"
    );
}

#[test]
fn totals_pool_errors_over_time_and_coverage_over_flights() {
    let world = room();
    let good = flown(&world, 0.04).finish(&world, ending((2.0, 1.5)));
    let bad = flown(&world, 0.2).finish(&world, ending((0.5, 0.5)));
    let report = Report::of(vec![good, bad], 120.0);
    let total = report.total;
    assert_eq!((total.flights, total.landed_on_pad, total.contacts), (2, 1, 0));
    // Three quarters of the pooled time the error was 4 cm.
    assert!((total.loc_error_m.median.expect("errors") - 0.04).abs() < 1e-3);
    assert!((total.loc_error_m.p95.expect("errors") - 0.2).abs() < 1e-3);
    assert!((total.min_clearance_m - 0.2135).abs() < 1e-9);
    assert!(total.coverage.p5 <= total.coverage.median);
}

/// The keys are a contract: each struct is written as TOML, which names them.
#[test]
fn the_keys_are_those_of_the_design() {
    let world = room();
    let report = Report::of(vec![flown(&world, 0.04).finish(&world, ending((2.0, 1.5)))], 120.0);
    let text = toml::to_string(&report).expect("serialises");
    for key in [
        "[[flights]]",
        "seed = 7",
        "outcome = \"landed_on_pad\"",
        "contacts = 0",
        "min_clearance_m = 0.2135",
        "time_s = ",
        "distance_m = ",
        "coverage = ",
        "[flights.loc_error_m]",
        "median = ",
        "p95 = ",
        "max = ",
        "[flights.heading_error_rad]",
        "first_fix_s = 0.0",
        "[flights.first_claim]",
        "lost_s = 0.0",
        "failsafes = []",
        "skipped = [\"Store 2: door closed\"]",
        "stalled_s = 0.25",
        "digest = \"cbf29ce484222325\"",
        "remarks = [",
        "[total]",
        "flights = 1",
        "landed_on_pad = 1",
        "[total.coverage]",
        "p5 = ",
        "[total.first_claims]",
        "[total.loc_error_m]",
        "real_time_factor = 120.0",
    ] {
        assert!(text.contains(key), "{key} is not in\n{text}");
    }
}
