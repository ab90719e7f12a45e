//! What may be wrong, for how long it has been, and what may be lost.

use super::policy::Policy;

/// What the rows of the table are made of. Each is timed by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Condition {
    /// No setpoint of navigation that has not expired. Counts while the drone follows navigation.
    NavigationSilent = 0,
    /// Who held the sticks last is not heard, and nobody has taken over or ordered anything since.
    OperatorSilent = 1,
    /// At least one side sonar has given nothing for two of its turns.
    SideSonarSilent = 2,
    /// Every side sonar has given nothing for two of its turns.
    AllSonarsSilent = 3,
    /// The pose is stale, not tracked, or beyond the policy's P(lost) or sigma.
    PoseUncertain = 4,
    /// The pose is uncertain, nothing holds the velocity, and fewer than two walls answer.
    FewWalls = 5,
    /// The pose is uncertain *and* nothing holds the velocity: a hover would drift.
    Adrift = 6,
    /// What is left in the battery does not cover the way home and the reserve.
    HomeUncovered = 7,
    /// Nobody can tell what is left in the battery.
    ChargeUnknown = 8,
    /// A cell is under the return voltage.
    CellLow = 9,
    /// A cell is under the landing voltage.
    CellEmpty = 10,
    /// No believable echo of the down sonar.
    HeightSilent = 11,
    /// The flight controller has not answered.
    LinkSilent = 12,
    /// Tilted beyond the policy's angle.
    TiltedOver = 13,
    /// The operator's standing order to land.
    LandOrdered = 14,
    /// Localization searches the plan for a drone of which nothing was known.
    Searching = 15,
}

/// How many conditions there are.
const COUNT: usize = 16;

impl Condition {
    /// All, in the order of their numbers.
    pub const ALL: &'static [Self; COUNT] = &[
        Self::NavigationSilent,
        Self::OperatorSilent,
        Self::SideSonarSilent,
        Self::AllSonarsSilent,
        Self::PoseUncertain,
        Self::FewWalls,
        Self::Adrift,
        Self::HomeUncovered,
        Self::ChargeUnknown,
        Self::CellLow,
        Self::CellEmpty,
        Self::HeightSilent,
        Self::LinkSilent,
        Self::TiltedOver,
        Self::LandOrdered,
        Self::Searching,
    ];

    /// Whether it means anything in this stage of the flight.
    #[must_use]
    pub const fn counts(self, stage: Stage) -> bool {
        !matches!(self, Self::NavigationSilent) || matches!(stage, Stage::Autonomous)
    }

    /// After how long without it it has gone, seconds, and the policy's key for that; `None`: at once. What comes and
    /// goes with single messages must not restart its clock each time.
    #[must_use]
    pub const fn clear(self, policy: &Policy) -> Option<(f32, &'static str)> {
        match self {
            Self::SideSonarSilent
            | Self::PoseUncertain
            | Self::FewWalls
            | Self::ChargeUnknown
            | Self::Searching
            | Self::CellEmpty => Some((policy.clear_s, "clear_s")),
            Self::HomeUncovered | Self::CellLow => Some((policy.battery_clear_s, "battery_clear_s")),
            Self::LinkSilent => Some((policy.link_clear_s, "link_clear_s")),
            Self::TiltedOver => Some((policy.tilt_clear_s, "tilt_clear_s")),
            Self::NavigationSilent
            | Self::OperatorSilent
            | Self::AllSonarsSilent
            | Self::Adrift
            | Self::HeightSilent
            | Self::LandOrdered => None,
        }
    }
}

/// Where a flight is, as far as the table cares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// On the ground with the motors off: whatever was kept ends here.
    #[default]
    Grounded,
    /// The motors run or were cut, and the skids are not known to be off the ground.
    Armed,
    /// In the air by the pilot's own will: take-off, hover, landing.
    Airborne,
    /// In the air, following navigation.
    Autonomous,
    /// In the air, following a human's sticks.
    Manual,
}

impl Stage {
    /// All.
    pub const ALL: &'static [Self] =
        &[Self::Grounded, Self::Armed, Self::Airborne, Self::Autonomous, Self::Manual];

    /// Whether the skids are off the ground: on it nothing is a failsafe.
    #[must_use]
    pub const fn in_the_air(self) -> bool {
        matches!(self, Self::Airborne | Self::Autonomous | Self::Manual)
    }
}

/// For how long what has been so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Where the flight is.
    pub stage: Stage,
    lasted_s: [f32; COUNT],
}

impl Evidence {
    /// Nothing is wrong.
    #[must_use]
    pub const fn new(stage: Stage) -> Self {
        Self { stage, lasted_s: [0.0; COUNT] }
    }

    /// With this condition held for so long, seconds; 0 when it is not so.
    #[must_use]
    pub fn with(mut self, condition: Condition, lasted_s: f32) -> Self {
        self.set(condition, lasted_s);
        self
    }

    /// This condition has held for so long, seconds; 0 when it is not so.
    pub fn set(&mut self, condition: Condition, lasted_s: f32) {
        self.lasted_s[condition as usize] = lasted_s;
    }

    /// For how long it has held, seconds. Not a number is "for ever": what cannot be measured is not taken for good.
    #[must_use]
    pub fn lasted_s(&self, condition: Condition) -> f32 {
        let lasted_s = self.lasted_s[condition as usize];
        if !condition.counts(self.stage) {
            0.0
        } else if lasted_s.is_nan() {
            f32::INFINITY
        } else {
            lasted_s
        }
    }
}

/// How a condition is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Seen {
    /// Whether it is so now; [`super::Failsafe`] times it.
    Now(bool),
    /// For how long it has been so, seconds, by who measures it.
    For(f32),
}

/// What is so now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flags {
    seen: [Seen; COUNT],
}

impl Default for Flags {
    /// Nothing is wrong.
    fn default() -> Self {
        Self { seen: [Seen::Now(false); COUNT] }
    }
}

impl Flags {
    /// Whether it is so now.
    pub fn set(&mut self, condition: Condition, is_so: bool) {
        self.seen[condition as usize] = Seen::Now(is_so);
    }

    /// For how long it has been so by who measures it, seconds: 0 when it is not, not a number for ever.
    pub fn set_lasted(&mut self, condition: Condition, lasted_s: f32) {
        self.seen[condition as usize] = Seen::For(lasted_s);
    }

    pub(super) fn seen(&self, condition: Condition) -> Seen {
        self.seen[condition as usize]
    }
}

/// What a guard would ask about: "if that were lost now?"
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The place on the plan.
    Pose,
    /// The link of who holds the sticks.
    OperatorLink,
    /// The down sonar.
    Height,
    /// All side sonars.
    SideSonars,
    /// Navigation.
    Navigation,
    /// The flight controller.
    Controller,
    /// What the controller tells of the battery.
    Charge,
}

impl Loss {
    /// All.
    pub const ALL: &'static [Self] = &[
        Self::Pose,
        Self::OperatorLink,
        Self::Height,
        Self::SideSonars,
        Self::Navigation,
        Self::Controller,
        Self::Charge,
    ];

    /// What is so when it is lost.
    #[must_use]
    pub const fn condition(self) -> Condition {
        match self {
            Self::Pose => Condition::PoseUncertain,
            Self::OperatorLink => Condition::OperatorSilent,
            Self::Height => Condition::HeightSilent,
            Self::SideSonars => Condition::AllSonarsSilent,
            Self::Navigation => Condition::NavigationSilent,
            Self::Controller => Condition::LinkSilent,
            Self::Charge => Condition::ChargeUnknown,
        }
    }

    /// Whether there is anything to lose: a link only to who holds the sticks.
    #[must_use]
    pub const fn matters(self, stage: Stage) -> bool {
        !matches!(self, Self::OperatorLink) || matches!(stage, Stage::Manual)
    }

    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Pose => "the place on the plan",
            Self::OperatorLink => "the link of who holds the sticks",
            Self::Height => "the down sonar",
            Self::SideSonars => "all side sonars",
            Self::Navigation => "navigation",
            Self::Controller => "the flight controller",
            Self::Charge => "what is known of the battery",
        }
    }
}
