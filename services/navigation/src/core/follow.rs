//! Following the route: what a blocked way, somebody to let pass and the route's end do to it.

use super::{Core, STANDING_M_S};
use crate::blockage::Verdict;
use crate::mission::Goal;
use crate::place::Place;
use crate::steer::Steer;
use avoid::Window;
use ipc_types::{Grid, Setpoint, SetpointKind, SteeringReason};

/// The route ends this near to its last point, metres: the hold of the hover does the rest.
const ARRIVED_M: f32 = 0.3;
/// A route that ends this near to the pad leads home, metres.
const HOME_M: f32 = 0.6;

impl Core {
    /// Turns what steering wishes into a setpoint, and looks after blocked ways and the end of the route.
    pub(super) fn follow(
        &mut self,
        dt_s: f32,
        place: &Place,
        grid: &Grid,
        window: Window,
        steer: &Steer,
        mut setpoint: Setpoint,
    ) -> Setpoint {
        let blocked = steer.reason == SteeringReason::Blocked;
        let along = self.journey.track().along();
        let config = &self.config;
        let now = self.last_ns.unwrap_or_default();
        self.courtesy.look(now, &self.senses, place, steer.target);
        match self.blockage.watch(dt_s, blocked, along, config.wait_s, config.stuck_s) {
            Verdict::Wait
                if !self.journey.stepping_aside
                    && self.courtesy.due(now, place, self.blockage.waited_s(), self.journey.contested()) =>
            {
                self.journey.plan_aside(steer.target);
                self.plan_anew(place);
                return setpoint;
            }
            Verdict::Go | Verdict::Wait => {}
            Verdict::Blocked | Verdict::Stuck if self.journey.stepping_aside => {
                self.journey.plan();
                self.plan_anew(place);
                return setpoint;
            }
            Verdict::Blocked | Verdict::Stuck => {
                self.journey.obstruct(place, steer.target, &grid.cells, &window);
                self.journey.plan();
                self.plan_anew(place);
                return setpoint;
            }
        }
        if self.mission.goal() == Goal::Round && self.journey.look_again() {
            self.plan_anew(place);
            return setpoint;
        }
        if self.journey.homeward() {
            self.mission.homeward();
        }
        let end = self.journey.track().end().filter(|end| place.distance(*end) < ARRIVED_M + 0.1);
        if let Some(end) = end
            && self.journey.complete()
            && self.journey.track().remaining() < ARRIVED_M
        {
            if self.journey.stepping_aside {
                self.courtesy.stay(now);
                self.journey.drop_route();
                self.plan_anew(place);
                return setpoint;
            }
            let pad = self.mission.pad().unwrap_or(end);
            let home = (pad.0 - end.0).hypot(pad.1 - end.1) < HOME_M;
            if home || matches!(self.mission.goal(), Goal::There(_)) {
                self.mission.arrived(end);
                self.journey.drop_route();
            } else {
                // There was no way home from afar: asked again from here, for what stood in the way may have moved on.
                if !(self.mission.goal() == Goal::Round && self.journey.forgive()) {
                    self.mission.homeward();
                }
                self.mission.replanning(place);
                self.journey.plan();
            }
            self.steering.forget();
            return setpoint;
        }
        setpoint.heading_rad = steer.heading;
        let (vx, vy) = steer.velocity;
        if vx.hypot(vy) < STANDING_M_S {
            let stand = *self.stand.get_or_insert((place.x, place.y));
            let (x, y) = self.firm.wait_at(now, place).unwrap_or(stand);
            (setpoint.hold_x_m, setpoint.hold_y_m) = (x, y);
        } else {
            self.stand = None;
            setpoint.kind = u32::from(SetpointKind::Velocity.code());
            (setpoint.velocity_x_m_s, setpoint.velocity_y_m_s) = (vx, vy);
            (setpoint.hold_x_m, setpoint.hold_y_m) = (f32::NAN, f32::NAN);
        }
        setpoint
    }

    /// Another route is asked for: the drone stands until it is there.
    fn plan_anew(&mut self, place: &Place) {
        self.mission.replanning(place);
        self.blockage.reset();
        self.steering.forget();
    }
}
