//! Ping groups waiting for their update.

use crate::rate::Ranged;
use ipc_types::{MAX_SONARS, SonarHealth, SonarRanges, SonarReading, SonarStatus};
use mcl::{Echo, Reading};

/// Groups that may wait while the last set is on its way; more mean that the process was held up, and
/// then the oldest are of least use.
const WAITING: usize = 4;

/// One ping group, checked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// When the ping left.
    pub(crate) time_ns: u64,
    pub(crate) count: usize,
    pub(crate) readings: [Reading; MAX_SONARS],
    /// Index of each reading's sensor.
    pub(crate) sensors: [u8; MAX_SONARS],
}

const NO_READING: Reading =
    Reading { echo: Echo::Nothing, bearing_rad: 0.0, elevation_rad: 0.0, mount_x: 0.0, mount_y: 0.0 };

impl Group {
    /// The readings that say something about walls; `None` when the message makes no sense.
    pub(crate) fn of(message: &SonarRanges, now: u64) -> Option<Self> {
        if message.count as usize > MAX_SONARS {
            return None;
        }
        let mut group =
            Self { time_ns: 0, count: 0, readings: [NO_READING; MAX_SONARS], sensors: [0; MAX_SONARS] };
        for reading in message.filled() {
            // A ping from the future or one without a time spoils the group: the filter would follow it.
            if reading.ping_ns == 0 || reading.ping_ns > now || usize::from(reading.sensor) >= MAX_SONARS {
                return None;
            }
            group.time_ns = group.time_ns.max(reading.ping_ns);
            let mounted = [reading.bearing_rad, reading.elevation_rad, reading.mount_x_m, reading.mount_y_m];
            let status = SonarStatus::from_code(reading.status)?;
            if mounted.iter().any(|v| !v.is_finite()) {
                return None;
            }
            if reading.looks_down() || SonarHealth::from_code(reading.health)? == SonarHealth::Stuck {
                continue;
            }
            let Some(echo) = echo(reading, status) else { continue };
            group.sensors[group.count] = reading.sensor;
            group.readings[group.count] = Reading {
                echo,
                bearing_rad: reading.bearing_rad,
                elevation_rad: reading.elevation_rad,
                mount_x: reading.mount_x_m,
                mount_y: reading.mount_y_m,
            };
            group.count += 1;
        }
        (group.time_ns > 0).then_some(group)
    }

    pub(crate) fn readings(&self) -> &[Reading] {
        &self.readings[..self.count]
    }

    /// The echoes, by sensor.
    pub(crate) fn ranged(&self) -> impl Iterator<Item = Ranged> {
        self.readings().iter().zip(self.sensors).filter_map(|(reading, sensor)| match reading.echo {
            Echo::Range(range) => Some(Ranged {
                sensor,
                range,
                mount: [reading.mount_x, reading.mount_y],
                bearing: reading.bearing_rad,
            }),
            Echo::Nothing => None,
        })
    }
}

fn echo(reading: &SonarReading, status: SonarStatus) -> Option<Echo> {
    match status {
        SonarStatus::Ok => reading.range().map(Echo::Range),
        SonarStatus::NoEcho => Some(Echo::Nothing),
        SonarStatus::Fault => None,
    }
}

/// A short queue.
#[derive(Default)]
pub(crate) struct Waiting {
    groups: [Option<Group>; WAITING],
    /// Groups dropped because too many waited.
    pub(crate) dropped: u64,
}

impl Waiting {
    pub(crate) fn push(&mut self, group: Group) {
        if self.groups[WAITING - 1].is_some() {
            self.groups.rotate_left(1);
            self.groups[WAITING - 1] = None;
            self.dropped += 1;
        }
        if let Some(free) = self.groups.iter_mut().find(|g| g.is_none()) {
            *free = Some(group);
        }
    }

    pub(crate) fn pop(&mut self) -> Option<Group> {
        let group = self.groups[0].take();
        self.groups.rotate_left(1);
        group
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(statuses: &[SonarStatus]) -> SonarRanges {
        let mut m = SonarRanges { count: statuses.len() as u32, ..SonarRanges::default() };
        for (i, status) in statuses.iter().enumerate() {
            m.readings[i].ping_ns = 100 + i as u64;
            m.readings[i].sensor = i as u8;
            m.readings[i].range_m = 1.0;
            m.readings[i].status = status.code();
        }
        m
    }

    #[test]
    fn faults_stuck_and_down_sensors_say_nothing_about_walls() {
        use SonarStatus::{Fault, NoEcho, Ok};
        let mut m = message(&[Ok, NoEcho, Fault, Ok, Ok]);
        m.readings[3].elevation_rad = -1.57;
        m.readings[4].health = SonarHealth::Stuck.code();
        let g = Group::of(&m, 1000).unwrap();
        assert_eq!((g.count, g.time_ns), (2, 104));
        assert_eq!(g.readings()[0].echo, Echo::Range(1.0));
        assert_eq!(g.readings()[1].echo, Echo::Nothing);
    }

    #[test]
    fn messages_that_make_no_sense_are_refused() {
        let broken: [fn(&mut SonarRanges); 6] = [
            |m| m.count = 17,
            |m| m.count = 0,
            |m| m.readings[0].ping_ns = 2000,
            |m| m.readings[0].status = 77,
            |m| m.readings[0].bearing_rad = f32::NAN,
            |m| m.readings[0].sensor = 16,
        ];
        for (i, spoil) in broken.iter().enumerate() {
            let mut m = message(&[SonarStatus::Ok]);
            assert!(Group::of(&m, 1000).is_some());
            spoil(&mut m);
            assert!(Group::of(&m, 1000).is_none(), "case {i}");
        }
    }

    #[test]
    fn when_too_many_wait_the_oldest_goes() {
        let mut waiting = Waiting::default();
        for i in 0..6 {
            let mut m = message(&[SonarStatus::Ok]);
            m.readings[0].ping_ns = 10 + i;
            waiting.push(Group::of(&m, 1000).unwrap());
        }
        let times: Vec<u64> = std::iter::from_fn(|| waiting.pop().map(|g| g.time_ns)).collect();
        assert_eq!((times, waiting.dropped), (vec![12, 13, 14, 15], 2));
    }
}
