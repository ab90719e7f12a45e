#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! Rounds on plans that laser scanners made: ragged, with unknown cells and legs of furniture.

mod common;

use common::{draw, fly_all, length, plan_round, scanned, score};
use patrol::{Obstacle, Seen};

/// Coverage and a picture of the flight; nothing when the plans are not there.
fn coverage(name: &str) -> Option<(f64, String)> {
    let site = scanned(name)?;
    let mut seen = Seen::new(&site.map);
    let round = plan_round(&site, site.pad, &seen);
    let flown = fly_all(&site, site.pad, &round, &mut seen);
    let stops: Vec<(f32, f32)> = round.stops().iter().map(|stop| (stop.x, stop.y)).collect();
    let coverage = score(&site.plan, site.pad, &flown);
    Some((
        coverage,
        format!("{}\n{} stops, {:.0} m", draw(&site, &flown, &stops), stops.len(), length(&flown)),
    ))
}

#[test]
fn the_depot_is_covered() {
    if let Some((coverage, picture)) = coverage("depot") {
        assert!(coverage >= 0.95, "{picture}\n{coverage}");
    }
}

#[test]
fn the_room_of_pillars_is_covered() {
    if let Some((coverage, picture)) = coverage("turtlebot3_world") {
        assert!(coverage >= 0.95, "{picture}\n{coverage}");
    }
}

#[test]
fn on_a_plan_without_marks_nothing_is_blamed_on_what_is_not_on_the_plan() {
    for (name, pad) in [("willow-full-0.05", Some((10.0, 15.0))), ("depot", None)] {
        let Some(site) = scanned(name) else { continue };
        let round = plan_round(&site, pad.unwrap_or(site.pad), &Seen::new(&site.map));
        let skipped: Vec<_> = round.rooms().iter().filter_map(|room| room.skipped).collect();
        assert!(!skipped.contains(&Obstacle::Unmapped), "{name}: {skipped:?}");
    }
}
