//! Random secrets, and the digests under which they are kept. Where randomness comes from is the caller's.

use ring::digest::{SHA256, digest};

/// SHA-256: enough for secrets that are themselves random (a password is not: see [`crate::password`]).
pub type Digest = [u8; 32];

/// The digest under which a secret is kept.
#[must_use]
pub fn digest_of(secret: &[u8]) -> Digest {
    let mut out = [0; 32];
    out.copy_from_slice(digest(&SHA256, secret).as_ref());
    out
}

/// Lower-case hexadecimal.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        // Writing into a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Characters of a claim code: no I, L, O, U, which are misread (Crockford's base 32).
const LETTERS: &[u8; 32] = b"0123456789ABCDEFGHJKMNPQRSTVWXYZ";
/// 20 characters of 5 bits: 100 bits.
pub const CLAIM_CHARACTERS: usize = 20;

/// The claim code that these random bytes make, in groups of five: `7QK2M-...`.
#[must_use]
pub fn claim_code(random: [u8; CLAIM_CHARACTERS]) -> String {
    let mut code = String::with_capacity(CLAIM_CHARACTERS + 3);
    for (at, byte) in random.iter().enumerate() {
        if at > 0 && at % 5 == 0 {
            code.push('-');
        }
        code.push(char::from(LETTERS[usize::from(byte & 31)]));
    }
    code
}

/// The digest of a claim code as somebody typed it: case, spaces and hyphens do not matter, and neither do the letters
/// that look like digits.
#[must_use]
pub fn claim_digest(typed: &str) -> Digest {
    let plain: String = typed
        .chars()
        .filter(|c| !c.is_whitespace() && *c != '-')
        .take(2 * CLAIM_CHARACTERS)
        .map(|c| match c.to_ascii_uppercase() {
            'I' | 'L' => '1',
            'O' => '0',
            other => other,
        })
        .collect();
    digest_of(plain.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_code_is_forgiving_about_how_it_is_typed_and_about_nothing_else() {
        let code = claim_code(std::array::from_fn(|k| (k * 13 + 1) as u8));
        assert_eq!(code.len(), 23);
        let kept = claim_digest(&code);
        assert_eq!(claim_digest(&code.to_lowercase().replace('-', " ")), kept);
        assert_eq!(claim_digest(&code.replace('1', "l").replace('0', "o")), kept);
        let mut other = code.clone();
        other.pop();
        assert_ne!(claim_digest(&other), kept);
        assert_ne!(claim_digest(""), kept);
    }

    #[test]
    fn all_random_bits_reach_the_code() {
        let mut codes = std::collections::BTreeSet::new();
        for byte in 0..=31 {
            codes.insert(claim_code([byte; CLAIM_CHARACTERS]));
        }
        assert_eq!(codes.len(), 32);
    }
}
