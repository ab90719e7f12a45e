//! What a camera on the drone sees of the world: a picture in which a person recognises a corridor, a door, a table
//! and somebody who walks.
//!
//! The picture is drawn in software, from the solids that the sonars hear and the airframe touches: faces are projected and
//! filled into a depth buffer (every pixel knows which face it shows and how far away that is), then each pixel is lit and
//! painted. By day lamps on the ceiling shine, each as far as the walls let it; by night only the ring of infra-red lamps
//! around the lens does (the thesis's NoIR camera): no colour, and dark after a few metres.
//!
//! What only a camera sees (door frames, handles, skirting boards, the pattern of the floor, a person's limbs) is added here
//! and is nowhere else: nothing in this module can change a flight.

pub mod bar_code;
mod lamps;
mod look;
mod paint;
mod person;
mod raster;
mod scene;
mod shade;
mod shapes;
#[cfg(test)]
mod tests;

use crate::acoustics::Pose6;
use crate::world::World;
use look::Look;
use raster::Raster;
use scene::Scene;

/// Where a camera sits on the body and how wide it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Forward of the centre of mass, metres.
    pub x_m: f32,
    /// Left of it, metres.
    pub y_m: f32,
    /// Above it, metres.
    pub z_m: f32,
    /// Where it looks above the body's plane, radians.
    pub elevation_rad: f32,
    /// Angle from the left to the right edge of the picture, radians.
    pub field_of_view_rad: f32,
}

impl From<&manifest::CameraMount> for Lens {
    fn from(mount: &manifest::CameraMount) -> Self {
        Self {
            x_m: mount.x_m,
            y_m: mount.y_m,
            z_m: mount.z_m,
            elevation_rad: mount.elevation_rad,
            field_of_view_rad: mount.field_of_view_rad,
        }
    }
}

/// What there is to see by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Light {
    /// The lamps of the building.
    #[default]
    Day,
    /// The drone's own infra-red ring.
    Night,
}

/// A person as a camera sees one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// World frame, metres.
    pub x: f32,
    /// World frame, metres.
    pub y: f32,
    /// From the floor to the top of the head, metres.
    pub height: f32,
    /// Where the person looks, radians from world x.
    pub heading: f32,
}

/// One moment, as the camera finds it.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// The drone's body.
    pub pose: Pose6,
    /// Seconds since the world began: how far somebody's stride has come.
    pub time_s: f64,
    /// Those who walk.
    pub people: &'a [Figure],
    /// Bit = index in [`World::doors`]: shut.
    pub doors_shut: u64,
    /// Of the noise in this picture.
    pub noise: u64,
}

/// An I420 picture to be drawn into: luma, then the two planes of colour with half as many columns and rows.
#[derive(Debug)]
pub struct Canvas<'a> {
    /// Pixels, even.
    pub width: usize,
    /// Pixels, even.
    pub height: usize,
    /// Bytes from one row of luma to the next; half of it for colour.
    pub stride: usize,
    /// Luma, blue difference, red difference.
    pub planes: [&'a mut [u8]; 3],
}

/// A camera in a world.
#[derive(Debug)]
pub struct Camera {
    scene: Scene,
    raster: Raster,
    lens: Lens,
    light: Light,
}

impl Camera {
    /// Looks at a world through a lens. Bakes the lamps' light into the world, which takes a moment.
    #[must_use]
    pub fn new(world: &World, lens: Lens, light: Light) -> Self {
        Self { scene: Scene::of(world), raster: Raster::default(), lens, light }
    }

    /// Draws one picture. False, and nothing is drawn, when the canvas does not hold what its numbers say.
    /// Allocates when the canvas is larger than any before.
    pub fn draw(&mut self, moment: &Moment<'_>, canvas: &mut Canvas<'_>) -> bool {
        let Canvas { width, height, stride, planes } = canvas;
        let luma = *stride * *height;
        let holds = *width >= 16
            && *height >= 16
            && width.is_multiple_of(2)
            && height.is_multiple_of(2)
            && stride.is_multiple_of(2)
            && *stride >= *width
            && planes[0].len() >= luma
            && planes[1].len() >= luma / 4
            && planes[2].len() >= luma / 4;
        if !holds {
            return false;
        }
        let look = Look::new(&moment.pose, &self.lens, *width, *height);
        self.scene.people(moment.people, moment.time_s);
        self.raster.clear(*width, *height);
        self.raster.draw(&self.scene, &look, moment.doors_shut);
        shade::picture(&self.scene, &self.raster, &look, self.light, moment.noise, canvas);
        true
    }
}
