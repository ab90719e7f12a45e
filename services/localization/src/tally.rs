//! What search after search says of a place that is believed.
//!
//! One search among furniture that no plan shows is an opinion; what they say one after the other, as far as each has heard
//! anew, adds up to a verdict: the sequential test of Wald 1945, with bounded steps because readings of one corridor
//! resemble each other.

use crate::attitude::seconds;
use mcl::TrailPose;

/// Log odds of the place against the likeliest other one: a search says this much at most, and a share counts for this
/// much at least.
const SAYS_MOST: f32 = 2.0;
const SAYS_LEAST: f32 = 0.02;
/// Another place speaks against this one if it explains more of what was heard: from this share on, with full voice at the
/// second and two and a half times as loud at most. Along a corridor the next door explains as much, and is likelier or not
/// as it happens.
const EXPLAINS_MORE: (f32, f32) = (0.02, 0.08);
const LOUDEST: f32 = 2.5;
/// And if it is one place: from this share of the belief on, with full voice at the second. Of forty places among equal
/// pillars the best always explains more than the true one, and holds a third of the belief. (92 flights, three
/// buildings: 11 576 audits of places that were right, of which 147 spoke against them when 0.04 more and no belief was asked
/// for, and 50 now; of 70 audits of wrong places, 45 and 35.)
const ALONE: (f32, f32) = (0.5, 0.9);
/// A search counts wholly after so much of new way, metres, or so long, seconds.
const ANEW_M: f32 = 2.0;
const ANEW_S: f32 = 6.0;
/// A place that was found is confirmed by so much, this far from where it was found, metres, and refuted by so much.
const CONFIRMED: f32 = 3.0;
const CONFIRMED_M: f32 = 3.0;
const REFUTED: f32 = -3.0;
/// What a place that is believed may have saved up, and when it is suspected: two searches for another one, or one and a half
/// loud ones.
const SAVED: f32 = 1.0;
const SUSPECTED: f32 = -2.9;

/// What one search says of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Opinion {
    /// Of the belief, 0..=1.
    pub(crate) share: f32,
    /// Share of the readings that it explains, 0..=1.
    pub(crate) explained: f32,
}

/// A place that was suspected is believed again when what is heard afresh speaks for it by so much, after so long at
/// least, seconds: among furniture that no plan shows an audit errs once in some hours.
const ACQUITTED: f32 = 0.5;
const ACQUITTED_S: f64 = 6.0;

/// The sum so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    log_odds: f32,
    /// Where it began, and where and when the last search was, in the trail's frame.
    from: Option<(f32, f32)>,
    began_ns: Option<u64>,
    last: Option<(u64, f32, f32)>,
}

impl Tally {
    /// Adds one search that ended `here`: what it says of the place and of the likeliest other one. A place that has been
    /// `believed` for long saves up little, so that it can be suspected before long.
    pub(crate) fn add(&mut self, now: u64, here: &TrailPose, [this, other]: [Opinion; 2], believed: bool) {
        let anew = self.last.map_or(1.0, |(at, x, y)| {
            (here.x - x).hypot(here.y - y) / ANEW_M + seconds(at, now) as f32 / ANEW_S
        });
        let odds = ((this.share + SAYS_LEAST) / (other.share + SAYS_LEAST)).ln();
        let voice = if odds > 0.0 {
            1.0
        } else {
            let above = |(from, full): (f32, f32), what: f32| ((what - from) / (full - from)).max(0.0);
            let more = above(EXPLAINS_MORE, other.explained - this.explained).min(LOUDEST);
            more * above(ALONE, other.share).min(1.0)
        };
        let says = odds.clamp(-SAYS_MOST, SAYS_MOST) * voice;
        let most = if believed { SAVED } else { f32::INFINITY };
        self.log_odds = (self.log_odds + anew.min(1.0) * says).min(most);
        self.from.get_or_insert((here.x, here.y));
        self.began_ns.get_or_insert(now);
        self.last = Some((now, here.x, here.y));
    }

    /// Whether a place that was found is the one, as far as it was flown since.
    pub(crate) fn is_confirmed(&self, here: &TrailPose) -> bool {
        let moved_m = self.from.map_or(0.0, |(x, y)| (here.x - x).hypot(here.y - y));
        self.log_odds >= CONFIRMED && moved_m >= CONFIRMED_M
    }

    /// Whether a place that was found is another one.
    pub(crate) fn is_refuted(&self) -> bool {
        self.log_odds <= REFUTED
    }

    /// Whether a place that was suspected is the one after all.
    pub(crate) fn is_acquitted(&self, now: u64) -> bool {
        self.log_odds >= ACQUITTED && self.began_ns.is_some_and(|began| seconds(began, now) >= ACQUITTED_S)
    }

    /// Whether a place that is believed may be another one.
    pub(crate) fn is_suspected(&self) -> bool {
        self.log_odds <= SUSPECTED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    fn at(x: f32) -> TrailPose {
        TrailPose { x, ..TrailPose::default() }
    }

    const FOR: [Opinion; 2] =
        [Opinion { share: 0.99, explained: 0.85 }, Opinion { share: 0.01, explained: 0.7 }];
    const AGAINST: [Opinion; 2] =
        [Opinion { share: 0.0, explained: 0.7 }, Opinion { share: 0.98, explained: 0.83 }];
    const UNDECIDED: [Opinion; 2] =
        [Opinion { share: 0.4, explained: 0.8 }, Opinion { share: 0.45, explained: 0.8 }];

    #[test]
    fn two_searches_confirm_a_place_that_was_left_and_not_one_that_was_not() {
        let mut tally = Tally::default();
        tally.add(0, &at(0.0), FOR, false);
        assert!(!tally.is_confirmed(&at(9.0)), "one search is an opinion");
        tally.add(6 * S, &at(0.1), FOR, false);
        assert!(!tally.is_confirmed(&at(0.1)) && tally.is_confirmed(&at(3.1)));
        // Doubtful ones say little, to neither side.
        for k in 2..10 {
            tally.add(6 * k * S, &at(0.1), UNDECIDED, false);
        }
        assert!(tally.is_confirmed(&at(3.1)) && !tally.is_refuted());
    }

    #[test]
    fn what_is_heard_again_and_again_on_the_spot_is_one_opinion() {
        let mut tally = Tally::default();
        tally.add(0, &at(0.0), FOR, true);
        for k in 1..=10 {
            tally.add(k * S / 2, &at(0.0), AGAINST, true);
        }
        assert!(!tally.is_suspected(), "five seconds on the spot");
        for k in 3..=4 {
            tally.add(6 * k * S, &at(0.0), AGAINST, true);
        }
        assert!(tally.is_suspected());
    }

    #[test]
    fn what_is_heard_afresh_acquits_and_not_at_once() {
        let mut tally = Tally::default();
        tally.add(S, &at(0.0), FOR, false);
        assert!(!tally.is_acquitted(6 * S) && tally.is_acquitted(7 * S));
        for k in 1..9 {
            tally.add(k * 2 * S, &at(0.0), AGAINST, false);
        }
        assert!(!tally.is_acquitted(30 * S) && !Tally::default().is_acquitted(30 * S));
    }

    #[test]
    fn long_belief_saves_up_little() {
        let mut tally = Tally::default();
        for k in 0..100 {
            tally.add(6 * k * S, &at(k as f32), FOR, true);
        }
        for k in 100..102 {
            assert!(!tally.is_suspected());
            tally.add(6 * k * S, &at(k as f32), AGAINST, true);
        }
        assert!(tally.is_suspected());
        let next_door = [Opinion { explained: 0.82, ..AGAINST[0] }, AGAINST[1]];
        let mut corridor = Tally::default();
        for k in 0..100 {
            corridor.add(6 * k * S, &at(k as f32), next_door, true);
        }
        assert!(!corridor.is_suspected(), "what explains as much is no better");
        let pillars = [AGAINST[0], Opinion { share: 0.35, ..AGAINST[1] }];
        let mut among = Tally::default();
        for k in 0..100 {
            among.add(6 * k * S, &at(k as f32), pillars, true);
        }
        assert!(!among.is_suspected(), "the best of many places is no other place");
        let mut found = Tally::default();
        for k in 0..2 {
            found.add(6 * k * S, &at(k as f32), AGAINST, false);
        }
        assert!(found.is_refuted());
    }
}
