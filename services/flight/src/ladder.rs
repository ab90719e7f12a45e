//! The ladder of DESIGN 4: what is flown when `pilot/channels` goes stale.
//!
//! ```text
//! fresh      Following   the pilot's channels
//! 100 ms     Level       level with the learned trim, hover throttle
//! 300 ms     Descend     the same, throttle by flight's own height loop
//! touched    TouchDown   throttle and arm low, until the pilot once says "no motors"
//! ```
//! A pilot that comes back is followed at once. Before there is any pilot, a disarmed aircraft gets neutral
//! frames and an armed one is an orphan on the second step. On the ground the throttle goes low instead.

use crate::config::Config;
use crate::descent::Descent;
use crate::wish::{CENTRE_US, LOW_US, PITCH, ROLL, THROTTLE, Wish, YAW, neutral};
use ipc_types::Ladder as Step;

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
        }
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

    /// Decides what is sent now. `armed`: what the controller says, once it is believed.
    pub fn decide(&mut self, now: u64, wish: Option<&Wish>, armed: Option<bool>) -> Decision {
        let decision = match wish {
            None => Self::rest(Step::Neutral),
            Some(wish) if now < self.stale_ns(wish) => self.follow(wish),
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

    /// Motors are wanted and nobody says where to.
    fn alone(&mut self, now: u64, wish: &Wish, armed: Option<bool>) -> Decision {
        let mut channels_us = wish.channels_us;
        channels_us[ROLL] = wish.level_roll_us;
        channels_us[PITCH] = wish.level_pitch_us;
        channels_us[YAW] = CENTRE_US;
        let hover = wish.hover_us.unwrap_or(f32::from(wish.channels_us[THROTTLE]));
        let waited = now.saturating_sub(self.stale_ns(wish));
        let (step, throttle_us) = if waited < self.descend_ns {
            (Step::Level, if wish.on_ground { f32::from(LOW_US) } else { hover })
        } else if wish.on_ground || armed == Some(false) {
            (Step::TouchDown, 0.0)
        } else {
            if !self.descent.active() {
                let reckoned = wish.climb_m_s * waited as f32 * 1e-9;
                let height_m = wish.height_m.map(|height| (height + reckoned).max(0.0));
                let hover = wish.hover_us.or_else(|| (hover > 1150.0).then_some(hover));
                self.descent.begin(now, hover, height_m, wish.climb_m_s);
            }
            match self.descent.step(now) {
                Some(fall) if !fall.touched => (Step::Descend, fall.throttle_us),
                _ => (Step::TouchDown, 0.0),
            }
        };
        if step == Step::TouchDown {
            self.latched = true;
            return Self::rest(step);
        }
        channels_us[THROTTLE] = throttle_us.round() as u16;
        Decision { channels_us, count: wish.count, step, arm: true }
    }
}
