//! What the drone says of itself, and its plan as a picture: made once, at the start.

use crate::config::BridgeConfig;
use crate::form::{Form, encoding, type_name};
use crate::revision::BuildingFiles;
use floorplan::{Area, NamedArea, PlanHeader, Sidecar};
use ipc_types::{Message, TopicVisitor, visit_topic};
use runtime::{Start, StartError};
use serde_json::{Value, json};
use std::io::Cursor;
use std::path::Path;

/// Everything that can be asked for and does not change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct About {
    /// `sereno/<drone>/about`.
    pub json: String,
    /// `sereno/<drone>/plan`.
    pub plan: Vec<u8>,
}

fn corners(area: &Area) -> Vec<[f32; 2]> {
    match area {
        Area::Rectangle([ax, ay, bx, by]) => vec![[*ax, *ay], [*bx, *ay], [*bx, *by], [*ax, *by]],
        Area::Polygon(corners) => corners.iter().map(|(x, y)| [*x, *y]).collect(),
    }
}

fn areas(areas: &[NamedArea]) -> Vec<Value> {
    areas.iter().map(|area| json!({ "name": area.name, "corners": corners(&area.area) })).collect()
}

/// The side file in the file's own words: 0.2 stays 0.2, where a number of single precision would become 0.20000000298.
fn building(sidecar: &Sidecar) -> Value {
    let text = serde_json::to_string(sidecar).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

struct Row<'a> {
    topic: &'a str,
    hz: f64,
}

impl TopicVisitor for Row<'_> {
    type Output = Value;
    fn visit<T: Message>(&mut self) -> Value {
        json!({
            "topic": self.topic, "type": type_name::<T>(), "layout": format!("{:016x}", T::LAYOUT),
            "encoding": encoding::<T>(), "form": Form::of::<T>().word(), "hz": self.hz,
        })
    }
}

impl About {
    /// Puts together what is known at the start; `topics` are those that leave.
    ///
    /// # Errors
    /// When the plan cannot be read.
    pub fn new(start: &Start, config: &BridgeConfig, topics: &[String]) -> Result<Self, StartError> {
        let plan = start.plan()?;
        let sidecar = start.sidecar()?;
        let (origin_x, origin_y) = plan.origin();
        let rows: Vec<Value> = topics
            .iter()
            .filter_map(|topic| {
                let hz = config.period_ns(topic).map_or(0.0, |period| 1e9 / period as f64);
                visit_topic(topic, &mut Row { topic, hz })
            })
            .collect();
        let doors: Vec<Value> =
            sidecar.doors.iter().map(|door| json!({ "name": door.name, "a": door.a, "b": door.b })).collect();
        let sonars: Vec<Value> = start
            .vehicle
            .sonars
            .iter()
            .map(|sonar| {
                json!({
                    "name": sonar.name, "bearing_rad": sonar.bearing_rad, "elevation_rad": sonar.elevation_rad,
                    "x_m": sonar.x_m, "y_m": sonar.y_m, "z_m": sonar.z_m, "group": sonar.group,
                    "min_range_m": sonar.min_range_m, "max_range_m": sonar.max_range_m,
                })
            })
            .collect();
        let vehicle = &start.vehicle;
        let files = BuildingFiles {
            header: start.root.join(&start.system.plan),
            sidecar: start.root.join(start.sidecar_name()),
        };
        let json = json!({
            "name": start.system.name,
            "version": env!("CARGO_PKG_VERSION"),
            "simulated": start.simulated,
            "plan": {
                "file": start.system.plan,
                "hash": format!("{:016x}", plan.hash()),
                "width": plan.width(),
                "height": plan.height(),
                "resolution_m": plan.resolution(),
                // The lower left corner of the picture.
                "origin_x_m": origin_x,
                "origin_y_m": origin_y,
            },
            // What a change of it must say that it was made from.
            "revision": files.revision().map_err(StartError::invalid)?,
            "building": building(&Sidecar { pad: start.pad()?, ..sidecar.clone() }),
            "pad": start.pad()?.map(|pad| json!({ "x_m": pad.x, "y_m": pad.y, "heading_rad": pad.heading_rad() })),
            "rooms": areas(&sidecar.rooms),
            "doors": doors,
            "no_fly": areas(&sidecar.no_fly),
            "vehicle": {
                "name": vehicle.name,
                "radius_m": vehicle.body.radius_m,
                "height_m": vehicle.body.height_m,
                "battery": {
                    "cells": vehicle.battery.cells,
                    "capacity_mah": vehicle.battery.capacity_mah,
                    "full_cell_v": vehicle.battery.full_cell_v,
                    "empty_cell_v": vehicle.battery.empty_cell_v,
                },
                "flow": vehicle.flow.is_some(),
                "sonars": sonars,
            },
            "topics": rows,
        });
        Ok(Self { json: json.to_string(), plan: picture(start)? })
    }
}

/// The plan's picture as PNG, pixel for pixel.
fn picture(start: &Start) -> Result<Vec<u8>, StartError> {
    let name = &start.system.plan;
    let header = PlanHeader::parse(name, &start.read(name)?).map_err(StartError::invalid)?;
    let file = Path::new(name).parent().unwrap_or(Path::new("")).join(&header.image);
    let bytes = start.read(&file.to_string_lossy())?;
    if bytes.starts_with(b"\x89PNG") {
        return Ok(bytes);
    }
    let wrong = |error: image::ImageError| StartError::invalid(format!("{}: {error}", file.display()));
    let mut png = Vec::new();
    let picture = image::load_from_memory(&bytes).map_err(wrong)?.to_luma8();
    picture.write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png).map_err(wrong)?;
    Ok(png)
}
