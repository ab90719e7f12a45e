use serde::Deserialize;

use crate::PlanError;
use crate::rooms::MAX_ROOMS;

/// Most doors of a sidecar file.
const MAX_DOORS: usize = 256;
/// Most areas that must not be entered.
const MAX_NO_FLY: usize = 64;
/// Farthest coordinate, metres, as for the origin of a plan.
const MAX_COORDINATE_M: f32 = 10_000.0;

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
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
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
}

/// Where the vehicle starts and lands.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
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
#[derive(Clone, Debug, PartialEq, Deserialize)]
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
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedArea {
    /// As people call it.
    pub name: String,
    /// Its outline.
    #[serde(flatten)]
    pub area: Area,
}

/// An outline in the plan frame, metres.
#[derive(Clone, Debug, PartialEq, Deserialize)]
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
        let mut sidecar: Self =
            serde_saphyr::from_slice(yaml).map_err(|error| PlanError::syntax(file, &error))?;
        // "Store" and "Store " are one name to whoever reads them.
        let doors = sidecar.doors.iter_mut().map(|door| &mut door.name);
        let areas = sidecar.rooms.iter_mut().chain(&mut sidecar.no_fly);
        for name in areas.map(|area| &mut area.name).chain(doors) {
            *name = name.trim().to_owned();
        }
        sidecar.check(file)?;
        Ok(sidecar)
    }

    fn check(&self, file: &str) -> Result<(), PlanError> {
        if self.rooms.len() > MAX_ROOMS {
            return Err(PlanError::range(
                file,
                "rooms",
                &format!("{} rooms", self.rooms.len()),
                "at most 48",
            ));
        }
        if self.doors.len() > MAX_DOORS {
            return Err(PlanError::range(
                file,
                "doors",
                &format!("{} doors", self.doors.len()),
                "at most 256",
            ));
        }
        if let Some(pad) = &self.pad {
            for (field, value) in [("pad.x", pad.x), ("pad.y", pad.y)] {
                check_coordinate(file, field, value)?;
            }
            if !(-360.0..=360.0).contains(&pad.heading_deg) {
                return Err(PlanError::range(
                    file,
                    "pad.heading_deg",
                    &pad.heading_deg,
                    "-360 to 360 degrees",
                ));
            }
        }
        for door in &self.doors {
            let field = format!("doors: {}", door.name);
            check_name(file, "doors.name", &door.name)?;
            for value in [door.a.0, door.a.1, door.b.0, door.b.1] {
                check_coordinate(file, &field, value)?;
            }
            if !(0.3..=10.0).contains(&door.width()) {
                return Err(PlanError::range(
                    file,
                    &field,
                    &format!("{:.2} m wide", door.width()),
                    "0.3 to 10 m",
                ));
            }
        }
        check_areas(file, "rooms", &self.rooms)?;
        if self.no_fly.len() > MAX_NO_FLY {
            let said = format!("{} areas", self.no_fly.len());
            return Err(PlanError::range(file, "no_fly", &said, "at most 64"));
        }
        check_areas(file, "no_fly", &self.no_fly)?;
        let closed = |pad: &Pad| self.no_fly.iter().find(|zone| zone.area.contains(pad.x, pad.y));
        if let Some(zone) = self.pad.as_ref().and_then(closed) {
            let said = format!("in the no-fly zone {}", zone.name);
            return Err(PlanError::range(file, "pad", &said, "outside every no-fly zone"));
        }
        Ok(())
    }
}

fn check_areas(file: &str, key: &str, areas: &[NamedArea]) -> Result<(), PlanError> {
    for (k, named) in areas.iter().enumerate() {
        let field = format!("{key}: {}", named.name);
        check_name(file, &format!("{key}.name"), &named.name)?;
        if areas[..k].iter().any(|other| other.name == named.name) {
            return Err(PlanError::range(file, &field, &"used twice", "one area a name"));
        }
        if let Area::Polygon(corners) = &named.area
            && !(3..=256).contains(&corners.len())
        {
            let said = format!("{} corners", corners.len());
            return Err(PlanError::range(file, &field, &said, "3 to 256"));
        }
        for value in named.area.coordinates() {
            check_coordinate(file, &field, value)?;
        }
    }
    Ok(())
}

fn check_name(file: &str, field: &str, name: &str) -> Result<(), PlanError> {
    // What fits the page and the messages.
    if (1..=31).contains(&name.len()) && !name.chars().any(char::is_control) {
        return Ok(());
    }
    Err(PlanError::range(file, field, &format!("{name:?}"), "1 to 31 bytes of text"))
}

fn check_coordinate(file: &str, field: &str, value: f32) -> Result<(), PlanError> {
    if value.abs() <= MAX_COORDINATE_M {
        return Ok(());
    }
    Err(PlanError::range(file, field, &value, "-10000 to 10000 m"))
}
