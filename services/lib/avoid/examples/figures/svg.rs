//! As much of SVG as the figures need. Numbers are written with one decimal, so that a picture is the same text each time.

use crate::world::World;
use std::fmt::Write;

pub const BLUE: &str = "#1f77b4";
pub const ORANGE: &str = "#e6700a";
pub const RED: &str = "#c22";
pub const GREEN: &str = "#2a8a2a";
pub const GREY: &str = "#888";
const STONE: &str = "#777";

/// Pixels around a panel: for its numbers and its title.
const LEFT: f32 = 46.0;
const TOP: f32 = 34.0;
const BELOW: f32 = 40.0;
const RIGHT: f32 = 14.0;

/// A picture being drawn.
pub struct Svg {
    body: String,
    width: f32,
    height: f32,
}

/// A rectangle of the picture in which data lie.
#[derive(Clone, Copy)]
pub struct Panel {
    left: f32,
    bottom: f32,
    x0: f32,
    y0: f32,
    /// Pixels a unit.
    sx: f32,
    sy: f32,
    x1: f32,
    y1: f32,
}

impl Panel {
    fn at(&self, (x, y): (f32, f32)) -> (f32, f32) {
        (self.left + (x - self.x0) * self.sx, self.bottom - (y - self.y0) * self.sy)
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

impl Svg {
    pub fn new() -> Self {
        Self { body: String::new(), width: 0.0, height: 0.0 }
    }

    fn put(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    /// A panel to the right of what is there, `width` x `height` pixels, for data in these ranges.
    pub fn panel(&mut self, title: &str, (width, height): (f32, f32), x: (f32, f32), y: (f32, f32)) -> Panel {
        let left = self.width + LEFT;
        let panel = Panel {
            left,
            bottom: TOP + height,
            x0: x.0,
            y0: y.0,
            sx: width / (x.1 - x.0),
            sy: height / (y.1 - y.0),
            x1: x.1,
            y1: y.1,
        };
        self.width = left + width + RIGHT;
        self.height = self.height.max(TOP + height + BELOW);
        self.words((left, TOP - 12.0), "start", 13.0, "#000", title);
        panel
    }

    /// A panel with equal scales, `pixels` a metre, that shows a world.
    pub fn plan(&mut self, title: &str, pixels: f32, world: &World) -> Panel {
        let (width, height) = world.size();
        let panel = self.panel(title, (pixels * width, pixels * height), (0.0, width), (0.0, height));
        for (x, y, length) in world.solids() {
            self.rect(&panel, (x, y), (x + length, y + crate::world::TILE), STONE);
        }
        self.axes(&panel, "x, m", "y, m", (1.0, 1.0));
        panel
    }

    /// Frame and numbers each so many units.
    pub fn axes(&mut self, panel: &Panel, x: &str, y: &str, (step_x, step_y): (f32, f32)) {
        let (left, top) = panel.at((panel.x0, panel.y1));
        let (right, bottom) = panel.at((panel.x1, panel.y0));
        self.put(&format!(
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"#000\" \
             stroke-width=\"0.7\"/>",
            right - left,
            bottom - top
        ));
        let ticks = |from: f32, to: f32, step: f32| {
            let first = (from / step).ceil() as i32;
            (first..=(to / step + 1e-3).floor() as i32).map(move |i| i as f32 * step)
        };
        let number = |v: f32| if v.fract() == 0.0 { format!("{v:.0}") } else { format!("{v:.1}") };
        for v in ticks(panel.x0, panel.x1, step_x) {
            let (px, _) = panel.at((v, panel.y0));
            self.words((px, bottom + 13.0), "middle", 10.0, "#000", &number(v));
        }
        for v in ticks(panel.y0, panel.y1, step_y) {
            let (_, py) = panel.at((panel.x0, v));
            self.words((left - 5.0, py + 3.5), "end", 10.0, "#000", &number(v));
        }
        self.words((0.5 * (left + right), bottom + 29.0), "middle", 11.0, "#000", x);
        let (cx, cy) = (left - 32.0, 0.5 * (top + bottom));
        self.put(&format!(
            "<text x=\"{cx:.1}\" y=\"{cy:.1}\" font-size=\"11\" text-anchor=\"middle\" \
             transform=\"rotate(-90 {cx:.1} {cy:.1})\">{}</text>",
            escape(y)
        ));
    }

    /// Text at a pixel.
    pub fn words(&mut self, (x, y): (f32, f32), anchor: &str, size: f32, colour: &str, text: &str) {
        self.put(&format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\">{}</text>",
            escape(text)
        ));
    }

    /// Text at a place of the data.
    pub fn label(&mut self, panel: &Panel, place: (f32, f32), colour: &str, text: &str) {
        self.words(panel.at(place), "start", 11.0, colour, text);
    }

    /// A line through points; those that no pixel tells apart are left out.
    pub fn path(&mut self, panel: &Panel, points: &[(f32, f32)], colour: &str, width: f32) {
        let mut text = String::new();
        let mut last = (f32::MAX, f32::MAX);
        for (i, point) in points.iter().enumerate() {
            let (x, y) = panel.at(*point);
            if (x - last.0).hypot(y - last.1) < 1.0 && i + 1 < points.len() {
                continue;
            }
            last = (x, y);
            let _ = write!(text, "{x:.1},{y:.1} ");
        }
        self.put(&format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"/>",
            text.trim_end()
        ));
    }

    /// An arrow, with a head when it is long enough to see one.
    pub fn arrow(&mut self, panel: &Panel, from: (f32, f32), to: (f32, f32), colour: &str) {
        let ((x0, y0), (x1, y1)) = (panel.at(from), panel.at(to));
        let length = (x1 - x0).hypot(y1 - y0);
        let mut shape = format!("M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}");
        if length > 3.0 {
            let (ux, uy) = ((x1 - x0) / length * 3.5, (y1 - y0) / length * 3.5);
            let _ = write!(
                shape,
                "M{:.1} {:.1}L{x1:.1} {y1:.1}L{:.1} {:.1}",
                x1 - ux - 0.6 * uy,
                y1 - uy + 0.6 * ux,
                x1 - ux + 0.6 * uy,
                y1 - uy - 0.6 * ux
            );
        }
        self.put(&format!("<path d=\"{shape}\" fill=\"none\" stroke=\"{colour}\"/>"));
    }

    pub fn rect(&mut self, panel: &Panel, low: (f32, f32), high: (f32, f32), fill: &str) {
        let ((x0, y1), (x1, y0)) = (panel.at(low), panel.at(high));
        self.put(&format!(
            "<rect x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"/>",
            x1 - x0,
            y1 - y0
        ));
    }

    pub fn dot(&mut self, panel: &Panel, place: (f32, f32), radius: f32, colour: &str) {
        let (x, y) = panel.at(place);
        self.put(&format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{colour}\"/>"));
    }

    /// The part of a disc of this radius around a place between two directions, radians counter-clockwise.
    pub fn fan(
        &mut self,
        panel: &Panel,
        (x, y): (f32, f32),
        radius: f32,
        (from, to): (f32, f32),
        fill: &str,
    ) {
        let mut shape = String::from("M");
        let steps = (((to - from) / 0.1).ceil() as usize).max(1);
        let arc = (0..=steps).map(|i| from + (to - from) * i as f32 / steps as f32);
        let points = arc.map(|a| (x + radius * a.cos(), y + radius * a.sin()));
        for point in std::iter::once((x, y)).chain(points) {
            let (px, py) = panel.at(point);
            let _ = write!(shape, "{px:.1} {py:.1}L");
        }
        let shape = shape.trim_end_matches('L');
        self.put(&format!("<path d=\"{shape}Z\" fill=\"{fill}\" fill-opacity=\"0.35\"/>"));
    }

    /// The file. `caption` stands below everything.
    pub fn finish(mut self, caption: &str) -> String {
        let y = self.height + 6.0;
        self.words((8.0, y), "start", 11.0, "#333", caption);
        let (width, height) = (self.width.max(6.2 * caption.len() as f32), y + 12.0);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{}</svg>\n",
            self.body
        )
    }
}
