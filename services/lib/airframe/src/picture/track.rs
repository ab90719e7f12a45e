//! What a picture of a flight is drawn from, gathered while it flies.

use crate::world::World;

/// Points of a path are at least this far apart, metres.
const STEP_M: f32 = 0.05;
/// A place counts as close below this clearance, metres.
const CLOSE_M: f32 = 0.4;
/// A close call ends when the clearance has grown by this much again, metres.
const OVER_M: f32 = 0.1;
/// Close calls nearer to each other than this are shown as one, metres.
const APART_M: f32 = 1.0;
/// Shown at most.
const SHOWN: usize = 6;

/// A moment when something was near.
#[derive(Clone, Debug, PartialEq)]
pub struct CloseCall {
    /// World frame.
    pub x: f32,
    /// World frame.
    pub y: f32,
    /// Between the airframe's cylinder and what was near, metres.
    pub clearance: f32,
    /// What was near.
    pub name: String,
    /// Simulated seconds.
    pub time_s: f64,
}

/// Paths and close calls of a flight.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Where the drone was, world frame.
    pub flown: Vec<(f32, f32)>,
    /// Where it believed to be; `None` breaks the line.
    pub believed: Vec<Option<(f32, f32)>>,
    /// Where each person went.
    pub people: Vec<Vec<(f32, f32)>>,
    calls: Vec<CloseCall>,
    open: Option<CloseCall>,
}

impl Track {
    /// Takes one look, at 10 Hz or faster while the drone is in the air. `clearance` is of that moment;
    /// the world is asked what was near only when it was close.
    #[expect(clippy::too_many_arguments, reason = "one look has as many sides")]
    pub fn observe(
        &mut self,
        world: &World,
        time_s: f64,
        place: (f32, f32),
        estimate: Option<(f32, f32)>,
        clearance: f32,
        body: (f32, f32, f32),
        people: impl IntoIterator<Item = (f32, f32)>,
    ) {
        push_apart(&mut self.flown, place);
        match (estimate, self.believed.last()) {
            (None, Some(Some(_))) => self.believed.push(None),
            (Some(next), Some(Some(last))) if apart(next, *last) < STEP_M => {}
            (Some(next), _) => self.believed.push(Some(next)),
            (None, _) => {}
        }
        for (index, person) in people.into_iter().enumerate() {
            if self.people.len() <= index {
                self.people.push(Vec::new());
            }
            push_apart(&mut self.people[index], person);
        }
        let nearer = self.open.as_ref().is_none_or(|call| clearance < call.clearance);
        if clearance < CLOSE_M && nearer {
            // Bottom, height and radius of the airframe's cylinder.
            let (bottom, height, radius) = body;
            let name = world.nearest(place.0, place.1, bottom, height, radius).name.to_owned();
            self.open = Some(CloseCall { x: place.0, y: place.1, clearance, name, time_s });
        } else if self.open.as_ref().is_some_and(|call| clearance > call.clearance + OVER_M) {
            self.calls.extend(self.open.take());
        }
    }

    /// The closest calls, the closest first.
    #[must_use]
    pub fn closest(&self) -> Vec<CloseCall> {
        let mut all: Vec<&CloseCall> = self.calls.iter().chain(&self.open).collect();
        all.sort_by(|a, b| a.clearance.total_cmp(&b.clearance));
        let mut shown: Vec<CloseCall> = Vec::new();
        for call in all {
            if shown.len() < SHOWN && shown.iter().all(|s| apart((s.x, s.y), (call.x, call.y)) > APART_M) {
                shown.push(call.clone());
            }
        }
        shown
    }
}

fn apart(a: (f32, f32), b: (f32, f32)) -> f32 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

fn push_apart(path: &mut Vec<(f32, f32)>, place: (f32, f32)) {
    if path.last().is_none_or(|last| apart(*last, place) >= STEP_M) {
        path.push(place);
    }
}
