//! Flight control laws, the shield, arbitration and the failsafe table.
//!
//! Everything here is arithmetic on what it is given: no clock, no I/O, no allocation after construction.
//! Time is nanoseconds of whatever monotonic clock the caller lives by, or a step in seconds.
//! Frames: plan frame x right, y up, heading counter-clockwise; body x forward, y left; roll right side down
//! positive, pitch nose down positive (so that a positive pitch accelerates forward and a positive roll to the
//! right). Angles in radians, everything else SI, radio channels in microseconds.
#![forbid(unsafe_code)]

mod arbitration;
mod check;
mod climb;
mod doubts;
mod failsafe;
mod floor_trail;
mod heading;
mod height;
mod held;
mod lease;
mod liftoff;
mod motion;
mod planar;
mod position;
mod shield;
pub mod stick;
mod touchdown;
mod velocity;
mod way_home;

pub use arbitration::{Asking, Source, arbitrate};
pub use check::RangeError;
pub use climb::{ClimbConfig, ClimbController, VerticalWish};
pub use failsafe::{
    Action, Cause, Clears, Condition, Evidence, Failsafe, Flags, Judgement, Loss, Memory, OperatorLost,
    Policy, Row, Stage, TABLE, TakeOver, judge, page as failsafe_page,
};
pub use floor_trail::FloorTrail;
pub use heading::{HeadingConfig, yaw_rate};
pub use height::{Echo as HeightEcho, HeightConfig, HeightEstimator};
pub use held::Held;
pub use lease::{Axes, Flip, Hand, Heard as SticksHeard, Lease, StickInput, Terms, Under};
pub use liftoff::{Liftoff, LiftoffConfig, SpoolUp};
pub use motion::{Motion, MotionConfig};
pub use planar::{Vector, wrap_angle};
pub use position::{HoldConfig, hold_velocity};
pub use shield::{
    Braking, Delay, Echo, Footing, GridView, Guarded, Look, MAX_SENSORS, Shield, ShieldConfig, Surroundings,
    Wish,
};
pub use touchdown::{TouchDown, TouchDownConfig};
pub use velocity::{Flown, Tilt, VelocityConfig, VelocityController};
pub use way_home::WayHome;

/// Standard gravity, m/s2.
pub const GRAVITY_M_S2: f32 = 9.806_65;
