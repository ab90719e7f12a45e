//! What may be wrong with a manifest or a vehicle, in sentences for the one who has to fix it.

/// A manifest that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ManifestError {
    /// Not TOML, an unknown key, or a value of the wrong kind.
    #[error("{file}:{line}: {message}")]
    Syntax {
        /// File as the caller named it.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What the reader of the format says, in one line.
        message: String,
    },
    /// A required key is absent.
    #[error("{file}: {field} is missing: {hint}")]
    Missing {
        /// File as the caller named it.
        file: String,
        /// Dotted key.
        field: String,
        /// What belongs there.
        hint: String,
    },
    /// A value outside what is allowed.
    #[error("{file}: {field} = {value}: allowed is {allowed}")]
    Range {
        /// File as the caller named it.
        file: String,
        /// Dotted key.
        field: String,
        /// The value found.
        value: String,
        /// The allowed range, in words.
        allowed: String,
    },
    /// Parts that do not fit together.
    #[error("{file}: {field}: {message}")]
    Wiring {
        /// File as the caller named it (base and overlay, when both matter).
        file: String,
        /// Dotted key.
        field: String,
        /// What does not fit and why.
        message: String,
    },
}

/// A vehicle file that cannot be flown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VehicleError {
    /// Not TOML, an unknown key, a missing key or a value of the wrong kind.
    #[error("{file}:{line}: {message}")]
    Syntax {
        /// File as the caller named it.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What the reader of the format says, in one line.
        message: String,
    },
    /// A value outside what is allowed.
    #[error("{file}: {field} = {value}: allowed is {allowed}")]
    Range {
        /// File as the caller named it.
        file: String,
        /// Dotted key.
        field: String,
        /// The value found.
        value: String,
        /// The allowed range, in words.
        allowed: String,
    },
    /// No sonar looks down: height could not be held.
    #[error("{file}: no sonar looks down (elevation_deg = -90): without one the height cannot be held")]
    NoDownSonar {
        /// File as the caller named it.
        file: String,
    },
    /// Fewer side sonars than can stop a drift.
    #[error("{file}: {count} sonars look around: at least 3 are needed to find a place on a plan")]
    TooFewSonars {
        /// File as the caller named it.
        file: String,
        /// How many look around.
        count: usize,
    },
    /// Two sonars see the same.
    #[error(
        "{file}: sonars {first} and {second} look in one direction ({degrees} degrees apart): allowed is 5 degrees or more"
    )]
    SameDirection {
        /// File as the caller named it.
        file: String,
        /// One sonar.
        first: String,
        /// The other.
        second: String,
        /// Angle between their axes, rounded.
        degrees: u32,
    },
    /// Two sonars carry one name.
    #[error("{file}: two sonars are called {name}: names must differ")]
    SameName {
        /// File as the caller named it.
        file: String,
        /// The name.
        name: String,
    },
    /// Motors that do not lift the body with a margin.
    #[error(
        "{file}: motors.max_thrust_n: four motors lift {ratio} times the weight: allowed is 1.5 or more (gusts and a tired battery need the rest)"
    )]
    TooHeavy {
        /// File as the caller named it.
        file: String,
        /// Thrust over weight, two digits.
        ratio: String,
    },
}

/// Line (from 1) of a byte offset.
pub(crate) fn line_of(text: &str, span: Option<std::ops::Range<usize>>) -> usize {
    let end = span.map_or(0, |s| s.start).min(text.len());
    text.as_bytes()[..end].iter().filter(|b| **b == b'\n').count() + 1
}

/// A parser's message on one line.
#[must_use]
pub fn one_line(message: &str) -> String {
    plain(&message.split('\n').map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; "))
}

/// What a file says, as a message may quote it: control characters are spelt out. A message ends in a terminal and in
/// a log, where whoever wrote the file must not move the cursor or begin lines of his own.
#[must_use]
pub fn plain(text: &str) -> String {
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
