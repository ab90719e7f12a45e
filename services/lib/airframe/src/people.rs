//! People: they walk where they like, keep off the furniture, and stop for a drone in front of them.

mod way;

use crate::world::draw::{index, uniform};
use crate::world::{AsBuilt, ClutterLevel, Ground, PadPlace, Role, Solid, Surface, WorldFile};
use rand::Rng;
use way::Walker;

/// People of full clutter (DESIGN 5).
pub const PEOPLE: usize = 3;
/// Walking speeds, metres a second (DESIGN 6).
pub const SPEED_M_S: (f32, f32) = (0.5, 1.4);
/// They stop for a drone within this distance ahead, centre to centre, metres (DESIGN 6).
pub const STOP_M: f32 = 0.8;
/// *Ahead* is this much to either side of where they walk, as a cosine (75 degrees).
const AHEAD_COS: f32 = 0.26;
/// Whoever has waited so long for the drone to go away turns round, seconds.
const PATIENCE_S: f32 = 5.0;
/// Shoulders, coat and bag.
const RADIUS_M: f32 = 0.25;
/// A person's height.
const HEIGHT_M: (f32, f32) = (1.55, 1.85);
/// Nobody walks this near to the pad, metres.
const PAD_FREE_M: f32 = 1.5;
/// Places that one person walks to before beginning again.
const PLACES: usize = 4;
/// Longest step in which people are moved: at 1.4 m/s that is 3 cm.
const STEP_S: f64 = 0.02;
/// A stop at a place of the way, seconds.
const PAUSE_S: (f32, f32) = (0.0, 4.0);

/// Somebody who walks.
#[derive(Clone, Debug)]
pub struct Person {
    /// Name for people.
    pub name: String,
    x: f32,
    y: f32,
    height: f32,
    speed: f32,
    pause: f32,
    /// Corners of the way, and whether the last leads to the first.
    way: Vec<(f32, f32)>,
    circle: bool,
    /// The corner that is walked to, and the direction along the list.
    target: usize,
    forward: bool,
    /// Seconds still to stand; whether it is for the drone, and the patience used up on it, seconds.
    standing: f32,
    halted: bool,
    waited: f32,
    /// Of a visitor, who walks straight up to the drone: how near, metres.
    up_to: Option<f32>,
}

impl Person {
    /// Where the person is, world frame.
    #[must_use]
    pub fn place(&self) -> (f32, f32) {
        (self.x, self.y)
    }

    /// Whether the person has a step to make now, rather than standing.
    #[must_use]
    pub fn walks(&self) -> bool {
        self.standing <= 0.0 && !self.halted && (self.up_to.is_some() || self.way.len() > 1)
    }

    /// Where the person walks, or would, radians from world x.
    #[must_use]
    pub fn heading(&self) -> f32 {
        let (tx, ty) = self.way.get(self.target).copied().unwrap_or((self.x + 1.0, self.y));
        (ty - self.y).atan2(tx - self.x)
    }

    /// From the floor to the top of the head, metres.
    #[must_use]
    pub fn height(&self) -> f32 {
        self.height
    }

    /// The person as a solid: a coat, and soft.
    #[must_use]
    pub fn solid(&self) -> Solid {
        Solid::new_cylinder((self.x, self.y), RADIUS_M, 0.0, self.height)
            .with_surface(Surface::Soft)
            .with_role(Role::Person)
    }

    fn next(&mut self) {
        let n = self.way.len();
        if self.circle {
            self.target = if self.forward { (self.target + 1) % n } else { (self.target + n - 1) % n };
            return;
        }
        if (self.forward && self.target + 1 >= n) || (!self.forward && self.target == 0) {
            self.forward = !self.forward;
        }
        self.target = if self.forward { (self.target + 1).min(n - 1) } else { self.target.saturating_sub(1) };
    }

    fn turn_round(&mut self) {
        self.forward = !self.forward;
        self.next();
    }

    fn walk_up(&mut self, dt: f32, drone: (f32, f32), up_to: f32) {
        let (dx, dy) = (drone.0 - self.x, drone.1 - self.y);
        let away = dx.hypot(dy);
        self.halted = away <= up_to;
        if !self.halted {
            let stride = (self.speed * dt).min(away - up_to);
            self.x += dx / away * stride;
            self.y += dy / away * stride;
        }
    }

    fn step(&mut self, dt: f32, drone: (f32, f32)) {
        if let Some(up_to) = self.up_to {
            self.walk_up(dt, drone, up_to);
            return;
        }
        if self.way.len() < 2 {
            return;
        }
        if self.standing > 0.0 {
            self.standing -= dt;
            return;
        }
        let (tx, ty) = self.way[self.target];
        let (dx, dy) = (tx - self.x, ty - self.y);
        let left = dx.hypot(dy);
        let stride = self.speed * dt;
        if left <= stride {
            (self.x, self.y) = (tx, ty);
            let end = !self.circle && (self.target == 0 || self.target + 1 == self.way.len());
            if end {
                self.standing = self.pause;
            }
            self.next();
            return;
        }
        let (ux, uy) = (dx / left, dy / left);
        let (ex, ey) = (drone.0 - self.x, drone.1 - self.y);
        let away = ex.hypot(ey);
        self.halted = away < STOP_M && ex * ux + ey * uy > AHEAD_COS * away;
        if self.halted {
            self.waited += dt;
            if self.waited > PATIENCE_S {
                self.waited = 0.0;
                self.turn_round();
            }
            return;
        }
        // A step made because the drone swayed is no walk: patience comes back as slowly as it goes.
        self.waited = (self.waited - dt).max(0.0);
        self.x += ux * stride;
        self.y += uy * stride;
    }
}

/// Everybody.
#[derive(Clone, Debug, Default)]
pub struct Crowd {
    people: Vec<Person>,
    now_s: f64,
}

impl Crowd {
    /// The people of the world file, and those of full clutter who cross the route.
    pub(crate) fn drawn<R: Rng + ?Sized>(
        ground: &Ground,
        pad: PadPlace,
        file: &WorldFile,
        built: &AsBuilt,
        level: ClutterLevel,
        rng: &mut R,
    ) -> Self {
        let mut people = Vec::new();
        let strangers = if level == ClutterLevel::Full { PEOPLE } else { 0 };
        if strangers == 0 && file.person.is_empty() {
            return Self::default();
        }
        let mut walker = Walker::new(ground, pad, RADIUS_M, PAD_FREE_M);
        for entry in &file.person {
            let places: Vec<_> = entry.way.iter().map(|[x, y]| built.place(*x, *y)).collect();
            let way = walker.join(&places, entry.circle);
            people.extend(person(entry.name.clone(), way, entry.circle, entry.speed_m_s, rng));
        }
        for number in 0..strangers {
            let places = walker.draw_places(PLACES, rng);
            let way = walker.join(&places, true);
            let speed = uniform(rng, SPEED_M_S.0, SPEED_M_S.1);
            people.extend(person(format!("passer-by {}", number + 1), way, true, speed, rng));
        }
        Self { people, now_s: 0.0 }
    }

    /// All of them.
    #[must_use]
    pub fn people(&self) -> &[Person] {
        &self.people
    }

    /// Somebody appears who walks straight up to the drone, as near as `up_to` (centre to centre, metres), and stays
    /// with it. Nothing in the way is walked around.
    pub(crate) fn enter(&mut self, name: &str, place: (f32, f32), speed: f32, up_to: f32) {
        self.people.push(Person {
            name: name.to_owned(),
            x: place.0,
            y: place.1,
            height: 0.5 * (HEIGHT_M.0 + HEIGHT_M.1),
            speed,
            pause: 0.0,
            way: Vec::new(),
            circle: false,
            target: 0,
            forward: true,
            standing: 0.0,
            halted: false,
            waited: 0.0,
            up_to: Some(up_to),
        });
    }

    /// Whoever has this name is gone.
    pub(crate) fn leave(&mut self, name: &str) {
        self.people.retain(|person| person.name != name);
    }

    pub(crate) fn advance(&mut self, now_s: f64, drone: (f32, f32)) {
        // A clock that jumps (a pause in a debugger) must not teleport anybody far.
        self.now_s = self.now_s.max(now_s - 1.0);
        while self.now_s < now_s {
            let dt = (now_s - self.now_s).min(STEP_S);
            self.now_s += dt;
            for person in &mut self.people {
                person.step(dt as f32, drone);
            }
        }
    }
}

fn person<R: Rng + ?Sized>(
    name: String,
    way: Vec<(f32, f32)>,
    circle: bool,
    speed: f32,
    rng: &mut R,
) -> Option<Person> {
    // The draws come first: the others must not depend on whether there is a way.
    let height = uniform(rng, HEIGHT_M.0, HEIGHT_M.1);
    let pause = uniform(rng, PAUSE_S.0, PAUSE_S.1);
    let start = index(rng, way.len());
    let &(x, y) = way.get(start)?;
    let mut person = Person {
        name,
        x,
        y,
        height,
        speed,
        pause,
        way,
        circle,
        target: start,
        forward: true,
        standing: 0.0,
        halted: false,
        waited: 0.0,
        up_to: None,
    };
    person.next();
    Some(person)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker_along_x() -> Person {
        Person {
            name: "Ana".into(),
            x: 0.0,
            y: 0.0,
            height: 1.7,
            speed: 1.0,
            pause: 0.0,
            way: vec![(0.0, 0.0), (5.0, 0.0)],
            circle: false,
            target: 1,
            forward: true,
            standing: 0.0,
            halted: false,
            waited: 0.0,
            up_to: None,
        }
    }

    #[test]
    fn a_visitor_walks_up_to_the_drone_and_stays_at_arms_length() {
        let mut crowd = Crowd::default();
        crowd.enter("guard", (4.0, 0.0), 1.0, 0.8);
        let gap = |crowd: &Crowd, drone: f32| crowd.people[0].place().0 - drone;
        (1..=100).for_each(|tick| crowd.advance(f64::from(tick) * 0.02, (0.0, 0.0)));
        assert!((gap(&crowd, 0.0) - 2.0).abs() < 0.05, "{}", gap(&crowd, 0.0));
        // The drone backs off by half a metre; the visitor comes after it.
        (101..=300).for_each(|tick| crowd.advance(f64::from(tick) * 0.02, (-0.5, 0.0)));
        assert!((gap(&crowd, -0.5) - 0.8).abs() < 0.01, "{}", gap(&crowd, -0.5));
        crowd.leave("guard");
        assert!(crowd.people().is_empty());
    }

    #[test]
    fn people_stop_for_a_drone_ahead_and_not_for_one_behind_or_beside() {
        let far = (100.0, 0.0);
        let walk = |drone: (f32, f32)| {
            let mut crowd = Crowd { people: vec![walker_along_x()], now_s: 0.0 };
            for tick in 1..=100 {
                crowd.advance(f64::from(tick) * 0.02, drone);
            }
            crowd.people[0].x
        };
        assert!((walk(far) - 2.0).abs() < 0.05);
        assert!((walk((1.5, 0.0)) - 0.7).abs() < 0.05, "{}", walk((1.5, 0.0)));
        assert!((walk((-0.5, 0.0)) - 2.0).abs() < 0.05);
        assert!((walk((1.0, 0.85)) - 2.0).abs() < 0.05);
    }

    #[test]
    fn whoever_waits_too_long_turns_round() {
        let mut crowd = Crowd { people: vec![walker_along_x()], now_s: 0.0 };
        let mut furthest = 0.0f32;
        for tick in 1..=330 {
            crowd.advance(f64::from(tick) * 0.02, (2.0, 0.0));
            furthest = furthest.max(crowd.people[0].x);
        }
        assert!(furthest < 1.25 && crowd.people[0].x < 1.0, "{furthest} {}", crowd.people[0].x);
    }

    #[test]
    fn a_drone_that_sways_wears_patience_out_like_one_that_stands() {
        let mut crowd = Crowd { people: vec![walker_along_x()], now_s: 0.0 };
        for tick in 1..=400 {
            // 3 cm to and fro, once in two seconds.
            let sway = 0.03 * (f32::from(tick as u16) * 0.02 * core::f32::consts::PI).sin();
            crowd.advance(f64::from(tick) * 0.02, (2.0 + sway, 0.0));
        }
        assert!(crowd.people[0].x < 0.8, "{}", crowd.people[0].x);
    }
}
