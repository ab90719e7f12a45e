//! What no camera may show: the privacy zones of the plan, covered in every picture that leaves. Pure.
//!
//! For each column of the picture a ray runs from where the drone believes to be to the first wall of the plan; a column whose
//! ray passes a zone is covered from top to bottom, and with it as many columns beside it as place, heading and roll are
//! uncertain by. While the place is not known, everything is covered.

use crate::source::Frame;
use floorplan::Plan;
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

/// Columns that are decided about, whatever the picture's size: 0.65 degrees each at 62.
const COLUMNS: usize = 96;
/// Beyond this a person is a few pixels, metres.
const FAR_M: f32 = 25.0;
/// Standard deviations that count as possible.
const SIGMAS: f32 = 3.0;
/// What the body's roll shifts a picture's upper and lower edge by (10 degrees of roll), and a plan that is off by some
/// centimetres, radians.
const LEAN_RAD: f32 = 0.09;
/// How fast the drone turns at most (navigation's `turn_rad_s` goes to 2), radians a second.
const TURN_RAD_S: f32 = 2.0;
/// How fast it flies at most (`cruise_m_s` goes to 1.5), metres a second.
const SPEED_M_S: f32 = 1.5;
/// A place that is older is not known any more, seconds.
const FRESH_S: f32 = 0.5;
/// Which share of being lost is still knowing the place: more stops the drone (the failsafe table's P(lost)).
const LOST: f32 = 0.05;
/// Luma and chroma of what is covered (BT.601, limited range): dark grey.
const GREY: [u8; 3] = [56, 128, 128];

/// Where the camera is believed to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// Where the middle of the picture looks, plan frame, radians.
    pub heading: f32,
    /// Standard deviation of the place, metres.
    pub sigma_m: f32,
    /// Standard deviation of the heading, radians.
    pub sigma_rad: f32,
    /// Probability that all of this is wrong, 0..1.
    pub p_lost: f32,
    /// Between the time that this is for and the picture, seconds.
    pub age_s: f32,
}

/// Covers the zones of one plan for one lens.
#[derive(Debug)]
pub struct Privacy {
    plan: Arc<Plan>,
    /// A flag a cell of the plan.
    zones: Vec<bool>,
    half_view_rad: f32,
    covered: [bool; COLUMNS],
    planes: [Vec<u8>; 3],
}

impl Privacy {
    /// `None` for a plan without privacy zones. `view_rad` is the angle from the left to the right edge of the picture.
    #[must_use]
    pub fn new(plan: Arc<Plan>, areas: &[floorplan::NamedArea], view_rad: f32) -> Option<Self> {
        let zones = plan.within(areas)?;
        let half_view_rad = (0.5 * view_rad).clamp(0.05, 1.4);
        Some(Self { plan, zones, half_view_rad, covered: [true; COLUMNS], planes: Default::default() })
    }

    /// Share of the picture that is covered, 0..1.
    #[must_use]
    pub fn share(&self) -> f32 {
        self.covered.iter().filter(|covered| **covered).count() as f32 / COLUMNS as f32
    }

    /// Decides what is covered in a picture taken from here; from nowhere known, all of it.
    pub fn look(&mut self, from: Option<Viewpoint>) {
        self.covered = [true; COLUMNS];
        let Some(view) = from.filter(|view| known(view) && self.is_free(view.x, view.y)) else { return };
        self.covered = [false; COLUMNS];
        let moved_m = SIGMAS * view.sigma_m + SPEED_M_S * view.age_s;
        let turned_rad = SIGMAS * view.sigma_rad + TURN_RAD_S * view.age_s + LEAN_RAD;
        let step = 2.0 * self.half_view_rad / COLUMNS as f32;
        // A zone that is seen just outside of the picture may be in it, by as much as is uncertain there. One at arm's
        // length may be anywhere.
        let beside = (FRAC_PI_2 / step).ceil() as i64;
        for k in -beside..COLUMNS as i64 + beside {
            // Columns run from left to right, angles from right to left.
            let angle = self.half_view_rad - (k as f32 + 0.5) * step;
            let Some(range_m) = self.zone_along(&view, view.heading + angle, moved_m) else { continue };
            let shift_rad = if moved_m >= range_m { FRAC_PI_2 } else { (moved_m / range_m).asin() };
            let columns = ((turned_rad + shift_rad) / step).ceil() as i64;
            for column in (k - columns).max(0)..=(k + columns).min(COLUMNS as i64 - 1) {
                if let Some(covered) = usize::try_from(column).ok().and_then(|at| self.covered.get_mut(at)) {
                    *covered = true;
                }
            }
        }
    }

    /// The picture with what is to be covered grey; the same one when nothing is.
    pub fn cover<'a>(&'a mut self, frame: Frame<'a>) -> Frame<'a> {
        if !self.covered.contains(&true) {
            return frame;
        }
        let width = frame.width as usize;
        let focal = 0.5 * width as f32 / self.half_view_rad.tan();
        let edge = |k: usize| {
            let angle = self.half_view_rad * (1.0 - 2.0 * k as f32 / COLUMNS as f32);
            ((0.5 * width as f32 - focal * angle.tan()).max(0.0) as usize).min(width)
        };
        for (plane, (copy, source)) in self.planes.iter_mut().zip(frame.planes).enumerate() {
            copy.clear();
            copy.extend_from_slice(source);
            let shrink = if plane == 0 { 1 } else { 2 };
            let (stride, width) = (frame.stride as usize / shrink, width / shrink);
            for (k, covered) in self.covered.iter().enumerate() {
                if !covered {
                    continue;
                }
                // Outwards: a pixel that belongs to both is covered.
                let from = edge(k) / shrink;
                let to = if k + 1 == COLUMNS { width } else { (edge(k + 1) + 1).div_ceil(shrink).min(width) };
                for line in copy.chunks_mut(stride.max(1)) {
                    if let Some(pixels) = line.get_mut(from..to.max(from)) {
                        pixels.fill(GREY[plane]);
                    }
                }
            }
        }
        Frame { planes: [&self.planes[0], &self.planes[1], &self.planes[2]], ..frame }
    }

    fn is_free(&self, x: f32, y: f32) -> bool {
        self.plan.cell_index(x, y).is_some_and(|(ix, iy)| self.plan.cell(ix, iy) == floorplan::Cell::Free)
    }

    /// Distance to the first zone before a wall; `slack_m` beside a wall's edge counts as before it.
    fn zone_along(&self, view: &Viewpoint, angle: f32, slack_m: f32) -> Option<f32> {
        let wall_m = self.plan.cast_ray(view.x, view.y, angle, FAR_M).map_or(FAR_M, |hit| hit.range_m);
        let (sin, cos) = angle.sin_cos();
        let step_m = 0.5 * self.plan.resolution();
        let steps = ((wall_m + slack_m.min(0.1)) / step_m).ceil() as usize;
        (0..=steps).map(|k| k as f32 * step_m).find(|range_m| {
            let cell = self.plan.cell_index(view.x + range_m * cos, view.y + range_m * sin);
            cell.and_then(|(ix, iy)| self.zones.get(iy * self.plan.width() + ix)).copied().unwrap_or(false)
        })
    }
}

/// Whether a viewpoint can be relied on.
fn known(view: &Viewpoint) -> bool {
    let all = [view.x, view.y, view.heading, view.sigma_m, view.sigma_rad, view.p_lost, view.age_s];
    all.iter().all(|value| value.is_finite())
        && view.sigma_m >= 0.0
        && view.sigma_rad >= 0.0
        && view.p_lost <= LOST
        && (0.0..=FRESH_S).contains(&view.age_s)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use floorplan::{Area, NamedArea};

    /// Two rooms of 4 m by 4 m with a door between them at the bottom; 0.2 m a cell.
    const PLAN: [&str; 22] = [
        "###########################################",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#....................#....................#",
        "#.........................................#",
        "#.........................................#",
        "#.........................................#",
        "#.........................................#",
        "#....................#....................#",
        "###########################################",
    ];
    const VIEW: f32 = 1.085;

    fn privacy(zone: [f32; 4]) -> Privacy {
        let plan = Arc::new(Plan::from_ascii(&PLAN, 0.2));
        let zone = NamedArea { name: "Washroom".to_owned(), area: Area::Rectangle(zone) };
        Privacy::new(plan, &[zone], VIEW).unwrap()
    }

    fn at(x: f32, y: f32, heading: f32) -> Option<Viewpoint> {
        Some(Viewpoint { x, y, heading, sigma_m: 0.03, sigma_rad: 0.01, p_lost: 0.0, age_s: 0.02 })
    }

    #[test]
    fn no_zone_no_work_and_nowhere_known_nothing_shown() {
        assert!(Privacy::new(Arc::new(Plan::from_ascii(&PLAN, 0.2)), &[], VIEW).is_none());
        let mut privacy = privacy([4.4, 0.2, 8.4, 4.2]);
        let good = at(2.0, 3.0, std::f32::consts::PI).unwrap();
        for lost in [
            None,
            Some(Viewpoint { p_lost: 0.2, ..good }),
            Some(Viewpoint { age_s: 1.0, ..good }),
            Some(Viewpoint { age_s: -0.1, ..good }),
            Some(Viewpoint { heading: f32::NAN, ..good }),
            Some(Viewpoint { x: -3.0, ..good }),
        ] {
            privacy.look(lost);
            assert!((privacy.share() - 1.0).abs() < 1e-6, "{lost:?}");
        }
        privacy.look(Some(good));
        assert!(privacy.share() < 1e-6, "its back is turned to it");
    }

    #[test]
    fn a_wall_hides_what_a_door_shows() {
        let mut privacy = privacy([4.4, 0.2, 8.4, 4.2]);
        privacy.look(at(2.0, 3.5, 0.0));
        assert!(privacy.share() < 0.5, "a wall is in most of the picture: {}", privacy.share());
        privacy.look(at(2.0, 0.8, 0.0));
        let through = privacy.share();
        assert!(through > 0.3, "through the door: {through}");
        // The door is on the right when looked at from above it.
        privacy.look(at(2.0, 2.6, -0.3));
        let (left, right) = privacy.covered.split_at(COLUMNS / 2);
        let count = |half: &[bool]| half.iter().filter(|covered| **covered).count();
        assert!(count(right) + count(left) > 0 && count(left) < COLUMNS / 2, "{:?}", privacy.covered);
        privacy.look(at(6.0, 2.0, 0.0));
        assert!((privacy.share() - 1.0).abs() < 1e-6, "within it");
    }

    /// For 4 000 drawn places and errors within three standard deviations of each: no true ray of the camera into the zone
    /// falls on a column that is shown. Drawn by a fixed sequence, so it cannot flicker.
    #[test]
    fn nothing_of_a_zone_is_shown_from_anywhere_that_the_drone_may_really_be() {
        let zone = [5.0, 0.4, 8.0, 3.0];
        let mut privacy = privacy(zone);
        let plan = Plan::from_ascii(&PLAN, 0.2);
        let mut state = 1_u64;
        let mut draw = |from: f32, to: f32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            from + (to - from) * ((state >> 40) as f32 / (1_u64 << 24) as f32)
        };
        let (mut rays, mut shown_somewhere) = (0_u32, 0_u32);
        for _ in 0..4000 {
            let (x, y, heading) = (draw(0.4, 8.4), draw(0.4, 4.2), draw(-3.2, 3.2));
            let (sigma_m, sigma_rad) = (draw(0.0, 0.08), draw(0.0, 0.03));
            let view = Viewpoint { x, y, heading, sigma_m, sigma_rad, p_lost: 0.0, age_s: 0.03 };
            privacy.look(Some(view));
            shown_somewhere += u32::from(privacy.share() < 1.0);
            let (error_m, towards) = (draw(0.0, 2.0) * sigma_m, draw(-3.2, 3.2));
            let true_x = x + error_m * towards.cos();
            let true_y = y + error_m * towards.sin();
            let true_heading = heading + draw(-2.0, 2.0) * sigma_rad;
            if !privacy.is_free(true_x, true_y) {
                continue;
            }
            for column in 0..COLUMNS {
                let part = (column as f32 + 0.5) / COLUMNS as f32;
                let angle = true_heading + privacy.half_view_rad * (1.0 - 2.0 * part);
                let wall = plan.cast_ray(true_x, true_y, angle, FAR_M).map_or(FAR_M, |hit| hit.range_m);
                let sees = (0..400).map(|k| k as f32 * 0.05).take_while(|range| *range < wall).any(|range| {
                    let (px, py) = (true_x + range * angle.cos(), true_y + range * angle.sin());
                    px > zone[0] + 0.1 && px < zone[2] - 0.1 && py > zone[1] + 0.1 && py < zone[3] - 0.1
                });
                if sees {
                    rays += 1;
                    assert!(privacy.covered[column], "column {column} shows the zone from {view:?}");
                }
            }
        }
        assert!(
            rays > 10_000 && shown_somewhere > 1000,
            "{rays} rays, {shown_somewhere} pictures with something to see"
        );
    }

    #[test]
    fn covered_columns_are_grey_and_the_others_as_they_were() {
        let mut privacy = privacy([4.4, 0.2, 8.4, 4.2]);
        let planes = [vec![200_u8; 648 * 480], vec![90; 324 * 240], vec![110; 324 * 240]];
        let frame = || Frame {
            capture_ns: 1,
            number: 2,
            width: 640,
            height: 480,
            stride: 648,
            planes: [&planes[0], &planes[1], &planes[2]],
        };
        privacy.look(at(2.0, 3.5, std::f32::consts::PI));
        assert_eq!(
            privacy.cover(frame()).planes[0].as_ptr(),
            planes[0].as_ptr(),
            "nothing is copied for nothing"
        );
        privacy.covered = [false; COLUMNS];
        privacy.covered[..COLUMNS / 2].fill(true);
        let covered = privacy.cover(frame());
        assert_eq!((covered.stride, covered.number), (648, 2));
        for line in 0..480 {
            let luma = &covered.planes[0][648 * line..648 * line + 640];
            assert!(luma[..320].iter().all(|value| *value == GREY[0]), "line {line}");
            assert!(luma[322..].iter().all(|value| *value == 200), "line {line}");
        }
        let chroma = &covered.planes[1][..320];
        assert!(
            chroma[..160].iter().all(|value| *value == 128) && chroma[162..].iter().all(|value| *value == 90)
        );
        privacy.covered = [true; COLUMNS];
        let all = privacy.cover(frame());
        assert!(all.planes[0].chunks(648).all(|line| line[..640].iter().all(|value| *value == GREY[0])));
    }
}
