//! The localization service.
