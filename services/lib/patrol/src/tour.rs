use crate::Costmap;
use crate::search::Search;

/// From each place the way to this many nearest others is measured; farther ones go by way of those.
const NEAREST: usize = 8;
/// Passes over the order at most; each one shortens it.
const PASSES: usize = 40;
/// Shorter by less than this is not shorter, metres.
const GAIN_M: f32 = 0.01;

/// The order of places from the first to the last one, by the lengths of the ways between them.
#[derive(Clone, Debug)]
pub(crate) struct Tour {
    cells: Vec<usize>,
    /// When each one's turn comes: never before one of a lower number.
    turns: Vec<usize>,
    /// Cost of the way between each two, row by row.
    between: Vec<f32>,
    order: Vec<usize>,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Measure { from: usize, running: bool, found: usize },
    Close { by: usize },
    Order { passes: usize },
    Done,
}

impl Tour {
    /// `cells` begins with the start and ends with the end of the tour; `turns` has one entry for each, of which those two
    /// are not looked at.
    pub(crate) fn new(cells: Vec<usize>, turns: Vec<usize>) -> Self {
        let count = cells.len();
        let mut between = vec![f32::INFINITY; count * count];
        for k in 0..count {
            between[k * count + k] = 0.0;
        }
        Self {
            cells,
            turns,
            between,
            order: Vec::new(),
            stage: Stage::Measure { from: 0, running: false, found: 0 },
        }
    }

    /// Positions in `cells`, from 0 to the last.
    pub(crate) fn order(&self) -> &[usize] {
        &self.order
    }

    /// Works on; returns what is left of the budget, and whether the order is ready.
    pub(crate) fn advance(&mut self, map: &Costmap, search: &mut Search, mut left: usize) -> (usize, bool) {
        let count = self.cells.len();
        while left > 0 {
            match self.stage {
                Stage::Measure { from, .. } if from >= count => self.stage = Stage::Close { by: 0 },
                Stage::Measure { from, running: false, .. } => {
                    search.begin(self.cells[from]);
                    self.stage = Stage::Measure { from, running: true, found: 0 };
                }
                Stage::Measure { from, found, .. } => {
                    // A settled cell costs about as much as thirty looked at.
                    left = left.saturating_sub(30);
                    self.measure(map, search, from, found);
                }
                Stage::Close { by } if by >= count => {
                    self.begin_order(map);
                    self.stage = Stage::Order { passes: 0 };
                }
                Stage::Close { by } => {
                    left = left.saturating_sub(count * count);
                    self.close(by);
                    self.stage = Stage::Close { by: by + 1 };
                }
                Stage::Order { passes } => {
                    left = left.saturating_sub(4 * count * count);
                    let better = self.improve();
                    let more = better && passes < PASSES;
                    self.stage = if more { Stage::Order { passes: passes + 1 } } else { Stage::Done };
                }
                Stage::Done => return (left, true),
            }
        }
        (left, self.stage == Stage::Done)
    }

    fn measure(&mut self, map: &Costmap, search: &mut Search, from: usize, found: usize) {
        let enter = |cell| {
            let cost = map.cost(cell);
            cost.is_finite().then_some((cost, 0.0))
        };
        let next = Stage::Measure { from: from + 1, running: false, found: 0 };
        let Some(cell) = search.settle(map, enter, |_| 0.0) else {
            self.stage = next;
            return;
        };
        let count = self.cells.len();
        let mut found = found;
        for (to, place) in self.cells.iter().enumerate() {
            if *place == cell {
                let cost = search.cost_of(cell);
                for (a, b) in [(from, to), (to, from)] {
                    let old = &mut self.between[a * count + b];
                    *old = old.min(cost);
                }
                found += usize::from(to != from);
            }
        }
        self.stage = if found >= NEAREST { next } else { Stage::Measure { from, running: true, found } };
    }

    /// One round of Floyd and Warshall: ways by way of one more place.
    fn close(&mut self, by: usize) {
        let count = self.cells.len();
        for a in 0..count {
            let first = self.between[a * count + by];
            if first.is_finite() {
                for b in 0..count {
                    let sum = first + self.between[by * count + b];
                    if sum < self.between[a * count + b] {
                        self.between[a * count + b] = sum;
                    }
                }
            }
        }
    }

    /// Nearest neighbour first.
    fn begin_order(&mut self, map: &Costmap) {
        let count = self.cells.len();
        let change = map.limits().room_change_m;
        for a in 0..count {
            for b in 0..count {
                if map.room_of(self.cells[a]) != map.room_of(self.cells[b]) {
                    self.between[a * count + b] += change;
                }
            }
        }
        let last = count - 1;
        let mut left: Vec<usize> = (1..last).collect();
        self.order = vec![0];
        let mut here = 0;
        while let Some(k) = (0..left.len()).min_by(|a, b| {
            let turn = |k: usize| self.turns[left[k]];
            let length = |k: usize| self.length(here, left[k]);
            turn(*a).cmp(&turn(*b)).then(length(*a).total_cmp(&length(*b)))
        }) {
            here = left.swap_remove(k);
            self.order.push(here);
        }
        self.order.push(last);
    }

    fn length(&self, a: usize, b: usize) -> f32 {
        self.between[a * self.cells.len() + b]
    }

    /// Whether what stands at `i..=j` of the order may be turned round: all of it has the same turn.
    fn one_turn(&self, i: usize, j: usize) -> bool {
        self.order[i..=j].windows(2).all(|pair| self.turns[pair[0]] == self.turns[pair[1]])
    }

    /// Whether what has this turn may stand between the `j`th of the order and the next.
    fn has_its_turn(&self, turn: usize, j: usize) -> bool {
        let last = self.order.len() - 1;
        (j == 0 || self.turns[self.order[j]] <= turn)
            && (j + 1 == last || turn <= self.turns[self.order[j + 1]])
    }

    /// One pass of 2-opt and of moving short runs elsewhere (Or 1976); whether it helped.
    fn improve(&mut self) -> bool {
        let mut better = false;
        let count = self.order.len();
        for i in 1..count.saturating_sub(2) {
            for j in i + 1..count - 1 {
                let (a, b, c, d) = (self.order[i - 1], self.order[i], self.order[j], self.order[j + 1]);
                let gain = self.length(a, b) + self.length(c, d) - self.length(a, c) - self.length(b, d);
                if gain > GAIN_M && self.one_turn(i, j) {
                    self.order[i..=j].reverse();
                    better = true;
                }
            }
        }
        for run in 1..=3 {
            for i in 1..count.saturating_sub(run) {
                better |= self.move_run(i, run);
            }
        }
        better
    }

    fn move_run(&mut self, i: usize, run: usize) -> bool {
        let count = self.order.len();
        if i + run >= count {
            return false;
        }
        if !self.one_turn(i, i + run - 1) {
            return false;
        }
        let (before, first) = (self.order[i - 1], self.order[i]);
        let (last, after) = (self.order[i + run - 1], self.order[i + run]);
        let saved = self.length(before, first) + self.length(last, after) - self.length(before, after);
        let mut best = (GAIN_M, None);
        for j in (0..count - 1).filter(|j| *j + 1 < i || *j >= i + run) {
            if !self.has_its_turn(self.turns[first], j) {
                continue;
            }
            let (a, b) = (self.order[j], self.order[j + 1]);
            for (head, tail, turned) in [(first, last, false), (last, first, true)] {
                let gain = saved - (self.length(a, head) + self.length(tail, b) - self.length(a, b));
                if gain > best.0 {
                    best = (gain, Some((j, turned)));
                }
            }
        }
        let (_, Some((j, turned))) = best else { return false };
        let mut moved: Vec<usize> = self.order.drain(i..i + run).collect();
        if turned {
            moved.reverse();
        }
        let at = if j >= i { j + 1 - run } else { j + 1 };
        self.order.splice(at..at, moved);
        true
    }
}
