//! While the place on the plan is not known, and when it turns out to be another.

use super::Core;
use crate::mission::Goal;
use crate::place::Place;
use crate::words::blank_setpoint;
use avoid::Window;
use ipc_types::{Grid, Setpoint, SetpointKind, Text};

impl Core {
    /// What was noted in the plan's frame lies elsewhere now: the grid begins anew, and so does the way.
    pub(super) fn jump(&mut self, place: &Place) {
        self.frame_ns = place.stamp_ns;
        self.beams.clear();
        self.explore.forget();
        self.steering.forget();
        self.blockage.reset();
        self.courtesy.forget();
        self.stand = None;
        self.firm.forget();
        self.mission.replanning(place);
        if self.mission.goal() != Goal::None {
            self.journey.plan();
        }
    }

    /// A setpoint while nobody knows where on the plan the drone is.
    pub(super) fn search(&mut self, now: u64, dt_s: f32, place: &Place, grid: Option<&Grid>) -> Setpoint {
        let mut setpoint = blank_setpoint(now, &self.config);
        let window = grid.and_then(|grid| Window::from_origin(grid.origin_x_m, grid.origin_y_m));
        if let (Some(grid), Some(window), true) = (grid, window, self.mission.heeded()) {
            let radius = self.steering.craft().radius_m;
            let wish = self.explore.step(now, dt_s, place, &grid.cells, &window, radius);
            setpoint.kind = u32::from(SetpointKind::Velocity.code());
            (setpoint.velocity_x_m_s, setpoint.velocity_y_m_s) = wish.velocity;
            setpoint.heading_rad = wish.heading;
        }
        self.text = Text::new("looking for the drone's place on the plan");
        setpoint
    }
}
