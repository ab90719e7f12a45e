//! `sereno rehearse`: the round, many times, in parallel, measured by the truth.

use crate::arguments::Rehearse;
use airframe::score::{FlightScore, Report, quantile};
use anyhow::{Context, Result, bail};
use cli::building::Building;
use cli::flight::{Flight, Setup};
use cli::place::{Place, vehicle_file};
use indicatif::{ProgressBar, ProgressStyle};
use localization::{FilterKind, LocalizationConfig};
use navigation::config::{Method, NavigationConfig};
use runtime::{Cache, Start};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Longest flight, simulated seconds: past any battery.
const PATIENCE_S: f64 = 1800.0;

fn absolute(path: &Path) -> Result<String> {
    Ok(std::path::absolute(path)?.display().to_string())
}

/// What is flown with, and what a reader of the figures must know.
fn setup(place: &Place, order: &Rehearse) -> Result<(Setup, Vec<String>)> {
    let (mut manifest, root) = place.manifest(true)?;
    if let Some(plan) = &order.plan {
        manifest.system.plan = absolute(plan)?;
        // A world file describes one building; another plan comes without.
        manifest.system.world = String::new();
    }
    if let Some(world) = &order.world {
        manifest.system.world = absolute(world)?;
    }
    manifest.system.vehicle = vehicle_file(&root, &order.vehicle)?;
    let entry = manifest.services.get("simulator").context("the manifest has no simulator")?;
    let text = std::fs::read_to_string(root.join(&entry.config)).with_context(|| entry.config.clone())?;
    let mut simulator: simulator::Config = runtime::parse_config(&entry.config, &text)?;
    order.clutter.clone_into(&mut simulator.clutter);
    simulator.displaced_m = order.displaced;
    if let Some(firmware) = &order.firmware {
        firmware.clone_into(&mut simulator.firmware);
    }
    simulator.magnetometer &= !order.no_magnetometer;
    runtime::Validate::validate(&simulator)?;
    if let Some(speed) = order.speed
        && !(0.1..=1.5).contains(&speed)
    {
        bail!("--speed {speed} is out of range: allowed is 0.1..=1.5 m/s");
    }
    let entry = manifest.services.get("navigation").context("the manifest has no navigation")?;
    let text = std::fs::read_to_string(root.join(&entry.config)).with_context(|| entry.config.clone())?;
    let mut navigation: NavigationConfig = runtime::parse_config(&entry.config, &text)?;
    if let Some(speed) = order.speed {
        navigation.cruise_m_s = speed as f32;
    }
    let method = order.method()?;
    if let Some(method) = method {
        navigation.avoid = method;
    }
    let mut localization = None;
    if let Some(filter) = order.filter {
        let entry = manifest.services.get("localization").context("the manifest has no localization")?;
        let text = std::fs::read_to_string(root.join(&entry.config)).with_context(|| entry.config.clone())?;
        let config: LocalizationConfig = runtime::parse_config(&entry.config, &text)?;
        localization = Some(LocalizationConfig { filter, ..config });
    }
    let cache = Cache::default();
    let start = Start::new(manifest.system.clone(), &root, 0, 0, true, cache.clone())?;
    let Building { pad, mut remarks } = Building::survey(&start, order.pad)?;
    if navigation.avoid != Method::default() {
        remarks.push(format!("obstacles are avoided by the method \"{}\"", navigation.avoid));
    }
    let usual = simulator::Config::default();
    if simulator.firmware != usual.firmware {
        remarks.push(format!("the flight controller plays {}", simulator.firmware));
    }
    if !simulator.magnetometer {
        remarks.push("the flight controller has no magnetometer".to_owned());
    }
    if order.filter == Some(FilterKind::Thesis) {
        remarks.push("localization by the thesis's plain particle filter".to_owned());
    }
    manifest.system.pad = Some([pad.x, pad.y, pad.heading_deg]);
    // The manifest's own file otherwise, with its hash in the journal.
    let navigation = (order.speed.is_some() || method.is_some()).then_some(navigation);
    let begin = order.start.into();
    let patience_s = PATIENCE_S;
    Ok((Setup { manifest, root, simulator, navigation, localization, begin, patience_s, cache }, remarks))
}

/// A scored flight and how much simulated time it took.
struct Flown {
    score: FlightScore,
    simulated_s: f64,
}

fn fly(setup: &Setup, seed: u64, pictures: Option<&PathBuf>) -> Result<Flown> {
    let mut flight = Flight::start(setup, seed)?;
    flight.fly_round();
    let simulated_s = flight.bus.now() as f64 * 1e-9;
    let Some(directory) = pictures else {
        return Ok(Flown { score: flight.finish(), simulated_s });
    };
    let labels = cli::flight::labels(&setup.manifest, &setup.root)?;
    let (score, drawn) = flight.finish_with_picture(&format!("Rehearsal, seed {seed}"), &labels);
    std::fs::create_dir_all(directory)?;
    std::fs::write(directory.join(format!("flight-{seed}.svg")), drawn)?;
    Ok(Flown { score, simulated_s })
}

pub(crate) fn run(place: &Place, order: &Rehearse, json: bool) -> Result<ExitCode> {
    order.check(json)?;
    let (setup, remarks) = setup(place, order)?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = order.threads.unwrap_or(cores);
    // On standard error, and only where somebody looks at it.
    let progress = ProgressBar::new(order.flights);
    progress.set_style(ProgressStyle::with_template(
        "{bar:30} {pos}/{len} flights, {elapsed} gone, {eta} to go  {msg}",
    )?);

    let next = AtomicU64::new(0);
    let flown: Mutex<Vec<(u64, Flown)>> = Mutex::new(Vec::new());
    let failed: Mutex<Option<anyhow::Error>> = Mutex::new(None);
    let began = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let stop = failed.lock().unwrap_or_else(PoisonError::into_inner).is_some();
                    if k >= order.flights || stop {
                        break;
                    }
                    match fly(&setup, order.seed + k, order.pictures.as_ref()) {
                        Ok(done) => {
                            progress.set_message(format!(
                                "seed {}: {}",
                                order.seed + k,
                                done.score.report.outcome
                            ));
                            flown.lock().unwrap_or_else(PoisonError::into_inner).push((k, done));
                        }
                        Err(error) => *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(error),
                    }
                    progress.inc(1);
                }
            });
        }
    });
    progress.finish_and_clear();
    if let Some(error) = failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let mut flown = flown.into_inner().unwrap_or_else(PoisonError::into_inner);
    flown.sort_by_key(|(k, _)| *k);
    let wall = began.elapsed().as_secs_f64();
    let simulated: f64 = flown.iter().map(|(_, done)| done.simulated_s).sum();
    let scores: Vec<FlightScore> = flown.into_iter().map(|(_, done)| done.score).collect();
    let report = Report { remarks, ..Report::of(scores, simulated / wall.max(1e-9)) };
    write(order, &report, json)?;
    Ok(ExitCode::SUCCESS)
}

fn write(order: &Rehearse, report: &Report, json: bool) -> Result<()> {
    let text = serde_json::to_string_pretty(report)?;
    match &order.out {
        Some(path) => std::fs::write(path, &text).with_context(|| path.display().to_string())?,
        None if json => {
            println!("{text}");
            return Ok(());
        }
        None => {}
    }
    print(report);
    Ok(())
}

fn figure(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
}

fn print(report: &Report) {
    println!(
        "{:>5}  {:<18} {:>8} {:>9} {:>7} {:>7} {:>9} {:>7} {:>7}  remarks",
        "seed", "outcome", "contacts", "clear m", "time s", "way m", "coverage", "err m", "p95 m"
    );
    for flight in &report.flights {
        let mut remarks = flight.failsafes.clone();
        remarks.extend(flight.skipped.iter().map(|skipped| format!("skipped {skipped}")));
        println!(
            "{:>5}  {:<18} {:>8} {:>9.2} {:>7.0} {:>7.0} {:>8.1}% {:>7} {:>7}  {}",
            flight.seed,
            flight.outcome.to_string(),
            flight.contacts,
            flight.min_clearance_m,
            flight.time_s,
            flight.distance_m,
            100.0 * flight.coverage,
            figure(flight.loc_error_m.median),
            figure(flight.loc_error_m.p95),
            remarks.join("; ")
        );
    }
    let total = &report.total;
    println!(
        "{} flights: {} contacts, {} landed on the pad, coverage median {:.1} % p5 {:.1} %, error median {} m \
         p95 {} m max {} m, least clearance {:.2} m, {:.0} times real time",
        total.flights,
        total.contacts,
        total.landed_on_pad,
        100.0 * total.coverage.median,
        100.0 * total.coverage.p5,
        figure(total.loc_error_m.median),
        figure(total.loc_error_m.p95),
        figure(total.loc_error_m.max),
        total.min_clearance_m,
        total.real_time_factor
    );
    let claims = &total.first_claims;
    println!(
        "said to know its place in {} of {} flights, {} s after the take-off in the median, {} s at the 95th percentile; \
         {} of these within 0.5 m",
        claims.made,
        total.flights,
        figure(claims.median_s),
        figure(claims.p95_s),
        claims.right
    );
    let honesty = &total.honesty;
    let hours = honesty.time_s / 3600.0;
    let mut noticed: Vec<f32> = honesty.noticed_s.iter().flatten().map(|s| *s as f32).collect();
    println!(
        "P(lost): of {hours:.2} h {:.3} % wrong by over 1 m at under 1 % ({:.1} s in a row at most); became wrong {} \
         times, {} never noticed, the others after {} s in the median, {} s at the 95th percentile; {:.2} false alarms an hour",
        100.0 * honesty.wrong_while_sure_s / honesty.time_s.max(1e-9),
        honesty.longest_wrong_while_sure_s,
        honesty.noticed_s.len(),
        honesty.noticed_s.len() - noticed.len(),
        figure(quantile(&mut noticed, 0.5).map(f64::from)),
        figure(quantile(&mut noticed, 0.95).map(f64::from)),
        f64::from(honesty.false_alarms) / hours.max(1e-9),
    );
    for class in honesty.calibration.iter().filter(|class| class.time_s > 0.0) {
        println!(
            "  said {:>5.1} to {:>5.1} %: {:>8.1} s, of which {:>6.2} % wrong",
            100.0 * class.from,
            100.0 * class.to,
            class.time_s,
            100.0 * class.wrong_s / class.time_s
        );
    }
    for remark in &report.remarks {
        println!("{remark}");
    }
}
