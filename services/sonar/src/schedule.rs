//! Which sensors are fired together.

use ipc_types::MAX_SONARS;
use manifest::SonarMount;
use thiserror::Error;

/// Sensors of one group must look at least this far apart, radians: their cones are 30 degrees wide and
/// a wall may throw one's ping into the other's. A degree of play for right angles in rounded numbers.
const APART: f32 = std::f32::consts::FRAC_PI_2 - 0.018;

/// Groups in the order in which they are fired.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    slots: Vec<Slot>,
}

/// One slot of the schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot {
    /// The group's number in the vehicle file.
    pub(crate) group: u32,
    /// Bit = index in the vehicle's list.
    pub(crate) sensors: u32,
}

/// Why a vehicle's sonars cannot be fired.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ScheduleError {
    /// None there.
    #[error("the vehicle has no sonar; give it at least one that looks around and one that looks down")]
    None,
    /// More than messages have room for.
    #[error("the vehicle has {0} sonars; allowed: at most 16")]
    TooMany(usize),
    /// Two that would hear each other.
    #[error(
        "sonars {first} and {second} of group {group} look {degrees} degrees apart and would hear each other; \
         allowed within one group: at least 90 degrees"
    )]
    CrossTalk {
        /// Name of one.
        first: String,
        /// Name of the other.
        second: String,
        /// Their group.
        group: u32,
        /// Angle between their axes.
        degrees: i32,
    },
}

impl Schedule {
    /// Groups in ascending order, one a slot. Sensors that look down make no slot of their own when their
    /// group holds nothing else: none around hears the floor, so they are fired along in every slot, which
    /// is what height control needs.
    ///
    /// # Errors
    /// No sonar, too many, or two in one group that look less than 90 degrees apart.
    pub fn new(sonars: &[SonarMount]) -> Result<Self, ScheduleError> {
        if sonars.is_empty() {
            return Err(ScheduleError::None);
        }
        if sonars.len() > MAX_SONARS {
            return Err(ScheduleError::TooMany(sonars.len()));
        }
        let mut groups: Vec<u32> = sonars.iter().map(|s| s.group).collect();
        groups.sort_unstable();
        groups.dedup();
        let members = |group: u32| sonars.iter().enumerate().filter(move |(_, s)| s.group == group);
        let mask = |group: u32| members(group).fold(0, |mask, (i, _)| mask | 1 << i);
        let (along, own): (Vec<u32>, Vec<u32>) =
            groups.into_iter().partition(|g| members(*g).all(|(_, s)| s.looks_down()));
        let always = along.iter().fold(0, |sensors, group| sensors | mask(*group));
        let slots: Vec<Slot> = if own.is_empty() {
            along.iter().take(1).map(|group| Slot { group: *group, sensors: always }).collect()
        } else {
            own.into_iter().map(|group| Slot { group, sensors: mask(group) | always }).collect()
        };
        for slot in &slots {
            check_apart(sonars, *slot)?;
        }
        Ok(Self { slots })
    }

    /// Number of slots in a sweep.
    #[must_use]
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Never true: a schedule has at least one slot.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Sensors fired in slot `index` (modulo the number of slots), as bits.
    #[must_use]
    pub fn sensors(&self, index: usize) -> u32 {
        self.slot(index).sensors
    }

    pub(crate) fn slot(&self, index: usize) -> Slot {
        self.slots[index % self.slots.len()]
    }
}

fn check_apart(sonars: &[SonarMount], slot: Slot) -> Result<(), ScheduleError> {
    let fired = || sonars.iter().enumerate().filter(|(i, _)| slot.sensors >> i & 1 == 1);
    for (i, a) in fired() {
        for (_, b) in fired().filter(|(k, _)| *k > i) {
            let cosine: f32 = a.axis().iter().zip(b.axis()).map(|(p, q)| p * q).sum();
            let angle = cosine.clamp(-1.0, 1.0).acos();
            if angle < APART {
                return Err(ScheduleError::CrossTalk {
                    first: a.name.clone(),
                    second: b.name.clone(),
                    group: slot.group,
                    degrees: angle.to_degrees().round() as i32,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sonar(name: &str, bearing_deg: f32, elevation_deg: f32, group: u32) -> SonarMount {
        SonarMount {
            name: name.into(),
            bearing_rad: bearing_deg.to_radians(),
            elevation_rad: elevation_deg.to_radians(),
            x_m: 0.0,
            y_m: 0.0,
            z_m: 0.0,
            group,
            min_range_m: 0.02,
            max_range_m: 4.0,
        }
    }

    #[test]
    fn the_down_sonar_is_fired_with_every_group() {
        let sonars = [
            sonar("front", 0.0, 0.0, 0),
            sonar("rear", 180.0, 0.0, 0),
            sonar("left", 90.0, 0.0, 3),
            sonar("right", 270.0, 0.0, 3),
            sonar("down", 0.0, -90.0, 9),
        ];
        let schedule = Schedule::new(&sonars).unwrap();
        assert_eq!(schedule.len(), 2);
        assert_eq!(
            [schedule.sensors(0), schedule.sensors(1), schedule.sensors(2)],
            [0b10011, 0b11100, 0b10011]
        );
    }

    #[test]
    fn a_down_sonar_in_a_mixed_group_waits_for_its_turn() {
        let sonars = [sonar("front", 0.0, 0.0, 0), sonar("left", 90.0, 0.0, 1), sonar("down", 0.0, -90.0, 1)];
        let schedule = Schedule::new(&sonars).unwrap();
        assert_eq!([schedule.sensors(0), schedule.sensors(1)], [0b001, 0b110]);
    }

    #[test]
    fn two_that_would_hear_each_other_are_named() {
        let sonars =
            [sonar("front", 0.0, 0.0, 0), sonar("front-left", 45.0, 0.0, 0), sonar("down", 0.0, -90.0, 1)];
        let text = Schedule::new(&sonars).map_err(|e| e.to_string());
        assert_eq!(
            text,
            Err("sonars front and front-left of group 0 look 45 degrees apart and would hear each other; allowed \
                 within one group: at least 90 degrees"
                .into())
        );
        let steep = [sonar("front", 0.0, -45.0, 0), sonar("down", 0.0, -90.0, 1)];
        assert!(Schedule::new(&steep).is_err(), "a sonar that looks half down hears the floor's echo");
    }

    #[test]
    fn no_sonar_and_too_many_are_refused() {
        assert_eq!(Schedule::new(&[]), Err(ScheduleError::None));
        let many: Vec<SonarMount> = (0..17).map(|i| sonar("s", 0.0, 0.0, i)).collect();
        assert_eq!(Schedule::new(&many), Err(ScheduleError::TooMany(17)));
    }
}
