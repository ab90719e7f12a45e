//! Fires the sonars in groups that cannot hear each other, and says of each reading and each sensor what
//! it is worth.
//!
//! Thesis 3.2 fires one sensor after another: five sensors then give 3 Hz, its author's main obstacle.
//! Sensors that look well apart do not hear each other, so they are fired together ([`Schedule`]).

mod config;
mod driver;
mod health;
mod range;
mod schedule;
mod service;
mod simulated;

pub use config::SonarConfig;
pub use driver::{Answer, Collected, SonarDriver};
pub use health::{HealthRules, SensorHealth};
pub use range::{Converted, Converter};
pub use schedule::{Schedule, ScheduleError};
pub use service::Sonar;
