//! `sereno demo`: the system as processes, one round, a line a second, a picture and a report.

use crate::arguments::Demo;
use crate::kills::Kills;
use airframe::picture::Picture;
use airframe::score::{FlightReport, Outcome};
use anyhow::{Context, Result, bail};
use cli::flight::{labels, vehicle_body, world};
use cli::interrupt::Interrupt;
use cli::orders::{Orders, next_order_number};
use cli::place::Place;
use cli::witness::Witness;
use ipc_types::Verb;
use runtime::{Cache, Tool};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

/// All services are ready within this time on a slow machine.
const READY: Duration = Duration::from_secs(60);
/// Half of the shortest period that is watched (50 Hz).
const GLANCE: Duration = Duration::from_millis(10);
/// The pilot may still be waiting for the controller's boot grace (5 s, FACTS 1): the order is repeated.
const ORDER_AGAIN: Duration = Duration::from_secs(2);
/// Disarmed on the ground for so long: it is over.
const REST: Duration = Duration::from_secs(2);

/// The supervised system as a child; ended when this goes out of scope.
struct System(Child);

impl System {
    fn start(place: &Place, seed: u64) -> Result<Self> {
        let program = std::env::current_exe().context("where am I?")?;
        let child = Command::new(program)
            .arg("--deploy")
            .arg(place.deploy()?)
            .arg("--run-dir")
            .arg(place.run_dir()?)
            .args(["up", "--sim", "--quiet", "--seed", &seed.to_string()])
            .stdin(Stdio::null())
            .spawn()
            .context("cannot start the system")?;
        Ok(Self(child))
    }

    /// Lands if need be, stops, waits.
    fn stop(mut self, place: &Place) -> Result<()> {
        if let Ok(client) = supervisor::Client::connect(&place.run_dir()?) {
            client.stop(false, Duration::from_secs(90))?;
        }
        self.0.wait().context("cannot wait for the system")?;
        Ok(())
    }
}

impl Drop for System {
    fn drop(&mut self) {
        // After a regular stop there is nothing left to kill; otherwise its warden brings the rest to an end.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn wait_until_ready(place: &Place, system: &mut System) -> Result<()> {
    let began = Instant::now();
    let run_dir = place.run_dir()?;
    loop {
        if let Ok(Some(status)) = system.0.try_wait() {
            bail!("the system ended at once: {status}");
        }
        let rows =
            supervisor::Client::connect(&run_dir).and_then(|mut client| client.ps()).map(|all| all.services);
        match rows {
            Ok(rows) if !rows.is_empty() && rows.iter().all(|row| row.state == "running") => return Ok(()),
            Ok(rows) if began.elapsed() > READY => {
                let waiting: Vec<_> = rows
                    .iter()
                    .filter(|row| row.state != "running")
                    .map(|row| format!("{} is {}: {}", row.name, row.state, row.last_end))
                    .collect();
                bail!("not all services came up: {}", waiting.join("; "));
            }
            Err(error) if began.elapsed() > READY => return Err(error.into()),
            _ => std::thread::sleep(GLANCE),
        }
    }
}

pub(crate) fn run(place: &Place, demo: &Demo, json: bool) -> Result<ExitCode> {
    let stop = Interrupt::catch()?;
    let mut system = System::start(place, demo.seed)?;
    wait_until_ready(place, &mut system)?;
    let mut kills = (demo.kills > 0)
        .then(|| Ok::<_, anyhow::Error>(Kills::new(place.run_dir()?, demo.kills, demo.seed)))
        .transpose()?;
    let flown = fly(place, demo, kills.as_mut(), &stop, json);
    system.stop(place)?;
    let (report, picture) = flown?;
    std::fs::write(&demo.picture, picture).with_context(|| demo.picture.display().to_string())?;
    show(&report, demo, kills.as_ref(), json)?;
    let good = report.outcome == Outcome::LandedOnPad
        && report.contacts == 0
        && kills.as_ref().is_none_or(Kills::shrugged_off);
    Ok(if good || !demo.once { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Flies one round among processes that run already.
///
/// # Errors
/// Also when the simulator was started again on the way: the drone then stands on the pad of a new world.
fn fly(
    place: &Place,
    demo: &Demo,
    mut kills: Option<&mut Kills>,
    stop: &Interrupt,
    json: bool,
) -> Result<(FlightReport, String)> {
    let (manifest, root, run_dir) = place.running()?;
    let entry = manifest.services.get("simulator").context("the manifest has no simulator")?;
    let text = std::fs::read_to_string(root.join(&entry.config)).with_context(|| entry.config.clone())?;
    let config: simulator::Config = runtime::parse_config(&entry.config, &text)?;
    let cache = Cache::default();
    let world = world(&manifest, &root, &config, demo.seed, &cache)?;
    let body = vehicle_body(&manifest, &root, &cache)?;
    let names = labels(&manifest, &root)?;

    let mut tool = Tool::join("cli", manifest, &run_dir)?;
    let mut witness = Witness::open(&mut tool.ports, &world, body)?;
    let mut orders = Orders::open(&mut tool.ports)?;
    let number = next_order_number();
    let began = Instant::now();
    let mut last_order = None::<Instant>;
    let mut last_line = Instant::now();
    let mut rest = None::<Instant>;
    while began.elapsed() < Duration::from_secs(demo.patience) && !stop.came() {
        tool.tick();
        witness.look(&world);
        if witness.last_truth.is_some_and(|truth| truth.header.incarnation > 0) {
            bail!(
                "the simulator was started again in flight, and its world with it: what was flown proves nothing"
            );
        }
        if let Some(kills) = kills.as_deref_mut() {
            kills.look(began.elapsed(), &witness)?;
        }
        if !witness.flown() && last_order.is_none_or(|at| at.elapsed() > ORDER_AGAIN) {
            last_order = Some(Instant::now());
            orders.give(
                Verb::PatrolStart,
                f32::NAN,
                f32::NAN,
                number.wrapping_add(began.elapsed().as_secs() as u32),
            );
        }
        if last_line.elapsed() >= Duration::from_secs(1) {
            last_line += Duration::from_secs(1);
            line(&witness, began.elapsed(), json);
        }
        if witness.landed() {
            if rest.get_or_insert_with(Instant::now).elapsed() > REST {
                break;
            }
        } else {
            rest = None;
        }
        std::thread::sleep(GLANCE);
    }
    let track = witness.track.clone();
    let coverage = witness.scorer().coverage().clone();
    let score = witness.finish(&world, demo.seed);
    let picture = Picture {
        title: "Sereno: one round of the demo building",
        world: &world,
        coverage: &coverage,
        track: &track,
        report: &score.report,
        labels: &names,
    };
    let drawn = picture.draw();
    Ok((score.report, drawn))
}

fn line(witness: &Witness, elapsed: Duration, json: bool) {
    let truth = witness.last_truth;
    let (height, clearance) = truth.map_or((0.0, 0.0), |truth| (truth.z_m, truth.clearance_m));
    let (x, y) = witness.last_pose.map_or((f32::NAN, f32::NAN), |pose| (pose.x_m, pose.y_m));
    let error = witness.error_m().unwrap_or(f32::NAN);
    if json {
        println!(
            "{}",
            serde_json::json!({ "t": elapsed.as_secs(), "phase": witness.phase(), "x": x, "y": y, "height": height,
                "error": error, "clearance": clearance, "coverage": witness.coverage(), "doing": witness.round.text })
        );
    } else {
        println!(
            "{:>4} s  {:<11} at {x:>6.2} {y:>6.2}  height {height:>4.2} m  off by {:>4.1} cm  nearest {clearance:>4.2} m  \
             seen {:>5.1} %  {}",
            elapsed.as_secs(),
            witness.phase(),
            100.0 * error,
            100.0 * witness.coverage(),
            witness.round.text
        );
    }
}

fn show(report: &FlightReport, demo: &Demo, kills: Option<&Kills>, json: bool) -> Result<()> {
    if json {
        let mut report = serde_json::to_value(report)?;
        if let Some(kills) = kills {
            report["kills"] = kills.report();
        }
        println!("{report}");
        return Ok(());
    }
    println!();
    println!("{}: {} contacts, nearest {:.2} m", report.outcome, report.contacts, report.min_clearance_m);
    println!(
        "{:.0} m in {:.0} s, {:.1} % of what can be seen was seen",
        report.distance_m,
        report.time_s,
        100.0 * report.coverage
    );
    if let (Some(median), Some(p95)) = (report.loc_error_m.median, report.loc_error_m.p95) {
        println!(
            "position off by {:.1} cm in the median, {:.1} cm at the 95th percentile",
            100.0 * median,
            100.0 * p95
        );
    }
    if report.stalled_s > 0.0 {
        println!("the machine stalled: the world stood still for {:.1} s in all", report.stalled_s);
    }
    for failsafe in &report.failsafes {
        println!("failsafe: {failsafe}");
    }
    for skipped in &report.skipped {
        println!("skipped: {skipped}");
    }
    if let Some(kills) = kills {
        println!("{}", kills.sentence());
    }
    println!("picture: {}", demo.picture.display());
    Ok(())
}
