#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! Rounds by somebody's wishes: an order of rooms, rooms left out, places to be flown to.

mod common;

use common::{Site, delivered, plan_round, plan_wished};
use patrol::{Obstacle, Round, Seen, Wishes};

fn room(site: &Site, name: &str) -> usize {
    (0..site.rooms.len()).find(|room| site.rooms.name(*room) == name).unwrap()
}

fn wished(site: &Site, wishes: &Wishes) -> Round {
    plan_wished(site, site.pad, &Seen::new(&site.map), wishes)
}

/// Positions in the round of the stops in a room.
fn visits(round: &Round, room: usize) -> Vec<usize> {
    let stops = round.stops().iter().enumerate();
    stops.filter(|(_, stop)| stop.look && stop.room == Some(room)).map(|(k, _)| k).collect()
}

#[test]
fn rooms_that_are_wished_first_come_first_and_in_their_order() {
    let site = delivered("demo");
    let order = ["Hall", "Kitchen", "Office 1"].map(|name| room(&site, name));
    let plain = plan_round(&site, site.pad, &Seen::new(&site.map));
    let firsts: Vec<usize> = order.iter().map(|room| visits(&plain, *room)[0]).collect();
    assert!(
        !firsts.is_sorted() || firsts[0] != 0,
        "the shortest round has another order, or nothing is tested"
    );
    let round = wished(&site, &Wishes { first: order.to_vec(), ..Wishes::default() });
    let rooms: Vec<usize> =
        round.stops().iter().filter(|stop| stop.look).filter_map(|stop| stop.room).collect();
    let turns: Vec<usize> = rooms
        .iter()
        .map(|room| order.iter().position(|first| first == room).unwrap_or(order.len()))
        .collect();
    assert!(turns.is_sorted(), "{turns:?}");
    for (turn, room) in order.iter().enumerate() {
        assert!(turns.contains(&turn), "{} is looked at", site.rooms.name(*room));
    }
    assert_eq!(round.to_see(), plain.to_see(), "an order leaves nothing out");
}

#[test]
fn a_room_that_is_left_out_is_not_looked_at_and_says_so() {
    let site = delivered("demo");
    let store = room(&site, "Store");
    let round = wished(&site, &Wishes { leave_out: vec![store], ..Wishes::default() });
    assert!(visits(&round, store).is_empty());
    assert_eq!(round.rooms()[store].skipped, Some(Obstacle::LeftOut));
    let raster = site.map.raster();
    let to_see = round.to_see().cells(raster).filter(|cell| site.map.room_of(*cell) == Some(store)).count();
    assert_eq!(to_see, 0, "what is not to be seen does not count as missed");
    assert!(round.rooms().iter().enumerate().all(|(k, room)| k == store || room.skipped.is_none()));
}

#[test]
fn wished_places_are_flown_to_and_those_nobody_can_reach_are_named() {
    let site = delivered("demo");
    // In a corner that no look needs, in the middle of a wall, and one that was flown to before.
    let places = [Some((17.9, 1.2)), Some((6.05, 4.0)), None, Some((25.0, 13.0))];
    let round = wished(&site, &Wishes { points: places.to_vec(), ..Wishes::default() });
    for (k, place) in places.iter().enumerate() {
        let stop = round.stops().iter().find(|stop| stop.point == Some(k));
        match (place, k) {
            (Some((x, y)), 0 | 3) => {
                let stop = stop.unwrap();
                assert!((stop.x - x).hypot(stop.y - y) < 0.1, "{stop:?}");
                assert!(stop.look);
            }
            // The nearest place that can be flown to is within reach of the wall's middle, or it is barred.
            (Some((x, y)), _) => match stop {
                Some(stop) => assert!((stop.x - x).hypot(stop.y - y) < 0.85, "{stop:?}"),
                None => assert_eq!(round.barred(), [k]),
            },
            (None, _) => assert!(stop.is_none()),
        }
    }
    let far = wished(&site, &Wishes { points: vec![Some((-3.0, 40.0))], ..Wishes::default() });
    assert_eq!(far.barred(), [0]);
}

#[test]
fn everything_left_out_is_a_way_back_to_the_pad() {
    let site = delivered("demo");
    let all = (0..site.rooms.len()).collect();
    let round = wished(&site, &Wishes { leave_out: all, ..Wishes::default() });
    assert_eq!(round.stops().iter().filter(|stop| stop.look).count(), 0, "{:?}", round.stops());
    assert_eq!(round.stops().len(), 1);
}
