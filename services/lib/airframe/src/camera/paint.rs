//! What things are painted like. The plan and the world file know nothing of colours: a thing's name decides, and a thing
//! that nobody has thought of gets a colour by its name all the same.

/// What is drawn on a face besides its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Pattern {
    #[default]
    Plain,
    /// Skirting board, a darker dado, a light upper half.
    Wall,
    /// Square tiles.
    Tiles,
    /// Square panels.
    Panels,
    /// Speckled cloth.
    Cloth,
    /// Horizontal seams: wood, cupboards.
    Seams,
    /// Shines by itself.
    Lamp,
}

/// Colour and pattern of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Paint {
    /// Share of the light that comes back, 0..1.
    pub albedo: f32,
    /// Blue and red difference of the colour in full light, -128..127.
    pub chroma: (f32, f32),
    /// The same in infra-red: cloth and leaves are bright there.
    pub infrared: f32,
    pub pattern: Pattern,
}

impl Paint {
    /// From a colour as a screen shows it, red, green and blue in 0..255.
    pub(super) const fn new(rgb: [u8; 3], pattern: Pattern) -> Self {
        let [r, g, b] = [rgb[0] as f32, rgb[1] as f32, rgb[2] as f32];
        let luma = 0.299 * r + 0.587 * g + 0.114 * b;
        let shown = luma / 255.0;
        // BT.601; a screen shows about the square of what a byte says.
        Self {
            albedo: shown * shown,
            chroma: (0.564 * (b - luma), 0.713 * (r - luma)),
            infrared: shown * shown,
            pattern,
        }
    }

    const fn bright_in_infrared(self, infrared: f32) -> Self {
        Self { infrared, ..self }
    }
}

pub(super) const WALL: Paint = Paint::new([226, 222, 208], Pattern::Wall);
pub(super) const LINTEL: Paint = Paint::new([226, 222, 208], Pattern::Plain);
pub(super) const FLOOR: Paint = Paint::new([150, 146, 140], Pattern::Tiles);
pub(super) const CEILING: Paint = Paint::new([232, 232, 228], Pattern::Panels);
pub(super) const LAMP: Paint = Paint::new([255, 252, 240], Pattern::Lamp);
pub(super) const DOOR_LEAF: Paint = Paint::new([158, 102, 58], Pattern::Seams);
pub(super) const DOOR_FRAME: Paint = Paint::new([70, 82, 104], Pattern::Plain);
pub(super) const STEEL: Paint = Paint::new([196, 200, 206], Pattern::Plain);
pub(super) const CARPET: Paint = Paint::new([122, 62, 66], Pattern::Cloth).bright_in_infrared(0.45);
pub(super) const SKIN: Paint = Paint::new([216, 170, 140], Pattern::Plain).bright_in_infrared(0.6);
pub(super) const HAIR: [Paint; 3] = [
    Paint::new([56, 38, 28], Pattern::Plain),
    Paint::new([28, 26, 28], Pattern::Plain),
    Paint::new([150, 120, 80], Pattern::Plain),
];
pub(super) const COATS: [Paint; 4] = [
    Paint::new([44, 84, 150], Pattern::Plain).bright_in_infrared(0.5),
    Paint::new([168, 52, 48], Pattern::Plain).bright_in_infrared(0.5),
    Paint::new([60, 120, 76], Pattern::Plain).bright_in_infrared(0.45),
    Paint::new([214, 168, 60], Pattern::Plain).bright_in_infrared(0.55),
];
pub(super) const TROUSERS: [Paint; 3] = [
    Paint::new([52, 56, 72], Pattern::Plain).bright_in_infrared(0.35),
    Paint::new([92, 84, 70], Pattern::Plain).bright_in_infrared(0.4),
    Paint::new([40, 40, 44], Pattern::Plain).bright_in_infrared(0.3),
];
pub(super) const SHOES: Paint = Paint::new([36, 32, 30], Pattern::Plain);

const WOOD: Paint = Paint::new([190, 146, 96], Pattern::Plain);
const CUPBOARD: Paint = Paint::new([176, 134, 90], Pattern::Seams);
const CARDBOARD: Paint = Paint::new([186, 146, 98], Pattern::Seams);
const LEAVES: Paint = Paint::new([62, 124, 58], Pattern::Cloth).bright_in_infrared(0.75);
const POT: Paint = Paint::new([164, 92, 66], Pattern::Plain);
const SOFA: Paint = Paint::new([84, 100, 128], Pattern::Cloth).bright_in_infrared(0.45);
const SEAT: Paint = Paint::new([62, 66, 76], Pattern::Plain);
const WHITE: Paint = Paint::new([230, 232, 234], Pattern::Plain);
const GLASS: Paint = Paint::new([150, 186, 196], Pattern::Plain);
const SHADE: Paint = Paint::new([236, 222, 180], Pattern::Plain);
const OTHERS: [Paint; 5] = [
    Paint::new([120, 132, 150], Pattern::Plain),
    Paint::new([160, 130, 110], Pattern::Plain),
    Paint::new([128, 142, 112], Pattern::Plain),
    Paint::new([170, 164, 150], Pattern::Plain),
    Paint::new([140, 108, 120], Pattern::Plain),
];

/// Words in a thing's name, and what it is painted like.
const KNOWN: [(&str, Paint); 21] = [
    ("table", WOOD),
    ("desk", WOOD),
    ("workbench", WOOD),
    ("bench", WOOD),
    ("pallet", WOOD),
    ("cupboard", CUPBOARD),
    ("shelf", CUPBOARD),
    ("box", CARDBOARD),
    ("carton", CARDBOARD),
    ("plant", LEAVES),
    ("palm", LEAVES),
    ("sofa", SOFA),
    ("coat", SOFA),
    ("chair", SEAT),
    ("refrigerator", WHITE),
    ("locker", STEEL),
    ("rack", STEEL),
    ("trolley", STEEL),
    ("case", GLASS),
    ("lamp", SHADE),
    ("pot", POT),
];

/// Paint of a part of the thing called `name`; `thin`: of a leg or a pole.
pub(super) fn of_thing(name: &str, thin: bool) -> Paint {
    let lower = name.to_lowercase();
    let plant = lower.contains("plant") || lower.contains("palm");
    if thin {
        return if plant { WOOD } else { STEEL };
    }
    if let Some((_, paint)) = KNOWN.iter().find(|(word, _)| lower.contains(word)) {
        return *paint;
    }
    let hash = lower.bytes().fold(7usize, |sum, byte| sum.wrapping_mul(31).wrapping_add(usize::from(byte)));
    OTHERS[hash % OTHERS.len()]
}
