//! The world file, and the world that is built of it.

use super::{FILE, check_finite, refused, text_memory, within_memory};
use airframe::world::{AsBuilt, ClutterLevel, World, WorldFile};
use floorplan::{Plan, Sidecar};

/// A world of more things than this is read and not built, so that a search builds many.
const LITTLE_WORLD: usize = 40;

/// A world's TOML.
///
/// What loads can be built into a building of its plan, of solids that have a bottom and a top, and measured in.
pub fn world(data: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(data) else { return false };
    let file = match within_memory(text_memory(text.len()), || WorldFile::parse(FILE, text)) {
        Ok(file) => file,
        Err(error) => return refused(&error),
    };
    check_finite(&file);
    assert_eq!(file.file, FILE);
    assert!(file.person.len() <= 13 && file.person.iter().all(|person| (2..=64).contains(&person.way.len())));
    if file.solid.len() + file.table.len() + file.carpet.len() <= LITTLE_WORLD {
        build(&file);
    }
    true
}

/// Four by three metres.
const PLAN: [&str; 12] = [
    "################",
    "#              #",
    "#              #",
    "#              #",
    "#              #",
    "#      ##      #",
    "#      ##      #",
    "#              #",
    "#              #",
    "#              #",
    "#              #",
    "################",
];
const SIDE: &str = "pad: {x: 0.8, y: 0.8}\ndoors:\n  - {name: Store, a: [2.0, 0.25], b: [2.0, 1.25]}\n";

fn build(file: &WorldFile) {
    let plan = Plan::from_ascii(&PLAN, 0.25);
    let side = match Sidecar::parse("side", SIDE.as_bytes()) {
        Ok(side) => side,
        Err(error) => panic!("{error}"),
    };
    // One fixed seed: what is drawn is not what is looked for.
    let built = World::build_as(&plan, &side, file, ClutterLevel::None, 1, AsBuilt::exact());
    let mut world = match built {
        Ok(world) => world,
        // The plan's own errors name no file: there is one plan only.
        Err(error) => {
            let text = error.to_string();
            return assert!(!text.chars().any(char::is_control), "not one plain line: {text:?}");
        }
    };
    for solid in world.solids() {
        check_finite(solid);
        assert!(solid.bottom < solid.top, "{solid:?} has no height");
        assert!(solid.half_x > 0.0 && solid.half_y > 0.0, "{solid:?} has no size");
    }
    for second in 0..3 {
        let pad = world.pad();
        world.advance(f64::from(second), (pad.x, pad.y));
        let clearance = world.clearance(pad.x, pad.y, 0.0, 0.2, 0.1);
        assert!(clearance.is_finite());
        let hit = world.cast([pad.x, pad.y, 1.2], [1.0, 0.0, 0.0], 4.0);
        assert!(hit.is_none_or(|hit| (0.0..=4.0).contains(&hit.range)));
        assert!(world.surface_below(pad.x, pad.y, 1.2).is_finite());
    }
}
