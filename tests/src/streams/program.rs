//! What is asked for in a stream.

use control::{Vector, wrap_angle};
use core::f32::consts::{PI, TAU};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use serde::Serialize;

/// What kind of commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Any direction and speed, changed every 0.3 to 3 seconds.
    Wander,
    /// One direction and speed.
    Straight,
    /// Straight at the nearest echo.
    AtTheNearest,
    /// Straight at the nearest wall of the plan.
    AtTheWall,
    /// Half way between two neighbouring sonars, whatever the heading.
    IntoTheGap,
    /// To and fro, two to five times a second.
    ToAndFro,
    /// One direction while it turns.
    Turning,
    /// Velocities of kilometres a second, no numbers, heights from the cellar to the roof.
    Nonsense,
}

const KINDS: [Kind; 8] = [
    Kind::Wander,
    Kind::Straight,
    Kind::AtTheNearest,
    Kind::AtTheWall,
    Kind::IntoTheGap,
    Kind::ToAndFro,
    Kind::Turning,
    Kind::Nonsense,
];

/// What a program may look at.
#[derive(Clone, Copy, Debug, Default)]
pub struct Around {
    /// Heading of the drone, plan frame.
    pub heading: f32,
    /// Direction of the nearest echo, plan frame.
    pub echo: Option<f32>,
    /// Direction of the nearest wall of the plan, plan frame.
    pub wall: Option<f32>,
    /// Directions half way between two neighbouring sonars, body frame.
    pub gaps: [f32; 8],
}

/// One command.
#[derive(Clone, Copy, Debug)]
pub struct Wish {
    /// Plan frame, m/s.
    pub velocity: Vector,
    /// Plan frame; NaN keeps the present one.
    pub heading: f32,
    /// Above the floor, metres.
    pub height_m: f32,
}

/// Ten seconds of commands.
#[derive(Clone, Debug)]
pub struct Program {
    /// What kind.
    pub kind: Kind,
    random: Xoshiro256PlusPlus,
    cruise_m_s: f32,
    height_m: f32,
    change_s: f64,
    direction: f32,
    speed_m_s: f32,
    turn_rad_s: f32,
    began_at: Option<f32>,
    gap: usize,
}

impl Program {
    /// Drawn from a seed, for a vehicle that flies so fast and so high.
    #[must_use]
    pub fn draw(seed: u64, cruise_m_s: f32, height_m: f32) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let kind = KINDS[random.random_range(0..KINDS.len())];
        let mut program = Self {
            kind,
            cruise_m_s,
            height_m,
            change_s: 0.0,
            direction: 0.0,
            speed_m_s: 0.0,
            turn_rad_s: random.random_range(-1.0..1.0),
            began_at: None,
            gap: random.random_range(0..8),
            random,
        };
        program.turn();
        // Now and then at another height, where other things stand.
        if program.random.random_bool(0.25) {
            program.height_m += program.random.random_range(-0.3..0.3);
        }
        program
    }

    fn turn(&mut self) {
        self.direction = self.random.random_range(-PI..PI);
        self.speed_m_s = self.cruise_m_s * self.random.random_range(0.2..1.5);
    }

    /// The command `at_s` seconds after the beginning.
    pub fn ask(&mut self, at_s: f64, around: &Around) -> Wish {
        let fast = 1.5 * self.cruise_m_s;
        let mut wish = Wish { velocity: Vector::ZERO, heading: f32::NAN, height_m: self.height_m };
        let due = at_s >= self.change_s;
        match self.kind {
            Kind::Wander => {
                if due {
                    self.turn();
                    self.change_s = at_s + self.random.random_range(0.3..3.0);
                }
                wish.velocity = Vector::along(self.direction) * self.speed_m_s;
                wish.heading = self.direction;
            }
            Kind::Straight => wish.velocity = Vector::along(self.direction) * self.speed_m_s,
            Kind::AtTheNearest => {
                wish.velocity = Vector::along(around.echo.unwrap_or(self.direction)) * self.speed_m_s;
            }
            Kind::AtTheWall => {
                wish.velocity = Vector::along(around.wall.unwrap_or(self.direction)) * self.speed_m_s;
            }
            Kind::IntoTheGap => {
                wish.velocity = Vector::along(around.heading + around.gaps[self.gap]) * self.speed_m_s;
            }
            Kind::ToAndFro => {
                if due {
                    self.direction = wrap_angle(self.direction + PI);
                    self.change_s = at_s + self.random.random_range(0.2..0.5);
                }
                wish.velocity = Vector::along(self.direction) * fast;
            }
            Kind::Turning => {
                let began = *self.began_at.get_or_insert(around.heading);
                wish.velocity = Vector::along(self.direction) * self.speed_m_s;
                wish.heading = wrap_angle(began + self.turn_rad_s * at_s as f32);
            }
            Kind::Nonsense => {
                let wild = [0.0, 1e-9, -3.0, 1e30, f32::NAN, f32::INFINITY, 0.5, -0.5];
                let mut pick = || wild[self.random.random_range(0..wild.len())];
                wish.velocity = Vector::new(pick(), pick());
                wish.heading = pick() * TAU;
                wish.height_m = pick();
            }
        }
        wish
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn all_kinds_are_drawn_and_each_asks_for_what_it_says() {
        let around = Around { heading: 0.5, echo: Some(1.0), wall: Some(-1.0), gaps: [0.3; 8] };
        let mut kinds = BTreeSet::new();
        for seed in 0..200 {
            let mut program = Program::draw(seed, 0.5, 1.0);
            kinds.insert(format!("{:?}", program.kind));
            let wishes: Vec<Wish> = (0..200).map(|k| program.ask(f64::from(k) * 0.05, &around)).collect();
            let along = |direction: f32| {
                wishes.iter().all(|w| wrap_angle(w.velocity.angle() - direction).abs() < 1e-3)
            };
            let kept = match program.kind {
                Kind::AtTheNearest => along(1.0),
                Kind::AtTheWall => along(-1.0),
                Kind::IntoTheGap => along(0.8),
                Kind::Straight => along(wishes[0].velocity.angle()),
                Kind::Turning => wishes.windows(2).any(|w| w[0].heading != w[1].heading),
                Kind::ToAndFro => wishes.windows(2).any(|w| w[0].velocity.dot(w[1].velocity) < 0.0),
                Kind::Wander => !along(wishes[0].velocity.angle()),
                Kind::Nonsense => wishes.iter().any(|w| !w.velocity.is_finite()),
            };
            assert!(kept, "seed {seed}: {:?}", program.kind);
        }
        assert_eq!(kinds.len(), KINDS.len());
    }
}
