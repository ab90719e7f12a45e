//! Everything but the ports: from places, echoes, commands and the pilot's state to a setpoint.

mod astray;
mod follow;

use crate::aside::Courtesy;
use crate::atlas::Atlas;
use crate::blockage::Blockage;
use crate::config::NavigationConfig;
use crate::explore::Explore;
use crate::firm::Firm;
use crate::journey::{Journey, Work};
use crate::mission::{Event, Goal, Heard, Intent, Mission, Nonsense};
use crate::place::Place;
use crate::senses::Senses;
use crate::steer::{Craft, Scene, Steer, Steering};
use crate::words::{blank_setpoint, write_polar};
use avoid::grid::{insert, scroll};
use avoid::{CELL_M, CELLS, GridRules, Histogram, SIDE, WallLayer, Window};
use floorplan::Cell;
use ipc_types::{
    Answer, Command, Grid, Patrol, PilotState, Polar, Pose, Setpoint, SetpointKind, SonarRanges, Text,
    seconds_between,
};
use std::sync::Arc;

/// Slower wishes are a hover at the place where the drone stands: a velocity of nothing drifts.
const STANDING_M_S: f32 = 0.03;
/// Cells of the plan nearer to a wall than this are stamped as wall, metres.
const WALL_SKIN_M: f32 = 0.02;
/// Beams kept for the grid between two decisions: two sweeps of a full set of sonars.
const MAX_BEAMS: usize = 64;

/// Navigation without its ports.
#[derive(Debug)]
pub struct Core {
    config: NavigationConfig,
    atlas: Arc<Atlas>,
    place: Option<Place>,
    /// Grids from before this are in another frame.
    frame_ns: u64,
    explore: Explore,
    senses: Senses,
    beams: Vec<avoid::Beam>,
    rules: GridRules,
    walls: WallLayer,
    steering: Steering,
    pub(crate) blockage: Blockage,
    waited_before_s: f32,
    pub(crate) mission: Mission,
    pub(crate) journey: Journey,
    pub(crate) courtesy: Courtesy,
    stand: Option<(f32, f32)>,
    firm: Firm,
    last_ns: Option<u64>,
    pub(crate) text: Text<128>,
    pub(crate) answer: Text<96>,
    started_ns: u64,
    refused: u64,
}

impl Core {
    /// Over a building, for a vehicle.
    ///
    /// # Errors
    /// A vehicle that the method of avoidance cannot be made for.
    pub fn new(
        config: NavigationConfig,
        craft: Craft,
        atlas: Arc<Atlas>,
    ) -> Result<Self, avoid::ConfigError> {
        Ok(Self {
            senses: Senses::new(craft.radius_m),
            steering: Steering::new(craft, config.avoid)?,
            rules: config.avoid.grid_rules(),
            mission: Mission::new(atlas.pad()),
            journey: Journey::new(Arc::clone(&atlas), config.tries),
            config,
            atlas,
            place: None,
            frame_ns: 0,
            explore: Explore::default(),
            beams: Vec::with_capacity(MAX_BEAMS),
            walls: WallLayer::new(),
            blockage: Blockage::default(),
            waited_before_s: 0.0,
            courtesy: Courtesy::default(),
            stand: None,
            firm: Firm::default(),
            last_ns: None,
            text: Text::new("waiting for a command"),
            answer: Text::default(),
            started_ns: 0,
            refused: 0,
        })
    }

    /// Messages refused since start.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// One sentence: what is being done and why.
    #[must_use]
    pub fn text(&self) -> &str {
        self.text.as_str()
    }

    /// Where the round stands.
    #[must_use]
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// The route and what was seen.
    #[must_use]
    pub fn journey(&self) -> &Journey {
        &self.journey
    }

    /// After a restart: goes on with the round that the keeper holds, if it is for this plan.
    pub fn resume(&mut self, now: u64, patrol: &Patrol) {
        match self.journey.restore(patrol) {
            Ok((state, there)) => {
                self.started_ns = patrol.started_ns;
                self.waited_before_s = if patrol.waited_s.is_finite() { patrol.waited_s } else { 0.0 };
                let answer = u8::try_from(patrol.answer).ok().and_then(Answer::from_code);
                let heard = Heard {
                    sequence: patrol.command_sequence,
                    // A time that has not come yet would shut out every later order.
                    stamp_ns: patrol.command_ns.min(now),
                    answer: answer.unwrap_or(Answer::None),
                };
                self.answer = patrol.answer_text;
                self.mission.restore(state, (patrol.pad_x_m, patrol.pad_y_m), there, heard);
            }
            Err(Nonsense) => self.refused += 1,
        }
    }

    /// A new estimate.
    pub fn pose(&mut self, pose: &Pose) {
        match Place::of(pose, self.place.as_ref()) {
            Some(place) => {
                if self.place.is_some_and(|last| place.jumped(&last)) {
                    self.jump(&place);
                }
                self.place = Some(place);
            }
            None => self.refused += 1,
        }
    }

    /// Echoes: kept until the next decision.
    pub fn ranges(&mut self, ranges: &SonarRanges) {
        if ranges.count as usize > ranges.readings.len() {
            self.refused += 1;
            return;
        }
        let Some(place) = &self.place else {
            return;
        };
        for reading in ranges.filled() {
            if let Some(beam) = self.senses.take(reading, place, self.atlas.plan())
                && self.beams.len() < MAX_BEAMS
            {
                self.beams.push(beam);
            }
        }
    }

    /// The pilot's state.
    pub fn pilot(&mut self, pilot: &PilotState) {
        let heard = self.mission.hear(pilot, self.place.as_ref());
        self.act(heard);
    }

    /// An operator's command.
    pub fn command(&mut self, now: u64, command: &Command) {
        let before = self.mission.heard();
        let obeyed = self.mission.obey(now, command, self.place.as_ref());
        if self.mission.heard() != before {
            self.say_answer(if self.mission.automatic() {
                "there is no round to pause"
            } else {
                "the automatic is switched off"
            });
        }
        self.act(obeyed);
    }

    fn act(&mut self, event: Result<Option<Event>, Nonsense>) {
        match event {
            Ok(None) => return,
            Ok(Some(Event::NewRound)) => {
                self.journey.plan_new_round();
                self.started_ns = self.last_ns.unwrap_or(0);
            }
            Ok(Some(Event::Plan)) => self.journey.plan(),
            Ok(Some(Event::Drop)) => self.journey.drop_route(),
            Err(Nonsense) => {
                self.refused += 1;
                return;
            }
        }
        self.steering.forget();
        self.blockage.reset();
        self.courtesy.forget();
        self.stand = None;
    }

    /// The pose, if it may be flown by.
    fn fresh_place(&self, now: u64) -> Option<Place> {
        self.place
            .filter(|place| place.age_s(now) <= self.config.pose_age_s && place.age_s(now) > -1.0)
            .map(|place| place.at(now))
    }

    /// Moves the grid under the drone and enters the echoes. `last` is the grid published before. False
    /// when there is no pose to put it around; then `next` is not to be sent.
    pub fn map(&mut self, now: u64, last: Option<&Grid>, next: &mut Grid) -> bool {
        let Some(window) = self.fresh_place(now).and_then(|place| Window::around(place.x, place.y)) else {
            self.beams.clear();
            return false;
        };
        let known = last
            .filter(|grid| (grid.cell_m - CELL_M).abs() < 1e-6 && grid.header.stamp_ns <= now)
            .filter(|grid| grid.header.stamp_ns > self.frame_ns)
            .and_then(|grid| Window::from_origin(grid.origin_x_m, grid.origin_y_m).map(|from| (grid, from)));
        match known {
            Some((grid, from)) => {
                let faded = self.rules.faded(grid.header.stamp_ns, now);
                scroll(&grid.cells, &from, &mut next.cells, &window, faded);
            }
            None => next.cells.fill(0),
        }
        (next.origin_x_m, next.origin_y_m) = window.origin();
        next.cell_m = CELL_M;
        next.reserved = [0; 11];
        for beam in self.beams.drain(..) {
            insert(&mut next.cells, &window, &self.rules, &beam);
        }
        true
    }

    /// One decision. `cells` and its window are the grid just made, empty when there is none.
    pub fn decide(&mut self, now: u64, grid: Option<&Grid>, polar: &mut Polar) -> Setpoint {
        let dt_s = self.last_ns.map_or(0.0, |last| seconds_between(last, now).clamp(0.0, 0.5)) as f32;
        self.last_ns = Some(now);
        let place = self.fresh_place(now);
        if self.mission.waited_on_the_ground(dt_s) {
            self.journey.drop_route();
        }
        if let Some(place) = place.filter(|place| place.tracking && self.mission.airborne()) {
            self.journey.see(&place);
            self.firm.see(now, &place);
        }
        let hearing = self.senses.fresh(now, self.config.ranges_age_s);
        if let Some(place) = place.filter(|place| place.searching) {
            write_polar(polar, None);
            return self.search(now, dt_s, &place, grid.filter(|_| hearing));
        }
        let planned = self.journey.planned();
        let intent = self.mission.intent(place.as_ref(), planned, self.config.pad_m, dt_s);
        let window = grid.and_then(|grid| Window::from_origin(grid.origin_x_m, grid.origin_y_m));
        let (steer, setpoint) = match (place, grid, window) {
            (Some(place), Some(grid), Some(window)) => {
                let setpoint = self.setpoint(now, &place, intent);
                let follow = intent == Intent::Follow && hearing && place.tracking;
                let steer = self.steer(now, dt_s, &place, (grid, window), follow, polar);
                let setpoint = if follow {
                    self.follow(dt_s, &place, grid, window, &steer, setpoint)
                } else {
                    self.steering.forget();
                    let aloft = matches!(intent, Intent::Hover(_)) && self.mission.airborne();
                    if aloft && hearing && place.tracking { give_way(&steer, setpoint) } else { setpoint }
                };
                (Some((steer, hearing && place.tracking)), setpoint)
            }
            _ => (None, blank_setpoint(now, &self.config)),
        };
        write_polar(polar, steer.as_ref().map(|(steer, seeing)| (steer, *seeing)));
        self.say(intent, steer.is_some_and(|(_, seeing)| seeing));
        setpoint
    }

    /// Works one bounded slice of a route that is being planned: to be called when the setpoint is out.
    pub fn plan_on(&mut self, now: u64) {
        // No way leads from a place that is not on the plan.
        let Some(place) = self.fresh_place(now).filter(|place| !place.searching) else {
            return;
        };
        if self.courtesy.over(now, &self.senses)
            && !self.journey.planned()
            && self.mission.goal() != Goal::None
        {
            self.journey.plan();
        }
        let before = self.mission.heard();
        match self.journey.work(self.mission.goal(), &place, self.mission.pad()) {
            Work::Ready => {
                self.mission.route_ready();
                self.blockage.resume(core::mem::take(&mut self.waited_before_s));
                self.steering.forget();
            }
            Work::NoWay => self.mission.no_way(Some(&place)),
            Work::Idle | Work::Busy => {}
        }
        if self.mission.heard() != before {
            let trouble = Text::<64>::new(self.journey.trouble());
            self.say_answer(trouble.as_str());
        }
    }

    fn steer(
        &mut self,
        now: u64,
        dt_s: f32,
        place: &Place,
        (grid, window): (&Grid, Window),
        follow: bool,
        polar: &mut Polar,
    ) -> Steer {
        let (plan, field) = (self.atlas.plan(), self.atlas.field());
        self.walls
            .follow(&window, |x, y| plan.cell_at(x, y) != Cell::Free || field.distance(x, y) < WALL_SKIN_M);
        let aim = if follow {
            self.journey.advance(place);
            self.steering.aim(&self.config, field, place, self.journey.track())
        } else {
            None
        };
        let scene = Scene {
            now,
            place: *place,
            window,
            cells: &grid.cells,
            walls: self.walls.cells(),
            field,
            senses: &self.senses,
            dt_s,
        };
        let mut histogram =
            Histogram { raw: &mut polar.raw, smoothed: &mut polar.smoothed, blocked: &mut polar.blocked };
        self.steering.step(&self.config, &scene, aim, &mut histogram)
    }

    /// The setpoint of an intent, before steering has its say.
    fn setpoint(&mut self, now: u64, place: &Place, intent: Intent) -> Setpoint {
        let mut setpoint = blank_setpoint(now, &self.config);
        let hold = match intent {
            Intent::Hover(hold) => hold,
            Intent::Follow => Some((place.x, place.y)),
            Intent::Land(pad) => {
                setpoint.kind = u32::from(SetpointKind::Land.code());
                Some(pad)
            }
        };
        if intent != Intent::Follow {
            self.stand = None;
        }
        if let Some((x, y)) = hold {
            (setpoint.hold_x_m, setpoint.hold_y_m) = (x, y);
        }
        setpoint
    }

    /// Fills the retained message.
    pub fn write_patrol(&mut self, patrol: &mut Patrol) {
        self.journey.write(patrol);
        patrol.started_ns = self.started_ns;
        patrol.state = u32::from(self.mission.state().code());
        (patrol.pad_x_m, patrol.pad_y_m) = self.mission.pad().unwrap_or((f32::NAN, f32::NAN));
        let heard = self.mission.heard();
        patrol.command_ns = heard.stamp_ns;
        patrol.command_sequence = heard.sequence;
        patrol.answer = u32::from(heard.answer.code());
        patrol.answer_text = self.answer;
        patrol.waited_s = self.blockage.waited_s().max(self.waited_before_s);
        patrol.text = self.text;
    }
}

/// A hover gives way to what comes too near.
fn give_way(steer: &Steer, mut setpoint: Setpoint) -> Setpoint {
    let (vx, vy) = steer.velocity;
    if vx.hypot(vy) >= STANDING_M_S {
        setpoint.kind = u32::from(SetpointKind::Velocity.code());
        (setpoint.velocity_x_m_s, setpoint.velocity_y_m_s) = (vx, vy);
        (setpoint.hold_x_m, setpoint.hold_y_m) = (f32::NAN, f32::NAN);
    }
    setpoint
}

// The grid message holds exactly the window that the algorithms work on.
const _: () = assert!(CELLS == ipc_types::GRID_CELLS && SIDE == ipc_types::GRID_SIDE);
