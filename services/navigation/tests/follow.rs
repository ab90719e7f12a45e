//! Following a planned line, with ideal dynamics and ideal sonars.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{find, follow, world};
use ipc_types::SteeringReason;

#[test]
fn a_corridor_is_flown_at_speed_and_in_the_middle() {
    // 0.1 m a character: 2 m wide, 8 m long.
    let wall = "#".repeat(80);
    let free = " ".repeat(80);
    let mut rows = vec![wall.as_str()];
    rows.extend(std::iter::repeat_n(free.as_str(), 20));
    rows.push(wall.as_str());
    let flown = follow(&world(&rows, 0.1), &[(0.8, 1.1), (7.2, 1.1)], 40.0);
    assert!(flown.arrived);
    assert!(flown.seconds < 6.4 / 0.5 + 4.0, "{} s", flown.seconds);
    assert!(flown.most_aside < 0.05);
}

const DOOR: &[&str] = &[
    "##########################################",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#         S                              #",
    "#                                        #",
    "#                                        #",
    "#                                        #",
    "#                               T        #",
    "#                                        #",
    "#                                        #",
    "#                                        #",
    "#                                        #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "#                    #                   #",
    "##########################################",
];

#[test]
fn a_door_of_ninety_centimetres_is_passed_in_its_middle() {
    let (s, t) = (find(DOOR, 'S', 0.1), find(DOOR, 'T', 0.1));
    // Door centre at row of T; approached from aside.
    let flown = follow(&world(DOOR, 0.1), &[s, (1.6, t.1), (2.7, t.1), t], 60.0);
    assert!(flown.arrived, "{:?}", flown.path.last());
    let (_, y) = flown.path.iter().find(|p| p.0 > 2.15).copied().unwrap();
    assert!((y - t.1).abs() < 0.08, "{y}");
    assert!(flown.least_gap > 0.12, "{}", flown.least_gap);
}

#[test]
fn a_box_that_is_not_on_the_plan_is_flown_around() {
    let rows = [
        "############################################################",
        "#                                                          #",
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
        "#                           oooo                           #",
        "#                                                          #",
        "#                                                          #",
        "#                                                          #",
        "#                                                          #",
        "#                                                          #",
        "#                                                          #",
        "############################################################",
    ];
    let flown = follow(&world(&rows, 0.1), &[find(&rows, 'S', 0.1), find(&rows, 'T', 0.1)], 60.0);
    assert!(flown.arrived, "{:?}", flown.path.last());
    assert!(flown.most_aside > 0.3);
    assert!(flown.least_gap > 0.08, "{}", flown.least_gap);
}

#[test]
fn a_gap_of_eighty_centimetres_beside_a_cupboard_is_passed() {
    let rows = [
        "########################################################################",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                 ooooooo                              #",
        "#                                 ooooooo                              #",
        "#                                 ooooooo                              #",
        "#                                 ooooooo                              #",
        "#                                 ooooooo                              #",
        "#        S                        ooooooo                    T         #",
        "#                                 ooooooo                              #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "#                                                                      #",
        "########################################################################",
    ];
    let flown = follow(&world(&rows, 0.1), &[find(&rows, 'S', 0.1), find(&rows, 'T', 0.1)], 60.0);
    assert!(flown.arrived, "{:?}", flown.path.last());
    assert!(flown.least_gap > 0.08, "{}", flown.least_gap);
}

#[test]
fn a_wall_across_the_corridor_that_is_not_on_the_plan_stops_the_drone_in_time() {
    let rows = [
        "############################################################",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#       S                          o               T       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "#                                  o                       #",
        "############################################################",
    ];
    let flown = follow(&world(&rows, 0.1), &[find(&rows, 'S', 0.1), find(&rows, 'T', 0.1)], 40.0);
    assert!(!flown.arrived);
    assert!(flown.least_gap > 0.15, "{}", flown.least_gap);
    let last = &flown.reasons[flown.reasons.len() - 100..];
    assert!(last.iter().all(|r| *r == SteeringReason::Blocked), "{:?}", last[99]);
}

#[test]
fn what_stands_behind_a_door_is_gone_round_from_behind_the_door() {
    // A box of 0.4 m, 1.1 m behind the door, on the line, in a room that is 2 m longer.
    let rows: Vec<String> = DOOR
        .iter()
        .enumerate()
        .map(|(row, line)| {
            let longer = format!(
                "{}{}",
                &line[..line.len() - 1],
                if line.starts_with("##") { "#" } else { " " }.repeat(20)
            );
            let there = |column: usize| (11..15).contains(&row) && (33..37).contains(&column);
            let boxed = longer.chars().enumerate().map(|(column, c)| if there(column) { 'o' } else { c });
            boxed.chain(['#']).collect()
        })
        .collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let (s, y) = (find(DOOR, 'S', 0.1), find(DOOR, 'T', 0.1).1);
    let flown = follow(&world(&rows, 0.1), &[s, (1.6, y), (2.7, y), (5.0, y)], 60.0);
    assert!(flown.arrived, "{:?}", flown.path.last());
    assert!(flown.least_gap > 0.08, "{}", flown.least_gap);
}

#[test]
fn a_shut_door_stops_the_drone_in_time() {
    let rows: Vec<String> = DOOR
        .iter()
        .map(|row| {
            if row.as_bytes()[21] == b' ' { format!("{}o{}", &row[..21], &row[22..]) } else { (*row).into() }
        })
        .collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let t = find(&rows, 'T', 0.1);
    let flown = follow(&world(&rows, 0.1), &[find(&rows, 'S', 0.1), (1.6, t.1), (2.7, t.1), t], 40.0);
    assert!(!flown.arrived);
    assert!(flown.least_gap > 0.15, "{}", flown.least_gap);
    assert_eq!(flown.reasons.last(), Some(&SteeringReason::Blocked));
}

#[test]
fn a_person_in_the_way_is_not_backed_into_and_gives_way() {
    // The person is a box that disappears: the grid must not keep it.
    let wall = "#".repeat(60);
    let free = " ".repeat(60);
    let with = format!("{}ooo{}", " ".repeat(30), " ".repeat(27));
    let build = |middle: &str| {
        let mut rows = vec![wall.clone()];
        for i in 0..14 {
            rows.push(if (1..13).contains(&i) { middle.to_owned() } else { free.clone() });
        }
        rows.push(wall.clone());
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        world(&rows, 0.1)
    };
    let (standing, gone) = (build(&with), build(&free));
    let mut bench = common::Bench::new();
    let line = [(0.8f32, 0.8f32), (5.2, 0.8)];
    bench.track.set(line);
    let mut drone = common::Drone::at(line[0]);
    let mut now = 10_000_000_000;
    for step in 0..600 {
        let world = if step < 200 { &standing } else { &gone };
        let steer = bench.step(world, &drone, now);
        drone.fly(steer.velocity, steer.heading);
        assert!(world.gap(drone.x, drone.y) > 0.1);
        if step == 199 {
            assert_eq!(steer.reason, SteeringReason::Blocked);
        }
        now += common::STEP_NS;
    }
    assert!(bench.track.remaining() < 0.15, "{} {}", drone.x, drone.y);
}
