//! A whole flight in lockstep: every service of the manifest, one simulated round.

use crate::orders::Orders;
use crate::witness::Witness;
use airframe::picture::Picture;
use airframe::score::FlightScore;
use airframe::world::World;
use anyhow::{Context, Result};
use floorplan::Rooms;
use ipc_types::Verb;
use localization::{LocalizationConfig, StartFrom, StartSection};
use manifest::{Body, Manifest};
use navigation::config::NavigationConfig;
use runtime::{Cache, Lockstep, Start};
use std::path::Path;

/// What a flight is flown with.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The system's manifest, simulator included.
    pub manifest: Manifest,
    /// Directory that its paths start from.
    pub root: std::path::PathBuf,
    /// Configuration of the simulator.
    pub simulator: simulator::Config,
    /// Configuration of navigation; that of the manifest's file when absent.
    pub navigation: Option<NavigationConfig>,
    /// Where the drone starts, and what localization is told of it.
    pub begin: Begin,
    /// Configuration of localization; that of the manifest's file when absent.
    pub localization: Option<LocalizationConfig>,
    /// Longest flight, simulated seconds.
    pub patience_s: f64,
    /// Plans and tables shared between flights.
    pub cache: Cache,
}

impl Setup {
    /// The simulated system of a `deploy` directory, with a vehicle of its `vehicles` and clutter by its word.
    ///
    /// # Errors
    /// When the manifest is missing or wrong.
    pub fn simulated(deploy: &Path, vehicle: &str, clutter: String, patience_s: f64) -> Result<Self> {
        let files = format!("{0}/system.toml:{0}/sim.toml", deploy.display());
        let (mut manifest, root) = runtime::load_manifest(&files)?;
        manifest.system.vehicle = format!("vehicles/{vehicle}.toml");
        let simulator = simulator::Config { clutter, ..simulator::Config::default() };
        Ok(Self {
            manifest,
            root,
            simulator,
            navigation: None,
            localization: None,
            begin: Begin::default(),
            patience_s,
            cache: Cache::default(),
        })
    }

    /// The configuration of localization with what it is told of the start.
    fn told(&self, simulator: &simulator::Config, world: &World, seed: u64) -> Result<LocalizationConfig> {
        let mut config = match &self.localization {
            Some(config) => config.clone(),
            None => self.config::<localization::Localization>()?,
        };
        config.start = StartSection { from: StartFrom::Unknown, ..config.start };
        if self.begin == Begin::Room {
            let seed = Start::service_seed(seed, <simulator::Simulator as runtime::Service>::NAME);
            let start =
                Start::new(self.manifest.system.clone(), &self.root, seed, 0, true, self.cache.clone())?;
            let place = simulator::start_place(simulator, &start, world)?;
            let rooms = Rooms::of(&start.sidecar_name(), &start.sidecar()?, &*start.plan()?)?;
            // A place between two rooms belongs to none.
            if let Some(room) = rooms.room_at(place.x, place.y) {
                config.start.from = StartFrom::Room;
                rooms.name(room).clone_into(&mut config.start.room);
            }
        }
        Ok(config)
    }

    /// The configuration file that the manifest names for a service.
    ///
    /// # Errors
    /// When it is missing or wrong.
    pub fn config<S: runtime::Service>(&self) -> Result<S::Config> {
        let name = S::NAME;
        let entry =
            self.manifest.services.get(name).with_context(|| format!("the manifest has no {name}"))?;
        let text =
            std::fs::read_to_string(self.root.join(&entry.config)).with_context(|| entry.config.clone())?;
        Ok(runtime::parse_config(&entry.config, &text)?)
    }
}

/// Where the drone starts, and what localization is told of it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Begin {
    /// On the pad.
    #[default]
    Pad,
    /// Anywhere, drawn by the seed: localization is told the room.
    Room,
    /// Anywhere: localization is told nothing.
    Unknown,
}

/// A flight being flown.
pub struct Flight {
    /// The services.
    pub bus: Lockstep,
    /// The world as built, for scoring.
    pub world: World,
    /// What is seen of the flight.
    pub witness: Witness,
    orders: Orders,
    patience_ns: u64,
    seed: u64,
}

/// Estimates are compared with the truth this often.
const LOOK_NS: u64 = 20_000_000;
/// The services have settled and the flight controller's boot grace (5 s, FACTS 1) is over.
const ORDER_AT_NS: u64 = 6_000_000_000;
/// Disarmed on the ground for so long: it is over.
const REST_NS: u64 = 1_500_000_000;

impl Flight {
    /// Starts all services.
    ///
    /// # Errors
    /// When one cannot start.
    pub fn start(setup: &Setup, seed: u64) -> Result<Self> {
        let world = world(&setup.manifest, &setup.root, &setup.simulator, seed, &setup.cache)?;
        let mut bus = Lockstep::new(setup.manifest.clone(), &setup.root, seed, setup.cache.clone());
        let mut simulator = setup.simulator.clone();
        if setup.begin != Begin::Pad {
            "room".clone_into(&mut simulator.start);
        }
        bus.add_with::<simulator::Simulator>(simulator.clone())?;
        bus.add::<flight::Flight>()?;
        bus.add::<sonar::Sonar>()?;
        bus.add::<flow::Flow>()?;
        bus.add::<pilot::Pilot>()?;
        if setup.begin == Begin::Pad {
            match &setup.localization {
                Some(config) => bus.add_with::<localization::Localization>(config.clone())?,
                None => bus.add::<localization::Localization>()?,
            }
        } else {
            bus.add_with::<localization::Localization>(setup.told(&simulator, &world, seed)?)?;
        }
        match &setup.navigation {
            Some(config) => bus.add_with::<navigation::Navigation>(config.clone())?,
            None => bus.add::<navigation::Navigation>()?,
        }
        let body = vehicle_body(&setup.manifest, &setup.root, &setup.cache)?;
        let mut ports = bus.tool("cli");
        let witness = Witness::open(&mut ports, &world, body)?;
        let orders = Orders::open(&mut ports)?;
        Ok(Self { bus, world, witness, orders, patience_ns: (setup.patience_s * 1e9) as u64, seed })
    }

    /// Runs for `seconds` of simulated time.
    pub fn run_for(&mut self, seconds: f64) {
        let until = self.bus.now() + ipc_types::nanoseconds(seconds);
        while self.bus.now() < until {
            let next = (self.bus.now() + LOOK_NS).min(until);
            self.bus.run_until(next);
            self.witness.look(&self.world);
        }
    }

    /// Gives an order. Orders are numbered by the simulated clock, so that a flight repeats.
    pub fn order(&mut self, verb: Verb, x: f32, y: f32) {
        let number = (self.bus.now() / 1_000_000) as u32 | 1;
        self.orders.give(verb, x, y, number);
    }

    /// Flies one round, from the order to rest.
    pub fn fly_round(&mut self) {
        self.run_for(ORDER_AT_NS as f64 * 1e-9);
        self.order(Verb::PatrolStart, f32::NAN, f32::NAN);
        while self.bus.now() < self.patience_ns {
            self.run_for(0.5);
            if self.witness.landed() || self.witness.contacts() > 0 {
                break;
            }
        }
        self.run_for(REST_NS as f64 * 1e-9);
    }

    /// The score, and the picture of the flight as SVG.
    #[must_use]
    pub fn finish_with_picture(self, title: &str, labels: &[(String, f32, f32)]) -> (FlightScore, String) {
        let track = self.witness.track.clone();
        let coverage = self.witness.scorer().coverage().clone();
        let score = self.witness.finish(&self.world, self.seed);
        let picture = Picture {
            title,
            world: &self.world,
            coverage: &coverage,
            track: &track,
            report: &score.report,
            labels,
        };
        let drawn = picture.draw();
        (score, drawn)
    }

    /// The score of the flight.
    #[must_use]
    pub fn finish(self) -> FlightScore {
        self.witness.finish(&self.world, self.seed)
    }
}

/// The world that a flight with this seed is flown in.
///
/// # Errors
/// When plan or world file are missing or wrong.
pub fn world(
    manifest: &Manifest,
    root: &Path,
    config: &simulator::Config,
    seed: u64,
    cache: &Cache,
) -> Result<World> {
    let seed = Start::service_seed(seed, <simulator::Simulator as runtime::Service>::NAME);
    let start = Start::new(manifest.system.clone(), root, seed, 0, true, cache.clone())?;
    Ok(simulator::build_world(config, &start)?)
}

/// The drone's body.
///
/// # Errors
/// When the vehicle file is missing or wrong.
pub fn vehicle_body(manifest: &Manifest, root: &Path, cache: &Cache) -> Result<Body> {
    Ok(Start::new(manifest.system.clone(), root, 0, 0, true, cache.clone())?.vehicle.body)
}

/// Names of rooms and where to write them on a picture, from the plan's sidecar file; none without one.
///
/// # Errors
/// When the sidecar is there and wrong.
pub fn labels(manifest: &Manifest, root: &Path) -> Result<Vec<(String, f32, f32)>> {
    let side = Start::new(manifest.system.clone(), root, 0, 0, true, Cache::default())?.sidecar()?;
    Ok(side
        .rooms
        .iter()
        .map(|room| {
            let (x, y) = room.area.middle();
            (room.name.clone(), x, y)
        })
        .collect())
}
