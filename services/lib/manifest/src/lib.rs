//! The manifest: what the system is made of, and the checks that it holds together.
#![forbid(unsafe_code)]
