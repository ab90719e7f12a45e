//! A small world of its own for the filter: exact rays over a drawn map, a point mass with gusts, a
//! compass that errs with place. It shares nothing with the cone table or the filter's mixture.

use floorplan::{ConeModel, ConeTable, Plan};
use mcl::{
    Config, Echo, Estimate, Filter, Flow, Generator, Memory, Motion, ParticlesMut, ParticlesRef, Reading,
    Start, Sweep,
};
use std::f32::consts::{FRAC_PI_4, PI};
use std::sync::Arc;

/// A side of a drawn character, metres.
const SIDE: f32 = 0.25;
/// Plan cells a character's side: 5 cm.
const FINER: usize = 5;

const BUILDING: &[&str] = &[
    "####################################################",
    "#                  #              #                #",
    "#                  #              #                #",
    "#                  #              #                #",
    "#                  #              #                #",
    "#       ##         #              #       ##       #",
    "#       ##         #              #       ##       #",
    "#                  #              #                #",
    "#                  #              #                #",
    "#                  #              #                #",
    "#                  #              #                #",
    "#                  #              #                #",
    "########    ##############    ##########    ########",
    "#                                                  #",
    "#                                                  #",
    "#                                                  #",
    "#                                                  #",
    "#                                                  #",
    "#                                                  #",
    "####    ##############    ##################    ####",
    "#                #               #                 #",
    "#                #               #                 #",
    "#                #               #                 #",
    "#                #               #                 #",
    "#                #   ##          #                 #",
    "#                #   ##          #                 #",
    "#                #               #                 #",
    "#                #               #                 #",
    "#                #               #                 #",
    "####################################################",
];

/// Through four rooms and the corridor, and back.
const ROUND: &[(f32, f32)] = &[
    (2.5, 3.35),
    (2.5, 5.9),
    (1.2, 6.2),
    (1.2, 3.4),
    (2.5, 3.35),
    (6.0, 3.4),
    (6.0, 1.3),
    (7.4, 1.3),
    (6.0, 3.4),
    (7.0, 3.4),
    (7.0, 6.0),
    (5.6, 6.4),
    (7.0, 3.4),
    (10.5, 3.4),
    (10.5, 5.8),
    (11.9, 6.6),
    (10.5, 3.4),
    (11.5, 3.4),
    (11.5, 1.2),
    (9.5, 1.2),
    (11.5, 3.4),
    (2.5, 3.35),
];

pub(crate) struct World {
    solid: Vec<Vec<bool>>,
    table: Arc<ConeTable>,
}

impl World {
    pub(crate) fn new() -> Self {
        let solid = BUILDING.iter().rev().map(|row| row.bytes().map(|c| c == b'#').collect()).collect();
        let fine: Vec<String> = BUILDING
            .iter()
            .flat_map(|row| {
                let wide: String = row.chars().flat_map(|c| std::iter::repeat_n(c, FINER)).collect();
                std::iter::repeat_n(wide, FINER)
            })
            .collect();
        let rows: Vec<&str> = fine.iter().map(String::as_str).collect();
        let plan = Arc::new(Plan::from_ascii(&rows, f64::from(SIDE) / FINER as f64));
        Self { solid, table: Arc::new(ConeTable::new(plan, ConeModel::default()).unwrap()) }
    }

    fn is_solid(&self, ix: i32, iy: i32) -> bool {
        usize::try_from(iy)
            .ok()
            .and_then(|iy| self.solid.get(iy))
            .and_then(|row| row.get(usize::try_from(ix).ok()?))
            .copied()
            .unwrap_or(true)
    }

    /// Distance to the first wall and the angle at which it is met.
    fn ray(&self, x: f32, y: f32, angle: f32) -> (f32, f32) {
        let (sin, cos) = angle.sin_cos();
        let (mut ix, mut iy) = ((x / SIDE).floor() as i32, (y / SIDE).floor() as i32);
        let next = |at: f32, i: i32, d: f32| {
            let edge = if d > 0.0 { (i + 1) as f32 } else { i as f32 } * SIDE;
            if d.abs() < 1e-9 { f32::INFINITY } else { (edge - at) / d }
        };
        loop {
            let (tx, ty) = (next(x, ix, cos), next(y, iy, sin));
            let t = tx.min(ty);
            if t > 6.0 {
                return (t, PI);
            }
            let incidence = if tx < ty {
                ix += if cos > 0.0 { 1 } else { -1 };
                cos.abs().min(1.0).acos()
            } else {
                iy += if sin > 0.0 { 1 } else { -1 };
                sin.abs().min(1.0).acos()
            };
            if self.is_solid(ix, iy) {
                return (t, incidence);
            }
        }
    }

    /// The nearest of 15 rays over 30 degrees that meets its wall at 13 degrees or less.
    fn hear(&self, x: f32, y: f32, angle: f32) -> Option<f32> {
        (0..15)
            .map(|k| self.ray(x, y, angle + (k - 7) as f32 * (15f32.to_radians() / 7.0)))
            .filter(|(range, incidence)| *range < 4.0 && *incidence < 13f32.to_radians())
            .map(|hit| hit.0)
            .min_by(f32::total_cmp)
    }
}

/// What is to go wrong.
#[derive(Clone)]
pub(crate) struct Trial {
    pub(crate) seed: u64,
    pub(crate) seconds: f32,
    pub(crate) flow: bool,
    /// Share of readings that are cut short by something unmapped.
    pub(crate) wrong: f32,
    /// Size of the compass error, radians, over a wave of 20 m.
    pub(crate) compass: f32,
    /// Moved to this place, unknown to the filter, at this time.
    pub(crate) kidnap: Option<(f32, (f32, f32))>,
    pub(crate) config: Config,
}

impl Default for Trial {
    fn default() -> Self {
        Self {
            seed: 1,
            seconds: 90.0,
            flow: true,
            wrong: 0.01,
            compass: 8f32.to_radians(),
            kidnap: None,
            config: Config::default(),
        }
    }
}

pub(crate) struct Moment {
    pub(crate) time: f32,
    pub(crate) error: f32,
    pub(crate) heading_error: f32,
    pub(crate) velocity_error: f32,
    pub(crate) count: usize,
    pub(crate) estimate: Estimate,
}

pub(crate) struct Log(pub(crate) Vec<Moment>);

impl Log {
    pub(crate) fn quantile(&self, q: f32, value: impl Fn(&Moment) -> f32) -> f32 {
        let mut values: Vec<f32> = self.0.iter().map(value).collect();
        values.sort_by(f32::total_cmp);
        values[((values.len() - 1) as f32 * q) as usize]
    }
    /// What to say when a bound is missed.
    pub(crate) fn summary(&self) -> String {
        let line = |name: &str, value: &dyn Fn(&Moment) -> f32| {
            let [median, p95, max] = [0.5, 0.95, 1.0].map(|q| self.quantile(q, value));
            format!("{name} median {median:.3} p95 {p95:.3} max {max:.3}; ")
        };
        line("error m", &|m| m.error)
            + &line("heading rad", &|m| m.heading_error)
            + &line("velocity m/s", &|m| m.velocity_error)
            + &line("P(lost)", &|m| m.estimate.p_lost)
            + &line("particles", &|m| m.count as f32)
    }
}

/// A particle set in ordinary memory.
pub(crate) struct Set {
    columns: [Vec<f32>; 8],
    count: usize,
}

impl Set {
    pub(crate) fn new(capacity: usize) -> Self {
        Self { columns: std::array::from_fn(|_| vec![f32::NAN; capacity]), count: 0 }
    }
    pub(crate) fn read(&self) -> ParticlesRef<'_> {
        let [x, y, vx, vy, ho, lr, lp, w] = &self.columns;
        let n = self.count;
        ParticlesRef {
            x: &x[..n],
            y: &y[..n],
            velocity_x: &vx[..n],
            velocity_y: &vy[..n],
            heading_offset: &ho[..n],
            level_roll: &lr[..n],
            level_pitch: &lp[..n],
            weight: &w[..n],
        }
    }
    pub(crate) fn write(&mut self) -> ParticlesMut<'_> {
        let [x, y, vx, vy, ho, lr, lp, w] = &mut self.columns;
        ParticlesMut {
            x,
            y,
            velocity_x: vx,
            velocity_y: vy,
            heading_offset: ho,
            level_roll: lr,
            level_pitch: lp,
            weight: w,
        }
    }
    pub(crate) fn set_count(&mut self, count: usize) {
        self.count = count;
    }
}

fn normal(g: &mut Generator) -> f32 {
    let u = g.uniform().max(1e-7);
    (-2.0 * u.ln()).sqrt() * (std::f32::consts::TAU * g.uniform()).cos()
}

const DT: f32 = 0.06;
const GRAVITY: f32 = 9.81;

/// Flies the round and filters along.
pub(crate) fn fly(world: &World, trial: &Trial) -> Log {
    let mut g = Generator::new(trial.seed);
    let mut filter = Filter::new(trial.config.clone(), Arc::clone(&world.table), 4_000).unwrap();
    let mut generator = Generator::new(trial.seed ^ 0x5eed);
    let (mut old, mut new) = (Set::new(4_000), Set::new(4_000));

    let level = [normal(&mut g) * 0.015, normal(&mut g) * 0.015];
    let scale = 1.0 + 0.01 * normal(&mut g);
    let phase = g.uniform() * 6.0;
    let base = 0.7;
    let offset =
        |x: f32, y: f32| base + trial.compass * ((x + 0.5 * y) / 20.0 * std::f32::consts::TAU + phase).sin();
    let (mut x, mut y) = ROUND[0];
    let (mut vx, mut vy, mut heading) = (0.0f32, 0.0f32, 0.3f32);
    let mut gust = [0.0f32; 2];
    let mut target = 1;

    let start = Start {
        x,
        y,
        sigma: 0.05,
        heading_offset: offset(x, y),
        heading_sigma: 0.05,
        level_roll: 0.0,
        level_pitch: 0.0,
        level_sigma: 0.015,
        velocity: [0.0; 2],
        p_lost: 0.01,
    };
    let begun = filter.start_at(&start, old.write(), &mut generator);
    old.set_count(begun.count);
    let mut memory: Memory = begun.memory;
    let mut log = Vec::new();
    let mut kidnap = trial.kidnap;
    let mut group = 0;
    let mut time = 0.0;
    while time < trial.seconds {
        let mut tilt = [0.0f32; 2];
        let mut yaw_mean = 0.0;
        const SUB: usize = 12;
        for _ in 0..SUB {
            let h = DT / SUB as f32;
            let (tx, ty) = ROUND[target];
            let (dx, dy) = (tx - x, ty - y);
            let far = dx.hypot(dy);
            if far < 0.3 {
                target = (target + 1) % ROUND.len();
            }
            let speed = 0.5f32.min(far);
            let wish = [(dx / far * speed - vx) * 2.0, (dy / far * speed - vy) * 2.0];
            for gust in &mut gust {
                *gust += -*gust * h + 0.2 * (2.0 * h).sqrt() * normal(&mut g);
            }
            let a = [wish[0].clamp(-1.2, 1.2), wish[1].clamp(-1.2, 1.2)];
            heading += 0.2 * h;
            let (s, c) = heading.sin_cos();
            let (forward, left) = (c * a[0] + s * a[1], -s * a[0] + c * a[1]);
            tilt[0] += (-left / GRAVITY).atan() / SUB as f32;
            tilt[1] += (forward / GRAVITY).atan() / SUB as f32;
            yaw_mean += (heading - offset(x, y)) / SUB as f32;
            vx += (a[0] + gust[0] - 0.3 * vx) * h;
            vy += (a[1] + gust[1] - 0.3 * vy) * h;
            x += vx * h;
            y += vy * h;
        }
        time += DT;
        if let Some((_, place)) = kidnap.filter(|k| time >= k.0) {
            (x, y) = place;
            (vx, vy) = (0.0, 0.0);
            kidnap = None;
        }
        let yaw = heading - offset(x, y) + 0.01 * normal(&mut g);
        let (roll, pitch) =
            (tilt[0] + level[0] + 0.003 * normal(&mut g), tilt[1] + level[1] + 0.003 * normal(&mut g));
        let (s, c) = heading.sin_cos();
        let flow = trial.flow.then(|| Flow {
            velocity_x: c * vx + s * vy + 0.08 * normal(&mut g),
            velocity_y: -s * vx + c * vy + 0.08 * normal(&mut g),
            sigma: 0.08,
        });
        let readings: Vec<Reading> = [group, group + 4]
            .iter()
            .map(|k| {
                let bearing = *k as f32 * FRAC_PI_4;
                let (bs, bc) = bearing.sin_cos();
                let (mx, my) = (0.2 * bc, 0.2 * bs);
                let heard = world.hear(x + c * mx - s * my, y + s * mx + c * my, heading + bearing);
                let heard = heard.map(|r| r * scale + 0.01 * normal(&mut g)).filter(|_| g.uniform() > 0.05);
                let echo = if g.uniform() < trial.wrong {
                    Echo::Range(0.2 + g.uniform() * (heard.unwrap_or(4.0) - 0.2).max(0.1))
                } else {
                    heard.filter(|r| *r < 4.0).map_or(Echo::Nothing, Echo::Range)
                };
                Reading { echo, bearing_rad: bearing, elevation_rad: 0.0, mount_x: mx, mount_y: my }
            })
            .collect();
        group = (group + 1) % 4;
        let sweep = Sweep {
            readings: &readings,
            roll_rad: roll,
            pitch_rad: pitch,
            yaw_rad: yaw,
            news: 1.0,
            familiar: 0,
            doors: 0,
        };
        let motion = Motion {
            felt: None,
            dt_s: DT,
            blind_s: 0.0,
            roll_rad: roll,
            pitch_rad: pitch,
            yaw_rad: yaw_mean,
            flow,
            grounded: false,
        };
        let update = filter.update(old.read(), &memory, &motion, Some(&sweep), new.write(), &mut generator);
        new.set_count(update.count);
        memory = update.memory;
        std::mem::swap(&mut old, &mut new);
        let e = update.estimate;
        log.push(Moment {
            time,
            error: (e.x - x).hypot(e.y - y),
            heading_error: mcl::wrap_angle(yaw + e.heading_offset - heading).abs(),
            velocity_error: (e.velocity_x - vx).hypot(e.velocity_y - vy),
            count: update.count,
            estimate: e,
        });
    }
    Log(log)
}
