//! Velocity from optical flow.

use super::{Frames, SHARE_AT, SHARE_LEAST, SPEED, STATES, Velocity, Y};
use crate::attitude::Attitudes;
use crate::flow::Frame;

/// How fast the weight of a surprising measurement falls, like Student's t: flow errs when the body turns fast.
const FLOW_TAIL: f32 = 0.1;
impl Velocity {
    /// Takes a flow frame.
    pub(crate) fn flow(&mut self, frame: &Frame, attitudes: &Attitudes, frames: &Frames) {
        if !self.is_known(frame.time_ns) {
            return;
        }
        self.advance(frame.time_ns, attitudes, frames);
        self.flows = true;
        let [x, y] = in_plan(frame, attitudes, frames);
        // A frame from before the state's time is a little old; the gust since then is not worth a replay.
        let [vx, vy] = self.velocity_now();
        let miss = [x - vx, y - vy];
        let [of_x, of_y] = self.velocity_variance();
        let spread = frame.sigma * frame.sigma + of_x.max(of_y);
        let sigma = frame.sigma * (1.0 + FLOW_TAIL * (miss[0] * miss[0] + miss[1] * miss[1]) / spread).sqrt();
        self.forget_share();
        self.measure([1.0, 0.0], miss[0], sigma);
        self.measure([0.0, 1.0], miss[1], sigma);
    }

    /// Takes a flow frame from over a poor floor: it shows an unknown share of the velocity. While the velocity
    /// is well known the share is learned from it, afterwards the velocity is from the share.
    pub(crate) fn dim(&mut self, frame: &Frame, attitudes: &Attitudes, frames: &Frames) {
        if !self.is_known(frame.time_ns) {
            return;
        }
        self.advance(frame.time_ns, attitudes, frames);
        self.flows = true;
        for (axis, shown) in in_plan(frame, attitudes, frames).into_iter().enumerate() {
            let (velocity, share) = (self.filter.state[SPEED + Y * axis], self.filter.state[SHARE_AT]);
            let mut along = [0.0; STATES];
            (along[SPEED + Y * axis], along[SHARE_AT]) = (share, velocity);
            self.take(&along, shown - (share * velocity) as f32, frame.sigma);
            let share = &mut self.filter.state[SHARE_AT];
            *share = share.clamp(f64::from(SHARE_LEAST), 1.0);
        }
    }
}

/// The velocity of a frame, which is in the body's, in the plan's.
fn in_plan(frame: &Frame, attitudes: &Attitudes, frames: &Frames) -> [f32; 2] {
    let yaw = attitudes.at(frame.time_ns).unwrap_or_default().yaw + frames.heading_offset;
    let (sin, cos) = yaw.sin_cos();
    let [x, y] = frame.velocity;
    [cos * x - sin * y, sin * x + cos * y]
}
