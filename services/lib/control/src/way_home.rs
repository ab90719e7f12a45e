//! How far home is, through the corridors.

use crate::planar::Vector;
use floorplan::DistanceField;

/// Side of a cell of the way-home grid, metres: a door of 0.9 m is more than three cells wide.
const CELL_M: f32 = 0.25;
/// No way.
const NOWHERE: f32 = f32::INFINITY;

/// Lengths of the shortest ways to the pad for a disc, over the whole plan. All memory is taken at once.
#[derive(Clone, Debug)]
pub struct WayHome {
    origin: Vector,
    width: usize,
    height: usize,
    open: Vec<bool>,
    length_m: Vec<f32>,
    queue: std::collections::VecDeque<u32>,
    queued: Vec<bool>,
    home: Option<Vector>,
    longest_m: f32,
}

impl WayHome {
    /// For a plan that begins at `origin` and is `size` metres wide and high, and a disc that needs
    /// `clearance_m` to the nearest wall.
    #[must_use]
    pub fn new(walls: &DistanceField, origin: Vector, size: Vector, clearance_m: f32) -> Self {
        let cells = |metres: f32| (metres / CELL_M).ceil().clamp(1.0, 2048.0) as usize;
        let (width, height) = (cells(size.x), cells(size.y));
        let mut open = vec![false; width * height];
        for (i, cell) in open.iter_mut().enumerate() {
            let x = origin.x + ((i % width) as f32 + 0.5) * CELL_M;
            let y = origin.y + ((i / width) as f32 + 0.5) * CELL_M;
            *cell = walls.distance(x, y) >= clearance_m;
        }
        Self {
            origin,
            width,
            height,
            length_m: vec![NOWHERE; open.len()],
            queue: std::collections::VecDeque::with_capacity(open.len() + 1),
            queued: vec![false; open.len()],
            open,
            home: None,
            longest_m: 0.0,
        }
    }

    /// Nor does it lead nearer than `clearance_m` to these areas.
    pub fn close(&mut self, zones: &DistanceField, clearance_m: f32) {
        for (i, cell) in self.open.iter_mut().enumerate() {
            let x = self.origin.x + ((i % self.width) as f32 + 0.5) * CELL_M;
            let y = self.origin.y + ((i / self.width) as f32 + 0.5) * CELL_M;
            *cell &= zones.distance(x, y) >= clearance_m;
        }
    }

    fn index(&self, at: Vector) -> Option<usize> {
        let x = ((at.x - self.origin.x) / CELL_M).floor();
        let y = ((at.y - self.origin.y) / CELL_M).floor();
        let inside = x >= 0.0 && y >= 0.0 && (x as usize) < self.width && (y as usize) < self.height;
        inside.then(|| y as usize * self.width + x as usize)
    }

    /// The place that lengths lead to.
    #[must_use]
    pub fn home(&self) -> Option<Vector> {
        self.home
    }

    /// Makes this place home and measures all ways to it: once a flight, no allocation.
    pub fn set_home(&mut self, home: Vector) {
        let Some(start) = self.index(home) else { return };
        self.home = Some(home);
        self.length_m.fill(NOWHERE);
        self.queued.fill(false);
        self.length_m[start] = 0.0;
        self.queue.clear();
        self.queue.push_back(start as u32);
        while let Some(cell) = self.queue.pop_front() {
            let cell = cell as usize;
            self.queued[cell] = false;
            let (x, y) = ((cell % self.width) as i64, (cell / self.width) as i64);
            for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let (nx, ny) = (x + dx, y + dy);
                if nx < 0 || ny < 0 || nx >= self.width as i64 || ny >= self.height as i64 {
                    continue;
                }
                let next = ny as usize * self.width + nx as usize;
                let step = CELL_M * if dx != 0 && dy != 0 { core::f32::consts::SQRT_2 } else { 1.0 };
                let length = self.length_m[cell] + step;
                if self.open[next] && length + 1e-3 < self.length_m[next] {
                    self.length_m[next] = length;
                    if !self.queued[next] {
                        self.queued[next] = true;
                        self.queue.push_back(next as u32);
                    }
                }
            }
        }
        let lengths = self.length_m.iter().filter(|length| length.is_finite());
        self.longest_m = lengths.fold(0.0, |most, length| f32::max(most, *length));
    }

    /// The longest way home from anywhere, metres; `None` without a home.
    #[must_use]
    pub fn longest_m(&self) -> Option<f32> {
        self.home.map(|_| self.longest_m)
    }

    /// Length of the way home from a place, metres; `None` without a home or a way.
    #[must_use]
    pub fn length_m(&self, from: Vector) -> Option<f32> {
        self.home?;
        let cell = self.index(from)?;
        let (x, y) = (cell % self.width, cell / self.width);
        // The disc's own cell may be a closed one when it hugs a wall: its neighbours count too.
        let mut best = self.length_m[cell];
        for ny in y.saturating_sub(1)..=(y + 1).min(self.height - 1) {
            for nx in x.saturating_sub(1)..=(x + 1).min(self.width - 1) {
                best = best.min(self.length_m[ny * self.width + nx] + CELL_M);
            }
        }
        best.is_finite().then_some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use floorplan::Plan;

    #[test]
    fn the_way_leads_through_the_door() {
        // Two rooms of about 3 m; the door is at the top, home at the lower left.
        let rows: Vec<String> = (0..36)
            .map(|row| {
                (0..64)
                    .map(|column| {
                        let border = row == 0 || row == 35 || column == 0 || column == 63;
                        let wall = column == 32 && !(2..14).contains(&row);
                        if border || wall { '#' } else { '.' }
                    })
                    .collect()
            })
            .collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let plan = Plan::from_ascii(&rows, 0.1);
        let walls = DistanceField::new(&plan, 2.0);
        let origin = Vector::new(plan.origin().0, plan.origin().1);
        let mut way = WayHome::new(&walls, origin, Vector::new(6.4, 3.6), 0.3);
        assert_eq!((way.length_m(Vector::new(5.0, 1.0)), way.longest_m()), (None, None));
        way.set_home(origin + Vector::new(1.6, 0.8));
        let from = origin + Vector::new(4.8, 0.8);
        let length = way.length_m(from).unwrap();
        assert!((4.5..7.0).contains(&length), "over the door, not through the wall: {length}");
        assert!(way.length_m(origin + Vector::new(-5.0, 0.0)).is_none());
        assert!((length..10.0).contains(&way.longest_m().unwrap()));
    }
}
