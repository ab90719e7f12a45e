use std::fmt;

use floorplan::Door;

/// Why there is no way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// The door of this index is shut.
    DoorClosed(usize),
    /// The widest way is narrower than the vehicle needs.
    Narrow {
        /// Width of the narrowest place, metres.
        width_m: f32,
        /// Width that is needed, metres.
        needed_m: f32,
    },
    /// Something that the plan does not show stands in the only way.
    Unmapped,
    /// On the plan it is not connected at all.
    NoWay,
    /// Nobody wants it looked at.
    LeftOut,
}

impl Obstacle {
    /// The reason in words for a report on `room`, at most about 60 bytes.
    pub fn reason(&self, room: &str, doors: &[Door]) -> String {
        match self {
            Self::DoorClosed(door) => match doors.get(*door) {
                Some(door) if !door.name.contains(room) => format!("door closed: {}", door.name),
                _ => "door closed".to_owned(),
            },
            other => other.to_string(),
        }
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DoorClosed(_) => f.write_str("door closed"),
            Self::Narrow { width_m, needed_m } => write!(f, "passage {width_m:.2} m < {needed_m:.2} m"),
            Self::Unmapped => f.write_str("blocked by something not on the plan"),
            Self::NoWay => f.write_str("no way to it on the plan"),
            Self::LeftOut => f.write_str("left out of the round"),
        }
    }
}
