//! World files: what stands in a building besides its plan.

use super::solid::Surface;
use manifest::plain;
use serde::Deserialize;
use thiserror::Error;

/// What is wrong with a world.
#[derive(Debug, Error, PartialEq)]
pub enum WorldError {
    /// The file is not TOML of a world, or names a key that worlds do not have.
    #[error("{file}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// What the parser says, on one line.
        message: String,
    },
    /// A value out of its range.
    #[error("{file}: {field} is {value}; allowed: {allowed}")]
    Range {
        /// The file.
        file: String,
        /// The key, with the name of its object.
        field: String,
        /// What it says.
        value: String,
        /// What it may say.
        allowed: &'static str,
    },
    /// A door of the world file that the plan's side file does not know.
    #[error("{file}: door \"{name}\" is not in the plan's list of doors (known: {known})")]
    UnknownDoor {
        /// The file.
        file: String,
        /// The door.
        name: String,
        /// The doors that there are.
        known: String,
    },
    /// The plan has no free cell.
    #[error("the plan has no free cell")]
    NoFreeSpace,
    /// Neither the world file nor the plan's side file says where the pad is.
    #[error("no pad: neither the world file nor the plan's side file says where the drone starts")]
    NoPad,
    /// The pad is not in free space.
    #[error("the pad at ({x:.2}, {y:.2}) is {what}")]
    PadBlocked {
        /// Plan frame, metres.
        x: f32,
        /// Plan frame, metres.
        y: f32,
        /// What is there.
        what: String,
    },
}

/// Longest name, bytes: what a line of a report can show.
const LONGEST_NAME: usize = 64;

/// A world file: solids, tables, carpets, doors and people that stand in a planned building.
/// Lengths are metres, angles degrees counter-clockwise, places in the plan frame.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorldFile {
    /// Name for people.
    pub name: String,
    /// Hash of the plan for which these things are placed, as `about` says it; on any other plan there are none of them. They
    /// stand on every plan when left out.
    pub plan_hash: Option<String>,
    /// Height of the ceiling; 2.6 when left out.
    pub ceiling_m: Option<f32>,
    /// Height of the wall's underside over doors; 2.03 when left out.
    pub lintel_m: Option<f32>,
    /// Where the drone starts and lands; the plan's side file says it when left out.
    pub pad: Option<PadEntry>,
    /// Boxes and cylinders.
    pub solid: Vec<SolidEntry>,
    /// Tables: a top on four legs.
    pub table: Vec<TableEntry>,
    /// Carpets and mats: soft ground over which the down sonar lies.
    pub carpet: Vec<CarpetEntry>,
    /// Doors of the plan that are shut.
    pub door: Vec<DoorEntry>,
    /// People who walk given ways.
    pub person: Vec<PersonEntry>,
    /// The file's name, for messages.
    #[serde(skip)]
    pub file: String,
}

/// Where the drone starts and lands.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PadEntry {
    /// Centre.
    pub x_m: f32,
    /// Centre.
    pub y_m: f32,
    /// Heading of the drone at the start.
    #[serde(default)]
    pub heading_deg: f32,
}

/// What a solid looks like from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeWord {
    /// `length_m` by `width_m`, turned by `yaw_deg`.
    Box,
    /// Of `radius_m`.
    Cylinder,
}

/// A box or a cylinder.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidEntry {
    /// Name for people.
    pub name: String,
    /// Box or cylinder.
    pub shape: ShapeWord,
    /// Centre.
    pub x_m: f32,
    /// Centre.
    pub y_m: f32,
    /// Turn of a box.
    #[serde(default)]
    pub yaw_deg: f32,
    /// Size of a box along its own x.
    pub length_m: Option<f32>,
    /// Size of a box along its own y.
    pub width_m: Option<f32>,
    /// Radius of a cylinder.
    pub radius_m: Option<f32>,
    /// Lowest point above the floor.
    #[serde(default)]
    pub bottom_m: f32,
    /// Highest point above the floor.
    pub top_m: f32,
    /// How it answers a sonar.
    #[serde(default = "hard")]
    pub surface: Surface,
}

fn hard() -> Surface {
    Surface::Hard
}

/// A table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableEntry {
    /// Name for people.
    pub name: String,
    /// Centre.
    pub x_m: f32,
    /// Centre.
    pub y_m: f32,
    /// Turn.
    #[serde(default)]
    pub yaw_deg: f32,
    /// Size along its own x.
    pub length_m: f32,
    /// Size along its own y.
    pub width_m: f32,
    /// Height of the top's upper side.
    #[serde(default = "table_height")]
    pub top_m: f32,
}

fn table_height() -> f32 {
    0.75
}

/// A carpet or mat.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarpetEntry {
    /// Name for people.
    pub name: String,
    /// Centre.
    pub x_m: f32,
    /// Centre.
    pub y_m: f32,
    /// Turn.
    #[serde(default)]
    pub yaw_deg: f32,
    /// Size along its own x.
    pub length_m: f32,
    /// Size along its own y.
    pub width_m: f32,
    /// How thick it is.
    #[serde(default = "carpet_thickness")]
    pub thickness_m: f32,
}

fn carpet_thickness() -> f32 {
    0.02
}

/// A door of the plan that is shut, in this world, on every flight.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DoorEntry {
    /// As the plan's side file calls it.
    pub name: String,
}

/// A person who walks a given way.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PersonEntry {
    /// Name for people.
    pub name: String,
    /// Walking speed, metres a second.
    pub speed_m_s: f32,
    /// Places to walk to, one after the other.
    pub way: Vec<[f32; 2]>,
    /// Whether the last place leads to the first again; otherwise the person walks back.
    #[serde(default)]
    pub circle: bool,
}

impl WorldFile {
    /// Reads and checks a world file. `file` is its name for messages.
    ///
    /// # Errors
    /// [`WorldError::Syntax`] for TOML that is not a world, [`WorldError::Range`] for values that make no sense.
    pub fn parse(file: &str, text: &str) -> Result<Self, WorldError> {
        let mut world: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            let message = plain(&error.message().replace('\n', " "));
            let message = line.map_or(message.clone(), |line| format!("line {line}: {message}"));
            WorldError::Syntax { file: file.to_owned(), message }
        })?;
        world.check(file)?;
        file.clone_into(&mut world.file);
        Ok(world)
    }

    /// All names, each with the key that it stands under.
    fn names(&self) -> impl Iterator<Item = (&'static str, &str)> {
        std::iter::once(("name", self.name.as_str()))
            .chain(self.solid.iter().map(|solid| ("solid.name", solid.name.as_str())))
            .chain(self.table.iter().map(|table| ("table.name", table.name.as_str())))
            .chain(self.carpet.iter().map(|carpet| ("carpet.name", carpet.name.as_str())))
            .chain(self.door.iter().map(|door| ("door.name", door.name.as_str())))
            .chain(self.person.iter().map(|person| ("person.name", person.name.as_str())))
    }

    fn check(&self, file: &str) -> Result<(), WorldError> {
        let range = |field: String, value: f32, low: f32, high: f32, allowed: &'static str| {
            if value.is_finite() && (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(WorldError::Range { file: file.to_owned(), field, value: format!("{value}"), allowed })
            }
        };
        let place = |name: &str, x: f32, y: f32, yaw: f32| {
            range(format!("{name}: x_m"), x, -1000.0, 1000.0, "-1000 to 1000 m")?;
            range(format!("{name}: y_m"), y, -1000.0, 1000.0, "-1000 to 1000 m")?;
            range(format!("{name}: angle"), yaw, -360.0, 360.0, "-360 to 360 degrees")
        };
        let size = |name: &str, key: &str, value: f32| {
            range(format!("{name}: {key}"), value, 0.01, 50.0, "0.01 to 50 m")
        };
        self.names().try_for_each(|(field, name)| {
            if name.len() <= LONGEST_NAME && !name.chars().any(char::is_control) {
                return Ok(());
            }
            let (field, value) = (field.to_owned(), format!("{name:?}"));
            Err(WorldError::Range { file: file.to_owned(), field, value, allowed: "up to 64 bytes of text" })
        })?;
        if let Some(ceiling) = self.ceiling_m {
            range("ceiling_m".into(), ceiling, 1.8, 20.0, "1.8 to 20 m")?;
        }
        if let Some(lintel) = self.lintel_m {
            let ceiling = self.ceiling_m.unwrap_or(super::CEILING_M);
            range("lintel_m".into(), lintel, 1.5, ceiling, "1.5 m to the ceiling")?;
        }
        if let Some(pad) = &self.pad {
            place("pad", pad.x_m, pad.y_m, pad.heading_deg)?;
        }
        for s in &self.solid {
            let n = format!("solid \"{}\"", s.name);
            place(&n, s.x_m, s.y_m, s.yaw_deg)?;
            let needed: [(&str, Option<f32>); 2] = match s.shape {
                ShapeWord::Box => [("length_m", s.length_m), ("width_m", s.width_m)],
                ShapeWord::Cylinder => [("radius_m", s.radius_m), ("radius_m", s.radius_m)],
            };
            let stray = match s.shape {
                ShapeWord::Box => s.radius_m.map(|_| "radius_m"),
                ShapeWord::Cylinder => s.length_m.map(|_| "length_m").or(s.width_m.map(|_| "width_m")),
            };
            let bad = |key: &str, value: &str, allowed: &'static str| WorldError::Range {
                file: file.to_owned(),
                field: format!("{n}: {key}"),
                value: value.to_owned(),
                allowed,
            };
            if let Some(key) = stray {
                return Err(bad(key, "given", "length_m and width_m of a box, radius_m of a cylinder"));
            }
            for (key, value) in needed {
                let value = value.ok_or_else(|| bad(key, "missing", "0.01 to 50 m"))?;
                size(&n, key, value)?;
            }
            range(format!("{n}: bottom_m"), s.bottom_m, 0.0, 20.0, "0 to 20 m")?;
            range(format!("{n}: top_m"), s.top_m, s.bottom_m + 0.005, 20.0, "above bottom_m, to 20 m")?;
        }
        for t in &self.table {
            let n = format!("table \"{}\"", t.name);
            place(&n, t.x_m, t.y_m, t.yaw_deg)?;
            size(&n, "length_m", t.length_m)?;
            size(&n, "width_m", t.width_m)?;
            range(format!("{n}: top_m"), t.top_m, 0.2, 2.0, "0.2 to 2 m")?;
        }
        for c in &self.carpet {
            let n = format!("carpet \"{}\"", c.name);
            place(&n, c.x_m, c.y_m, c.yaw_deg)?;
            size(&n, "length_m", c.length_m)?;
            size(&n, "width_m", c.width_m)?;
            range(format!("{n}: thickness_m"), c.thickness_m, 0.001, 0.06, "0.001 to 0.06 m")?;
        }
        for p in &self.person {
            let n = format!("person \"{}\"", p.name);
            range(format!("{n}: speed_m_s"), p.speed_m_s, 0.5, 1.4, "0.5 to 1.4 m/s")?;
            range(format!("{n}: way, places"), p.way.len() as f32, 2.0, 64.0, "2 to 64 places")?;
            for [x, y] in &p.way {
                place(&n, *x, *y, 0.0)?;
            }
        }
        range("people".into(), self.person.len() as f32, 0.0, 13.0, "at most 13 people")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_is_read_and_nonsense_is_refused_by_name() {
        let good = r#"
            name = "w"
            [[solid]]
            name = "cabinet"
            shape = "box"
            x_m = 1.0
            y_m = 2.0
            length_m = 0.8
            width_m = 0.4
            top_m = 1.8
            surface = "mirror"
            [[table]]
            name = "desk"
            x_m = 3.0
            y_m = 2.0
            length_m = 1.6
            width_m = 0.8
        "#;
        let world = WorldFile::parse("w.toml", good).expect("a world");
        assert_eq!(world.solid[0].surface, Surface::Mirror);
        assert!((world.table[0].top_m - 0.75).abs() < 1e-6);
        let message = |text: &str| WorldFile::parse("w.toml", text).expect_err("refused").to_string();
        let unknown = message("name = \"w\"\ncolour = 3\n");
        assert!(unknown.contains("w.toml: line 2") && unknown.contains("colour"), "{unknown}");
        let low = message(&good.replace("top_m = 1.8", "top_m = -1.0"));
        assert!(low.contains("solid \"cabinet\": top_m is -1"), "{low}");
        let stray = message(&good.replace("width_m = 0.4", "width_m = 0.4\nradius_m = 0.2"));
        assert!(stray.contains("radius_m"), "{stray}");
        let missing = message(&good.replace("width_m = 0.4", ""));
        assert!(missing.contains("width_m is missing"), "{missing}");
        let fast = message("[[person]]\nname = \"Ana\"\nspeed_m_s = 9.0\nway = [[0.0, 0.0], [1.0, 0.0]]\n");
        assert!(fast.contains("0.5 to 1.4"), "{fast}");
        let line = message(&good.replace("cabinet", "cabinet\\nall is well"));
        assert!(line.contains("solid.name is \"cabinet\\nall is well\"; allowed: up to 64"), "{line}");
        let key = message("\"\\u001b[2J\" = 1");
        assert!(!key.chars().any(char::is_control), "{key:?}");
    }
}
