//! What stood in the way may have moved on: when it is forgotten, and how often.

use super::Journey;
use patrol::{Bits, Obstacle, RoomPlan};

/// So often in a round what stood in the way is believed to have moved on, when nothing is left to see but behind it.
const AMNESTIES: u32 = 6;
/// Amnesties that are given nearer together than this, metres, are one, up to so many: the drone waits there for somebody.
const HERE_M: f32 = 1.5;
const WAITS: u32 = 2;
/// Share of the building behind doors that are taken for shut beyond which they are tried again and again.
const MUCH: f32 = 0.25;
/// A door that was found shut so often is shut: somebody in it turns round sooner.
const TRIED_ENOUGH: u32 = 3;

/// An amnesty that was given and not yet carried out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pardon {
    /// For doors that were found shut too.
    doors: bool,
}

/// The amnesties of a round.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Amnesties {
    given: u32,
    /// Where the last one was given, and how many more have been given there.
    at: Option<(f32, f32)>,
    more: u32,
}

impl Amnesties {
    /// Whether there is one left.
    fn left(&self) -> bool {
        self.given < AMNESTIES
    }

    /// Whether the last one was given where the one before was: somebody there does not move on.
    fn waits(&self) -> bool {
        self.more > 0
    }

    /// One is given here.
    fn give(&mut self, here: Option<(f32, f32)>) {
        let near = |(a, b): (&(f32, f32), &(f32, f32))| (a.0 - b.0).hypot(a.1 - b.1) < HERE_M;
        let again = self.at.as_ref().zip(here.as_ref()).is_some_and(near);
        self.more = if again { self.more + 1 } else { 0 };
        self.at = here;
        self.given += u32::from(!(again && self.more <= WAITS));
    }
}

impl Journey {
    /// What stood in the way may have moved on, and who stood in a door made it look shut: when rooms were left out for that
    /// they are to be forgotten before the next planning, which the caller asks for. Things a few times; doors until each was found shut thrice, and as often as things while much of the
    /// building lies behind them: those first that were found shut least often.
    pub(crate) fn forgive(&mut self) -> bool {
        let patient = self.amnesties.left();
        let things = patient && self.rooms.iter().any(|room| room.skipped == Some(Obstacle::Unmapped));
        let doors = self.behind_doors();
        let doors = if self.doors_again { patient && doors > MUCH } else { doors > 0.0 }
            || (patient && doors > 0.0 && self.least_found_shut() < TRIED_ENOUGH);
        if !(doors || things) {
            return false;
        }
        self.amnesties.give(self.looks.last().copied());
        self.given_up.clear();
        self.pardon = Some(Pardon { doors });
        true
    }

    /// Whether the drone has come back to a blocked place and found it blocked again, with nothing else left to see.
    pub(crate) fn waits_in_vain(&self) -> bool {
        self.amnesties.waits()
    }

    /// Forgets what an amnesty was given for. Works through the whole map: part of planning, never of a decision.
    pub(super) fn pardon(&mut self, pardon: Pardon) {
        self.map.set_unmapped(&Bits::default());
        self.setbacks.forgive(|x, y| self.map.mark_unmapped(x, y));
        if pardon.doors {
            let times = |door: usize| self.found_shut.get(door).copied().unwrap_or_default();
            let least = self.least_found_shut();
            for door in 0..self.map.doors().len() {
                if !self.doors_again || times(door) <= least {
                    self.map.set_door(door, false);
                }
            }
            self.doors_again = true;
        }
    }

    /// How often that door was found shut which was found so least often, of those that count as shut.
    fn least_found_shut(&self) -> u32 {
        let times = |door: usize| self.found_shut.get(door).copied().unwrap_or_default();
        let shut = |door: &usize| self.map.door_closed(*door);
        (0..self.map.doors().len()).filter(shut).map(times).min().unwrap_or_default()
    }

    /// Share of the building's floor in rooms that are left out because of a shut door. While the drone is shut in itself,
    /// away from the pad, all.
    fn behind_doors(&self) -> f32 {
        let behind = |room: &&RoomPlan| matches!(room.skipped, Some(Obstacle::DoorClosed(_)));
        let home = self.stops.last().and_then(|pad| pad.room).and_then(|room| self.rooms.get(room));
        if home.as_ref().is_some_and(behind) {
            return 1.0;
        }
        let floor: usize = self.rooms.iter().map(|room| room.floor).sum();
        let shut: usize = self.rooms.iter().filter(behind).map(|room| room.floor).sum();
        shut as f32 / floor.max(1) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_in_one_place_for_somebody_is_one_amnesty_but_not_for_ever() {
        let mut amnesties = Amnesties::default();
        for more in 0..3 {
            amnesties.give(Some((4.0, 2.0 + 0.1 * more as f32)));
        }
        assert_eq!(amnesties.given, 1);
        for _ in 0..AMNESTIES {
            amnesties.give(Some((4.0, 2.0)));
        }
        assert!(!amnesties.left(), "{amnesties:?}");
    }

    #[test]
    fn elsewhere_each_counts() {
        let mut amnesties = Amnesties::default();
        for i in 0..AMNESTIES {
            assert!(amnesties.left());
            amnesties.give((i > 0).then_some((2.0 * i as f32, 0.0)));
        }
        assert!(!amnesties.left());
    }
}
