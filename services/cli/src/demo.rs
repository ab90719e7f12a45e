//! `sereno demo`: the system as processes, one round, a line a second, a picture and a report.

use crate::arguments::Demo;
use crate::kills::Kills;
use crate::room::{Berth, Room};
use airframe::picture::Picture;
use airframe::score::{FlightReport, Outcome};
use anyhow::{Context, Result, bail};
use cli::flight::{labels, vehicle_body, world};
use cli::interrupt::Interrupt;
use cli::orders::{Orders, next_order_number};
use cli::place::Place;
use cli::witness::Witness;
use ipc_types::{PilotState, Verb};
use runtime::{Cache, Tool};
use std::path::Path;
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
    fn start(place: &Place, overlay: &Path, seed: u64) -> Result<Self> {
        let program = std::env::current_exe().context("where am I?")?;
        let child = Command::new(program)
            .arg("--deploy")
            .arg(place.deploy()?)
            .arg("--run-dir")
            .arg(place.run_dir()?)
            .args(["up", "--sim", "--quiet", "--seed", &seed.to_string()])
            .arg("--overlay")
            .arg(overlay)
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
        // What only shows something may still be built, and flies nothing.
        let rows = rows.map(|mut rows| {
            rows.retain(|row| row.criticality != "comfort");
            rows
        });
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

/// Another drone than the one that is measured: started, sent on its round and stopped with the demo.
struct Companion {
    place: Place,
    system: System,
}

impl Companion {
    fn start(place: &Place, berth: &Berth, seed: u64) -> Result<Self> {
        let mut run_dir = place.run_dir()?.into_os_string();
        run_dir.push(format!("-{}", berth.name));
        let place = Place { run_dir: Some(run_dir.into()), ..place.clone() };
        let mut system = System::start(&place, &berth.overlay, seed)?;
        wait_until_ready(&place, &mut system)?;
        Ok(Self { place, system })
    }

    /// Sends it on its round, as an operator does.
    fn send(&self) -> Result<()> {
        let (manifest, _, run_dir) = self.place.running()?;
        let mut tool = Tool::join("cli", manifest, &run_dir)?;
        let mut orders = Orders::open(&mut tool.ports)?;
        let mut state = tool.ports.input::<PilotState>()?;
        let began = Instant::now();
        while began.elapsed() < READY {
            orders.give(Verb::PatrolStart, f32::NAN, f32::NAN, next_order_number());
            let again = Instant::now();
            while again.elapsed() < ORDER_AGAIN {
                tool.tick();
                while let Some(state) = state.receive() {
                    if state.arm == 1 {
                        return Ok(());
                    }
                }
                std::thread::sleep(GLANCE);
            }
        }
        bail!("the pilot of {} does not start its round", run_dir.path().display())
    }
}

pub(crate) fn run(place: &Place, demo: &Demo, json: bool) -> Result<ExitCode> {
    let stop = Interrupt::catch()?;
    let state = demo.state.clone().unwrap_or_else(crate::room::state_directory);
    let mut room = Room::prepare(place, state, usize::from(demo.drones))?;
    let Some((first, others)) = room.berths.split_first() else { bail!("a demo needs a drone") };
    let mut system = System::start(place, &first.overlay, demo.seed)?;
    wait_until_ready(place, &mut system)?;
    let companions = others
        .iter()
        .zip(1..)
        .map(|(berth, k)| Companion::start(place, berth, demo.seed.wrapping_add(k)))
        .collect::<Result<Vec<_>>>()?;
    let mut kills = (demo.kills > 0)
        .then(|| Ok::<_, anyhow::Error>(Kills::new(place.run_dir()?, demo.kills, demo.seed)))
        .transpose()?;
    for companion in &companions {
        companion.send()?;
    }
    let mut page = (!demo.once).then_some(&mut room);
    let flown = fly(place, demo, kills.as_mut(), page.as_deref_mut(), &stop, json);
    let shown = flown.and_then(|flown| {
        let Some((report, picture)) = flown else {
            // Somebody changed the building from the page: there is no round to report on.
            if !json {
                println!("\nThe drone was started anew on the way: this round is not measured.");
            }
            return Ok(None);
        };
        std::fs::write(&demo.picture, picture).with_context(|| demo.picture.display().to_string())?;
        show(&report, demo, kills.as_ref(), json)?;
        Ok(Some(report))
    });
    if let (Ok(_), Some(room)) = (&shown, page) {
        stay(room, &mut system, &stop, json);
    }
    for companion in companions {
        companion.system.stop(&companion.place)?;
    }
    system.stop(place)?;
    let Some(report) = shown? else { return Ok(ExitCode::SUCCESS) };
    let good = report.outcome == Outcome::LandedOnPad
        && report.contacts == 0
        && kills.as_ref().is_none_or(Kills::shrugged_off);
    Ok(if good || !demo.once { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The round is over, and the drone is the guard's until Ctrl-C.
fn stay(room: &mut Room, system: &mut System, stop: &Interrupt, json: bool) {
    if !json {
        println!(
            "\nThe drone is yours now, from the page or by `sereno`; Ctrl-C lands it and ends the demo."
        );
    }
    while !stop.came() && matches!(system.0.try_wait(), Ok(None)) {
        tell(room, json);
        std::thread::sleep(ORDER_AGAIN / 10);
    }
}

/// Passes on what the console says, and starts it as soon as it is built.
fn tell(room: &mut Room, json: bool) {
    if let Err(error) = room.open() {
        eprintln!("no page: {error:#}");
    }
    for line in room.said() {
        if json {
            println!("{}", serde_json::json!({ "console": line }));
        } else {
            println!("  >> {line}");
        }
    }
    if let Some(end) = room.ended() {
        eprintln!("{end}");
    }
}

/// Flies one round among processes that run already; `None` when the system was started anew on the way by somebody at the
/// page, and nothing was measured.
///
/// # Errors
/// Also when the simulator was started again and nobody is at the page: the drone then stands on the pad of a new world.
fn fly(
    place: &Place,
    demo: &Demo,
    mut kills: Option<&mut Kills>,
    mut room: Option<&mut Room>,
    stop: &Interrupt,
    json: bool,
) -> Result<Option<(FlightReport, String)>> {
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
            if room.is_some() {
                return Ok(None);
            }
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
            if let Some(room) = room.as_deref_mut() {
                tell(room, json);
            }
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
    Ok(Some((score.report, drawn)))
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
