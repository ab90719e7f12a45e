//! One decision: from the aim on the route to a velocity and a heading.

mod lane;
mod line;
mod method;

use crate::config::{Method, NavigationConfig};
use crate::fence::{self, Fence};
use crate::place::Place;
use crate::senses::Senses;
use avoid::swath::free_length;
use avoid::{Avoider, ConfigError, Decision, Histogram, Reason, Situation, Vfh, Window, wrap};
use floorplan::DistanceField;
use ipc_types::SteeringReason;
use line::along;
pub use line::{Aim, clearance_between};
use method::Chosen;

/// Certainty at which a cell stands in the way: one reading, for 2 s. The next ping of what moves or is passed falls
/// into another cell; an outlier (FACTS 8: 1 %) is cleared by the next ping through it.
pub const STANDS_CERTAINTY: u8 = 5;
/// Speed beside something unmapped that is as near as the fence keeps, metres a second, and its growth with the gap, 1/s: what can be
/// stopped within the gap.
const BESIDE_M_S: f32 = 0.15;
const BESIDE_PER_S: f32 = 0.7;
/// Uncertainty of the velocity that costs no speed, metres a second, and over how much more it falls to the least share.
const KNOWN_M_S: f32 = 0.08;
const UNKNOWN_OVER_M_S: f32 = 0.25;
/// What is narrower on the plan than both of the histogram's configurations allow (doors) is flown along the planned line.
///
/// The strip looked at ahead is wider than the airframe by this on each side, metres; where there is room, and where
/// there is little.
const ROOMY_SWATH_M: f32 = 0.12;
const TIGHT_SWATH_M: f32 = 0.08;
/// How far the strip reaches, metres.
const SWATH_M: f32 = 1.6;
/// Deceleration counted on for stopping, metres a second squared: half of what FACTS 2 allows.
const BRAKE_M_S2: f32 = 0.8;
/// From an echo to the first braking, seconds: decision, link and the tilt's own time (FACTS 2: 0.35 beside the sweep).
const REACTION_S: f32 = 0.35;
/// Who comes nearer from within this of the way is met, radians (60 degrees).
const MEETS_RAD: f32 = core::f32::consts::FRAC_PI_3;
/// And comes on for so long until the drone stands, seconds: a sweep, the reaction and the braking from cruise speed.
const MEETS_S: f32 = 0.8;
/// Growth of the wished speed, metres a second squared: small tilts keep the attitude filter honest (FACTS 1).
const SPEED_UP_M_S2: f32 = 0.6;
/// Clearance of the plan at and above which the full speed is flown, metres.
const OPEN_M: f32 = 0.9;
/// Clearance at which the door speed is flown, metres.
const DOOR_M: f32 = 0.42;
/// Position uncertainty that costs no speed, metres, and over how much more it falls to the least share.
const SURE_M: f32 = 0.12;
const UNSURE_OVER_M: f32 = 0.25;
const LEAST_SHARE: f32 = 0.3;
/// Heading errors up to the first are flown through, from the second on the drone turns on the spot, radians.
const TURN_FREE_RAD: f32 = 25.0 * core::f32::consts::PI / 180.0;
const TURN_FIRST_RAD: f32 = 80.0 * core::f32::consts::PI / 180.0;
/// Nearer to the route than this the drone counts as on it, metres.
const ON_ROUTE_M: f32 = 0.25;
/// A route that gets narrower than the drone's place by this leads into a narrow place, metres.
const ENTERING_M: f32 = 0.12;
/// Free way kept before what is gone round, metres: cruise speed stops in 0.26 m.
const ROUND_GAP_M: f32 = 0.25;
/// Farther than this behind the narrowest place, metres, is behind the door and not in it.
const BEHIND_M: f32 = 0.5;
/// Between the posts of a door the line has less clearance than this, metres; 1.2 m are the widest.
const POSTS_M: f32 = 0.55;
/// Blocked or led astray for so long, seconds, the drone looks for a way past beside the route: who only comes by is gone.
const LANE_AFTER_S: f32 = 2.0;
/// Once blocked, the way must be free for this much more, metres.
const FREE_AGAIN_M: f32 = 0.2;
/// Less than this much way before the stop is not worth going, metres.
const WORTH_M: f32 = 0.05;
/// A valley with room leads away when it is farther than this from the way, and on again when nearer than that, radians.
const LEADS_AWAY_RAD: f32 = 60.0 * core::f32::consts::PI / 180.0;
const LEADS_ON_RAD: f32 = 30.0 * core::f32::consts::PI / 180.0;
/// Slowest approach to the end of the route, metres a second.
const CREEP_M_S: f32 = 0.1;

/// What steering needs to know about the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Craft {
    /// Propellers included, metres.
    pub radius_m: f32,
    /// Speed in free space, metres a second.
    pub cruise_m_s: f32,
}

/// What is around at one decision.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Now.
    pub now: u64,
    /// The drone, now.
    pub place: Place,
    /// Where the two layers lie.
    pub window: Window,
    /// What the sonars have seen.
    pub cells: &'a [u8],
    /// What the plan knows.
    pub walls: &'a [u8],
    /// Distance to what is not free on the plan.
    pub field: &'a DistanceField,
    /// The newest word of each sonar.
    pub senses: &'a Senses,
    /// Since the last decision, seconds.
    pub dt_s: f32,
}

/// A decision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steer {
    /// Wished velocity, plan frame, metres a second.
    pub velocity: (f32, f32),
    /// Wished heading, plan frame, radians.
    pub heading: f32,
    /// Why.
    pub reason: SteeringReason,
    /// Direction chosen, radians; NaN when stopped.
    pub direction: f32,
    /// Direction of the aim, radians; NaN without.
    pub target: f32,
    /// Free way ahead, metres.
    pub free_m: f32,
    /// How the method decided.
    pub decision: Decision,
}

/// Remembers what makes one decision follow from the last.
#[derive(Clone, Debug)]
pub struct Steering {
    /// With room on each side, and, where the method knows it, with as little as is allowed.
    roomy: Chosen,
    tight: Option<Vfh>,
    /// The last decision left as little.
    squeezing: bool,
    craft: Craft,
    heading: f32,
    speed: f32,
    blocked: bool,
    astray_s: f32,
}

impl Steering {
    /// For a vehicle, by a method.
    ///
    /// # Errors
    /// A vehicle that the method cannot be made for.
    pub fn new(craft: Craft, method: Method) -> Result<Self, ConfigError> {
        let (roomy, tight) = method::build(method, craft.radius_m)?;
        Ok(Self {
            roomy,
            tight,
            squeezing: false,
            craft,
            heading: f32::NAN,
            speed: 0.0,
            blocked: false,
            astray_s: 0.0,
        })
    }

    /// The vehicle.
    #[must_use]
    pub fn craft(&self) -> Craft {
        self.craft
    }

    /// Starts afresh: the next wished heading is the present one, the speed grows from nothing.
    pub fn forget(&mut self) {
        self.roomy.forget();
        if let Some(tight) = &mut self.tight {
            tight.forget();
        }
        self.squeezing = false;
        self.heading = f32::NAN;
        self.speed = 0.0;
        self.blocked = false;
        self.astray_s = 0.0;
    }

    /// Chooses velocity and heading towards the aim (`None`: stand). The histogram is filled in any case.
    pub fn step(
        &mut self,
        config: &NavigationConfig,
        scene: &Scene<'_>,
        aim: Option<Aim>,
        histogram: &mut Histogram<'_>,
    ) -> Steer {
        let place = &scene.place;
        if !self.heading.is_finite() {
            self.heading = place.heading;
        }
        let radius_m = self.craft.radius_m;
        let free = |direction: f32, margin_m: f32| {
            let from = (place.x, place.y);
            let half_width = radius_m + margin_m;
            free_length(scene.cells, &scene.window, from, direction, half_width, SWATH_M, STANDS_CERTAINTY)
        };
        let (target_rad, target_m) = aim.map_or((f32::NAN, f32::NAN), |aim| {
            ((aim.y - place.y).atan2(aim.x - place.x), place.distance((aim.x, aim.y)))
        });
        let mut margin_m = ROOMY_SWATH_M;
        let mut on_line = free(target_rad, margin_m);
        let mut situation = Situation {
            cells: scene.cells,
            walls: scene.walls,
            target_rad,
            // What stands on the way is gone round first: the walls behind it close no way past it.
            target_m: target_m.min(on_line),
            max_speed_m_s: self.craft.cruise_m_s,
        };
        let mut decision = self.roomy.decide(&situation, histogram);
        // A valley that leads away is left for a narrower one that leads on.
        let off = decision.direction_rad.map_or(f32::INFINITY, |d| wrap(d - target_rad).abs());
        let away = off > if self.squeezing { LEADS_ON_RAD } else { LEADS_AWAY_RAD };
        let tight = self.tight.as_mut().filter(|_| away);
        let squeezing = tight.is_some();
        if let Some(tight) = tight {
            if !self.squeezing {
                tight.forget();
            }
            margin_m = TIGHT_SWATH_M;
            on_line = free(target_rad, margin_m);
            situation.target_m = target_m.min(on_line);
            decision = tight.decide(&situation, histogram);
        }
        self.squeezing = squeezing;
        let mut steer = Steer {
            velocity: (0.0, 0.0),
            heading: wrap(self.heading + scan(config, scene.now)),
            reason: SteeringReason::Holding,
            direction: f32::NAN,
            target: target_rad,
            free_m: SWATH_M,
            decision,
        };
        let Some(aim) = aim else {
            self.speed = 0.0;
            (steer.velocity, _) = Fence::around(scene, self.craft.radius_m).keep((0.0, 0.0), None);
            return steer;
        };
        let reserve = self.craft.radius_m + config.stop_gap_m;
        let wanted = if self.blocked { FREE_AGAIN_M } else { WORTH_M };
        // Between mapped walls the planned line is known to 3 cm, and the valley is only a few sectors wide:
        // the line is flown while nothing stands on it.
        let narrow = aim.route_m < config.narrow_m && aim.aside_m < ON_ROUTE_M;
        // What stands behind a door is gone round from behind the door.
        let behind = aim.gate_m.is_some_and(|gate| on_line > gate + BEHIND_M);
        let near = self.craft.radius_m + ROUND_GAP_M.min(config.stop_gap_m);
        let reserve = if narrow && behind { near } else { reserve };
        let (direction, speed, reason, free_m) = match decision.direction_rad {
            _ if narrow && on_line - reserve > wanted => {
                (target_rad, self.craft.cruise_m_s, SteeringReason::TargetSafe, on_line)
            }
            // A valley beside what stands in a door leads nowhere.
            _ if narrow && aim.gate_m.is_some() && !behind => {
                (target_rad, 0.0, SteeringReason::Blocked, on_line)
            }
            Some(direction) => {
                (direction, decision.speed_m_s, reason_of(decision.reason), free(direction, margin_m))
            }
            None => (target_rad, 0.0, SteeringReason::Blocked, on_line),
        };
        steer.free_m = free_m;
        // What is gone round has a side to pass on: it may be nearer than what is waited for.
        let round = matches!(
            reason,
            SteeringReason::NarrowValley | SteeringReason::WideValley | SteeringReason::Deflected
        );
        let reserve = if round { near } else { reserve };
        let gap = free_m - reserve;
        self.blocked = gap <= wanted || reason == SteeringReason::Blocked;
        steer.reason = if self.blocked { SteeringReason::Blocked } else { reason };
        if !self.blocked {
            steer.direction = direction;
        }
        let (dx, dy) = (aim.onward.0 - aim.foot.0, aim.onward.1 - aim.foot.1);
        let onward = if dx.hypot(dy) > WORTH_M { dy.atan2(dx) } else { f32::NAN };
        let astray = self.blocked || wrap(direction - target_rad).abs() > LEADS_AWAY_RAD;
        let dt_s = scene.dt_s.clamp(0.0, 0.2);
        self.astray_s = (self.astray_s + if astray { dt_s } else { -dt_s }).clamp(0.0, LANE_AFTER_S + 1.0);
        let past = if astray && self.astray_s > LANE_AFTER_S && !(narrow && aim.gate_m.is_some()) {
            lane::past(scene, radius_m, onward)
        } else {
            None
        };

        self.turn(config, scene.dt_s, if past.is_some() { onward } else { direction });
        steer.heading = wrap(self.heading + scan(config, scene.now));
        let mut speed = if self.blocked { 0.0 } else { speed };
        speed = speed.min(stoppable_within(gap));
        // Who walks this way is nearer when the drone has stopped.
        let met = scene
            .senses
            .approaching(scene.now)
            .filter(|a| wrap(place.heading + a.bearing - direction).abs() < MEETS_RAD);
        for approach in met {
            speed = speed.min(stoppable_within(approach.distance - reserve - MEETS_S * approach.speed));
        }
        speed = speed.min(self.speed_for(config, aim.clearance_m));
        speed = speed.min((0.7 * aim.remaining_m).max(CREEP_M_S));
        let unsure = ((place.sigma - SURE_M) / UNSURE_OVER_M).clamp(0.0, 1.0 - LEAST_SHARE);
        speed *= 1.0 - unsure;
        let swaying = ((place.velocity_sigma - KNOWN_M_S) / UNKNOWN_OVER_M_S).clamp(0.0, 1.0 - LEAST_SHARE);
        speed *= 1.0 - swaying;
        let fence = Fence::around(scene, self.craft.radius_m);
        speed = speed
            .min(BESIDE_M_S + BESIDE_PER_S * (fence.unmapped_towards_m(direction) - fence::KEEP_M).max(0.0));
        let off = wrap(direction - place.heading).abs();
        speed *= 1.0 - ((off - TURN_FREE_RAD) / (TURN_FIRST_RAD - TURN_FREE_RAD)).clamp(0.0, 1.0);
        speed = speed.min(self.speed + SPEED_UP_M_S2 * scene.dt_s.clamp(0.0, 0.2));
        self.speed = speed;
        let mut wish = (speed * direction.cos(), speed * direction.sin());
        // Beside something unmapped the line does not pull back, but for between the posts of a door: whoever drew it did not
        // know of the thing.
        let alone = fence.unmapped_m().is_infinite();
        let held = narrow && (alone || aim.route_m < POSTS_M);
        let entering = scene.field.distance(place.x, place.y) > aim.route_m + ENTERING_M;
        if !self.blocked
            && (held || (aim.aside_m < ON_ROUTE_M && steer.reason == SteeringReason::TargetSafe && alone))
        {
            wish = along(&aim, place, speed, entering, wish);
        }
        if let Some(past) = past {
            (wish, steer.direction, steer.reason) = (past, onward, SteeringReason::NarrowValley);
            self.speed = past.0.hypot(past.1);
        }
        let (velocity, backing) = fence.keep(wish, Some(target_rad));
        steer.velocity = velocity;
        if backing {
            steer.reason = SteeringReason::BackingOff;
        }
        steer
    }

    /// Turns the wished heading towards `direction`, no faster than allowed.
    fn turn(&mut self, config: &NavigationConfig, dt_s: f32, direction: f32) {
        let most = config.turn_rad_s * dt_s.clamp(0.0, 0.2);
        let error = wrap(direction - self.heading);
        if error.is_finite() {
            self.heading = wrap(self.heading + error.clamp(-most, most));
        }
    }

    /// Speed for a clearance of the plan: the door speed in doors, the cruise in the open.
    fn speed_for(&self, config: &NavigationConfig, clearance: f32) -> f32 {
        let door = config.door_m_s.min(self.craft.cruise_m_s);
        let share = ((clearance - DOOR_M) / (OPEN_M - DOOR_M)).clamp(0.0, 1.0);
        door + share * (self.craft.cruise_m_s - door)
    }
}

/// Speed from which the drone stops within a gap, metres a second: d = v t + v²/2a (FACTS 2).
fn stoppable_within(gap: f32) -> f32 {
    let away = BRAKE_M_S2 * REACTION_S;
    (away * away + 2.0 * BRAKE_M_S2 * gap.max(0.0)).sqrt() - away
}

/// How far the heading is swept aside now, radians.
fn scan(config: &NavigationConfig, now: u64) -> f32 {
    let period_ns = (f64::from(config.scan_s) * 1e9) as u64;
    let phase = (now % period_ns.max(1)) as f32 / period_ns.max(1) as f32;
    config.scan_deg.to_radians() * (phase * core::f32::consts::TAU).sin()
}

fn reason_of(reason: Reason) -> SteeringReason {
    match reason {
        Reason::Holding => SteeringReason::Holding,
        Reason::TargetSafe => SteeringReason::TargetSafe,
        Reason::NarrowValley => SteeringReason::NarrowValley,
        Reason::WideValley => SteeringReason::WideValley,
        Reason::Deflected => SteeringReason::Deflected,
        Reason::Blocked => SteeringReason::Blocked,
    }
}
