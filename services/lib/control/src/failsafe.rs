//! The failsafe table of DESIGN 4: a pure function of for how long what has been wrong.
//!
//! [`TABLE`] is data: a row says which conditions must have held together for how long, what is done then, when that
//! ends and whether a human may take the sticks meanwhile. [`judge`] reads it; [`Failsafe`] times the conditions and
//! keeps what only the ground ends. `docs/failsafes.md` is printed from the same rows by [`page`].

mod condition;
mod machine;
mod page;
mod policy;
mod table;

pub use condition::{Condition, Evidence, Flags, Loss, Stage};
pub use machine::Failsafe;
pub use page::page;
pub use policy::{OperatorLost, Policy};
pub use table::{Clears, Row, TABLE};

/// What a failsafe does, from mild to severe: the order decides which one wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Action {
    /// Nothing.
    None = 0,
    /// Stop and hover.
    Hover = 1,
    /// Fly home and land.
    Return = 2,
    /// Land here.
    Land = 3,
    /// Come down level without position control.
    Descend = 4,
    /// Stop the motors.
    Cut = 5,
}

impl Action {
    /// From mild to severe.
    pub const ALL: &'static [Self] =
        &[Self::None, Self::Hover, Self::Return, Self::Land, Self::Descend, Self::Cut];

    /// What is left of it when its conditions have gone and the row is kept: who has come down level and knows the
    /// place again holds it on the rest of the way.
    #[must_use]
    pub const fn kept(self) -> Self {
        match self {
            Self::Descend => Self::Land,
            other => other,
        }
    }

    /// A word for people.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Hover => "hover",
            Self::Return => "return",
            Self::Land => "land",
            Self::Descend => "descend",
            Self::Cut => "cut",
        }
    }
}

/// Causes, from mild to severe: between equal actions the higher one is named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Cause {
    /// None.
    None = 0,
    /// Navigation fell silent.
    NavigationSilent = 1,
    /// Who held the sticks fell silent.
    OperatorSilent = 2,
    /// A side sonar is silent; the shield has closed its sectors.
    SideSonarSilent = 3,
    /// The pose is stale, or P(lost) or sigma too large.
    PoseUncertain = 4,
    /// All side sonars are silent.
    AllSonarsSilent = 5,
    /// The way home is just covered, a cell is low, or nobody knows.
    BatteryReturn = 6,
    /// A cell is nearly empty.
    BatteryLand = 7,
    /// The pose stayed uncertain too long, or too few walls answer.
    Lost = 8,
    /// The down sonar is silent.
    HeightUnknown = 9,
    /// The flight controller's link is down.
    LinkDown = 10,
    /// Tilted over.
    Tilt = 11,
    /// The operator ordered it.
    Operator = 12,
}

impl Cause {
    /// From mild to severe.
    pub const ALL: &'static [Self] = &[
        Self::None,
        Self::NavigationSilent,
        Self::OperatorSilent,
        Self::SideSonarSilent,
        Self::PoseUncertain,
        Self::AllSonarsSilent,
        Self::BatteryReturn,
        Self::BatteryLand,
        Self::Lost,
        Self::HeightUnknown,
        Self::LinkDown,
        Self::Tilt,
        Self::Operator,
    ];

    /// Its bit in [`Judgement::causes`].
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self as u8
    }

    /// Whether a drone on the ground stays there while this holds. Navigation comes back by itself and the sticks are
    /// nobody's on the ground. A side sonar loses pings: who asks for a take-off looks longer than the table does.
    #[must_use]
    pub const fn refuses_arming(self) -> bool {
        !matches!(
            self,
            Self::None
                | Self::NavigationSilent
                | Self::OperatorSilent
                | Self::SideSonarSilent
                | Self::Operator
        )
    }

    /// A few words for people.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::NavigationSilent => "navigation silent",
            Self::OperatorSilent => "operator silent",
            Self::SideSonarSilent => "a side sonar is silent",
            Self::PoseUncertain => "position uncertain",
            Self::AllSonarsSilent => "all side sonars are silent",
            Self::BatteryReturn => "battery: return",
            Self::BatteryLand => "battery: land",
            Self::Lost => "lost",
            Self::HeightUnknown => "height unknown",
            Self::LinkDown => "flight controller silent",
            Self::Tilt => "tilted over",
            Self::Operator => "operator",
        }
    }
}

/// Whether a human may take the sticks while a row acts, from free to forbidden. Whoever takes over stops the drone
/// first and passes neutral, whatever this says (DESIGN 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum TakeOver {
    /// At once: the cause ends with it, or does not concern who flies by hand.
    Yes = 0,
    /// Once the drone stands. The cause may go on: it does not act again until it has gone and comes anew.
    AfterStop = 1,
    /// No: what the sticks are flown by is what has failed, or there is no time left to fly.
    No = 2,
}

impl TakeOver {
    /// A few words for people.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::AfterStop => "yes, once it stands",
            Self::No => "no",
        }
    }
}

/// What the table says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// Causes that hold in the air now, as [`Cause::bit`]s, whether they act or not.
    pub causes: u32,
    /// The one that acts; it may have gone when only the ground ends what it began.
    pub cause: Cause,
    /// What it does.
    pub action: Action,
    /// Whether a human may take the sticks: the strictest of all rows that act.
    pub take_over: TakeOver,
    /// Who holds the sticks has lost them: by his silence, or because something acts that he cannot fly on through.
    pub lease_over: bool,
    /// The most severe cause that forbids arming; [`Cause::None`] when none does.
    pub no_arming: Cause,
}

impl Judgement {
    /// Nothing is wrong.
    pub const NOTHING: Self = Self {
        causes: 0,
        cause: Cause::None,
        action: Action::None,
        take_over: TakeOver::Yes,
        lease_over: false,
        no_arming: Cause::None,
    };

    fn weigh(&mut self, row: &Row, action: Action) {
        (self.action, self.cause) = (self.action, self.cause).max((action, row.cause));
        self.take_over = self.take_over.max(row.take_over);
        self.lease_over |= row.take_over != TakeOver::Yes || row.only.is_some();
    }

    fn forbid_arming(&mut self, cause: Cause) {
        self.no_arming = self.no_arming.max(cause);
    }
}

/// What is remembered of earlier judgements, one bit a row of [`TABLE`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Rows that have acted and that only the ground ends ([`Clears::Landed`]).
    kept: u32,
    /// Rows that a human has overruled by taking the sticks while they acted.
    overruled: u32,
    /// Whoever holds the sticks next overrules nothing: something acted that lets no human take them, or somebody has
    /// held them before.
    shut: bool,
}

impl Memory {
    /// That of a drone which did this for that reason, when no more is known of it: a restart. Rows that do not outlive
    /// their conditions are not remembered; of several that may have acted all are.
    #[must_use]
    pub fn of(cause: Cause, action: Action) -> Self {
        let began = |row: &Row| {
            row.cause == cause
                && row.clears == Clears::Landed
                && (row.action == action || row.action.kept() == action)
        };
        let kept = TABLE.iter().enumerate().filter(|(_, row)| began(row)).map(|(index, _)| 1 << index).sum();
        Self { kept, ..Self::default() }
    }

    /// Whether nothing outlives its conditions.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.kept == 0
    }
}

/// Judges the evidence: of all rows that act, the most severe action, and of those the most severe cause. Answers what
/// has to be remembered as well.
///
/// On the ground nothing acts, but a cut stays one until the motors are off. Within one stage of the flight the judgement is
/// monotone: what lasts longer never makes it milder.
#[must_use]
pub fn judge(evidence: &Evidence, memory: &Memory, policy: &Policy) -> (Judgement, Memory) {
    let stage = evidence.stage;
    let manual = stage == Stage::Manual;
    let taken_now = manual && !memory.shut;
    let mut judged = Judgement::NOTHING;
    let mut next = Memory::default();
    for (index, row) in TABLE.iter().enumerate() {
        let bit = 1 << index;
        let holds = row.holds(evidence, policy);
        let overruled = manual
            && holds
            && row.take_over == TakeOver::AfterStop
            && (taken_now || memory.overruled & bit != 0);
        let acts = holds && stage.in_the_air() && !overruled;
        let released = stage == Stage::Grounded || (taken_now && row.take_over != TakeOver::No);
        let kept = memory.kept & bit != 0 && !released;
        if holds && row.cause.refuses_arming() {
            judged.forbid_arming(row.cause);
        }
        if holds && stage.in_the_air() {
            judged.causes |= row.cause.bit();
        }
        if overruled {
            next.overruled |= bit;
        }
        if acts {
            judged.weigh(row, row.action);
        }
        if kept {
            judged.weigh(row, row.action.kept());
            judged.forbid_arming(row.cause);
        }
        if kept || (acts && row.clears == Clears::Landed) {
            next.kept |= bit;
        }
    }
    next.shut = manual || judged.take_over == TakeOver::No;
    (judged, next)
}
