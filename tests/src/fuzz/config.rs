//! The services' configurations.

use super::{FILE, check_finite, refused, text_memory, within_memory};
use runtime::{Validate, parse_config};
use std::fmt::Debug;

/// One byte that selects the service, and the TOML of its configuration.
///
/// What loads holds no number that is not finite, and loads again to the same.
pub fn config(data: &[u8]) -> bool {
    let Some((&selector, text)) = data.split_first() else { return false };
    let Ok(text) = std::str::from_utf8(text) else { return false };
    match selector.wrapping_sub(b'0') % 8 {
        0 => load::<flight::Config>(text, |_| {}),
        1 => load::<flow::Config>(text, |_| {}),
        2 => load::<sonar::SonarConfig>(text, |_| {}),
        3 => load::<localization::LocalizationConfig>(text, |config| {
            assert_eq!(config.filter_config().check(), Ok(()));
        }),
        4 => load::<navigation::config::NavigationConfig>(text, |_| {}),
        5 => load::<pilot::PilotConfig>(text, |_| {}),
        6 => load::<simulator::Config>(text, |_| {}),
        _ => load::<bridge::BridgeConfig>(text, |_| {}),
    }
}

fn load<C>(text: &str, more: impl FnOnce(&C)) -> bool
where
    C: serde::de::DeserializeOwned + Validate + Debug + PartialEq,
{
    match within_memory(text_memory(text.len()), || parse_config::<C>(FILE, text)) {
        Ok(config) => {
            check_finite(&config);
            assert_eq!(parse_config::<C>(FILE, text).as_ref(), Ok(&config));
            more(&config);
            true
        }
        Err(error) => refused(&error),
    }
}
