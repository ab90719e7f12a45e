//! The three methods of avoidance on one route: a box that is not on the plan stands in the way.
#![allow(clippy::unwrap_used, dead_code, reason = "tests, sharing code")]

mod common;

use common::{Flown, find, follow, follow_by, world};
use ipc_types::SteeringReason;
use navigation::config::Method;

const ROWS: &[&str] = &[
    "############################################################",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                           oooo                           #",
    "#       S                   oooo                   T       #",
    "#                           oooo                           #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "#                                                          #",
    "############################################################",
];

fn fly(method: Method) -> Flown {
    follow_by(method, &world(ROWS, 0.1), &[find(ROWS, 'S', 0.1), find(ROWS, 'T', 0.1)], 60.0)
}

#[test]
fn each_method_steers_by_itself_and_none_touches() {
    for method in Method::ALL {
        let flown = fly(method);
        println!(
            "{method}: {} after {:.1} s, least gap {:.2} m, aside {:.2} m",
            if flown.arrived { "arrived" } else { "not arrived" },
            flown.seconds,
            flown.least_gap,
            flown.most_aside
        );
        assert!(flown.least_gap > 0.05, "{method}: {}", flown.least_gap);
        let has = |reason| flown.reasons.contains(&reason);
        assert_eq!(has(SteeringReason::Deflected), method == Method::Potential, "{method}");
    }
}

#[test]
fn the_method_makes_the_difference_and_nothing_else() {
    let (said, unsaid) =
        (fly(Method::Vfh), follow(&world(ROWS, 0.1), &[find(ROWS, 'S', 0.1), find(ROWS, 'T', 0.1)], 60.0));
    assert_eq!(said.path, unsaid.path, "it flies the same twice");
    assert_ne!(fly(Method::Thesis).path, said.path);
    assert_ne!(fly(Method::Potential).path, said.path);
}
