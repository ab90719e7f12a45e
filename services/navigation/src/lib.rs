//! The navigation service.
