//! Back-off after failed attempts, a user and an address. Pure: time is an argument, the table is bounded.
//!
//! What is promised: nobody waits longer than [`LONGEST_MS`] for an attempt of his own. Failures of others on the same
//! account cannot shut the rightful user out, because an address that was told to wait keeps its place: once that wait is
//! over its attempt is heard, whatever others have done in between.

use std::collections::HashMap;
use std::hash::Hash;
use std::net::IpAddr;

/// Failures that cost nothing: people mistype.
const FREE: u32 = 4;
/// The wait after the first failure that costs something; it doubles with each further one.
const FIRST_MS: u64 = 1_000;
/// No wait is longer: a guard in need of the page must not be shut out of it for more than a minute.
pub const LONGEST_MS: u64 = 60_000;
/// Failures are forgotten after this long without another.
const FORGET_MS: u64 = 30 * 60_000;
/// Rows kept in each table; the one whose last failure is longest ago makes room.
pub(crate) const ROWS: usize = 4096;

#[derive(Clone, Copy, Debug)]
struct Row {
    failures: u32,
    failed_ms: u64,
    until_ms: u64,
}

#[derive(Debug)]
struct Table<K> {
    rows: HashMap<K, Row>,
}

impl<K: Hash + Eq + Clone> Table<K> {
    fn new() -> Self {
        Self { rows: HashMap::new() }
    }

    fn wait(&self, key: &K, now_ms: u64) -> u64 {
        self.rows.get(key).map_or(0, |row| row.until_ms.saturating_sub(now_ms))
    }

    fn fail(&mut self, key: &K, now_ms: u64) {
        let old = self.rows.get(key).filter(|row| now_ms < row.failed_ms.saturating_add(FORGET_MS));
        let failures = old.map_or(0, |row| row.failures).saturating_add(1);
        let wait = match failures.checked_sub(FREE + 1) {
            None => 0,
            Some(doublings) => (FIRST_MS << doublings.min(16)).min(LONGEST_MS),
        };
        self.insert(key, Row { failures, failed_ms: now_ms, until_ms: now_ms.saturating_add(wait) });
    }

    fn insert(&mut self, key: &K, row: Row) {
        if !self.rows.contains_key(key) && self.rows.len() >= ROWS {
            let oldest = self.rows.iter().min_by_key(|(_, row)| row.failed_ms).map(|(key, _)| key.clone());
            if let Some(oldest) = oldest {
                self.rows.remove(&oldest);
            }
        }
        self.rows.insert(key.clone(), row);
    }
}

/// Who has failed lately, and who waits.
#[derive(Debug)]
pub struct Backoff {
    users: Table<String>,
    addresses: Table<IpAddr>,
    /// Addresses that were told to wait because of others' failures, and until when.
    places: Table<(String, IpAddr)>,
}

impl Default for Backoff {
    fn default() -> Self {
        Self { users: Table::new(), addresses: Table::new(), places: Table::new() }
    }
}

/// An address as it is counted: one IPv6 subscriber has a whole /64.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) => IpAddr::V6((u128::from(v6) & !u128::from(u64::MAX)).into()),
        v4 => v4,
    }
}

impl Backoff {
    /// Whether an attempt may be heard now; otherwise for how many milliseconds not.
    ///
    /// # Errors
    /// The wait, 1..=[`LONGEST_MS`].
    pub fn ask(&mut self, user: &str, address: IpAddr, now_ms: u64) -> Result<(), u64> {
        let address = network(address);
        let own = self.addresses.wait(&address, now_ms);
        if own > 0 {
            return Err(own);
        }
        let others = self.users.wait(&user.to_owned(), now_ms);
        let place = (user.to_owned(), address);
        match self.places.rows.get(&place).map(|row| row.until_ms) {
            // The place is used up by this attempt: after a failure it is to be waited for again.
            Some(until_ms) if until_ms <= now_ms || others == 0 => {
                self.places.rows.remove(&place);
                Ok(())
            }
            Some(until_ms) => Err(until_ms - now_ms),
            None if others == 0 => Ok(()),
            None => {
                let row = Row { failures: 0, failed_ms: now_ms, until_ms: now_ms.saturating_add(others) };
                self.places.insert(&place, row);
                Err(others)
            }
        }
    }

    /// An attempt has failed.
    pub fn failed(&mut self, user: &str, address: IpAddr, now_ms: u64) {
        self.addresses.fail(&network(address), now_ms);
        self.users.fail(&user.to_owned(), now_ms);
    }

    /// An attempt has succeeded: this address and this user start anew.
    pub fn succeeded(&mut self, user: &str, address: IpAddr) {
        let address = network(address);
        self.addresses.rows.remove(&address);
        self.users.rows.remove(user);
        self.places.rows.remove(&(user.to_owned(), address));
    }

    /// Rows in all tables.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.users.rows.len() + self.addresses.rows.len() + self.places.rows.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(k: u32) -> IpAddr {
        IpAddr::V4(k.into())
    }

    #[test]
    fn the_wait_doubles_up_to_its_bound_and_is_forgotten() {
        let mut backoff = Backoff::default();
        let mut now = 1_000_000;
        let mut waits = Vec::new();
        for _ in 0..14 {
            assert_eq!(backoff.ask("ana", address(1), now), Ok(()));
            backoff.failed("ana", address(1), now);
            let wait = backoff.ask("ana", address(1), now).err().unwrap_or(0);
            waits.push(wait);
            now += wait;
        }
        let s = 1000;
        assert_eq!(
            waits,
            [0, 0, 0, 0, s, 2 * s, 4 * s, 8 * s, 16 * s, 32 * s, 60 * s, 60 * s, 60 * s, 60 * s]
        );
        now += FORGET_MS;
        backoff.failed("ana", address(1), now);
        assert_eq!(backoff.ask("ana", address(1), now), Ok(()));
    }

    #[test]
    fn an_address_pays_for_all_users_that_it_tries() {
        let mut backoff = Backoff::default();
        for k in 0..10 {
            backoff.failed(&format!("user {k}"), address(1), 5_000);
        }
        assert!(backoff.ask("somebody else", address(1), 5_000).is_err());
        assert!(backoff.ask("somebody else", address(2), 5_000).is_ok());
    }

    /// An attacker with as many addresses as he likes tries without a pause; the rightful user comes in between.
    #[test]
    fn the_rightful_user_is_heard_within_the_longest_wait_whatever_others_do() {
        let mut backoff = Backoff::default();
        let mut now = 0;
        for k in 0..200_u32 {
            backoff.failed("ana", address(1000 + k), now);
            now += 10;
        }
        let first = now;
        let mut heard = None;
        for k in 0..2_000_u32 {
            if backoff.ask("ana", address(3), now).is_ok() {
                heard = Some(now - first);
                break;
            }
            backoff.failed("ana", address(5000 + k), now);
            now += 100;
        }
        assert!(heard.is_some_and(|waited| waited <= LONGEST_MS), "{heard:?}");
    }

    #[test]
    fn the_tables_are_bounded() {
        let mut backoff = Backoff::default();
        for k in 0..3 * ROWS as u32 {
            backoff.failed(&format!("user {k}"), address(k), u64::from(k));
            backoff.failed("ana", address(k), u64::from(k));
            let _ = backoff.ask("ana", address(k + 1_000_000), u64::from(k));
        }
        assert!(backoff.rows() <= 3 * ROWS);
    }

    #[test]
    fn one_subscriber_of_ipv6_is_one_address() {
        let mut backoff = Backoff::default();
        let at = |k: u64| IpAddr::V6(((0x2001_0db8_0000_0001_u128 << 64) | u128::from(k)).into());
        for k in 0..10 {
            backoff.failed(&format!("user {k}"), at(k), 0);
        }
        assert!(backoff.ask("x", at(99), 0).is_err());
    }
}
