//! What every message has: a header, a layout hash and a way to be shown.

use core::fmt::{self, Write};

/// A value that may stand in a message.
pub trait Field: bytemuck::Pod {
    /// Hash over the names, types and order of everything inside (FNV-1a, 64 bits).
    const LAYOUT: u64;

    /// Writes the value as JSON.
    ///
    /// # Errors
    /// Only what `out` itself reports.
    fn write_json(&self, out: &mut dyn Write) -> fmt::Result;

    /// Writes the JSON schema (draft 2020-12) of what [`Field::write_json`] writes, with each field's line of
    /// documentation as its description.
    ///
    /// # Errors
    /// Only what `out` itself reports.
    fn write_schema(out: &mut dyn Write) -> fmt::Result;
}

/// Writes lines of documentation as one JSON string.
pub(crate) fn write_description(lines: &[&str], out: &mut dyn Write) -> fmt::Result {
    out.write_char('"')?;
    for (index, line) in lines.iter().enumerate() {
        if index > 0 {
            out.write_char(' ')?;
        }
        for c in line.trim().chars() {
            match c {
                '"' => out.write_str("\\\"")?,
                '\\' => out.write_str("\\\\")?,
                c => out.write_char(c)?,
            }
        }
    }
    out.write_char('"')
}

const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;

/// The layout hash of a bare name: where every hash starts.
#[must_use]
pub const fn layout_of_name(name: &str) -> u64 {
    let bytes = name.as_bytes();
    let mut hash = FNV_OFFSET;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(FNV_PRIME);
        i += 1;
    }
    hash
}

/// Mixes one more number into a layout hash.
#[must_use]
pub const fn layout_step(hash: u64, value: u64) -> u64 {
    let mut hash = hash;
    let mut i = 0;
    while i < 8 {
        hash = (hash ^ ((value >> (8 * i)) & 0xff)).wrapping_mul(FNV_PRIME);
        i += 1;
    }
    hash
}

macro_rules! integer_field {
    ($($t:ty),*) => {$(
        impl Field for $t {
            const LAYOUT: u64 = layout_of_name(stringify!($t));
            fn write_json(&self, out: &mut dyn Write) -> fmt::Result {
                write!(out, "{self}")
            }
            fn write_schema(out: &mut dyn Write) -> fmt::Result {
                write!(out, "{{\"type\":\"integer\",\"minimum\":{},\"maximum\":{}}}", <$t>::MIN, <$t>::MAX)
            }
        }
    )*};
}
integer_field!(u8, u16, u32, u64, i8, i16, i32, i64);

macro_rules! float_field {
    ($($t:ty),*) => {$(
        impl Field for $t {
            const LAYOUT: u64 = layout_of_name(stringify!($t));
            fn write_json(&self, out: &mut dyn Write) -> fmt::Result {
                if self.is_finite() { write!(out, "{self}") } else { out.write_str("null") }
            }
            fn write_schema(out: &mut dyn Write) -> fmt::Result {
                out.write_str("{\"type\":[\"number\",\"null\"]}")
            }
        }
    )*};
}
float_field!(f32, f64);

impl<T: Field, const N: usize> Field for [T; N] {
    const LAYOUT: u64 = layout_step(layout_step(layout_of_name("array"), N as u64), T::LAYOUT);
    fn write_json(&self, out: &mut dyn Write) -> fmt::Result {
        out.write_char('[')?;
        for (i, item) in self.iter().enumerate() {
            if i > 0 {
                out.write_char(',')?;
            }
            item.write_json(out)?;
        }
        out.write_char(']')
    }
    fn write_schema(out: &mut dyn Write) -> fmt::Result {
        out.write_str("{\"type\":\"array\",\"items\":")?;
        T::write_schema(out)?;
        write!(out, ",\"minItems\":{N},\"maxItems\":{N}}}")
    }
}

/// Defines a structure that may stand in a message.
macro_rules! fields {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident {
            $( $(#[doc = $fdoc:literal])* pub $field:ident : $ty:ty, )*
        }
    ) => {
        $(#[doc = $doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $( $(#[doc = $fdoc])* pub $field: $ty, )* }

        impl $crate::Field for $name {
            const LAYOUT: u64 = {
                let hash = $crate::layout_of_name(stringify!($name));
                $(
                    let hash = $crate::layout_step(hash, $crate::layout_of_name(stringify!($field)));
                    let hash = $crate::layout_step(hash, <$ty as $crate::Field>::LAYOUT);
                )*
                hash
            };
            fn write_json(&self, out: &mut dyn core::fmt::Write) -> core::fmt::Result {
                let mut first = true;
                $(
                    if !stringify!($field).starts_with("reserved") {
                        out.write_str(if first { "{\"" } else { ",\"" })?;
                        first = false;
                        out.write_str(stringify!($field))?;
                        out.write_str("\":")?;
                        self.$field.write_json(out)?;
                    }
                )*
                out.write_str(if first { "{}" } else { "}" })
            }
            fn write_schema(out: &mut dyn core::fmt::Write) -> core::fmt::Result {
                write!(out, "{{\"title\":\"{}\",\"description\":", stringify!($name))?;
                $crate::field::write_description(&[$($doc),*], out)?;
                out.write_str(",\"type\":\"object\",\"additionalProperties\":false,\"properties\":{")?;
                let mut first = true;
                $(
                    if !stringify!($field).starts_with("reserved") {
                        out.write_str(if first { "\"" } else { ",\"" })?;
                        first = false;
                        out.write_str(concat!(stringify!($field), "\":{\"description\":"))?;
                        $crate::field::write_description(&[$($fdoc),*], out)?;
                        // Beside a description, so that what is inside keeps its own.
                        out.write_str(",\"allOf\":[")?;
                        <$ty as $crate::Field>::write_schema(out)?;
                        out.write_str("]}")?;
                    }
                )*
                out.write_str("},\"required\":[")?;
                let mut more = false;
                $(
                    if !stringify!($field).starts_with("reserved") {
                        out.write_str(if more { ",\"" } else { "\"" })?;
                        more = true;
                        out.write_str(concat!(stringify!($field), "\""))?;
                    }
                )*
                let _ = (first, more);
                out.write_str("]}")
            }
        }

        impl Default for $name {
            /// All bytes zero.
            fn default() -> Self {
                <Self as bytemuck::Zeroable>::zeroed()
            }
        }
    };
}
pub(crate) use fields;

/// Defines a message: a structure whose first field is `header: Header`, and its topic.
macro_rules! message {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident on $topic:literal {
            $($body:tt)*
        }
    ) => {
        $crate::field::fields! {
            $(#[doc = $doc])*
            pub struct $name {
                /// Who said this and when.
                pub header: $crate::Header,
                $($body)*
            }
        }
        impl $crate::Message for $name {
            const TOPIC: &'static str = $topic;
            fn header(&self) -> &$crate::Header { &self.header }
            fn header_mut(&mut self) -> &mut $crate::Header { &mut self.header }
        }
    };
}
pub(crate) use message;

fields! {
    /// Stands at the head of every message; filled in by the runtime when a loan is sent.
    pub struct Header {
        /// `now` of the step that made the message, never re-stamped.
        pub stamp_ns: u64,
        /// Counts from 1 in each incarnation of the publisher; a gap is a lost message.
        pub sequence: u64,
        /// FNV-1a hash of the publisher's name, folded to 32 bits.
        pub publisher: u32,
        /// Which start of the publisher: differs after every restart.
        pub incarnation: u32,
    }
}

/// A structure that travels on a topic.
pub trait Message: Field {
    /// The topic, or for families (`health`, `trace`) its first part.
    const TOPIC: &'static str;
    /// Who said this and when.
    fn header(&self) -> &Header;
    /// For the runtime, which fills it in.
    fn header_mut(&mut self) -> &mut Header;
}
