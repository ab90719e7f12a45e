//! Height above the floor from a down-looking sonar that sees tables, spikes and nothing.
//!
//! The state is height of the skids above the floor, climb rate and the acceleration that the thrust model
//! does not explain. It is carried forward by the commanded thrust and corrected by echoes at the time that
//! they left the ground (a short memory of past heights). A jump of the reading is never a jump of the drone:
//! it becomes a change of `surface`, the level of what is below.

use crate::check::{RangeError, within};
use crate::held::seconds;

/// Settings of the height estimator.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeightConfig {
    /// Bandwidth of the observer, rad/s: three equal poles. 5 averages 3-10 mm of noise at 16.7 Hz to under
    /// 3 cm/s of climb rate and still sees a wrong hover throttle within half a second.
    pub bandwidth_rad_s: f32,
    /// Disagreement beyond which a reading is a step or a spike, metres: seven times the worst noise.
    pub gate_m: f32,
    /// Widening of the gate for each second without an echo, m/s: what a drone that is 3 % wrong about its
    /// weight gains in a second.
    pub gate_growth_m_s: f32,
    /// Readings in a row that must agree on a step; three are 0.18 s, and 1 % of spikes never make three.
    pub step_readings: u32,
    /// Half-angle of the sonar's cone, degrees. While the body tilts less than this the nearest echo is
    /// straight below and the range *is* the height; beyond it the cone's edge is the nearest.
    pub cone_half_angle_deg: f32,
    /// Greatest tilt at which echoes are used, degrees.
    pub max_tilt_deg: f32,
}

impl Default for HeightConfig {
    fn default() -> Self {
        Self {
            bandwidth_rad_s: 5.0,
            gate_m: 0.07,
            gate_growth_m_s: 0.3,
            step_readings: 3,
            cone_half_angle_deg: 15.0,
            max_tilt_deg: 30.0,
        }
    }
}

impl HeightConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("height.bandwidth_rad_s", self.bandwidth_rad_s, 1.0, 8.0)?;
        within("height.gate_m", self.gate_m, 0.03, 0.3)?;
        within("height.gate_growth_m_s", self.gate_growth_m_s, 0.0, 2.0)?;
        within("height.step_readings", self.step_readings as f32, 2.0, 8.0)?;
        within("height.cone_half_angle_deg", self.cone_half_angle_deg, 0.0, 40.0)?;
        within("height.max_tilt_deg", self.max_tilt_deg, 15.0, 45.0)
    }
}

/// What became of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Echo {
    /// It fitted and corrected the estimate.
    Used,
    /// It does not fit; whether it is a step will be seen.
    Doubted,
    /// Enough readings agree: what is below has another level.
    Step,
    /// The drone itself moved more than the thrust explains: the estimate follows at once.
    Jolt,
    /// No number, out of reach, or tilted too far.
    Refused,
}

#[derive(Clone, Copy, Debug, Default)]
struct Doubt {
    count: u32,
    growing: u32,
    level_m: f32,
    error_m: f32,
    at_ns: u64,
}

/// Heights remembered: at 50 Hz 0.64 s, several times the age of the oldest echo.
const MEMORY: usize = 32;
/// Unexplained acceleration that is believed, m/s2: a third of the weight.
const MAX_BIAS_M_S2: f32 = 3.5;
/// Period of a reading from which the gate starts to widen, seconds.
const USUAL_PERIOD_S: f32 = 0.06;
/// Errors that grow so often in a row, and to so much, are a fall of the drone, metres: over a soft chair echoes come
/// 2 to 10 cm late, and grow by chance. Only towards the ground: nothing throws a drone up faster than its thrust
/// explains, but the far side of a plant or chair falls away from under it in just such readings.
const JOLT_READINGS: u32 = 2;
const JOLT_M: f32 = 0.15;
/// Levels that differ by less are the same, metres.
const SAME_LEVEL_M: f32 = 0.06;
/// A thing so thin is flown over like the floor, metres; estimates of the level drift by less.
const THIN_M: f32 = 0.15;
/// With so much room below a level may be forgotten without harm, metres: the seat of a chair at flying height leaves 0.75.
const ROOMY_M: f32 = 0.8;
/// How fast a level that cannot be (below the floor) or does not matter (thin) is forgotten, m/s.
const FORGET_M_S: f32 = 0.04;

/// The estimator.
#[derive(Clone, Debug)]
pub struct HeightEstimator {
    config: HeightConfig,
    height_m: f32,
    climb_m_s: f32,
    bias_m_s2: f32,
    surface_m: f32,
    rest_m: f32,
    memory: [(u64, f32); MEMORY],
    newest: usize,
    now_ns: u64,
    last_echo_ns: u64,
    doubt: Doubt,
}

impl HeightEstimator {
    /// On the floor. `rest_m` is what the sonar reads when the skids stand on the floor.
    #[must_use]
    pub fn new(config: HeightConfig, rest_m: f32) -> Self {
        Self {
            config,
            height_m: 0.0,
            climb_m_s: 0.0,
            bias_m_s2: 0.0,
            surface_m: 0.0,
            rest_m: if rest_m.is_finite() { rest_m.clamp(0.0, 0.5) } else { 0.0 },
            memory: [(0, 0.0); MEMORY],
            newest: 0,
            now_ns: 0,
            last_echo_ns: 0,
            doubt: Doubt::default(),
        }
    }

    /// Starts (again) in this state, for instance after a restart in the air. What is no number reads as zero.
    pub fn set(&mut self, now: u64, height_m: f32, climb_m_s: f32, surface_m: f32) {
        let known = |value: f32| if value.is_finite() { value } else { 0.0 };
        self.height_m = known(height_m).clamp(-0.5, 10.0);
        self.climb_m_s = known(climb_m_s).clamp(-3.0, 3.0);
        self.surface_m = known(surface_m).clamp(-1.0, 3.0);
        self.bias_m_s2 = 0.0;
        self.doubt = Doubt::default();
        self.now_ns = now;
        self.last_echo_ns = now;
        self.memory = [(now, self.height_m); MEMORY];
    }

    /// Sets what the sonar reads when the skids stand on the floor.
    pub fn set_rest(&mut self, rest_m: f32) {
        if rest_m.is_finite() {
            self.rest_m = rest_m.clamp(0.0, 0.5);
        }
    }

    /// What the sonar reads when the skids stand on the floor.
    #[must_use]
    pub fn rest_m(&self) -> f32 {
        self.rest_m
    }

    /// Carries the state to `now` under the vertical acceleration that the thrust model expects.
    pub fn predict(&mut self, now: u64, acceleration_m_s2: f32) {
        let dt = seconds(self.now_ns, now).min(0.1);
        self.now_ns = self.now_ns.max(now);
        if dt <= 0.0 {
            return;
        }
        let a = if acceleration_m_s2.is_finite() { acceleration_m_s2 } else { 0.0 } + self.bias_m_s2;
        self.height_m += self.climb_m_s * dt + 0.5 * a * dt * dt;
        self.climb_m_s = (self.climb_m_s + a * dt).clamp(-4.0, 4.0);
        if self.surface_m < 0.0 {
            // Nothing lies below the floor: the estimate of the height was too low, and comes up slowly.
            let up = (FORGET_M_S * dt).min(-self.surface_m);
            self.lift_all(up, up);
        } else if self.surface_m < THIN_M || self.clearance_m() > ROOMY_M {
            // What is thin does not matter; what is far below and stays is the floor, and the height was wrong.
            let down = (0.5 * FORGET_M_S * dt).min(self.surface_m);
            self.lift_all(-down, -down);
        }
        self.newest = (self.newest + 1) % MEMORY;
        self.memory[self.newest] = (now, self.height_m);
    }

    /// Moves height and surface alike: the distance between them, which is measured, stays.
    fn lift_all(&mut self, height: f32, surface: f32) {
        self.height_m += height;
        self.surface_m += surface;
        for (_, h) in &mut self.memory {
            *h += height;
        }
    }

    /// The height believed for a past moment.
    fn height_at(&self, at_ns: u64) -> f32 {
        let mut later = (self.now_ns, self.height_m);
        for back in 0..MEMORY {
            let entry = self.memory[(self.newest + MEMORY - back) % MEMORY];
            if entry.0 <= at_ns {
                let span = seconds(entry.0, later.0);
                let share = if span > 0.0 { seconds(entry.0, at_ns).min(span) / span } else { 0.0 };
                return entry.1 + share * (later.1 - entry.1);
            }
            later = entry;
        }
        later.1
    }

    /// Takes an echo that left the ground at `at_ns`, with the body tilted by `tilt_rad` from the vertical.
    pub fn measure(&mut self, at_ns: u64, range_m: f32, tilt_rad: f32) -> Echo {
        let tilt = if tilt_rad.is_finite() { tilt_rad.abs() } else { 0.0 };
        if !(range_m > 0.0 && range_m < 20.0) || tilt > self.config.max_tilt_deg.to_radians() {
            return Echo::Refused;
        }
        let beyond = (tilt - self.config.cone_half_angle_deg.to_radians()).max(0.0);
        let below = range_m * beyond.cos() - self.rest_m;
        let at_ns = at_ns.min(self.now_ns);
        let then = self.height_at(at_ns);
        let error = below - (then - self.surface_m);
        let gap = seconds(self.last_echo_ns, at_ns);
        let gate = self.config.gate_m + self.config.gate_growth_m_s * (gap - USUAL_PERIOD_S).clamp(0.0, 1.0);
        if error.abs() <= gate {
            self.doubt = Doubt::default();
            self.correct(at_ns, gap, error);
            return Echo::Used;
        }
        self.doubted(at_ns, then - below, error)
    }

    fn doubted(&mut self, at_ns: u64, level: f32, error: f32) -> Echo {
        let last = self.doubt;
        let recent = last.count > 0 && seconds(last.at_ns, at_ns) < 0.4;
        let agrees = recent && (level - last.level_m).abs() < SAME_LEVEL_M;
        // A fall that the thrust does not explain grows from reading to reading; an edge does not.
        let grows = recent && !agrees && error * last.error_m > 0.0 && error.abs() > last.error_m.abs();
        self.doubt = Doubt {
            count: if agrees { last.count + 1 } else { 1 },
            growing: if grows && (error - last.error_m).abs() < 0.35 { last.growing + 1 } else { 0 },
            level_m: if agrees { last.level_m + 0.5 * (level - last.level_m) } else { level },
            error_m: error,
            at_ns,
        };
        if self.doubt.growing >= JOLT_READINGS && error < -JOLT_M {
            let climb = (error - last.error_m) / seconds(last.at_ns, at_ns).max(0.02);
            self.doubt = Doubt::default();
            self.last_echo_ns = at_ns;
            let ahead = seconds(at_ns, self.now_ns);
            self.lift_all(error, 0.0);
            self.height_m += climb * ahead;
            self.climb_m_s = (self.climb_m_s + climb).clamp(-4.0, 4.0);
            return Echo::Jolt;
        }
        if self.doubt.count >= self.config.step_readings {
            let level = self.doubt.level_m;
            self.doubt = Doubt::default();
            self.last_echo_ns = at_ns;
            self.surface_m = if level.abs() <= self.config.gate_m { 0.0 } else { level };
            return Echo::Step;
        }
        Echo::Doubted
    }

    /// The fading-memory filter of third order: three equal poles at exp(-bandwidth x period).
    fn correct(&mut self, at_ns: u64, gap_s: f32, error: f32) {
        self.last_echo_ns = at_ns;
        let period = gap_s.clamp(0.03, 0.2);
        let pole = (-self.config.bandwidth_rad_s * period).exp();
        let left = 1.0 - pole;
        let height = (1.0 - pole * pole * pole) * error;
        let climb = 1.5 * left * left * (1.0 + pole) / period * error;
        let bias = left * left * left / (period * period) * error;
        self.height_m += height + climb * seconds(at_ns, self.now_ns);
        self.climb_m_s += climb;
        self.bias_m_s2 = (self.bias_m_s2 + bias).clamp(-MAX_BIAS_M_S2, MAX_BIAS_M_S2);
        for (t, h) in &mut self.memory {
            *h += height + climb * seconds(at_ns, *t);
        }
    }

    /// Moves up to `share` of the unexplained acceleration out of the estimate, to whoever can explain it.
    pub fn take_bias(&mut self, share: f32) -> f32 {
        let taken = self.bias_m_s2 * share.clamp(0.0, 1.0);
        self.bias_m_s2 -= taken;
        taken
    }

    /// Height of the skids above the floor, metres.
    #[must_use]
    pub fn height_m(&self) -> f32 {
        self.height_m
    }
    /// Climb rate, m/s.
    #[must_use]
    pub fn climb_m_s(&self) -> f32 {
        self.climb_m_s
    }
    /// Acceleration that the thrust model does not explain, m/s2.
    #[must_use]
    pub fn bias_m_s2(&self) -> f32 {
        self.bias_m_s2
    }
    /// Level of what is below against the floor, metres.
    #[must_use]
    pub fn surface_m(&self) -> f32 {
        self.surface_m
    }
    /// Distance of the skids from what is below, metres.
    #[must_use]
    pub fn clearance_m(&self) -> f32 {
        self.height_m - self.surface_m
    }
    /// Seconds since an echo was believed.
    #[must_use]
    pub fn silent_s(&self, now: u64) -> f32 {
        seconds(self.last_echo_ns, now)
    }
}
