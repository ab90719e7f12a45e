//! What the side sonars have said: the newest ping of each, and how fast what it hears comes nearer.

use super::{Echo, Look, Shield};
use crate::held::seconds;
use crate::planar::Vector;
use floorplan::DistanceField;

/// An echo from so far within the airframe's edge is none, metres: more than ranges and mounts err.
const INSIDE_M: f32 = 0.03;
/// Older pings than this say nothing of how fast something comes nearer, seconds: three turns of the slowest sweep.
const CLOSING_S: f32 = 0.8;
/// Nothing indoors comes nearer faster than this, m/s: a person who walks, and the drone. What does is another echo.
const FASTEST_M_S: f32 = 2.0;
/// A hit is moved by what was flown since its ping for no longer than this, seconds: as long as one is kept.
const MOVED_S: f32 = 0.6;
/// What was heard from nearer than this, metres, is not gone because one ping or two did not hear it: at the edge of what
/// a face answers to, every third is lost. It is kept for so many pings, and for so long, seconds.
const KEPT_M: f32 = 1.0;
const KEPT_MISSED: u8 = 2;
const KEPT_S: f32 = 0.6;
/// Two echoes in a row that differ by less than this, metres, and what a person walks meanwhile, are of one thing.
const AGREE_M: f32 = 0.1;

/// One side sonar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensor {
    pub(super) bearing: f32,
    pub(super) mount: Vector,
    pub(super) look: Option<Look>,
    /// The echoes before the newest, the newest of them first.
    before: [Option<(u64, f32)>; 2],
    /// The last echo from near.
    kept: Option<Kept>,
    /// Pings that did not hear a wall which it looked squarely at, less those that did.
    missed: u8,
    /// The range that it has said again and again, and where the drone was when it began to.
    still: Option<(f32, Vector)>,
    /// It has said the same while the drone flew towards or away from what it hears.
    stuck: bool,
}

/// An echo from near, and how it was followed.
#[derive(Clone, Copy, Debug)]
struct Kept {
    at_ns: u64,
    heading: f32,
    range: f32,
    /// Another one before it said the same.
    confirmed: bool,
    missed: u8,
}

impl Sensor {
    pub(super) fn new(bearing: f32, mount: Vector) -> Self {
        Self {
            bearing,
            mount,
            look: None,
            before: [None; 2],
            kept: None,
            missed: 0,
            still: None,
            stuck: false,
        }
    }

    fn take(&mut self, look: Look) {
        let last = self.look.and_then(|look| match look.echo {
            Echo::Range(range) => Some((look.at_ns, range)),
            Echo::Nothing => None,
        });
        self.before = [last, self.before[0].filter(|_| last.is_some())];
        self.watch(&look);
        self.keep(&look);
        self.look = Some(look);
    }

    fn keep(&mut self, look: &Look) {
        let before = self.kept.take().filter(|kept| seconds(kept.at_ns, look.at_ns) < KEPT_S);
        self.kept = match look.echo {
            Echo::Range(range) if range < KEPT_M => {
                let agrees = |kept: Kept| {
                    let walked = FASTEST_M_S * seconds(kept.at_ns, look.at_ns);
                    (kept.range - range).abs() < AGREE_M + walked
                };
                let confirmed = before.is_some_and(agrees);
                Some(Kept { at_ns: look.at_ns, heading: look.heading, range, confirmed, missed: 0 })
            }
            _ => before
                .map(|kept| Kept { missed: kept.missed + 1, ..kept })
                .filter(|kept| kept.missed <= KEPT_MISSED),
        };
    }

    /// A range that stays the same while the drone comes nearer to what it is heard from, or leaves it, is no range.
    fn watch(&mut self, look: &Look) {
        let (Echo::Range(range), Some(place)) = (look.echo, look.place) else {
            (self.still, self.stuck) = (None, self.stuck && look.place.is_none());
            return;
        };
        match self.still {
            Some((same, from)) if (range - same).abs() < SAME_M => {
                let along = (place - from).dot(Vector::along(self.bearing + look.heading));
                self.stuck |= along.abs() > MOVED_M;
            }
            _ => (self.still, self.stuck) = (Some((range, place)), false),
        }
    }

    /// Whether it is believed to be deaf, or to say always the same, or to look elsewhere than its mount says.
    pub(super) fn doubted(&self) -> bool {
        self.stuck || self.missed >= DOUBTED
    }

    /// How fast what it hears comes nearer, m/s, by the slower of the last two steps; `None` unless three pings in a row
    /// heard it coming. It needs no estimate of the velocity, which is the weak link (FACTS 8).
    fn closing(&self) -> Option<f32> {
        let (Look { at_ns, echo: Echo::Range(range), .. }, [Some(last), Some(first)]) =
            (self.look?, self.before)
        else {
            return None;
        };
        let rate = |(from_ns, from): (u64, f32), (to_ns, to): (u64, f32)| {
            // Two pings at one moment: endless or no number, and neither lies within.
            let rate = (from - to) / seconds(from_ns, to_ns);
            (rate > 0.0 && rate < FASTEST_M_S).then_some(rate)
        };
        let recent = seconds(first.0, at_ns) < CLOSING_S;
        Some(rate(first, last)?.min(rate(last, (at_ns, range))?)).filter(|_| recent)
    }
}

/// Ranges that differ by less are the same, metres: one quantum (FACTS 2).
const SAME_M: f32 = 0.003_1;
/// Having flown so far along its axis, a sonar must say something else, metres: twice what the place errs by meanwhile.
const MOVED_M: f32 = 0.08;
/// Walls of the plan are expected to answer from nearer than this, metres: from twice as far they do, and half as near it is
/// too late.
const EXPECTED_M: f32 = 1.4;
/// To either side of the axis the wall must stand too, radians (8 degrees), so that no edge and no jamb is expected.
const ASIDE_RAD: f32 = 0.14;
/// Of what the axis hits, the sides may differ by this share.
const EVEN: f32 = 0.15;
/// Cosine of the incidence beyond which no answer is expected (15 degrees; walls answer up to 25, FACTS 2).
const SQUARE: f32 = 0.966;
/// What is heard from so much farther away than the wall was not the wall, metres.
const BEHIND_M: f32 = 0.4;
/// Missed so often, all told, a sonar is doubted: a coat or a lost ping is no reason.
const DOUBTED: u8 = 5;
const MOST_MISSED: u8 = 8;

/// A fresh echo, as it lies now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Plan-frame azimuth of the axis.
    pub(super) axis: f32,
    /// Face of the sensor from the middle of the drone, plan frame, moved by what was flown since.
    pub(super) face: Vector,
    pub(super) range: f32,
    /// The point on the axis, from the middle of the drone.
    pub(super) centre: Vector,
    /// How fast it comes nearer by its echoes alone, m/s.
    pub(super) closing: Option<f32>,
    /// It was heard twice: no outlier.
    pub(super) confirmed: bool,
}

impl Shield {
    /// Takes a ping. Faults and sensors known to be stuck are not to be told: they fall silent. False when
    /// there is no such side sonar or the ping makes no sense.
    pub fn hear(&mut self, sensor: usize, look: Look) -> bool {
        let sane = match look.echo {
            Echo::Range(range) => range > 0.0 && range < 20.0,
            Echo::Nothing => true,
        };
        // Nothing answers from within the airframe: propeller wash.
        let within = |sensor: &Sensor, range: f32| {
            range + sensor.mount.dot(Vector::along(sensor.bearing)) < self.radius_m - INSIDE_M
        };
        match self.sensors.get_mut(sensor) {
            Some(Some(sensor)) if matches!(look.echo, Echo::Range(range) if within(sensor, range)) => sane,
            Some(Some(sensor)) if sane && look.heading.is_finite() => {
                sensor.take(look);
                let cone = self.config.cone_half_angle_deg.to_radians();
                self.glances.look(look.at_ns, sensor.bearing + look.heading, cone);
                if let (Some(place), Echo::Range(range)) = (look.place.and_then(Vector::known), look.echo) {
                    let face = place + sensor.mount.rotated(look.heading);
                    self.remembered.hear(look.at_ns, place, face, sensor.bearing + look.heading, range);
                }
                true
            }
            _ => false,
        }
    }

    /// Compares the newest ping of a sensor with the plan around a place that is sure. A sonar that hears nothing, or what
    /// stands behind, where it looks squarely at a near wall, is doubted before long: nothing else tells a deaf one from an
    /// open room. While it is doubted nobody looks that way.
    pub fn compare(&mut self, sensor: usize, walls: &DistanceField) {
        let Some(Some(sensor)) = self.sensors.get_mut(sensor) else { return };
        let Some(Look { heading, place: Some(place), echo, .. }) = sensor.look else { return };
        let face = place + sensor.mount.rotated(heading);
        let Some(expected) = squarely(walls, face, sensor.bearing + heading) else { return };
        let heard = matches!(echo, Echo::Range(range) if range < expected + BEHIND_M);
        sensor.missed =
            if heard { sensor.missed.saturating_sub(2) } else { (sensor.missed + 1).min(MOST_MISSED) };
    }

    /// Side sonars silent for two of their turns, and side sonars at all.
    #[must_use]
    pub fn silent(&self, now: u64) -> (u32, u32) {
        let all = self.sensors.iter().flatten();
        all.fold((0, 0), |(silent, all), s| (silent + u32::from(self.fresh(s, now).is_none()), all + 1))
    }

    /// How many of the side sonars have not answered for so long, seconds.
    #[must_use]
    pub fn silent_for(&self, now: u64, longer_s: f32) -> u32 {
        let silent = |s: &&Sensor| s.look.is_none_or(|look| seconds(look.at_ns, now) > longer_s);
        self.sensors.iter().flatten().filter(silent).count() as u32
    }

    pub(super) fn fresh(&self, sensor: &Sensor, now: u64) -> Option<Look> {
        sensor.look.filter(|look| seconds(look.at_ns, now) <= self.config.stale_turns * self.sweep_s)
    }

    /// Nearest echo to the disc's edge among fresh readings, metres; infinite without one.
    #[must_use]
    pub fn nearest_m(&self, now: u64) -> f32 {
        let gap = |hit: Hit| hit.centre.norm() - self.radius_m;
        self.hits(now, Vector::ZERO).map(gap).fold(f32::INFINITY, f32::min)
    }

    /// Fresh echoes, where they lie now for a drone that has flown with `flown` since.
    pub(super) fn hits(&self, now: u64, flown: Vector) -> impl Iterator<Item = Hit> + '_ {
        self.sensors.iter().flatten().flat_map(move |sensor| {
            let hit = move |at_ns: u64, heading: f32, range: f32| {
                let axis = sensor.bearing + heading;
                let moved = flown * seconds(at_ns, now).min(MOVED_S);
                let face = sensor.mount.rotated(heading) - moved;
                let centre = face + Vector::along(axis) * range;
                Hit { axis, face, range, centre, closing: None, confirmed: true }
            };
            let fresh = self.fresh(sensor, now).and_then(|look| match look.echo {
                Echo::Range(range) => {
                    let unsure = sensor.kept.is_some_and(|kept| kept.at_ns == look.at_ns && !kept.confirmed);
                    let hit = hit(look.at_ns, look.heading, range);
                    Some(Hit { closing: sensor.closing(), confirmed: !unsure, ..hit })
                }
                Echo::Nothing => None,
            });
            let kept = sensor.kept.filter(|kept| kept.missed > 0 && seconds(kept.at_ns, now) < KEPT_S);
            let kept = kept
                .map(|kept| Hit { confirmed: kept.confirmed, ..hit(kept.at_ns, kept.heading, kept.range) });
            fresh.into_iter().chain(kept)
        })
    }
}

/// Distance to a wall of the plan that a sonar looks squarely at and must hear.
fn squarely(walls: &DistanceField, face: Vector, axis: f32) -> Option<f32> {
    let ahead = way(walls, face, axis)?;
    let along = Vector::along(axis);
    let at = face + along * (ahead - WALL_M);
    let (x, y) = walls.gradient(at.x, at.y);
    let normal = Vector::new(x, y);
    let square = normal.norm() > 0.5 && -normal.dot(along) > SQUARE * normal.norm();
    let even = |side: f32| way(walls, face, axis + side).is_some_and(|w| (w - ahead).abs() < EVEN * ahead);
    (square && even(ASIDE_RAD) && even(-ASIDE_RAD)).then_some(ahead)
}

/// Nearer than this to a wall is at it, metres: a cell of the usual plan.
const WALL_M: f32 = 0.05;

/// Way along a ray to a wall of the plan nearer than [`EXPECTED_M`], by steps as long as the distance field allows.
fn way(walls: &DistanceField, from: Vector, axis: f32) -> Option<f32> {
    let along = Vector::along(axis);
    let mut way = 0.0;
    while way < EXPECTED_M {
        let at = from + along * way;
        let distance = walls.distance(at.x, at.y);
        if distance < WALL_M {
            return Some(way);
        }
        way += distance;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn heard(ranges: &[Option<f32>]) -> Option<f32> {
        let mut sensor = Sensor::new(0.0, Vector::ZERO);
        for (k, range) in ranges.iter().enumerate() {
            let echo = range.map_or(Echo::Nothing, Echo::Range);
            sensor.take(Look { at_ns: 200 * MS * k as u64, heading: 0.0, place: None, echo });
        }
        sensor.closing()
    }

    #[test]
    fn what_comes_nearer_is_seen_to_and_what_jumps_is_not() {
        let closing = heard(&[Some(1.0), Some(0.9), Some(0.84)]);
        assert!((closing.unwrap_or(0.0) - 0.3).abs() < 1e-4, "the slower of the two: {closing:?}");
        assert_eq!(heard(&[Some(1.0), Some(0.9)]), None, "one step is noise");
        assert_eq!(heard(&[Some(1.0), None, Some(0.8), Some(0.7)]), None, "not in a row");
        assert_eq!(heard(&[Some(0.8), Some(0.9), Some(0.8)]), None);
        assert_eq!(heard(&[Some(3.0), Some(0.9), Some(0.8)]), None, "another thing");
        assert_eq!(heard(&[Some(0.8), Some(0.8), Some(0.8)]), None, "what stands does not come");
    }

    #[test]
    fn pings_of_one_moment_and_pings_of_long_ago_say_nothing() {
        let heard = |times_ms: [u64; 3]| {
            let mut sensor = Sensor::new(0.0, Vector::ZERO);
            for (at_ms, range) in times_ms.into_iter().zip([1.0, 0.9, 0.8]) {
                sensor.take(Look { at_ns: at_ms * MS, heading: 0.0, place: None, echo: Echo::Range(range) });
            }
            sensor.closing()
        };
        assert!(heard([0, 350, 700]).is_some() && heard([0, 450, 900]).is_none());
        assert!(heard([0, 0, 200]).is_none() && heard([0, 200, 200]).is_none());
    }

    /// A room of 4 m by 2 m, drawn at 1 cm, whose right wall begins at `face(y)`.
    fn wall(face: impl Fn(f32) -> f32) -> DistanceField {
        let middle = |k: usize| k as f32 * 0.01 + 0.005;
        let cells: Vec<bool> = (0..400 * 200).map(|k| middle(k % 400) > face(middle(k / 400))).collect();
        DistanceField::from_blocked(&cells, 400, 0.01, (0.0, 0.0), 2.0)
    }

    #[test]
    fn a_wall_is_expected_as_far_away_as_it_is_seen_squarely() {
        let walls = wall(|_| 2.0);
        let expected =
            |away: f32, degrees: f32| squarely(&walls, Vector::new(2.0 - away, 1.0), degrees.to_radians());
        for away in [0.3, 0.8, 1.3] {
            let way = expected(away, 0.0).unwrap_or(0.0);
            assert!(way > away - WALL_M - 1e-3 && way < away + 1e-3, "{way} to what is {away} m away");
        }
        assert_eq!(expected(1.5, 0.0), None, "from too far away");
        assert_eq!(expected(0.8, 180.0), None, "the other way");
        // 15 degrees of incidence are the most that must answer (FACTS 2: up to 25 may).
        assert!(expected(0.8, 13.0).is_some() && expected(0.8, -13.0).is_some());
        assert!(expected(0.8, 17.0).is_none() && expected(0.8, -17.0).is_none());
        // Coarse cells leave the field less steep at a face.
        let cells: Vec<bool> = (0..40 * 20).map(|k| k % 40 >= 20).collect();
        let coarse = DistanceField::from_blocked(&cells, 40, 0.1, (0.0, 0.0), 2.0);
        assert!(squarely(&coarse, Vector::new(1.2, 1.0), 0.0).is_some());
    }

    /// The disc of sound at 8 degrees aside is 0.11 m from the axis at 0.8 m: there the wall must stand too, within 15 %.
    #[test]
    fn an_edge_and_a_jamb_are_not_expected() {
        let face = Vector::new(1.2, 1.0);
        for edge in [0.95, 1.05] {
            let open = wall(|y| if (y < edge) == (edge < 1.0) { 3.0 } else { 2.0 });
            assert_eq!(squarely(&open, face, 0.0), None, "nothing on one side of {edge}");
        }
        // The wall steps back beyond y = 1.05 m. A face 1.25 m away expects it while the step is below some 0.19 m.
        let stepped = |back: f32| {
            let walls = wall(|y| if y > 1.05 { 2.0 + back } else { 2.0 });
            squarely(&walls, Vector::new(0.85, 1.0), 0.0)
        };
        let (low, high) = (stepped(0.13), stepped(0.24));
        assert!(low.is_some() && high.is_none(), "{low:?}, {high:?}");
    }
}
