//! Straight through doors: where a route squeezes between two walls it comes up to the opening from the front,
//! passes its middle and turns only when it is out. A route cut short at a post costs the clearance that gusts and
//! the error of the pose need; the detour is a few decimetres.

use crate::Costmap;
use floorplan::DistanceField;

/// Openings up to this wide are gates, metres: beyond it there is room to either side anyway.
const WIDEST_M: f32 = 1.4;
/// A route is looked at every so often, metres.
const STEP_M: f32 = 0.05;
/// Narrowest places nearer to each other than this are one gate, metres.
const APART_M: f32 = 0.5;
/// Ways before and behind a gate that are tried, metres: the length of the airframe and the time to brake, less
/// where something stands there.
const LEADS_M: [f32; 3] = [0.65, 0.5, 0.35];
/// What the way up to a gate may be narrower than the gate itself, metres.
const LOSS_M: f32 = 0.04;
/// Angles that an opening is measured at.
const ANGLES: usize = 36;

/// A place or a direction, plan frame.
type Place = (f32, f32);

struct Gate {
    /// How far along the route.
    along: f32,
    middle: Place,
    /// Unit vector through the opening, as the route goes.
    axis: Place,
    half_m: f32,
}

/// The same route, straight through its gates.
pub(crate) fn straightened(map: &Costmap, points: Vec<Place>) -> Vec<Place> {
    let samples = sampled(&points);
    let total = samples.last().map_or(0.0, |sample| sample.1);
    let mut out = points;
    // From the end, so that what lies before keeps its place along the route.
    for gate in gates(map.field(), &samples).iter().rev() {
        let before = LEADS_M.into_iter().find(|lead| open(map, gate, -lead));
        let behind = LEADS_M.into_iter().find(|lead| open(map, gate, *lead));
        let (Some(before), Some(behind)) = (before, behind) else { continue };
        if gate.along < 0.2 || total - gate.along < 0.2 {
            // Begins or ends in the opening: whoever stands there goes as he can.
            continue;
        }
        let at = |lead: f32| (gate.middle.0 + lead * gate.axis.0, gate.middle.1 + lead * gate.axis.1);
        let (head, tail) = split(&out, gate.along - before, gate.along + behind);
        let enters = head.last().is_none_or(|last| clear(map, *last, at(-before), gate.half_m));
        let leaves = tail.first().is_none_or(|first| clear(map, at(behind), *first, gate.half_m));
        if !(enters && leaves) {
            continue;
        }
        let mut next = head;
        if gate.along > before {
            next.push(at(-before));
        }
        next.push(gate.middle);
        if total - gate.along > behind {
            next.push(at(behind));
        }
        next.extend(tail);
        out = next;
    }
    out
}

/// Corners before one place along a line and after another; its two ends are always kept.
fn split(points: &[Place], until: f32, from: f32) -> (Vec<Place>, Vec<Place>) {
    let (mut head, mut tail, mut along) = (Vec::new(), Vec::new(), 0.0);
    for (i, point) in points.iter().enumerate() {
        if let Some(last) = i.checked_sub(1).and_then(|last| points.get(last)) {
            along += (point.0 - last.0).hypot(point.1 - last.1);
        }
        if i == 0 || along < until {
            head.push(*point);
        } else if i + 1 == points.len() || along > from {
            tail.push(*point);
        }
    }
    (head, tail)
}

fn sampled(points: &[Place]) -> Vec<(Place, f32)> {
    let mut samples = Vec::new();
    let mut start = 0.0;
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let count = (length / STEP_M).ceil().max(1.0);
        for k in 0..count as usize {
            let t = k as f32 / count;
            samples.push(((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)), start + t * length));
        }
        start += length;
    }
    samples.extend(points.last().map(|last| (*last, start)));
    samples
}

fn gates(field: &DistanceField, samples: &[(Place, f32)]) -> Vec<Gate> {
    let mut found: Vec<Gate> = Vec::new();
    let clearance: Vec<f32> = samples.iter().map(|((x, y), _)| field.distance(*x, *y)).collect();
    let window = (APART_M / STEP_M) as usize;
    for (i, here) in clearance.iter().enumerate() {
        let around = i.saturating_sub(window)..(i + window + 1).min(clearance.len());
        let least = clearance[around].iter().copied().fold(f32::INFINITY, f32::min);
        if *here > 0.5 * WIDEST_M || *here > least {
            continue;
        }
        let (place, along) = samples[i];
        if found.last().is_some_and(|last| along - last.along < APART_M) {
            continue;
        }
        let Some((middle, across, half_m)) = narrowest(field, place) else { continue };
        let (mut ax, mut ay) = (-across.1, across.0);
        let (from, to) = (samples[i.saturating_sub(6)].0, samples[(i + 6).min(samples.len() - 1)].0);
        if ax * (to.0 - from.0) + ay * (to.1 - from.1) < 0.0 {
            (ax, ay) = (-ax, -ay);
        }
        found.push(Gate { along, middle, axis: (ax, ay), half_m });
    }
    found
}

/// The narrowest opening around a place: its middle, the unit vector across it, half its width.
fn narrowest(field: &DistanceField, place: Place) -> Option<(Place, Place, f32)> {
    let mut middle = place;
    let mut best = None;
    // Each pass measures from the middle of the last: three are enough from anywhere in a door.
    for _ in 0..3 {
        let mut narrow = f32::INFINITY;
        let mut next = middle;
        for k in 0..ANGLES {
            let (sin, cos) = (k as f32 * core::f32::consts::PI / ANGLES as f32).sin_cos();
            let there = way(field, middle, (cos, sin));
            let back = way(field, middle, (-cos, -sin));
            if there + back < narrow {
                narrow = there + back;
                let shift = 0.5 * (there - back);
                next = (middle.0 + shift * cos, middle.1 + shift * sin);
                best = Some(((cos, sin), narrow));
            }
        }
        middle = next;
    }
    best.filter(|(_, wide)| *wide <= WIDEST_M).map(|(across, wide)| (middle, across, 0.5 * wide))
}

/// Free way in a direction, metres, looked at as far as a gate is wide.
fn way(field: &DistanceField, from: Place, along: Place) -> f32 {
    let mut way = 0.0;
    while way < WIDEST_M {
        let free = field.distance(from.0 + way * along.0, from.1 + way * along.1);
        if free < 0.01 {
            return way;
        }
        way += free.max(0.01);
    }
    f32::INFINITY
}

/// Whether the axis of a gate is as open as the gate itself up to a place on it.
fn open(map: &Costmap, gate: &Gate, lead: f32) -> bool {
    let end = (gate.middle.0 + lead * gate.axis.0, gate.middle.1 + lead * gate.axis.1);
    clear(map, gate.middle, end, gate.half_m)
}

fn clear(map: &Costmap, a: Place, b: Place, half_m: f32) -> bool {
    let least = (half_m - LOSS_M).min(map.limits().clearance_m());
    let count = ((b.0 - a.0).hypot(b.1 - a.1) / STEP_M).ceil().max(1.0);
    (0..=count as usize).all(|k| {
        let t = k as f32 / count;
        map.clearance(a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)) >= least
    })
}
