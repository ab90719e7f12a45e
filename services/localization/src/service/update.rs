//! From one set to the next.

use super::{Believed, Localization};
use crate::attitude::{Tilt, seconds};
use crate::clutter::Ear;
use crate::plain::Flown;
use crate::predict::{Dynamics, predict};
use crate::set::{MEMORY_GROUNDED, MEMORY_SEEKING, columns, columns_mut};
use crate::start::From;
use crate::sweep::Group;
use crate::velocity::Frames;
use floorplan::cast_cone;
use ipc_types::Particles;
use mcl::{Generator, Memory, Motion, Sweep, Update, wrap_angle};
use runtime::Loan;

/// Attitudes averaged before the first set is drawn: a quarter of a second at 30 Hz, enough for the whole
/// degrees in which a controller gives its yaw.
const RESTING_SAMPLES: usize = 8;
/// Tilt on the ground beyond which it is the ground that slopes, radians; the level error of a calibrated
/// controller is smaller.
const LARGEST_LEVEL: f32 = 0.05;
/// Doubt of a set that was drawn in the air because nothing better was left.
const HOPELESS: f32 = 0.9;
/// A set that doubts itself more than this is no witness of the velocity.
const DOUBTED: f32 = 0.05;
/// With a place less sure than this, metres, echoes are compared with the wrong walls.
const SURE_M: f32 = 1.0;
/// The velocity that is flown by errs alike for so long, seconds: to the set, one update of it is a part of one witness.
const SWEPT_S: f32 = 1.5;
/// Without a flow frame for so long, seconds, the sensor is as good as not there.
const FLOW_KEPT_S: f64 = 5.0;
/// And it is never surer than this, m/s.
const LEAST_SWEPT_M_S: f32 = 0.1;

impl Localization {
    /// Draws the first set around the start, once the attitude has settled.
    pub(super) fn begin(&mut self, now: u64) {
        if self.attitudes.len() < RESTING_SAMPLES {
            return;
        }
        let (Some(resting), Some(mut loan)) = (self.attitudes.resting(), self.particles.loan()) else {
            return;
        };
        let From::Pad(pad) = self.from else {
            self.seek_from_nothing();
            return;
        };
        let level = self.level_of(&resting);
        let start = &self.config.start;
        let start = mcl::Start {
            x: pad.x,
            y: pad.y,
            sigma: start.sigma_m,
            heading_offset: wrap_angle(pad.heading - resting.yaw),
            heading_sigma: start.heading_sigma_deg.to_radians(),
            level_roll: level[0],
            level_pitch: level[1],
            level_sigma: start.level_sigma_deg.to_radians(),
            velocity: [0.0; 2],
            p_lost: if self.grounded { 0.01 } else { HOPELESS },
        };
        let mut generator = Generator::new(self.seed);
        let update = match &mut self.plain {
            None => self.filter.start_at(&start, columns_mut(&mut loan), &mut generator),
            Some(plain) => plain.begin(&start, &mut loan, &mut generator),
        };
        self.believed = Some(self.send(now, now, &update, &generator, loan));
    }

    /// The level error (roll, pitch) that an attitude at rest on the ground tells; in the air it tells none.
    pub(super) fn level_of(&self, resting: &Tilt) -> [f32; 2] {
        let most = if self.grounded { LARGEST_LEVEL } else { 0.0 };
        [resting.roll, resting.pitch].map(|angle| angle.clamp(-most, most))
    }

    /// Sends a set that was written for `time_ns`.
    pub(super) fn send(
        &mut self,
        now: u64,
        time_ns: u64,
        update: &Update,
        generator: &Generator,
        mut loan: Loan<Particles>,
    ) -> Believed {
        loan.estimated_ns = time_ns;
        loan.updates = self.sent + 1;
        loan.generator = generator.state();
        loan.memory = update.memory.to_array();
        loan.memory[MEMORY_GROUNDED] = f32::from(u8::from(self.grounded));
        loan.memory[MEMORY_SEEKING] = self.seeking().code();
        loan.count = update.count as u32;
        loan.plan = self.plan;
        loan.send();
        self.sent += 1;
        self.sent_ns = now;
        Believed {
            time_ns,
            estimate: update.estimate,
            count: update.count,
            heading_mean: update.memory.heading_mean,
        }
    }

    /// Reads the last set, writes the next for `time_ns` into a fresh loan and sends it.
    pub(super) fn update(&mut self, time_ns: u64, group: Option<&Group>, now: u64) {
        let Some(set) = self.set.get() else { return };
        let Some(mut loan) = self.particles.loan() else { return };
        let memory = Memory::from_array(&set.memory);
        let level = self.believed.map_or([0.0; 2], |b| [b.estimate.level_roll, b.estimate.level_pitch]);
        let mean = self.attitudes.mean(set.estimated_ns, time_ns);
        // What the accelerometer reads of gravity, because it sits aslant, is no motion.
        let aslant = self.velocity.accelerometer_error();
        let felt = self.believed.map(|_| [0, 1].map(|axis| mean.force[axis] + aslant[axis]));
        // The set's level stands still; what the attitude errs by while it flies is followed beside it.
        let upright = self.believed.map_or(level, |b| self.upright(&b));
        let strayed = [upright[0] - level[0], upright[1] - level[1]];
        let dt_s = seconds(set.estimated_ns, time_ns) as f32;
        let motion = Motion {
            felt,
            dt_s,
            blind_s: mean.blind_s,
            roll_rad: mean.roll - strayed[0],
            pitch_rad: mean.pitch - strayed[1],
            yaw_rad: mean.yaw,
            flow: self.flows.take(time_ns, &self.attitudes, upright).or_else(|| self.swept(time_ns, dt_s)),
            grounded: self.grounded,
        };
        let then = self.attitudes.at(time_ns).unwrap_or_default();
        let news = self.news.follow(motion.dt_s, self.velocity.way, then.yaw);
        let (familiar, doors) = self.believed.zip(group).map_or((0, 0), |(b, g)| {
            let (ear, table) = (Ear::of(&b.estimate, then.yaw), &self.table);
            let expected = |x: f32, y: f32, angle: f32| table.range(x, y, angle);
            (self.clutter.familiar(g.readings(), &ear), self.clutter.doors(g.readings(), &ear, expected))
        });
        let sweep = group.map(|g| Sweep {
            readings: g.readings(),
            familiar,
            doors,
            roll_rad: then.roll - upright[0],
            pitch_rad: then.pitch - upright[1],
            yaw_rad: then.yaw,
            news,
        });
        let mut generator = Generator::from_state(set.generator);
        let flown = self.plain.as_ref().and_then(|_| self.flown(time_ns));
        let (sweep, generator_now) = (sweep.as_ref(), &mut generator);
        let update = match &mut self.plain {
            None => {
                let next = columns_mut(&mut loan);
                self.filter.update(columns(set), &memory, &motion, sweep, next, generator_now)
            }
            Some(plain) => plain.update(set, &memory, &motion, flown, sweep, &mut loan, generator_now),
        };
        if update.count == 0 {
            return;
        }
        if let Some(group) = group {
            self.walls.take(&group.sensors[..group.count], update.fits, time_ns);
            self.clutter.learn(group.readings(), &Ear::of(&update.estimate, then.yaw), update.short);
        }
        let believed = self.send(now, time_ns, &update, &generator, loan);
        let (e, frames) = (&believed.estimate, self.frames(&believed));
        if let Some(group) = group {
            let (place, velocity) = ([e.x, e.y], [e.velocity_x, e.velocity_y]);
            let spread = [e.variance_x, e.variance_y].map(f32::sqrt);
            if self.grounded || e.p_lost < DOUBTED || self.flows_lately(time_ns) {
                self.adrift_ns = 0;
            } else if self.adrift_ns == 0 {
                self.adrift_ns = time_ns;
            }
            if self.grounded {
                self.velocity.stand(time_ns, place, [e.level_roll, e.level_pitch]);
            } else if e.p_lost < DOUBTED || !self.velocity.is_known(time_ns) {
                self.velocity.place(time_ns, place, spread, velocity, &self.attitudes, &frames);
            } else {
                // A set that has lost its way moves as its errors do.
                self.velocity.advance(time_ns, &self.attitudes, &frames);
            }
            // Along a corridor the place may be unsure for long, and a set may doubt where along it: the walls beside are
            // still the ones meant.
            let sure = e.sigma() < SURE_M;
            let plan = self.table.plan();
            for ranged in group.ranged() {
                self.velocity.range(time_ns, &ranged, &self.attitudes, &frames, |x, y, angle| {
                    sure.then(|| cast_cone(plan, &self.cone, x, y, angle))?
                });
            }
        }
        self.believed = Some(believed);
        if let Some(group) = group {
            self.watch(now, group, familiar | doors, &believed);
        }
    }

    /// What is flown by, as the set takes it while the flow sensor sees nothing: what ranges and poor floors show of the
    /// velocity. A vehicle without the sensor lets each particle keep its own velocity: flown by one that errs, and then
    /// seen moving by it, the set would tell the velocity that it is right.
    fn swept(&self, time_ns: u64, dt_s: f32) -> Option<mcl::Flow> {
        if !self.flows_lately(time_ns) {
            return None;
        }
        let frames = self.frames(self.believed.as_ref().filter(|_| dt_s > 0.0)?);
        let swept = self.velocity.at(time_ns, &self.attitudes, &frames)?;
        let (sin, cos) = (self.attitudes.at(time_ns)?.yaw + frames.heading_offset).sin_cos();
        let [x, y] = swept.velocity;
        Some(mcl::Flow {
            velocity_x: cos * x + sin * y,
            velocity_y: -sin * x + cos * y,
            sigma: (swept.sigma * (SWEPT_S / dt_s).sqrt()).max(LEAST_SWEPT_M_S),
        })
    }

    /// The velocity that is flown by, as a set takes it that has none of its own.
    fn flown(&self, time_ns: u64) -> Option<Flown> {
        let b = self.believed?;
        let p = self.predicted(&b, time_ns, false);
        Some(Flown {
            velocity: p.velocity,
            sigma: p.velocity_sigma,
            heading_offset: b.estimate.heading_offset,
        })
    }

    /// Whether a flow sensor has seen good floor lately.
    pub(super) fn flows_lately(&self, time_ns: u64) -> bool {
        self.flow_ns > 0 && seconds(self.flow_ns, time_ns) <= FLOW_KEPT_S
    }

    /// What the attitude reads when the body is upright (roll, pitch).
    pub(super) fn upright(&self, b: &Believed) -> [f32; 2] {
        self.velocity.upright(&self.attitudes, &self.frames(b))
    }

    pub(super) fn frames(&self, b: &Believed) -> Frames {
        let e = &b.estimate;
        let level = [e.level_roll, e.level_pitch];
        Frames { heading_offset: e.heading_offset, level, drag: self.config.motion.drag }
    }

    pub(super) fn predicted(&self, b: &Believed, to_ns: u64, with_flow: bool) -> crate::predict::Predicted {
        let motion = &self.config.motion;
        let dynamics = Dynamics { drag: motion.drag, velocity_noise: motion.velocity_noise };
        let flows = if with_flow { self.flows.waiting() } else { &[] };
        let mut p = predict(&b.estimate, dynamics, b.time_ns, to_ns, &self.attitudes, flows);
        if let Some(swept) = self.velocity.at(to_ns, &self.attitudes, &self.frames(b)) {
            (p.velocity, p.velocity_sigma, p.air) = (swept.velocity, swept.sigma, swept.air);
        }
        if self.grounded {
            p.position = [b.estimate.x, b.estimate.y];
            p.velocity = [0.0; 2];
            p.air = [f32::NAN; 2];
            p.variance = 0.0;
        }
        p
    }
}
