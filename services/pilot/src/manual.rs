//! The human's hand: who holds the sticks, what they ask for, and what ends that.

use crate::command::{Ruling, refused};
use crate::core::PilotCore;
use crate::senses::{LEAST_LEFT_NS, age_s};
use control::{Axes, Flip, Hand, Lease, StickInput, SticksHeard, TakeOver, Terms, Under, Vector};
use core::fmt::Write;
use ipc_types::{Command, Phase, Sticks, Text};

/// Slower than this the drone stands, m/s: a hover sways by 0.1 m/s.
const STANDS_M_S: f32 = 0.2;
/// Who has braked for so long stands as well as he can, in gusts, seconds: from cruise a stop takes one.
const BRAKED_S: f32 = 3.0;
/// So much of the climb goes on when the stick is let go, seconds: that height is held, not one that was passed.
const CARRIES_S: f32 = 0.3;
/// A stick that has moved by so much since that was last said is not kept waiting, of a full deflection.
const PROMPT: f32 = 0.1;

/// What tells one holder of the sticks from another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Holder {
    pub(crate) account: Text<32>,
    pub(crate) certificate: Text<32>,
    pub(crate) socket: u64,
}

impl PartialEq for Holder {
    fn eq(&self, other: &Self) -> bool {
        self.socket == other.socket
            && self.account.as_str() == other.account.as_str()
            && self.certificate.as_str() == other.certificate.as_str()
    }
}

impl Holder {
    pub(crate) fn of(command: &Command) -> Self {
        Self { account: command.account, certificate: command.certificate, socket: command.socket }
    }
}

/// Everything about the sticks that is remembered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ByHand {
    pub(crate) lease: Lease<Holder>,
    /// When the last input was made of a holder whose silence ended his lease in the air; until somebody says what next.
    pub(crate) lost_ns: Option<u64>,
    /// Since when it has been coming to a stop.
    pub(crate) stopping_ns: Option<u64>,
    /// Where the sticks were when a move of theirs was last called prompt.
    told: Axes,
    /// They have moved since, or been let go.
    pub(crate) prompt: bool,
}

impl PilotCore {
    pub(crate) fn terms(&self) -> Terms {
        Terms {
            hover_s: self.config.failsafe.operator_hover_s,
            lease_s: self.config.failsafe.operator_lease_s,
            spare_s: LEAST_LEFT_NS as f32 * 1e-9,
            neutral: self.config.manual.neutral,
        }
    }

    /// Refuses in a sentence that names the holder.
    pub(crate) fn held_by(holder: &Holder) -> Ruling {
        let mut sentence = Text::<96>::default();
        // It fits: a name has at most 32 bytes.
        let _ = write!(sentence, "refused: {} holds the sticks", holder.account);
        Err(sentence)
    }

    /// Grants the sticks, or says why not.
    pub(crate) fn take_sticks(&mut self, now: u64, command: &Command) -> Ruling {
        if command.socket == 0 {
            return refused("refused: sticks need a connection of their own, which an order alone has not");
        }
        if self.airborne() && self.judged.take_over == TakeOver::No {
            let mut sentence = Text::<96>::default();
            // It fits.
            let _ = write!(sentence, "refused: nobody may fly by hand now: {}", self.judged.cause.words());
            return Err(sentence);
        }
        let terms = self.terms();
        let known = self.by_hand.lease.number();
        let number = match self.by_hand.lease.ask(now, Holder::of(command), &terms) {
            Ok(number) => number,
            Err(holder) => return Self::held_by(&holder),
        };
        if number == known && !matches!(self.phase, Phase::Landing | Phase::EmergencyLanding) {
            return Ok("the sticks are yours already");
        }
        match self.phase {
            Phase::Grounded => Ok("the sticks are yours: let them go once"),
            Phase::Arming => Ok("the sticks are yours after the take-off"),
            Phase::TakeOff if self.spool.is_some() => Ok("the sticks are yours after the take-off"),
            _ => {
                self.operator_land = false;
                self.lands_at = None;
                self.fly_by_hand(now);
                Ok("the sticks are yours: stopping first")
            }
        }
    }

    /// The drone is the holder's: it stops, at the height that it has.
    pub(crate) fn fly_by_hand(&mut self, now: u64) {
        self.hold = None;
        self.hold_heading = Some(self.heading());
        self.height_wish_m = self.height.height_m();
        self.by_hand.stopping_ns = Some(now);
        self.enter(now, Phase::Manual);
    }

    /// The holder lets go.
    pub(crate) fn release_sticks(&mut self, now: u64, command: &Command) -> Ruling {
        let his = command.lease == 0 || command.lease == self.by_hand.lease.number();
        if !his || !self.by_hand.lease.release(&Holder::of(command)) {
            return refused("refused: you do not hold the sticks");
        }
        Ok(self.hands_off(now, "the sticks are nobody's"))
    }

    /// Nobody holds the sticks any more: what flies hovers, what has not lifted off stays. Nothing resumes by itself.
    pub(crate) fn hands_off(&mut self, now: u64, why: &'static str) -> &'static str {
        match self.phase {
            Phase::Manual => {
                self.hold = None;
                self.enter(now, Phase::Hover);
            }
            Phase::Arming => self.give_up(now, why),
            Phase::TakeOff if self.spool.is_some() => self.give_up(now, why),
            Phase::TakeOff => self.after_take_off = Phase::Hover,
            _ => {}
        }
        self.changed = true;
        self.say(why);
        why
    }

    /// Takes sticks. Those of another lease are counted and ignored; so is what makes no sense.
    pub fn sticks(&mut self, now: u64, message: &Sticks) {
        let Some(input) = crate::senses::sticks(now, message) else {
            self.refused += 1;
            return;
        };
        let terms = self.terms();
        if self.by_hand.lease.hear(now, &input, &terms) == SticksHeard::Foreign {
            self.refused += 1;
        }
    }

    /// Times the lease, and moves its state on.
    pub(crate) fn watch_hand(&mut self, now: u64) {
        let terms = self.terms();
        let before = self.by_hand.lease.hand();
        let braked_s = self.by_hand.stopping_ns.map_or(0.0, |since| age_s(Some(since), now));
        let stands = self.motion.velocity().norm() < STANDS_M_S || braked_s > BRAKED_S;
        let under = match self.phase {
            Phase::Grounded | Phase::Cut => Under::Ground,
            Phase::Manual => Under::Hand { stands },
            _ => Under::Other,
        };
        if let Some(age_s) = self.by_hand.lease.step(now, under, &terms) {
            if self.airborne() {
                let made_ns = now.saturating_sub((f64::from(age_s) * 1e9) as u64);
                self.by_hand.lost_ns = Some(made_ns);
            }
            self.hands_off(now, "who held the sticks fell silent");
        }
        let axes = self.followed().map_or(Axes::default(), |input| input.axes);
        self.by_hand.prompt = axes.apart(&self.by_hand.told) >= PROMPT;
        if self.by_hand.prompt {
            self.by_hand.told = axes;
        }
        let hand = self.by_hand.lease.hand();
        if hand != before {
            self.changed = true;
            self.by_hand.stopping_ns = (hand == Hand::Stopping).then_some(now);
            if self.phase == Phase::Manual {
                self.say_hand(hand);
            }
        }
        if let Some(flip) = self.by_hand.lease.take_flip() {
            self.heed_switch(now, flip, hand);
        }
    }

    fn say_hand(&mut self, hand: Hand) {
        self.say(match hand {
            Hand::Free => return,
            Hand::Stopping => "by hand: stopping first",
            Hand::AwaitingNeutral => "by hand: let the sticks go once",
            Hand::Ready => "by hand: hovering until the button is held",
            Hand::Following => "by hand: following the sticks",
            Hand::Silent => "by hand: nothing new is heard of who holds the sticks",
        });
    }

    /// The arm switch arms only on the ground, and lands in the air.
    fn heed_switch(&mut self, now: u64, flip: Flip, hand: Hand) {
        match (flip, self.phase) {
            (Flip::On, Phase::Grounded) if hand == Hand::Ready => {
                if let Err(why) = self.try_take_off(now, Phase::Manual) {
                    self.say(why.as_str());
                }
            }
            (Flip::On, Phase::Grounded) => self.say("refused: the sticks must be let go before they arm"),
            (Flip::Off, Phase::Arming) => {
                self.call_off(now);
            }
            (Flip::Off, Phase::TakeOff) if self.spool.is_some() => {
                self.call_off(now);
            }
            (Flip::Off, Phase::TakeOff | Phase::Hover | Phase::Autonomous | Phase::Manual) => {
                self.operator_land = true;
                self.land(now, None);
                self.say("landing: the arm switch is off");
            }
            _ => {}
        }
    }

    /// A failsafe has begun that the holder cannot fly on through.
    pub(crate) fn mind_the_table(&mut self, now: u64) {
        if self.airborne() && self.judged.lease_over && self.by_hand.lease.revoke() {
            self.hands_off(now, "a failsafe took the sticks away");
        }
    }

    /// For how long nothing new has been heard of who holds the sticks, or held them last, seconds.
    pub(crate) fn operator_silent_s(&self, now: u64) -> f32 {
        let lost = self.by_hand.lost_ns.map(|made_ns| age_s(Some(made_ns), now));
        lost.or_else(|| self.by_hand.lease.age_s(now)).unwrap_or(0.0)
    }

    /// What the sticks ask for now.
    pub(crate) fn followed(&self) -> Option<StickInput> {
        self.by_hand.lease.followed().filter(|_| self.phase == Phase::Manual)
    }

    /// The velocity that they ask for, plan frame; `None`: to stand.
    pub(crate) fn asked_velocity(&self, input: &StickInput) -> Option<Vector> {
        let axes = input.axes.beyond(self.config.manual.neutral);
        let most = self.config.manual.speed_m_s.min(self.craft.cruise_m_s);
        let wish = (Vector::new(axes.forward, axes.left) * most).limited(most);
        (wish.norm() > 0.0).then(|| wish.rotated(self.heading()))
    }

    /// Until when an input may be flown, nanoseconds.
    pub(crate) fn flown_until(&self, input: &StickInput) -> u64 {
        input.made_ns.saturating_add(ipc_types::nanoseconds(f64::from(self.config.failsafe.operator_hover_s)))
    }

    /// The turn rate that the sticks ask for, radians a second; `None`: to keep the heading that is held.
    pub(crate) fn asked_turn(&mut self) -> Option<f32> {
        let input = self.followed()?;
        let turn = input.axes.beyond(self.config.manual.neutral).turn;
        if turn == 0.0 && input.heading_hold {
            return None;
        }
        // Whatever heading is reached is held from then on.
        self.hold_heading = Some(self.heading());
        Some(turn * self.config.manual.turn_deg_s.to_radians())
    }

    /// The climb rate that the sticks ask for between two heights, m/s; `None`: to keep the height that is held.
    pub(crate) fn asked_climb(&mut self, low_m: f32, high_m: f32) -> Option<f32> {
        let input = self.followed()?;
        let up = input.axes.beyond(self.config.manual.neutral).up;
        if up == 0.0 && input.height_hold {
            return None;
        }
        let (height_m, climb_m_s) = (self.height.height_m(), self.height.climb_m_s());
        self.height_wish_m = height_m + CARRIES_S * climb_m_s;
        let gain = self.config.climb.height_gain_per_s;
        let rate = up * self.config.manual.climb_m_s;
        Some(rate.min(gain * (high_m - height_m)).max(gain * (low_m - height_m)))
    }
}
