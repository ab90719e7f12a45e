//! What the controller said, and the questions on the wire.

use crate::schedule::Question;
use msp::messages::{
    Analog, AnalogReply, ApiVersion, Attitude, AttitudeAndImu, AttitudeReply, BoxIds, FcVariant, FcVersion,
    Motor, RawImuReply, Rc, RxMap, Status, StatusReply,
};
use msp::{EncodeError, Request, Version, encode_request};

/// Who the controller is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Identity {
    /// `BTFL`, `INAV`; zero before it is known.
    pub variant: [u8; 4],
    /// Major, minor, patch, 0.
    pub version: [u8; 4],
    /// Minor version of the MSP messages.
    pub api: Option<(u8, u8)>,
}

/// An attitude and when it was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttitudeSample {
    /// When the controller read it, by the time that the answer is on the way.
    pub sampled_ns: u64,
    /// In the controller's frame.
    pub reply: AttitudeReply,
    /// The accelerometer, when the firmware gives both at once.
    pub imu: Option<RawImuReply>,
}

/// The newest of everything that the controller said. Taken fields are set anew by each answer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Said {
    /// Taken by the publisher.
    pub attitude: Option<AttitudeSample>,
    /// Taken by the publisher.
    pub analog: Option<AnalogReply>,
    /// The newest status and when it came.
    pub status: Option<(u64, StatusReply)>,
    /// Statuses so far.
    pub statuses: u32,
    /// Motor outputs.
    pub motors_us: [u16; 8],
    /// Throttle as the controller has it.
    pub throttle_us: Option<u16>,
    /// The controller refused a frame of channels: its receiver is not MSP.
    pub channels_refused: bool,
    /// The receiver's order makes no sense.
    pub order_broken: bool,
}

/// Counts since the port opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames of channels sent.
    pub frames: u32,
    /// Answers that belong to a question or a frame.
    pub answers: u32,
    /// Broken, too short or unasked for.
    pub refused: u32,
    /// Bytes that belong to no frame.
    pub junk: u32,
}

/// Writes a question to the front of `out` and returns its length; the attitude with the accelerometer when `imu`.
pub(crate) fn write(
    question: Question,
    version: Version,
    imu: bool,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    match question {
        Question::Status => encode_request(out, version, &Status),
        Question::Map => encode_request(out, version, &RxMap),
        Question::Rc => encode_request(out, version, &Rc),
        Question::Attitude if imu => encode_request(out, version, &AttitudeAndImu),
        Question::Attitude => encode_request(out, version, &Attitude),
        Question::Api => encode_request(out, version, &ApiVersion),
        Question::Variant => encode_request(out, version, &FcVariant),
        Question::Version => encode_request(out, version, &FcVersion),
        Question::Boxes => encode_request(out, version, &BoxIds),
        Question::Analog => encode_request(out, version, &Analog),
        Question::Motor => encode_request(out, version, &Motor),
    }
}

/// The question that an answer with this code belongs to.
pub(crate) fn question_of(code: u16) -> Option<Question> {
    Some(match code {
        Status::CODE => Question::Status,
        RxMap::CODE => Question::Map,
        Rc::CODE => Question::Rc,
        Attitude::CODE | AttitudeAndImu::CODE => Question::Attitude,
        ApiVersion::CODE => Question::Api,
        FcVariant::CODE => Question::Variant,
        FcVersion::CODE => Question::Version,
        BoxIds::CODE => Question::Boxes,
        Analog::CODE => Question::Analog,
        Motor::CODE => Question::Motor,
        _ => return None,
    })
}
