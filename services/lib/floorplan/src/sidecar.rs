mod check;

use serde::{Deserialize, Serialize};

use crate::PlanError;

/// What a plan's picture cannot say: where the pad is, what the doors and rooms are called. A yaml file
/// beside the header (`demo.yaml` has `demo.rooms.yaml`); every key may be left out.
///
/// ```yaml
/// pad: {x: 1.5, y: 2.0, heading_deg: 90}
/// doors:
///   - {name: Office 1, a: [3.0, 4.0], b: [3.9, 4.0]}
/// rooms:
///   - {name: Office 1, rectangle: [0.0, 4.0, 5.0, 8.0]}
///   - {name: Store, polygon: [[5, 4], [9, 4], [9, 8]]}
/// no_fly:
///   - {name: Server rack, rectangle: [7.0, 5.0, 8.0, 6.0]}
/// privacy:
///   - {name: Washroom, rectangle: [9.0, 0.0, 11.0, 3.0]}
/// round:
///   order: [Store]
///   leave_out: [Office 1]
///   points:
///     - {name: Safe, x: 8.2, y: 7.1}
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sidecar {
    /// Where the vehicle starts and lands.
    pub pad: Option<Pad>,
    /// Openings that can be shut.
    pub doors: Vec<Door>,
    /// Named areas; where they overlap the first one counts.
    pub rooms: Vec<NamedArea>,
    /// Areas that the vehicle must not enter in flight.
    pub no_fly: Vec<NamedArea>,
    /// Areas that no camera may show.
    pub privacy: Vec<NamedArea>,
    /// How the building is to be looked at.
    pub round: RoundOrder,
}

/// What the guard wants of a round; without anything it shows every room by the shortest way.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct RoundOrder {
    /// Rooms that come first, in this order; all others after them, as is shortest.
    pub order: Vec<String>,
    /// Rooms that are not looked at. They may be flown through.
    pub leave_out: Vec<String>,
    /// Places that are flown to in any case.
    pub points: Vec<RoundPoint>,
}

/// A place of the round.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RoundPoint {
    /// As people call it.
    pub name: String,
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
}

/// Where the vehicle starts and lands.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Pad {
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// Which way the vehicle looks when it is put down: degrees, counter-clockwise from plan x.
    #[serde(default)]
    pub heading_deg: f32,
}

/// An opening that can be shut: the line between its two posts.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Door {
    /// As people call it.
    pub name: String,
    /// The post with the hinges, plan frame, metres.
    pub a: (f32, f32),
    /// The other post, plan frame, metres.
    pub b: (f32, f32),
}

/// A named part of the plan.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NamedArea {
    /// As people call it.
    pub name: String,
    /// Its outline.
    #[serde(flatten)]
    pub area: Area,
}

/// An outline in the plan frame, metres.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Area {
    /// Two opposite corners: x, y, x, y.
    Rectangle([f32; 4]),
    /// Three corners or more, in order.
    Polygon(Vec<(f32, f32)>),
}

impl Pad {
    /// Heading in radians.
    pub fn heading_rad(&self) -> f32 {
        self.heading_deg.to_radians()
    }
}

impl Door {
    /// Clear width, metres.
    pub fn width(&self) -> f32 {
        (self.a.0 - self.b.0).hypot(self.a.1 - self.b.1)
    }

    /// The middle of the opening, plan frame.
    pub fn middle(&self) -> (f32, f32) {
        (0.5 * (self.a.0 + self.b.0), 0.5 * (self.a.1 + self.b.1))
    }

    /// Metres from a place to the line between the posts.
    pub fn distance(&self, x: f32, y: f32) -> f32 {
        let (dx, dy) = (self.b.0 - self.a.0, self.b.1 - self.a.1);
        let length = (dx * dx + dy * dy).max(f32::MIN_POSITIVE);
        let t = (((x - self.a.0) * dx + (y - self.a.1) * dy) / length).clamp(0.0, 1.0);
        (x - self.a.0 - t * dx).hypot(y - self.a.1 - t * dy)
    }
}

impl Area {
    /// The middle of its corners, plan frame.
    pub fn middle(&self) -> (f32, f32) {
        match self {
            Self::Rectangle([ax, ay, bx, by]) => (0.5 * (ax + bx), 0.5 * (ay + by)),
            Self::Polygon(corners) => {
                let count = corners.len().max(1) as f32;
                let (x, y) =
                    corners.iter().fold((0.0, 0.0), |sum, corner| (sum.0 + corner.0, sum.1 + corner.1));
                (x / count, y / count)
            }
        }
    }

    /// Whether a place lies inside.
    pub fn contains(&self, x: f32, y: f32) -> bool {
        match self {
            Self::Rectangle([ax, ay, bx, by]) => {
                x >= ax.min(*bx) && x <= ax.max(*bx) && y >= ay.min(*by) && y <= ay.max(*by)
            }
            Self::Polygon(corners) => {
                // Even-odd rule: a ray to the right crosses the outline an odd number of times.
                let edges = corners.iter().zip(corners.iter().cycle().skip(1));
                edges
                    .filter(|((ax, ay), (bx, by))| {
                        (*ay > y) != (*by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
                    })
                    .count()
                    % 2
                    == 1
            }
        }
    }

    fn coordinates(&self) -> Vec<f32> {
        match self {
            Self::Rectangle(corners) => corners.to_vec(),
            Self::Polygon(corners) => corners.iter().flat_map(|(x, y)| [*x, *y]).collect(),
        }
    }
}

impl Sidecar {
    /// Reads the yaml of `file` (its name is for messages only).
    ///
    /// # Errors
    /// Unreadable yaml, unknown keys, names missing or used twice, coordinates that are not numbers.
    pub fn parse(file: &str, yaml: &[u8]) -> Result<Self, PlanError> {
        let sidecar: Self =
            serde_saphyr::from_slice(yaml).map_err(|error| PlanError::syntax(file, &error))?;
        sidecar.checked(file)
    }

    /// One that came by another way than a file of yaml, with its names tidied.
    ///
    /// # Errors
    /// As [`Sidecar::parse`].
    pub fn checked(mut self, file: &str) -> Result<Self, PlanError> {
        // "Store" and "Store " are one name to whoever reads them.
        let doors = self.doors.iter_mut().map(|door| &mut door.name);
        let areas = self.rooms.iter_mut().chain(&mut self.no_fly).chain(&mut self.privacy);
        let round = self.round.order.iter_mut().chain(&mut self.round.leave_out);
        let points = self.round.points.iter_mut().map(|point| &mut point.name);
        for name in areas.map(|area| &mut area.name).chain(doors).chain(round).chain(points) {
            *name = name.trim().to_owned();
        }
        self.check(file)?;
        Ok(self)
    }

    /// The yaml that [`Sidecar::parse`] reads; `file` is named in errors only.
    ///
    /// # Errors
    /// When it cannot be written: never for one that was checked.
    pub fn yaml(&self, file: &str) -> Result<String, PlanError> {
        serde_saphyr::to_string(self).map_err(|error| PlanError::unwritable(file, &error))
    }
}
