//! Checks before anything flies.

use anyhow::{Result, bail};
use cli::place::Place;
use runtime::{Cache, Service, Start, Validate};
use std::path::Path;
use std::process::ExitCode;

pub(crate) fn graph(place: &Place, json: bool) -> Result<ExitCode> {
    let (manifest, _) = place.manifest(false)?;
    if json {
        let rows: Vec<_> = manifest
            .topics()
            .iter()
            .map(|topic| {
                serde_json::json!({ "topic": topic.name, "publishers": topic.publishers,
                    "subscribers": topic.subscribers })
            })
            .collect();
        println!("{}", serde_json::Value::from(rows));
    } else {
        print!("{}", manifest.graph());
    }
    Ok(ExitCode::SUCCESS)
}

/// Manifest, every configuration, the vehicle, the plan and its pad.
pub(crate) fn check(place: &Place, json: bool) -> Result<ExitCode> {
    let mut said = Vec::new();
    for sim in [false, true] {
        let (manifest, root) = place.manifest(sim)?;
        said.push(format!("{}: {} services hold together", manifest.file, manifest.services.len()));
        config::<sonar::Sonar>(&manifest, &root)?;
        config::<flow::Flow>(&manifest, &root)?;
        config::<flight::Flight>(&manifest, &root)?;
        config::<localization::Localization>(&manifest, &root)?;
        config::<navigation::Navigation>(&manifest, &root)?;
        config::<pilot::Pilot>(&manifest, &root)?;
        config::<bridge::Bridge>(&manifest, &root)?;
        if sim {
            config::<simulator::Simulator>(&manifest, &root)?;
        }
        let start = Start::new(manifest.system.clone(), &root, 0, 0, sim, Cache::default())?;
        said.push(format!("{}: {} sonars", start.system.vehicle, start.vehicle.sonars.len()));
        let plan = start.plan()?;
        said.push(format!(
            "{}: {} x {} cells of {} m",
            start.system.plan,
            plan.width(),
            plan.height(),
            plan.resolution()
        ));
        said.extend(reach(&start)?);
    }
    said.dedup();
    if json {
        println!("{}", serde_json::json!({ "ok": true, "checked": said }));
    } else {
        for line in said {
            println!("ok  {line}");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether the vehicle fits on the pad, and which rooms it cannot get to.
fn reach(start: &Start) -> Result<Vec<String>> {
    let atlas = navigation::atlas_of(start)?;
    let name = start.sidecar_name();
    let Some((x, y)) = atlas.pad() else {
        return Ok(vec![format!(
            "{name}: names no pad: the localization configuration must say where the drone starts"
        )]);
    };
    let (needed, free) = (start.vehicle.body.radius_m, atlas.field().distance(x, y));
    if free < needed {
        bail!(
            "{name}: pad ({x}, {y}) is {free:.2} m from what is not free on the plan; {} needs {needed:.2} m",
            start.system.vehicle
        );
    }
    let Some(left_out) = atlas.left_out() else {
        bail!("{name}: from the pad ({x}, {y}) there is no way to anywhere");
    };
    let rooms = atlas.rooms().len();
    let mut said =
        vec![format!("{name}: {} of {rooms} rooms can be reached from the pad", rooms - left_out.len())];
    said.extend(left_out.iter().map(|(room, reason)| format!("{name}: left out: {room}: {reason}")));
    Ok(said)
}

fn config<S: Service>(manifest: &manifest::Manifest, root: &Path) -> Result<()> {
    let Some(entry) = manifest.services.get(S::NAME) else { return Ok(()) };
    if entry.config.is_empty() {
        S::Config::default().validate()?;
        return Ok(());
    }
    let path = root.join(&entry.config);
    let text = std::fs::read_to_string(&path)
        .map_err(|reason| runtime::StartError::Read { path: path.display().to_string(), reason })?;
    runtime::parse_config::<S::Config>(&entry.config, &text)?;
    Ok(())
}
