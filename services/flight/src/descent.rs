//! Coming down without the pilot: a small height loop on the down sonar alone.
//!
//! An alpha-beta-gamma filter estimates height over the ground below, climb and how far the hover throttle is
//! off (as an acceleration); the loop flies the wanted rate of descent on it. A range that jumps is the edge
//! of a table and moves the ground, not the aircraft. Without echoes the filter goes on by dead reckoning.

use crate::config::Config;
use crate::wish::LOW_US;

/// No thrust.
const LOW: f32 = LOW_US as f32;
/// Standard gravity.
const GRAVITY: f32 = 9.81;
/// Thrust grows between linearly and with the square of the throttle above 1000 us: in between.
const THRUST_EXPONENT: f32 = 1.5;
/// Filter gains a reading: position settles in two, the climb follows from it (Kalata's critically damped relations, rounded).
/// The acceleration is learned three times slower than these ask for: ground effect and sag come slowly, and with the loop
/// around it the aircraft swings between 0.1 and 0.8 m/s otherwise.
const ALPHA: f32 = 0.5;
const BETA: f32 = 0.17;
const GAMMA: f32 = 0.01;
/// A range that is off by more is another surface or an outlier: no descent moves so far between two pings.
const JUMP_M: f32 = 0.25;
/// Two jumped readings so close together are a surface.
const AGREE_M: f32 = 0.15;
/// Acceleration for an error of climb, 1/s: slower than the filter at a ping every 0.2 s, faster than the ground comes.
const CLIMB_GAIN: f32 = 1.2;
/// Most acceleration that the loop asks for.
const MOST_M_S2: f32 = 1.5;
/// Most error of the hover throttle that is learned: 20 % of weight.
const MOST_OFFSET_M_S2: f32 = 2.0;
/// Rate of descent for one that drifts, m/s: what `descend_m_s` may be at most. Level in gusts of 0.2 m/s2 it drifts 2 m in
/// five seconds.
const HURRIED_M_S: f32 = 0.6;
/// Below this height it comes down at [`SOFT_M_S`].
const SOFT_BELOW_M: f32 = 0.35;
/// Rate of descent near the ground.
const SOFT_M_S: f32 = 0.22;
/// Without echoes the thrust is kept this much short of the reckoned one, more with time, so that an error of
/// the hover throttle cannot turn the descent into a climb: 2 % too much of it is outweighed in 1.5 s.
const BLIND_BIAS_M_S2: f32 = 0.1;
const BLIND_BIAS_GROWTH_M_S3: f32 = 0.08;
/// Most of it: a tenth of the weight.
const MOST_BIAS_M_S2: f32 = 1.0;
/// It stands when it has come no nearer to the ground for so long, seconds, and is lower than this, metres. A range says no more:
/// the floor here may be a few centimetres off what it was at the take-off.
const STILL_LOW_S: f32 = 0.4;
const LOW_M: f32 = 0.12;
/// On a chair it is believed later, and only below this height, metres.
const STILL_S: f32 = 0.8;
const CHAIR_M: f32 = 0.3;
/// Without any motion for so long it stands wherever that is, seconds.
const STUCK_S: f32 = 4.0;
/// From standing to no thrust, seconds: from 6 cm too high an aircraft that is cut off falls at 1.1 m/s, with this at 0.6.
const RELEASE_S: f32 = 0.8;
/// Height assumed when nobody knows it: patrol height.
const UNKNOWN_HEIGHT_M: f32 = 1.2;
/// Reckoned so far below the ground, it has long been reached: six seconds more than was reckoned.
const BELOW_GROUND_M: f32 = 2.0;
/// Range to the ground of a standing aircraft before it was ever measured.
const STANDING_RANGE_M: f32 = 0.06;

/// The newest of the down sonar, always kept up to date.
#[derive(Debug, Clone, Copy)]
struct DownSonar {
    /// When the newest echo came.
    echo_ns: Option<u64>,
    /// Its range.
    range_m: f32,
    /// Usual time between two pings, seconds.
    interval_s: f32,
    ping_ns: u64,
    /// Range while standing on the ground.
    standing_m: f32,
}

/// A descent on its way.
#[derive(Debug, Clone, Copy)]
struct Falling {
    updated_ns: u64,
    height_m: f32,
    climb_m_s: f32,
    /// What the hover throttle gives too much, m/s2.
    offset_m_s2: f32,
    hover_us: f32,
    throttle_us: f32,
    /// A range that jumped, waiting for another that agrees.
    jumped_m: Option<f32>,
    /// Height at which the range began to stand still, and when.
    still_m: f32,
    still_ns: u64,
    /// When it was found to stand, and the throttle then.
    stands: Option<(u64, f32)>,
    /// When it became blind.
    blind_ns: Option<u64>,
    /// Nothing holds its place.
    hurried: bool,
}

/// What the descent says now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescentStep {
    /// Throttle to fly, microseconds.
    pub throttle_us: f32,
    /// The skids stand on something.
    pub touched: bool,
}

/// The down sonar and, when the pilot is gone, the descent.
#[derive(Debug, Clone)]
pub struct Descent {
    rate_m_s: f32,
    hold_ns: u64,
    blind_ns: u64,
    default_hover_us: f32,
    sonar: DownSonar,
    falling: Option<Falling>,
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}

fn seconds(from: u64, to: u64) -> f32 {
    (to.saturating_sub(from) as f64 * 1e-9) as f32
}

impl Descent {
    /// Nothing known yet.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            rate_m_s: config.descend_m_s as f32,
            hold_ns: nanoseconds(config.blind_hold_after_s),
            blind_ns: nanoseconds(config.blind_descend_after_s),
            default_hover_us: config.default_hover_us as f32,
            sonar: DownSonar {
                echo_ns: None,
                range_m: 0.0,
                interval_s: 0.1,
                ping_ns: 0,
                standing_m: STANDING_RANGE_M,
            },
            falling: None,
        }
    }

    /// A ping of the down sonar. `range_m`: `None` without an echo; `tilt_cos`: cosine of the tilt.
    pub fn ping(&mut self, now: u64, ping_ns: u64, range_m: Option<f32>, tilt_cos: f32, on_ground: bool) {
        if ping_ns <= self.sonar.ping_ns || ping_ns > now {
            return;
        }
        let interval = seconds(self.sonar.ping_ns, ping_ns);
        if interval < 1.0 {
            self.sonar.interval_s += 0.2 * (interval - self.sonar.interval_s);
        }
        self.sonar.ping_ns = ping_ns;
        let Some(range) = range_m.map(|range| range * tilt_cos).filter(|range| range.is_finite()) else {
            return;
        };
        let before = self.sonar.echo_ns;
        self.sonar.echo_ns = Some(now);
        self.sonar.range_m = range;
        if on_ground && range < 0.3 {
            self.sonar.standing_m = range;
        }
        let standing = self.sonar.standing_m;
        if let Some(falling) = &mut self.falling {
            let since = before.map_or(0.1, |before| seconds(before, now)).clamp(0.03, 0.4);
            falling.correct(range - standing, seconds(ping_ns, now), since);
        }
    }

    /// Takes over with what the pilot knew.
    pub fn begin(&mut self, now: u64, hover_us: Option<f32>, height_m: Option<f32>, climb_m_s: f32) {
        let hover_us = hover_us.unwrap_or(self.default_hover_us);
        let by_sonar = self.heard(now).then_some(self.sonar.range_m - self.sonar.standing_m);
        let height_m = by_sonar.or(height_m).unwrap_or(UNKNOWN_HEIGHT_M);
        self.falling = Some(Falling {
            updated_ns: now,
            height_m,
            climb_m_s,
            offset_m_s2: 0.0,
            hover_us,
            throttle_us: hover_us,
            jumped_m: None,
            still_m: height_m,
            still_ns: now,
            stands: None,
            blind_ns: None,
            hurried: false,
        });
    }

    /// Comes down faster while the sonar hears the ground.
    pub fn hurry(&mut self) {
        if let Some(falling) = &mut self.falling {
            falling.hurried = true;
        }
    }

    /// The pilot is back, or it is over.
    pub fn end(&mut self) {
        self.falling = None;
    }

    /// Whether a descent is on its way.
    #[must_use]
    pub fn active(&self) -> bool {
        self.falling.is_some()
    }

    /// Time without an echo that counts as silence; never less than a few turns of the sonars.
    fn hold_limit(&self) -> u64 {
        self.hold_ns.max(nanoseconds(f64::from(self.sonar.interval_s) * 2.5))
    }

    fn silence(&self, now: u64) -> u64 {
        self.sonar.echo_ns.map_or(u64::MAX, |echo| now.saturating_sub(echo))
    }

    fn heard(&self, now: u64) -> bool {
        self.silence(now) < self.hold_limit()
    }

    /// One step of the loop; `None` when no descent was begun.
    pub fn step(&mut self, now: u64) -> Option<DescentStep> {
        let silence = self.silence(now);
        let heard = self.heard(now);
        let blind = silence >= self.blind_ns.max(self.hold_limit());
        let rate_m_s = self.rate_m_s;
        let falling = self.falling.as_mut()?;
        falling.predict(now, blind);
        let wanted = match (heard, falling.height_m < SOFT_BELOW_M) {
            (true, true) => -rate_m_s.min(SOFT_M_S),
            (true, false) if falling.hurried => -rate_m_s.max(HURRIED_M_S),
            _ => -rate_m_s,
        };
        let acceleration = if heard || blind {
            (CLIMB_GAIN * (wanted - falling.climb_m_s)).clamp(-MOST_M_S2, MOST_M_S2)
        } else {
            0.0
        };
        let bias = falling.bias(now, blind);
        let slope = falling.slope();
        falling.throttle_us =
            (falling.hover_us + (acceleration - falling.offset_m_s2 - bias) / slope).clamp(1050.0, 1900.0);
        let last_heard_m = self.sonar.range_m - self.sonar.standing_m;
        if falling.stands.is_none() && falling.is_standing(now, heard, last_heard_m) {
            falling.stands = Some((now, falling.throttle_us));
        }
        let Some((since, throttle_us)) = falling.stands else {
            return Some(DescentStep { throttle_us: falling.throttle_us, touched: false });
        };
        // Once found to stand it is not asked again: the range of a standing aircraft is worth little.
        let left = 1.0 - seconds(since, now) / RELEASE_S;
        Some(DescentStep { throttle_us: LOW + (throttle_us - LOW) * left.max(0.0), touched: left <= 0.0 })
    }
}

impl Falling {
    /// Acceleration a microsecond of throttle gives at hover.
    fn slope(&self) -> f32 {
        THRUST_EXPONENT * GRAVITY / (self.hover_us - 1000.0).max(50.0)
    }

    /// Thrust held back while blind, as an acceleration; the reckoning does not count it.
    fn bias(&mut self, now: u64, blind: bool) -> f32 {
        if !blind {
            self.blind_ns = None;
            return 0.0;
        }
        let blind_s = seconds(*self.blind_ns.get_or_insert(now), now);
        (BLIND_BIAS_M_S2 + BLIND_BIAS_GROWTH_M_S3 * blind_s).min(MOST_BIAS_M_S2)
    }

    fn predict(&mut self, now: u64, blind: bool) {
        let dt = seconds(self.updated_ns, now).min(0.1);
        self.updated_ns = now;
        let bias = self.bias(now, blind);
        let acceleration = self.slope() * (self.throttle_us - self.hover_us) + self.offset_m_s2 + bias;
        self.climb_m_s += acceleration * dt;
        self.height_m += self.climb_m_s * dt;
    }

    fn correct(&mut self, measured_m: f32, age_s: f32, since_s: f32) {
        let innovation = measured_m - (self.height_m - self.climb_m_s * age_s);
        if innovation.abs() > JUMP_M {
            match self.jumped_m {
                // The ground moved: the height follows, the climb does not.
                Some(before) if (before - measured_m).abs() < AGREE_M => {
                    self.height_m += innovation;
                    self.still_m = self.height_m;
                    self.still_ns = self.updated_ns;
                    self.jumped_m = None;
                }
                _ => self.jumped_m = Some(measured_m),
            }
            return;
        }
        self.jumped_m = None;
        self.height_m += ALPHA * innovation;
        self.climb_m_s += BETA / since_s * innovation;
        self.offset_m_s2 = (self.offset_m_s2 + GAMMA / (since_s * since_s) * innovation)
            .clamp(-MOST_OFFSET_M_S2, MOST_OFFSET_M_S2);
    }

    fn is_standing(&mut self, now: u64, heard: bool, last_heard_m: f32) -> bool {
        if (self.height_m - self.still_m).abs() > 0.03 {
            self.still_m = self.height_m;
            self.still_ns = now;
        }
        if !heard {
            // Near the ground the sonar is deaf, so little reckoning is enough; from higher up much is needed.
            return self.height_m < if last_heard_m < 0.15 { -0.15 } else { -BELOW_GROUND_M };
        }
        let still_s = seconds(self.still_ns, now);
        self.height_m < LOW_M && still_s > STILL_LOW_S
            || self.height_m < CHAIR_M && still_s > STILL_S
            || still_s > STUCK_S
    }
}
