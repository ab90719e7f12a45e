//! Whose picture is encoded.

use ipc_types::Format;

/// A viewer, as far as the choice goes.
#[derive(Clone, Debug)]
pub struct Party {
    /// Its account.
    pub account: String,
    /// Its certificate.
    pub certificate: String,
    /// What it wants.
    pub format: Format,
    /// Counts sessions: the lower, the longer it has watched.
    pub since: u64,
}

/// The picture for all, and who decides it.
#[derive(Clone, Debug)]
pub struct Choice {
    /// What is wished of the camera.
    pub format: Format,
    /// The account that decides.
    pub account: String,
    /// It holds the sticks.
    pub flies: bool,
    /// Which of the account's sessions.
    pub since: u64,
}

impl Choice {
    /// The choice among viewers: of whoever holds the sticks (account; empty for nobody), or else of the one who has watched
    /// for longest. `None` without viewers.
    pub fn of<'a>(parties: impl Iterator<Item = &'a Party> + Clone, holder: &str) -> Option<Self> {
        let flying = parties.clone().filter(|party| !holder.is_empty() && party.account == holder);
        // The newest session of the holder: the page that was opened to fly.
        let flying = flying.max_by_key(|party| party.since);
        let flies = flying.is_some();
        let party = flying.or_else(|| parties.min_by_key(|party| party.since))?;
        Some(Self { format: party.format, account: party.account.clone(), flies, since: party.since })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn party(account: &str, width: u32, since: u64) -> Party {
        let format = Format { width, height: 480, fps: 30, bitrate: 1_000_000 };
        Party { account: account.into(), certificate: "desk".into(), format, since }
    }

    #[test]
    fn the_holder_decides_and_without_one_the_oldest() {
        let all = [party("ana", 640, 1), party("luis", 1280, 2), party("ana", 320, 3)];
        let width = |holder: &str| Choice::of(all.iter(), holder).map(|c| (c.format.width, c.flies));
        assert_eq!(width(""), Some((640, false)));
        assert_eq!(width("luis"), Some((1280, true)));
        assert_eq!(width("ana"), Some((320, true)), "the page that was opened last");
        assert_eq!(width("nobody here"), Some((640, false)));
        assert!(Choice::of([].iter(), "ana").is_none());
    }
}
