//! An ordered landing as a table: when the order is given again, and when nobody waits any longer. Pure: time is an
//! argument.

use std::time::{Duration, Instant};

/// How often the order to land is repeated: the pilot may be restarting.
const AGAIN: Duration = Duration::from_secs(1);

/// What there is to do about a landing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Descent {
    /// Tell the pilot to land; the number is the same for repetitions.
    Order(u32),
    /// It stands.
    Landed,
    /// It takes longer than a landing may.
    Late,
}

/// A landing that somebody wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Landing {
    until: Instant,
    again: Instant,
    order: u32,
}

impl Landing {
    /// A landing that begins now and may take as long as `limit`.
    pub(crate) fn new(limit: Duration, order: u32, now: Instant) -> Self {
        Self { until: now + limit, again: now, order }
    }

    /// What is due by now.
    pub(crate) fn due(&mut self, airborne: bool, now: Instant) -> Option<Descent> {
        if !airborne {
            Some(Descent::Landed)
        } else if now >= self.until {
            Some(Descent::Late)
        } else if now >= self.again {
            self.again = now + AGAIN;
            Some(Descent::Order(self.order))
        } else {
            None
        }
    }
}

/// A number that no earlier order had: the milliseconds of a clock that never goes back.
pub(crate) fn order_number() -> u32 {
    (runtime::monotonic_ns() / 1_000_000) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_order_is_repeated_until_it_stands_or_time_is_over() {
        let began = Instant::now();
        let at = |ms: u64| began + Duration::from_millis(ms);
        let mut landing = Landing::new(Duration::from_secs(3), 7, began);
        let told: Vec<u64> = (0..3000)
            .step_by(10)
            .filter(|ms| landing.due(true, at(*ms)) == Some(Descent::Order(7)))
            .collect();
        assert_eq!(told, [0, 1000, 2000]);
        assert_eq!(landing.due(false, at(2990)), Some(Descent::Landed));
        assert_eq!(landing.due(true, at(3000)), Some(Descent::Late));
        // Standing counts, however late.
        assert_eq!(landing.due(false, at(9000)), Some(Descent::Landed));
    }
}
