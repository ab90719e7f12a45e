//! One scenario in lockstep.

use super::guard::{self, AtTheSticks};
use super::{Scenario, Seen};
use crate::checkout;
use anyhow::{Context, Result};
use cli::flight::{Flight, Setup, labels};
use ipc_types::Phase;
use runtime::Cache;

/// The services have settled and the controller's boot grace (5 s, FACTS 1) is over, seconds.
const BEGIN_S: f64 = 6.0;
/// One look.
const LOOK_S: f64 = 0.02;
/// Whoever has not left the ground so long after the order will not, seconds: arming may take 3, spooling up 4.
const REFUSED_S: f64 = 12.0;
/// After the landing it is watched for so long: motors that start again would be seen, seconds.
const REST_S: f64 = 2.0;

/// A flight that is over.
pub struct Flown {
    /// What was seen of it.
    pub seen: Seen,
    /// Simulated seconds.
    pub simulated_s: f64,
    flight: Flight,
    setup: Setup,
}

impl Flown {
    /// The picture of the flight, as SVG.
    ///
    /// # Errors
    /// When the plan's side file is wrong.
    pub fn picture(self, title: &str) -> Result<String> {
        let labels = labels(&self.setup.manifest, &self.setup.root)?;
        Ok(self.flight.finish_with_picture(title, &labels).1)
    }
}

/// Flies a scenario, to its landing or to the end of its time. Plans and tables are shared over `cache`.
///
/// # Errors
/// Files of `deploy` that are missing or wrong, faults that name what the vehicle or the plan does not have.
pub fn fly(scenario: &Scenario, cache: &Cache) -> Result<Flown> {
    let deploy = checkout().join("deploy");
    let mut setup = Setup::simulated(&deploy, &scenario.vehicle, String::new(), scenario.flight_s)?;
    setup.manifest.system.plan = format!("plans/{}.yaml", scenario.world);
    setup.manifest.system.world = format!("worlds/{}.toml", scenario.world);
    setup.simulator = scenario.simulator();
    runtime::Validate::validate(&setup.simulator).with_context(|| scenario.name.clone())?;
    setup.cache = cache.clone();
    if scenario.guard.is_some() {
        guard::admit(&mut setup.manifest);
    }
    let mut flight = Flight::start(&setup, scenario.seed).with_context(|| scenario.name.clone())?;
    let mut guard = match &scenario.guard {
        Some(guard) => Some(AtTheSticks::open(guard.clone(), &mut flight, scenario.seed)?),
        None => None,
    };
    let mut seen = Seen::default();
    look_for(&mut flight, &mut seen, scenario, BEGIN_S);
    let mut orders = scenario.orders.iter().peekable();
    let mut rested_s = 0.0;
    while rested_s < REST_S {
        let now_s = flight.bus.now() as f64 * 1e-9;
        let flown_s =
            seen.took_off_s.and(flight.witness.last_truth).map(|t| t.time_s - seen.took_off_s.unwrap_or(0.0));
        while let Some(order) =
            orders.next_if(|order| order.at_s.is_none_or(|at| flown_s.is_some_and(|f| f >= at)))
        {
            let [x, y] = order.to.unwrap_or([f32::NAN; 2]);
            flight.order(order.order.verb(), x, y);
            // Orders are numbered by the millisecond.
            look_for(&mut flight, &mut seen, scenario, LOOK_S);
        }
        if let (Some(guard), Some(flown_s)) = (&mut guard, flown_s) {
            guard.act(flown_s, flight.witness.last_pilot.as_ref());
        }
        look_for(&mut flight, &mut seen, scenario, LOOK_S);
        let grounded = flight.witness.phase() == Phase::Grounded.word();
        let refused = seen.took_off_s.is_none() && grounded && now_s > BEGIN_S + REFUSED_S;
        let too_long = flown_s.unwrap_or(now_s - BEGIN_S - REFUSED_S) > scenario.flight_s;
        if too_long || refused {
            break;
        }
        if flight.witness.landed() {
            rested_s += LOOK_S;
        }
    }
    let simulated_s = flight.bus.now() as f64 * 1e-9;
    Ok(Flown { seen, simulated_s, flight, setup })
}

fn look_for(flight: &mut Flight, seen: &mut Seen, scenario: &Scenario, seconds: f64) {
    let looks = (seconds / LOOK_S).round().max(1.0) as u32;
    for _ in 0..looks {
        flight.run_for(LOOK_S);
        seen.look(flight, scenario);
    }
}
