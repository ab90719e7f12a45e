use serde::Deserialize;
use serde::de::{Deserializer, Error as _, Visitor};

use crate::PlanError;

/// Smallest and largest side of a cell in metres: finer than a sonar resolves, coarser than a door frame.
const RESOLUTION_M: std::ops::RangeInclusive<f64> = 0.01..=0.5;
/// Farthest origin in metres: beyond it an `f32` no longer resolves a millimetre.
const MAX_ORIGIN_M: f64 = 5_000.0;

/// How the shades of the picture are read (ROS map_server's `mode`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureMode {
    /// Dark is occupied, light is free, between the thresholds is unknown. Transparency is not looked at.
    #[default]
    Trinary,
    /// As trinary, and what is transparent is unknown.
    Scale,
    /// The value is the occupancy in percent, 0 to 100; anything above is unknown. `negate` does not apply.
    Raw,
}

/// The yaml header of a plan, as ROS map_server writes it. Keys that it does not know are ignored: other
/// programs add their own.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanHeader {
    /// The picture's file name, relative to the header.
    pub image: String,
    /// Side of a cell, metres.
    pub resolution: f64,
    /// Plan-frame x and y of the lower left corner of the picture, metres; yaw, always 0.
    pub origin: [f64; 3],
    /// Light is occupied instead of dark.
    pub negate: bool,
    /// At this occupancy or above a cell is occupied, 0..1.
    pub occupied_thresh: f64,
    /// At this occupancy or below a cell is free, 0..1.
    pub free_thresh: f64,
    /// How shades are read.
    pub mode: PictureMode,
}

#[derive(Deserialize)]
struct Raw {
    image: Option<String>,
    resolution: Option<f64>,
    origin: Option<Vec<f64>>,
    #[serde(default, deserialize_with = "flag")]
    negate: bool,
    // map_server's own defaults.
    occupied_thresh: Option<f64>,
    free_thresh: Option<f64>,
    #[serde(default)]
    mode: PictureMode,
}

impl PlanHeader {
    /// Reads the yaml of `file` (its name is for messages only).
    ///
    /// # Errors
    /// Unreadable yaml, a missing `image` or `resolution`, values out of range, an origin with a yaw.
    pub fn parse(file: &str, yaml: &[u8]) -> Result<Self, PlanError> {
        let raw: Raw = serde_saphyr::from_slice(yaml).map_err(|error| PlanError::syntax(file, &error))?;
        let missing = |field, hint| PlanError::Missing { file: file.to_owned(), field, hint };
        let image = raw
            .image
            .filter(|image| !image.trim().is_empty())
            .ok_or_else(|| missing("image", "the file name of the picture"))?;
        let resolution = raw
            .resolution
            .ok_or_else(|| missing("resolution", "the side of a cell in metres, such as 0.05"))?;
        if !RESOLUTION_M.contains(&resolution) {
            return Err(PlanError::range(file, "resolution", &resolution, "0.01 to 0.5 m a cell"));
        }
        let origin = raw.origin.ok_or_else(|| missing("origin", "x, y and yaw of the lower left corner"))?;
        let [x, y, yaw] = match origin.as_slice() {
            [x, y] => [*x, *y, 0.0],
            [x, y, yaw] => [*x, *y, *yaw],
            other => {
                return Err(PlanError::range(
                    file,
                    "origin",
                    &format!("{} numbers", other.len()),
                    "[x, y, yaw]",
                ));
            }
        };
        for value in [x, y] {
            if !(-MAX_ORIGIN_M..=MAX_ORIGIN_M).contains(&value) {
                return Err(PlanError::range(file, "origin", &value, "-5000 to 5000 m"));
            }
        }
        // Written by hand or by a program, zero is zero to a few digits.
        if !(-1e-6..=1e-6).contains(&yaw) {
            return Err(PlanError::Turned { file: file.to_owned(), yaw_rad: yaw });
        }
        let occupied_thresh = raw.occupied_thresh.unwrap_or(0.65);
        let free_thresh = raw.free_thresh.unwrap_or(0.196);
        for (field, value) in [("occupied_thresh", occupied_thresh), ("free_thresh", free_thresh)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(PlanError::range(file, field, &value, "0 to 1"));
            }
        }
        if free_thresh >= occupied_thresh {
            return Err(PlanError::range(file, "free_thresh", &free_thresh, "below occupied_thresh"));
        }
        Ok(Self {
            image,
            resolution,
            origin: [x, y, 0.0],
            negate: raw.negate,
            occupied_thresh,
            free_thresh,
            mode: raw.mode,
        })
    }
}

/// `negate` is 0 or 1 in most files and true or false in some.
fn flag<'de, D: Deserializer<'de>>(deserializer: D) -> Result<bool, D::Error> {
    struct Flag;
    impl Visitor<'_> for Flag {
        type Value = bool;
        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("0, 1, true or false")
        }
        fn visit_bool<E>(self, value: bool) -> Result<bool, E> {
            Ok(value)
        }
        fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<bool, E> {
            match value {
                0 => Ok(false),
                1 => Ok(true),
                other => Err(E::custom(format!("negate is {other}, allowed is 0 or 1"))),
            }
        }
        fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<bool, E> {
            u64::try_from(value)
                .map_err(|_| E::custom("negate is negative, allowed is 0 or 1"))
                .and_then(|v| self.visit_u64(v))
        }
    }
    deserializer.deserialize_any(Flag).map_err(D::Error::custom)
}
