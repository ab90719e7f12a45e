//! How a message leaves: as JSON or as bytes, cut after what is filled.

use ipc_types::{Field, Message, Particles, Patrol, Still, Video};
use std::fmt::Write;

/// Messages larger than this leave as bytes, however they are asked for.
const MOST_JSON: usize = 4096;
/// The columns of a particle set.
const COLUMNS: usize = 8;

/// How a topic leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// JSON as `sereno topic echo` prints it.
    Json,
    /// JSON without bitmaps, its lists cut after what is filled.
    JsonCut,
    /// The bytes of the message as they lie in shared memory.
    Bytes,
    /// The same, each column cut after `count` values.
    Columns,
    /// The same, cut after `length` bytes of its last field.
    BytesCut,
}

impl Form {
    /// The word of `about`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::JsonCut => "json, cut",
            Self::Bytes => "bytes",
            Self::Columns => "bytes, columns cut",
            Self::BytesCut => "bytes, cut",
        }
    }

    /// How messages of `T` leave.
    #[must_use]
    pub fn of<T: Message>() -> Self {
        match T::TOPIC {
            Particles::TOPIC => Self::Columns,
            Patrol::TOPIC => Self::JsonCut,
            Video::TOPIC | Still::TOPIC => Self::BytesCut,
            _ if size_of::<T>() > MOST_JSON => Self::Bytes,
            _ => Self::Json,
        }
    }

    /// Whether it is text.
    #[must_use]
    pub const fn is_json(self) -> bool {
        matches!(self, Self::Json | Self::JsonCut)
    }
}

/// Name of a message type, as `Pose`.
#[must_use]
pub fn type_name<T: Message>() -> &'static str {
    let path = std::any::type_name::<T>();
    path.rsplit("::").next().unwrap_or(path)
}

/// The encoding that a message of `T` bears.
#[must_use]
pub fn encoding<T: Message>() -> String {
    let media = if Form::of::<T>().is_json() { "application/json" } else { "application/octet-stream" };
    format!("{media};schema=sereno/{}/{:016x}", type_name::<T>(), T::LAYOUT)
}

/// A message as it leaves.
#[must_use]
pub fn encode<T: Message>(message: &T) -> Vec<u8> {
    let bytes = bytemuck::bytes_of(message);
    match Form::of::<T>() {
        Form::Json => {
            let mut text = String::with_capacity(512);
            // Writing into a String cannot fail.
            let _ = message.write_json(&mut text);
            text.into_bytes()
        }
        Form::JsonCut => cast::<T, Patrol>(message).map(patrol_json).unwrap_or_default().into_bytes(),
        Form::Bytes => bytes.to_vec(),
        Form::Columns => cast::<T, Particles>(message).map(particle_columns).unwrap_or_default(),
        Form::BytesCut => {
            let end = cast::<T, Video>(message)
                .map(|video| std::mem::offset_of!(Video, bytes) + video.access_unit().len())
                .or_else(|| {
                    cast::<T, Still>(message)
                        .map(|still| std::mem::offset_of!(Still, bytes) + still.jpeg().len())
                });
            bytes.get(..end.unwrap_or(0)).unwrap_or_default().to_vec()
        }
    }
}

/// The message as what its topic says that it is.
fn cast<T: Message, U: Message>(message: &T) -> Option<&U> {
    bytemuck::try_from_bytes(bytemuck::bytes_of(message)).ok()
}

/// What stands before the columns, then of each column its first `count` values.
fn particle_columns(set: &Particles) -> Vec<u8> {
    let count = (set.count as usize).min(ipc_types::MAX_PARTICLES);
    let head = std::mem::offset_of!(Particles, x_m);
    let mut out = Vec::with_capacity(head + COLUMNS * 4 * count);
    out.extend_from_slice(bytemuck::bytes_of(set).get(..head).unwrap_or_default());
    let columns: [&[f32]; COLUMNS] = [
        &set.x_m,
        &set.y_m,
        &set.velocity_x_m_s,
        &set.velocity_y_m_s,
        &set.heading_offset_rad,
        &set.level_roll_rad,
        &set.level_pitch_rad,
        &set.weight,
    ];
    for column in columns {
        out.extend_from_slice(bytemuck::cast_slice(column.get(..count).unwrap_or_default()));
    }
    out
}

/// A set of particles out of what [`encode`] made of it; `None` when the bytes are none.
#[must_use]
pub fn decode_particles(bytes: &[u8]) -> Option<Box<Particles>> {
    let mut set = bytemuck::allocation::zeroed_box::<Particles>();
    let head = std::mem::offset_of!(Particles, x_m);
    let (start, columns) = bytes.split_at_checked(head)?;
    bytemuck::bytes_of_mut(&mut *set).get_mut(..head)?.copy_from_slice(start);
    let count = set.count as usize;
    if count > ipc_types::MAX_PARTICLES || columns.len() != COLUMNS * 4 * count {
        return None;
    }
    let stride = 4 * ipc_types::MAX_PARTICLES;
    for (index, column) in columns.chunks_exact((4 * count).max(1)).enumerate() {
        let from = head + index * stride;
        bytemuck::bytes_of_mut(&mut *set).get_mut(from..from + column.len())?.copy_from_slice(column);
    }
    Some(set)
}

/// The route as JSON: `waypoints` and `rooms` end where they are filled, and `seen` and `unmapped`, 32 KiB of bits
/// each, are left out.
fn patrol_json(patrol: &Patrol) -> String {
    let mut out = String::with_capacity(4096);
    let _ = write_patrol(patrol, &mut out);
    out
}

fn write_patrol(patrol: &Patrol, out: &mut String) -> std::fmt::Result {
    // All fields in the order of the message; `tests::the_route_loses_nothing_but_its_bitmaps` holds this against it.
    macro_rules! plain {
        ($($field:ident),*) => {$(
            write!(out, "\"{}\":", stringify!($field))?;
            patrol.$field.write_json(out)?;
            out.push(',');
        )*};
    }
    out.push('{');
    plain!(
        header,
        started_ns,
        command_ns,
        waypoints_used,
        next,
        rooms_used,
        state,
        pad_x_m,
        pad_y_m,
        coverage,
        plan,
        seen_origin_x_m,
        seen_origin_y_m,
        seen_cell_m,
        command_sequence,
        waited_s,
        answer,
        points_waiting,
        points_barred
    );
    write_list("waypoints", patrol.waypoints.get(..patrol.waypoints_used as usize).unwrap_or(&[]), out)?;
    write_list("rooms", patrol.rooms.get(..patrol.rooms_used as usize).unwrap_or(&[]), out)?;
    plain!(answer_text);
    out.push_str("\"text\":");
    patrol.text.write_json(out)?;
    out.push('}');
    Ok(())
}

fn write_list<T: Field>(name: &str, items: &[T], out: &mut String) -> std::fmt::Result {
    write!(out, "\"{name}\":[")?;
    for (index, item) in items.iter().enumerate() {
        if index > 0 {
            out.push(',');
        }
        item.write_json(out)?;
    }
    out.push_str("],");
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn the_route_loses_nothing_but_its_bitmaps() {
        let mut patrol = bytemuck::allocation::zeroed_box::<Patrol>();
        (patrol.waypoints_used, patrol.rooms_used, patrol.answer) = (2, 1, 2);
        patrol.rooms[0].name.set("Aula \"1\"");
        let mut whole = String::new();
        patrol.write_json(&mut whole).unwrap();
        let mut whole: Value = serde_json::from_str(&whole).unwrap();
        let object = whole.as_object_mut().unwrap();
        assert!(object.remove("seen").is_some() && object.remove("unmapped").is_some());
        for (list, used) in [("waypoints", 2), ("rooms", 1)] {
            object[list].as_array_mut().unwrap().truncate(used);
        }
        let cut: Value = serde_json::from_slice(&encode(&*patrol)).unwrap();
        assert_eq!(cut, whole);
        patrol.waypoints_used = u32::MAX;
        let broken: Value = serde_json::from_slice(&encode(&*patrol)).unwrap();
        assert_eq!(broken["waypoints"], Value::from(Vec::<Value>::new()));
    }

    #[test]
    fn pictures_end_where_they_are_filled() {
        let mut still = bytemuck::allocation::zeroed_box::<Still>();
        let head = std::mem::offset_of!(Still, bytes);
        (still.width, still.length) = (640, 3);
        still.bytes.as_mut_slice()[..4].copy_from_slice(&[0xff, 0xd8, 0xff, 9]);
        assert_eq!(encode(&*still)[head..], [0xff, 0xd8, 0xff]);
        still.length = u32::MAX;
        assert_eq!(encode(&*still).len(), head, "a length that makes no sense");
        let mut video = bytemuck::allocation::zeroed_box::<Video>();
        video.length = 5;
        assert_eq!(encode(&*video).len(), std::mem::offset_of!(Video, bytes) + 5);
        for (topic, form) in [(Form::of::<Still>(), "bytes, cut"), (Form::of::<Video>(), "bytes, cut")] {
            assert_eq!(topic.word(), form);
        }
    }

    #[test]
    fn particles_come_back_and_junk_does_not() {
        let mut set = bytemuck::allocation::zeroed_box::<Particles>();
        set.count = 3;
        set.x_m[2] = 1.5;
        set.weight[0] = 0.25;
        let bytes = encode(&*set);
        assert_eq!(bytes.len(), std::mem::offset_of!(Particles, x_m) + 8 * 4 * 3);
        let back = decode_particles(&bytes).unwrap();
        assert_eq!(bytemuck::bytes_of(&*back), bytemuck::bytes_of(&*set));
        assert!(decode_particles(&bytes[..bytes.len() - 1]).is_none());
        assert!(decode_particles(&[]).is_none());
        set.count = 0;
        assert!(decode_particles(&encode(&*set)).is_some());
    }
}
