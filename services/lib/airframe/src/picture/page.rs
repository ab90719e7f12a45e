//! The sheet that a picture is drawn on: metres to pixels, and SVG text.

use std::fmt::Write;

/// Pixels of the longer side of the map.
const MAP_PX: f32 = 1240.0;
/// Most pixels a metre: small worlds are not blown up without bound.
const MOST_PX_M: f32 = 110.0;
/// Around the map.
const MARGIN_PX: f32 = 28.0;
/// Over the map, for the headline and the figures.
const HEAD_PX: f32 = 96.0;
/// The headline and the figures need this much.
const LEAST_WIDTH_PX: f32 = 1100.0;
/// A line of the legend.
const LEGEND_LINE_PX: f32 = 24.0;
/// A column of the legend.
const LEGEND_COLUMN_PX: f32 = 215.0;

pub(super) struct Page {
    body: String,
    low: (f32, f32),
    high_y: f32,
    scale: f32,
    width: f32,
    height: f32,
    left: f32,
    map_width: f32,
}

impl Page {
    pub(super) fn new(bounds: [f32; 4]) -> Self {
        let (w, h) = ((bounds[2] - bounds[0]).max(0.1), (bounds[3] - bounds[1]).max(0.1));
        let scale = (MAP_PX / w.max(h)).min(MOST_PX_M);
        let width = (w * scale + 2.0 * MARGIN_PX).max(LEAST_WIDTH_PX);
        Self {
            body: String::new(),
            low: (bounds[0], bounds[1]),
            high_y: bounds[3],
            scale,
            width,
            height: HEAD_PX + h * scale + MARGIN_PX,
            left: (width - w * scale) * 0.5,
            map_width: w * scale,
        }
    }

    /// A place of the world on the page.
    pub(super) fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.left + (x - self.low.0) * self.scale, HEAD_PX + (self.high_y - y) * self.scale)
    }

    /// A length of the world on the page.
    pub(super) fn long(&self, metres: f32) -> f32 {
        metres * self.scale
    }

    pub(super) fn width(&self) -> f32 {
        self.width
    }

    pub(super) fn raw(&mut self, svg: &str) {
        self.body.push_str(svg);
        self.body.push('\n');
    }

    pub(super) fn path(&mut self, d: &str, style: &str) {
        if !d.is_empty() {
            let _ = writeln!(self.body, "<path d=\"{d}\" {style}/>");
        }
    }

    /// A line through places; `None` lifts the pen.
    pub(super) fn line(&self, places: impl Iterator<Item = Option<(f32, f32)>>) -> String {
        let mut d = String::new();
        let mut down = false;
        for place in places {
            let Some((x, y)) = place.filter(|(x, y)| x.is_finite() && y.is_finite()) else {
                down = false;
                continue;
            };
            let (px, py) = self.at(x, y);
            let _ = write!(d, "{}{px:.1} {py:.1}", if down { 'L' } else { 'M' });
            down = true;
        }
        d
    }

    /// Text at pixels from the left margin and the top.
    pub(super) fn text(&mut self, x: f32, y: f32, size: f32, style: &str, text: &str) {
        if !text.is_empty() {
            let x = MARGIN_PX + x;
            let text = escaped(text);
            let _ =
                writeln!(self.body, "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" {style}>{text}</text>");
        }
    }

    /// A group that shows a name when it is pointed at.
    pub(super) fn titled(&mut self, name: &str, draw: impl FnOnce(&mut Self)) {
        let _ = write!(self.body, "<g><title>{}</title>", escaped(name));
        draw(self);
        self.body.push_str("</g>\n");
    }

    /// Swatches with words in columns under the map, and a scale.
    pub(super) fn legend(&mut self, entries: &[(String, &str)]) {
        let columns = (((self.width - 2.0 * MARGIN_PX) / LEGEND_COLUMN_PX) as usize).max(1);
        let top = self.height + 14.0;
        // Five metres, or one on a small map.
        let metres = if self.map_width / self.scale > 8.0 { 5.0 } else { 1.0 };
        let (x1, y1) = (self.width - MARGIN_PX, self.height - 6.0);
        let x0 = x1 - self.long(metres);
        self.raw(&format!(
            "<path d=\"M{x0:.1} {:.1}v6h{:.1}v-6\" fill=\"none\" stroke=\"#4a5560\" stroke-width=\"1.4\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"12\" fill=\"#4a5560\" text-anchor=\"end\">{metres:.0} \
             m</text>",
            y1 - 6.0,
            x1 - x0,
            x0 - 6.0,
            y1
        ));
        for (i, (swatch, word)) in entries.iter().enumerate() {
            let x = MARGIN_PX + (i % columns) as f32 * LEGEND_COLUMN_PX;
            let y = top + 12.0 + (i / columns) as f32 * LEGEND_LINE_PX;
            self.raw(&format!(
                "<g transform=\"translate({x:.1} {y:.1})\">{swatch}<text x=\"30\" font-size=\"13\" \
                 fill=\"#28313a\">{}</text></g>",
                escaped(word)
            ));
        }
        self.height = top + entries.len().div_ceil(columns) as f32 * LEGEND_LINE_PX + 12.0;
    }

    pub(super) fn finish(self) -> String {
        let (w, h) = (self.width, self.height);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w:.0} {h:.0}\" width=\"{w:.0}\" \
             height=\"{h:.0}\" font-family=\"system-ui, 'Segoe UI', Helvetica, Arial, sans-serif\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.body
        )
    }
}

/// Text that may stand in XML.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if (c as u32) < 0x20 => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
