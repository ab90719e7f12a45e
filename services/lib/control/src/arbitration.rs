//! Whose wish is flown.

use crate::failsafe::Action;

/// Whose wish is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Nobody's: the motors are off.
    Neutral,
    /// The pilot's own: take-off, hover, landing.
    Pilot,
    /// Navigation's setpoint.
    Navigation,
    /// Of who holds the sticks.
    Manual,
    /// A failsafe's.
    Failsafe,
}

/// Who asks for motion now.
#[derive(Clone, Copy, Debug)]
pub struct Asking {
    /// The motors are to run.
    pub airborne: bool,
    /// The phase follows navigation, and its setpoint has not expired.
    pub navigation: bool,
    /// The sticks are followed.
    pub sticks: bool,
    /// What the failsafe table says.
    pub failsafe: Action,
}

/// The most severe wins: a failsafe that moves the drone beats the sticks, one that stops or lands beats navigation, and
/// these beat the pilot's own hover. Nobody follows navigation and the sticks at the same time.
/// [`Action::Return`] is flown *by* navigation, whose shield and route it needs; without a fresh setpoint the
/// failsafe itself hovers.
#[must_use]
pub fn arbitrate(asking: &Asking) -> Source {
    if !asking.airborne {
        return Source::Neutral;
    }
    match (asking.failsafe, asking.navigation, asking.sticks) {
        (Action::None, _, true) => Source::Manual,
        (Action::None | Action::Return, true, _) => Source::Navigation,
        (Action::None, false, false) => Source::Pilot,
        _ => Source::Failsafe,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_severe_wins() {
        for &failsafe in Action::ALL {
            for (navigation, sticks) in [(false, false), (true, false), (false, true), (true, true)] {
                let on_ground = arbitrate(&Asking { airborne: false, navigation, sticks, failsafe });
                assert_eq!(on_ground, Source::Neutral);
                let source = arbitrate(&Asking { airborne: true, navigation, sticks, failsafe });
                let expected = match failsafe {
                    Action::None if sticks => Source::Manual,
                    Action::None if navigation => Source::Navigation,
                    Action::None => Source::Pilot,
                    Action::Return if navigation => Source::Navigation,
                    _ => Source::Failsafe,
                };
                assert_eq!(source, expected, "{failsafe:?}");
            }
        }
    }
}
