//! Height above the floor from a down-looking sonar that sees tables, spikes and nothing.
//!
//! The state is height of the skids above the floor, climb rate and the acceleration that the thrust model
//! does not explain. It is carried forward by the commanded thrust and corrected by echoes at the time that
//! they left the ground (a short memory of past heights). Readings that do not fit are collected until they lie on
//! a line: a level one is a change of `surface`, the level of what is below; a steep one is the drone's own motion.

use crate::check::{RangeError, within};
use crate::doubts::{DOUBT_APART_S, DOUBTS, Doubts};
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
    /// Widening of the gate with the square of the time without an echo, m/s2: half of the acceleration of a drone
    /// that is 3 % wrong about its weight and stands in a gust.
    pub gate_growth_m_s2: f32,
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
            gate_growth_m_s2: 0.3,
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
        within("height.gate_growth_m_s2", self.gate_growth_m_s2, 0.0, 2.0)?;
        within("height.step_readings", self.step_readings as f32, 3.0, DOUBTS as f32)?;
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

/// Heights remembered: at 50 Hz 0.64 s, several times the age of the oldest echo.
const MEMORY: usize = 32;
/// Unexplained acceleration that is believed, m/s2: a third of the weight.
const MAX_BIAS_M_S2: f32 = 3.5;
/// What the accelerometer feels is believed in this time, seconds: its low-pass and the link are 0.03 s behind the model.
const FELT_S: f32 = 0.1;
/// Silence from which the gate widens, seconds: after a shorter one, what does not fit is rather a step than a drift.
const SILENCE_S: f32 = 0.4;
/// Readings on one line scatter about it by less than this, metres: over carpets echoes come 2 to 10 cm late.
const LINE_M: f32 = 0.04;
/// Errors that grow slower than this are those of another level, metres a second.
const LEVEL_M_S: f32 = 0.4;
/// Errors that grow faster than this are the drone's own motion, metres a second, by the number of readings: from
/// three, late echoes alone make 0.27 rms, from four 0.17, from five 0.12.
const MOTION_M_S: [f32; 3] = [1.0, 0.6, 0.4];
/// A thing so thin is flown over like the floor, metres; estimates of the level drift by less.
const THIN_M: f32 = 0.15;
/// With so much room below a level may be forgotten without harm, metres: the seat of a chair at flying height leaves 0.75.
const ROOMY_M: f32 = 0.8;
/// How fast a level that cannot be (below the floor) or does not matter (thin) is forgotten, m/s.
const FORGET_M_S: f32 = 0.04;

/// What a beam's range may miss, metres: at most three times its noise over carpets, where it is four times that of
/// floors; at least five times the noise over floors.
const BEAM_GATE_M: f32 = 0.2;
const BEAM_LEAST_GATE_M: f32 = 0.08;
/// Things lower than this are no step to a beam that misses as over a carpet, metres.
const LOW_THING_M: f32 = 0.35;
/// And between them so many of its mean misses: five standard deviations.
const BEAM_MISSES: f32 = 4.0;
/// What misses by more than that and less than a level passes (the rim of a trolley's bed) or stays for so long, seconds:
/// then the height was wrong.
const LOW_S: f32 = 0.4;
/// Mean miss of the beam over a good floor, metres; where it misses by more, it is followed more slowly.
const BEAM_SURE_M: f32 = 0.02;
/// Share of the newest miss in the mean: about half a second of them.
const BEAM_SHARE: f32 = 0.08;
/// Mean miss over the mean difference of two readings in a row, for normal noise: levels and motion leave no trace in
/// differences (von Neumann 1941).
const MISS_OF_DIFFERENCE: f32 = 0.707;
/// Ranges of a beam that agree on another level: 0.16 s at 25 Hz.
const BEAM_READINGS: usize = 4;

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
    doubts: Doubts,
    /// When the accelerometer was heard last.
    felt_ns: u64,
    /// What the beam's ranges scatter by of late, metres: a floor or a carpet. And the last of them.
    beam_m: f32,
    beam_range_m: f32,
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
            doubts: Doubts::default(),
            felt_ns: 0,
            beam_m: BEAM_SURE_M,
            beam_range_m: 0.0,
        }
    }

    /// Starts (again) in this state, for instance after a restart in the air. What is no number reads as zero.
    pub fn set(&mut self, now: u64, height_m: f32, climb_m_s: f32, surface_m: f32) {
        let known = |value: f32| if value.is_finite() { value } else { 0.0 };
        self.height_m = known(height_m).clamp(-0.5, 10.0);
        self.climb_m_s = known(climb_m_s).clamp(-3.0, 3.0);
        self.surface_m = known(surface_m).clamp(-1.0, 3.0);
        self.bias_m_s2 = 0.0;
        self.doubts = Doubts::default();
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

    /// The accelerometer feels this much more than the thrust model expects, m/s2: a gust, a sagging battery or a motor
    /// that lags, before they have moved the body.
    pub fn feel(&mut self, now: u64, more_m_s2: f32) {
        let dt = seconds(self.felt_ns, now).clamp(0.0, FELT_S);
        self.felt_ns = now;
        if more_m_s2.is_finite() {
            let more = more_m_s2.clamp(-MAX_BIAS_M_S2, MAX_BIAS_M_S2);
            self.bias_m_s2 += dt / FELT_S * (more - self.bias_m_s2);
        }
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

    /// Takes a range of a narrow beam along the body's axis, measured at `at_ns` from `rest_m` above the skids with the
    /// body tilted by `tilt_rad`. It sees what lies under the middle and nothing else: what does not fit is another
    /// level, a motion it would have followed.
    pub fn measure_beam(&mut self, at_ns: u64, range_m: f32, rest_m: f32, tilt_rad: f32) -> Echo {
        let tilt = if tilt_rad.is_finite() { tilt_rad.abs() } else { 0.0 };
        if !(range_m > 0.0 && range_m < 20.0) || tilt > self.config.max_tilt_deg.to_radians() {
            return Echo::Refused;
        }
        let at_ns = at_ns.min(self.now_ns);
        let error = range_m * tilt.cos() - rest_m - (self.height_at(at_ns) - self.surface_m);
        let gap = seconds(self.last_echo_ns, at_ns);
        let differs = (range_m - self.beam_range_m).abs();
        self.beam_range_m = range_m;
        if differs < BEAM_GATE_M {
            self.beam_m += BEAM_SHARE * (MISS_OF_DIFFERENCE * differs - self.beam_m);
        }
        let silent = if self.doubts.count > 0 { 0.0 } else { gap };
        let drifted = self.config.gate_growth_m_s2 * silent.clamp(0.0, 1.0).powi(2);
        let gate = (BEAM_MISSES * self.beam_m).clamp(BEAM_LEAST_GATE_M, BEAM_GATE_M) + drifted;
        if error.abs() <= gate {
            self.doubts = Doubts::default();
            // The noise of the climb rate goes with noise times bandwidth to the power of 3/2.
            // Over the first centimetres of a carpet two readings in a row tell that they are not worth as much any more.
            let noise = self.beam_m.max(MISS_OF_DIFFERENCE * differs);
            let calm = (BEAM_SURE_M / noise.max(BEAM_SURE_M)).powf(2.0 / 3.0);
            self.correct(at_ns, gap, error, self.config.bandwidth_rad_s * calm);
            return Echo::Used;
        }
        self.doubts.push(at_ns, error);
        let newest = self.doubts.count.saturating_sub(BEAM_READINGS);
        let last = &self.doubts.error_m[newest..self.doubts.count];
        let mean = last.iter().sum::<f32>() / BEAM_READINGS as f32;
        if last.len() < BEAM_READINGS || last.iter().any(|error| (error - mean).abs() > BEAM_GATE_M) {
            return Echo::Doubted;
        }
        let level = self.surface_m - mean;
        let off_a_low_one = self.surface_m > 0.0 && level.abs() <= gate;
        // Over a carpet a few readings may agree by chance and carry the height off. What seems to be a low thing below is
        // more often that, and whoever takes one for it climbs, which does no harm; the other way round it would sink.
        let low_thing =
            self.surface_m <= THIN_M && self.beam_m > BEAM_SURE_M && (-LOW_THING_M..0.0).contains(&mean);
        if (mean.abs() > BEAM_GATE_M && !low_thing) || off_a_low_one {
            self.surface_m = if level.abs() <= BEAM_GATE_M { 0.0 } else { level };
            self.doubts = Doubts::default();
            self.last_echo_ns = at_ns;
            return Echo::Step;
        }
        if gap < LOW_S {
            return Echo::Doubted;
        }
        self.lift_all(mean, 0.0);
        self.doubts = Doubts::default();
        self.last_echo_ns = at_ns;
        Echo::Jolt
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
        // Silence widens the gate; readings that were doubted say where the ground is.
        let silent = if self.doubts.count > 0 { 0.0 } else { gap - SILENCE_S };
        let gate = self.config.gate_m + self.config.gate_growth_m_s2 * silent.clamp(0.0, 1.0).powi(2);
        if error.abs() <= gate {
            // What was doubted shortly before did not drift there since the last echo that fitted.
            let since = self.doubts.last().map_or(gap, |(at, _)| gap.min(seconds(at, at_ns)));
            self.doubts = Doubts::default();
            self.correct(at_ns, since, error, self.config.bandwidth_rad_s);
            return Echo::Used;
        }
        self.doubted(at_ns, error)
    }

    /// A reading that does not fit: what several of them in a row lie on is a step of the ground, a motion of the
    /// drone, or a step and a motion.
    fn doubted(&mut self, at_ns: u64, error: f32) -> Echo {
        self.doubts.push(at_ns, error);
        let enough = self.doubts.count >= self.config.step_readings as usize;
        let Some(line) = self.doubts.line().filter(|line| enough && line.scatter_m < LINE_M) else {
            return Echo::Doubted;
        };
        let believed_ns = self.last_echo_ns;
        let most = MOTION_M_S[(self.doubts.count - 3).min(MOTION_M_S.len() - 1)];
        if line.slope_m_s.abs() < LEVEL_M_S {
            let count = self.doubts.count as f32;
            let level = self.surface_m - self.doubts.error_m[..self.doubts.count].iter().sum::<f32>() / count;
            self.doubts = Doubts::default();
            self.last_echo_ns = at_ns;
            self.surface_m = if level.abs() <= self.config.gate_m { 0.0 } else { level };
            return Echo::Step;
        }
        if line.slope_m_s.abs() < most {
            return Echo::Doubted;
        }
        // Where the line was when the last echo fitted: there it began, unless the ground stepped as well.
        let began = line.error_m - line.slope_m_s * seconds(believed_ns, at_ns).min(DOUBT_APART_S);
        let step = if began.abs() > 2.0 * self.config.gate_m { began } else { 0.0 };
        self.doubts = Doubts::default();
        self.last_echo_ns = at_ns;
        self.surface_m -= step;
        self.lift_all(line.error_m - step, 0.0);
        self.height_m += line.slope_m_s * seconds(at_ns, self.now_ns);
        self.climb_m_s = (self.climb_m_s + line.slope_m_s).clamp(-4.0, 4.0);
        Echo::Jolt
    }

    /// The fading-memory filter of third order: three equal poles at exp(-bandwidth x period).
    fn correct(&mut self, at_ns: u64, gap_s: f32, error: f32, bandwidth_rad_s: f32) {
        self.last_echo_ns = at_ns;
        let period = gap_s.clamp(0.03, 0.2);
        let pole = (-bandwidth_rad_s * period).exp();
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
