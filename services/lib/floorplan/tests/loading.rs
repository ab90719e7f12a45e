#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! Plans as map_server writes them, and everything that can be wrong with one.

use floorplan::{Cell, DistanceField, PictureMode, Plan, PlanError, PlanHeader};

const HEADER: &str = "image: a.pgm\nresolution: 0.05\norigin: [-1.0, 2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

fn header(yaml: &str) -> Result<PlanHeader, PlanError> {
    PlanHeader::parse("a.yaml", yaml.as_bytes())
}

fn pgm(width: usize, shades: &[u8]) -> Vec<u8> {
    let mut bytes = format!("P5\n# drawn by a test\n{width} {}\n255\n", shades.len() / width).into_bytes();
    bytes.extend_from_slice(shades);
    bytes
}

fn load(yaml: &str, bytes: &[u8]) -> Result<Plan, PlanError> {
    Plan::load("a.yaml", &header(yaml)?, bytes)
}

fn sentence(result: Result<Plan, PlanError>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn the_first_row_of_the_picture_is_the_top_of_the_plan() {
    let plan = load(HEADER, &pgm(3, &[0, 254, 205, 254, 254, 254, 254, 254, 0])).unwrap();
    assert_eq!((plan.width(), plan.height(), plan.origin()), (3, 3, (-1.0, 2.0)));
    assert_eq!(plan.cell(0, 2), Cell::Occupied);
    assert_eq!(plan.cell(1, 2), Cell::Free);
    assert_eq!(plan.cell(2, 2), Cell::Unknown, "205 is map_server's unknown");
    assert_eq!(plan.cell(2, 0), Cell::Occupied);
    assert_eq!(plan.cell_at(-0.876, 2.01), Cell::Occupied);
    assert_eq!(plan.cell_at(-1.01, 2.01), Cell::Unknown, "outside");
    assert_eq!(plan.cell_index(f32::NAN, 2.0), None);
    let (x, y) = plan.centre(2, 0);
    assert!((x + 0.875).abs() < 1e-6 && (y - 2.025).abs() < 1e-6);
}

#[test]
fn negate_turns_light_and_dark() {
    for flag in ["1", "true"] {
        let yaml = HEADER.replace("negate: 0", &format!("negate: {flag}"));
        let plan = load(&yaml, &pgm(3, &[255, 0, 0, 0, 0, 0, 0, 0, 0])).unwrap();
        assert_eq!((plan.cell(0, 2), plan.cell(1, 1)), (Cell::Occupied, Cell::Free));
    }
}

#[test]
fn raw_values_are_percent() {
    let yaml = format!("{HEADER}mode: raw\n");
    assert_eq!(header(&yaml).unwrap().mode, PictureMode::Raw);
    let plan = load(&yaml, &pgm(3, &[0, 100, 255, 19, 50, 65, 0, 0, 0])).unwrap();
    assert_eq!(
        [plan.cell(0, 2), plan.cell(1, 2), plan.cell(2, 2)],
        [Cell::Free, Cell::Occupied, Cell::Unknown]
    );
    assert_eq!(
        [plan.cell(0, 1), plan.cell(1, 1), plan.cell(2, 1)],
        [Cell::Free, Cell::Unknown, Cell::Occupied]
    );
}

#[test]
fn a_plan_in_png_is_the_same_plan() {
    let shades = [0, 254, 205, 254, 254, 254, 254, 254, 0, 254, 0, 254];
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_raw(4, 3, shades.to_vec())
        .unwrap()
        .write_to(&mut png, image::ImageFormat::Png)
        .unwrap();
    let a = load(HEADER, &pgm(4, &shades)).unwrap();
    let b = load(HEADER, png.get_ref()).unwrap();
    assert_eq!(a.cells(), b.cells());
    assert_eq!(a.hash(), b.hash());
    let other = load(&HEADER.replace("0.05", "0.06"), png.get_ref()).unwrap();
    assert_ne!(a.hash(), other.hash(), "another scale is another plan");
}

#[test]
fn what_map_server_and_others_write_is_read() {
    let short =
        header("image: x.png\nresolution: 0.050000\norigin: [0.0, 0.0]\nsome_other_tool: yes\n").unwrap();
    assert_eq!((short.occupied_thresh, short.free_thresh, short.negate), (0.65, 0.196, false));
    assert_eq!(short.mode, PictureMode::Trinary);
}

#[test]
fn a_wrong_header_is_refused_with_the_field_and_what_is_allowed() {
    let cases = [
        ("image: a.pgm", "image: \"\"", "`image` is missing"),
        ("resolution: 0.05", "resolution: 0", "`resolution` is 0, allowed is 0.01 to 0.5 m a cell"),
        ("resolution: 0.05", "resolution: .nan", "`resolution` is NaN"),
        ("resolution: 0.05", "", "`resolution` is missing"),
        ("origin: [-1.0, 2, 0]", "origin: [1, 2, 0.5]", "`origin` turns the plan by 0.5 rad"),
        ("origin: [-1.0, 2, 0]", "origin: [1]", "`origin` is 1 numbers"),
        ("origin: [-1.0, 2, 0]", "origin: [1e30, 2, 0]", "allowed is -5000 to 5000 m"),
        ("negate: 0", "negate: 7", "negate is 7, allowed is 0 or 1"),
        ("free_thresh: 0.196", "free_thresh: 0.9", "allowed is below occupied_thresh"),
        ("free_thresh: 0.196", "free_thresh: -1", "`free_thresh` is -1, allowed is 0 to 1"),
        ("negate: 0", "mode: upside-down", "a.yaml: cannot be read"),
        ("image: a.pgm", "[[[", "a.yaml: cannot be read"),
    ];
    for (from, to, expected) in cases {
        let text = header(&HEADER.replace(from, to)).unwrap_err().to_string();
        assert!(text.starts_with("a.yaml: ") && text.contains(expected), "{to}: {text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
}

#[test]
fn a_wrong_picture_is_refused() {
    for bytes in [&b""[..], b"not a picture at all", b"P5\n10 10\n255\nshort"] {
        let text = sentence(load(HEADER, bytes));
        assert!(text.contains("the picture `a.pgm` is not a PGM or PNG image"), "{text}");
    }
    let text = sentence(load(HEADER, b"P5\n60000 60000\n255\n"));
    assert!(text.contains("60000 x 60000 cells"), "{text}");
    let text = sentence(load(HEADER, &pgm(1, &[254])));
    assert!(text.contains("1 x 1 cells"), "{text}");
    let text = sentence(load(HEADER, &pgm(3, &[0; 9])));
    assert!(text.contains("no cell of the plan is free"), "{text}");
}

#[test]
fn a_pad_must_stand_in_free_space() {
    let rows =
        ["############", "#          #", "#          #", "#         ?#", "#          #", "############"];
    let plan = Plan::from_ascii(&rows, 0.5);
    let field = DistanceField::new(&plan, 2.0);
    assert_eq!(plan.check_pad(&field, 3.0, 1.5, 0.5), Ok(()));
    let text = |x, y| plan.check_pad(&field, x, y, 0.5).unwrap_err().to_string();
    assert!(text(0.2, 0.2).contains("inside a wall"), "{}", text(0.2, 0.2));
    assert!(text(99.0, 0.2).contains("outside the plan"));
    assert!(text(5.25, 1.25).contains("in unknown space"));
    assert!(text(0.7, 1.5).contains("is 0.20 m from a wall, needed is 0.50 m"), "{}", text(0.7, 1.5));
}

/// A picture as a PNG of its own depth.
fn png(picture: &image::DynamicImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn middle_row(plan: &Plan) -> Vec<Cell> {
    (0..plan.width()).map(|ix| plan.cell(ix, 1)).collect()
}

#[test]
fn transparent_cells_are_unknown_in_scale_mode_and_shades_in_trinary() {
    // Black, white and grey, opaque; white and black, transparent.
    let row = [[0, 255], [254, 255], [205, 255], [254, 0], [0, 254]];
    let cells: Vec<u8> = [row, row, row].concat().concat();
    let picture = image::GrayAlphaImage::from_raw(5, 3, cells).unwrap();
    let bytes = png(&image::DynamicImage::ImageLumaA8(picture));
    let scale = load(&format!("{HEADER}mode: scale\n"), &bytes).unwrap();
    assert_eq!(middle_row(&scale), [Cell::Occupied, Cell::Free, Cell::Unknown, Cell::Unknown, Cell::Unknown]);
    let trinary = load(HEADER, &bytes).unwrap();
    assert_eq!(middle_row(&trinary), [Cell::Occupied, Cell::Free, Cell::Unknown, Cell::Free, Cell::Occupied]);
}

#[test]
fn a_picture_of_sixteen_bits_is_the_same_plan_and_no_percents() {
    let row = [0_u16, 254 * 257, 205 * 257, 65_535];
    let picture =
        image::ImageBuffer::<image::Luma<u16>, _>::from_raw(4, 3, [row, row, row].concat()).unwrap();
    let bytes = png(&image::DynamicImage::ImageLuma16(picture));
    let plan = load(HEADER, &bytes).unwrap();
    assert_eq!(middle_row(&plan), [Cell::Occupied, Cell::Free, Cell::Unknown, Cell::Free]);
    let said = sentence(load(&format!("{HEADER}mode: raw\n"), &bytes));
    assert!(
        said.contains("`mode` is raw with a 16-bit picture, allowed is raw with an 8-bit picture"),
        "{said}"
    );
}

#[test]
fn colours_and_other_white_points_are_read() {
    let row = [[0, 0, 0], [254, 254, 254], [205, 205, 205]];
    let picture = image::RgbImage::from_raw(3, 3, [row, row, row].concat().concat()).unwrap();
    let plan = load(HEADER, &png(&image::DynamicImage::ImageRgb8(picture))).unwrap();
    assert_eq!(middle_row(&plan), [Cell::Occupied, Cell::Free, Cell::Unknown]);
    // A PGM may say that 100 is white, or 1000 in two bytes.
    let hundred = [&b"P5\n3 3\n100\n"[..], &[0, 100, 80].repeat(3)].concat();
    assert_eq!(middle_row(&load(HEADER, &hundred).unwrap()), [Cell::Occupied, Cell::Free, Cell::Unknown]);
    let thousand = [&b"P5\n3 3\n1000\n"[..], &[0, 0, 3, 232, 3, 32].repeat(3)].concat();
    assert_eq!(middle_row(&load(HEADER, &thousand).unwrap()), [Cell::Occupied, Cell::Free, Cell::Unknown]);
}

#[test]
fn thresholds_are_the_headers() {
    let shades = [0, 100, 150, 200, 254].repeat(3);
    let at = |occupied: f64, free: f64| {
        let yaml = HEADER
            .replace("occupied_thresh: 0.65", &format!("occupied_thresh: {occupied}"))
            .replace("free_thresh: 0.196", &format!("free_thresh: {free}"));
        middle_row(&load(&yaml, &pgm(5, &shades)).unwrap())
    };
    use Cell::{Free, Occupied, Unknown};
    // Occupancies 1, 0.61, 0.41, 0.22 and 0.004.
    assert_eq!(at(0.65, 0.196), [Occupied, Unknown, Unknown, Unknown, Free]);
    assert_eq!(at(0.6, 0.25), [Occupied, Occupied, Unknown, Free, Free]);
    assert_eq!(at(0.4, 0.3), [Occupied, Occupied, Occupied, Free, Free]);
}

#[test]
fn a_message_is_one_plain_line_whatever_the_header_says() {
    let image = HEADER.replace("image: a.pgm", r#"image: "a\n\e[2Jb""#);
    let text = sentence(load(&image, b"no picture"));
    assert!(text.contains(r"`a\n\u{1b}[2Jb`") && !text.chars().any(char::is_control), "{text:?}");
}
