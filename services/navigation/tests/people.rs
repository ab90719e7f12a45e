//! Rounds with somebody in the way who wants to pass too.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::flight::{Flight, room};
use ipc_types::{PatrolState, RoomState, Verb};

/// Walks to and fro along a line, and stands for as long as a drone is near in front: the simulator's people lose
/// patience after a while, this one never does.
struct Walker {
    x: f32,
    y: f32,
    ends: (f32, f32),
    /// Metres a second, signed.
    speed: f32,
    /// How often an end was reached.
    arrivals: u32,
}

impl Walker {
    fn step(&mut self, dt_s: f32, drone: (f32, f32)) {
        let (dx, dy) = (drone.0 - self.x, drone.1 - self.y);
        let away = dx.hypot(dy);
        if away < 0.8 && dx * self.speed.signum() > 0.26 * away {
            return;
        }
        self.x = (self.x + self.speed * dt_s).clamp(self.ends.0, self.ends.1);
        if self.x == self.ends.0 || self.x == self.ends.1 {
            self.speed = -self.speed;
            self.arrivals += 1;
        }
    }
}

#[test]
fn the_drone_steps_aside_for_somebody_in_the_only_door() {
    // Only the South door is open. Somebody walks through it to and fro, twenty seconds each way.
    let mut flight = Flight::new(&[1, 2], &[]);
    let mut walker = Walker { x: 7.5, y: 1.45, ends: (1.8, 7.5), speed: -0.6, arrivals: 0 };
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    let (mut seconds, mut aside_s, mut met_s) = (0.0, 0.0, 0.0);
    // Without stepping aside it is still on its way home then.
    while seconds < 400.0 && !matches!(flight.core.mission().state(), PatrolState::Done | PatrolState::Failed)
    {
        walker.step(0.05, (flight.drone.x, flight.drone.y));
        flight.world.people = vec![(walker.x, walker.y)];
        flight.step();
        seconds += 0.05;
        aside_s += if flight.core.text().contains("letting somebody pass") { 0.05 } else { 0.0 };
        let away = (walker.x - flight.drone.x).hypot(walker.y - flight.drone.y);
        met_s += if away < 1.0 { 0.05 } else { 0.0 };
    }
    let patrol = flight.report();
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    assert!(flight.least_gap > 0.08, "{}", flight.least_gap);
    assert!(met_s > 1.0, "they met");
    assert!(aside_s > 1.0 && walker.arrivals >= 4, "{aside_s} {}", walker.arrivals);
    assert_eq!(room(&patrol, "South").state, u32::from(RoomState::Seen.code()));
}
