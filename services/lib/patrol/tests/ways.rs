#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! Ways, shut doors, narrow passages and things in the way, on drawn plans.

mod common;

use common::{Site, along, delivered, drawn, enlarged, fly_all, length, plan_round, route, score};
use patrol::{Bits, Limits, Obstacle, Progress, Round, RoutePlanner, SIDE, Seen, Step};
use proptest::prelude::*;

/// A hall and two stores at 0.3 m a cell: the first behind a door of 0.9 m, the second behind 0.6 m.
#[rustfmt::skip]
const STORES: [&str; 20] = [
    "###########################",
    "#            #            #",
    "#            #            #",
    "#            #            #",
    "#            #            #",
    "#            #            #",
    "#            #            #",
    "#            #            #",
    "#            #            #",
    "####   ###########  #######",
    "#                         #",
    "#                         #",
    "#                         #",
    "#                         #",
    "#                         #",
    "#                         #",
    "#                         #",
    "#                         #",
    "#                         #",
    "###########################",
];
const NAMES: &str = "doors:
  - {name: Store 1, a: [1.2, 3.15], b: [2.1, 3.15]}
rooms:
  - {name: Hall, rectangle: [0, 0, 8.1, 3.0]}
  - {name: Store 1, rectangle: [0, 3.0, 3.9, 6]}
  - {name: Store 2, rectangle: [4.2, 3.0, 8.1, 6]}
";
const PAD: (f32, f32) = (4.0, 1.5);

/// Drawn at 0.3 m a cell, flown at 0.1 m.
fn stores() -> Site {
    let rows = enlarged(&STORES, 3);
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    drawn(&rows, 0.1, NAMES, PAD)
}

fn reasons(site: &Site, round: &Round) -> Vec<String> {
    let skipped = round.rooms().iter().enumerate().filter_map(|(k, room)| Some((k, room.skipped?)));
    skipped
        .map(|(k, why)| format!("{}: {}", site.rooms.name(k), why.reason(site.rooms.name(k), &site.doors)))
        .collect()
}

#[test]
fn a_narrow_passage_is_skipped_by_name_with_its_width() {
    let site = stores();
    let mut seen = Seen::new(&site.map);
    let round = plan_round(&site, PAD, &seen);
    assert_eq!(reasons(&site, &round), ["Store 2: passage 0.60 m < 0.75 m"]);
    let flown = fly_all(&site, PAD, &round, &mut seen);
    assert!(flown.iter().any(|(_, y)| *y > 3.6), "store 1 is entered");
    assert!(flown.iter().all(|(x, y)| *y < 3.0 || *x < 3.9), "store 2 is not");
    // What is missing lies at the far end of what the slit shows of store 2.
    let coverage = score(&site.plan, PAD, &flown);
    assert!(coverage >= 0.95, "{coverage}");
    assert!((flown.last().unwrap().0 - PAD.0).abs() < 0.01);
}

#[test]
fn a_shut_door_is_named_and_the_rest_is_seen() {
    let mut site = stores();
    let mut seen = Seen::new(&site.map);
    let open = plan_round(&site, PAD, &seen);
    let door = site.map.door_near(1.7, 3.2, 0.3).unwrap();
    assert_eq!(site.map.door_near(4.0, 1.0, 0.3), None);
    site.map.set_door(door, true);
    assert_eq!(route(&site, PAD, (1.5, 4.5)), Err(Obstacle::DoorClosed(door)));
    // The replan starts from in front of the door with a part seen.
    seen.mark(&site.map, PAD.0, PAD.1);
    let round = plan_round(&site, (1.6, 2.4), &seen);
    assert_eq!(reasons(&site, &round), ["Store 1: door closed", "Store 2: passage 0.60 m < 0.75 m"]);
    assert!(round.stops().iter().all(|stop| stop.y < 3.0));
    assert!(round.stops().len() < open.stops().len());
    assert!(round.to_see().count() < open.to_see().count());
    let flown = fly_all(&site, (1.6, 2.4), &round, &mut seen);
    assert!(seen.total(round.to_see()).share() > 0.95, "{:?}", seen.total(round.to_see()));
    assert_eq!(flown.last(), Some(&PAD));
    site.map.set_door(door, false);
    assert!(route(&site, PAD, (1.5, 4.5)).is_ok(), "opened again");
}

#[test]
fn what_stands_in_the_only_way_is_said_and_forgotten() {
    let mut site = stores();
    for k in 0..9 {
        site.map.mark_unmapped(1.25 + 0.1 * k as f32, 3.15);
    }
    assert_eq!(route(&site, PAD, (1.5, 4.5)), Err(Obstacle::Unmapped));
    let round = plan_round(&site, PAD, &Seen::new(&site.map));
    assert_eq!(reasons(&site, &round)[0], "Store 1: blocked by something not on the plan");
    let kept = Bits::from_words(site.map.unmapped().words());
    site.map.forget_unmapped(1.6, 3.15, 1.0);
    assert!(route(&site, PAD, (1.5, 4.5)).is_ok());
    site.map.set_unmapped(&kept);
    assert_eq!(route(&site, PAD, (1.5, 4.5)), Err(Obstacle::Unmapped), "as after a restart");
}

#[test]
fn the_way_leads_round_what_stands_about() {
    let mut site = stores();
    let straight = route(&site, (1.0, 1.5), (7.0, 1.5)).unwrap();
    assert!(length(&straight) < 6.1, "{straight:?}");
    for k in 0..8 {
        site.map.mark_unmapped(4.0, 1.0 + 0.1 * k as f32);
    }
    let round_it = along(&route(&site, (1.0, 1.5), (7.0, 1.5)).unwrap());
    let nearest = round_it
        .iter()
        .flat_map(|p| (0..8).map(move |k| (p.0 - 4.05).hypot(p.1 - (1.05 + 0.1 * k as f32)) - 0.05))
        .fold(f32::INFINITY, f32::min);
    assert!(nearest > 0.3, "{nearest}");
    let hidden = {
        let mut seen = Seen::new(&site.map);
        seen.mark(&site.map, 3.4, 1.4);
        seen.bits().get(site.map.raster(), site.map.raster().cell(4.6, 1.4).unwrap())
    };
    assert!(!hidden, "what stands there hides what is behind it");
}

#[test]
fn a_room_without_a_door_has_no_way() {
    let shut: Vec<String> = enlarged(&STORES, 3)
        .iter()
        .enumerate()
        .map(|(k, row)| if k / 3 == 9 { "#".repeat(row.len()) } else { row.clone() })
        .collect();
    let shut: Vec<&str> = shut.iter().map(String::as_str).collect();
    let site = drawn(&shut, 0.1, NAMES, PAD);
    let round = plan_round(&site, PAD, &Seen::new(&site.map));
    assert_eq!(
        reasons(&site, &round),
        ["Store 1: no way to it on the plan", "Store 2: no way to it on the plan"]
    );
    assert_eq!(route(&site, PAD, (99.0, 0.0)), Err(Obstacle::NoWay));
    assert_eq!(route(&site, (f32::NAN, 0.0), PAD), Err(Obstacle::NoWay));
}

#[test]
fn a_start_too_near_to_a_wall_is_left_and_a_goal_in_one_is_moved() {
    let site = stores();
    let points = route(&site, (0.5, 0.5), PAD).unwrap();
    assert_eq!(points[0], (0.5, 0.5));
    let end = route(&site, PAD, (7.75, 1.5)).unwrap();
    let (x, y) = *end.last().unwrap();
    assert!(site.map.passable(x, y) && (x - 7.75).abs() <= 0.5);
    let round = plan_round(&site, (0.45, 0.45), &Seen::new(&site.map));
    assert!(round.stops().len() > 2);
}

#[test]
fn a_round_from_nowhere_fails_and_one_with_nothing_left_goes_home() {
    let site = stores();
    let seen = Seen::new(&site.map);
    let mut nowhere = Round::new(&site.map, 3, (-5.0, 0.0), PAD, &seen, &patrol::Wishes::default());
    assert_eq!(nowhere.advance(&site.map, &seen, 1_000_000), Progress::Failed);
    let mut all = Seen::new(&site.map);
    all.restore(&[u64::MAX; SIDE * SIDE / 64]);
    let round = plan_round(&site, (1.0, 1.0), &all);
    assert_eq!(round.stops().len(), 1);
    assert_eq!((round.stops()[0].x, round.stops()[0].y, round.stops()[0].look), (PAD.0, PAD.1, false));
}

#[test]
fn both_small_plans_are_covered() {
    for name in ["hall", "two-rooms"] {
        let site = delivered(name);
        let mut seen = Seen::new(&site.map);
        let round = plan_round(&site, site.pad, &seen);
        let flown = fly_all(&site, site.pad, &round, &mut seen);
        let coverage = score(&site.plan, site.pad, &flown);
        assert!(coverage >= 0.97, "{name}: {coverage}");
        assert!(length(&flown) < 40.0, "{name}: {}", length(&flown));
    }
}

#[test]
fn a_search_takes_no_more_than_its_slice() {
    let site = stores();
    let mut planner = RoutePlanner::new(&site.map);
    planner.begin(&site.map, (1.0, 1.0), (1.5, 4.5));
    let mut calls = 0;
    while planner.advance(&site.map, 50) == Step::Working {
        calls += 1;
    }
    assert!((5..400).contains(&calls), "{calls}");
    let sliced = planner.route().clone();
    planner.begin(&site.map, (1.0, 1.0), (1.5, 4.5));
    assert_eq!(planner.advance(&site.map, 1_000_000), Step::Found);
    assert_eq!(*planner.route(), sliced);
    assert!(
        sliced.clearance_m > Limits::default().clearance_m()
            && (sliced.length_m - length(&sliced.points)).abs() < 1e-3
    );
}

#[test]
fn rooms_are_tallied() {
    let site = stores();
    let mut seen = Seen::new(&site.map);
    let round = plan_round(&site, PAD, &seen);
    let mut tallies = vec![Default::default(); 3];
    seen.by_room(&site.map, round.to_see(), &mut tallies);
    assert!(tallies.iter().all(|tally| tally.seen == 0));
    seen.mark(&site.map, 1.6, 4.6);
    seen.by_room(&site.map, round.to_see(), &mut tallies);
    assert!(tallies[1].share() > 0.9, "{tallies:?}");
    assert!(tallies[0].share() < 0.5, "{tallies:?}");
    assert_eq!(seen.gain_m2(&site.map, round.to_see(), 1.6, 4.6), 0.0);
    assert!(seen.gain_m2(&site.map, round.to_see(), 6.0, 1.5) > 5.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// Whatever stands about, a way that is found can be flown and one that is not has a reason.
    #[test]
    fn found_ways_keep_their_clearance(marks in proptest::collection::vec((0.3_f32..7.8, 0.3_f32..2.7), 0..12),
                                       from in (0.7_f32..7.4, 0.7_f32..2.3), to in (0.7_f32..7.4, 0.7_f32..2.3)) {
        let mut site = stores();
        for (x, y) in marks {
            site.map.mark_unmapped(x, y);
        }
        let free = site.map.passable(from.0, from.1);
        if let Ok(points) = route(&site, from, to) && free {
            for (x, y) in along(&points) {
                prop_assert!(site.map.clearance(x, y) > 0.225, "({x}, {y}) {}", site.map.clearance(x, y));
            }
        }
    }

    #[test]
    fn no_input_panics(x in any::<f32>(), y in any::<f32>()) {
        let mut site = stores();
        site.map.mark_unmapped(x, y);
        site.map.forget_unmapped(x, y, y);
        site.map.set_door(x as usize, true);
        let mut seen = Seen::new(&site.map);
        seen.mark(&site.map, x, y);
        let _ = route(&site, (x, y), (y, x));
        let mut round = Round::new(&site.map, 3, (x, y), (y, x), &seen, &patrol::Wishes::default());
        round.advance(&site.map, &seen, 1_000);
        prop_assert!(site.map.clearance(x, y) >= 0.0);
    }
}

#[test]
fn a_route_comes_up_to_a_door_from_the_front_and_passes_its_middle() {
    // The door of store 1 is 0.9 m wide around (1.65, 3.15); both ends of the route lie well aside of it.
    let site = stores();
    let points = route(&site, (6.5, 2.2), (3.2, 5.0)).unwrap();
    let passed: Vec<_> = along(&points).into_iter().filter(|p| (p.1 - 3.15).abs() < 0.3).collect();
    assert!(passed.len() > 4, "{points:?}");
    for (x, y) in passed {
        assert!((x - 1.65).abs() < 0.06, "at {x} {y}: {points:?}");
    }
}
