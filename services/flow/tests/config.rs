//! The configuration that is delivered is the default one, and what makes no sense is refused by name.
#![allow(clippy::unwrap_used, reason = "tests")]

use flow::Config;

const DELIVERED: &str = include_str!("../../../deploy/config/flow.toml");

#[test]
fn the_delivered_file_says_the_defaults() {
    assert_eq!(runtime::parse_config::<Config>("flow.toml", DELIVERED).unwrap(), Config::default());
}

#[test]
fn values_out_of_range_and_unknown_keys_are_refused() {
    let refused = |text: &str| runtime::parse_config::<Config>("flow.toml", text).unwrap_err().to_string();
    assert!(refused("max_tilt_deg = 80.0").contains("5..=45"), "{}", refused("max_tilt_deg = 80.0"));
    assert!(refused("min_quality = 300").contains("min_quality"));
    assert!(refused("quality = 3").contains("quality"));
}
