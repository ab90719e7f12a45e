//! What can be asked of a world: rays, clearances, what lies below.

use super::draw::{index, uniform};
use super::solid::{NO_OBJECT, Role, Solid, Surface};
use super::{CLEARANCE_CAP_M, Edge, World};
use rand::Rng;

/// First look this far around for the nearest solid, metres: enough almost always, and a handful of squares.
const FIRST_LOOK_M: f32 = 0.5;
/// A surface this little above the feet is still below them, metres.
const FOOT_M: f32 = 0.02;

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub struct RayHit {
    /// Distance along the ray, metres.
    pub range: f32,
    /// Outward unit normal of the surface, world frame.
    pub normal: [f32; 3],
    /// How the surface answers a sonar.
    pub surface: Surface,
    /// What it belongs to; `None` for the floor and the ceiling.
    pub role: Option<Role>,
    /// Radius of curvature of an upright mantle, metres; infinite for flat faces.
    pub curvature: f32,
}

/// The nearest solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest<'a> {
    /// Distance from the airframe's cylinder, metres; negative when it is inside.
    pub clearance: f32,
    /// What people call it.
    pub name: &'a str,
}

/// Nobody stands nearer than this to a drone that is put down somewhere, metres, as nobody does to the pad.
const ALONE_M: f32 = 1.5;

impl World {
    /// What a ray of unit direction meets first within `reach`.
    #[must_use]
    pub fn cast(&self, from: [f32; 3], along: [f32; 3], reach: f32) -> Option<RayHit> {
        let mut best: Option<RayHit> = None;
        let mut limit = reach;
        let level = if along[2] < 0.0 { 0.0 } else { self.ceiling };
        if along[2] != 0.0 {
            let t = ((level - from[2]) / along[2]).max(0.0);
            if t <= limit {
                limit = t;
                let normal = [0.0, 0.0, -along[2].signum()];
                best = Some(RayHit {
                    range: t,
                    normal,
                    surface: Surface::Hard,
                    role: None,
                    curvature: f32::INFINITY,
                });
            }
        }
        self.solid_index.walk((from[0], from[1]), (along[0], along[1]), limit, |ids, leave| {
            for id in ids {
                let solid = &self.solids[*id as usize];
                if let Some(meeting) = solid.meet(from, along, limit) {
                    limit = meeting.t;
                    let at = |axis: usize| from[axis] + meeting.t * along[axis];
                    let normal = match solid.role {
                        Role::Wall if meeting.face < 4 => self
                            .walls
                            .normal(*id as usize, meeting.face, at(0), at(1))
                            .unwrap_or(meeting.normal),
                        _ => meeting.normal,
                    };
                    best = Some(hit(solid, meeting.t, normal, meeting.face));
                }
            }
            limit > leave
        });
        for person in self.crowd.people() {
            let solid = person.solid();
            // Most people are far away: a circle test first.
            let (dx, dy) = (solid.x - from[0], solid.y - from[1]);
            if dx * dx + dy * dy > (limit + solid.half_x).powi(2) {
                continue;
            }
            if let Some(meeting) = solid.meet(from, along, limit) {
                limit = meeting.t;
                best = Some(hit(&solid, meeting.t, meeting.normal, meeting.face));
            }
        }
        best
    }

    /// Distance from an upright cylinder to the nearest solid, people and ceiling included, the floor not:
    /// negative by the depth when inside, at most [`CLEARANCE_CAP_M`]. `bottom` is the cylinder's lowest
    /// point above the floor.
    #[must_use]
    pub fn clearance(&self, x: f32, y: f32, bottom: f32, height: f32, radius: f32) -> f32 {
        self.search(x, y, bottom, height, radius).0
    }

    /// The same, and what it is.
    #[must_use]
    pub fn nearest(&self, x: f32, y: f32, bottom: f32, height: f32, radius: f32) -> Nearest<'_> {
        let (clearance, what) = self.search(x, y, bottom, height, radius);
        let name = match what {
            What::Nothing => "nothing near",
            What::Ceiling => "the ceiling",
            What::Person => "a person",
            What::Solid(id) => {
                let solid = &self.solids[id as usize];
                match solid.role {
                    Role::Wall => "a wall",
                    Role::Lintel => "the wall over a door",
                    _ => self.objects.get(solid.object as usize).map_or("something", |o| &o.name),
                }
            }
        };
        Nearest { clearance, name }
    }

    /// The same for what stands still, people and ceiling left out.
    #[must_use]
    pub fn still_clearance(&self, x: f32, y: f32, bottom: f32, height: f32, radius: f32) -> f32 {
        let best = (CLEARANCE_CAP_M, What::Nothing);
        self.search_solids(x, y, (bottom, bottom + height), radius, best).0
    }

    fn search(&self, x: f32, y: f32, bottom: f32, height: f32, radius: f32) -> (f32, What) {
        let top = bottom + height;
        let mut best = (CLEARANCE_CAP_M, What::Nothing);
        if self.ceiling - top < best.0 {
            best = (self.ceiling - top, What::Ceiling);
        }
        for person in self.crowd.people() {
            let clearance = person.solid().clearance(x, y, bottom, top, radius);
            if clearance < best.0 {
                best = (clearance, What::Person);
            }
        }
        self.search_solids(x, y, (bottom, top), radius, best)
    }

    fn search_solids(
        &self,
        x: f32,
        y: f32,
        span: (f32, f32),
        radius: f32,
        mut best: (f32, What),
    ) -> (f32, What) {
        for look in [FIRST_LOOK_M, CLEARANCE_CAP_M] {
            self.solid_index.around(x, y, radius + look, |id| {
                let solid = &self.solids[id as usize];
                if solid.role != Role::SoftFloor {
                    let clearance = solid.clearance(x, y, span.0, span.1, radius);
                    if clearance < best.0 {
                        best = (clearance, What::Solid(id));
                    }
                }
            });
            if best.0 <= look {
                break;
            }
        }
        best
    }

    /// The solids that may stand at a place: all that reach into its square of the index.
    pub(crate) fn solids_at(&self, x: f32, y: f32) -> impl Iterator<Item = &Solid> {
        self.solid_index.at(x, y).iter().filter_map(|id| self.solids.get(*id as usize))
    }

    /// Height of the highest surface under a point, carpets included: what the down sonar sees and what a
    /// landing lands on. The floor is 0.
    #[must_use]
    pub fn surface_below(&self, x: f32, y: f32, z: f32) -> f32 {
        self.solid_index
            .at(x, y)
            .iter()
            .map(|id| &self.solids[*id as usize])
            .filter(|solid| solid.top <= z + FOOT_M && solid.outline_distance(x, y) <= 0.0)
            .map(|solid| solid.top)
            .fold(0.0, f32::max)
    }

    /// Distance from a place to the nearest solid at flight height, people not counted, metres; for gusts,
    /// which are stronger near walls. Large outside the plan.
    #[must_use]
    pub fn wall_distance(&self, x: f32, y: f32) -> f32 {
        self.ground
            .cell_at(x, y)
            .map(|(column, row)| row * self.ground.width() + column)
            .and_then(|cell| self.flight_distance.get(cell))
            .map_or(f32::MAX, |d| d.min(f32::MAX))
    }

    /// Whether a place is inside the building and nothing stands there at flight height.
    #[must_use]
    pub fn is_free_in_flight(&self, x: f32, y: f32) -> bool {
        let cell = self.ground.cell_at(x, y).map(|(column, row)| row * self.ground.width() + column);
        cell.is_some_and(|cell| self.ground.is_free_in_flight(cell))
    }

    /// A place on free floor, at least `clearance` metres from every solid, with a random heading, from which a disc of
    /// `radius` can fly to the pad: where a flight starts that does not start on the pad.
    pub fn draw_start<R: Rng + ?Sized>(&self, radius: f32, clearance: f32, rng: &mut R) -> super::PadPlace {
        let ground = &self.ground;
        let reached = ground.flood(self.pad.x, self.pad.y, |cell| self.flight_distance[cell] > radius);
        let places: Vec<usize> = (0..reached.len())
            .filter(|cell| {
                reached[*cell] && self.flight_distance[*cell] > clearance && ground.is_free_on_foot(*cell)
            })
            .collect();
        let heading = uniform(rng, -std::f32::consts::PI, std::f32::consts::PI);
        // Legs of furniture stand lower than flight height: some draws for a place without any.
        for _ in 0..200 {
            let Some(cell) = places.get(index(rng, places.len())) else { break };
            let (x, y) = ground.centre(cell % ground.width(), cell / ground.width());
            let alone = self.crowd.people().iter().all(|person| {
                let (px, py) = person.place();
                (px - x).hypot(py - y) > ALONE_M
            });
            if alone && self.still_clearance(x, y, 0.0, 1.5, clearance) >= 0.0 {
                return super::PadPlace { x, y, heading };
            }
        }
        super::PadPlace { heading, ..self.pad }
    }

    /// Calls `act` with each upright edge in a rectangle (low x, low y, high x, high y).
    pub(crate) fn edges_within(&self, extent: [f32; 4], mut act: impl FnMut(&Edge)) {
        self.edge_index.within(extent, |id| act(&self.edges[id as usize]));
    }

    /// Calls `act` with each upright cylinder in a rectangle, people included. A cylinder may come twice.
    pub(crate) fn cylinders_within(&self, extent: [f32; 4], mut act: impl FnMut(&Solid)) {
        self.solid_index.within(extent, |id| {
            let solid = &self.solids[id as usize];
            if solid.shape == super::Shape::Cylinder {
                act(solid);
            }
        });
        for person in self.crowd.people() {
            let solid = person.solid();
            if solid.x > extent[0] && solid.y > extent[1] && solid.x < extent[2] && solid.y < extent[3] {
                act(&solid);
            }
        }
    }
}

#[derive(Clone, Copy)]
enum What {
    Nothing,
    Ceiling,
    Person,
    Solid(u32),
}

fn hit(solid: &Solid, range: f32, normal: [f32; 3], face: u8) -> RayHit {
    debug_assert!(solid.object == NO_OBJECT || solid.role != Role::Wall);
    let curvature = if face == 6 { solid.half_x } else { f32::INFINITY };
    RayHit { range, normal, surface: solid.surface, role: Some(solid.role), curvature }
}
