#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! The round of the demo building.

mod common;

use common::{along, delivered, draw, fly, length, plan_round, route, score};
use floorplan::DistanceField;
use patrol::Seen;

#[test]
fn a_round_sees_everything_and_ends_at_the_pad() {
    let site = delivered("demo");
    let mut seen = Seen::new(&site.map);
    let round = plan_round(&site, site.pad, &seen);
    let stops: Vec<(f32, f32)> = round.stops().iter().map(|stop| (stop.x, stop.y)).collect();
    let flown = fly(&site, site.pad, &round, &mut seen);
    let coverage = score(&site.plan, site.pad, &flown);
    let metres = length(&flown);
    let own = seen.total(round.to_see()).share();
    let picture = draw(&site, &flown, &stops);
    println!(
        "{picture}\n{} stops, {metres:.1} m, coverage {coverage:.4}, own reckoning {own:.4}",
        stops.len()
    );
    assert!(coverage >= 0.97, "{coverage}\n{picture}");
    assert!((f64::from(own) - coverage).abs() < 0.03, "own reckoning {own}, scored {coverage}");
    assert!(metres / 0.5 < 480.0, "{metres} m take longer than eight minutes\n{picture}");
    assert_eq!(flown.last(), Some(&site.pad));
    assert!(round.rooms().iter().all(|room| room.skipped.is_none() && room.to_see > 0));
    let field = DistanceField::of_not_free(&site.plan, 3.0);
    let tightest = flown.iter().map(|p| field.distance(p.0, p.1)).fold(f32::INFINITY, f32::min);
    assert!(tightest >= 0.41, "{tightest}: a door of 0.9 m is passed within 4 cm of its middle");
}

#[test]
fn a_round_finishes_rooms_before_it_leaves_them() {
    let site = delivered("demo");
    let round = plan_round(&site, site.pad, &Seen::new(&site.map));
    let rooms: Vec<_> = round.stops().iter().filter_map(|stop| stop.room).collect();
    let changes = rooms.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // Nine rooms, eight changes at the least and one home; the corridor lies between most of them.
    assert!(changes <= 18, "{rooms:?}");
}

#[test]
fn without_echoes_it_is_never_longer_than_five_seconds() {
    let site = delivered("demo");
    let mut seen = Seen::new(&site.map);
    let round = plan_round(&site, site.pad, &seen);
    let walls = DistanceField::new(&site.plan, 6.0);
    let mut deaf = 0.0_f32;
    for place in fly(&site, site.pad, &round, &mut seen) {
        deaf = if walls.distance(place.0, place.1) > 3.5 { deaf + 0.1 } else { 0.0 };
        assert!(deaf <= 2.5, "farther than 3.5 m from every surface for 5 s at 0.5 m/s");
    }
}

#[test]
fn doors_and_corridor_are_passed_in_the_middle() {
    let site = delivered("demo");
    let points = route(&site, site.pad, (16.0, 11.0)).unwrap();
    let field = DistanceField::of_not_free(&site.plan, 3.0);
    let doors: Vec<f32> = site
        .doors
        .iter()
        .flat_map(|door| {
            let field = &field;
            along(&points)
                .into_iter()
                .filter(|p| door.distance(p.0, p.1) < 0.1)
                .map(move |p| 0.5 * door.width() - field.distance(p.0, p.1))
        })
        .collect();
    assert!(!doors.is_empty());
    assert!(doors.iter().all(|off| *off < 0.06), "{doors:?}");
    let corridor = along(&points).into_iter().filter(|p| p.0 > 6.0 && p.0 < 13.0);
    for (x, y) in corridor {
        assert!((y - 7.0).abs() < 0.35, "({x}, {y}) in the corridor between y 6 and 8");
    }
}

#[test]
fn slices_are_bounded_and_change_nothing() {
    let site = delivered("demo");
    let seen = Seen::new(&site.map);
    let whole = plan_round(&site, site.pad, &seen);
    let mut sliced = patrol::Round::new(
        &site.map,
        site.rooms.len(),
        site.pad,
        site.pad,
        &seen,
        &patrol::Wishes::default(),
    );
    let mut calls = 0;
    while sliced.advance(&site.map, &seen, 5_000) == patrol::Progress::Working {
        calls += 1;
        assert!(calls < 100_000);
    }
    assert!(calls > 100, "{calls} slices: a slice is not the whole");
    assert_eq!(sliced.stops(), whole.stops());
}
