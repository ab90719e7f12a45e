//! Whatever bytes stand in the grids: no panic, no NaN, and never a blocked sector chosen.
#![allow(clippy::unwrap_used, reason = "tests")]

use avoid::grid::{Faded, insert, scroll};
use avoid::swath::free_length;
use avoid::{Avoider, Beam, CELLS, Echo, GridRules, Histogram, Reason, SECTORS, Situation, Smoothing, Vfh};
use avoid::{VfhConfig, Window, sector_of};
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
        s_max in 1usize..40,
    ) {
        let smoothing = if triangle { Smoothing::Triangle } else { Smoothing::Hann };
        let config = VfhConfig { smoothing, straight_at_target: straight, s_max, ..VfhConfig::tight(0.225) };
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
