//! The sonar service.
