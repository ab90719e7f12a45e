use super::*;
use crate::world::{AsBuilt, ClutterLevel, World, WorldFile};
use floorplan::{Door, Plan, Sidecar};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;

/// Two rooms of 4 m by 4 m, a door of 1 m between them, 20 cm a cell; the drone looks from the left one to the door.
fn world() -> World {
    let mut rows = vec!["#".repeat(42)];
    for row in 0..20 {
        let wall = if (8..13).contains(&row) { ' ' } else { '#' };
        rows.push(format!("#{}{wall}{}#", " ".repeat(20), " ".repeat(19)));
    }
    rows.push("#".repeat(42));
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let plan = Plan::from_ascii(&rows, 0.2);
    let text = "name = \"rooms\"\npad = { x_m = 1.0, y_m = 1.0, heading_deg = 0.0 }\n\
                [[table]]\nname = \"table\"\nx_m = 2.6\ny_m = 3.4\nlength_m = 0.8\nwidth_m = 0.8\n";
    let file = WorldFile::parse("rooms.toml", text).unwrap();
    let side = Sidecar {
        doors: vec![Door { name: "door".to_owned(), a: (4.3, 1.8), b: (4.3, 2.8) }],
        ..Sidecar::default()
    };
    World::build_as(&plan, &side, &file, ClutterLevel::None, 1, AsBuilt::exact()).unwrap()
}

fn lens() -> Lens {
    Lens { x_m: 0.0, y_m: 0.0, z_m: 0.0, elevation_rad: 0.0, field_of_view_rad: 1.1 }
}

struct Shown([Vec<u8>; 3]);

impl Shown {
    fn luma(&self, x: usize, y: usize) -> i32 {
        i32::from(self.0[0][y * WIDTH + x])
    }
    fn colour(&self, x: usize, y: usize) -> (i32, i32) {
        let at = y / 2 * (WIDTH / 2) + x / 2;
        (i32::from(self.0[1][at]), i32::from(self.0[2][at]))
    }
}

fn draw(camera: &mut Camera, pose: Pose6, people: &[Figure], doors_shut: u64) -> Shown {
    let mut planes = [vec![0; WIDTH * HEIGHT], vec![0; WIDTH * HEIGHT / 4], vec![0; WIDTH * HEIGHT / 4]];
    let [luma, blue, red] = &mut planes;
    let mut canvas = Canvas { width: WIDTH, height: HEIGHT, stride: WIDTH, planes: [luma, blue, red] };
    let moment = Moment { pose, time_s: 0.25, people, doors_shut, noise: 3 };
    assert!(camera.draw(&moment, &mut canvas));
    Shown(planes)
}

fn at_the_door() -> Pose6 {
    Pose6::level(1.5, 2.3, 1.2, 0.0)
}

#[test]
fn what_a_pixel_shows_is_what_a_ray_through_it_meets() {
    let world = world();
    let mut camera = Camera::new(&world, lens(), Light::Day);
    let pose = Pose6 { roll: 0.15, pitch: -0.1, ..Pose6::level(1.3, 1.6, 1.1, 0.4) };
    draw(&mut camera, pose, &[], 0);
    let look = Look::new(&pose, &lens(), WIDTH, HEIGHT);
    let (mut looked, mut differ) = (0, 0);
    for row in (3..HEIGHT).step_by(7) {
        let (_, nearness) = camera.raster.row(row);
        for column in (2..WIDTH).step_by(5) {
            let ray = look.ray(column as f32 + 0.5, row as f32 + 0.5);
            let length = look::dot(ray, ray).sqrt();
            let hit = world.cast(look.eye, ray.map(|v| v / length), 30.0).unwrap();
            let ahead = hit.range / length;
            looked += 1;
            // Frames of doors and edges of things are the camera's own.
            differ += u32::from((1.0 / nearness[column] - ahead).abs() > 0.03);
        }
    }
    assert!(looked > 2000 && differ * 20 < looked, "{differ} of {looked}");
}

#[test]
fn a_shut_door_and_a_person_hide_the_next_room() {
    let mut camera = Camera::new(&world(), lens(), Light::Day);
    let open = draw(&mut camera, at_the_door(), &[], 0);
    let shut = draw(&mut camera, at_the_door(), &[], 1);
    let somebody = Figure { x: 3.2, y: 2.3, height: 1.75, heading: 3.0 };
    let person = draw(&mut camera, at_the_door(), &[somebody], 0);
    let middle = (WIDTH / 2, HEIGHT / 2);
    let red = |shown: &Shown| shown.colour(middle.0, middle.1).1;
    assert!(red(&shut) > red(&open) + 15, "a wooden leaf is redder than the wall behind it");
    let blue = |shown: &Shown| shown.colour(middle.0, middle.1).0;
    assert!(blue(&person) > blue(&open) + 15, "a blue coat");
    // The head is where 1.75 m at 1.7 m ahead comes to lie.
    let (top, focal) = ((1.75f32 - 1.2) / 1.7, WIDTH as f32 * 0.5 / 0.55f32.tan());
    let head = (HEIGHT as f32 * 0.5 - focal * (top - 0.06)) as usize;
    assert_ne!(person.luma(middle.0, head) / 8, open.luma(middle.0, head) / 8);
}

#[test]
fn the_horizon_tilts_with_the_body() {
    let mut camera = Camera::new(&world(), lens(), Light::Day);
    // Where the light upper half of the wall begins, in a column.
    let edge = |shown: &Shown, column: usize| {
        (HEIGHT / 4..HEIGHT).find(|row| shown.luma(column, *row) < shown.luma(column, row - 6) - 25)
    };
    let level = draw(&mut camera, Pose6::level(1.5, 1.2, 1.2, 0.0), &[], 1);
    let right_down = draw(&mut camera, Pose6 { roll: 0.2, ..Pose6::level(1.5, 1.2, 1.2, 0.0) }, &[], 1);
    // The wall beside the door.
    let (left, right) = (WIDTH / 2 + 10, WIDTH * 3 / 4);
    let slope = |shown: &Shown| edge(shown, right).unwrap() as f32 - edge(shown, left).unwrap() as f32;
    assert!(slope(&level).abs() < 4.0, "{}", slope(&level));
    // The right side is down, so the world turns the other way: what is on the right rises.
    let expected = -0.2f32.tan() * (right - left) as f32;
    assert!((slope(&right_down) - expected).abs() < 5.0, "{} against {expected}", slope(&right_down));
}

#[test]
fn a_night_picture_has_no_colour_and_is_darker_farther_away() {
    let mut camera = Camera::new(&world(), lens(), Light::Night);
    let bright = |x: f32, camera: &mut Camera| {
        let shown = draw(camera, Pose6::level(x, 1.0, 1.5, 0.0), &[], 1);
        assert!(shown.0[1].iter().chain(&shown.0[2]).all(|v| *v == 128));
        let patch = (100..140).flat_map(|column| (90..120).map(move |row| (column, row)));
        patch.map(|(column, row)| shown.luma(column, row)).sum::<i32>() / 1200
    };
    let (near, far) = (bright(3.2, &mut camera), bright(0.6, &mut camera));
    assert!(near > 120 && far < near - 50, "{near} at one metre, {far} at three and a half");
}

#[test]
fn equal_moments_give_equal_bytes_and_noise_goes_by_its_seed() {
    let world = world();
    let shot = |noise| {
        let mut camera = Camera::new(&world, lens(), Light::Day);
        let mut planes = [vec![0; WIDTH * HEIGHT], vec![0; WIDTH * HEIGHT / 4], vec![0; WIDTH * HEIGHT / 4]];
        let [luma, blue, red] = &mut planes;
        let mut canvas = Canvas { width: WIDTH, height: HEIGHT, stride: WIDTH, planes: [luma, blue, red] };
        let moment = Moment { pose: at_the_door(), time_s: 0.0, people: &[], doors_shut: 0, noise };
        assert!(camera.draw(&moment, &mut canvas));
        planes
    };
    assert_eq!(shot(1), shot(1));
    assert_ne!(shot(1), shot(2));
}

#[test]
fn a_canvas_that_does_not_hold_its_picture_is_refused() {
    let mut camera = Camera::new(&world(), lens(), Light::Day);
    let moment = Moment { pose: at_the_door(), time_s: 0.0, people: &[], doors_shut: 0, noise: 0 };
    for (width, height, stride) in [(66, 64, 64), (64, 65, 64), (0, 0, 0), (63, 64, 64), (64, 66, 64)] {
        let (mut luma, mut blue, mut red) = (vec![0; 64 * 64], vec![0; 1024], vec![0; 1024]);
        let planes = [&mut luma[..], &mut blue[..], &mut red[..]];
        let mut canvas = Canvas { width, height, stride, planes };
        assert!(!camera.draw(&moment, &mut canvas), "{width}x{height}, {stride}");
    }
}

#[test]
fn a_bar_code_is_read_back_and_a_picture_without_one_says_so() {
    for (width, height) in [(640, 480), (1280, 720), (1920, 1080)] {
        let mut luma = vec![90; width * height];
        assert_eq!(bar_code::read(&luma, width, width), None);
        for number in [0, 1, 0xdead_beef, u32::MAX, 0x8000_0000] {
            assert!(bar_code::draw(&mut luma, width, width, height, number));
            assert_eq!(bar_code::read(&luma, width, width), Some(number));
        }
        // One cell turned: the check does not fit.
        let side = bar_code::cell_side(width);
        let wrong = luma[side / 2 * width + 5 * side + side / 2] < 128;
        for line in luma.chunks_exact_mut(width).take(side) {
            line[5 * side..6 * side].fill(if wrong { 235 } else { 16 });
        }
        assert_eq!(bar_code::read(&luma, width, width), None);
    }
    assert!(!bar_code::draw(&mut [0; 100], 10, 10, 10, 1));
}
