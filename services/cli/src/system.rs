//! Commands about the services, over the supervisor's own socket.

use crate::arguments::Up;
use anyhow::{Context, Result};
use cli::place::Place;
use std::io::Write;
use std::process::ExitCode;
use std::time::Duration;
use supervisor::protocol::ServiceRow;
use supervisor::{Client, Echo};

/// A service that does not come up within this time is reported.
const PATIENCE: Duration = Duration::from_secs(30);
/// A landing from any height and the end of all services.
const DOWN_PATIENCE: Duration = Duration::from_secs(90);

pub(crate) fn up(place: &Place, up: &Up, json: bool) -> Result<ExitCode> {
    let mut manifests = place.manifest_files(up.sim)?;
    for overlay in &up.overlays {
        manifests.push(std::path::absolute(overlay)?);
    }
    if up.sim && up.overlays.is_empty() {
        own_certificates(place)?;
    }
    let options = supervisor::Options {
        manifests,
        run_dir: Some(place.run_dir()?),
        logs: up.logs.clone(),
        seed: up.seed,
        echo: match (up.quiet, json) {
            (true, _) => Echo::Silent,
            (false, true) => Echo::Json,
            (false, false) => Echo::Text,
        },
        ..supervisor::Options::default()
    };
    supervisor::run(&options)?;
    if json {
        // Whoever listened may have gone before the system.
        let _ = writeln!(std::io::stdout(), "{{\"stopped\":true}}");
    }
    Ok(ExitCode::SUCCESS)
}

/// Whoever only simulates needs no installation: the certificates without which the bridge stays silent are made here.
fn own_certificates(place: &Place) -> Result<()> {
    let (manifest, root) = place.manifest(true)?;
    let Some(entry) = manifest.services.get("bridge") else { return Ok(()) };
    let file = root.join(&entry.config);
    let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    let config: bridge::BridgeConfig = runtime::parse_config(&entry.config, &text)?;
    let endpoint = config.listen.first().cloned().unwrap_or_else(|| "tls/127.0.0.1:7447".to_owned());
    let directory = root.join(&config.certificates);
    if bridge::Authority::at(&directory).exists() {
        return Ok(());
    }
    if let Err(error) =
        crate::room::certificates(&directory, std::slice::from_ref(&manifest.system.name), &[endpoint])
    {
        // It flies without anybody who watches from elsewhere.
        eprintln!("no certificates, so the bridge will not start: {error:#}");
    }
    Ok(())
}

fn client(place: &Place) -> Result<Client> {
    Ok(Client::connect(&place.run_dir()?)?)
}

fn print_rows(rows: &[ServiceRow]) {
    println!(
        "{:<14} {:<9} {:>8} {:>8} {:>9} {:>5}  what it says",
        "service", "state", "pid", "restarts", "up s", "late"
    );
    for row in rows {
        let pid = row.pid.map_or_else(|| "-".to_owned(), |pid| pid.to_string());
        let age = row.age_s.map_or_else(|| "-".to_owned(), |age| format!("{age:.1}"));
        let says = if row.status.is_empty() { &row.last_end } else { &row.status };
        println!(
            "{:<14} {:<9} {pid:>8} {:>8} {age:>9} {:>5}  {says}",
            row.name, row.state, row.restarts, row.missed_deadlines
        );
    }
}

pub(crate) fn ps(place: &Place, json: bool) -> Result<ExitCode> {
    let overview = client(place)?.ps()?;
    if json {
        println!("{}", serde_json::to_string(&overview)?);
    } else {
        print_rows(&overview.services);
        println!("{}, {}", overview.phase, if overview.airborne { "in the air" } else { "on the ground" });
        match overview.warden {
            Some(pid) => println!("warden: process {pid}"),
            None => println!("warden: none now; the supervisor is starting another"),
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn show(row: &ServiceRow, json: bool) -> Result<ExitCode> {
    if json {
        println!("{}", serde_json::to_string(row)?);
    } else {
        println!("{} is {}", row.name, row.state);
    }
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn restart(place: &Place, service: &str, in_flight: bool, json: bool) -> Result<ExitCode> {
    show(&client(place)?.restart(service, in_flight, PATIENCE)?, json)
}

pub(crate) fn reload(place: &Place, json: bool) -> Result<ExitCode> {
    let overview = client(place)?.reload(PATIENCE)?;
    if json {
        println!("{}", serde_json::to_string(&overview)?);
    } else {
        print_rows(&overview.services);
    }
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn hold(place: &Place, service: &str, in_flight: bool, json: bool) -> Result<ExitCode> {
    show(&client(place)?.hold(service, in_flight, PATIENCE)?, json)
}

pub(crate) fn release(place: &Place, service: &str, json: bool) -> Result<ExitCode> {
    show(&client(place)?.release(service, PATIENCE)?, json)
}

pub(crate) fn logs(place: &Place, service: &str, lines: usize, json: bool) -> Result<ExitCode> {
    let lines = client(place)?.logs(service, lines)?;
    if json {
        println!("{}", serde_json::to_string(&lines)?);
    } else {
        for line in lines {
            println!("{line}");
        }
    }
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn down(place: &Place, now: bool, json: bool) -> Result<ExitCode> {
    client(place)?.stop(now, DOWN_PATIENCE)?;
    println!("{}", if json { "{\"stopped\":true}" } else { "stopped" });
    Ok(ExitCode::SUCCESS)
}
