//! Draws the plans in `deploy/plans` from the lists below: `cargo run -p floorplan --example draw_demo DIR`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use image::{GrayImage, Luma};

/// Metres a cell.
const RESOLUTION: f64 = 0.05;
/// Unknown ground drawn around a building, metres.
const MARGIN: f64 = 0.5;
const FREE: u8 = 254;
const OCCUPIED: u8 = 0;
const UNKNOWN: u8 = 205;

/// x from, y from, x to, y to, metres in the plan frame.
type Rect = [f64; 4];

struct Building {
    name: &'static str,
    /// Width and depth over the outer walls, metres.
    size: [f64; 2],
    /// What reaches the ceiling.
    walls: &'static [Rect],
    /// Openings cut out of the walls, with their posts: the hinges first.
    doors: &'static [(&'static str, Rect, [f64; 2], [f64; 2])],
    /// What reaches the flight height of 1.2 m: pillars, cupboards, shelves. Lower things are not on a plan.
    furniture: &'static [Rect],
    rooms: &'static [(&'static str, Rect)],
    /// x, y, heading in degrees.
    pad: [f64; 3],
}

const DEMO: Building = Building {
    name: "demo",
    size: [26.0, 14.0],
    walls: &[
        // Around.
        [0.0, 0.0, 26.0, 0.15],
        [0.0, 13.85, 26.0, 14.0],
        [0.0, 0.0, 0.15, 14.0],
        [25.85, 0.0, 26.0, 14.0],
        // Along the corridor.
        [0.15, 5.9, 19.0, 6.0],
        [0.15, 8.0, 19.0, 8.1],
        // Between the southern rooms.
        [6.0, 0.15, 6.1, 5.9],
        [10.0, 0.15, 10.1, 5.9],
        [14.5, 0.15, 14.6, 5.9],
        // Between the northern rooms.
        [6.0, 8.1, 6.1, 13.85],
        [13.5, 8.1, 13.6, 13.85],
        // In front of the hall.
        [19.0, 0.15, 19.1, 13.85],
    ],
    doors: &[
        ("Lobby", [2.4, 5.9, 3.6, 6.0], [2.4, 5.95], [3.6, 5.95]),
        ("Hall", [19.0, 6.4, 19.1, 7.6], [19.05, 6.4], [19.05, 7.6]),
        ("Lobby to Office 1", [6.0, 1.2, 6.1, 2.1], [6.05, 1.2], [6.05, 2.1]),
        ("Office 1", [8.4, 5.9, 9.3, 6.0], [8.4, 5.95], [9.3, 5.95]),
        ("Office 2", [11.0, 5.9, 11.9, 6.0], [11.0, 5.95], [11.9, 5.95]),
        ("Store", [17.2, 5.9, 18.1, 6.0], [18.1, 5.95], [17.2, 5.95]),
        ("Store to Hall", [19.0, 2.0, 19.1, 2.9], [19.05, 2.0], [19.05, 2.9]),
        ("Meeting room", [4.4, 8.0, 5.3, 8.1], [5.3, 8.05], [4.4, 8.05]),
        ("Workshop", [8.9, 8.0, 9.8, 8.1], [8.9, 8.05], [9.8, 8.05]),
        ("Kitchen", [15.0, 8.0, 15.9, 8.1], [15.0, 8.05], [15.9, 8.05]),
        ("Kitchen to Hall", [19.0, 10.5, 19.1, 11.4], [19.05, 11.4], [19.05, 10.5]),
    ],
    furniture: &[
        // Lobby: lockers.
        [0.15, 3.9, 0.6, 5.5],
        // Office 1: a cupboard.
        [9.55, 0.15, 10.0, 1.6],
        // Office 2: shelves and a cupboard.
        [10.1, 1.6, 10.5, 3.6],
        [14.05, 0.15, 14.5, 1.35],
        // Store: racks.
        [14.6, 0.8, 15.05, 5.0],
        [16.5, 1.5, 16.95, 4.2],
        // Meeting room: a bookcase.
        [0.15, 9.6, 0.5, 12.0],
        // Workshop: a rack and a machine.
        [10.2, 13.35, 12.8, 13.85],
        [9.5, 10.7, 10.4, 11.4],
        // Kitchen: refrigerator and tall cupboards.
        [13.6, 13.15, 14.3, 13.85],
        [16.2, 13.3, 18.4, 13.85],
        // Hall: six pillars and a vending machine.
        [21.0, 2.8, 21.4, 3.2],
        [21.0, 6.8, 21.4, 7.2],
        [21.0, 10.8, 21.4, 11.2],
        [23.5, 2.8, 23.9, 3.2],
        [23.5, 6.8, 23.9, 7.2],
        [23.5, 10.8, 23.9, 11.2],
        [25.05, 8.6, 25.85, 9.6],
    ],
    rooms: &[
        ("Corridor", [0.15, 5.9, 19.0, 8.1]),
        ("Lobby", [0.15, 0.15, 6.0, 5.9]),
        ("Office 1", [6.0, 0.15, 10.0, 5.9]),
        ("Office 2", [10.1, 0.15, 14.5, 5.9]),
        ("Store", [14.6, 0.15, 19.0, 5.9]),
        ("Meeting room", [0.15, 8.1, 6.0, 13.85]),
        ("Workshop", [6.1, 8.1, 13.5, 13.85]),
        ("Kitchen", [13.6, 8.1, 19.0, 13.85]),
        ("Hall", [19.0, 0.15, 25.85, 13.85]),
    ],
    pad: [2.4, 2.2, 90.0],
};

const HALL: Building = Building {
    name: "hall",
    size: [8.3, 6.3],
    walls: &[[0.0, 0.0, 8.3, 0.15], [0.0, 6.15, 8.3, 6.3], [0.0, 0.0, 0.15, 6.3], [8.15, 0.0, 8.3, 6.3]],
    doors: &[],
    furniture: &[[2.6, 3.8, 3.0, 4.2], [5.6, 2.2, 6.0, 2.6]],
    rooms: &[("Hall", [0.15, 0.15, 8.15, 6.15])],
    pad: [1.65, 1.65, 0.0],
};

const TWO_ROOMS: Building = Building {
    name: "two-rooms",
    size: [9.3, 5.3],
    walls: &[
        [0.0, 0.0, 9.3, 0.15],
        [0.0, 5.15, 9.3, 5.3],
        [0.0, 0.0, 0.15, 5.3],
        [9.15, 0.0, 9.3, 5.3],
        [4.6, 0.15, 4.7, 5.15],
    ],
    doors: &[("East room", [4.6, 2.0, 4.7, 2.9], [4.65, 2.0], [4.65, 2.9])],
    furniture: &[[8.65, 0.15, 9.15, 1.6]],
    rooms: &[("West room", [0.15, 0.15, 4.6, 5.15]), ("East room", [4.6, 0.15, 9.15, 5.15])],
    pad: [1.9, 3.3, 0.0],
};

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args().nth(1).ok_or("which directory shall the plans be drawn into?")?;
    for building in [DEMO, HALL, TWO_ROOMS] {
        draw(&building, Path::new(&directory))?;
    }
    Ok(())
}

fn draw(building: &Building, directory: &Path) -> Result<(), Box<dyn Error>> {
    let [width, depth] = building.size;
    let cells = |metres: f64| (metres / RESOLUTION).round() as u32;
    let mut picture =
        GrayImage::from_pixel(cells(width + 2.0 * MARGIN), cells(depth + 2.0 * MARGIN), Luma([UNKNOWN]));
    fill(&mut picture, [0.0, 0.0, width, depth], FREE);
    for wall in building.walls {
        fill(&mut picture, *wall, OCCUPIED);
    }
    for (_, opening, _, _) in building.doors {
        fill(&mut picture, *opening, FREE);
    }
    for thing in building.furniture {
        fill(&mut picture, *thing, OCCUPIED);
    }
    let name = building.name;
    picture.save(directory.join(format!("{name}.png")))?;
    std::fs::write(directory.join(format!("{name}.yaml")), header(name))?;
    std::fs::write(directory.join(format!("{name}.rooms.yaml")), sidecar(building)?)?;
    Ok(())
}

fn fill(picture: &mut GrayImage, [x0, y0, x1, y1]: Rect, shade: u8) {
    let cell = |metres: f64| ((metres + MARGIN) / RESOLUTION).round() as u32;
    for y in cell(y0)..cell(y1) {
        for x in cell(x0)..cell(x1) {
            // The picture's first row is the top of the plan.
            let row = picture.height() - 1 - y;
            picture.put_pixel(x, row, Luma([shade]));
        }
    }
}

fn header(name: &str) -> String {
    format!(
        "# Drawn by services/lib/floorplan/examples/draw_demo.rs.\nimage: {name}.png\nmode: trinary\n\
         resolution: {RESOLUTION}\norigin: [-{MARGIN}, -{MARGIN}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n\
         free_thresh: 0.196\n"
    )
}

fn sidecar(building: &Building) -> Result<String, std::fmt::Error> {
    let mut text =
        String::from("# Drawn by services/lib/floorplan/examples/draw_demo.rs. Plan frame, metres.\n");
    let [x, y, heading] = building.pad;
    writeln!(text, "pad: {{x: {x}, y: {y}, heading_deg: {heading}}}")?;
    writeln!(text, "doors:{}", if building.doors.is_empty() { " []" } else { "" })?;
    for (name, _, a, b) in building.doors {
        writeln!(text, "  - {{name: {name}, a: [{}, {}], b: [{}, {}]}}", a[0], a[1], b[0], b[1])?;
    }
    writeln!(text, "rooms:")?;
    for (name, [x0, y0, x1, y1]) in building.rooms {
        writeln!(text, "  - {{name: {name}, rectangle: [{x0}, {y0}, {x1}, {y1}]}}")?;
    }
    Ok(text)
}
