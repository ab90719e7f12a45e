//! The messages that Sereno uses, one type each.

mod command;
mod identity;
mod sensor;
mod status;
mod telemetry;

pub use command::{CHANNEL_MAX_US, CHANNEL_MIN_US, MAX_CHANNELS, MAX_MOTORS, Refusal, SetMotor, SetRawRc};
pub use identity::{
    ApiVersion, ApiVersionReply, BoxIds, BoxIdsReply, BoxNames, BoxNamesReply, FcVariant, FcVariantReply,
    FcVersion, FcVersionReply, RxMap, RxMapReply,
};
pub use sensor::{FlowFrame, RangeFrame};
pub use status::{Arming, Status, StatusEx, StatusReply};
pub use telemetry::{
    Altitude, AltitudeReply, Analog, AnalogReply, Attitude, AttitudeAndImu, AttitudeAndImuReply,
    AttitudeReply, FailsafeConfig, FailsafeConfigReply, Motor, MotorReply, RawImu, RawImuReply, Rc, RcReply,
};
