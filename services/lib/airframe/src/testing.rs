//! Vehicles for the tests of this crate.

/// The deployed vehicle file, so that tests fly what flies.
pub(crate) fn watchman() -> manifest::Vehicle {
    manifest::Vehicle::parse("watchman.toml", include_str!("../../../../deploy/vehicles/watchman.toml"))
        .expect("the deployed vehicle file parses")
}

/// The thesis's vehicle.
pub(crate) fn thesis() -> manifest::Vehicle {
    manifest::Vehicle::parse("thesis.toml", include_str!("../../../../deploy/vehicles/thesis.toml"))
        .expect("the deployed vehicle file parses")
}
