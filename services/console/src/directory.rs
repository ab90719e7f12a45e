//! Accounts and sessions as they are asked for on every request: in memory, pure, time is an argument. The store keeps them.

use crate::secret::Digest;
use crate::{EVERY_DRONE, Role};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A person who may log in. The password's hash stays in the store.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Account {
    /// Number, never given twice.
    pub id: i64,
    /// Given name.
    pub name: String,
    /// Family name.
    pub surname: String,
    /// E-mail address, the name to log in with; unique whatever the case.
    pub email: String,
    /// What it may do.
    pub role: Role,
    /// Language of the page: `es` or `en`.
    pub language: String,
    /// Drones that it may see, and fly when the role allows it; [`EVERY_DRONE`] for all.
    pub drones: BTreeSet<String>,
    /// Whether it may no longer log in.
    pub disabled: bool,
}

impl Account {
    /// Whether it is assigned to this drone.
    #[must_use]
    pub fn may_see(&self, drone: &str) -> bool {
        self.drones.contains(drone) || self.drones.contains(EVERY_DRONE)
    }
}

/// A log-in that has not ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Session {
    /// Whose.
    pub account: i64,
    /// When it began, Unix milliseconds.
    pub began_ms: u64,
    /// When its human last did something, Unix milliseconds.
    pub seen_ms: u64,
}

/// How long a session lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lifetime {
    /// Without a deed of its human, milliseconds.
    pub idle_ms: u64,
    /// At most, milliseconds.
    pub absolute_ms: u64,
}

/// Sessions kept; the one unused for longest makes room.
pub const MOST_SESSIONS: usize = 1024;

/// Who exists and who is logged in.
#[derive(Debug)]
pub struct Directory {
    accounts: BTreeMap<i64, Account>,
    sessions: HashMap<Digest, Session>,
    lifetime: Lifetime,
}

impl Directory {
    /// From what the store has kept.
    #[must_use]
    pub fn new(
        accounts: impl IntoIterator<Item = Account>,
        sessions: impl IntoIterator<Item = (Digest, Session)>,
        lifetime: Lifetime,
    ) -> Self {
        Self {
            accounts: accounts.into_iter().map(|account| (account.id, account)).collect(),
            sessions: sessions.into_iter().collect(),
            lifetime,
        }
    }

    /// Whose session this is, if it has not expired and its account may log in.
    #[must_use]
    pub fn who(&self, session: &Digest, now_ms: u64) -> Option<&Account> {
        let found = self.sessions.get(session).filter(|session| self.lives(session, now_ms))?;
        self.accounts.get(&found.account).filter(|account| !account.disabled)
    }

    fn lives(&self, session: &Session, now_ms: u64) -> bool {
        now_ms < session.began_ms.saturating_add(self.lifetime.absolute_ms)
            && now_ms < session.seen_ms.saturating_add(self.lifetime.idle_ms)
    }

    /// Its human has done something. Returns when that should be written down: not more than once a minute.
    pub fn seen(&mut self, session: &Digest, now_ms: u64) -> bool {
        const MINUTE_MS: u64 = 60_000;
        match self.sessions.get_mut(session) {
            Some(found) if found.seen_ms < now_ms => {
                let due = found.seen_ms / MINUTE_MS != now_ms / MINUTE_MS;
                found.seen_ms = now_ms;
                due
            }
            _ => false,
        }
    }

    /// Begins a session; returns those that had to go: expired ones, and the longest unused when there are too many.
    pub fn begin(&mut self, session: Digest, account: i64, now_ms: u64) -> Vec<Digest> {
        let mut gone: Vec<Digest> = self
            .sessions
            .iter()
            .filter(|(_, session)| !self.lives(session, now_ms))
            .map(|(digest, _)| *digest)
            .collect();
        if self.sessions.len() - gone.len() >= MOST_SESSIONS {
            let oldest = self
                .sessions
                .iter()
                .filter(|(digest, _)| !gone.contains(digest))
                .min_by_key(|(_, session)| session.seen_ms)
                .map(|(digest, _)| *digest);
            gone.extend(oldest);
        }
        for digest in &gone {
            self.sessions.remove(digest);
        }
        self.sessions.insert(session, Session { account, began_ms: now_ms, seen_ms: now_ms });
        gone
    }

    /// Ends a session.
    pub fn end(&mut self, session: &Digest) -> bool {
        self.sessions.remove(session).is_some()
    }

    /// Ends every session of an account but `but`.
    pub fn end_all(&mut self, account: i64, but: Option<&Digest>) -> Vec<Digest> {
        let gone: Vec<Digest> = self
            .sessions
            .iter()
            .filter(|(digest, session)| session.account == account && Some(*digest) != but)
            .map(|(digest, _)| *digest)
            .collect();
        for digest in &gone {
            self.sessions.remove(digest);
        }
        gone
    }

    /// All accounts by number.
    pub fn accounts(&self) -> impl Iterator<Item = &Account> {
        self.accounts.values()
    }

    /// An account by number.
    #[must_use]
    pub fn account(&self, id: i64) -> Option<&Account> {
        self.accounts.get(&id)
    }

    /// Adds an account or replaces the one of its number.
    pub fn put(&mut self, account: Account) {
        self.accounts.insert(account.id, account);
    }

    /// Whether somebody has claimed this console.
    #[must_use]
    pub fn is_claimed(&self) -> bool {
        !self.accounts.is_empty()
    }

    /// Whether nobody but `id` could keep the accounts.
    #[must_use]
    pub fn is_last_administrator(&self, id: i64) -> bool {
        let able: Vec<i64> = self
            .accounts
            .values()
            .filter(|account| account.role == Role::Administrator && !account.disabled)
            .map(|account| account.id)
            .collect();
        able == [id]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn account(id: i64, role: Role) -> Account {
        Account {
            id,
            name: "Ana".to_owned(),
            surname: "Prieto".to_owned(),
            email: format!("{id}@example.org"),
            role,
            language: "es".to_owned(),
            drones: ["north".to_owned()].into(),
            disabled: false,
        }
    }

    fn directory() -> Directory {
        Directory::new(
            [account(1, Role::Administrator), account(2, Role::Guard)],
            [],
            Lifetime { idle_ms: 1000, absolute_ms: 5000 },
        )
    }

    #[test]
    fn a_session_ends_idle_or_old() {
        let mut directory = directory();
        directory.begin([1; 32], 2, 10_000);
        assert_eq!(directory.who(&[1; 32], 10_999).map(|a| a.id), Some(2));
        assert!(directory.who(&[1; 32], 11_000).is_none());
        assert!(directory.who(&[2; 32], 10_000).is_none());
        for now in (10_000..15_000).step_by(500) {
            assert!(directory.who(&[1; 32], now).is_some(), "{now}");
            directory.seen(&[1; 32], now);
        }
        assert!(directory.who(&[1; 32], 15_000).is_none());
    }

    #[test]
    fn a_clock_set_back_does_not_lengthen_a_session() {
        let mut directory = directory();
        directory.begin([1; 32], 2, 10_000);
        directory.seen(&[1; 32], 2_000);
        assert!(directory.who(&[1; 32], 11_000).is_none());
    }

    #[test]
    fn a_disabled_account_is_out_at_once() {
        let mut directory = directory();
        directory.begin([1; 32], 2, 0);
        directory.put(Account { disabled: true, ..account(2, Role::Guard) });
        assert!(directory.who(&[1; 32], 1).is_none());
    }

    #[test]
    fn sessions_are_bounded_and_expired_ones_go_first() {
        let mut directory = directory();
        for k in 0..MOST_SESSIONS as u64 {
            let mut digest = [0; 32];
            digest[..8].copy_from_slice(&k.to_le_bytes());
            assert!(directory.begin(digest, 2, 100_000 + k / 2).is_empty());
        }
        assert_eq!(directory.begin([9; 32], 2, 100_600).len(), 1);
        assert!(directory.begin([8; 32], 2, 101_400).len() > 500);
        assert!(directory.who(&[8; 32], 101_400).is_some());
    }

    #[test]
    fn the_last_administrator_is_known() {
        let mut directory = directory();
        assert!(directory.is_last_administrator(1));
        assert!(!directory.is_last_administrator(2));
        directory.put(account(3, Role::Administrator));
        assert!(!directory.is_last_administrator(1));
    }

    #[test]
    fn a_star_is_every_drone() {
        let mut guard = account(2, Role::Guard);
        assert!(guard.may_see("north") && !guard.may_see("south"));
        guard.drones = [EVERY_DRONE.to_owned()].into();
        assert!(guard.may_see("south"));
    }
}
