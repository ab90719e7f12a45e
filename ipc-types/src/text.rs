//! Bounded text inside a message.

use crate::field::{Field, layout_of_name, layout_step};
use core::fmt::{self, Write};

/// UTF-8 of at most `N` bytes, ended by the first NUL or the end of the array.
#[repr(transparent)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Text<const N: usize>([u8; N]);

impl<const N: usize> Text<N> {
    /// As much of `text` as fits without cutting a character.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut out = Self([0; N]);
        out.set(text);
        out
    }

    /// Replaces the text by as much of `text` as fits without cutting a character. Allocates nothing.
    pub fn set(&mut self, text: &str) {
        let mut end = text.len().min(N);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.0 = [0; N];
        self.0[..end].copy_from_slice(&text.as_bytes()[..end]);
    }

    /// The text up to the first NUL; empty when the bytes are not UTF-8.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|b| *b == 0).unwrap_or(N);
        core::str::from_utf8(&self.0[..end]).unwrap_or("")
    }
}

/// Appends; what does not fit is dropped at a character boundary and reported as an error.
impl<const N: usize> Write for Text<N> {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        let used = self.as_str().len();
        let mut end = s.len().min(N - used);
        while !s.is_char_boundary(end) {
            end -= 1;
        }
        self.0[used..used + end].copy_from_slice(&s.as_bytes()[..end]);
        if end == s.len() { Ok(()) } else { Err(fmt::Error) }
    }
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

impl<const N: usize> fmt::Debug for Text<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl<const N: usize> fmt::Display for Text<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl<const N: usize> Field for Text<N> {
    const LAYOUT: u64 = layout_step(layout_of_name("text"), N as u64);
    fn write_json(&self, out: &mut dyn Write) -> fmt::Result {
        out.write_char('"')?;
        for c in self.as_str().chars() {
            match c {
                '"' => out.write_str("\\\"")?,
                '\\' => out.write_str("\\\\")?,
                c if (c as u32) < 0x20 => write!(out, "\\u{:04x}", c as u32)?,
                c => out.write_char(c)?,
            }
        }
        out.write_char('"')
    }
    fn write_schema(out: &mut dyn Write) -> fmt::Result {
        // `maxLength` counts characters, of which there are no more than bytes.
        write!(out, "{{\"type\":\"string\",\"maxLength\":{N}}}")
    }
}

#[cfg(test)]
mod tests {
    use super::Text;
    use core::fmt::Write;

    #[test]
    fn a_character_is_never_cut() {
        assert_eq!(Text::<4>::new("añoso").as_str(), "año");
        assert_eq!(Text::<2>::new("añ").as_str(), "a");
        let mut t = Text::<5>::new("abc");
        assert!(t.write_str("dñ").is_err());
        assert_eq!(t.as_str(), "abcd");
    }

    #[test]
    fn bytes_that_are_not_text_read_as_empty() {
        let t: Text<3> = bytemuck::cast([0xffu8, 0xfe, 0]);
        assert_eq!(t.as_str(), "");
    }
}
