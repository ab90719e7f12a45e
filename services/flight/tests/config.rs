//! The configuration that is delivered is the default one, and what makes no sense is refused by name.
#![allow(clippy::unwrap_used, reason = "tests")]

use flight::Config;

const DELIVERED: &str = include_str!("../../../deploy/config/flight.toml");

#[test]
fn the_delivered_file_says_the_defaults() {
    assert_eq!(runtime::parse_config::<Config>("flight.toml", DELIVERED).unwrap(), Config::default());
}

#[test]
fn values_out_of_range_and_unknown_keys_are_refused() {
    let refused = |text: &str| runtime::parse_config::<Config>("flight.toml", text).unwrap_err().to_string();
    assert!(
        refused("level_after_s = 0.5").contains("level_after_s = 0.5"),
        "{}",
        refused("level_after_s = 0.5")
    );
    assert!(refused("msp_version = 3").contains("1..=2"));
    assert!(refused("level_after_s = 0.2\ndescend_after_s = 0.15").contains("descend_after_s"));
    assert!(refused("profile = \"radio\"").contains("radio"));
    assert!(refused("levl_after_s = 0.1").contains("levl_after_s"));
}
