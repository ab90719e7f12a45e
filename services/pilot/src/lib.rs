//! The pilot service.
