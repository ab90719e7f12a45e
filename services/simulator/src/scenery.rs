//! The simulated camera's picture, in a process of its own: rendering takes milliseconds, for which the world must not wait.

use crate::{Config, build_world};
use airframe::acoustics::Pose6;
use airframe::camera::{Camera, Canvas, Figure, Lens, Moment, bar_code};
use ipc_types::{Format, MAX_PEOPLE, Picture, Text, View};
use manifest::System;
use runtime::{Cache, Input, Output, Ports, Service, Start, StartError};
use std::fmt::Write;
use std::path::PathBuf;

/// Renders what the simulator's views show.
pub struct Scenery {
    views: Input<View>,
    pictures: Output<Picture>,
    config: Config,
    lens: Lens,
    place: (System, PathBuf, Cache),
    /// The world of a seed, seen by its camera; `Err` says why there is none.
    camera: Option<(u64, Result<Camera, String>)>,
    rendered: u64,
    refused: u64,
}

impl Service for Scenery {
    const NAME: &'static str = "scenery";
    type Config = Config;

    fn start(config: Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        if !start.simulated {
            return Err(StartError::invalid("scenery starts in a simulated system only"));
        }
        let mount = start.vehicle.camera.as_ref().ok_or_else(|| {
            StartError::Invalid(format!(
                "{} has no [camera]: there is nothing to render",
                start.system.vehicle
            ))
        })?;
        Ok(Self {
            views: ports.input()?,
            pictures: ports.output()?,
            config,
            lens: Lens::from(mount),
            place: (start.system.clone(), start.root.clone(), start.cache.clone()),
            camera: None,
            rendered: 0,
            refused: 0,
        })
    }

    fn step(&mut self, _now: u64) {
        // Of several the newest: a picture that is late is worth nothing.
        let Some(view) = self.views.latest() else { return };
        if self.camera.as_ref().is_none_or(|(seed, _)| *seed != view.seed) {
            self.camera = Some((view.seed, self.look_at_world(view.seed)));
        }
        let Some((_, Ok(camera))) = &mut self.camera else { return };
        let format = Format { width: view.width, height: view.height, fps: 1, bitrate: 50_000 };
        if !format.is_valid() || view.people_used as usize > MAX_PEOPLE {
            self.refused += 1;
            return;
        }
        let Some(mut picture) = self.pictures.loan() else { return };
        picture.capture_ns = view.capture_ns;
        picture.frame = view.frame;
        picture.width = view.width;
        picture.height = view.height;
        picture.stride = view.width;
        picture.monochrome = u32::from(self.config.camera.is_night());
        if render(camera, &view, &mut picture, self.config.camera.bar_code) {
            picture.send();
            self.rendered += 1;
        } else {
            self.refused += 1;
        }
    }

    fn status(&self, text: &mut Text<96>) {
        // What does not fit is cut off.
        let _ = match &self.camera {
            Some((_, Err(why))) => write!(text, "nothing to see: {why}"),
            _ => write!(text, "{} pictures", self.rendered),
        };
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}

impl Scenery {
    fn look_at_world(&self, seed: u64) -> Result<Camera, String> {
        let (system, root, cache) = &self.place;
        let start = Start::new(system.clone(), root, seed, 0, true, cache.clone());
        let world = start.and_then(|start| build_world(&self.config, &start));
        world
            .map(|world| Camera::new(&world, self.lens, self.config.camera.light()))
            .map_err(|error| error.to_string())
    }
}

fn render(camera: &mut Camera, view: &View, picture: &mut Picture, with_code: bool) -> bool {
    let mut people = [Figure::default(); MAX_PEOPLE];
    for (figure, person) in people.iter_mut().zip(&view.people) {
        *figure =
            Figure { x: person.x_m, y: person.y_m, height: person.height_m, heading: person.heading_rad };
    }
    let moment = Moment {
        pose: Pose6 {
            x: view.x_m,
            y: view.y_m,
            z: view.z_m,
            roll: view.roll_rad,
            pitch: view.pitch_rad,
            yaw: view.yaw_rad,
        },
        time_s: view.time_s,
        people: people.get(..view.people_used as usize).unwrap_or(&people),
        doors_shut: view.doors_shut,
        noise: runtime::mix_seed(view.seed, view.frame),
    };
    let (width, height, stride) = (picture.width as usize, picture.height as usize, picture.stride as usize);
    let Some(planes) = picture.planes_mut() else { return false };
    let mut canvas = Canvas { width, height, stride, planes };
    if !camera.draw(&moment, &mut canvas) {
        return false;
    }
    if with_code {
        // The low 32 bits of microseconds; a picture too small for it has none.
        let _ = bar_code::draw(canvas.planes[0], stride, width, height, (view.capture_ns / 1000) as u32);
    }
    true
}
