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
    /// What the failsafe table says.
    pub failsafe: Action,
}

/// The most severe wins: a failsafe that stops or lands beats navigation, which beats the pilot's own hover.
/// [`Action::Return`] is flown *by* navigation, whose shield and route it needs; without a fresh setpoint the
/// failsafe itself hovers.
#[must_use]
pub fn arbitrate(asking: &Asking) -> Source {
    if !asking.airborne {
        return Source::Neutral;
    }
    match (asking.failsafe, asking.navigation) {
        (Action::None | Action::Return, true) => Source::Navigation,
        (Action::None, false) => Source::Pilot,
        _ => Source::Failsafe,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_severe_wins() {
        for &failsafe in Action::ALL {
            for navigation in [false, true] {
                let on_ground = arbitrate(&Asking { airborne: false, navigation, failsafe });
                assert_eq!(on_ground, Source::Neutral);
                let source = arbitrate(&Asking { airborne: true, navigation, failsafe });
                let expected = match failsafe {
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
