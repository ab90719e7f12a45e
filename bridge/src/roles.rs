//! Who may do what: roles, and the drone's list of the certificates that it knows (`clients.toml`).

use serde::Deserialize;
use std::collections::BTreeMap;

/// Longest name of a certificate, bytes: it must fit into a message.
pub const MAX_NAME: usize = 32;
/// Most certificates in one list.
pub const MAX_CLIENTS: usize = 256;

/// What a certificate, an account or an order may do; each may all that those before it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// Sees.
    Viewer,
    /// Also orders and flies.
    Guard,
    /// Also edits plans and rounds.
    Installer,
    /// Also keeps accounts.
    Administrator,
}

impl Role {
    /// Every role, the least first.
    pub const ALL: [Self; 4] = [Self::Viewer, Self::Guard, Self::Installer, Self::Administrator];

    /// The word of `clients.toml`, of orders and of accounts.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Guard => "guard",
            Self::Installer => "installer",
            Self::Administrator => "administrator",
        }
    }

    /// The inverse of [`Role::word`].
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.word() == word)
    }
}

/// What a certificate stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// A program of people, with their role.
    Client(Role),
    /// A zenoh router, which checks the certificates of others and carries what they say.
    Router,
    /// Another drone of the same owner: a router must know it, a drone wants nothing from it.
    Drone,
}

impl Standing {
    /// The word of `clients.toml`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Client(role) => role.word(),
            Self::Router => "router",
            Self::Drone => "drone",
        }
    }

    /// The inverse of [`Standing::word`].
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "router" => Some(Self::Router),
            "drone" => Some(Self::Drone),
            word => Role::from_word(word).map(Self::Client),
        }
    }

    /// All words, for messages.
    pub const WORDS: &'static str = "viewer, guard, installer, administrator, router, drone";
}

/// Whether a name may stand in a certificate and in a key: letters, digits, `-`, `_` and `.`, at most [`MAX_NAME`] bytes.
#[must_use]
pub fn is_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= MAX_NAME
        && !name.starts_with('.')
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.'))
}

/// The certificates that a drone knows, by their common names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Clients(BTreeMap<String, Standing>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(default)]
    client: BTreeMap<String, RawClient>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawClient {
    role: String,
}

impl Clients {
    /// Reads a list; `file` is how it is called in messages.
    ///
    /// # Errors
    /// One sentence with file, field, value and what is allowed.
    pub fn parse(file: &str, text: &str) -> Result<Self, String> {
        let raw: Raw = toml::from_str(text)
            .map_err(|error| format!("{file}: {}", manifest::one_line(error.to_string().trim_end())))?;
        if raw.client.len() > MAX_CLIENTS {
            return Err(format!("{file}: {} clients: allowed are at most {MAX_CLIENTS}", raw.client.len()));
        }
        let mut clients = BTreeMap::new();
        for (name, client) in raw.client {
            if !is_name(&name) {
                return Err(format!(
                    "{file}: client.\"{}\": a name has 1 to {MAX_NAME} letters, digits, - _ and .",
                    manifest::plain(&name)
                ));
            }
            let standing = Standing::from_word(&client.role).ok_or_else(|| {
                format!(
                    "{file}: client.{name}.role = \"{}\": allowed are {}",
                    manifest::plain(&client.role),
                    Standing::WORDS
                )
            })?;
            clients.insert(name, standing);
        }
        Ok(Self(clients))
    }

    /// As a file, one table a client.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::from(
            "# Certificates that this drone knows, by name, and the role of each (docs/off-board.md). Written by `sereno certs`;\n\
             # the bridge reads it again when it changes. A certificate that is not here may nothing.\n",
        );
        for (name, standing) in &self.0 {
            // A name with a dot would be two keys.
            text.push_str(&format!("\n[client.\"{name}\"]\nrole = \"{}\"\n", standing.word()));
        }
        text
    }

    /// Adds or changes one.
    pub fn set(&mut self, name: &str, standing: Standing) {
        self.0.insert(name.to_owned(), standing);
    }

    /// Takes one off the list; false when it was not on it.
    pub fn remove(&mut self, name: &str) -> bool {
        self.0.remove(name).is_some()
    }

    /// What a certificate stands for.
    #[must_use]
    pub fn standing(&self, name: &str) -> Option<Standing> {
        self.0.get(name).copied()
    }

    /// Role of a certificate; `None` when it is not known or no client.
    #[must_use]
    pub fn role(&self, name: &str) -> Option<Role> {
        match self.standing(name) {
            Some(Standing::Client(role)) => Some(role),
            _ => None,
        }
    }

    /// All, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Standing)> {
        self.0.iter().map(|(name, standing)| (name.as_str(), *standing))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_read_as_it_was_written() {
        let mut clients = Clients::default();
        for (name, word) in [("desk", "guard"), ("hub.1", "router"), ("py", "viewer"), ("sereno-1", "drone")]
        {
            clients.set(name, Standing::from_word(word).unwrap());
        }
        assert_eq!(Clients::parse("clients.toml", &clients.to_toml()).unwrap(), clients);
        assert_eq!(clients.role("desk"), Some(Role::Guard));
        assert_eq!(clients.role("hub.1"), None, "a router gives no orders");
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, said) in [
            (
                "[client.desk]\nrole = \"king\"",
                "clients.toml: client.desk.role = \"king\": allowed are viewer,",
            ),
            ("[client.desk]\nrule = \"guard\"", "rule"),
            ("[client.\"a/b\"]\nrole = \"guard\"", "client.\"a/b\": a name has"),
            ("[client.\"*\"]\nrole = \"guard\"", "a name has"),
            ("[client.desk", "clients.toml: "),
        ] {
            let error = Clients::parse("clients.toml", text).unwrap_err();
            assert!(error.contains(said) && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn roles_are_in_order() {
        assert!(Role::ALL.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(Role::ALL.iter().all(|role| Role::from_word(role.word()) == Some(*role)));
    }
}
