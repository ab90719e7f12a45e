//! The shield over a drawn building and over arbitrary readings.
#![allow(clippy::unwrap_used, reason = "tests")]

mod anything;
mod creep;
mod listening;
mod plan;
mod retreat;
mod trust;
mod wishes;

use control::{Echo, Footing, GridView, Look, Shield, ShieldConfig, Surroundings, Vector, Wish};
use floorplan::{DistanceField, Plan};
use std::f32::consts::{FRAC_PI_4, PI};

const RADIUS: f32 = 0.225;
const MOUNT: f32 = 0.21;
const MS: u64 = 1_000_000;

fn eight() -> Shield {
    eight_with(ShieldConfig::default())
}

fn eight_with(config: ShieldConfig) -> Shield {
    let sonars = (0..8).map(|k| {
        let bearing = k as f32 * FRAC_PI_4;
        (k, bearing, Vector::along(bearing) * MOUNT)
    });
    Shield::new(config, RADIUS, sonars)
}

/// All eight ping at `now`: these hear something at this range, the others nothing.
fn ping(shield: &mut Shield, now: u64, echoes: &[(usize, f32)]) {
    for k in 0..8 {
        let echo = echoes.iter().find(|echo| echo.0 == k).map_or(Echo::Nothing, |echo| Echo::Range(echo.1));
        assert!(shield.hear(k, Look { at_ns: now, heading: 0.0, place: None, echo }));
    }
}

/// Range of an echo that leaves this gap between the thing and the disc's edge, metres.
fn range(gap: f32) -> f32 {
    gap + RADIUS - MOUNT
}

fn at(place: Vector) -> Footing {
    Footing { place: Some(place), sigma_m: 0.03, heading: 0.0, velocity: Vector::ZERO, clearance_m: 1.0 }
}

/// High above the ground, and nobody knows where.
fn somewhere() -> Footing {
    Footing { place: None, sigma_m: 9.0, ..at(Vector::ZERO) }
}

fn among(walls: &DistanceField) -> Surroundings<'_> {
    Surroundings { walls: Some(walls), zones: None }
}

fn to(x: f32, y: f32) -> Wish {
    Wish::to(Vector::new(x, y))
}

/// A wall with a door of 0.9 m, 0.2 m thick, between two rooms. 0.1 m a character.
fn door() -> Plan {
    let rows: Vec<String> = (0..40)
        .map(|row| {
            (0..60)
                .map(|column| {
                    let border = row == 0 || row == 39 || column == 0 || column == 59;
                    let wall = (30..32).contains(&column) && !(16..25).contains(&row);
                    if border || wall { '#' } else { '.' }
                })
                .collect()
        })
        .collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    Plan::from_ascii(&rows, 0.1)
}

/// The nearest echo of a cone of seven rays that a wall sends back, or nothing.
fn cone(plan: &Plan, place: Vector, bearing: f32) -> Echo {
    let face = place + Vector::along(bearing) * MOUNT;
    let mut nearest = f32::INFINITY;
    for ray in -3..=3 {
        let angle = bearing + ray as f32 * 5f32.to_radians();
        if let Some(hit) = plan.cast_ray(face.x, face.y, angle, 4.0)
            && hit.incidence_rad.abs() < 0.5
        {
            nearest = nearest.min(hit.range_m);
        }
    }
    if nearest.is_finite() { Echo::Range(nearest) } else { Echo::Nothing }
}

/// Flies at a door, obeying the shield at once; side sonars in opposite pairs, 60 ms each.
fn through(start: Vector, wish: Vector, seconds: f32) -> (Vector, f32, f32) {
    let plan = door();
    let walls = DistanceField::new(&plan, 2.0);
    let origin = Vector::new(plan.origin().0, plan.origin().1);
    let mut shield = eight();
    shield.set_sweep(0.24);
    let mut place = origin + start;
    let (mut least, mut slowest) = (f32::INFINITY, f32::INFINITY);
    for step in 0..(seconds / 0.02) as u64 {
        let now = 1_000_000_000 + step * 20_000_000;
        if step % 3 == 0 {
            let pair = (step / 3 % 4) as usize;
            for sensor in [pair, pair + 4] {
                let echo = cone(&plan, place, sensor as f32 * FRAC_PI_4);
                assert!(shield.hear(sensor, Look { at_ns: now, heading: 0.0, place: Some(place), echo }));
            }
        }
        let guarded =
            shield.guard(now, Wish::to(wish), &Footing { velocity: wish, ..at(place) }, &among(&walls));
        place += guarded.velocity * 0.02;
        least = least.min(walls.distance(place.x, place.y) - RADIUS);
        if step > 20 && (place.x - origin.x) < 4.0 {
            slowest = slowest.min(guarded.velocity.x);
        }
    }
    (place - origin, least, slowest)
}

#[test]
fn a_centred_drone_passes_a_door_of_0_9_m() {
    let (place, least, slowest) = through(Vector::new(1.5, 1.95), Vector::new(0.5, 0.0), 12.0);
    assert!(place.x > 4.0, "stuck at {place:?}");
    assert!(slowest >= 0.2, "slowest {slowest}");
    // Nobody steers here: readings that come one after the other wag it by some centimetres.
    assert!(least > 0.08, "{least}");
}

#[test]
fn a_drone_that_is_off_the_middle_is_centred_on_the_way() {
    for offset in [-0.12, -0.06, 0.06, 0.12] {
        let (place, least, _) = through(Vector::new(1.5, 1.95 + offset), Vector::new(0.4, 0.0), 20.0);
        assert!(place.x > 4.0, "offset {offset}: stuck at {place:?}");
        assert!(least > 0.06, "offset {offset}: {least}");
    }
}

#[test]
fn no_wish_leads_into_a_wall() {
    for k in 0..24 {
        let wish = Vector::along(k as f32 * PI / 12.0) * 0.8;
        let (place, least, _) = through(Vector::new(1.6, 1.0), wish, 12.0);
        assert!(least > 0.0, "direction {k}: {least} at {place:?}");
    }
}

#[test]
fn no_sensor_looking_that_way_no_motion_that_way() {
    let mut shield = eight();
    let now = 10_000_000_000;
    for k in 0..8 {
        if k != 2 {
            shield.hear(k, Look { at_ns: now, heading: 0.0, place: None, echo: Echo::Nothing });
        }
    }
    assert_eq!(shield.silent(now), (1, 8));
    let footing = Footing { clearance_m: 0.0, ..somewhere() };
    let left = shield.guard(now, to(0.0, 0.5), &footing, &Surroundings::default());
    assert_eq!(left.allowed_m_s, 0.0);
    // What is left is turned out of the closed sector, 17 degrees on either side of the dead sensor.
    assert!(left.velocity.angle() < 75f32.to_radians() || left.velocity.angle() > 105f32.to_radians());
    let ahead = shield.guard(now, to(0.5, 0.0), &footing, &Surroundings::default());
    assert!(ahead.velocity.x > 0.45 && !ahead.limited);
    // Two turns later nobody has looked anywhere.
    let later = shield.guard(now + 500_000_000, to(0.5, 0.0), &footing, &Surroundings::default());
    assert_eq!(later.velocity, Vector::ZERO);
    assert_eq!(shield.silent(now + 500_000_000), (8, 8));
}

#[test]
fn the_plan_stops_what_no_echo_shows() {
    // A glass wall: the plan has it, the sonars hear nothing.
    let plan = door();
    let walls = DistanceField::new(&plan, 2.0);
    let origin = Vector::new(plan.origin().0, plan.origin().1);
    let mut shield = eight();
    let mut place = origin + Vector::new(1.5, 1.0);
    for step in 0..600u64 {
        let now = step * 20_000_000;
        for k in 0..8 {
            shield.hear(k, Look { at_ns: now, heading: 0.0, place: None, echo: Echo::Nothing });
        }
        place += shield.guard(now, to(0.6, 0.0), &at(place), &among(&walls)).velocity * 0.02;
    }
    let gap = walls.distance(place.x, place.y);
    assert!(gap > RADIUS, "{gap}");
}

#[test]
fn no_wish_leads_into_a_no_fly_zone_and_who_is_in_one_comes_out() {
    // The right half of a room of 6 m; a wide gap to it, and nothing that a sonar could hear.
    let zone: Vec<bool> = (0..40 * 60).map(|cell| cell % 60 >= 30).collect();
    let zones = DistanceField::from_blocked(&zone, 60, 0.1, (0.0, 0.0), 2.0);
    let plan = Surroundings { walls: None, zones: Some(&zones) };
    let mut shield = eight();
    let mut fly = |from: Vector, wish: Wish, seconds: u64| {
        let mut place = from;
        let mut velocity = Vector::ZERO;
        for step in 0..seconds * 50 {
            let now = step * 20_000_000;
            for k in 0..8 {
                shield.hear(k, Look { at_ns: now, heading: 0.0, place: None, echo: Echo::Nothing });
            }
            velocity = shield.guard(now, wish, &Footing { velocity, ..at(place) }, &plan).velocity;
            place += velocity * 0.02;
        }
        place
    };
    for (direction, wish) in [to(0.6, 0.0), to(0.5, 0.3), to(0.2, -0.1)].into_iter().enumerate() {
        let end = fly(Vector::new(1.5, 2.0), wish, 20);
        assert!(end.x < 3.0 - RADIUS && end.x > 2.0, "direction {direction} ends at {end:?}");
    }
    // Carried over the border by a gust: back, whatever is wished.
    let end = fly(Vector::new(2.95, 2.0), to(0.5, 0.0), 10);
    assert!(end.x < 3.0 - RADIUS, "{end:?}");
    // Nobody knows where: a zone means nothing.
    let nowhere = shield_at_rest().guard(0, to(0.4, 0.0), &somewhere(), &plan);
    assert!(nowhere.velocity.x > 0.35);
}

fn shield_at_rest() -> Shield {
    let mut shield = eight();
    for k in 0..8 {
        shield.hear(k, Look { at_ns: 0, heading: 0.0, place: None, echo: Echo::Nothing });
    }
    shield
}

#[test]
fn near_things_push_and_a_person_ahead_stops() {
    let mut shield = eight();
    let (footing, low) = (somewhere(), Footing { clearance_m: 0.0, ..somewhere() });
    let mut still = |at_ns: u64, range: f32, footing: &Footing| {
        for k in 0..8 {
            let echo = if k == 0 { Echo::Range(range) } else { Echo::Nothing };
            shield.hear(k, Look { at_ns, heading: 0.0, place: None, echo });
        }
        (shield.guard(at_ns, to(0.0, 0.0), footing, &Surroundings::default()).velocity, shield.clone())
    };
    assert_eq!(still(0, 0.15, &footing).0, Vector::ZERO, "heard once it may be an outlier");
    assert_eq!(still(200_000_000, 0.8, &footing).0, Vector::ZERO, "and what jumps is another thing");
    assert_eq!(still(400_000_000, 0.15, &low).0, Vector::ZERO, "near the floor it may be the floor");
    let (pushed, shield) = still(600_000_000, 0.15, &footing);
    assert!(pushed.x < -0.01 && pushed.x >= -0.2 && pushed.y.abs() < 1e-6, "{pushed:?}");
    let ahead = shield.guard(600_000_000, to(0.5, 0.0), &low, &Surroundings::default()).velocity;
    assert!(shield.braking().distance(ahead.x) <= 0.15 + MOUNT - RADIUS);
}

/// A face that is looked at askance loses every third ping; one that is gone is heard through three times.
#[test]
fn a_near_thing_outlives_two_lost_pings_and_not_three() {
    let mut shield = eight();
    let turn = 180_000_000;
    shield.set_sweep(0.18);
    for (k, (heard, stands)) in [
        (true, true),
        (true, true),
        (false, true),
        (true, true),
        (false, true),
        (false, true),
        (false, false),
    ]
    .into_iter()
    .enumerate()
    {
        let now = k as u64 * turn;
        for sonar in 0..8 {
            let echo = if heard && sonar == 0 { Echo::Range(0.4) } else { Echo::Nothing };
            shield.hear(sonar, Look { at_ns: now, heading: 0.0, place: None, echo });
        }
        let free = shield.free_way(now, Vector::new(1.0, 0.0), &somewhere());
        assert_eq!(free < 1.0, stands, "ping {k}: {free}");
    }
}

#[test]
fn a_box_that_stopped_answering_is_still_there() {
    let mut shield = eight();
    let footing = at(Vector::ZERO);
    for turn in 0..2u64 {
        for k in 0..8 {
            let echo = if k == 0 { Echo::Range(0.4) } else { Echo::Nothing };
            shield.hear(k, Look { at_ns: turn * 240 * MS, heading: 0.0, place: Some(Vector::ZERO), echo });
        }
    }
    // Turned by 20 degrees: the face sends the ping elsewhere.
    let footing = Footing { heading: 0.35, ..footing };
    let now = 720 * MS;
    for k in 0..8 {
        let look = Look { at_ns: now, heading: 0.35, place: Some(Vector::ZERO), echo: Echo::Nothing };
        shield.hear(k, look);
    }
    let left = shield.guard(now, to(0.5, 0.0), &footing, &Surroundings::default());
    assert!(shield.braking().distance(left.velocity.x) <= 0.61 - RADIUS, "{:?}", left.velocity);
    let aside = shield.guard(now, to(0.0, 0.5), &footing, &Surroundings::default());
    assert!(aside.velocity.y > 0.45);
    let later = shield.guard(now + 200 * MS, to(0.5, 0.0), &footing, &Surroundings::default());
    assert!(later.velocity.x < 0.45);
}

/// Nothing stands around, by the sonars.
fn heard_nothing(now: u64) -> Shield {
    let mut shield = eight();
    for k in 0..8 {
        shield.hear(k, Look { at_ns: now, heading: 0.0, place: None, echo: Echo::Nothing });
    }
    shield
}

#[test]
fn what_the_grid_holds_stops_and_is_forgotten_with_the_place() {
    let mut cells = [0u8; 41 * 41];
    // The drone stands in the middle of cell (20, 20); a pole 0.6 m ahead.
    cells[20 * 41 + 32] = 5;
    let grid = GridView { origin: Vector::new(-1.025, -1.025), cell_m: 0.05, side: 41, cells: &cells };
    let mut shield = heard_nothing(0);
    let ahead = |shield: &Shield| shield.guard(0, to(0.5, 0.0), &at(Vector::ZERO), &Surroundings::default());
    assert!(ahead(&shield).velocity.x > 0.45);
    shield.see(0, Vector::ZERO, &grid);
    let left = ahead(&shield).velocity.x;
    assert!(left < 0.35 && shield.braking().distance(left) <= 0.6 - RADIUS, "{left}");
    // Nobody knows where it is: nor where the pole is.
    let lost = shield.guard(0, to(0.5, 0.0), &somewhere(), &Surroundings::default());
    assert!(lost.velocity.x > 0.45);
    shield.forget();
    assert!(ahead(&shield).velocity.x > 0.45);
}

#[test]
fn what_comes_late_costs_speed() {
    let mut shield = heard_nothing(0);
    shield.hear(0, Look { at_ns: 0, heading: 0.0, place: None, echo: Echo::Range(1.0) });
    let allowed = |shield: &Shield| {
        shield.guard(0, to(1.0, 0.0), &at(Vector::ZERO), &Surroundings::default()).allowed_m_s
    };
    let (before, in_time) = (shield.braking().delay_s, allowed(&shield));
    shield.set_delay(0.4);
    assert!((shield.braking().delay_s - before - 0.4).abs() < 1e-6);
    assert!(allowed(&shield) < 0.85 * in_time && allowed(&shield) > 0.0);
    // A delay that is no number is the longest.
    shield.set_delay(f32::NAN);
    assert!(shield.braking().delay_s > before + 1.9);
}

#[test]
fn every_number_of_the_shield_has_bounds_and_who_leaves_them_is_told() {
    type Set = fn(&mut ShieldConfig, f32);
    let numbers: [(&str, Set); 24] = [
        ("margin_m", |c, v| c.margin_m = v),
        ("standoff_m", |c, v| c.standoff_m = v),
        ("near_m", |c, v| c.near_m = v),
        ("push_gain_per_s", |c, v| c.push_gain_per_s = v),
        ("max_push_m_s", |c, v| c.max_push_m_s = v),
        ("max_brake_m_s", |c, v| c.max_brake_m_s = v),
        ("beside_m_s", |c, v| c.beside_m_s = v),
        ("beside_gain_per_s", |c, v| c.beside_gain_per_s = v),
        ("look_half_angle_deg", |c, v| c.look_half_angle_deg = v),
        ("gap_m_s", |c, v| c.gap_m_s = v),
        ("glance_s", |c, v| c.glance_s = v),
        ("cone_half_angle_deg", |c, v| c.cone_half_angle_deg = v),
        ("reaction_s", |c, v| c.reaction_s = v),
        ("deceleration_m_s2", |c, v| c.deceleration_m_s2 = v),
        ("stale_turns", |c, v| c.stale_turns = v),
        ("plan_margin_m", |c, v| c.plan_margin_m = v),
        ("creep_m_s", |c, v| c.creep_m_s = v),
        ("plan_near_m", |c, v| c.plan_near_m = v),
        ("zone_margin_m", |c, v| c.zone_margin_m = v),
        ("plan_overlap_m", |c, v| c.plan_overlap_m = v),
        ("margin_m", |c, _| c.margin_m = f32::NAN),
        ("near_m", |c, _| c.near_m = f32::INFINITY),
        ("grid_stands", |c, _| c.grid_stands = 0),
        ("reaction_s", |c, _| c.reaction_s = 0.1),
    ];
    for (name, set) in numbers {
        for wrong in [-1.0, 1e9] {
            let mut config = ShieldConfig::default();
            set(&mut config, wrong);
            let error = config.validate().unwrap_err().to_string();
            assert!(error.contains(&format!("shield.{name}")), "{name} = {wrong}: {error}");
        }
    }
    assert!(ShieldConfig::default().validate().is_ok());
}
