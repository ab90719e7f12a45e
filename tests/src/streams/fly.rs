//! Streams in lockstep, many flights at once, and the report.

use super::commander::{self, Commander};
use super::teller::{self, Teller};
use super::{FIRST_S, Kind, PERIOD_S, STREAM_S, STREAMS, Stream, draw, stream_at};
use crate::checkout;
use anyhow::{Context, Result};
use cli::flight::{Setup, vehicle_body, world};
use cli::orders::Orders;
use cli::witness::{Witness, touched};
use ipc_types::{MAX_SONARS, Pose, Setpoint, SonarRanges, Truth, Verb};
use manifest::Subscription;
use runtime::{Cache, Input, Lockstep, Ports};
use serde::Serialize;
use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Services have settled and the boot grace of the controller is over, seconds.
const BEGIN_S: f64 = 6.0;
/// One look.
const LOOK_S: f64 = 0.1;
/// From the order to the take-off at most, seconds.
const REFUSED_S: f64 = 15.0;

/// What is flown.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Flights at once.
    pub threads: usize,
    /// Streams to be flown; the last flight may bring some more.
    pub streams: u64,
    /// Seed of the first flight.
    pub seed: u64,
    /// Name of a plan and world of `deploy`.
    pub world: String,
    /// Name of a vehicle of `deploy`.
    pub vehicle: String,
    /// `none`, `light` or `full`.
    pub clutter: String,
}

/// A contact.
#[derive(Clone, Debug, Serialize)]
pub struct Touch {
    /// Seed of the flight.
    pub seed: u64,
    /// Stream in which it happened; `None`: between two, or on the way down.
    pub stream: Option<usize>,
    /// Seconds since the stream began, or since the take-off.
    pub at_s: f64,
    /// Where, and how fast and high the drone was.
    pub place_m: [f32; 3],
    /// Metres a second.
    pub speed_m_s: f32,
    /// What was asked for.
    pub kind: Option<Kind>,
    /// What was broken.
    pub broken: String,
    /// How far off the place was that the pilot was told, metres.
    pub off_m: f32,
    /// What it was told of that, metres.
    pub sigma_m: f32,
    /// Phase of the pilot.
    pub phase: String,
    /// What was touched, and in which direction of the body frame it was, degrees.
    pub what: String,
    /// See `what`.
    pub bearing_deg: f32,
    /// The last seconds before it, a line each tenth.
    pub trace: Vec<String>,
}

/// What came of one flight.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// Streams that were flown, wholly or until something ended the flight.
    pub streams: u64,
    /// The contact that ended it.
    pub touch: Option<Touch>,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// Way flown within the streams, metres.
    pub distance_m: f64,
}

/// What came of all.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Streams flown.
    pub streams: u64,
    /// Flights that they were flown in.
    pub flights: u64,
    /// Contacts, each the end of its flight.
    pub contacts: Vec<Touch>,
    /// Way flown within the streams, metres: a shield that lets nothing move touches nothing.
    pub distance_m: f64,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// Seconds that it took.
    pub wall_s: f64,
}

/// Flies streams until there are enough; `tell` hears of each flight as it is done.
///
/// # Errors
/// Files of `deploy` that are missing or wrong.
pub fn run(settings: &Settings, tell: impl Fn(u64, &Course) + Sync) -> Result<Report> {
    let began = Instant::now();
    let cache = Cache::default();
    let (next, flown) = (AtomicU64::new(0), AtomicU64::new(0));
    let done: Mutex<Vec<Result<(u64, Course)>>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..settings.threads.max(1) {
            scope.spawn(|| {
                // Flights are numbered in the order of their start, so that as many are flown whoever is faster.
                while flown.load(Ordering::Relaxed) < settings.streams {
                    let seed = settings.seed + next.fetch_add(1, Ordering::Relaxed);
                    let course = fly(settings, seed, &cache);
                    if let Ok(course) = &course {
                        flown.fetch_add(course.streams.max(1), Ordering::Relaxed);
                        tell(seed, course);
                    } else {
                        flown.store(u64::MAX, Ordering::Relaxed);
                    }
                    done.lock().unwrap_or_else(PoisonError::into_inner).push(course.map(|c| (seed, c)));
                }
            });
        }
    });
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut flights = done.into_iter().collect::<Result<Vec<_>>>()?;
    flights.sort_by_key(|(seed, _)| *seed);
    let mut report = Report { wall_s: began.elapsed().as_secs_f64(), ..Report::default() };
    for (_, course) in flights {
        report.flights += 1;
        report.streams += course.streams;
        report.distance_m += course.distance_m;
        report.simulated_s += course.simulated_s;
        report.contacts.extend(course.touch);
    }
    Ok(report)
}

/// The system with the two stand-ins, which may look at the truth.
fn setup(settings: &Settings, streams: &[Stream], cache: &Cache) -> Result<Setup> {
    let deploy = checkout().join("deploy");
    let mut setup = Setup::simulated(&deploy, &settings.vehicle, settings.clutter.clone(), 0.0)?;
    setup.manifest.system.plan = format!("plans/{}.yaml", settings.world);
    setup.manifest.system.world = format!("worlds/{}.toml", settings.world);
    "room".clone_into(&mut setup.simulator.start);
    setup.simulator.faults = streams.iter().flat_map(|stream| stream.faults.clone()).collect();
    // What the stand-ins open, and nothing else.
    let topics = [
        (
            "navigation",
            &["navigation/grid", "navigation/setpoint"][..],
            &["localization/pose", "sonar/ranges", "pilot/state", "navigation/grid"][..],
        ),
        ("localization", &["localization/pose"][..], &["flight/attitude"][..]),
    ];
    for (name, published, read) in topics {
        let entry = setup.manifest.services.get_mut(name).context("the manifest has no such service")?;
        entry.scorer = true;
        entry.publishes.retain(|topic, _| published.contains(&topic.as_str()));
        entry.subscribes.retain(|topic, _| read.contains(&topic.as_str()));
        entry.subscribes.insert("sim/truth".to_owned(), Subscription { depth: 8, wake: false });
    }
    setup.cache = cache.clone();
    Ok(setup)
}

fn sides(deploy: &Path, vehicle: &str) -> Result<Vec<String>> {
    let file = format!("vehicles/{vehicle}.toml");
    let text = std::fs::read_to_string(deploy.join(&file)).with_context(|| file.clone())?;
    let vehicle = manifest::Vehicle::parse(&file, &text)?;
    Ok(vehicle.sonars.iter().filter(|s| s.elevation_rad.abs() < 0.8).map(|s| s.name.clone()).collect())
}

fn fly(settings: &Settings, seed: u64, cache: &Cache) -> Result<Course> {
    let streams = draw(seed, &sides(&checkout().join("deploy"), &settings.vehicle)?);
    let setup = setup(settings, &streams, cache)?;
    let world = world(&setup.manifest, &setup.root, &setup.simulator, seed, &setup.cache)?;
    let mut bus = Lockstep::new(setup.manifest.clone(), &setup.root, seed, setup.cache.clone());
    bus.add_with::<simulator::Simulator>(setup.simulator.clone())?;
    bus.add::<flight::Flight>()?;
    bus.add::<sonar::Sonar>()?;
    bus.add::<flow::Flow>()?;
    bus.add::<pilot::Pilot>()?;
    let offsets = streams.iter().map(|stream| stream.offset).collect();
    bus.add_with::<Teller>(teller::Config { offsets })?;
    let seeds = streams.iter().map(|stream| stream.seed).collect();
    bus.add_with::<Commander>(commander::Config { seeds })?;
    let body = vehicle_body(&setup.manifest, &setup.root, &setup.cache)?;
    let mut ports = bus.tool("cli");
    let mut witness = Witness::open(&mut ports, &world, body)?;
    let mut orders = Orders::open(&mut ports)?;

    let mut trace = Trace::open(&mut ports)?;
    let mut course = Course::default();
    let run_for = |bus: &mut Lockstep, seconds: f64| {
        bus.run_until(bus.now() + ipc_types::nanoseconds(seconds));
    };
    run_for(&mut bus, BEGIN_S);
    orders.give(Verb::PatrolStart, f32::NAN, f32::NAN, 1);
    let mut took_off_s = None;
    let mut last = None;
    loop {
        run_for(&mut bus, LOOK_S);
        witness.look(&world);
        let Some(truth) = witness.last_truth else { continue };
        if truth.armed != 0 && truth.on_ground == 0 {
            took_off_s.get_or_insert(truth.time_s);
        }
        let flown_s = took_off_s.map_or(0.0, |off| truth.time_s - off);
        let stream = took_off_s.and_then(|_| stream_at(flown_s));
        if let Some(stream) = stream {
            course.streams = course.streams.max(stream as u64 + 1);
            if let Some((x, y)) = last {
                course.distance_m += f64::from((truth.x_m - x as f32).hypot(truth.y_m - y as f32));
            }
        }
        last = stream.map(|_| (f64::from(truth.x_m), f64::from(truth.y_m)));
        trace.look(&truth, witness.last_pilot.map_or(f32::NAN, |pilot| pilot.shield_speed_m_s));
        if truth.contacts > 0 {
            let (what, bearing) = touched(&world, &truth, body);
            let bearing = control::wrap_angle(bearing - truth.yaw_rad);
            let began_s = stream.map_or(0.0, |s| FIRST_S + PERIOD_S * s as f64);
            let of = stream.and_then(|stream| streams.get(stream));
            course.touch = Some(Touch {
                seed,
                stream,
                at_s: flown_s - began_s,
                place_m: [truth.x_m, truth.y_m, truth.z_m],
                speed_m_s: truth.velocity_x_m_s.hypot(truth.velocity_y_m_s),
                kind: of.map(Stream::kind),
                broken: of.map_or_else(String::new, Stream::broken),
                off_m: of.map_or(0.0, |s| s.offset.x_m.hypot(s.offset.y_m)),
                sigma_m: of.map_or(0.0, |s| s.offset.sigma_m),
                phase: witness.phase().to_owned(),
                what,
                bearing_deg: bearing.to_degrees(),
                trace: trace.lines.iter().cloned().collect(),
            });
        }
        let over = flown_s > FIRST_S + PERIOD_S * (STREAMS - 1) as f64 + STREAM_S;
        let refused = took_off_s.is_none() && truth.time_s > BEGIN_S + REFUSED_S;
        if course.touch.is_some() || over || refused || witness.landed() {
            break;
        }
    }
    course.simulated_s = bus.now() as f64 * 1e-9;
    Ok(course)
}

/// The last looks before a contact.
struct Trace {
    pose: Input<Pose>,
    setpoint: Input<Setpoint>,
    ranges: Input<SonarRanges>,
    last: (Pose, Setpoint),
    heard_m: [f32; MAX_SONARS],
    lines: VecDeque<String>,
}

/// Looks kept: three seconds.
const KEPT: usize = 30;

impl Trace {
    fn open(ports: &mut Ports) -> Result<Self> {
        Ok(Self {
            pose: ports.input()?,
            setpoint: ports.input()?,
            ranges: ports.input()?,
            last: (Pose::default(), Setpoint::default()),
            heard_m: [f32::INFINITY; MAX_SONARS],
            lines: VecDeque::with_capacity(KEPT),
        })
    }

    fn look(&mut self, truth: &Truth, shield_m_s: f32) {
        while let Some(group) = self.ranges.receive() {
            for reading in group.filled() {
                if let Some(heard) = self.heard_m.get_mut(usize::from(reading.sensor)) {
                    *heard = reading.range().unwrap_or(f32::NAN);
                }
            }
        }
        let pose = self.pose.latest().map_or(self.last.0, |new| *new);
        let setpoint = self.setpoint.latest().map_or(self.last.1, |new| *new);
        self.last = (pose, setpoint);
        let sonars = self.heard_m.iter().rposition(|heard| !heard.is_infinite()).map_or(0, |last| last + 1);
        let body = |x: f32, y: f32| {
            let v = control::Vector::new(x, y).rotated(-truth.yaw_rad);
            format!("{:5.2} {:5.2}", v.x, v.y)
        };
        if self.lines.len() == KEPT {
            self.lines.pop_front();
        }
        self.lines.push_back(format!(
            "{:6.1} at {:6.2} {:6.2} {:4.2} yaw {:4.0} gap {:5.2} | body frame: wish {} true {} believed {} | shield {:5.2} tilt {:4.1} {:4.1} | heard {:.2?}",
            truth.time_s,
            truth.x_m,
            truth.y_m,
            truth.z_m,
            truth.yaw_rad.to_degrees(),
            truth.clearance_m,
            body(setpoint.velocity_x_m_s, setpoint.velocity_y_m_s),
            body(truth.velocity_x_m_s, truth.velocity_y_m_s),
            body(pose.velocity_x_m_s, pose.velocity_y_m_s),
            shield_m_s,
            truth.roll_rad.to_degrees(),
            truth.pitch_rad.to_degrees(),
            &self.heard_m[..sonars],
        ));
    }
}
