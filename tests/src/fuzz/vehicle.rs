//! The vehicle file.

use super::{FILE, check_finite, refused, text_memory, within_memory};
use manifest::Vehicle;
use std::collections::BTreeSet;

/// A vehicle's TOML.
///
/// What loads lifts itself, holds its height and finds its place: a down sonar, three around, all different.
pub fn vehicle(data: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(data) else { return false };
    let vehicle = match within_memory(text_memory(text.len()), || Vehicle::parse(FILE, text)) {
        Ok(vehicle) => vehicle,
        Err(error) => return refused(&error),
    };
    check_finite(&vehicle);
    assert!((0.0..=1.0 / 1.5).contains(&vehicle.hover_fraction()) && vehicle.hover_fraction() > 0.0);
    assert!((4..=16).contains(&vehicle.sonars.len()));
    let down = vehicle.down_sonar().and_then(|index| vehicle.sonars.get(index));
    assert!(down.is_some_and(manifest::SonarMount::looks_down));
    let around = vehicle.sonars.iter().filter(|sonar| sonar.elevation_rad.abs() < 30_f32.to_radians());
    assert!(around.count() >= 3);
    for sonar in &vehicle.sonars {
        let length: f32 = sonar.axis().iter().map(|part| part * part).sum();
        assert!((length - 1.0).abs() < 1e-4, "an axis has length 1");
        assert!(sonar.min_range_m < sonar.max_range_m);
    }
    let names: BTreeSet<&str> = vehicle.sonars.iter().map(|sonar| sonar.name.as_str()).collect();
    assert_eq!(names.len(), vehicle.sonars.len(), "two sonars of one name");
    for name in names.into_iter().chain([vehicle.name.as_str()]) {
        assert!((1..=32).contains(&name.len()), "a name that cannot be shown: {name:?}");
        assert!(!name.chars().any(char::is_control), "{name:?}");
    }
    true
}
