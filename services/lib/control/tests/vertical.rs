//! The height loop against a small plant: thrust with a lag, a delayed link and a bad down sonar.
#![allow(clippy::unwrap_used, reason = "tests")]

use control::{
    ClimbConfig, ClimbController, HeightConfig, HeightEcho, HeightEstimator, Liftoff, LiftoffConfig, SpoolUp,
    TouchDown, TouchDownConfig, VerticalWish,
};
use std::collections::VecDeque;

/// Uniform noise from a seed.
struct Noise(u64);
impl Noise {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
    /// About normal.
    fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.unit()).sum::<f32>() - 6.0
    }
}

struct Plant {
    height: f32,
    climb: f32,
    load: f32,
    hover_us: f32,
    /// Exponent of the thrust law: 2 as modelled, 1 for a controller that linearises thrust.
    exponent: f32,
    /// Share of the thrust that is left: of four cells three make 0.56.
    thrust: f32,
    /// What the accelerometer tells behind its low-pass of 10 Hz, less gravity.
    felt: f32,
    link: VecDeque<f32>,
    surface: f32,
    touched_at: f32,
}

impl Plant {
    fn new(hover_us: f32) -> Self {
        Self {
            height: 0.0,
            climb: 0.0,
            load: 0.0,
            hover_us,
            exponent: 2.0,
            thrust: 1.0,
            felt: 0.0,
            link: VecDeque::from(vec![1000.0; 30]),
            surface: 0.0,
            touched_at: 0.0,
        }
    }
    /// One millisecond; the link takes 30.
    fn step(&mut self, throttle_us: f32, push: f32) {
        self.link.push_back(throttle_us);
        let us = self.link.pop_front().unwrap();
        let wanted = ((us - 1000.0) / (self.hover_us - 1000.0)).max(0.0).powf(self.exponent);
        self.load += (wanted * self.thrust - self.load) * 0.001 / 0.06;
        let lifted = 9.81 * (self.load - 1.0) + push - 0.1 * self.climb;
        self.felt += (lifted - self.felt) * 0.001 / 0.016;
        self.climb += lifted * 0.001;
        self.height += self.climb * 0.001;
        if self.height <= self.surface {
            if self.climb < -0.05 {
                self.touched_at = self.touched_at.min(self.climb);
            }
            self.height = self.surface;
            self.climb = self.climb.max(0.0);
        }
    }
}

const REST: f32 = 0.06;

/// One flight at 50 Hz with a down sonar at 16.7 Hz whose readings arrive 65 ms after the ping.
struct Flight {
    plant: Plant,
    estimate: HeightEstimator,
    climb: ClimbController,
    noise: Noise,
    now_ns: u64,
    echoes: VecDeque<(u64, f32)>,
    lost: f32,
    spikes: f32,
    lie: f32,
    tilt: f32,
    push: f32,
    /// The controller tells its accelerometer, 30 times a second.
    feels: bool,
    learn: bool,
    steps: u64,
}

impl Flight {
    fn new(hover_us: f32, guess_us: f32, seed: u64) -> Self {
        Self {
            plant: Plant::new(hover_us),
            estimate: HeightEstimator::new(HeightConfig::default(), REST),
            climb: ClimbController::new(ClimbConfig::default(), guess_us),
            noise: Noise(seed),
            now_ns: 1_000_000_000,
            echoes: VecDeque::new(),
            lost: 0.05,
            spikes: 0.01,
            lie: 0.0,
            tilt: 0.0,
            push: 0.0,
            feels: false,
            learn: true,
            steps: 0,
        }
    }

    fn hovering(hover_us: f32, height: f32, seed: u64) -> Self {
        let mut flight = Self::new(hover_us, hover_us, seed);
        flight.plant.height = height;
        flight.plant.load = 1.0;
        flight.plant.link = VecDeque::from(vec![hover_us; 30]);
        flight.estimate.set(flight.now_ns, height, 0.0, 0.0);
        flight.climb.set_throttle(hover_us);
        flight
    }

    /// The readings due now.
    fn sense(&mut self) -> Option<(u64, f32)> {
        if self.steps.is_multiple_of(3) {
            let true_range = self.plant.height - self.plant.surface + REST + self.lie;
            let dice = self.noise.unit();
            if dice > self.lost {
                let mut range = true_range + 0.006 * self.noise.normal();
                if self.noise.unit() < self.spikes {
                    range = 0.1 + 3.0 * self.noise.unit();
                }
                self.echoes.push_back((self.now_ns, range.max(0.02)));
            }
        }
        let due = self.echoes.front().is_some_and(|(at, _)| self.now_ns >= at + 65_000_000);
        if due { self.echoes.pop_front() } else { None }
    }

    fn fly(&mut self, throttle: f32) {
        for _ in 0..20 {
            // Tilt takes vertical thrust away.
            let weight = 9.81 * self.plant.load * (self.tilt.cos() - 1.0);
            self.plant.step(throttle, self.push + weight);
        }
        self.now_ns += 20_000_000;
        self.steps += 1;
    }

    fn step(&mut self, wish: VerticalWish) -> Option<HeightEcho> {
        let heard = self.sense().map(|(at, range)| self.estimate.measure(at, range, self.tilt));
        let model = self.climb.expected_acceleration(0.02, self.tilt, self.estimate.climb_m_s());
        if self.feels && self.steps % 5 < 3 {
            self.estimate.feel(self.now_ns, self.plant.felt - model);
        }
        self.estimate.predict(self.now_ns, model);
        let us = self.climb.step(0.02, wish, &mut self.estimate, self.tilt, self.learn);
        self.fly(us);
        heard
    }

    /// Flies for a time; worst distance of the true height from the wanted one.
    fn hold(&mut self, height: f32, seconds: f32) -> f32 {
        let mut worst = 0.0f32;
        for _ in 0..(seconds * 50.0) as usize {
            self.step(VerticalWish::Height(height));
            worst = worst.max((self.plant.height - height).abs());
        }
        worst
    }
}

#[test]
fn holds_its_height_under_noise_gusts_and_sag() {
    for seed in 0..8 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        let mut squares = 0.0;
        let mut worst = 0.0f32;
        let mut push = 0.0f32;
        for k in 0..3000 {
            push += -push * 0.02 / 1.5 + 0.2 * (2.0f32 * 0.02 / 1.5).sqrt() * flight.noise.normal();
            flight.push = push;
            // A battery that needs 60 us more in a minute.
            flight.plant.hover_us = 1450.0 + k as f32 * 0.02;
            flight.step(VerticalWish::Height(1.2));
            let error = flight.plant.height - 1.2;
            squares += error * error;
            worst = worst.max(error.abs());
        }
        let rms = (squares / 3000.0).sqrt();
        assert!(rms < 0.06 && worst < 0.22, "seed {seed}: rms {rms}, worst {worst}");
        assert!(
            (flight.climb.hover_us() - flight.plant.hover_us).abs() < 25.0,
            "{}",
            flight.climb.hover_us()
        );
    }
}

#[test]
fn a_lost_cell_costs_less_than_half_of_the_height_and_so_does_one_that_is_back() {
    for seed in 0..6 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        flight.feels = true;
        flight.hold(1.2, 3.0);
        flight.plant.thrust = 0.56;
        let sunk = flight.hold(1.2, 4.0);
        assert!(sunk < 0.6, "seed {seed}: sank by {sunk}");
        let worst = flight.hold(1.2, 2.0);
        assert!(worst < 0.1, "seed {seed}: {worst}");
        assert!((flight.climb.hover_us() - 1601.0).abs() < 30.0, "{}", flight.climb.hover_us());
        flight.plant.thrust = 1.0;
        let risen = flight.hold(1.2, 4.0);
        assert!(risen < 0.6, "seed {seed}: rose by {risen}");
    }
}

#[test]
fn stays_stable_when_the_thrust_answers_otherwise_than_modelled() {
    for exponent in [1.0, 1.5, 2.0, 3.0] {
        let mut flight = Flight::hovering(1450.0, 1.0, 3);
        flight.plant.exponent = exponent;
        flight.hold(1.3, 6.0);
        let worst = flight.hold(1.3, 10.0);
        assert!(worst < 0.06, "exponent {exponent}: {worst}");
    }
}

#[test]
fn a_table_edge_is_no_reason_to_climb() {
    for seed in 0..10 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        flight.hold(1.2, 3.0);
        for _ in 0..6 {
            flight.plant.surface = 0.75;
            let over = flight.hold(1.2, 3.0);
            assert!(over < 0.10, "seed {seed}: over the table {over}");
            assert!((flight.estimate.surface_m() - 0.75).abs() < 0.06, "{}", flight.estimate.surface_m());
            flight.plant.surface = 0.0;
            let beyond = flight.hold(1.2, 3.0);
            assert!(beyond < 0.10, "seed {seed}: beyond the table {beyond}");
            assert!(flight.estimate.surface_m().abs() < 0.05, "{}", flight.estimate.surface_m());
        }
    }
}

#[test]
fn tables_that_come_and_go_do_not_add_up() {
    // Chairs and tables of several heights for two minutes: the error is forgotten whenever the floor is seen.
    let mut flight = Flight::hovering(1450.0, 1.2, 5);
    for k in 0..60 {
        flight.plant.surface = [0.0, 0.45, 0.75, 0.0, 0.75, 0.45][k % 6];
        let worst = flight.hold(1.2, 1.0 + (k % 3) as f32 * 0.7);
        assert!(worst < 0.20, "{k}: {worst}");
    }
    flight.plant.surface = 0.0;
    flight.hold(1.2, 6.0);
    assert!(flight.hold(1.2, 2.0) < 0.06);
}

#[test]
fn lost_echoes_and_spikes_are_ridden_out() {
    for seed in 0..6 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        flight.hold(1.2, 6.0);
        flight.lost = 0.4;
        flight.spikes = 0.05;
        let worst = flight.hold(1.2, 30.0);
        assert!(worst < 0.15, "seed {seed}: {worst}");
        // Nothing at all for 0.9 s: the learned throttle holds.
        flight.lost = 1.0;
        let worst = flight.hold(1.2, 0.9);
        assert!(worst < 0.25, "seed {seed}: blind {worst}");
        assert!(flight.estimate.silent_s(flight.now_ns) > 0.8);
    }
}

#[test]
fn fifteen_degrees_of_tilt_cost_centimetres() {
    let mut flight = Flight::hovering(1450.0, 1.2, 2);
    flight.hold(1.2, 3.0);
    let mut worst = 0.0f32;
    for k in 0..500 {
        flight.tilt = 0.26 * (k as f32 * 0.05).sin();
        flight.step(VerticalWish::Height(1.2));
        worst = worst.max((flight.plant.height - 1.2).abs());
    }
    assert!(worst < 0.08, "{worst}");
}

#[test]
fn a_soft_floor_lies_no_worse_than_it_lies() {
    let mut flight = Flight::hovering(1450.0, 1.2, 4);
    flight.hold(1.2, 3.0);
    let mut worst = 0.0f32;
    for k in 0..2000 {
        flight.lie = 0.06 * (k as f32 * 0.02 * 0.7).sin();
        flight.step(VerticalWish::Height(1.2));
        worst = worst.max((flight.plant.height - 1.2).abs());
    }
    assert!(worst < 0.06 + 0.06, "{worst}");
}

#[test]
fn a_fall_is_believed_although_it_is_faster_than_thrust_explains() {
    // Motors stop for 0.25 s (a link that died), as the estimator cannot know.
    for seed in 0..6 {
        let mut flight = Flight::hovering(1450.0, 1.4, seed);
        flight.hold(1.4, 3.0);
        for _ in 0..12 {
            flight.sense().map(|(at, range)| flight.estimate.measure(at, range, 0.0));
            let model = flight.climb.expected_acceleration(0.02, 0.0, flight.estimate.climb_m_s());
            flight.estimate.predict(flight.now_ns, model);
            flight.climb.step(0.02, VerticalWish::Height(1.4), &mut flight.estimate, 0.0, true);
            flight.fly(1000.0);
        }
        let mut lowest = f32::INFINITY;
        for _ in 0..300 {
            flight.step(VerticalWish::Height(1.4));
            lowest = lowest.min(flight.plant.height);
        }
        assert!(lowest > 0.15, "seed {seed}: fell to {lowest}");
        let worst = flight.hold(1.4, 2.0);
        assert!(worst < 0.12, "seed {seed}: {worst}, surface {}", flight.estimate.surface_m());
    }
}

#[test]
fn low_steps_between_lost_echoes_are_no_motion() {
    // Books on a table: 11 cm, little more than the gate, and half of the echoes lost.
    for seed in 0..10 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        flight.plant.surface = 0.75;
        flight.hold(1.2, 4.0);
        flight.lost = 0.5;
        for k in 0..8 {
            flight.plant.surface = if k % 2 == 0 { 0.86 } else { 0.75 };
            let worst = flight.hold(1.2, 1.5);
            assert!(worst < 0.25, "seed {seed}, step {k}: {worst}");
        }
    }
}

#[test]
fn a_leap_is_believed_although_it_is_faster_than_thrust_explains() {
    // 1.2 m/s upwards within a quarter of a second, over a table that begins just then.
    for seed in 0..6 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        flight.hold(1.2, 3.0);
        flight.plant.surface = 0.4;
        flight.push = 5.0;
        let mut worst = flight.hold(1.2, 0.24);
        flight.push = 0.0;
        worst = worst.max(flight.hold(1.2, 6.0));
        assert!(worst < 0.8, "seed {seed}: {worst}");
        let late = flight.hold(1.2, 2.0);
        assert!(late < 0.2, "seed {seed}: {late}, surface {}", flight.estimate.surface_m());
    }
}

#[test]
fn a_whole_flight_from_floor_to_floor() {
    for (seed, hover, guess) in
        [(1, 1380.0, 1480.0), (2, 1450.0, 1450.0), (3, 1520.0, 1430.0), (4, 1600.0, 1500.0)]
    {
        for lie in [0.0, 0.08] {
            let mut flight = Flight::new(hover, guess, seed);
            let mut spool = SpoolUp::new(LiftoffConfig::default(), guess);
            loop {
                if let Some((at, range)) = flight.sense() {
                    spool.hear(at, range - REST);
                }
                match spool.step(0.02) {
                    Liftoff::SpoolingUp { throttle_us } => flight.fly(throttle_us),
                    Liftoff::Lifted { hover_us, height_m, climb_m_s } => {
                        assert!((hover_us - hover).abs() < 70.0, "{hover_us} for {hover}");
                        flight.climb.set_hover(hover_us);
                        flight.climb.set_throttle(hover_us);
                        flight.estimate.set(flight.now_ns, height_m, climb_m_s, 0.0);
                        break;
                    }
                    Liftoff::Stuck => panic!("stuck at {hover}"),
                }
                assert!(flight.steps < 500, "never lifted");
            }
            let mut top = 0.0f32;
            for _ in 0..500 {
                flight.step(VerticalWish::Height(1.2));
                top = top.max(flight.plant.height);
            }
            assert!(top < 1.45, "hover {hover}: overshoot to {top}");
            assert!((flight.plant.height - 1.2).abs() < 0.06, "hover {hover}: {}", flight.plant.height);
            assert!((flight.climb.hover_us() - hover).abs() < 20.0, "{} {hover}", flight.climb.hover_us());
            // The pad is soft: near it the sonar reads long.
            let mut touch = TouchDown::default();
            let mut steps = 0;
            flight.plant.touched_at = 0.0;
            loop {
                flight.lie = if flight.plant.height < 0.5 { lie } else { 0.0 };
                let clearance = flight.estimate.clearance_m();
                let rate = if clearance > 0.4 { -0.35 } else { -0.2 };
                flight.learn = clearance > 0.35;
                flight.step(VerticalWish::Rate(rate));
                let e = &flight.estimate;
                if touch.step(
                    &TouchDownConfig::default(),
                    0.02,
                    e.clearance_m(),
                    e.climb_m_s(),
                    flight.climb.load(),
                ) {
                    break;
                }
                steps += 1;
                assert!(steps < 600, "no touch-down: {} {}", flight.plant.height, flight.climb.load());
            }
            // What is left to fall when the motors stop counts as well.
            let fall = (flight.plant.climb.powi(2) + 2.0 * 9.81 * flight.plant.height).sqrt();
            assert!(flight.plant.touched_at > -0.5, "hover {hover}: touched at {}", flight.plant.touched_at);
            assert!(fall < 0.65, "hover {hover}, lie {lie}: cut {} m up", flight.plant.height);
        }
    }
}

#[test]
fn comes_down_blind_without_a_crash() {
    for seed in 0..6 {
        let mut flight = Flight::hovering(1450.0, 1.2, seed);
        flight.hold(1.2, 12.0);
        flight.lost = 1.0;
        flight.plant.touched_at = 0.0;
        flight.learn = false;
        for _ in 0..400 {
            flight.step(VerticalWish::Rate(-0.35));
        }
        assert!(flight.plant.height < 0.02, "seed {seed}: still at {}", flight.plant.height);
        assert!(flight.plant.touched_at > -0.7, "seed {seed}: {}", flight.plant.touched_at);
    }
}
