//! Which recordings go, and why. Pure: time is an argument.

use crate::store::Recording;

/// Why a recording goes without anybody having erased it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// Its time is over.
    Old,
    /// Newer ones need its room.
    Room,
}

/// Which of `kept`, the oldest first, go at `now_ms`. Those that are being written are not asked about; an incident's goes when
/// its time is over, and never for room.
pub(super) fn going(kept: &[Recording], now_ms: u64, retention_ms: u64, most_bytes: u64) -> Vec<(i64, Why)> {
    let mut all: u64 = kept.iter().map(|one| one.bytes).sum();
    let mut going = Vec::new();
    let ended = || kept.iter().filter_map(|one| Some((one, one.ended_ms?)));
    for (one, ended_ms) in ended() {
        if now_ms > ended_ms.saturating_add(retention_ms) {
            going.push((one.id, Why::Old));
            all -= one.bytes;
        }
    }
    for (one, ended_ms) in ended() {
        if all <= most_bytes {
            break;
        }
        if one.incident.is_none() && now_ms <= ended_ms.saturating_add(retention_ms) {
            going.push((one.id, Why::Room));
            all -= one.bytes;
        }
    }
    going
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(id: i64, ended_ms: Option<u64>, bytes: u64, incident: Option<i64>) -> Recording {
        Recording { id, ended_ms, bytes, incident, ..Recording::default() }
    }

    #[test]
    fn the_old_go_then_the_oldest_for_room_and_incidents_only_by_age() {
        let all = [
            kept(1, Some(100), 5, None),
            kept(2, Some(200), 5, Some(9)),
            kept(3, Some(300), 5, None),
            kept(4, Some(400), 5, None),
            kept(5, None, 5, None),
        ];
        assert_eq!(going(&all, 400, 1000, 25), []);
        assert_eq!(going(&all, 1100, 1000, 25), [], "to the very millisecond");
        assert_eq!(going(&all, 1101, 1000, 25), [(1, Why::Old)]);
        assert_eq!(going(&all, 1201, 1000, 25), [(1, Why::Old), (2, Why::Old)]);
        assert_eq!(going(&all, 400, 1000, 24), [(1, Why::Room)]);
        assert_eq!(going(&all, 400, 1000, 14), [(1, Why::Room), (3, Why::Room), (4, Why::Room)]);
        assert_eq!(going(&all, 1101, 1000, 19), [(1, Why::Old), (3, Why::Room)]);
        assert_eq!(going(&all, 400, 1000, 0).len(), 3, "neither an incident nor what is being written");
    }
}
