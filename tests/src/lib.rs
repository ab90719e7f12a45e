//! What the tests of the whole system share.

pub mod counting;

use std::path::Path;

/// The root of the checkout that these tests belong to.
#[must_use]
pub fn checkout() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}
