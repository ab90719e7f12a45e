//! What may stand in a sidecar file.

use super::{Area, NamedArea, Pad, Sidecar};
use crate::PlanError;
use crate::rooms::MAX_ROOMS;

/// Most doors of a sidecar file.
const MAX_DOORS: usize = 256;
/// Most areas that must not be entered.
const MAX_NO_FLY: usize = 64;
/// Most areas that no camera may show.
const MAX_PRIVACY: usize = 64;
/// Most places of a round that are named.
const MAX_POINTS: usize = 32;
/// Farthest coordinate, metres, as for the origin of a plan.
const MAX_COORDINATE_M: f32 = 10_000.0;

impl Sidecar {
    pub(super) fn check(&self, file: &str) -> Result<(), PlanError> {
        if self.rooms.len() > MAX_ROOMS {
            return Err(PlanError::range(
                file,
                "rooms",
                &format!("{} rooms", self.rooms.len()),
                "at most 48",
            ));
        }
        if self.doors.len() > MAX_DOORS {
            return Err(PlanError::range(
                file,
                "doors",
                &format!("{} doors", self.doors.len()),
                "at most 256",
            ));
        }
        if let Some(pad) = &self.pad {
            for (field, value) in [("pad.x", pad.x), ("pad.y", pad.y)] {
                check_coordinate(file, field, value)?;
            }
            if !(-360.0..=360.0).contains(&pad.heading_deg) {
                return Err(PlanError::range(
                    file,
                    "pad.heading_deg",
                    &pad.heading_deg,
                    "-360 to 360 degrees",
                ));
            }
        }
        for door in &self.doors {
            let field = format!("doors: {}", door.name);
            check_name(file, "doors.name", &door.name)?;
            for value in [door.a.0, door.a.1, door.b.0, door.b.1] {
                check_coordinate(file, &field, value)?;
            }
            if !(0.3..=10.0).contains(&door.width()) {
                return Err(PlanError::range(
                    file,
                    &field,
                    &format!("{:.2} m wide", door.width()),
                    "0.3 to 10 m",
                ));
            }
        }
        check_areas(file, "rooms", &self.rooms)?;
        if self.no_fly.len() > MAX_NO_FLY {
            let said = format!("{} areas", self.no_fly.len());
            return Err(PlanError::range(file, "no_fly", &said, "at most 64"));
        }
        check_areas(file, "no_fly", &self.no_fly)?;
        if self.privacy.len() > MAX_PRIVACY {
            let said = format!("{} areas", self.privacy.len());
            return Err(PlanError::range(file, "privacy", &said, "at most 64"));
        }
        check_areas(file, "privacy", &self.privacy)?;
        self.check_round(file)?;
        let closed = |pad: &Pad| self.no_fly.iter().find(|zone| zone.area.contains(pad.x, pad.y));
        if let Some(zone) = self.pad.as_ref().and_then(closed) {
            let said = format!("in the no-fly zone {}", zone.name);
            return Err(PlanError::range(file, "pad", &said, "outside every no-fly zone"));
        }
        Ok(())
    }
}

impl Sidecar {
    fn check_round(&self, file: &str) -> Result<(), PlanError> {
        let round = &self.round;
        for (field, rooms) in [("round.order", &round.order), ("round.leave_out", &round.leave_out)] {
            for (k, name) in rooms.iter().enumerate() {
                if !self.rooms.iter().any(|room| room.name == *name) {
                    return Err(PlanError::range(
                        file,
                        field,
                        &format!("{name:?}"),
                        "names that stand in rooms",
                    ));
                }
                if rooms[..k].contains(name) {
                    return Err(PlanError::range(file, field, &format!("{name:?} twice"), "each room once"));
                }
            }
        }
        if let Some(both) = round.order.iter().find(|name| round.leave_out.contains(name)) {
            let said = format!("{both:?} is left out, too");
            return Err(PlanError::range(
                file,
                "round.order",
                &said,
                "rooms that are not in round.leave_out",
            ));
        }
        if round.points.len() > MAX_POINTS {
            let said = format!("{} points", round.points.len());
            return Err(PlanError::range(file, "round.points", &said, "at most 32"));
        }
        for (k, point) in round.points.iter().enumerate() {
            let field = format!("round.points: {}", point.name);
            check_name(file, "round.points.name", &point.name)?;
            if round.points[..k].iter().any(|other| other.name == point.name) {
                return Err(PlanError::range(file, &field, &"used twice", "one point a name"));
            }
            check_coordinate(file, &field, point.x)?;
            check_coordinate(file, &field, point.y)?;
            if let Some(zone) = self.no_fly.iter().find(|zone| zone.area.contains(point.x, point.y)) {
                let said = format!("in the no-fly zone {}", zone.name);
                return Err(PlanError::range(file, &field, &said, "outside every no-fly zone"));
            }
        }
        Ok(())
    }
}

fn check_areas(file: &str, key: &str, areas: &[NamedArea]) -> Result<(), PlanError> {
    for (k, named) in areas.iter().enumerate() {
        let field = format!("{key}: {}", named.name);
        check_name(file, &format!("{key}.name"), &named.name)?;
        if areas[..k].iter().any(|other| other.name == named.name) {
            return Err(PlanError::range(file, &field, &"used twice", "one area a name"));
        }
        if let Area::Polygon(corners) = &named.area
            && !(3..=256).contains(&corners.len())
        {
            let said = format!("{} corners", corners.len());
            return Err(PlanError::range(file, &field, &said, "3 to 256"));
        }
        for value in named.area.coordinates() {
            check_coordinate(file, &field, value)?;
        }
    }
    Ok(())
}

fn check_name(file: &str, field: &str, name: &str) -> Result<(), PlanError> {
    // What fits the page and the messages.
    if (1..=31).contains(&name.len()) && !name.chars().any(char::is_control) {
        return Ok(());
    }
    Err(PlanError::range(file, field, &format!("{name:?}"), "1 to 31 bytes of text"))
}

fn check_coordinate(file: &str, field: &str, value: f32) -> Result<(), PlanError> {
    if value.abs() <= MAX_COORDINATE_M {
        return Ok(());
    }
    Err(PlanError::range(file, field, &value, "-10000 to 10000 m"))
}
