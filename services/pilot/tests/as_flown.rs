//! The shield over the vehicles as they are flown: their sonars, groups and settings.
#![allow(clippy::unwrap_used, reason = "tests")]

use control::{Echo, Footing, Look, Shield, Surroundings, Vector, Wish, wrap_angle};
use pilot::{Craft, PilotConfig};
use runtime::{Cache, Start, load_manifest, parse_config};

const MS: u64 = 1_000_000;
/// Speed of the wishes: cruise.
const CRUISE: f32 = 0.5;
/// The sweep of navigation's heading, degrees and milliseconds (`scan_deg`, `scan_s` in deploy/config/navigation.toml).
const SCAN_DEG: f32 = 8.0;
const SCAN_MS: u64 = 1400;

struct Flown {
    shield: Shield,
    /// Index, axis in the body frame and group of each side sonar.
    sonars: Vec<(usize, f32, u32)>,
    gap_m_s: f32,
    half: f32,
}

fn flown(vehicle: &str) -> Flown {
    let deploy = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy");
    let (mut manifest, root) = load_manifest(&format!("{deploy}/system.toml")).unwrap();
    manifest.system.vehicle = format!("vehicles/{vehicle}.toml");
    let start = Start::new(manifest.system, &root, 1, 0, true, Cache::default()).unwrap();
    let craft = Craft::of(&start);
    let text = std::fs::read_to_string(format!("{deploy}/config/pilot.toml")).unwrap();
    let config: PilotConfig = parse_config("pilot.toml", &text).unwrap();
    let mut shield = Shield::new(config.shield, craft.radius_m, craft.sides.iter().copied());
    shield.set_sweep(0.18);
    let group = |index: usize| start.vehicle.sonars[index].group;
    let sonars = craft.sides.iter().map(|(index, axis, _)| (*index, *axis, group(*index))).collect();
    Flown { shield, sonars, gap_m_s: config.shield.gap_m_s, half: config.shield.cone_half_angle_deg }
}

impl Flown {
    /// Nothing stands around. One ping group each 60 ms from `from` to `until`, with the heading that `heading` gives;
    /// the sonar `dead` never answers.
    fn listen(&mut self, from: u64, until: u64, dead: Option<usize>, heading: impl Fn(u64) -> f32) {
        for (turn, now) in (from..=until).step_by(60 * MS as usize).enumerate() {
            for (index, _, group) in &self.sonars {
                if *group == turn as u32 % 3 && dead != Some(*index) {
                    let look = Look { at_ns: now, heading: heading(now), place: None, echo: Echo::Nothing };
                    assert!(self.shield.hear(*index, look));
                }
            }
        }
    }

    /// What is left of a wish at cruise speed in a direction of the body, degrees, and what would be allowed there.
    fn left(&self, now: u64, heading: f32, degrees: f32) -> (Vector, f32) {
        let wish = Vector::along(heading + degrees.to_radians()) * CRUISE;
        let footing = Footing { place: None, sigma_m: 0.03, heading, velocity: wish, clearance_m: 1.0 };
        let guarded = self.shield.guard(now, Wish::to(wish), &footing, &Surroundings::default());
        (guarded.velocity, guarded.allowed_m_s)
    }

    /// Degrees from a direction of the body to the nearest axis of the sonars but one.
    fn off(&self, degrees: f32, but: Option<usize>) -> f32 {
        let others = self.sonars.iter().filter(|(index, ..)| but != Some(*index));
        others
            .map(|(_, axis, _)| wrap_angle(degrees.to_radians() - axis).abs().to_degrees())
            .fold(f32::INFINITY, f32::min)
    }

    /// The axes beside a sonar's, degrees, and its own between them.
    fn beside(&self, sonar: usize) -> (f32, f32, f32) {
        let axis = self.sonars.iter().find(|(index, ..)| *index == sonar).unwrap().1;
        let turns = self.sonars.iter().filter(|(index, ..)| *index != sonar);
        let turns: Vec<f32> = turns.map(|(_, other, _)| wrap_angle(other - axis).to_degrees()).collect();
        let left = turns.iter().copied().filter(|turn| *turn > 0.0).fold(f32::INFINITY, f32::min);
        let right = turns.iter().copied().filter(|turn| *turn < 0.0).fold(f32::NEG_INFINITY, f32::max);
        (right, axis.to_degrees(), left)
    }
}

const VEHICLES: [&str; 2] = ["watchman", "watchman-sonar"];

#[test]
fn a_dead_sonar_closes_everything_between_its_neighbours_cones() {
    for vehicle in VEHICLES {
        let dead: Vec<usize> = flown(vehicle).sonars.iter().map(|(index, ..)| *index).collect();
        assert_eq!(dead.len(), 8);
        for dead in dead {
            let mut drone = flown(vehicle);
            // The heading sweeps meanwhile: a glance of a neighbour into the hole opens nothing.
            let swept = |now: u64| {
                let phase = (now / MS % SCAN_MS) as f32 / SCAN_MS as f32;
                0.4 + SCAN_DEG.to_radians() * (phase * std::f32::consts::TAU).sin()
            };
            drone.listen(1000 * MS, 4000 * MS, Some(dead), swept);
            let (now, heading) = (4000 * MS, swept(4000 * MS));
            let (right, axis, left) = drone.beside(dead);
            let (right, left) = (right + drone.half, left - drone.half);
            assert!(right < -10.0 && left > 10.0, "{vehicle} {dead}");
            let mut closed = 0;
            for degree in -180..180 {
                let degrees = degree as f32 + 0.5;
                let aside = wrap_angle((degrees - axis).to_radians()).to_degrees();
                let (velocity, allowed) = drone.left(now, heading, degrees);
                if aside > right && aside < left {
                    closed += 1;
                    assert_eq!(
                        allowed, 0.0,
                        "{vehicle}: sonar {dead} is dead and {degrees} degrees are open"
                    );
                } else {
                    assert!(
                        allowed >= drone.gap_m_s.min(CRUISE),
                        "{vehicle}: {dead} dead closes {degrees}: {allowed}"
                    );
                }
                // What is left of it leads out of the hole.
                let out = wrap_angle(velocity.angle() - heading - axis.to_radians()).to_degrees();
                let inside = out > right + 0.1 && out < left - 0.1;
                assert!(
                    velocity.norm() < 1e-3 || !inside,
                    "{vehicle}: {dead} dead, {degrees} turned to {out}"
                );
            }
            assert!((closed as f32 - (left - right)).abs() <= 1.0, "{closed} degrees of {}", left - right);
        }
    }
}

#[test]
fn the_living_layout_flies_everywhere_and_slowly_where_nobody_has_looked() {
    for vehicle in VEHICLES {
        let mut drone = flown(vehicle);
        drone.listen(1000 * MS, 4000 * MS, None, |_| 0.4);
        let (mut gaps, mut open) = (0, 0);
        for degree in -180..180 {
            let degrees = degree as f32 + 0.5;
            let (velocity, allowed) = drone.left(4000 * MS, 0.4, degrees);
            let aside = wrap_angle(velocity.angle() - 0.4 - degrees.to_radians()).abs();
            assert!(aside < 0.01, "{vehicle}: {degrees} is turned aside");
            if drone.off(degrees, None) > drone.half {
                gaps += 1;
                assert!(allowed <= drone.gap_m_s + 1e-3, "{vehicle}: {allowed} m/s unseen at {degrees}");
                assert!(velocity.norm() >= drone.gap_m_s - 1e-3, "{vehicle}: {degrees} is closed");
            } else if drone.off(degrees, None) < drone.half - 3.0 {
                open += 1;
                assert!(velocity.norm() > CRUISE - 1e-3, "{vehicle}: {} at {degrees}", velocity.norm());
            }
        }
        // 5 + 10 + 20 + 25 degrees on each side.
        assert!((118..=122).contains(&gaps) && open > 180, "{vehicle}: {gaps} {open}");
    }
}

#[test]
fn what_the_sweep_of_the_heading_has_looked_at_is_flown_at_speed() {
    let mut drone = flown("watchman");
    let swept = |now: u64| {
        let phase = (now / MS % SCAN_MS) as f32 / SCAN_MS as f32;
        0.4 + SCAN_DEG.to_radians() * (phase * std::f32::consts::TAU).sin()
    };
    drone.listen(1000 * MS, 5000 * MS, None, swept);
    let (now, mut slow) = (5000 * MS, 0);
    for degree in -180..180 {
        let plan = degree as f32 + 0.5;
        // As the body stands now; the middle of the sweep is at 0.4.
        let degrees = plan + (0.4 - swept(now)).to_degrees();
        let beyond = drone.off(plan, None) - drone.half;
        let (velocity, _) = drone.left(now, swept(now), degrees);
        if beyond < SCAN_DEG - 4.0 {
            assert!(velocity.norm() > CRUISE - 1e-3, "{} at {plan}, {beyond} beyond a cone", velocity.norm());
        }
        slow += u32::from(velocity.norm() < CRUISE - 1e-3);
    }
    assert!(slow > 0, "the widest gaps are more than the sweep looks into");
    // Who stands still does not look into them: 1.6 s later a glance is too old.
    drone.listen(5060 * MS, 7000 * MS, None, |_| 0.4);
    assert!(drone.left(7000 * MS, 0.4, 55.0).0.norm() <= drone.gap_m_s + 1e-3);
}
