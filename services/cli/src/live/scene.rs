//! Messages of topics as Foxglove's well-known ones. Pure. Frames: `plan` (REP-103, the plan's own) and `drone` (its body, level).

use floorplan::Plan;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    Color, CompressedVideo, Duration, FrameTransform, Grid, LinePrimitive, PackedElementField, Point3, Pose,
    PoseInFrame, PosesInFrame, Quaternion, SceneEntity, SceneUpdate, Timestamp, TriangleListPrimitive,
    Vector2, Vector3, line_primitive,
};
use ipc_types::{Particles, SonarStatus, Video};
use serde_json::Value;
use std::f64::consts::{FRAC_PI_4, TAU};

pub(crate) const PLAN: &str = "plan";
pub(crate) const DRONE: &str = "drone";
/// Particles that are shown at most.
const MOST_PARTICLES: usize = 1000;
/// Corners of a round that are shown at most.
const MOST_WAYPOINTS: usize = 1024;
/// Half of a sonar's cone (DESIGN 6: about 30 degrees).
const HALF_CONE: f64 = TAU / 24.0;
/// An echo is shown until its sensor has had its turn thrice.
const ECHO_LASTS_NS: u32 = 600_000_000;
/// Sides of an arc and of an ellipse.
const ARC: u32 = 8;
const ELLIPSE: u32 = 36;

const LAMP: Color = Color { r: 1.0, g: 0.72, b: 0.3, a: 1.0 };
const ROUTE: Color = Color { r: 0.5, g: 0.65, b: 0.94, a: 1.0 };
const FLOWN: Color = Color { r: 0.5, g: 0.65, b: 0.94, a: 0.35 };
const SONAR: Color = Color { r: 0.5, g: 0.82, b: 1.0, a: 0.35 };

/// Where the drone is, as far as that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) z_m: f64,
    pub(crate) heading_rad: f64,
    /// What the compass reads, as the particles mean it.
    pub(crate) compass_rad: f64,
}

impl Place {
    /// From `localization/pose`; `None` while it is no place on the plan. `z_m` is what the down sonar says.
    ///
    /// # Errors
    /// Which field is none.
    pub(crate) fn of(pose: &Value, z_m: f64) -> Result<Option<Self>, &'static str> {
        let number = |key: &str| pose[key].as_f64().filter(|number| number.is_finite());
        if pose["searching"].as_u64().ok_or("searching is no whole number")? != 0 {
            return Ok(None);
        }
        let heading_rad = number("heading_rad").ok_or("heading_rad is no number")?;
        let compass_rad = heading_rad - number("heading_offset_rad").unwrap_or(0.0);
        let (x_m, y_m) = (number("x_m").ok_or("x_m is no number")?, number("y_m").ok_or("y_m is no number")?);
        Ok(Some(Self { x_m, y_m, z_m, heading_rad, compass_rad }))
    }

    fn pose(&self) -> Pose {
        pose(self.x_m, self.y_m, self.z_m, self.heading_rad)
    }
}

pub(crate) fn timestamp(unix_ns: u64) -> Timestamp {
    let second = 1_000_000_000;
    // Until 2106, as the message itself.
    Timestamp::new(u32::try_from(unix_ns / second).unwrap_or(u32::MAX), (unix_ns % second) as u32)
}

fn turned(heading_rad: f64) -> Quaternion {
    Quaternion { x: 0.0, y: 0.0, z: (0.5 * heading_rad).sin(), w: (0.5 * heading_rad).cos() }
}

fn pose(x: f64, y: f64, z: f64, heading_rad: f64) -> Pose {
    Pose { position: Some(Vector3 { x, y, z }), orientation: Some(turned(heading_rad)) }
}

pub(crate) fn pose_in_frame(place: &Place, at: Timestamp) -> PoseInFrame {
    PoseInFrame { timestamp: Some(at), frame_id: PLAN.to_owned(), pose: Some(place.pose()) }
}

pub(crate) fn transform(place: &Place, at: Timestamp) -> FrameTransform {
    FrameTransform {
        timestamp: Some(at),
        parent_frame_id: PLAN.to_owned(),
        child_frame_id: DRONE.to_owned(),
        translation: Some(Vector3 { x: place.x_m, y: place.y_m, z: place.z_m }),
        rotation: Some(turned(place.heading_rad)),
    }
}

fn entity(id: impl Into<String>, frame: &str, at: Timestamp) -> SceneEntity {
    SceneEntity { timestamp: Some(at), frame_id: frame.to_owned(), id: id.into(), ..SceneEntity::default() }
}

fn line(kind: line_primitive::Type, points: Vec<Point3>, color: Color, thickness: f64) -> LinePrimitive {
    LinePrimitive { r#type: kind.into(), points, color: Some(color), thickness, ..LinePrimitive::default() }
}

/// Two standard deviations each way, by the covariance of `localization/pose`: of a normal distribution, 86 of 100 are in this
/// ellipse.
///
/// # Errors
/// When the covariance is none.
pub(crate) fn uncertainty(
    message: &Value,
    place: &Place,
    at: Timestamp,
) -> Result<SceneUpdate, &'static str> {
    let number = |key: &str| {
        message[key].as_f64().filter(|number| number.is_finite()).ok_or("the covariance is no number")
    };
    let (xx, xy, yy) = (number("variance_x_m2")?, number("covariance_xy_m2")?, number("variance_y_m2")?);
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let root = half.hypot(xy);
    let (major, minor) = (2.0 * (mean + root).max(0.0).sqrt(), 2.0 * (mean - root).max(0.0).sqrt());
    let (sin, cos) = (0.5 * xy.atan2(half)).sin_cos();
    let points = (0..ELLIPSE).map(|k| {
        let (b, a) = (TAU * f64::from(k) / f64::from(ELLIPSE)).sin_cos();
        let (a, b) = (major * a, minor * b);
        Point3 { x: place.x_m + cos * a - sin * b, y: place.y_m + sin * a + cos * b, z: place.z_m }
    });
    let ring = line(line_primitive::Type::LineLoop, points.collect(), LAMP, 0.02);
    let ring = SceneEntity { lines: vec![ring], ..entity("uncertainty", PLAN, at) };
    Ok(SceneUpdate { deletions: Vec::new(), entities: vec![ring] })
}

/// A thousand of the particles at most, each as often as its weight deserves.
pub(crate) fn particles(set: &Particles, compass_rad: f64, at: Timestamp) -> PosesInFrame {
    let count = (set.count as usize).min(set.weight.len());
    let sound = |weight: f32| if weight.is_finite() { f64::from(weight.max(0.0)) } else { 0.0 };
    let columns = set.weight.iter().zip(&set.x_m).zip(&set.y_m).zip(&set.heading_offset_rad).take(count);
    let total: f64 = columns.clone().map(|(((weight, _), _), _)| sound(*weight)).sum();
    let shown = count.min(MOST_PARTICLES);
    let step = total / shown.max(1) as f64;
    let mut poses = Vec::with_capacity(shown);
    let (mut passed, mut next) = (0.0, 0.5 * step);
    for (((weight, x), y), offset) in columns {
        passed += sound(*weight);
        while step > 0.0 && passed > next && poses.len() < shown {
            poses.push(pose(f64::from(*x), f64::from(*y), 0.0, compass_rad + f64::from(*offset)));
            next += step;
        }
    }
    PosesInFrame { timestamp: Some(at), frame_id: PLAN.to_owned(), poses }
}

fn grid(columns: u32, cell_m: f64, corner: (f64, f64), z: f64, data: Vec<u8>, at: Timestamp) -> Grid {
    let field =
        PackedElementField { name: "occupied".to_owned(), offset: 0, r#type: NumericType::Uint8.into() };
    Grid {
        timestamp: Some(at),
        frame_id: PLAN.to_owned(),
        pose: Some(pose(corner.0, corner.1, z, 0.0)),
        column_count: columns,
        cell_size: Some(Vector2 { x: cell_m, y: cell_m }),
        row_stride: columns,
        cell_stride: 1,
        fields: vec![field],
        data: data.into(),
    }
}

/// The plan, below everything: 255 wall, 128 unknown, 0 free.
pub(crate) fn plan(plan: &Plan, at: Timestamp) -> Grid {
    let (width, height) = (plan.width(), plan.height());
    let cells = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let data = cells.map(|(x, y)| match plan.cell(x, y) {
        floorplan::Cell::Free => 0,
        floorplan::Cell::Unknown => 128,
        floorplan::Cell::Occupied => 255,
    });
    let origin = plan.origin();
    let corner = (f64::from(origin.0), f64::from(origin.1));
    let columns = u32::try_from(width).unwrap_or(0);
    grid(columns, f64::from(plan.resolution()), corner, -0.02, data.collect(), at)
}

/// What stands around the drone, of `navigation/grid`.
pub(crate) fn certainty(message: &ipc_types::Grid, at: Timestamp) -> Grid {
    let corner = (f64::from(message.origin_x_m), f64::from(message.origin_y_m));
    grid(
        message.cells.len().isqrt() as u32,
        f64::from(message.cell_m),
        corner,
        -0.01,
        message.cells.to_vec(),
        at,
    )
}

/// The echoes of one group, as cones in the drone's frame; and the height over the ground, if one looked down.
///
/// # Errors
/// Which field is none.
pub(crate) fn sonar(message: &Value, at: Timestamp) -> Result<(SceneUpdate, Option<f64>), &'static str> {
    let readings = message["readings"].as_array().ok_or("readings is no list")?;
    let count = message["count"].as_u64().ok_or("count is no whole number")?;
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let mut height_m = None;
    let mut entities = Vec::new();
    for reading in readings.iter().take(count) {
        let number = |key: &str| reading[key].as_f64().filter(|number| number.is_finite());
        let ok = reading["status"].as_u64() == Some(SonarStatus::Ok.code().into());
        let values = (number("range_m"), number("bearing_rad"), number("elevation_rad"));
        let ((Some(range), Some(bearing), Some(elevation)), true) = (values, ok) else { continue };
        let mount = |key: &str| number(key).unwrap_or(0.0);
        let from = Point3 { x: mount("mount_x_m"), y: mount("mount_y_m"), z: mount("mount_z_m") };
        if elevation < -FRAC_PI_4 {
            height_m = Some(range - from.z);
        }
        let id = format!("sonar {}", reading["sensor"].as_u64().unwrap_or(0));
        let cone = SceneEntity {
            lifetime: Some(Duration::new(0, ECHO_LASTS_NS)),
            frame_locked: true,
            triangles: vec![fan(&from, bearing, elevation, range)],
            ..entity(id, DRONE, at)
        };
        entities.push(cone);
    }
    Ok((SceneUpdate { deletions: Vec::new(), entities }, height_m))
}

/// A flat cone: across the axis in the plane that turns about the body's up.
fn fan(from: &Point3, bearing: f64, elevation: f64, range: f64) -> TriangleListPrimitive {
    let edge = |k: u32| {
        let aside = HALF_CONE * (2.0 * f64::from(k) / f64::from(ARC) - 1.0);
        // Along the axis, then to its left.
        let (across, along) = aside.sin_cos();
        let (up, out) = elevation.sin_cos();
        let (left, ahead) = bearing.sin_cos();
        Point3 {
            x: from.x + range * (along * out * ahead - across * left),
            y: from.y + range * (along * out * left + across * ahead),
            z: from.z + range * along * up,
        }
    };
    let points = (0..ARC).flat_map(|k| [*from, edge(k), edge(k + 1)]).collect();
    TriangleListPrimitive { points, color: Some(SONAR), ..TriangleListPrimitive::default() }
}

/// The round of `navigation/patrol`: what has been flown, faint, and what is still to be.
///
/// # Errors
/// Which field is none.
pub(crate) fn route(message: &Value, at: Timestamp) -> Result<SceneUpdate, &'static str> {
    let points: Vec<Point3> = message["waypoints"]
        .as_array()
        .ok_or("waypoints is no list")?
        .iter()
        .take(MOST_WAYPOINTS)
        .filter_map(|point| Some(Point3 { x: point["x_m"].as_f64()?, y: point["y_m"].as_f64()?, z: 0.05 }))
        .collect();
    let next = message["next"].as_u64().and_then(|next| usize::try_from(next).ok()).unwrap_or(0);
    let flown: Vec<_> = points.iter().take(next.saturating_add(1)).copied().collect();
    let ahead: Vec<_> = points.iter().skip(next).copied().collect();
    let strip = |points: Vec<Point3>, color| line(line_primitive::Type::LineStrip, points, color, 0.04);
    let lines = [(flown, FLOWN), (ahead, ROUTE)];
    let lines = lines.into_iter().filter(|(points, _)| points.len() > 1);
    let lines = lines.map(|(points, color)| strip(points, color)).collect();
    let round = SceneEntity { lines, ..entity("round", PLAN, at) };
    Ok(SceneUpdate { deletions: Vec::new(), entities: vec![round] })
}

/// One access unit, of a message of which `heard` bytes came; `None` if they end before it does.
pub(crate) fn video(message: &Video, heard: usize, at: Timestamp) -> Option<CompressedVideo> {
    let length = message.length as usize;
    if heard < std::mem::offset_of!(Video, bytes).checked_add(length)? {
        return None;
    }
    let data = message.bytes.as_slice().get(..length)?.to_vec();
    Some(CompressedVideo {
        timestamp: Some(at),
        frame_id: DRONE.to_owned(),
        data: data.into(),
        format: "h264".to_owned(),
    })
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::indexing_slicing, reason = "tests")]
mod tests;
