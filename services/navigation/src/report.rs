//! The round as the retained message `navigation/patrol`, and back after a restart.

use crate::journey::Journey;
use crate::journey::planning::bit;
use crate::mission::Nonsense;
use ipc_types::{MAX_ROOMS, MAX_WAYPOINTS, Patrol, PatrolState, RoomProgress, RoomState, Waypoint};
use patrol::Bits;

/// A room counts as seen from this share on.
const SEEN_SHARE: f32 = 0.95;
/// And as entered from this share on.
const ENTERED_SHARE: f32 = 0.05;
const NO_ROOM: u8 = 255;
const PASSED: u8 = 1;
const LOOK: u8 = 4;

impl Journey {
    /// Writes everything but state, pad, command and text, which are the mission's.
    pub fn write(&mut self, patrol: &mut Patrol) {
        let raster = *self.map.raster();
        patrol.plan = self.atlas.plan_hash();
        (patrol.seen_origin_x_m, patrol.seen_origin_y_m) = raster.origin;
        patrol.seen_cell_m = raster.cell_m;
        patrol.seen.copy_from_slice(self.seen.bits().words());
        patrol.unmapped.copy_from_slice(self.map.unmapped().words());
        patrol.coverage = self.coverage();
        let waiting = self.wishes.points.iter().enumerate().filter(|(_, point)| point.is_some());
        patrol.points_waiting = waiting.fold(0, |bits, (point, _)| bits | bit(point));
        patrol.points_barred = self.points_barred;

        let used = self.corners.len().min(MAX_WAYPOINTS);
        let next = self.next_corner();
        patrol.waypoints_used = used as u32;
        patrol.next = next.min(used) as u32;
        for (i, (waypoint, corner)) in patrol.waypoints.iter_mut().zip(&self.corners).enumerate() {
            let passed = if i < next { PASSED } else { 0 };
            let look = if corner.stop.is_some() { LOOK } else { 0 };
            *waypoint = Waypoint {
                x_m: corner.x,
                y_m: corner.y,
                room: corner.room.and_then(|room| u8::try_from(room).ok()).unwrap_or(NO_ROOM),
                flags: passed | look,
                reserved: 0,
            };
        }
        patrol.waypoints[used..].fill(Waypoint::default());
        self.write_rooms(patrol);
    }

    fn write_rooms(&mut self, patrol: &mut Patrol) {
        if let Some((_, rooms)) = &self.kept {
            patrol.rooms_used = rooms.len() as u32;
            patrol.rooms[..rooms.len()].copy_from_slice(rooms);
            patrol.rooms[rooms.len()..].fill(RoomProgress::default());
            return;
        }
        self.seen.by_room(&self.map, &self.to_see, &mut self.tallies);
        let used = self.rooms.len().min(MAX_ROOMS);
        patrol.rooms_used = used as u32;
        for (room, progress) in patrol.rooms.iter_mut().enumerate().take(used) {
            let (plan, tally) = (&self.rooms[room], self.tallies[room]);
            let share = if tally.all == 0 { 0.0 } else { tally.share() };
            *progress = RoomProgress { seen: share, ..RoomProgress::default() };
            let name = self.atlas.rooms().name(room);
            progress.name.set(name);
            let state = match plan.skipped {
                Some(_) => {
                    progress.reason = self.reasons[room];
                    RoomState::Skipped
                }
                _ if share >= SEEN_SHARE => RoomState::Seen,
                _ if self.has_stop_in(room) && share < ENTERED_SHARE => RoomState::Waiting,
                _ if self.has_stop_in(room) => RoomState::Entered,
                _ if self.gave_up_in(room) => {
                    progress.reason.set("blocked by something not on the plan");
                    if share < ENTERED_SHARE { RoomState::Skipped } else { RoomState::PartlySeen }
                }
                _ if share >= ENTERED_SHARE && self.looked => {
                    progress.reason.set("no place left that shows more of it");
                    RoomState::PartlySeen
                }
                _ if share >= ENTERED_SHARE => RoomState::Entered,
                _ => RoomState::Waiting,
            };
            progress.state = u32::from(state.code());
        }
        patrol.rooms[used..].fill(RoomProgress::default());
    }

    /// After a restart: takes over what was seen and found and asks for the rest of the route. Answers the
    /// state and the place that a `goto` was heading for.
    ///
    /// # Errors
    /// A message that makes no sense or is for another plan.
    pub fn restore(&mut self, patrol: &Patrol) -> Result<(PatrolState, Option<(f32, f32)>), Nonsense> {
        let raster = *self.map.raster();
        let state = u8::try_from(patrol.state).ok().and_then(PatrolState::from_code).ok_or(Nonsense)?;
        let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
        let same_raster = near(patrol.seen_origin_x_m, raster.origin.0)
            && near(patrol.seen_origin_y_m, raster.origin.1)
            && near(patrol.seen_cell_m, raster.cell_m);
        let used = patrol.waypoints_used as usize;
        let rooms = patrol.rooms_used as usize;
        let same_rooms = rooms == self.rooms.len().min(MAX_ROOMS);
        if patrol.plan != self.atlas.plan_hash() || !same_raster || !same_rooms || used > MAX_WAYPOINTS {
            return Err(Nonsense);
        }
        self.new_round();
        self.restore_seen(&patrol.seen);
        for (k, point) in self.wishes.points.iter_mut().enumerate() {
            if patrol.points_waiting & bit(k) == 0 {
                *point = None;
            }
        }
        self.map.set_unmapped(&Bits::from_words(&patrol.unmapped));
        for door in 0..self.map.doors().len() {
            let (x, y) = self.map.doors()[door].middle();
            let marked = raster.cell(x, y).is_some_and(|cell| self.map.unmapped().get(&raster, cell));
            self.map.set_door(door, marked);
        }
        let there = patrol.waypoints[..used]
            .last()
            .map(|last| (last.x_m, last.y_m))
            .filter(|(x, y)| x.is_finite() && y.is_finite());
        let under_way = matches!(
            state,
            PatrolState::Planning
                | PatrolState::Flying
                | PatrolState::Returning
                | PatrolState::Landing
                | PatrolState::GoingThere
        );
        if patrol.coverage.is_finite() {
            self.kept = Some((patrol.coverage.clamp(0.0, 1.0), patrol.rooms[..rooms].to_vec()));
        }
        if under_way {
            self.plan();
        }
        Ok((state, there))
    }
}
