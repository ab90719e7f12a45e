//! Passwords: what may be one, and how they are kept (argon2id).

use argon2::password_hash::{PasswordHash, PasswordHasher, PasswordVerifier, SaltString};
use argon2::{Algorithm, Argon2, Params, Version};

/// NIST SP 800-63B 5.1.1.2 asks for 8 at least and no rules of composition; nobody slows a guesser down but length.
pub const SHORTEST: usize = 12;
/// What is longer is no password but an attempt to keep the hash busy.
pub const LONGEST: usize = 256;
/// 19 MiB, two passes, one lane: OWASP's password storage cheat sheet for argon2id. About 40 ms on a desk.
const MEMORY_KIB: u32 = 19 * 1024;
const PASSES: u32 = 2;
const LANES: u32 = 1;

/// Why a password is not taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PasswordError {
    /// By its length.
    #[error("a password has {SHORTEST} to {LONGEST} characters: this one has {0}")]
    Length(usize),
    /// By the library.
    #[error("the password cannot be kept: {0}")]
    Hash(String),
}

fn argon2() -> Result<Argon2<'static>, PasswordError> {
    let params = Params::new(MEMORY_KIB, PASSES, LANES, None)
        .map_err(|error| PasswordError::Hash(error.to_string()))?;
    Ok(Argon2::new(Algorithm::Argon2id, Version::V0x13, params))
}

/// Checks the length.
///
/// # Errors
/// [`PasswordError::Length`].
pub fn check(password: &str) -> Result<(), PasswordError> {
    let characters = password.chars().count();
    if (SHORTEST..=LONGEST).contains(&characters) { Ok(()) } else { Err(PasswordError::Length(characters)) }
}

/// The hash under which a password is kept, with its salt and parameters, as a PHC string.
///
/// # Errors
/// When it is too short or too long.
pub fn hash(password: &str, salt: [u8; 16]) -> Result<String, PasswordError> {
    check(password)?;
    let salt = SaltString::encode_b64(&salt).map_err(|error| PasswordError::Hash(error.to_string()))?;
    let hash = argon2()?
        .hash_password(password.as_bytes(), &salt)
        .map_err(|error| PasswordError::Hash(error.to_string()))?;
    Ok(hash.to_string())
}

/// What an unknown user's password is compared with, so that it takes as long as a known one's.
///
/// # Errors
/// As [`hash`].
pub fn decoy(salt: [u8; 16]) -> Result<String, PasswordError> {
    hash("nobody has this password", salt)
}

/// Whether `password` is the one that is kept as `kept`; compared in constant time. One that is too long is not hashed.
#[must_use]
pub fn is_right(password: &str, kept: &str) -> bool {
    if password.len() > 4 * LONGEST {
        return false;
    }
    let Ok(kept) = PasswordHash::new(kept) else { return false };
    // The parameters are those of the kept hash.
    argon2().is_ok_and(|argon2| argon2.verify_password(password.as_bytes(), &kept).is_ok())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_known_again_and_no_other() {
        let kept = hash("correct horse battery", [7; 16]).unwrap();
        assert!(kept.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"), "{kept}");
        assert!(is_right("correct horse battery", &kept));
        assert!(!is_right("correct horse batterz", &kept));
        assert!(!is_right("", &kept));
        assert!(!is_right("correct horse battery", "not a hash"));
        assert_ne!(kept, hash("correct horse battery", [8; 16]).unwrap());
    }

    #[test]
    fn length_is_the_only_rule() {
        assert_eq!(check("eleven char"), Err(PasswordError::Length(11)));
        assert!(check("aaaaaaaaaaaa").is_ok());
        assert!(check("contraseña ñ").is_ok(), "characters count, not bytes");
        assert!(check(&"x".repeat(256)).is_ok());
        assert_eq!(check(&"x".repeat(257)), Err(PasswordError::Length(257)));
    }
}
