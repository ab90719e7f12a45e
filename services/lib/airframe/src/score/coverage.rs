//! Coverage by DESIGN 5, on the true world: of the free cells within 3 m and line of sight of any place
//! that the disc + 0.15 m can reach from the pad, the fraction that came so near the drone.

use super::sight::Sight;
use crate::world::field::squared_distances;
use crate::world::{FLIGHT_BAND_M, World};

/// What counts as seen lies within this distance, metres.
pub const SEEN_M: f32 = 3.0;
/// Reachable places leave this much room around the disc, metres.
pub const ROOM_M: f32 = 0.15;

/// The drone looks around again after this way, metres: what could be seen from between only is a sliver.
const LOOK_M: f32 = 0.1;

/// Which cells ought to be seen and which were.
#[derive(Clone, Debug)]
pub struct Coverage {
    /// Cells that the drone's disc with room around it can be at.
    reachable: Vec<bool>,
    /// Cells that ought to be seen.
    wanted: Vec<bool>,
    seen: Vec<bool>,
    wanted_count: usize,
    seen_count: usize,
    reach: i32,
    last_look: Option<(f32, f32)>,
    /// Cells that were looked around from.
    looked: Vec<bool>,
    sight: Sight,
}

impl Coverage {
    /// What a disc of this radius ought to see in a world as its doors and objects are now; people do not
    /// count.
    #[must_use]
    pub fn new(world: &World, radius: f32) -> Self {
        let ground = world.ground();
        let (width, count) = (ground.width(), ground.width() * ground.height());
        let height = FLIGHT_BAND_M.1 - FLIGHT_BAND_M.0;
        let fits = |cell: usize| {
            let (x, y) = ground.centre(cell % width, cell / width);
            if !ground.is_free_in_flight(cell) {
                return false;
            }
            // The raster decides where it can; solids decide near the border.
            let rough = world.wall_distance(x, y);
            let needed = radius + ROOM_M;
            let doubt = 1.5 * ground.resolution();
            if rough > needed + doubt {
                true
            } else if rough < needed - doubt {
                false
            } else {
                world.still_clearance(x, y, FLIGHT_BAND_M.0, height, radius) >= ROOM_M
            }
        };
        let pad = world.pad();
        let reachable = ground.flood(pad.x, pad.y, fits);
        let reach = (SEEN_M / ground.resolution()).floor() as i32;
        // Sight goes over cells that nothing stands on: a shut room holds nothing that can be seen.
        let open = ground.flood(pad.x, pad.y, |cell| !ground.blocks_sight(cell));
        let near = squared_distances(width, ground.height(), |cell| reachable[cell]);
        let limit = (reach * reach) as f32;
        let mut sight = Sight::default();
        let mut wanted = vec![false; count];
        for cell in 0..count {
            if !ground.is_free_in_flight(cell) {
                continue;
            }
            let mut found = reachable[cell];
            if !found && near[cell] <= limit && touches(&open, width, cell) {
                // Almost always the nearest reachable place is in sight: a short look first.
                let short = (near[cell].sqrt() as i32 + 4).min(reach);
                for look in [short, reach] {
                    if !found {
                        sight.scan(ground, cell % width, cell / width, look, |other| {
                            found |= reachable[other];
                            !found
                        });
                    }
                }
            }
            wanted[cell] = found;
        }
        let wanted_count = wanted.iter().filter(|w| **w).count();
        Self {
            reachable,
            wanted,
            seen: vec![false; count],
            wanted_count,
            seen_count: 0,
            reach,
            last_look: None,
            looked: vec![false; count],
            sight,
        }
    }

    /// The drone is airborne at this place of the world frame.
    pub fn visit(&mut self, world: &World, x: f32, y: f32) {
        let ground = world.ground();
        let Some((column, row)) = ground.cell_at(x, y) else { return };
        let near = self.last_look.is_some_and(|(lx, ly)| (x - lx).hypot(y - ly) < LOOK_M);
        let here = row * ground.width() + column;
        if near || std::mem::replace(&mut self.looked[here], true) {
            return;
        }
        self.last_look = Some((x, y));
        let (seen, wanted, count) = (&mut self.seen, &self.wanted, &mut self.seen_count);
        self.sight.scan(ground, column, row, self.reach, |cell| {
            if wanted[cell] && !seen[cell] {
                seen[cell] = true;
                *count += 1;
            }
            true
        });
    }

    /// The fraction seen of what ought to be seen; 0 when nothing ought to.
    #[must_use]
    pub fn fraction(&self) -> f32 {
        self.seen_count as f32 / self.wanted_count.max(1) as f32
    }

    /// Cells that ought to be seen, by index of the ground's raster.
    #[must_use]
    pub fn wanted(&self) -> &[bool] {
        &self.wanted
    }

    /// Cells that were seen.
    #[must_use]
    pub fn seen(&self) -> &[bool] {
        &self.seen
    }

    /// Cells that the disc with its room can be at.
    #[must_use]
    pub fn reachable(&self) -> &[bool] {
        &self.reachable
    }
}

/// Whether a cell or one of its eight neighbours is marked.
fn touches(marked: &[bool], width: usize, cell: usize) -> bool {
    let (c, r) = ((cell % width) as isize, (cell / width) as isize);
    let height = (marked.len() / width) as isize;
    (-1..=1).any(|dr| {
        (-1..=1).any(|dc| {
            let (c, r) = (c + dc, r + dr);
            c >= 0 && r >= 0 && c < width as isize && r < height && marked[r as usize * width + c as usize]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{AsBuilt, ClutterLevel, PadEntry, WorldFile};
    use floorplan::{Plan, Sidecar};

    fn world(rows: &[&str], pad: (f32, f32)) -> World {
        let plan = Plan::from_ascii(rows, 0.1);
        let pad = Some(PadEntry { x_m: pad.0, y_m: pad.1, heading_deg: 0.0 });
        let file = WorldFile { pad, ..WorldFile::default() };
        World::build_as(&plan, &Sidecar::default(), &file, ClutterLevel::None, 1, AsBuilt::exact())
            .expect("a world")
    }

    /// Two rooms of 2.0 x 0.8 m; the passage between them is 0.6 m wide, or 0.2 m.
    const WIDE: [&str; 10] = [
        "###########################################",
        "#                    #                    #",
        "#                                         #",
        "#                                         #",
        "#                                         #",
        "#                                         #",
        "#                                         #",
        "#                                         #",
        "#                    #                    #",
        "###########################################",
    ];
    const NARROW: [&str; 10] = [
        "###########################################",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "#                                         #",
        "#                                         #",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "###########################################",
    ];
    const SHUT: [&str; 10] = [
        "###########################################",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "#                    #                    #",
        "###########################################",
    ];

    #[test]
    fn what_ought_to_be_seen_follows_the_disc_and_the_walls() {
        let wanted = |rows: &[&str]| Coverage::new(&world(rows, (1.0, 0.5)), 0.1).wanted_count;
        // A disc of 0.1 m with 0.15 m around it fits through 0.6 m and not through 0.2 m.
        assert_eq!(wanted(&WIDE), 20 * 8 * 2 + 6);
        assert_eq!(wanted(&SHUT), 20 * 8);
        let narrow = wanted(&NARROW);
        // Into the far room it can still look, not everywhere.
        assert!(narrow > 20 * 8 + 10 && narrow < 20 * 8 * 2, "{narrow}");
    }

    #[test]
    fn one_place_sees_its_room_and_the_far_corners_only_from_the_door() {
        let world = world(&WIDE, (1.0, 0.5));
        let mut coverage = Coverage::new(&world, 0.1);
        assert!(coverage.fraction() == 0.0);
        coverage.visit(&world, 0.5, 0.5);
        let first = coverage.fraction();
        // Its own room, and of the other one what lies within 3 m and not behind the wall's stumps.
        assert!(first > 0.5 && first < 0.9, "{first}");
        coverage.visit(&world, 3.0, 0.5);
        assert!(coverage.fraction() > 0.995, "{}", coverage.fraction());
    }

    #[test]
    fn sight_is_mutual() {
        let world = world(&NARROW, (1.0, 0.5));
        let ground = world.ground();
        let width = ground.width();
        let mut sight = Sight::default();
        let all: Vec<Vec<usize>> = (0..width * ground.height())
            .map(|cell| {
                let mut seen = Vec::new();
                if !ground.blocks_sight(cell) {
                    sight.scan(ground, cell % width, cell / width, 30, |other| {
                        seen.push(other);
                        true
                    });
                    seen.sort_unstable();
                }
                seen
            })
            .collect();
        for (cell, seen) in all.iter().enumerate() {
            for other in seen {
                assert!(all[*other].binary_search(&cell).is_ok(), "{cell} sees {other} and is not seen");
            }
        }
    }
}
