//! The manifest: what the system is made of, what flows between its services, and the checks that it holds
//! together. Also the vehicle file, which says what is flown.
//!
//! Pure: texts come in, structures and errors go out. Whoever opens the files says how they are called, so
//! that every error names file, field, value and what is allowed.
#![forbid(unsafe_code)]

mod check;
mod error;
mod graph;
mod model;
mod raw;
mod vehicle;

pub use error::{ManifestError, VehicleError, one_line, plain};
pub use model::{
    Criticality, Manifest, Publication, Restart, RestartPolicy, ServiceEntry, Subscription, System,
    ToolEntry, Topic,
};
pub use vehicle::{Battery, Body, CameraMount, FlowSensor, Limits, Motors, SonarMount, Vehicle};
