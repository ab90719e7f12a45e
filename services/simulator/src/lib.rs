//! The simulator service.
