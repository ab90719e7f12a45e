//! The ladder of DESIGN 4: what is flown when `pilot/channels` goes stale.
//!
//! ```text
//! fresh      Following   the pilot's channels
//! 100 ms     Level       level with the learned trim, hover throttle
//! 300 ms     Descend     the same, throttle by flight's own height loop
//! touched    TouchDown   throttle and arm low, until the pilot once says "no motors"
//! ```
//! The same steps are taken for a pilot that is there, while the controller tells no attitude: commands still arrive, but
//! sticks by a tilt that nobody knows fly into a wall within two seconds. There it is level after 300 ms, with the
//! pilot's throttle, which needs no attitude, and down after 1 s. On a line that is too slow it is the pilot's height loop
//! that fails first: it comes down at once, under `flight`'s slower one, by the pilot's sticks.
//!
//! A pilot that comes back is followed at once, and so is one that can see again. Before there is any pilot, a disarmed aircraft gets neutral
//! frames and an armed one is an orphan on the second step. On the ground the throttle goes low instead.

use crate::config::Config;
use crate::descent::Descent;
use crate::wish::{CENTRE_US, LOW_US, PITCH, ROLL, THROTTLE, Wish, YAW, neutral};
use ipc_types::Ladder as Step;

/// Without attitude for so long the sticks are level: the pilot takes the tilt for level from here on, and would fly
/// by what the localization makes of that.
const UNSEEN_LEVEL_NS: u64 = 300_000_000;
/// ... and it comes down: what drifts level is in the next wall after a few seconds. As for a down sonar that is silent.
const UNSEEN_DESCEND_NS: u64 = 1_000_000_000;

/// What the controller tells of the tilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// The newest attitude is so old, nanoseconds.
    Seen(u64),
    /// Attitudes come, and they and what is sent are held up for longer than can be flown by.
    Late,
}

impl View {
    fn is_clear(self) -> bool {
        matches!(self, Self::Seen(age_ns) if age_ns < UNSEEN_LEVEL_NS)
    }
}

/// What to send.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Roll, pitch, throttle, yaw, AUX1...; AUX1 is not decided here.
    pub channels_us: [u16; 18],
    /// Filled channels.
    pub count: usize,
    /// How far `flight` has taken over.
    pub step: Step,
    /// Motors are to run.
    pub arm: bool,
}

/// The ladder and its memory.
#[derive(Debug, Clone)]
pub struct Ladder {
    level_ns: u64,
    /// From stale to descending.
    descend_ns: u64,
    descent: Descent,
    /// Landed by itself: no motors until the pilot says so itself.
    latched: bool,
    step: Step,
    /// The step was taken because the controller tells no attitude.
    unseen: bool,
    /// Roll and pitch that kept it level while the attitude was known: what the pilot learns without it is nonsense.
    level_us: (u16, u16),
}

impl Ladder {
    /// At the bottom: neutral.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let nanoseconds = |seconds: f64| (seconds * 1e9) as u64;
        Self {
            level_ns: nanoseconds(config.level_after_s),
            descend_ns: nanoseconds(config.descend_after_s - config.level_after_s),
            descent: Descent::new(config),
            latched: false,
            step: Step::Neutral,
            unseen: false,
            level_us: (CENTRE_US, CENTRE_US),
        }
    }

    /// Whether the last step was taken because nobody knows the tilt.
    #[must_use]
    pub fn unseen(&self) -> bool {
        self.unseen
    }

    /// A ping of the down sonar; see [`Descent::ping`].
    pub fn ping(&mut self, now: u64, ping_ns: u64, range_m: Option<f32>, tilt_cos: f32, wish: Option<&Wish>) {
        let on_ground = wish.is_some_and(|wish| wish.on_ground && now < self.stale_ns(wish));
        self.descent.ping(now, ping_ns, range_m, tilt_cos, on_ground);
    }

    /// Landed by itself and waiting for the pilot to ask for no motors.
    #[must_use]
    pub fn latched(&self) -> bool {
        self.latched
    }

    /// The step that was decided last.
    #[must_use]
    pub fn current(&self) -> Step {
        self.step
    }

    /// From here on the wish is stale: its own expiry, which may only be shortened.
    fn stale_ns(&self, wish: &Wish) -> u64 {
        wish.expiry_ns.min(wish.stamp_ns.saturating_add(self.level_ns))
    }

    /// Decides what is sent now. `armed`: what the controller says, once it is believed; `view`: what it tells of
    /// the tilt.
    pub fn decide(&mut self, now: u64, wish: Option<&Wish>, armed: Option<bool>, view: View) -> Decision {
        let fresh = wish.is_some_and(|wish| now < self.stale_ns(wish));
        let flies = wish.is_some_and(|wish| wish.arm && !wish.on_ground) && !self.latched;
        self.unseen = fresh && flies && !view.is_clear();
        if let Some(wish) = wish.filter(|_| view.is_clear()) {
            self.level_us = (wish.level_roll_us, wish.level_pitch_us);
        }
        let decision = match wish {
            None => Self::rest(Step::Neutral),
            Some(wish) if self.unseen => self.without_attitude(now, wish, armed, view),
            Some(wish) if fresh => self.follow(wish),
            Some(_) if self.latched => Self::rest(Step::TouchDown),
            Some(wish) if !wish.arm => Self::rest(Step::Neutral),
            Some(wish) => self.alone(now, wish, armed),
        };
        if decision.step != Step::Descend {
            self.descent.end();
        }
        self.step = decision.step;
        decision
    }

    /// Throttle and switch low.
    fn rest(step: Step) -> Decision {
        Decision { channels_us: neutral(), count: 6, step, arm: false }
    }

    fn follow(&mut self, wish: &Wish) -> Decision {
        if !wish.arm {
            self.latched = false;
        }
        let mut channels_us = wish.channels_us;
        if self.latched {
            channels_us[THROTTLE] = LOW_US;
        }
        Decision { channels_us, count: wish.count, step: Step::Following, arm: wish.arm && !self.latched }
    }

    /// The pilot flies, and nobody knows the tilt well enough.
    fn without_attitude(&mut self, now: u64, wish: &Wish, armed: Option<bool>, view: View) -> Decision {
        match view {
            View::Seen(age_ns) if age_ns < UNSEEN_DESCEND_NS => {
                self.level(wish, Step::Level, wish.channels_us[THROTTLE])
            }
            View::Seen(_) => {
                let decision = self.down(now, wish, armed, 0);
                self.descent.hurry();
                decision
            }
            View::Late => {
                let mut decision = self.down(now, wish, armed, 0);
                if decision.step == Step::Descend {
                    for stick in [ROLL, PITCH, YAW] {
                        decision.channels_us[stick] = wish.channels_us[stick];
                    }
                }
                decision
            }
        }
    }

    /// Level with the learned trim.
    fn level(&self, wish: &Wish, step: Step, throttle_us: u16) -> Decision {
        let mut channels_us = wish.channels_us;
        (channels_us[ROLL], channels_us[PITCH]) = self.level_us;
        channels_us[YAW] = CENTRE_US;
        channels_us[THROTTLE] = throttle_us;
        Decision { channels_us, count: wish.count, step, arm: true }
    }

    /// Motors are wanted and nobody says where to.
    fn alone(&mut self, now: u64, wish: &Wish, armed: Option<bool>) -> Decision {
        let waited = now.saturating_sub(self.stale_ns(wish));
        if waited >= self.descend_ns {
            return self.down(now, wish, armed, waited);
        }
        let hover_us = wish.hover_us.map_or(wish.channels_us[THROTTLE], |hover| hover.round() as u16);
        self.level(wish, Step::Level, if wish.on_ground { LOW_US } else { hover_us })
    }

    /// Down by the own height loop. `waited`: how old what the pilot knew is.
    fn down(&mut self, now: u64, wish: &Wish, armed: Option<bool>, waited: u64) -> Decision {
        let over = wish.on_ground || armed == Some(false);
        if !over && !self.descent.active() {
            let reckoned = wish.climb_m_s * waited as f32 * 1e-9;
            let height_m = wish.height_m.map(|height| (height + reckoned).max(0.0));
            let throttle_us = f32::from(wish.channels_us[THROTTLE]);
            let hover = wish.hover_us.or_else(|| (throttle_us > 1150.0).then_some(throttle_us));
            self.descent.begin(now, hover, height_m, wish.climb_m_s);
        }
        match self.descent.step(now).filter(|fall| !over && !fall.touched) {
            Some(fall) => self.level(wish, Step::Descend, fall.throttle_us.round() as u16),
            None => {
                self.latched = true;
                Self::rest(Step::TouchDown)
            }
        }
    }
}
