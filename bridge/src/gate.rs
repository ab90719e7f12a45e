//! Which orders are given: by whom, how often, how fresh, and none twice. Pure: time is an argument.

use crate::edit::Edit;
use crate::order::{BEACON_LIFE_NS, Order};
use crate::roles::{Clients, Role};
use ipc_types::{COMMAND_LIFE_NS, Command, Text, Verb};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Most identities that are remembered. With the largest `orders_hz` ten certificates can fill it in two seconds.
const MAX_REMEMBERED: usize = 4096;
/// Stops and cuts a second of one certificate, beside its other orders.
const URGENT_HZ: f64 = 10.0;

/// What is counted against the same limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Stop and cut: never kept waiting by other orders.
    Urgent,
    /// Every other order.
    Order,
    /// Sticks.
    Sticks,
    /// Questions for the newest message, wishes, and messages of video sessions.
    Other,
    /// Changes of the building.
    Edit,
}

impl Class {
    /// Of an order.
    #[must_use]
    pub const fn of(verb: Verb) -> Self {
        match verb {
            Verb::Stop | Verb::Cut => Self::Urgent,
            _ => Self::Order,
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Bucket {
    tokens: f64,
    filled_ns: u64,
}

/// How often each certificate may say something: a bucket of tokens each, a second deep.
#[derive(Debug)]
pub struct Limits {
    orders_hz: f64,
    sticks_hz: f64,
    buckets: BTreeMap<(String, Class), Bucket>,
}

impl Limits {
    /// Limits as configured, Hz.
    #[must_use]
    pub fn new(orders_hz: f64, sticks_hz: f64) -> Self {
        Self { orders_hz, sticks_hz, buckets: BTreeMap::new() }
    }

    /// Whether a certificate may say one more thing of this class at `now`. Only for certificates that are on the list: each
    /// one that is asked about is remembered.
    pub fn take(&mut self, now: u64, certificate: &str, class: Class) -> bool {
        let hz = match class {
            Class::Urgent => URGENT_HZ,
            Class::Order => self.orders_hz,
            Class::Sticks => self.sticks_hz,
            Class::Other => 200.0,
            Class::Edit => 2.0,
        };
        let full = Bucket { tokens: hz, filled_ns: now };
        let bucket = self.buckets.entry((certificate.to_owned(), class)).or_insert(full);
        let passed_s = now.saturating_sub(bucket.filled_ns) as f64 * 1e-9;
        bucket.tokens = (bucket.tokens + passed_s * hz).min(hz);
        bucket.filled_ns = now;
        let may = bucket.tokens >= 1.0;
        if may {
            bucket.tokens -= 1.0;
        }
        may
    }
}

/// By what somebody asks for something.
#[derive(Debug, Clone, Copy)]
struct Paper<'a> {
    certificate: &'a str,
    claimed: Option<Role>,
    id: u64,
    beacon_ns: u64,
}

/// Decides about orders and changes.
#[derive(Debug)]
pub struct Gate {
    clients: Arc<Clients>,
    /// The first beacon of this start: what names an older one was meant for an earlier start, and may have been
    /// obeyed then.
    first_beacon_ns: u64,
    /// Who gave which order when, the oldest first.
    seen: VecDeque<(u64, u64, u64)>,
}

impl Gate {
    /// A gate that knows these clients and has sent its first beacon at `first_beacon_ns`.
    #[must_use]
    pub fn new(clients: Arc<Clients>, first_beacon_ns: u64) -> Self {
        Self { clients, first_beacon_ns, seen: VecDeque::new() }
    }

    /// The list of clients has changed.
    pub fn set_clients(&mut self, clients: Arc<Clients>) {
        self.clients = clients;
    }

    /// The first beacon that counts.
    #[must_use]
    pub fn first_beacon_ns(&self) -> u64 {
        self.first_beacon_ns
    }

    /// Whether a certificate may send sticks.
    #[must_use]
    pub fn may_fly(&self, certificate: &str) -> bool {
        self.clients.role(certificate) >= Some(Role::Guard)
    }

    /// The role by which a certificate speaks for an account of role `claimed`: the lesser of both.
    #[must_use]
    pub fn role(&self, certificate: &str, claimed: Option<Role>) -> Option<Role> {
        let own = self.clients.role(certificate)?;
        Some(claimed.map_or(own, |claimed| claimed.min(own)))
    }

    /// Reads an order that came by `certificate` and decides about it. Answers the command to be given, without number.
    ///
    /// # Errors
    /// One sentence for whoever gave it.
    pub fn decide(
        &mut self,
        now: u64,
        certificate: &str,
        verb: Verb,
        json: &[u8],
    ) -> Result<Command, String> {
        let order = Order::parse(verb, json)?;
        let paper = Paper { certificate, claimed: order.role, id: order.id, beacon_ns: order.beacon_ns };
        let role = self.admit(now, &paper, Role::Guard, "order: guard, installer or administrator")?;
        let account = if order.account.as_str().is_empty() { Text::new(certificate) } else { order.account };
        Ok(Command {
            expiry_ns: now.saturating_add(COMMAND_LIFE_NS),
            lease: order.lease,
            socket: order.socket,
            x_m: order.x_m,
            y_m: order.y_m,
            verb: u32::from(verb.code()),
            account,
            role: Text::new(role.word()),
            certificate: Text::new(certificate),
            ..Command::default()
        })
    }

    /// Reads a change of the building that came by `certificate`, with its picture, and decides about it.
    ///
    /// # Errors
    /// One sentence for whoever wants it.
    pub fn decide_edit(
        &mut self,
        now: u64,
        certificate: &str,
        json: &[u8],
        picture: Option<&[u8]>,
    ) -> Result<Edit, String> {
        // First: who may not need not be told what was wrong with it, and costs nothing.
        let own = self.role(certificate, None);
        if own < Some(Role::Installer) {
            let word = own.map_or("stranger", Role::word);
            return Err(format!("a {word} may not change the building: installer or administrator may"));
        }
        let mut edit = Edit::parse(json, picture)?;
        let paper = Paper { certificate, claimed: edit.role, id: edit.id, beacon_ns: edit.beacon_ns };
        self.admit(now, &paper, Role::Installer, "change the building: installer or administrator")?;
        if edit.account.is_empty() {
            certificate.clone_into(&mut edit.account);
        }
        Ok(edit)
    }

    /// Whether something may be done for who shows this paper: role, freshness, and that it did not come before.
    fn admit(&mut self, now: u64, paper: &Paper<'_>, least: Role, who: &str) -> Result<Role, String> {
        let Paper { certificate, claimed, id, beacon_ns } = *paper;
        let Some(role) = self.role(certificate, claimed) else {
            return Err(format!("the certificate {certificate} is not on the drone's list of clients"));
        };
        if role < least {
            return Err(format!("a {} may not {who} may", role.word()));
        }
        if beacon_ns > now || beacon_ns < self.first_beacon_ns {
            return Err(
                "beacon_ns is no beacon of this drone since it started: give the order again".to_owned()
            );
        }
        let age_ns = now - beacon_ns;
        if age_ns > BEACON_LIFE_NS {
            return Err(format!(
                "the order is {:.1} s old: the link is too slow, or it was held back",
                age_ns as f64 * 1e-9
            ));
        }
        while self.seen.front().is_some_and(|(when, ..)| now.saturating_sub(*when) > BEACON_LIFE_NS) {
            self.seen.pop_front();
        }
        let by = runtime::fnv(certificate.as_bytes());
        if self.seen.iter().any(|(_, from, seen)| (*from, *seen) == (by, id)) {
            return Err("the same order came before".to_owned());
        }
        if self.seen.len() >= MAX_REMEMBERED {
            return Err("too many orders at once".to_owned());
        }
        self.seen.push_back((now, by, id));
        Ok(role)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::roles::Standing;

    const SECOND: u64 = 1_000_000_000;
    const START: u64 = 100 * SECOND;

    fn gate() -> Gate {
        let mut clients = Clients::default();
        for role in Role::ALL {
            clients.set(role.word(), Standing::Client(role));
        }
        clients.set("hub", Standing::Router);
        Gate::new(Arc::new(clients), START)
    }

    fn order(id: u64, beacon_ns: u64, more: &str) -> Vec<u8> {
        format!("{{\"id\":\"{id:016x}\",\"beacon_ns\":{beacon_ns}{more}}}").into_bytes()
    }

    #[test]
    fn every_verb_needs_a_guard_and_the_lesser_role_counts() {
        for verb in Verb::ALL.iter().copied() {
            let place = if verb == Verb::GoTo { ",\"x_m\":1,\"y_m\":2" } else { "" };
            for certificate in Role::ALL {
                for account in Role::ALL {
                    let more = format!("{place},\"role\":\"{}\"", account.word());
                    let decided = gate().decide(START, certificate.word(), verb, &order(1, START, &more));
                    let may = certificate.min(account) >= Role::Guard;
                    assert_eq!(
                        decided.is_ok(),
                        may,
                        "{verb} by {certificate:?} for {account:?}: {decided:?}"
                    );
                    if let Ok(command) = decided {
                        assert_eq!(command.role.as_str(), certificate.min(account).word());
                        assert_eq!(command.certificate.as_str(), certificate.word());
                    }
                }
            }
            for stranger in ["hub", "nobody", ""] {
                let error = gate().decide(START, stranger, verb, &order(1, START, place)).unwrap_err();
                assert!(error.contains("not on the drone's list"), "{error}");
            }
        }
    }

    #[test]
    fn replayed_stale_and_earlier_orders_are_refused() {
        let mut gate = gate();
        let now = START + 5 * SECOND;
        let first = order(7, now, "");
        assert!(gate.decide(now, "guard", Verb::Land, &first).is_ok());
        for (what, at, text) in [
            ("the same order came before", now + 1, first.clone()),
            ("the same order came before", now + 2 * SECOND, first.clone()),
            ("s old", now + 2 * SECOND + 1, first),
            ("no beacon of this drone", now, order(8, now + 1, "")),
            ("no beacon of this drone", START, order(8, START - 1, "")),
        ] {
            let error = gate.decide(at, "guard", Verb::Land, &text).unwrap_err();
            assert!(error.contains(what), "{error}");
        }
        assert!(gate.decide(now, "administrator", Verb::Land, &order(7, now, "")).is_ok(), "somebody else's");
    }

    #[test]
    fn the_building_is_changed_by_installers_and_by_nobody_twice() {
        let change = |id: u64, more: &str| {
            let building = "\"made_from\":\"00000000000000aa\",\"building\":{\"pad\":{\"x\":1,\"y\":1}}";
            format!("{{\"id\":\"{id:016x}\",\"beacon_ns\":{START},{building}{more}}}").into_bytes()
        };
        for certificate in Role::ALL {
            for account in Role::ALL {
                let json = change(1, &format!(",\"role\":\"{}\"", account.word()));
                let decided = gate().decide_edit(START, certificate.word(), &json, None);
                let may = certificate.min(account) >= Role::Installer;
                assert_eq!(decided.is_ok(), may, "{certificate:?} for {account:?}: {decided:?}");
            }
        }
        let mut gate = gate();
        assert!(gate.decide_edit(START, "hub", b"junk", None).unwrap_err().contains("a stranger may not"));
        assert!(gate.decide_edit(START, "installer", &change(7, ""), None).is_ok());
        let again = gate.decide_edit(START + 1, "installer", &change(7, ""), None).unwrap_err();
        assert_eq!(again, "the same order came before");
        let late = gate.decide_edit(START + 3 * SECOND, "installer", &change(8, ""), None).unwrap_err();
        assert!(late.contains("s old"), "{late}");
    }

    #[test]
    fn a_flood_of_one_certificate_keeps_nobody_else_from_anything() {
        let mut limits = Limits::new(10.0, 100.0);
        let passed = (0..10_000).filter(|i| limits.take(START + i * 1000, "desk", Class::Order)).count();
        assert_eq!(passed, 10, "in 10 ms");
        assert!(limits.take(START, "desk", Class::Urgent));
        assert!(limits.take(START, "other", Class::Order));
        assert!(limits.take(START + SECOND, "desk", Class::Order));
    }

    #[test]
    fn memory_is_bounded() {
        let mut gate = gate();
        for id in 0..MAX_REMEMBERED as u64 {
            gate.decide(START, "guard", Verb::Hold, &order(id, START, "")).unwrap();
        }
        let error = gate.decide(START, "guard", Verb::Hold, &order(u64::MAX, START, "")).unwrap_err();
        assert_eq!(error, "too many orders at once");
        let later = START + BEACON_LIFE_NS + 1;
        assert!(gate.decide(later, "guard", Verb::Hold, &order(u64::MAX, later, "")).is_ok());
    }
}
