//! The flow service.
