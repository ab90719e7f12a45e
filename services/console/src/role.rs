//! Who may do what, in four steps.

use serde::{Deserialize, Serialize};

/// A role includes all that stand before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Sees.
    Viewer,
    /// Also orders and flies.
    Guard,
    /// Also edits plans and rounds.
    Installer,
    /// Also keeps the accounts.
    Administrator,
}

impl Role {
    /// Every role, the least first.
    pub const ALL: [Self; 4] = [Self::Viewer, Self::Guard, Self::Installer, Self::Administrator];

    /// The word for files, messages and people.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Guard => "guard",
            Self::Installer => "installer",
            Self::Administrator => "administrator",
        }
    }

    /// The inverse of [`Self::word`].
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.word() == word)
    }
}

/// Stands in an account's list for all drones, also those that come later.
pub const EVERY_DRONE: &str = "*";

/// Whether `name` may be a drone's: one chunk of a zenoh key without wildcards, at most 64 bytes.
#[must_use]
pub fn is_drone_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= 64
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_' | b'.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_are_ordered_and_their_words_lead_back() {
        for pair in Role::ALL.windows(2) {
            assert!(pair[0] < pair[1]);
        }
        for role in Role::ALL {
            assert_eq!(Role::from_word(role.word()), Some(role));
        }
        assert_eq!(Role::from_word("Guard"), None);
    }

    #[test]
    fn a_name_cannot_reach_another_key() {
        for name in ["", "*", "a/b", "**", "a b", "a?b", "a#", "$x", "ñ"] {
            assert!(!is_drone_name(name), "{name}");
        }
        assert!(is_drone_name("watchman-1"));
        assert!(!is_drone_name(&"a".repeat(65)));
    }
}
