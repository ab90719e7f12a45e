//! Whatever bytes stand in the grids: no panic, no NaN, and never a blocked sector chosen.
#![allow(clippy::unwrap_used, reason = "tests")]

use avoid::grid::{Faded, insert, scroll};
use avoid::potential::{attraction, repulsion};
use avoid::swath::free_length;
use avoid::{Avoider, Beam, CELLS, Echo, GridRules, Histogram, Reason, SECTORS, Situation, Smoothing, Vfh};
use avoid::{PotentialConfig, PotentialField, VfhConfig, Window, sector_of};
use proptest::collection::vec;
use proptest::prelude::*;

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![
        -10.0f32..10.0,
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(f32::NEG_INFINITY),
        Just(f32::MAX),
        Just(0.0)
    ]
}

/// Grids with few and with many cells, so that all kinds of valleys come up.
fn column() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        vec(any::<u8>(), CELLS),
        vec((0usize..CELLS, any::<u8>()), 0..60).prop_map(|marks| {
            let mut cells = vec![0; CELLS];
            for (index, certainty) in marks {
                cells[index] = certainty;
            }
            cells
        }),
        vec(any::<u8>(), 0..100),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_chosen_sector_is_never_blocked(
        steps in vec((column(), column(), any_float(), any_float(), any_float()), 1..4),
        triangle in any::<bool>(),
        straight in any::<bool>(),
        thesis in any::<bool>(),
        s_max in 1usize..40,
    ) {
        let smoothing = if triangle { Smoothing::Triangle } else { Smoothing::Hann };
        let config = if thesis { VfhConfig::thesis() } else { VfhConfig::tight(0.225) };
        let config = VfhConfig { smoothing, straight_at_target: straight, s_max, ..config };
        let mut vfh = Vfh::new(config).unwrap();
        for (cells, walls, target_rad, target_m, max_speed_m_s) in &steps {
            let (mut raw, mut smoothed, mut blocked) = ([f32::NAN; SECTORS], [f32::NAN; SECTORS], [9; SECTORS]);
            let decision = vfh.decide(
                &Situation { cells, walls, target_rad: *target_rad, target_m: *target_m, max_speed_m_s: *max_speed_m_s },
                &mut Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked },
            );
            prop_assert!(raw.iter().chain(&smoothed).all(|h| h.is_finite() && *h >= 0.0));
            prop_assert!(blocked.iter().all(|b| *b <= 1));
            prop_assert!(decision.speed_m_s.is_finite() && decision.speed_m_s >= 0.0);
            if let Some(direction) = decision.direction_rad {
                prop_assert!(direction.is_finite());
                prop_assert_eq!(blocked[sector_of(direction)], 0);
                if max_speed_m_s.is_finite() {
                    prop_assert!(decision.speed_m_s <= max_speed_m_s.max(0.0));
                }
            } else {
                prop_assert_eq!(decision.speed_m_s, 0.0);
                prop_assert!(matches!(decision.reason, Reason::Blocked | Reason::Holding));
            }
        }
    }

    #[test]
    fn a_potential_field_answers_with_a_motion_or_says_that_there_is_none(
        cells in column(), walls in column(), target_rad in any_float(), target_m in any_float(),
        max_speed_m_s in any_float(), radius_m in 0.0f32..0.5, influence_m in 0.1f32..4.0, eta in 0.0f32..100.0,
    ) {
        let config = PotentialConfig { repulsion: eta, influence_m, ..PotentialConfig::flight(radius_m) };
        let mut field = PotentialField::new(config).unwrap();
        let (mut raw, mut smoothed, mut blocked) = ([f32::NAN; SECTORS], [f32::NAN; SECTORS], [9; SECTORS]);
        let decision = field.decide(
            &Situation { cells: &cells, walls: &walls, target_rad, target_m, max_speed_m_s },
            &mut Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked },
        );
        prop_assert!(raw.iter().chain(&smoothed).all(|push| push.is_finite() && *push >= 0.0));
        prop_assert!(blocked.iter().all(|b| *b == 0));
        prop_assert!(decision.speed_m_s.is_finite() && decision.speed_m_s >= 0.0);
        if max_speed_m_s.is_finite() {
            prop_assert!(decision.speed_m_s <= max_speed_m_s.max(0.0));
        }
        match decision.direction_rad {
            Some(direction) => {
                prop_assert!(direction.abs() <= std::f32::consts::PI);
                prop_assert!(matches!(decision.reason, Reason::TargetSafe | Reason::Deflected));
            }
            None => {
                prop_assert_eq!(decision.speed_m_s, 0.0);
                prop_assert!(matches!(decision.reason, Reason::Blocked | Reason::Holding));
            }
        }
    }

    #[test]
    fn the_two_gradients_survive_any_numbers(
        x in any_float(), y in any_float(), eta in any_float(), rho in any_float(), radius in any_float(),
        least in any_float(),
    ) {
        let _ = (attraction(eta, (x, y)), repulsion(eta, rho, radius, least, (x, y)));
        let (px, py) = repulsion(0.002, 0.8, 0.225, 0.05, (x, y));
        prop_assert!(px.is_finite() && py.is_finite(), "{} {}", px, py);
        // Never towards the obstacle.
        prop_assert!(!(x.is_finite() && y.is_finite()) || px * x + py * y <= 0.0);
    }

    #[test]
    fn any_ping_at_any_place_is_survived(
        mut cells in column(), x in any_float(), y in any_float(), angle in any_float(), range in any_float(),
        kind in 0u8..3,
    ) {
        let window = Window::around(1.0, 1.0).unwrap();
        let echo = match kind { 0 => Echo::Obstacle(range), 1 => Echo::Mapped(range), _ => Echo::Silence(range) };
        let before = cells.iter().filter(|c| **c > 0).count();
        insert(&mut cells, &window, &GridRules::default(), &Beam { x_m: x, y_m: y, angle_rad: angle, echo });
        prop_assert!(cells.iter().filter(|c| **c > 0).count() <= before + 1);
        let free = free_length(&cells, &window, (x, y), angle, range, 1.5, 1);
        prop_assert!((0.0..=1.5).contains(&free));
        if let (Some(to), true) = (Window::around(x, y), cells.len() >= CELLS) {
            let mut next = vec![0; CELLS];
            scroll(&cells, &window, &mut next, &to, Faded { far: 1, ..Faded::default() });
        }
    }
}
