//! The service.

mod seeking;
mod update;

use crate::attitude::{Attitudes, seconds};
use crate::clutter::Clutter;
use crate::flow::{Flows, Frame};
use crate::news::News;
use crate::plain::Plain;
use crate::pose::{Walls, fill};
use crate::seek::{Seek, Why};
use crate::set::{MEMORY_GROUNDED, MEMORY_SEEKING, Seeking, Set, columns, fold};
use crate::start::{From, from};
use crate::sweep::{Group, Waiting};
use crate::velocity::Velocity;
use crate::{FilterKind, LocalizationConfig};
use floorplan::{ConeModel, ConeTable};
use ipc_types::{
    Attitude, FlowMotion, LocalizationState, MAX_PARTICLES, Particles, PilotState, Pose, SonarRanges, Text,
};
use mcl::{Estimate, Filter, Lattice, Memory};
use runtime::{Input, Output, Ports, Service, Start, StartError};
use std::fmt::Write;
use std::sync::Arc;

/// The set is moved without a ping up to this long before now, seconds: attitudes and flow are that late.
const BEHIND_S: f64 = 0.04;
/// Half of the cone in which a wall's nearest point is looked for, radians, and the rays over it, two degrees apart.
const WIDE_RAD: f32 = 20.0 * core::f32::consts::PI / 180.0;
const WIDE_RAYS: usize = 21;
/// Doubt that was told fades in this time, seconds: two clusters that are alike take turns in being the larger one.
const FADES_S: f32 = 1.0;
/// After so long, nanoseconds, a set that was sent and did not come back is given up and the last one that
/// did is used again.
const ECHO_TIMEOUT_NS: u64 = 100_000_000;

/// Follows the drone on the plan.
pub struct Localization {
    ranges: Input<SonarRanges>,
    attitude: Input<Attitude>,
    flow: Input<FlowMotion>,
    pilot: Input<PilotState>,
    sets: Input<Particles>,
    poses: Output<Pose>,
    particles: Output<Particles>,

    config: LocalizationConfig,
    filter: Filter<Arc<ConeTable>>,
    /// The thesis's filter, when that is to follow the drone instead.
    plain: Option<Plain>,
    table: Arc<ConeTable>,
    /// The sonars as the velocity looks through them: exactly, and as wide as large things are heard.
    cone: ConeModel,
    plan: u32,
    from: From,
    seed: u64,

    attitudes: Attitudes,
    flows: Flows,
    /// When the flow sensor last saw good floor; zero: never.
    flow_ns: u64,
    /// Since when neither the set nor flow holds the velocity; zero: it is held.
    adrift_ns: u64,
    velocity: Velocity,
    waiting: Waiting,
    walls: Walls,
    news: News,
    clutter: Clutter,
    set: Set,
    seek: Seek,
    /// Share of the last search for another place.
    elsewhere: f32,
    /// The place was refuted by its check, or is suspected by the audits.
    suspected: bool,
    /// What was being looked for before a restart, until it is looked for again.
    kept_why: Option<Why>,
    /// Number and time of the last set sent.
    sent: u64,
    sent_ns: u64,
    grounded: bool,
    /// The level error (roll, pitch) that the attitude told on the ground, while nothing else tells it.
    rest_level: [f32; 2],
    believed: Option<Believed>,
    next_pose_ns: u64,
    /// P(lost) of the last pose, and when that was.
    doubted: f32,
    doubted_ns: u64,
    refused: u64,
}

/// The last update's result.
#[derive(Clone, Copy)]
struct Believed {
    time_ns: u64,
    estimate: Estimate,
    count: usize,
    /// What the heading offset wanders about, as far as the filter knows.
    heading_mean: Option<f32>,
}

impl Service for Localization {
    const NAME: &'static str = "localization";
    type Config = LocalizationConfig;

    fn start(config: LocalizationConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let plan = start.plan()?;
        let begins = from(&config.start, start, &plan)?;
        let hash = fold(plan.hash());
        let lattice = start
            .shared(&format!("lattice {} {}", start.system.plan, start.vehicle.body.radius_m), || {
                Ok(Lattice::new(&plan, start.vehicle.body.radius_m))
            })?;
        let model = ConeModel { max_range_m: config.sonar.max_range, ..ConeModel::default() };
        let table = start.shared(&format!("cone table {} {model:?}", start.system.plan), || {
            ConeTable::new(plan, model).map_err(StartError::invalid)
        })?;
        let filter = Filter::new(config.filter_config(), Arc::clone(&table), MAX_PARTICLES)
            .map_err(StartError::invalid)?;
        let plain = (config.filter == FilterKind::Thesis)
            .then(|| Plain::new(&config, table.plan()).map_err(StartError::invalid))
            .transpose()?;
        let clutter = Clutter::new(table.plan(), start.sidecar()?.doors);
        let room = match &begins {
            From::Room { rooms, room } => Some((Arc::clone(rooms), *room)),
            From::Pad(_) | From::Unknown => None,
        };
        let seek = Seek::new(lattice, &config.filter_config().sonar, room);
        let mut service = Self {
            ranges: ports.input()?,
            attitude: ports.input()?,
            flow: ports.input()?,
            pilot: ports.input()?,
            sets: ports.input()?,
            poses: ports.output()?,
            particles: ports.output()?,
            config,
            filter,
            plain,
            table,
            cone: ConeModel { half_angle_rad: WIDE_RAD, sub_rays: WIDE_RAYS, ..model },
            plan: hash,
            from: begins,
            seed: start.seed,
            attitudes: Attitudes::default(),
            flows: Flows::default(),
            flow_ns: 0,
            adrift_ns: 0,
            velocity: Velocity::default(),
            waiting: Waiting::default(),
            walls: Walls::default(),
            news: News::default(),
            clutter,
            set: Set::None,
            seek,
            elsewhere: 0.0,
            suspected: false,
            kept_why: None,
            sent: 0,
            sent_ns: 0,
            grounded: true,
            rest_level: [0.0; 2],
            believed: None,
            next_pose_ns: 0,
            doubted: 0.0,
            doubted_ns: 0,
            refused: 0,
        };
        if let Some(kept) = ports.retained::<Particles>()? {
            service.resume(kept);
        }
        if matches!(service.set, Set::None) && !matches!(service.from, From::Pad(_)) {
            service.seek_from_nothing();
        }
        Ok(service)
    }

    fn step(&mut self, now: u64) {
        self.listen(now);
        if self.seek.why() == Some(Why::Start) {
            self.seek_on(now);
        } else if self.set_is_back(now) {
            self.advance(now);
        }
        self.publish(now);
    }

    fn status(&self, text: &mut Text<96>) {
        // A text that is full is full.
        let _ = match &self.believed {
            None => write!(text, "waiting for the attitude"),
            Some(_) if self.seek.why() == Some(Why::Start) => {
                write!(
                    text,
                    "searching the plan for the drone, {:.0} % sure of one place",
                    100.0 * self.seek.share()
                )
            }
            Some(b) => {
                let e = &b.estimate;
                let state = match e.state {
                    mcl::State::Lost => LocalizationState::Lost,
                    mcl::State::Converging => LocalizationState::Converging,
                    mcl::State::Tracking => LocalizationState::Tracking,
                };
                write!(
                    text,
                    "{state} at {:.2} {:.2}, sigma {:.2} m, P(lost) {:.3}, {} particles",
                    e.x,
                    e.y,
                    e.sigma(),
                    e.p_lost,
                    b.count
                )
            }
        };
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}

impl Localization {
    /// Goes on from what the keeper held, if it is sound and of this plan.
    fn resume(&mut self, mut kept: Box<Particles>) {
        let sound = kept.plan == self.plan
            && kept.count as usize <= MAX_PARTICLES
            && kept.estimated_ns > 0
            && columns(&kept).check().is_ok();
        if !sound {
            self.refused += 1;
            return;
        }
        self.grounded = kept.memory[MEMORY_GROUNDED] == 1.0;
        match Seeking::of(kept.memory[MEMORY_SEEKING]) {
            Seeking::No => {}
            Seeking::Hypotheses => {
                // They are searched for anew.
                self.sent = kept.updates;
                return;
            }
            Seeking::Unchecked => self.kept_why = Some(Why::Check),
            Seeking::Suspected => (self.kept_why, self.suspected) = (Some(Why::Lost), true),
        }
        // What happened meanwhile is unknown: search with all there is.
        let mut memory = Memory::from_array(&kept.memory);
        memory.wanted = self.config.population.max as f32;
        kept.memory[..MEMORY_SEEKING].copy_from_slice(&memory.to_array()[..MEMORY_SEEKING]);
        self.sent = kept.updates;
        self.set = Set::Kept(kept);
    }

    /// Drains the inputs.
    fn listen(&mut self, now: u64) {
        while let Some(a) = self.attitude.receive() {
            // Times ahead of ours would stop the history until they are reached.
            let taken = a.sampled_ns <= now
                && self.attitudes.push_felt(
                    a.sampled_ns,
                    a.roll_rad,
                    a.pitch_rad,
                    a.yaw_rad,
                    [a.force_x_m_s2, a.force_y_m_s2],
                );
            self.refused += u64::from(!taken);
        }
        while let Some(state) = self.pilot.receive() {
            self.grounded = state.on_ground == 1;
        }
        while let Some(frame) = self.flow.receive() {
            let velocity = [frame.velocity_x_m_s, frame.velocity_y_m_s];
            if velocity.iter().any(|v| v.is_nan()) {
                self.glimpse(now, &frame);
                continue;
            }
            if frame.sampled_ns > now || !self.flows.push(frame.sampled_ns, velocity, frame.sigma_m_s) {
                self.refused += 1;
                continue;
            }
            self.flow_ns = frame.sampled_ns;
            if let Some(b) = self.believed {
                let p = self.predicted(&b, frame.sampled_ns, false);
                let (sin, cos) = p.heading.sin_cos();
                let [x, y] = p.velocity;
                if let Some(frame) = self.flows.gate([cos * x + sin * y, -sin * x + cos * y]) {
                    self.velocity.flow(&frame, &self.attitudes, &self.frames(&b));
                }
            }
        }
        while let Some(message) = self.ranges.receive() {
            match Group::of(&message, now) {
                Some(group) => self.waiting.push(group),
                None => self.refused += 1,
            }
        }
        // One at a time, each in the place of the one before: a reader may hold two.
        while let Some(set) = self.sets.receive() {
            if set.plan == self.plan && set.count as usize <= MAX_PARTICLES && set.count > 0 {
                self.set = Set::Live(set);
            } else {
                self.refused += 1;
            }
        }
    }

    /// A frame from over a poor floor says something about the velocity, but too little to weigh particles by.
    fn glimpse(&mut self, now: u64, frame: &FlowMotion) {
        let velocity = [frame.dim_x_m_s, frame.dim_y_m_s];
        let sane = velocity.iter().all(|v| v.abs() < 10.0) && (1e-3..=5.0).contains(&frame.sigma_m_s);
        let Some(b) = self.believed.filter(|_| sane && frame.sampled_ns > 0 && frame.sampled_ns <= now)
        else {
            return;
        };
        let frame = Frame { time_ns: frame.sampled_ns, velocity, sigma: frame.sigma_m_s };
        self.velocity.dim(&frame, &self.attitudes, &self.frames(&b));
    }

    /// Whether the last set sent has come back, or is not to be waited for any longer.
    fn set_is_back(&self, now: u64) -> bool {
        match self.set.get() {
            Some(set) => set.updates >= self.sent || now.saturating_sub(self.sent_ns) > ECHO_TIMEOUT_NS,
            None => self.sent == 0 || now.saturating_sub(self.sent_ns) > ECHO_TIMEOUT_NS,
        }
    }

    /// One update, when there is something to update by.
    fn advance(&mut self, now: u64) {
        let Some(set) = self.set.get() else {
            self.begin(now);
            return;
        };
        let time_ns = set.estimated_ns;
        if seconds(time_ns, now) > self.config.max_age_s {
            // Only a restart after a long death comes here: a live filter updates itself when all is silent.
            self.set = Set::None;
            self.begin(now);
            return;
        }
        if self.attitudes.is_empty() {
            return;
        }
        if let Some(group) = self.waiting.pop() {
            self.update(group.time_ns.max(time_ns), Some(&group), now);
        } else if seconds(time_ns, now) > self.config.silent_s {
            let to = now.saturating_sub((BEHIND_S * 1e9) as u64);
            self.update(to.max(time_ns), None, now);
        }
    }

    /// The pose for now.
    fn publish(&mut self, now: u64) {
        // A tick a millisecond early is the tick that was meant.
        if now + 1_000_000 < self.next_pose_ns {
            return;
        }
        let Some(b) = self.believed else { return };
        let p = self.predicted(&b, now, true);
        let walls = self.walls.in_echo(now);
        if let Some(mut pose) = self.poses.loan() {
            fill(&mut pose, now, &b.estimate, &p, b.count, walls);
            pose.adrift_ns = self.adrift_ns;
            let faded = self.doubted * (-seconds(self.doubted_ns, now) as f32 / FADES_S).exp();
            pose.p_lost = pose.p_lost.max(self.least_doubt()).max(faded);
            (self.doubted, self.doubted_ns) = (pose.p_lost, now);
            pose.searching = u32::from(self.seek.why() == Some(Why::Start));
            pose.send();
        }
        self.next_pose_ns = now + (1e9 / self.config.pose_hz) as u64;
    }
}
