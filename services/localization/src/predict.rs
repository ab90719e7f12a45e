//! From the time of the last ping to now: a pose is wanted for the present.

use crate::attitude::{Attitudes, seconds};
use crate::flow::Frame;
use mcl::Estimate;

/// Steps of the integration, seconds.
const STEP_S: f64 = 0.01;
/// A prediction goes no farther than this, seconds: then the velocity is held at rest.
const LONGEST_S: f64 = 0.6;
/// m/s².
const GRAVITY: f32 = 9.806_65;

/// What the motion is believed to do between updates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dynamics {
    /// Air drag over mass, 1/s.
    pub(crate) drag: f32,
    /// Random walk of the velocity, m/s per √s.
    pub(crate) velocity_noise: f32,
}

/// Where it is now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Predicted {
    pub(crate) position: [f32; 2],
    pub(crate) velocity: [f32; 2],
    pub(crate) heading: f32,
    /// Standard deviation of the velocity.
    pub(crate) velocity_sigma: f32,
    /// Acceleration by what the tilt does not explain, m/s²; NaN when nothing is known of it.
    pub(crate) air: [f32; 2],
    /// What the prediction adds to each position variance, m².
    pub(crate) variance: f32,
}

/// Carries the estimate, which is for `from_ns`, on to `to_ns` by tilt, drag and the flow frames that
/// no update has used yet, each taken in as a Kalman measurement when its time is passed.
pub(crate) fn predict(
    e: &Estimate,
    dynamics: Dynamics,
    from_ns: u64,
    to_ns: u64,
    attitudes: &Attitudes,
    flows: &[Frame],
) -> Predicted {
    let mut position = [e.x, e.y];
    let mut velocity = [e.velocity_x, e.velocity_y];
    let mut variance = e.velocity_sigma * e.velocity_sigma;
    let horizon = seconds(from_ns, to_ns).clamp(0.0, LONGEST_S);
    let steps = (horizon / STEP_S).ceil().max(1.0);
    let h = horizon / steps;
    let mut used = 0;
    for step in 0..steps as u32 {
        let time = from_ns + ((f64::from(step) + 0.5) * h * 1e9) as u64;
        let tilt = attitudes.at(time).unwrap_or_default();
        let (sin, cos) = (tilt.yaw + e.heading_offset).sin_cos();
        while let Some(frame) = flows.get(used).filter(|f| f.time_ns <= time) {
            let gain = variance / (variance + frame.sigma * frame.sigma).max(1e-9);
            let [x, y] = frame.velocity;
            velocity[0] += gain * (cos * x - sin * y - velocity[0]);
            velocity[1] += gain * (sin * x + cos * y - velocity[1]);
            variance *= 1.0 - gain;
            used += 1;
        }
        let forward = GRAVITY * tan(tilt.pitch - e.level_pitch);
        let left = -GRAVITY * tan(tilt.roll - e.level_roll);
        let h = h as f32;
        let before = velocity;
        velocity[0] += (cos * forward - sin * left - dynamics.drag * velocity[0]) * h;
        velocity[1] += (sin * forward + cos * left - dynamics.drag * velocity[1]) * h;
        position[0] += 0.5 * (before[0] + velocity[0]) * h;
        position[1] += 0.5 * (before[1] + velocity[1]) * h;
        variance += dynamics.velocity_noise * dynamics.velocity_noise * h;
    }
    let yaw = attitudes.at(to_ns).unwrap_or_default().yaw;
    Predicted {
        position,
        velocity,
        heading: mcl::wrap_angle(yaw + e.heading_offset),
        velocity_sigma: variance.sqrt(),
        air: [f32::NAN; 2],
        variance: variance * (horizon * horizon) as f32,
    }
}

/// A tumbling aircraft gets no infinite acceleration.
fn tan(angle: f32) -> f32 {
    angle.clamp(-0.6, 0.6).tan()
}

#[cfg(test)]
mod tests {
    use super::{Dynamics, predict};
    use crate::Attitudes;
    use crate::flow::Frame;
    use mcl::{Estimate, State};

    const MS: u64 = 1_000_000;
    const STILL: Dynamics = Dynamics { drag: 0.0, velocity_noise: 0.35 };

    fn estimate() -> Estimate {
        Estimate {
            x: 1.0,
            y: 2.0,
            velocity_x: 0.4,
            velocity_y: 0.0,
            heading_offset: 0.5,
            level_roll: 0.0,
            level_pitch: 0.02,
            variance_x: 0.01,
            covariance_xy: 0.0,
            variance_y: 0.01,
            heading_sigma: 0.05,
            velocity_sigma: 0.1,
            effective: 500.0,
            share: 1.0,
            p_lost: 0.0,
            state: State::Tracking,
        }
    }

    fn nose_down() -> Attitudes {
        let mut a = Attitudes::default();
        for i in 0..20 {
            // Heading in the plan is yaw + offset = 0: forward is +x.
            a.push((1000 + i * 30) * MS, 0.0, 0.12, -0.5);
        }
        a
    }

    #[test]
    fn it_flies_on_with_the_tilt_less_the_level_error() {
        let p = predict(&estimate(), STILL, 1200 * MS, 1300 * MS, &nose_down(), &[]);
        let a = 9.806_65 * 0.1f32.tan();
        assert!((p.velocity[0] - (0.4 + a * 0.1)).abs() < 1e-3, "{p:?}");
        assert!((p.position[0] - (1.0 + 0.04 + 0.5 * a * 0.01)).abs() < 1e-3, "{p:?}");
        assert!(p.velocity[1].abs() < 1e-3 && p.heading.abs() < 1e-3, "{p:?}");
        assert!(p.velocity_sigma > 0.1 && p.variance > 0.0);
    }

    #[test]
    fn fresh_flow_corrects_the_velocity() {
        let frame = Frame { time_ns: 1250 * MS, velocity: [0.0, 0.0], sigma: 0.08 };
        let p = predict(&estimate(), STILL, 1200 * MS, 1300 * MS, &nose_down(), &[frame]);
        let without = predict(&estimate(), STILL, 1200 * MS, 1300 * MS, &nose_down(), &[]);
        assert!(p.velocity[0] < without.velocity[0] - 0.2, "{p:?}");
        assert!(p.velocity_sigma < without.velocity_sigma);
    }

    #[test]
    fn an_old_estimate_is_not_carried_on_for_ever() {
        let p = predict(&estimate(), STILL, 1200 * MS, 90_000 * MS, &nose_down(), &[]);
        assert!(p.position.iter().all(|x| x.abs() < 5.0), "{p:?}");
    }
}
