//! Who the controller is and how it numbers things.

use crate::reader::{Reader, TooShort};
use crate::request::{Layout, Request};

/// MSP_API_VERSION.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ApiVersion;
/// Answer to [`ApiVersion`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ApiVersionReply {
    /// Version of the protocol itself.
    pub protocol: u8,
    /// Major version of the messages.
    pub major: u8,
    /// Minor version of the messages.
    pub minor: u8,
}
impl Request for ApiVersion {
    const CODE: u16 = 1;
    type Reply<'a> = ApiVersionReply;
}
impl Layout<'_> for ApiVersionReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { protocol: reader.u8()?, major: reader.u8()?, minor: reader.u8()? })
    }
}

/// MSP_FC_VARIANT.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FcVariant;
/// Answer to [`FcVariant`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FcVariantReply {
    /// Four ASCII letters: `BTFL`, `INAV`.
    pub letters: [u8; 4],
}
impl Request for FcVariant {
    const CODE: u16 = 2;
    type Reply<'a> = FcVariantReply;
}
impl Layout<'_> for FcVariantReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { letters: reader.array()? })
    }
}

/// MSP_FC_VERSION.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FcVersion;
/// Answer to [`FcVersion`]: 4.5.6 or 25.12.6; newer firmware appends a text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FcVersionReply {
    /// Major number, or the year since 2000.
    pub major: u8,
    /// Minor number, or the month.
    pub minor: u8,
    /// Patch.
    pub patch: u8,
}
impl Request for FcVersion {
    const CODE: u16 = 3;
    type Reply<'a> = FcVersionReply;
}
impl Layout<'_> for FcVersionReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { major: reader.u8()?, minor: reader.u8()?, patch: reader.u8()? })
    }
}

/// MSP_RX_MAP.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RxMap;
/// Answer to [`RxMap`]: where roll, pitch, YAW, THROTTLE, AUX1... stand in the receiver's order, which is the
/// order of [`SetRawRc`](super::SetRawRc). AETR is 0 1 3 2. Betaflight sends 8, INAV 4.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RxMapReply {
    /// Positions; the first `count` are filled.
    pub positions: [u8; 8],
    /// 4..=8.
    pub count: u8,
}
impl Request for RxMap {
    const CODE: u16 = 64;
    type Reply<'a> = RxMapReply;
}
impl Layout<'_> for RxMapReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        let mut positions = [0; 8];
        let count = reader.left().clamp(4, 8);
        for (slot, byte) in positions.iter_mut().zip(reader.bytes(count)?) {
            *slot = *byte;
        }
        Ok(Self { positions, count: count as u8 })
    }
}

/// MSP_BOXIDS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoxIds;
/// Answer to [`BoxIds`]: the mode bits of a status are indices into this list, not ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxIdsReply<'a> {
    /// Permanent ids: 0 ARM, 1 ANGLE, 27 FAILSAFE, 50 MSP OVERRIDE.
    pub ids: &'a [u8],
}
impl Request for BoxIds {
    const CODE: u16 = 119;
    type Reply<'a> = BoxIdsReply<'a>;
}
impl<'a> Layout<'a> for BoxIdsReply<'a> {
    fn read(reader: &mut Reader<'a>) -> Result<Self, TooShort> {
        Ok(Self { ids: reader.rest() })
    }
}

/// MSP_BOXNAMES.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoxNames;
/// Answer to [`BoxNames`]: names in the order of [`BoxIds`], each ended by a semicolon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxNamesReply<'a> {
    /// ASCII.
    pub text: &'a [u8],
}
impl<'a> BoxNamesReply<'a> {
    /// The names; those that are not text are empty.
    pub fn names(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let text = self.text.strip_suffix(b";").unwrap_or(self.text);
        text.split(|byte| *byte == b';').map(|name| core::str::from_utf8(name).unwrap_or(""))
    }
}
impl Request for BoxNames {
    const CODE: u16 = 116;
    type Reply<'a> = BoxNamesReply<'a>;
}
impl<'a> Layout<'a> for BoxNamesReply<'a> {
    fn read(reader: &mut Reader<'a>) -> Result<Self, TooShort> {
        Ok(Self { text: reader.rest() })
    }
}
