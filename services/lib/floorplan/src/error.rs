use thiserror::Error;

/// What is wrong with a plan, its picture or its sidecar file.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PlanError {
    /// The header or the sidecar is not readable yaml of the expected shape.
    #[error("{file}: cannot be read: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// What the parser said, on one line.
        reason: String,
    },
    /// A sidecar cannot be written as yaml.
    #[error("{file}: cannot be written: {reason}")]
    Unwritable {
        /// The file.
        file: String,
        /// What the writer said, on one line.
        reason: String,
    },
    /// A key that must be there is not.
    #[error("{file}: `{field}` is missing: {hint}")]
    Missing {
        /// The file.
        file: String,
        /// The key.
        field: &'static str,
        /// What belongs there.
        hint: &'static str,
    },
    /// A value outside its range.
    #[error("{file}: `{field}` is {value}, allowed is {allowed}")]
    Range {
        /// The file.
        file: String,
        /// The key.
        field: String,
        /// What stands there.
        value: String,
        /// What may stand there.
        allowed: String,
    },
    /// A plan whose origin is turned against its picture.
    #[error(
        "{file}: `origin` turns the plan by {yaw_rad} rad: turned plans are not supported, turn the picture \
         and set the third number to 0"
    )]
    Turned {
        /// The file.
        file: String,
        /// The third number of `origin`.
        yaw_rad: f64,
    },
    /// The picture does not decode.
    #[error("{file}: the picture `{picture}` is not a PGM or PNG image: {reason}")]
    NotAnImage {
        /// The plan.
        file: String,
        /// The picture's name as the header gives it.
        picture: String,
        /// What the decoder said.
        reason: String,
    },
    /// The picture is larger or smaller than a building can be.
    #[error(
        "{file}: the picture is {width} x {height} cells, allowed is 3 to {side} a side and {cells} in all"
    )]
    Size {
        /// The plan.
        file: String,
        /// Cells across.
        width: u64,
        /// Cells up.
        height: u64,
        /// Most cells a side.
        side: u64,
        /// Most cells in all.
        cells: u64,
    },
    /// Nothing in the picture is free.
    #[error("{file}: no cell of the plan is free: is `negate` right, and are the thresholds?")]
    NoFreeCell {
        /// The plan.
        file: String,
    },
    /// The table of what the sonars hear everywhere does not fit into this machine's addresses.
    #[error("the plan is too large for this machine: its sonar table takes {megabytes} MB")]
    Memory {
        /// Room for all of its free space.
        megabytes: usize,
    },
    /// The pad is not in free space.
    #[error("the pad at ({x_m:.2}, {y_m:.2}) is {place}: it must stand in free space")]
    PadPlace {
        /// Plan frame.
        x_m: f32,
        /// Plan frame.
        y_m: f32,
        /// "inside a wall", "outside the plan", "in unknown space".
        place: &'static str,
    },
    /// The pad is too near to a wall to take off from.
    #[error("the pad at ({x_m:.2}, {y_m:.2}) is {clearance_m:.2} m from a wall, needed is {needed_m:.2} m")]
    PadClearance {
        /// Plan frame.
        x_m: f32,
        /// Plan frame.
        y_m: f32,
        /// To the nearest occupied cell, metres.
        clearance_m: f32,
        /// What the vehicle needs, metres.
        needed_m: f32,
    },
}

/// What a file says, as a message may quote it: control characters are spelt out. A message ends in a terminal and in
/// a log, where whoever drew the plan must not move the cursor or begin lines of his own.
pub(crate) fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() {
            plain.extend(character.escape_default());
        } else {
            plain.push(character);
        }
    }
    plain
}

fn first_line(error: &impl ToString) -> String {
    plain(error.to_string().lines().next().unwrap_or("no reason given").trim())
}

impl PlanError {
    pub(crate) fn syntax(file: &str, error: &impl ToString) -> Self {
        Self::Syntax { file: file.to_owned(), reason: first_line(error) }
    }

    pub(crate) fn unwritable(file: &str, error: &impl ToString) -> Self {
        Self::Unwritable { file: file.to_owned(), reason: first_line(error) }
    }

    pub(crate) fn range(file: &str, field: &str, value: &dyn ToString, allowed: &str) -> Self {
        Self::Range {
            file: file.to_owned(),
            field: plain(field),
            value: plain(&value.to_string()),
            allowed: allowed.to_owned(),
        }
    }
}
