//! What is below, by two eyes: the flow sensor's narrow beam and the sonar's wide cone.
//!
//! Where a table ends the cone hears now the top, now the floor, and never says which: in rehearsed flights the height
//! was wrong by 0.2 to 0.4 m over the chairs of a meeting room, and twice the drone climbed to the ceiling. The beam
//! sees what lies under the middle alone, 25 times a second. While it answers the height is its; the cone then says
//! whether an edge stands higher under the rim. Without the sensor, or while it is silent, the sonar is the height.

use ipc_types::seconds_between;

/// Without a range for so long the beam is silent and the sonar takes over, seconds: four frames.
const SILENT_S: f64 = 0.16;
/// Heard so much above the level below the middle, something stands under the rim, metres: more than what ranges of
/// both err together.
const EDGE_M: f32 = 0.12;
/// Two pings in a row that differ by less hear one thing, metres.
const SAME_M: f32 = 0.15;
/// An edge is minded for so long after it was heard, seconds: half a metre of flight.
const MINDED_S: f64 = 1.0;

/// On the ground the beam reads no more, metres.
const MOST_REST_M: f32 = 0.25;
/// Share of the newest range on the ground in the mean: about a second of them.
const REST_SHARE: f32 = 0.05;

/// The newest of both.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Below {
    /// What the beam reads when the skids stand on the floor, metres.
    rest_m: f32,
    /// When the beam measured last.
    ranged_ns: u64,
    /// The level of the last ping that was too high.
    high_m: Option<f32>,
    /// An edge, heard twice: when last, and its level above the floor.
    edge: Option<(u64, f32)>,
}

impl Below {
    /// Before anything was measured on the ground: the sensor as high above the skids as this, metres.
    pub(crate) fn new(rest_m: f32) -> Self {
        Self { rest_m, ..Self::default() }
    }

    /// A range while the skids stand on the floor.
    pub(crate) fn stand(&mut self, range_m: f32) {
        if range_m < MOST_REST_M {
            self.rest_m += REST_SHARE * (range_m - self.rest_m);
        }
    }

    /// What the beam reads when the skids stand on the floor, metres.
    pub(crate) fn rest_m(&self) -> f32 {
        self.rest_m
    }

    /// A range of the beam; false when it is none, not a new one, or from after the message `sent_ns` that brought it:
    /// a stamp from the future would make all later ranges old.
    pub(crate) fn range(&mut self, sent_ns: u64, ranged_ns: u64, range_m: f32) -> bool {
        let new = ranged_ns > self.ranged_ns && ranged_ns <= sent_ns && range_m > 0.0 && range_m < 20.0;
        if new {
            self.ranged_ns = ranged_ns;
        }
        new
    }

    /// Whether the height is the beam's.
    pub(crate) fn sees(&self, now: u64) -> bool {
        self.ranged_ns > 0 && seconds_between(self.ranged_ns, now).abs() < SILENT_S
    }

    /// The sonar heard something at `heard_m` above the floor while the beam sees a level of `level_m`.
    pub(crate) fn hear(&mut self, at_ns: u64, heard_m: f32, level_m: f32) {
        let high = (heard_m > level_m + EDGE_M).then_some(heard_m);
        if let (Some(before), Some(now)) = (self.high_m, high)
            && (before - now).abs() < SAME_M
        {
            self.edge = Some((at_ns, before.max(now)));
        }
        self.high_m = high;
    }

    /// Level of an edge under the rim, metres above the floor.
    pub(crate) fn edge_m(&self, now: u64) -> Option<f32> {
        self.edge.filter(|(at, _)| seconds_between(*at, now) < MINDED_S).map(|(_, level)| level)
    }
}

#[cfg(test)]
mod tests {
    use super::Below;

    const MS: u64 = 1_000_000;

    #[test]
    fn an_edge_is_believed_when_two_pings_agree_and_minded_for_a_second() {
        let mut below = Below::default();
        below.hear(1000 * MS, 0.75, 0.0);
        assert_eq!(below.edge_m(1000 * MS), None, "one ping may be an outlier");
        below.hear(1060 * MS, 0.3, 0.0);
        assert_eq!(below.edge_m(1060 * MS), None, "two that disagree are two outliers");
        below.hear(1120 * MS, 0.33, 0.0);
        assert_eq!(below.edge_m(1500 * MS), Some(0.33));
        below.hear(1180 * MS, 0.02, 0.0);
        below.hear(1240 * MS, 0.33, 0.0);
        assert_eq!(below.edge_m(2200 * MS), None);
    }

    #[test]
    fn the_beam_is_the_height_while_it_brings_new_ranges() {
        let mut below = Below::default();
        assert!(!below.sees(1000 * MS));
        let mut range = |sent: u64, ranged: u64, metres: f32| below.range(sent * MS, ranged * MS, metres);
        assert!(!range(990, 9000, 1.2), "from the future");
        assert!(range(1000, 1000, 1.2) && !range(1000, 1000, 1.2) && !range(1010, 1010, f32::NAN));
        assert!(below.sees(1100 * MS) && !below.sees(1200 * MS));
    }
}
