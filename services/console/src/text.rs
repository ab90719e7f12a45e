//! Text that comes from elsewhere.

/// Cuts after at most `bytes`, at a character.
pub(crate) fn shorten(text: &mut String, bytes: usize) {
    if text.len() > bytes {
        let end = (0..=bytes).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
        text.truncate(end);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_character_is_not_cut() {
        let mut text = "aña".to_owned();
        super::shorten(&mut text, 2);
        assert_eq!(text, "a");
        super::shorten(&mut text, 9);
        assert_eq!(text, "a");
    }
}
