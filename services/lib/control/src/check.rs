//! Bounds of configuration values.

/// A configuration value outside what is safe to fly.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} = {value} is outside {low}..={high}")]
pub struct RangeError {
    /// Dotted name of the field.
    pub field: &'static str,
    /// What was asked for.
    pub value: f32,
    /// Least allowed.
    pub low: f32,
    /// Most allowed.
    pub high: f32,
}

/// Refuses what is outside the bounds or no number.
pub(crate) fn within(field: &'static str, value: f32, low: f32, high: f32) -> Result<(), RangeError> {
    if value >= low && value <= high { Ok(()) } else { Err(RangeError { field, value, low, high }) }
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn a_value_that_is_no_number_is_refused() {
        assert!(within("a.b", f32::NAN, 0.0, 1.0).is_err());
        assert!(within("a.b", 1.0, 0.0, 1.0).is_ok());
        let error = within("a.b", 1.5, 0.0, 1.0).unwrap_err();
        assert_eq!(error.to_string(), "a.b = 1.5 is outside 0..=1");
    }
}
