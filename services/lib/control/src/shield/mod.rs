//! The shield: every wish for motion passes it, whoever wishes.
//!
//! It trusts only what the drone's own sonars say now, the walls of the plan around the pose, and the braking
//! law. No sensor looking that way, no motion that way.

mod braking;
mod delay;
mod grid;
mod guard;
mod heard;
mod remembered;
mod sight;
mod ways;

pub use braking::Braking;
pub use delay::Delay;
pub use grid::GridView;

use crate::check::{RangeError, within};
use crate::planar::Vector;
use floorplan::DistanceField;
use heard::Sensor;
use remembered::Remembered;
use sight::Glances;

/// Most sonars around.
pub const MAX_SENSORS: usize = 16;

/// Settings of the shield.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShieldConfig {
    /// Room kept between disc and echo on top of the stopping distance, metres. A centred disc of 0.45 m has
    /// 0.225 m on each side of a door of 0.9 m.
    pub margin_m: f32,
    /// More room kept to what is flown straight at, metres: whoever stands before a wall is shaken by gusts of
    /// up to 0.3 m/s2, which cost 0.1 to 0.15 m; whoever passes a door soon leaves it.
    pub standoff_m: f32,
    /// Things nearer to the disc than this are moved away from, metres: in the
    /// middle of a 0.9 m door neither jamb is: sonars hear them in turns, and pushes in turns would swing it.
    pub near_m: f32,
    /// Speed away for each metre nearer than `near_m`, 1/s: both jambs of a door push alike, which centres.
    pub push_gain_per_s: f32,
    /// Fastest push, m/s: more than what gusts of 0.3 m/s2 and the error of the velocity make the loop miss together.
    pub max_push_m_s: f32,
    /// Most that is taken off the wish beyond zero to brake what comes too fast, m/s: the velocity loop brakes by what the
    /// velocity misses the wish by, and a wish of zero alone brakes 0.5 m/s with less than half of what the law counts on.
    pub max_brake_m_s: f32,
    /// Speed that may be flown with something at the disc's edge, m/s...
    pub beside_m_s: f32,
    /// ... and more for each metre of the gap to it, 1/s: 0.4 m/s in the middle of a door of 0.9 m.
    pub beside_gain_per_s: f32,
    /// Half-angle to which a sonar and an answering neighbour join, degrees: 27.5 joins the flown layout at its widest.
    /// Beyond the cone that is a gap; beside a sonar that does not answer the cone is all.
    pub look_half_angle_deg: f32,
    /// Fastest way into a gap over which no cone has swept of late, m/s.
    pub gap_m_s: f32,
    /// A cone that swept over a gap vouches for it so long, seconds: the period of navigation's scan, and a sweep. What
    /// was heard meanwhile is remembered for longer.
    pub glance_s: f32,
    /// Half-angle of the cone in which an echo may lie, degrees (FACTS 2).
    pub cone_half_angle_deg: f32,
    /// Delay of the braking law beside the sweep, seconds (FACTS 2).
    pub reaction_s: f32,
    /// Deceleration of the braking law, m/s2 (FACTS 2).
    pub deceleration_m_s2: f32,
    /// Readings older than so many of the sensor's turns are worth nothing (DESIGN 4).
    pub stale_turns: f32,
    /// Certainty from which a cell of navigation's grid stands, eighths of a reading.
    pub grid_stands: u8,
    /// Room kept to the plan's walls beside the disc and the pose's sigma, metres: the plan is 3 cm wrong.
    pub plan_margin_m: f32,
    /// Speed at which the drone may still go where only the plan sees a wall, and a cone that looks at it hears none, m/s.
    pub creep_m_s: f32,
    /// Walls of the plan nearer to the disc, its plan margin and the pose's sigma than this are moved away from while the
    /// pose is sure, metres: sonars hear no wall that they look at askance. Where a sure pose sees a wall that the cone which
    /// looks there does not hear, it is crept up to this near and no nearer.
    pub plan_near_m: f32,
    /// Room kept to no-fly zones beside the disc and the pose's sigma, metres. No echo says that they are not there.
    pub zone_margin_m: f32,
    /// Most of the disc that an unsure pose may put inside a wall of the plan while the sonars say free, metres.
    pub plan_overlap_m: f32,
}

impl Default for ShieldConfig {
    fn default() -> Self {
        Self {
            margin_m: 0.07,
            standoff_m: 0.12,
            near_m: 0.2,
            push_gain_per_s: 2.0,
            max_push_m_s: 0.3,
            max_brake_m_s: 0.4,
            beside_m_s: 0.1,
            beside_gain_per_s: 1.5,
            look_half_angle_deg: 28.0,
            gap_m_s: 0.25,
            glance_s: 1.6,
            cone_half_angle_deg: 15.0,
            reaction_s: 0.35,
            deceleration_m_s2: 2.0,
            stale_turns: 2.0,
            grid_stands: 5,
            plan_margin_m: 0.03,
            creep_m_s: 0.15,
            plan_near_m: 0.08,
            zone_margin_m: 0.1,
            plan_overlap_m: 0.08,
        }
    }
}

impl ShieldConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("shield.margin_m", self.margin_m, 0.0, 0.2)?;
        within("shield.standoff_m", self.standoff_m, 0.0, 0.3)?;
        within("shield.near_m", self.near_m, 0.0, 0.6)?;
        within("shield.push_gain_per_s", self.push_gain_per_s, 0.0, 4.0)?;
        within("shield.max_push_m_s", self.max_push_m_s, 0.0, 0.5)?;
        within("shield.max_brake_m_s", self.max_brake_m_s, 0.0, 0.6)?;
        within("shield.beside_m_s", self.beside_m_s, 0.05, 1.0)?;
        within("shield.beside_gain_per_s", self.beside_gain_per_s, 0.0, 10.0)?;
        within("shield.look_half_angle_deg", self.look_half_angle_deg, 15.0, 45.0)?;
        within("shield.gap_m_s", self.gap_m_s, 0.0, 0.5)?;
        within("shield.glance_s", self.glance_s, 0.0, 4.0)?;
        within("shield.cone_half_angle_deg", self.cone_half_angle_deg, 5.0, 30.0)?;
        within("shield.reaction_s", self.reaction_s, 0.2, 1.0)?;
        within("shield.deceleration_m_s2", self.deceleration_m_s2, 0.5, 2.5)?;
        within("shield.stale_turns", self.stale_turns, 1.5, 4.0)?;
        within("shield.grid_stands", f32::from(self.grid_stands), 1.0, 255.0)?;
        within("shield.plan_margin_m", self.plan_margin_m, 0.0, 0.2)?;
        within("shield.creep_m_s", self.creep_m_s, 0.0, 0.3)?;
        within("shield.plan_near_m", self.plan_near_m, 0.0, 0.2)?;
        within("shield.zone_margin_m", self.zone_margin_m, 0.0, 0.5)?;
        within("shield.plan_overlap_m", self.plan_overlap_m, 0.0, 0.15)
    }
}

/// What a ping of a side sonar brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Echo {
    /// Something at this distance from the sensor's face, metres.
    Range(f32),
    /// The sensor works and heard nothing.
    Nothing,
}

/// One ping of one side sonar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// When the ping left.
    pub at_ns: u64,
    /// Heading of the body then, plan frame.
    pub heading: f32,
    /// Middle of the body then, plan frame; `None` when it is not known, and nothing is remembered.
    pub place: Option<Vector>,
    /// What came back.
    pub echo: Echo,
}

/// Where the drone is and how it flies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footing {
    /// Plan frame; `None` when it is not known.
    pub place: Option<Vector>,
    /// Larger standard deviation of the place, metres.
    pub sigma_m: f32,
    /// Plan frame.
    pub heading: f32,
    /// Plan frame, m/s; zero when it is not known.
    pub velocity: Vector,
    /// Over what is underneath, metres: near it the echoes of the side sonars may be its.
    pub clearance_m: f32,
}

/// What the plan says of the place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surroundings<'a> {
    /// Distance to its walls.
    pub walls: Option<&'a DistanceField>,
    /// Distance to its no-fly zones; `None` without one.
    pub zones: Option<&'a DistanceField>,
}

/// What is wished.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wish {
    /// Plan frame, m/s.
    pub velocity: Vector,
    /// It only leads back to a place that was left a moment ago, within an arm's length: slowly it may where no sonar looks,
    /// because to drift is worse.
    pub back: bool,
}

impl Wish {
    /// To somewhere.
    #[must_use]
    pub fn to(velocity: Vector) -> Self {
        Self { velocity, back: false }
    }
}

/// What the shield made of a wish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded {
    /// To be flown, plan frame.
    pub velocity: Vector,
    /// Speed that can still be stopped in the wished direction, m/s.
    pub allowed_m_s: f32,
    /// Whether less than the wish is left.
    pub limited: bool,
}

/// The shield.
#[derive(Clone, Debug)]
pub struct Shield {
    config: ShieldConfig,
    radius_m: f32,
    sensors: [Option<Sensor>; MAX_SENSORS],
    remembered: Remembered,
    grid: grid::Grid,
    glances: Glances,
    sweep_s: f32,
    more_s: f32,
}

impl Shield {
    /// For a disc of this radius and sonars given by index, azimuth of the axis (body frame, counter-clockwise
    /// from forward) and position of the face (body frame). Sonars that look down do not belong here.
    pub fn new(
        config: ShieldConfig,
        radius_m: f32,
        sonars: impl IntoIterator<Item = (usize, f32, Vector)>,
    ) -> Self {
        let mut sensors = [None; MAX_SENSORS];
        for (index, bearing, mount) in sonars {
            if let Some(slot) = sensors.get_mut(index) {
                *slot = Some(Sensor::new(bearing, mount));
            }
        }
        Self {
            config,
            radius_m,
            sensors,
            remembered: Remembered::new(),
            grid: grid::Grid::new(),
            glances: Glances::new(),
            sweep_s: 0.24,
            more_s: 0.0,
        }
    }

    /// Forgets what was heard a moment ago: the place is another one, and it lies elsewhere.
    pub fn forget(&mut self) {
        self.remembered = Remembered::new();
        self.grid = grid::Grid::new();
        self.glances = Glances::new();
    }

    /// Takes navigation's certainty grid, for a drone at `place`.
    pub fn see(&mut self, at_ns: u64, place: Vector, grid: &GridView<'_>) {
        self.grid.see(at_ns, place, grid, self.config.grid_stands);
    }

    /// Sets by how much the messages are later than usual ([`Delay`]), seconds.
    pub fn set_delay(&mut self, more_s: f32) {
        self.more_s = if more_s.is_finite() { more_s.clamp(0.0, 2.0) } else { 2.0 };
    }

    /// Sets the period of a whole sweep through all sonars, seconds.
    pub fn set_sweep(&mut self, sweep_s: f32) {
        if sweep_s.is_finite() {
            self.sweep_s = sweep_s.clamp(0.05, 2.0);
        }
    }

    /// The braking law at the present sweep and the measured delay.
    #[must_use]
    pub fn braking(&self) -> Braking {
        Braking {
            delay_s: self.sweep_s + self.config.reaction_s + self.more_s,
            deceleration_m_s2: self.config.deceleration_m_s2,
        }
    }
}
