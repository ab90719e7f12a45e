//! What stands where the plan shows nothing: doors that may be shut, and what was heard while the place was sure.
//!
//! The plan shows its doors open. One that is shut sounds like a wall without a door, a metre further on, and draws
//! the set there: an echo from where the set thinks that a door is says nothing of the place.
//!
//! A cupboard beside a drone makes readings too short, and so does the wall of another room beside a drone that is lost.
//! What was first heard from afar, while the other sonars knew the place, is a cupboard: it says nothing of being lost,
//! however often it is heard again (novelty filter: Fox, Burgard and Thrun 1999, which asks how surprising a reading is;
//! this asks whether it has surprised before). It is kept out of the doubt only; the weights have a tail for
//! short readings of their own.

use floorplan::{Door, Plan};
use mcl::{Echo, Estimate, MAX_READINGS, Reading};

/// Side of a cell, metres: a cone is as wide as three of them 1.1 m away.
const CELL_M: f32 = 0.2;
/// Heard so often in a cell, it stands there.
const KNOWN: u8 = 4;
/// Only a set that doubts itself less than this learns what stands where.
const SURE: f32 = 0.02;

/// From where was heard, plan frame, and how much the set doubted it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ear {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) heading: f32,
    pub(crate) p_lost: f32,
}

impl Ear {
    /// Where the set is thought to be, the body's yaw being this, compass frame.
    pub(crate) fn of(e: &Estimate, yaw: f32) -> Self {
        Self { x: e.x, y: e.y, heading: yaw + e.heading_offset, p_lost: e.p_lost }
    }
}

/// An echo so near to the line between a door's posts comes from the door, metres: half a cone 1.1 m away.
const DOOR_M: f32 = 0.3;
/// Shorter by so much than the plan has it with the door open, metres.
const SHORT_M: f32 = 0.3;

/// A raster over the plan: how often something unmapped was heard; and the doors.
#[derive(Debug)]
pub(crate) struct Clutter {
    origin: (f32, f32),
    columns: usize,
    rows: usize,
    heard: Vec<u8>,
    doors: Vec<Door>,
}

impl Clutter {
    /// Nothing heard yet. Allocates here and nowhere else.
    pub(crate) fn new(plan: &Plan, doors: Vec<Door>) -> Self {
        let cells = |length: usize| (length as f32 * plan.resolution() / CELL_M).ceil().max(1.0) as usize;
        let (columns, rows) = (cells(plan.width()), cells(plan.height()));
        Self { origin: plan.origin(), columns, rows, heard: vec![0; columns * rows], doors }
    }

    /// Bit i: what reading i hears, from where the set is thought to be, was heard there before.
    pub(crate) fn familiar(&self, readings: &[Reading], ear: &Ear) -> u32 {
        heard_at(readings, ear)
            .filter(|(_, x, y)| self.around(*x, *y).any(|cell| self.heard[cell] >= KNOWN))
            .fold(0, |familiar, (i, ..)| familiar | 1 << i)
    }

    /// Bit i: reading i comes from a door, where it is shorter than the plan has it: `expected` of a place and direction.
    pub(crate) fn doors(
        &self,
        readings: &[Reading],
        ear: &Ear,
        expected: impl Fn(f32, f32, f32) -> f32,
    ) -> u32 {
        let echoes = heard_at(readings, ear).filter(|(i, x, y)| {
            let angle = ear.heading + readings[*i].bearing_rad;
            let Echo::Range(range) = readings[*i].echo else { return false };
            self.doors.iter().any(|door| door.distance(*x, *y) < DOOR_M)
                && range + SHORT_M < expected(x - range * angle.cos(), y - range * angle.sin(), angle)
        });
        echoes.fold(0, |doors, (i, ..)| doors | 1 << i)
    }

    /// Learns from the readings that were too short (bit i: reading i), if the set is sure of its place.
    pub(crate) fn learn(&mut self, readings: &[Reading], ear: &Ear, short: u32) {
        if ear.p_lost >= SURE {
            return;
        }
        for (_, x, y) in heard_at(readings, ear).filter(|(i, ..)| short >> i & 1 == 1) {
            if let Some(heard) = self.cell(x, y, 0, 0).and_then(|cell| self.heard.get_mut(cell)) {
                *heard = heard.saturating_add(1);
            }
        }
    }

    /// The cell of a place, or the one so many columns and rows on.
    fn cell(&self, x: f32, y: f32, right: isize, up: isize) -> Option<usize> {
        let at = |v: f32, from: f32, on: isize, cells: usize| {
            let cell = ((v - from) / CELL_M).floor();
            let cell = (cell.abs() < 1e6).then_some(cell as isize + on)?;
            usize::try_from(cell).ok().filter(|cell| *cell < cells)
        };
        let column = at(x, self.origin.0, right, self.columns)?;
        Some(at(y, self.origin.1, up, self.rows)? * self.columns + column)
    }

    fn around(&self, x: f32, y: f32) -> impl Iterator<Item = usize> {
        (-1..=1).flat_map(move |up| (-1..=1).filter_map(move |right| self.cell(x, y, right, up)))
    }
}

/// Where each echo comes from if it comes from the middle of its cone, plan frame, with its index.
fn heard_at(readings: &[Reading], ear: &Ear) -> impl Iterator<Item = (usize, f32, f32)> {
    let Ear { x, y, heading, .. } = *ear;
    let (sin, cos) = heading.sin_cos();
    readings.iter().take(MAX_READINGS).enumerate().filter_map(move |(i, r)| {
        let Echo::Range(range) = r.echo else { return None };
        let (axis_sin, axis_cos) = (heading + r.bearing_rad).sin_cos();
        Some((
            i,
            x + cos * r.mount_x - sin * r.mount_y + range * axis_cos,
            y + sin * r.mount_x + cos * r.mount_y + range * axis_sin,
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(range: f32, bearing_rad: f32) -> Reading {
        Reading { echo: Echo::Range(range), bearing_rad, elevation_rad: 0.0, mount_x: 0.0, mount_y: 0.0 }
    }

    fn room() -> Clutter {
        Clutter::new(&Plan::from_ascii(&["                    "; 20], 0.25), Vec::new())
    }

    fn at(x: f32, y: f32, heading: f32, p_lost: f32) -> Ear {
        Ear { x, y, heading, p_lost }
    }

    #[test]
    fn what_was_heard_while_the_place_was_sure_is_familiar_from_elsewhere_too() {
        let mut clutter = room();
        let east = [reading(1.0, 0.0), reading(1.0, 1.57)];
        for _ in 0..KNOWN {
            assert_eq!(clutter.familiar(&east, &at(2.0, 2.0, 0.0, 0.01)), 0);
            clutter.learn(&east, &at(2.0, 2.0, 0.0, 0.01), 0b01);
        }
        assert_eq!(clutter.familiar(&east, &at(2.0, 2.0, 0.0, 0.01)), 0b01, "the other was not too short");
        // From the north, looking south past a turned body, and once the set doubts itself too.
        assert_eq!(clutter.familiar(&[reading(1.5, 0.3)], &at(3.0, 3.5, -1.87, 0.9)), 1);
        assert_eq!(
            clutter.familiar(&[reading(0.5, 0.3)], &at(3.0, 3.5, -1.87, 0.9)),
            0,
            "nearer stands nothing"
        );
    }

    #[test]
    fn an_echo_from_a_door_that_the_plan_has_open_says_nothing() {
        let clutter =
            Clutter { doors: vec![Door { name: String::new(), a: (3.0, 1.5), b: (3.0, 2.4) }], ..room() };
        let heard = |range: f32, expected: f32| {
            clutter.doors(&[reading(range, 0.0)], &at(2.0, 2.0, 0.0, 0.0), |x, y, angle| {
                assert!((x - 2.0).abs() < 1e-5 && (y - 2.0).abs() < 1e-5 && angle == 0.0);
                expected
            })
        };
        assert_eq!(heard(1.0, 3.0), 1);
        assert_eq!(heard(1.0, f32::INFINITY), 1);
        assert_eq!(heard(1.0, 1.1), 0, "the plan has it there: a post");
        assert_eq!(heard(0.5, 3.0), 0, "before the door");
        assert_eq!(heard(2.0, 3.0), 0, "behind the door");
    }

    #[test]
    fn who_may_be_lost_learns_nothing_and_nonsense_stands_nowhere() {
        let mut clutter = room();
        for _ in 0..100 {
            clutter.learn(&[reading(1.0, 0.0)], &at(2.0, 2.0, 0.0, 0.1), 1);
            clutter.learn(&[reading(f32::NAN, 0.0)], &at(2.0, 2.0, 0.0, 0.0), 1);
            clutter.learn(&[reading(9.0, 0.0)], &at(2.0, 2.0, 0.0, 0.0), 1);
        }
        assert!(clutter.heard.iter().all(|heard| *heard == 0));
    }
}
