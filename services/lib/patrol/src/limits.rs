/// What the vehicle needs and how a round is to be flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Radius of the airframe, metres.
    pub radius_m: f32,
    /// Free space kept around it, metres: a passage must be twice radius and margin wide.
    pub margin_m: f32,
    /// Free space kept to things that the plan does not show, metres: they are seen while they are passed.
    pub unmapped_margin_m: f32,
    /// Below this clearance a path costs more, steeply, so that it runs through the middle of doors and
    /// corridors; metres (FACTS 8: 0.8 m).
    pub comfort_m: f32,
    /// Farther than this from every mapped surface the sonars hear nothing; metres.
    pub horizon_m: f32,
    /// From how far a place is to be looked at, metres: under the 3 m that count, for a vehicle that is
    /// not exactly where it believes to be.
    pub view_m: f32,
    /// A place counts as seen when it is in sight within this, metres.
    pub seen_m: f32,
    /// From how far a place counts for coverage, metres.
    pub reach_m: f32,
    /// A place to look from that shows less new floor than this is not worth the way, square metres.
    pub least_gain_m2: f32,
    /// What entering another room costs in the order of a round, metres: a room is finished before it is left.
    pub room_change_m: f32,
}

impl Default for Limits {
    /// The `watchman`: 0.45 m across.
    fn default() -> Self {
        Self {
            radius_m: 0.225,
            margin_m: 0.15,
            unmapped_margin_m: 0.15,
            comfort_m: 0.8,
            horizon_m: 3.5,
            view_m: 2.8,
            seen_m: 2.9,
            reach_m: 3.0,
            least_gain_m2: 0.2,
            room_change_m: 3.0,
        }
    }
}

impl Limits {
    /// Least clearance of a mapped passage, from its middle to its side, metres.
    pub fn clearance_m(&self) -> f32 {
        self.radius_m + self.margin_m
    }

    /// The same beside a thing that is not on the plan.
    pub fn unmapped_clearance_m(&self) -> f32 {
        self.radius_m + self.unmapped_margin_m
    }
}
