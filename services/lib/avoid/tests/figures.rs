//! Thesis figures 3.8 to 3.12: the flights that the committed pictures show, and what must be true of them. Up on the page
//! is +y; angles are counter-clockwise (the thesis counts clockwise).
#![allow(clippy::unwrap_used, unreachable_pub, dead_code, reason = "tests, sharing code with an example")]

#[path = "../examples/figures/scenes.rs"]
mod scenes;
#[path = "../examples/figures/world.rs"]
mod world;

use avoid::{CELLS, Decision, Reason, SECTORS, Smoothing, Vfh, VfhConfig, Window, wrap};
use scenes::RADIUS_M;
use world::{Trial, fly};

fn decide(vfh: &mut Vfh, cells: &[u8], target_rad: f32, target_m: f32) -> (Decision, [u8; SECTORS]) {
    let look = world::look(vfh, cells, target_rad, target_m, 0.5);
    (look.decision, look.blocked)
}

#[test]
fn figure_3_8_a_wide_valley_beside_an_obstacle_is_flown_along_its_near_border() {
    let world = scenes::wide_valley();
    let ours = scenes::wide_valley_ours();
    assert!(ours.arrived, "{:?}", ours.path.last());
    assert!(ours.has(Reason::WideValley));
    assert!(ours.nearest > RADIUS_M, "{}", ours.nearest);
    // Round the upper, nearer end: never below the start.
    let lowest = ours.path.iter().map(|p| p.1).fold(f32::MAX, f32::min);
    assert!(lowest > world.find(b'S').1 - 0.3, "{lowest}");
    // The thesis's vehicle is a point, and flies as one.
    let thesis = scenes::wide_valley_thesis();
    assert!(thesis.arrived && thesis.has(Reason::WideValley));
    assert!(thesis.nearest > 0.0 && thesis.nearest < RADIUS_M, "{}", thesis.nearest);
}

#[test]
fn at_three_sweeps_a_second_the_smoothing_of_equation_14_leaves_gaps_that_equation_13_closes() {
    // Readings are 22.5 degrees apart less the swing of the heading. Equation 14 reaches one sector to either side, 13 five.
    let hann = fly(&scenes::wide_valley(), &mut scenes::vfh(VfhConfig::thesis()), &Trial::thesis());
    let triangle = fly(&scenes::wide_valley(), &mut scenes::vfh(scenes::thesis_13()), &Trial::thesis());
    assert!(hann.hit, "{:?}", hann.end());
    assert!(triangle.arrived && !triangle.hit, "{:?}", triangle.end());
}

#[test]
fn figure_3_9_equation_15_alone_circles_a_target_in_a_free_sector() {
    let (straight, alone) = (scenes::free_thesis(true), scenes::free_thesis(false));
    let distance = 7.0 * world::TILE;
    assert!(straight.arrived && alone.arrived);
    assert!(straight.length() < 1.02 * distance);
    // A course held s_max / 2 = 37.5 degrees off the target is a spiral, longer by 1 / cos(37.5 degrees).
    assert!(alone.length() > 1.2 * (distance - 0.1), "{}", alone.length());
    // All the way to the same side: tan(37.5 degrees) ln(1.4 / 0.1) = 2.0 rad in all.
    let turned: f32 = alone
        .path
        .windows(3)
        .map(|p| {
            let a = (p[1].1 - p[0].1).atan2(p[1].0 - p[0].0);
            wrap((p[2].1 - p[1].1).atan2(p[2].0 - p[1].0) - a)
        })
        .sum();
    assert!(turned.abs() > 1.6 && turned.abs() < 2.4, "turned {turned} rad");
}

#[test]
fn figure_3_10_a_narrow_valley_is_flown_in_its_middle() {
    let flight = scenes::narrow_valley_ours();
    assert!(flight.arrived, "{:?}", flight.path.last());
    assert!(flight.nearest > RADIUS_M, "{}", flight.nearest);
    let crossing: Vec<f32> = flight.path.iter().filter(|p| (1.8..2.2).contains(&p.0)).map(|p| p.1).collect();
    assert!(!crossing.is_empty());
    assert!(crossing.iter().all(|y| (y - scenes::GAP_MIDDLE_M).abs() < 0.2), "{crossing:?}");
    let thesis = scenes::narrow_valley_thesis();
    assert!(thesis.arrived && thesis.has(Reason::NarrowValley) && !thesis.hit);
}

#[test]
fn figure_3_11_a_threshold_far_too_high_still_turns_away_when_flown_slowly_and_hits_when_flown_fast() {
    let (slow, fast) =
        (scenes::threshold_too_high(scenes::SLOW_M_S), scenes::threshold_too_high(scenes::FAST_M_S));
    assert!(slow.arrived && !slow.hit, "{:?}", slow.end());
    assert!(fast.hit, "{:?}", fast.end());
    // The same of our own widened cells on a grid that only grows, at 400 times their threshold.
    let ours = |cruise_m_s: f32| {
        let config = VfhConfig {
            threshold_high: 1000.0,
            threshold_low: 1000.0,
            slow_density: 1e9,
            ..VfhConfig::tight(RADIUS_M)
        };
        let trial = Trial { rules: avoid::GridRules::thesis(), cruise_m_s, ..scenes::scanning() };
        fly(&scenes::wall_across(), &mut scenes::vfh(config), &trial)
    };
    let (slow, fast) = (ours(0.1), ours(1.0));
    assert!(slow.arrived && slow.nearest > RADIUS_M, "{}", slow.nearest);
    assert!(fast.hit, "{:?}", fast.end());
    // And at their own threshold they keep their distance at either speed.
    for cruise_m_s in [0.1, 1.0] {
        let kept =
            fly(&scenes::wall_across(), &mut scenes::ours(), &Trial { cruise_m_s, ..scenes::scanning() });
        assert!(kept.arrived && kept.nearest > RADIUS_M, "{cruise_m_s}: {}", kept.nearest);
    }
}

#[test]
fn figure_3_12_a_threshold_far_too_low_closes_a_passage() {
    let (good, low) = (scenes::passage_with_threshold(2.0), scenes::passage_with_threshold(scenes::LOW));
    assert!(good.arrived && !good.hit, "{:?}", good.end());
    // It never comes within a metre of the passage, whose line is at x = 2.4 m.
    let farthest = low.path.iter().map(|p| p.0).fold(0.0, f32::max);
    assert!(!low.arrived && farthest < 1.4, "{farthest}");
    let ahead = |threshold: f32| scenes::look_at_passage(threshold).1;
    assert_eq!(ahead(2.0).blocked[0], 0);
    assert_eq!(ahead(scenes::LOW).blocked[0], 1);
}

/// A gap of 1 m between two certain posts, 1 m ahead.
fn gap() -> Vec<u8> {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut cells = vec![0u8; CELLS];
    for i in 0..20 {
        for side in [-1.0, 1.0] {
            cells[window.index(1.01, 0.01 + side * (0.5 + 0.05 * i as f32)).unwrap()] = 40;
        }
    }
    cells
}

#[test]
fn figure_3_12_from_outside_a_threshold_far_too_low_closes_a_gap() {
    let config = |threshold| VfhConfig {
        threshold_high: threshold,
        threshold_low: threshold,
        smoothing: Smoothing::Triangle,
        ..VfhConfig::tight(RADIUS_M)
    };
    let (open, free) = decide(&mut Vfh::new(config(40.0)).unwrap(), &gap(), 0.0, 3.0);
    let (shut, closed) = decide(&mut Vfh::new(config(0.05)).unwrap(), &gap(), 0.0, 3.0);
    assert_eq!(open.reason, Reason::TargetSafe);
    assert_ne!(shut.reason, Reason::TargetSafe);
    let count = |blocked: [u8; SECTORS]| blocked.iter().filter(|b| **b == 1).count();
    assert!(count(closed) > count(free));
}

#[test]
fn the_same_gap_is_open_to_the_flight_configuration_and_shut_to_a_wider_vehicle() {
    let (decision, _) = decide(&mut Vfh::new(VfhConfig::tight(0.225)).unwrap(), &gap(), 0.0, 1.2);
    assert_eq!(decision.reason, Reason::TargetSafe);
    let (decision, blocked) = decide(&mut Vfh::new(VfhConfig::tight(0.5)).unwrap(), &gap(), 0.0, 1.2);
    assert_eq!(blocked[0], 1);
    assert_ne!(decision.reason, Reason::TargetSafe);
}

#[test]
fn walled_in_all_round_is_blocked() {
    let window = Window::around(0.0, 0.0).unwrap();
    let mut cells = vec![0u8; CELLS];
    for k in 0..360 {
        let a = (k as f32).to_radians();
        cells[window.index(0.7 * a.cos(), 0.7 * a.sin()).unwrap()] = 40;
    }
    let (decision, _) = decide(&mut Vfh::new(VfhConfig::tight(0.225)).unwrap(), &cells, 1.0, 2.0);
    assert_eq!((decision.direction_rad, decision.speed_m_s, decision.reason), (None, 0.0, Reason::Blocked));
}

#[test]
fn the_threshold_has_hysteresis() {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut vfh = Vfh::new(VfhConfig::tight(0.225)).unwrap();
    let mut blocked_with = |certainty: u8| {
        let mut cells = vec![0u8; CELLS];
        cells[window.index(0.51, 0.01).unwrap()] = certainty;
        decide(&mut vfh, &cells, 0.0, 2.0).1[0] == 1
    };
    assert!(!blocked_with(14), "between the thresholds, from below");
    assert!(blocked_with(24));
    assert!(blocked_with(14), "between the thresholds, from above");
    assert!(!blocked_with(6));
}

#[test]
fn the_valley_flown_last_is_kept_while_two_are_nearly_equal() {
    // A post straight ahead; the target wanders a little around it.
    let window = Window::around(0.01, 0.01).unwrap();
    let mut cells = vec![0u8; CELLS];
    for i in 0..5 {
        cells[window.index(0.71, -0.09 + 0.05 * i as f32).unwrap()] = 60;
    }
    let mut vfh = Vfh::new(VfhConfig::tight(0.225)).unwrap();
    let mut sides = Vec::new();
    for step in 0..20 {
        let target = 0.1 * if step % 2 == 0 { 1.0 } else { -1.0 };
        sides.push(decide(&mut vfh, &cells, target, 2.0).0.direction_rad.unwrap() > 0.0);
    }
    assert!(sides.iter().all(|s| *s == sides[0]), "{sides:?}");
}

#[test]
fn speed_falls_with_the_density_ahead() {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut last = f32::MAX;
    for certainty in [0u8, 8, 10, 12, 14] {
        let mut cells = vec![0u8; CELLS];
        cells[window.index(0.51, 0.01).unwrap()] = certainty;
        let (decision, _) = decide(&mut Vfh::new(VfhConfig::tight(0.225)).unwrap(), &cells, 0.0, 2.0);
        assert_eq!(decision.reason, Reason::TargetSafe);
        assert!(decision.speed_m_s < last, "{certainty}");
        last = decision.speed_m_s;
    }
    assert!(last > 0.2 && last < 0.45, "{last}");
}

#[test]
fn a_parameter_out_of_range_is_refused_by_name() {
    let error = Vfh::new(VfhConfig { reach_m: f32::NAN, ..VfhConfig::thesis() }).unwrap_err();
    assert_eq!(error.field, "reach_m");
    assert!(Vfh::new(VfhConfig { threshold_low: 3.0, ..VfhConfig::tight(0.2) }).is_err());
    assert!(Vfh::new(VfhConfig { s_max: 0, ..VfhConfig::tight(0.2) }).is_err());
}

#[test]
fn the_thesis_counts_what_stands_behind_the_target_and_we_do_not() {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut cells = vec![0u8; CELLS];
    for i in -4..=4 {
        cells[window.index(1.01, 0.01 + 0.05 * i as f32).unwrap()] = 40;
    }
    let reason = |config| decide(&mut Vfh::new(config).unwrap(), &cells, 0.0, 0.4).0.reason;
    assert_eq!(reason(VfhConfig::tight(RADIUS_M)), Reason::TargetSafe);
    assert_ne!(reason(VfhConfig::thesis()), Reason::TargetSafe);
}

#[test]
fn the_thesis_flies_the_nearest_valley_even_if_it_leads_back() {
    // Everything but straight behind is full of readings.
    let window = Window::around(0.0, 0.0).unwrap();
    let mut cells = vec![0u8; CELLS];
    for k in (0..720).filter(|k| !(340..=380).contains(k)) {
        let a = (k as f32 * 0.5).to_radians();
        cells[window.index(0.7 * a.cos(), 0.7 * a.sin()).unwrap()] = 40;
    }
    let decide = |config| decide(&mut Vfh::new(config).unwrap(), &cells, 0.0, 3.0).0;
    assert_eq!(decide(VfhConfig::tight(RADIUS_M)).reason, Reason::Blocked);
    let thesis = decide(VfhConfig::thesis());
    assert_eq!(thesis.reason, Reason::NarrowValley);
    assert!(thesis.direction_rad.unwrap().abs() > 2.9, "{thesis:?}");
}

#[test]
fn the_speed_of_the_thesis_is_full_in_the_clear_and_three_quarters_at_its_threshold() {
    // V = Vmax (1 - min(h, hm) / hm), hm 8: one reading at distance d has h = 1/2 (5 - 5/81 d) of its own sector.
    let mut cells = vec![0u8; CELLS];
    let window = Window::around(0.01, 0.01).unwrap();
    let speed = |cells: &[u8]| {
        let mut vfh = Vfh::new(VfhConfig { threshold_high: 9.0, threshold_low: 9.0, ..VfhConfig::thesis() });
        decide(vfh.as_mut().unwrap(), cells, 0.0, 3.0).0.speed_m_s
    };
    assert_eq!(speed(&cells), 0.5);
    cells[window.index(1.01, 0.01).unwrap()] = 8;
    let h = 0.5 * (5.0 - 5.0 / 81.0 * 20.0);
    assert!((speed(&cells) - 0.5 * (1.0 - h / 8.0)).abs() < 1e-3);
}
