//! The Cartesian Histogram Grid: a window of certainty that moves with the drone in whole cells.

use core::f32::consts::PI;

/// Cells along each side (thesis 3.1: 81, so that the drone has a cell of its own in the middle).
pub const SIDE: usize = 81;
/// Cells in all.
pub const CELLS: usize = SIDE * SIDE;
/// Side of a cell, metres (thesis 3.1).
pub const CELL_M: f32 = 0.05;
/// Cells on either side of the drone's own: 40 cells reach 2 m.
pub const HALF: usize = SIDE / 2;
/// Reach of the window along its axes, metres.
pub const REACH_M: f32 = HALF as f32 * CELL_M;

/// How far from the plan's origin a place may be, metres: keeps cell numbers far from overflow.
const FARTHEST_M: f32 = 50_000.0;

/// Where the grid lies: cell numbers of its lower left corner on the raster of 5 cm through the plan frame's
/// origin. Contents keep their place in the building while the window moves over them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    column: i32,
    row: i32,
}

impl Window {
    /// The window whose middle cell holds (x, y); `None` for places that are not finite or absurdly far.
    #[must_use]
    pub fn around(x: f32, y: f32) -> Option<Self> {
        let cell = |v: f32| {
            (v.is_finite() && v.abs() <= FARTHEST_M).then(|| (v / CELL_M).floor() as i32 - HALF as i32)
        };
        Some(Self { column: cell(x)?, row: cell(y)? })
    }

    /// The window with this lower left corner, metres; `None` when no window has it.
    #[must_use]
    pub fn from_origin(x: f32, y: f32) -> Option<Self> {
        if !(x.is_finite() && y.is_finite() && x.abs() <= FARTHEST_M && y.abs() <= FARTHEST_M) {
            return None;
        }
        Some(Self { column: (x / CELL_M).round() as i32, row: (y / CELL_M).round() as i32 })
    }

    /// Lower left corner, plan frame, metres.
    #[must_use]
    pub fn origin(&self) -> (f32, f32) {
        (self.column as f32 * CELL_M, self.row as f32 * CELL_M)
    }

    /// Index of the cell that holds (x, y); `None` outside the window.
    #[must_use]
    pub fn index(&self, x: f32, y: f32) -> Option<usize> {
        let (ox, oy) = self.origin();
        let column = ((x - ox) / CELL_M).floor();
        let row = ((y - oy) / CELL_M).floor();
        let inside = |v: f32| (0.0..SIDE as f32).contains(&v);
        (inside(column) && inside(row)).then(|| row as usize * SIDE + column as usize)
    }

    /// Centre of a cell, plan frame, metres.
    #[must_use]
    pub fn centre(&self, index: usize) -> (f32, f32) {
        let (ox, oy) = self.origin();
        (ox + ((index % SIDE) as f32 + 0.5) * CELL_M, oy + ((index / SIDE) as f32 + 0.5) * CELL_M)
    }

    /// Whole cells from `self` to `other`: right and up.
    #[must_use]
    pub fn shift_to(&self, other: &Self) -> (i32, i32) {
        (other.column.saturating_sub(self.column), other.row.saturating_sub(self.row))
    }
}

/// How certainty grows and fades. Units: 1/8 of a reading, so that a byte holds fractions of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridRules {
    /// Added to one cell a reading.
    pub reading: u8,
    /// Certainty saturates here.
    pub most: u8,
    /// Taken along a beam that came back from farther away.
    pub clear_echo: u8,
    /// Taken along a beam that never came back: little, because a smooth wall seen aslant is silent too.
    pub clear_silence: u8,
    /// Taken from every cell each second.
    pub decay_per_s: f32,
    /// And from those no farther than this from the drone's middle, metres:
    pub lingers_m: f32,
    /// less, each second. What is so near stands between two cones for long, and soft things answer none of them.
    pub lingering_decay_per_s: f32,
    /// Clearing ends this far before the echo, metres: range noise and half a cell diagonal.
    pub clear_margin_m: f32,
    /// Nearer to the sensor than [`Self::near_m`] a beam takes no more than this: what is a little lower or higher than the
    /// sensor is under or over the cone there, and was heard from farther away.
    pub clear_near: u8,
    /// There the cone is 13 cm high to either side of its axis, metres.
    pub near_m: f32,
    /// Half-angle within which an echo clears, radians: half of the cone's 15 degrees, where it is loudest.
    pub clear_half_angle_rad: f32,
}

/// Certainty units in one reading: [`GridRules::reading`] of the flight configuration, and what equation 9
/// divides by to have c in readings.
pub const UNITS_PER_READING: u8 = 8;

impl Default for GridRules {
    /// The `flight` configuration: six readings saturate, so that what moved on is cleared by sixteen
    /// pings (3 s at 5.6 Hz a sensor); a full cell is forgotten in 19 s, near the drone in 32 s, because who stands between two cones
    /// is heard by neither; an echo from behind takes three eighths of a reading away, for a coat swallows every fifth ping.
    fn default() -> Self {
        Self {
            reading: UNITS_PER_READING,
            most: 6 * UNITS_PER_READING,
            clear_echo: 3,
            clear_silence: 1,
            decay_per_s: 2.5,
            lingers_m: 0.7,
            lingering_decay_per_s: 1.5,
            clear_margin_m: 0.15,
            clear_near: 2,
            near_m: 0.5,
            clear_half_angle_rad: 7.5 / 180.0 * PI,
        }
    }
}

impl GridRules {
    /// Only increments, as in the thesis. A byte holds 31 readings, where the thesis's certainty is an integer
    /// without an end.
    #[must_use]
    pub fn thesis() -> Self {
        Self {
            most: u8::MAX - u8::MAX % UNITS_PER_READING,
            clear_echo: 0,
            clear_silence: 0,
            decay_per_s: 0.0,
            lingering_decay_per_s: 0.0,
            ..Self::default()
        }
    }

    /// Units that fade between two instants. Counted on an absolute time scale, so that nothing is lost to
    /// rounding however short the steps are and no remainder has to survive a restart.
    #[must_use]
    pub fn faded(&self, earlier_ns: u64, later_ns: u64) -> Faded {
        let units = |rate: f32| {
            let rate = f64::from(rate);
            if !(rate.is_finite() && rate > 0.0) || later_ns <= earlier_ns {
                return 0;
            }
            let until = |ns: u64| (ns as f64 * 1e-9 * rate).floor();
            (until(later_ns) - until(earlier_ns)).clamp(0.0, 255.0) as u8
        };
        let cells = (self.lingers_m / CELL_M).clamp(0.0, SIDE as f32) as i32;
        Faded { far: units(self.decay_per_s), near: units(self.lingering_decay_per_s), cells }
    }
}

/// What every cell loses when the window moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faded {
    /// Units that a cell loses.
    pub far: u8,
    /// Units that one near the middle loses.
    pub near: u8,
    /// How far from the middle that is, cells.
    pub cells: i32,
}

/// What one ping brought back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Echo {
    /// Something unknown to the plan answered from this distance, metres.
    Obstacle(f32),
    /// The plan expects a surface at this distance, metres: it stands in the wall layer already, so the beam
    /// clears and increments nothing. (On the cone's bisector a door jamb would stand in the opening.)
    Mapped(f32),
    /// Nothing within reach, metres.
    Silence(f32),
}

/// One ping in the plan frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// The sensor's face, metres.
    pub x_m: f32,
    /// The sensor's face, metres.
    pub y_m: f32,
    /// Bisector of the cone, radians.
    pub angle_rad: f32,
    /// What came back.
    pub echo: Echo,
}

/// Moves the window: copies what `last` and `next` share, less what has `faded`; what enters is zero.
/// Columns shorter than [`CELLS`] are left alone.
pub fn scroll(last: &[u8], from: &Window, next: &mut [u8], to: &Window, faded: Faded) {
    if next.len() < CELLS {
        return;
    }
    next[..CELLS].fill(0);
    let (right, up) = from.shift_to(to);
    let side = SIDE as i32;
    if last.len() < CELLS || right.abs() >= side || up.abs() >= side {
        return;
    }
    let width = (side - right.abs()) as usize;
    let (read_x, write_x) = (right.max(0) as usize, (-right).max(0) as usize);
    for row in (-up).max(0)..(side - up).min(side) {
        let read = (row + up) as usize * SIDE + read_x;
        let write = row as usize * SIDE + write_x;
        let aside = row - side / 2;
        let near = faded.cells * faded.cells - aside * aside;
        let first = write_x as i32 - side / 2;
        for ((w, r), ahead) in
            next[write..write + width].iter_mut().zip(&last[read..read + width]).zip(first..)
        {
            *w = r.saturating_sub(if ahead * ahead <= near { faded.near } else { faded.far });
        }
    }
}

/// Enters one ping: clears along the beam, then increments the one cell on the bisector at the echo's
/// distance (figure 3.5). Echoes from beyond the window are not clamped to its edge: they only clear.
pub fn insert(cells: &mut [u8], window: &Window, rules: &GridRules, beam: &Beam) {
    let finite = beam.x_m.is_finite() && beam.y_m.is_finite() && beam.angle_rad.is_finite();
    if cells.len() < CELLS || !finite {
        return;
    }
    let (range, clear, hit) = match beam.echo {
        Echo::Obstacle(range) => (range, rules.clear_echo, true),
        Echo::Mapped(range) => (range, rules.clear_echo, false),
        Echo::Silence(range) => (range, rules.clear_silence, false),
    };
    if !(range.is_finite() && range > 0.0) {
        return;
    }
    if clear > 0 {
        clear_wedge(cells, window, rules, beam, range - rules.clear_margin_m, clear);
    }
    if hit {
        let (x, y) = (beam.x_m + range * beam.angle_rad.cos(), beam.y_m + range * beam.angle_rad.sin());
        if let Some(index) = window.index(x, y) {
            cells[index] = cells[index].saturating_add(rules.reading).min(rules.most.max(1));
        }
    }
}

/// Takes `units` from every cell whose centre lies in the inner part of the cone nearer than `reach`.
fn clear_wedge(cells: &mut [u8], window: &Window, rules: &GridRules, beam: &Beam, reach: f32, units: u8) {
    // The window's diagonal: farther cells do not exist.
    let reach = reach.min(2.0 * core::f32::consts::SQRT_2 * REACH_M);
    if reach <= 0.0 {
        return;
    }
    let (sin, cos) = beam.angle_rad.sin_cos();
    let slope = rules.clear_half_angle_rad.clamp(0.0, PI / 4.0).tan();
    let (ox, oy) = window.origin();
    let (end_x, end_y) = (beam.x_m + reach * cos, beam.y_m + reach * sin);
    let spread = reach * slope + CELL_M;
    let bound = |low: f32, high: f32, origin: f32| {
        let first = ((low - spread - origin) / CELL_M).floor().clamp(0.0, SIDE as f32) as usize;
        let last = ((high + spread - origin) / CELL_M).ceil().clamp(0.0, SIDE as f32) as usize;
        first..last
    };
    let rows = bound(beam.y_m.min(end_y), beam.y_m.max(end_y), oy);
    let columns = bound(beam.x_m.min(end_x), beam.x_m.max(end_x), ox);
    for row in rows {
        let dy = oy + (row as f32 + 0.5) * CELL_M - beam.y_m;
        let line = &mut cells[row * SIDE..(row + 1) * SIDE][columns.clone()];
        // Most rows are empty, and that is seen many bytes at a time.
        if line.iter().fold(0u8, |any, c| any | c) == 0 {
            continue;
        }
        for (column, cell) in line.iter_mut().enumerate() {
            if *cell == 0 {
                continue;
            }
            let dx = ox + ((columns.start + column) as f32 + 0.5) * CELL_M - beam.x_m;
            let along = dx * cos + dy * sin;
            let across = (dy * cos - dx * sin).abs();
            // Half a cell beside the axis: next to the sensor the wedge is thinner than a cell.
            if along > 0.0 && along < reach && across <= along * slope + 0.5 * CELL_M {
                let units = if along < rules.near_m { units.min(rules.clear_near) } else { units };
                *cell = cell.saturating_sub(units);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(x: f32, y: f32, degrees: f32, echo: Echo) -> Beam {
        Beam { x_m: x, y_m: y, angle_rad: degrees.to_radians(), echo }
    }

    #[test]
    fn one_reading_increments_one_cell_on_the_bisector() {
        let window = Window::around(1.0, 2.0).unwrap();
        let mut cells = vec![0u8; CELLS];
        insert(&mut cells, &window, &GridRules::default(), &beam(1.0, 2.0, 90.0, Echo::Obstacle(1.02)));
        let filled: Vec<usize> = (0..CELLS).filter(|i| cells[*i] > 0).collect();
        assert_eq!(filled.len(), 1);
        assert_eq!(cells[filled[0]], UNITS_PER_READING);
        let (x, y) = window.centre(filled[0]);
        assert!((x - 1.0).abs() <= 0.03 && (y - 3.02).abs() <= 0.03, "{x} {y}");
    }

    #[test]
    fn readings_beyond_the_window_are_ignored_not_clamped() {
        let window = Window::around(0.0, 0.0).unwrap();
        let mut cells = vec![0u8; CELLS];
        insert(&mut cells, &window, &GridRules::default(), &beam(0.0, 0.0, 0.0, Echo::Obstacle(2.3)));
        assert!(cells.iter().all(|c| *c == 0));
    }

    #[test]
    fn a_far_echo_clears_what_stood_before_it_and_a_thesis_grid_keeps_it() {
        let window = Window::around(0.0, 0.0).unwrap();
        for (rules, gone) in [(GridRules::default(), true), (GridRules::thesis(), false)] {
            let mut cells = vec![0u8; CELLS];
            for _ in 0..3 {
                insert(&mut cells, &window, &rules, &beam(0.0, 0.0, 30.0, Echo::Obstacle(1.0)));
            }
            // Three readings of 8 units, and 3 units an echo from behind.
            for _ in 0..8 {
                insert(&mut cells, &window, &rules, &beam(0.0, 0.0, 30.0, Echo::Obstacle(3.0)));
            }
            assert_eq!(cells.iter().all(|c| *c == 0), gone);
        }
    }

    #[test]
    fn one_echo_from_behind_takes_less_than_a_reading_and_near_the_sensor_less_still() {
        let window = Window::around(0.0, 0.0).unwrap();
        let left = |distance: f32| {
            let mut cells = vec![0u8; CELLS];
            insert(
                &mut cells,
                &window,
                &GridRules::default(),
                &beam(0.0, 0.0, 30.0, Echo::Obstacle(distance)),
            );
            insert(&mut cells, &window, &GridRules::default(), &beam(0.0, 0.0, 30.0, Echo::Obstacle(3.0)));
            cells.iter().copied().max().unwrap()
        };
        // A coat swallows every fifth ping: whoever answered once is still there after one ping past him.
        assert_eq!(left(1.0), UNITS_PER_READING - 3);
        // What is a little lower than the sensor is under the cone near by, and was heard from farther away.
        assert_eq!(left(0.3), UNITS_PER_READING - 2);
    }

    #[test]
    fn a_wall_echo_of_the_plan_is_not_stamped() {
        let window = Window::around(0.0, 0.0).unwrap();
        let mut cells = vec![0u8; CELLS];
        insert(&mut cells, &window, &GridRules::default(), &beam(0.0, 0.0, 0.0, Echo::Mapped(1.0)));
        assert!(cells.iter().all(|c| *c == 0));
    }

    #[test]
    fn contents_keep_their_place_when_the_window_scrolls() {
        let from = Window::around(0.02, 0.02).unwrap();
        let mut last = vec![0u8; CELLS];
        let place = (1.02, -0.52);
        last[from.index(place.0, place.1).unwrap()] = 100;
        for (x, y) in [(0.34, 0.02), (-0.4, 0.3), (0.02, -0.9), (1.9, -1.9)] {
            let to = Window::around(x, y).unwrap();
            let mut next = vec![7u8; CELLS];
            scroll(&last, &from, &mut next, &to, Faded { far: 3, ..Faded::default() });
            assert_eq!(next[to.index(place.0, place.1).unwrap()], 97);
            assert_eq!(next.iter().filter(|c| **c > 0).count(), 1);
        }
        let far = Window::around(40.0, 0.0).unwrap();
        let mut next = vec![7u8; CELLS];
        scroll(&last, &from, &mut next, &far, Faded::default());
        assert!(next.iter().all(|c| *c == 0));
    }

    #[test]
    fn decay_does_not_depend_on_the_length_of_the_steps() {
        let rules = GridRules::default();
        let start = 1_234_567_890u64;
        let fine = (0..600u64)
            .map(|i| rules.faded(start + i * 5_000_000, start + (i + 1) * 5_000_000))
            .fold((0, 0), |sum, faded| (sum.0 + u32::from(faded.far), sum.1 + u32::from(faded.near)));
        let coarse = rules.faded(start, start + 3_000_000_000);
        assert_eq!(fine, (u32::from(coarse.far), u32::from(coarse.near)));
        assert_eq!(fine, (7, 5), "2.5 and 1.5 a second, rounded on the absolute scale");
        assert_eq!(rules.faded(start, start), rules.faded(start, 0), "the clock went back");
        let thesis = GridRules::thesis().faded(start, start + 3_000_000_000);
        assert_eq!((thesis.far, thesis.near), (0, 0), "only increments");
    }

    /// Seeds 1762 and 1801: a plant and a person were forgotten at 0.2 and 0.4 m, because no beam hears a soft thing there.
    #[test]
    fn what_is_near_lingers() {
        let window = Window::around(3.02, 4.02).unwrap();
        let (near, far) = (window.index(3.6, 4.0).unwrap(), window.index(3.9, 4.0).unwrap());
        let mut last = vec![0u8; CELLS];
        (last[near], last[far]) = (8, 8);
        let mut next = vec![0u8; CELLS];
        let faded = GridRules::default().faded(1, 4_000_000_000);
        scroll(&last, &window, &mut next, &window, faded);
        assert_eq!((next[near], next[far]), (2, 0));
        let beyond = Window::around(2.52, 4.02).unwrap();
        scroll(&last, &window, &mut next, &beyond, faded);
        assert_eq!(next[beyond.index(3.6, 4.0).unwrap()], 0, "it is by where the drone is now");
    }

    #[test]
    fn a_window_is_recovered_from_its_origin() {
        for (x, y) in [(0.0, 0.0), (13.37, -4.2), (-212.013, 99.99)] {
            let window = Window::around(x, y).unwrap();
            let (ox, oy) = window.origin();
            assert_eq!(Window::from_origin(ox, oy), Some(window));
        }
        assert_eq!(Window::around(f32::NAN, 0.0), None);
        assert_eq!(Window::from_origin(f32::INFINITY, 0.0), None);
    }
}
