//! From echoes to beams on the certainty grid, and what each sonar says last.

use crate::place::Place;
use avoid::{Beam, Echo};
use floorplan::Plan;
use ipc_types::{MAX_SONARS, SonarReading, SonarStatus, seconds_between};

/// Reach that a silent beam speaks for, metres: HC-SR04 class hears to 4 m, and past the window nothing
/// matters anyway.
const SILENT_REACH_M: f32 = 4.0;
/// Farthest believable range, metres.
const LONGEST_RANGE_M: f32 = 10.0;
/// Half of the cone (FACTS 2), radians.
const CONE_HALF_RAD: f32 = 15.0 * core::f32::consts::PI / 180.0;
/// Rays over the cone when asking the plan: 5 degrees apart, 17 cm at the window's edge.
const RAYS: usize = 7;
/// How much a mapped surface may be off, metres: plan 3 cm, half a cell, mount 3 degrees.
const PLAN_TOLERANCE_M: f32 = 0.12;
/// And in proportion to the range: headings are a degree or two off, ranges 1 %.
const RANGE_TOLERANCE: f32 = 0.03;

/// An echo from so far within the airframe's edge is propeller wash, metres: more than ranges and mounts err.
const INSIDE_M: f32 = 0.03;
/// Two pings of a sensor are compared when they lie so far apart, seconds: a sweep, and one that was missed.
const COMPARED_S: core::ops::Range<f32> = 0.05..0.6;

/// Surfaces met at a flatter angle explain nothing, radians: they send no echo back (FACTS 2: 25 to 30 degrees). Mounts and
/// headings err by some degrees, and corners answer a little aslant: at 42 shut doors were seen that stood open. Along a
/// corridor the cones that look ahead would otherwise find every person explained by its walls.
const HEARD_RAD: f32 = 48.0 * core::f32::consts::PI / 180.0;
/// People hurry no faster, metres a second: a larger change of range is another surface.
const FASTEST_M_S: f32 = 2.0;
/// Ranges and places err by less than makes this of a thing that stands, metres a second.
const WALKS_M_S: f32 = 0.25;
/// An approach is of now for so long, seconds: two sweeps.
const FRESH_S: f64 = 0.5;

/// Something comes nearer by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Body frame, radians.
    pub bearing: f32,
    /// From the drone's middle, metres.
    pub distance: f32,
    /// Its own, metres a second.
    pub speed: f32,
    /// How far it has come in a row, metres.
    pub walked: f32,
}

/// The newest word of one sonar.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    ping_ns: u64,
    bearing: f32,
    /// From the drone's middle; infinite without an echo.
    distance: f32,
    /// Where the sensor was, plan frame, metres.
    from: (f32, f32),
    /// How fast it comes nearer by itself, metres a second, and how far it has come in a row, metres.
    own_m_s: f32,
    walked_m: f32,
}

/// What the side sonars said last.
#[derive(Clone, Debug, Default)]
pub struct Senses {
    /// Of the airframe.
    radius_m: f32,
    sides: [Side; MAX_SONARS],
    newest_ns: u64,
}

impl Senses {
    /// For an airframe of this radius: nothing answers from within it.
    #[must_use]
    pub fn new(radius_m: f32) -> Self {
        Self { radius_m, ..Self::default() }
    }

    /// Takes one reading in: the beam for the grid, `None` for the down sonar, faults and nonsense.
    /// `place` is the newest pose; the beam starts where the drone was at the ping.
    pub fn take(&mut self, reading: &SonarReading, place: &Place, plan: &Plan) -> Option<Beam> {
        let mount = [reading.bearing_rad, reading.elevation_rad, reading.mount_x_m, reading.mount_y_m];
        let sane = mount.iter().all(|v| v.is_finite() && v.abs() < 10.0);
        if !sane || reading.looks_down() || reading.ping_ns == 0 || (reading.sensor as usize) >= MAX_SONARS {
            return None;
        }
        let level = reading.elevation_rad.cos();
        let range = match reading.range() {
            Some(range) if range <= LONGEST_RANGE_M => Some(range * level),
            Some(_) => return None,
            None if reading.status == SonarStatus::NoEcho.code() => None,
            None => return None,
        };
        let (sin, cos) = reading.bearing_rad.sin_cos();
        let ahead = reading.mount_x_m * cos + reading.mount_y_m * sin;
        let distance = range.map_or(f32::INFINITY, |range| range + ahead);
        if distance < self.radius_m - INSIDE_M {
            return None;
        }
        let last = self.sides[reading.sensor as usize];
        let since = seconds_between(last.ping_ns, reading.ping_ns) as f32;
        self.sides[reading.sensor as usize] = Side {
            ping_ns: reading.ping_ns,
            bearing: reading.bearing_rad,
            distance,
            from: (0.0, 0.0),
            own_m_s: 0.0,
            walked_m: 0.0,
        };
        self.newest_ns = self.newest_ns.max(reading.ping_ns);

        let then = place.at(reading.ping_ns);
        let (sin, cos) = then.heading.sin_cos();
        let x_m = then.x + reading.mount_x_m * cos - reading.mount_y_m * sin;
        let y_m = then.y + reading.mount_x_m * sin + reading.mount_y_m * cos;
        let angle_rad = avoid::wrap(then.heading + reading.bearing_rad);
        let echo = match range {
            None => Echo::Silence(SILENT_REACH_M),
            // Where on the plan it is, nobody knows yet.
            Some(range) if place.searching => Echo::Obstacle(range),
            Some(range) if mapped(plan, x_m, y_m, angle_rad, range, place.sigma) => Echo::Mapped(range),
            Some(range) => Echo::Obstacle(range),
        };
        let side = &mut self.sides[reading.sensor as usize];
        side.from = (x_m, y_m);
        let thing = matches!(echo, Echo::Obstacle(_));
        if last.ping_ns > 0 && thing && COMPARED_S.contains(&since) {
            let (sin, cos) = angle_rad.sin_cos();
            let flown = (x_m - last.from.0) * cos + (y_m - last.from.1) * sin;
            let own_m_s = (last.distance - side.distance - flown) / since;
            // Faster, or from nowhere, is another surface.
            side.own_m_s = if own_m_s < FASTEST_M_S { own_m_s } else { 0.0 };
            if side.own_m_s > WALKS_M_S {
                side.walked_m = last.walked_m + side.own_m_s * since;
            }
        }
        Some(Beam { x_m, y_m, angle_rad, echo })
    }

    /// Whether any side sonar was heard of within `age_s`.
    #[must_use]
    pub fn fresh(&self, now: u64, age_s: f32) -> bool {
        self.newest_ns > 0 && seconds_between(self.newest_ns, now) <= f64::from(age_s)
    }

    /// What comes nearer by itself: faster than the drone's own motion explains.
    pub fn approaching(&self, now: u64) -> impl Iterator<Item = Approach> {
        let fresh = move |side: &&Side| side.ping_ns > 0 && seconds_between(side.ping_ns, now) <= FRESH_S;
        self.sides.iter().filter(fresh).filter(|side| side.own_m_s > WALKS_M_S).map(|side| Approach {
            bearing: side.bearing,
            distance: side.distance,
            speed: side.own_m_s,
            walked: side.walked_m,
        })
    }

    /// Bearing in the body frame and distance from the drone's middle of everything that a side sonar has
    /// heard within `age_s`.
    pub fn near(&self, now: u64, age_s: f32) -> impl Iterator<Item = (f32, f32)> {
        self.sides.iter().filter_map(move |side| {
            let fresh = side.ping_ns > 0 && seconds_between(side.ping_ns, now) <= f64::from(age_s);
            (fresh && side.distance.is_finite()).then_some((side.bearing, side.distance))
        })
    }
}

/// Whether the plan explains an echo: some part of the cone meets a mapped surface at about this range, or all
/// of it would have met one before.
fn mapped(plan: &Plan, x: f32, y: f32, angle: f32, range: f32, sigma: f32) -> bool {
    let tolerance = PLAN_TOLERANCE_M + RANGE_TOLERANCE * range + sigma.clamp(0.0, 0.15);
    let mut behind = true;
    for ray in 0..RAYS {
        let offset = CONE_HALF_RAD * (2.0 * ray as f32 / (RAYS - 1) as f32 - 1.0);
        match plan.cast_ray(x, y, angle + offset, range + tolerance) {
            Some(hit)
                if hit.range_m >= range - tolerance && (hit.scatters || hit.incidence_rad < HEARD_RAD) =>
            {
                return true;
            }
            Some(hit) if hit.range_m >= range - tolerance => behind = false,
            Some(_) => {}
            None => behind = false,
        }
    }
    behind
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(bearing_deg: f32, range_m: f32) -> SonarReading {
        SonarReading {
            ping_ns: 1_000_000_000,
            range_m,
            bearing_rad: bearing_deg.to_radians(),
            mount_x_m: 0.2 * bearing_deg.to_radians().cos(),
            mount_y_m: 0.2 * bearing_deg.to_radians().sin(),
            sensor: 1,
            status: SonarStatus::Ok.code(),
            ..SonarReading::default()
        }
    }

    fn plan() -> Plan {
        // 0.1 m a character: a wall on the right with a door 0.9 m wide.
        Plan::from_ascii(
            &[
                "                         #",
                "                         #",
                "                         #",
                "                         #",
                "                         #",
                "                          ",
                "                          ",
                "                          ",
                "                          ",
                "                          ",
                "                          ",
                "                          ",
                "                          ",
                "                          ",
                "                         #",
                "                         #",
                "                         #",
                "                         #",
            ],
            0.1,
        )
    }

    fn place(x: f32, y: f32) -> Place {
        Place { stamp_ns: 1_000_000_000, x, y, sigma: 0.03, tracking: true, ..Place::default() }
    }

    #[test]
    fn a_wall_of_the_plan_is_explained_and_a_box_before_it_is_not() {
        let mut senses = Senses::default();
        let beam = senses.take(&reading(0.0, 1.1), &place(1.2, 0.3), &plan()).unwrap();
        assert_eq!(beam.echo, Echo::Mapped(1.1));
        assert!((beam.x_m - 1.4).abs() < 1e-5);
        let beam = senses.take(&reading(0.0, 0.6), &place(1.2, 0.3), &plan()).unwrap();
        assert_eq!(beam.echo, Echo::Obstacle(0.6));
    }

    #[test]
    fn a_shut_door_is_an_obstacle_once_the_jambs_leave_the_cone() {
        let mut senses = Senses::default();
        let beam = senses.take(&reading(0.0, 1.1), &place(1.2, 0.85), &plan()).unwrap();
        assert_eq!(beam.echo, Echo::Obstacle(1.1));
    }

    #[test]
    fn an_echo_from_behind_a_wall_is_no_obstacle() {
        let mut senses = Senses::default();
        let beam = senses.take(&reading(0.0, 1.9), &place(2.0, 0.2), &plan()).unwrap();
        assert_eq!(beam.echo, Echo::Mapped(1.9));
    }

    #[test]
    fn the_beam_starts_where_the_drone_was_at_the_ping() {
        let mut senses = Senses::default();
        let moving = Place { stamp_ns: 1_100_000_000, vx: 0.5, ..place(1.2, 0.85) };
        let beam = senses.take(&reading(90.0, 0.5), &moving, &plan()).unwrap();
        assert!((beam.x_m - 1.15).abs() < 1e-4);
    }

    #[test]
    fn a_cone_along_a_wall_hears_people_and_not_the_wall() {
        // A wall a metre to the right.
        let plan = Plan::from_ascii(&["                         #"; 40], 0.1);
        let heard = |heading_deg: f32, bearing_deg: f32, range_m: f32| {
            let there = Place { heading: heading_deg.to_radians(), ..place(1.6, 2.0) };
            Senses::default().take(&reading(bearing_deg, range_m), &there, &plan).unwrap().echo
        };
        assert_eq!(heard(35.0, -35.0, 0.7), Echo::Mapped(0.7), "square on it is heard");
        assert_eq!(heard(0.0, 35.0, 0.9), Echo::Mapped(0.9), "at 35 degrees it may be");
        assert_eq!(
            heard(30.0, 40.0, 1.5),
            Echo::Obstacle(1.5),
            "from 55 degrees on it is not: somebody is there"
        );
    }

    #[test]
    fn nothing_answers_from_within_the_airframe() {
        let plan = Plan::from_ascii(&["                         "; 25], 0.1);
        let mut senses = Senses::new(0.225);
        let at = |range_m: f32| SonarReading { mount_x_m: 0.06, mount_y_m: 0.0, ..reading(0.0, range_m) };
        // 0.19 m from the middle is under the guards, 0.20 m may be an error of the range.
        assert_eq!(senses.take(&at(0.13), &place(1.2, 1.2), &plan), None);
        assert_eq!(senses.near(1_000_000_000, 0.5).count(), 0);
        let beam = senses.take(&at(0.14), &place(1.2, 1.2), &plan).unwrap();
        assert_eq!(beam.echo, Echo::Obstacle(0.14));
    }

    #[test]
    fn who_walks_up_approaches_and_what_is_flown_up_to_does_not() {
        let plan = Plan::from_ascii(&["                                        "; 25], 0.1);
        let approach = |speed: f32, walk: f32| {
            let mut senses = Senses::new(0.225);
            for i in 0..3u64 {
                let (ns, t) = (1_000_000_000 + i * 240_000_000, 0.24 * i as f32);
                let reading = SonarReading { ping_ns: ns, ..reading(0.0, 1.8 - (speed + walk) * t) };
                let place = Place { stamp_ns: ns, vx: speed, ..place(0.5 + speed * t, 1.2) };
                senses.take(&reading, &place, &plan);
            }
            senses.approaching(1_480_000_000).map(|a| a.speed).next()
        };
        assert_eq!(approach(0.5, 0.0), None);
        assert!((approach(0.3, 0.8).unwrap() - 0.8).abs() < 0.02);
        assert_eq!(approach(0.3, 3.0), None, "another surface");
    }

    #[test]
    fn faults_nonsense_and_the_down_sonar_say_nothing() {
        let mut senses = Senses::default();
        let good = reading(0.0, 0.6);
        for bad in [
            SonarReading { status: SonarStatus::Fault.code(), ..good },
            SonarReading { status: 99, ..good },
            SonarReading { range_m: f32::NAN, ..good },
            SonarReading { range_m: -1.0, ..good },
            SonarReading { range_m: 1e20, ..good },
            SonarReading { bearing_rad: f32::NAN, ..good },
            SonarReading { sensor: 200, ..good },
            SonarReading { ping_ns: 0, ..good },
            SonarReading { elevation_rad: -1.57, ..good },
        ] {
            assert_eq!(senses.take(&bad, &place(1.0, 1.0), &plan()), None, "{bad:?}");
        }
        assert!(!senses.fresh(1_000_000_000, 0.5));
        let silent = SonarReading { status: SonarStatus::NoEcho.code(), range_m: f32::NAN, ..good };
        assert!(senses.take(&silent, &place(1.0, 1.0), &plan()).is_some());
        assert!(senses.fresh(1_400_000_000, 0.5) && !senses.fresh(1_600_000_000, 0.5));
        assert_eq!(senses.near(1_000_000_000, 0.5).count(), 0);
    }
}
