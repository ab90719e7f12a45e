//! One picture of a flight: a self-contained SVG that any browser shows.

mod page;
#[cfg(test)]
mod tests;
mod track;

pub use track::{CloseCall, Track};

use crate::score::{Coverage, FlightReport};
use crate::world::{FLIGHT_BAND_M, Ground, Role, Shape, Solid, Surface, World, rectangles};
use page::{Page, escaped};
use std::fmt::Write;

/// What a picture shows.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Headline.
    pub title: &'a str,
    /// Where it was flown.
    pub world: &'a World,
    /// What was seen.
    pub coverage: &'a Coverage,
    /// Where it went.
    pub track: &'a Track,
    /// The figures.
    pub report: &'a FlightReport,
    /// Names of rooms and where to write them, world frame.
    pub labels: &'a [(String, f32, f32)],
}

const FLOOR: &str = "#f6f4ee";
const SEEN: &str = "#d5eadb";
const MISSED: &str = "#f3c9bf";
const WALL: &str = "#37404a";
const LOW: &str = "#f0dcae";
const HIGH: &str = "#e0a03c";
const SOFT: &str = "#a9c88a";
const MIRROR: &str = "#9fc9dd";
const CARPET: &str = "#cbb9d6";
const SHUT: &str = "#b3261e";
const FLOWN: &str = "#1456c4";
const BELIEVED: &str = "#e8590c";
const PERSON: &str = "#8a3ab9";
const CALL: &str = "#d6001c";
const PAD: &str = "#11733a";

impl Picture<'_> {
    /// The picture as SVG text.
    #[must_use]
    pub fn draw(&self) -> String {
        let mut page = Page::new(self.world.bounds());
        self.head(&mut page);
        self.floor(&mut page);
        self.things(&mut page);
        self.paths(&mut page);
        self.marks(&mut page);
        self.legend(&mut page);
        page.finish()
    }

    fn head(&self, page: &mut Page) {
        let r = self.report;
        page.text(0.0, 34.0, 24.0, "font-weight=\"600\"", self.title);
        let centimetres = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.0} cm", v * 100.0));
        let figures = format!(
            "{} · {} contacts · closest {:.0} cm · coverage {:.1} % · {:.0} m in {}:{:02} min · \
             position error median {}, p95 {}, max {} · seed {}",
            r.outcome,
            r.contacts,
            r.min_clearance_m * 100.0,
            r.coverage * 100.0,
            r.distance_m,
            (r.time_s / 60.0) as u32,
            (r.time_s % 60.0) as u32,
            centimetres(r.loc_error_m.median),
            centimetres(r.loc_error_m.p95),
            centimetres(r.loc_error_m.max),
            r.seed,
        );
        page.text(0.0, 58.0, 14.0, "fill=\"#4a5560\"", &figures);
        let mut notes = Vec::new();
        if !r.failsafes.is_empty() {
            notes.push(format!("Failsafes: {}", r.failsafes.join(", ")));
        }
        if !r.skipped.is_empty() {
            notes.push(format!("Skipped: {}", r.skipped.join("; ")));
        }
        page.text(0.0, 78.0, 13.0, "fill=\"#8a4b12\"", &notes.join(" · "));
    }

    fn floor(&self, page: &mut Page) {
        let ground = self.world.ground();
        let (wanted, seen) = (self.coverage.wanted(), self.coverage.seen());
        let any = |cell: usize| ground.is_free_in_flight(cell);
        page.path(&cells(page, ground, any), &format!("fill=\"{FLOOR}\""));
        let crisp = "shape-rendering=\"crispEdges\"";
        page.path(&cells(page, ground, |c| seen[c]), &format!("fill=\"{SEEN}\" {crisp}"));
        page.path(&cells(page, ground, |c| wanted[c] && !seen[c]), &format!("fill=\"{MISSED}\" {crisp}"));
    }

    fn things(&self, page: &mut Page) {
        for solid in self.world.solids().iter().filter(|s| s.role == Role::SoftFloor) {
            page.solid(solid, &format!("fill=\"{CARPET}\" fill-opacity=\"0.45\""));
        }
        let mut walls = String::new();
        for solid in self.world.solids().iter().filter(|s| s.role == Role::Wall) {
            let (x, y) = page.at(solid.x - solid.half_x, solid.y + solid.half_y);
            let (w, h) = (page.long(2.0 * solid.half_x), page.long(2.0 * solid.half_y));
            let _ = write!(walls, "M{x:.1} {y:.1}h{w:.1}v{h:.1}h-{w:.1}z");
        }
        // A hair of stroke closes the seams between blocks.
        page.path(&walls, &format!("fill=\"{WALL}\" stroke=\"{WALL}\" stroke-width=\"0.6\""));
        for object in self.world.objects() {
            if object.outline.role == Role::Door {
                continue;
            }
            let parts = self.world.solids().iter().filter(|s| s.object == object.outline.object);
            let mut top = object.outline;
            let mut any = false;
            for part in parts.filter(|s| matches!(s.role, Role::Furniture | Role::Clutter)) {
                if !any || part.half_x * part.half_y > top.half_x * top.half_y * 0.5 {
                    top.surface = part.surface;
                }
                any = true;
            }
            let colour = match top.surface {
                Surface::Soft => SOFT,
                Surface::Mirror => MIRROR,
                Surface::Hard if top.top <= FLIGHT_BAND_M.0 => LOW,
                Surface::Hard => HIGH,
            };
            let style = format!("fill=\"{colour}\" stroke=\"#7a5a1c\" stroke-width=\"0.8\"");
            page.titled(&object.name, |page| page.solid(&object.outline, &style));
        }
        for door in self.world.doors().iter().filter(|d| d.shut) {
            let size = (door.width, 0.12);
            let leaf = Solid::new_box(door.middle, size, door.heading, 0.0, 2.0);
            let name = format!("{} (shut)", door.name);
            page.titled(&name, |page| page.solid(&leaf, &format!("fill=\"{SHUT}\"")));
        }
        for (name, x, y) in self.labels {
            let (px, py) = page.at(*x, *y);
            page.raw(&format!(
                "<text x=\"{px:.1}\" y=\"{py:.1}\" font-size=\"13\" text-anchor=\"middle\" fill=\"#4a5560\" \
                 fill-opacity=\"0.75\" letter-spacing=\"0.5\">{}</text>",
                escaped(name)
            ));
        }
    }

    fn paths(&self, page: &mut Page) {
        for path in &self.track.people {
            let line = page.line(path.iter().map(|p| Some(*p)));
            let style = format!(
                "fill=\"none\" stroke=\"{PERSON}\" stroke-width=\"1.3\" stroke-dasharray=\"1 5\" \
                 stroke-linecap=\"round\" stroke-opacity=\"0.8\""
            );
            page.path(&line, &style);
            if let Some(last) = path.last() {
                let body = Solid::new_cylinder(*last, 0.25, 0.0, 1.7);
                page.solid(&body, &format!("fill=\"{PERSON}\" fill-opacity=\"0.55\""));
            }
        }
        let smooth = "fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\"";
        let flown = page.line(self.track.flown.iter().map(|p| Some(*p)));
        page.path(
            &flown,
            &format!("{smooth} stroke=\"#ffffff\" stroke-opacity=\"0.7\" stroke-width=\"4.5\""),
        );
        page.path(&flown, &format!("{smooth} stroke=\"{FLOWN}\" stroke-width=\"2.2\""));
        let believed = page.line(self.track.believed.iter().copied());
        page.path(&believed, &format!("{smooth} stroke=\"{BELIEVED}\" stroke-width=\"1.1\""));
    }

    fn marks(&self, page: &mut Page) {
        let pad = self.world.pad();
        let (x, y) = page.at(pad.x, pad.y);
        let r = page.long(0.35);
        let (sin, cos) = pad.heading.sin_cos();
        let (hx, hy) = (x + cos * r, y - sin * r);
        page.raw(&format!(
            "<g><title>Pad</title><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" fill=\"{PAD}\" \
             fill-opacity=\"0.2\" stroke=\"{PAD}\" stroke-width=\"1.8\"/><path d=\"M{x:.1} {y:.1}L{hx:.1} \
             {hy:.1}\" stroke=\"{PAD}\" stroke-width=\"1.8\"/></g>"
        ));
        for call in self.track.closest() {
            let (x, y) = page.at(call.x, call.y);
            // Labels stay on the page.
            let left = x > page.width() - 130.0;
            let (tx, anchor) = if left { (x - 12.0, "end") } else { (x + 12.0, "start") };
            let text = format!("{:.0} cm", call.clearance * 100.0);
            let minutes = (call.time_s / 60.0) as u32;
            let seconds = (call.time_s % 60.0) as u32;
            // Twice, because not every viewer paints strokes under fills.
            let label = |style: &str| {
                format!(
                    "<text x=\"{tx:.1}\" y=\"{:.1}\" font-size=\"12\" font-weight=\"600\" \
                     text-anchor=\"{anchor}\" {style}>{text}</text>",
                    y - 8.0
                )
            };
            page.titled(&format!("{text} from {} at {minutes}:{seconds:02}", call.name), |page| {
                page.raw(&format!(
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"none\" stroke=\"{CALL}\" \
                     stroke-width=\"2\"/>"
                ));
                page.raw(&label("fill=\"none\" stroke=\"#ffffff\" stroke-width=\"3\""));
                page.raw(&label(&format!("fill=\"{CALL}\"")));
            });
        }
    }

    fn legend(&self, page: &mut Page) {
        let swatch = |colour: &str| {
            format!(
                "<rect y=\"-10\" width=\"22\" height=\"12\" rx=\"2\" fill=\"{colour}\" stroke=\"#00000030\"/>"
            )
        };
        let stroke = |colour: &str, width: f32, dash: &str| {
            format!(
                "<path d=\"M0 -4h22\" stroke=\"{colour}\" stroke-width=\"{width}\" \
                 stroke-dasharray=\"{dash}\" stroke-linecap=\"round\"/>"
            )
        };
        let ring = |colour: &str| {
            format!(
                "<circle cx=\"11\" cy=\"-4\" r=\"6\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
            )
        };
        page.legend(&[
            (stroke(FLOWN, 2.5, ""), "true path"),
            (stroke(BELIEVED, 1.4, ""), "where it believed to be"),
            (stroke(PERSON, 1.5, "1 5"), "people"),
            (swatch(SEEN), "seen"),
            (swatch(MISSED), "not seen, but could be"),
            (swatch(WALL), "walls as built"),
            (swatch(HIGH), "unmapped, at flight height"),
            (swatch(LOW), "unmapped, flown over"),
            (swatch(SOFT), "unmapped, soft"),
            (swatch(MIRROR), "unmapped, mirror-like"),
            (swatch(CARPET), "carpet"),
            (swatch(SHUT), "shut door"),
            (ring(PAD), "pad"),
            (ring(CALL), "closest calls"),
        ]);
    }
}

/// The outline of marked cells as rectangles of one path.
fn cells(page: &Page, ground: &Ground, marked: impl Fn(usize) -> bool) -> String {
    let mut path = String::new();
    let long = ground.width().max(ground.height());
    let side = ground.resolution();
    for [c0, r0, c1, r1] in rectangles(ground.width(), ground.height(), long, marked) {
        let (ox, oy) = ground.origin();
        let (x, y) = page.at(ox + c0 as f32 * side, oy + (r1 + 1) as f32 * side);
        let (w, h) = (page.long((c1 + 1 - c0) as f32 * side), page.long((r1 + 1 - r0) as f32 * side));
        let _ = write!(path, "M{x:.1} {y:.1}h{w:.1}v{h:.1}h-{w:.1}z");
    }
    path
}

impl Page {
    /// A solid from above.
    fn solid(&mut self, solid: &Solid, style: &str) {
        let (x, y) = self.at(solid.x, solid.y);
        match solid.shape {
            Shape::Cylinder => {
                let r = self.long(solid.half_x);
                self.raw(&format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" {style}/>"));
            }
            Shape::Box => {
                let points: Vec<String> = solid
                    .corners()
                    .iter()
                    .map(|(cx, cy)| self.at(*cx, *cy))
                    .map(|(px, py)| format!("{px:.1},{py:.1}"))
                    .collect();
                self.raw(&format!("<polygon points=\"{}\" {style}/>", points.join(" ")));
            }
        }
    }
}
