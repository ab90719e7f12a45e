#![allow(clippy::unwrap_used, dead_code, reason = "tests: each binary uses its part")]
//! What the tests share: plans, a walk along a round, and a scorer that knows nothing of this crate.

use std::path::Path;

use floorplan::{Cell, DistanceField, Door, Plan, PlanHeader, Rooms, Sidecar};
use patrol::{Costmap, Limits, Progress, Round, RoutePlanner, Seen, Step, Wishes};

pub(crate) struct Site {
    pub(crate) plan: Plan,
    pub(crate) rooms: Rooms,
    pub(crate) doors: Vec<Door>,
    pub(crate) pad: (f32, f32),
    pub(crate) map: Costmap,
}

pub(crate) fn delivered(name: &str) -> Site {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../deploy/plans");
    let read = |file: String| std::fs::read(folder.join(file)).unwrap();
    let header = PlanHeader::parse(name, &read(format!("{name}.yaml"))).unwrap();
    let plan = Plan::load(name, &header, &read(header.image.clone())).unwrap();
    let sidecar = Sidecar::parse(name, &read(format!("{name}.rooms.yaml"))).unwrap();
    let rooms = Rooms::of(name, &sidecar, &plan).unwrap();
    let pad = sidecar.pad.unwrap();
    site(plan, rooms, sidecar.doors, (pad.x, pad.y))
}

/// A plan made by a laser scanner, when the folder beside the project is there; the pad in its widest place.
pub(crate) fn scanned(name: &str) -> Option<Site> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/maps");
    let read = |file: String| std::fs::read(folder.join(file)).ok();
    let header = PlanHeader::parse(name, &read(format!("{name}.yaml"))?).unwrap();
    let plan = Plan::load(name, &header, &read(header.image.clone())?).unwrap();
    let field = DistanceField::of_not_free(&plan, 2.5);
    let widest = (0..plan.cells().len())
        .map(|k| (k % plan.width(), k / plan.width()))
        .max_by(|a, b| field.at_cell(a.0, a.1).total_cmp(&field.at_cell(b.0, b.1)));
    let pad = widest.map(|(ix, iy)| plan.centre(ix, iy)).unwrap();
    let rooms = Rooms::segment(&plan);
    Some(site(plan, rooms, Vec::new(), pad))
}

pub(crate) fn drawn(rows: &[&str], resolution: f64, sidecar: &str, pad: (f32, f32)) -> Site {
    let plan = Plan::from_ascii(rows, resolution);
    let sidecar = Sidecar::parse("drawn", sidecar.as_bytes()).unwrap();
    let rooms = Rooms::of("drawn", &sidecar, &plan).unwrap();
    site(plan, rooms, sidecar.doors, pad)
}

fn site(plan: Plan, rooms: Rooms, doors: Vec<Door>, pad: (f32, f32)) -> Site {
    let map = Costmap::new(&plan, &rooms, &doors, &Limits::default());
    Site { plan, rooms, doors, pad, map }
}

/// Draws a picture larger: each cell `times` by `times`.
pub(crate) fn enlarged(rows: &[&str], times: usize) -> Vec<String> {
    rows.iter()
        .flat_map(|row| {
            let wide: String = row.chars().flat_map(|c| std::iter::repeat_n(c, times)).collect();
            std::iter::repeat_n(wide, times)
        })
        .collect()
}

pub(crate) fn plan_round(site: &Site, from: (f32, f32), seen: &Seen) -> Round {
    plan_wished(site, from, seen, &Wishes::default())
}

pub(crate) fn plan_wished(site: &Site, from: (f32, f32), seen: &Seen, wishes: &Wishes) -> Round {
    let mut round = Round::new(&site.map, site.rooms.len(), from, site.pad, seen, wishes);
    while round.advance(&site.map, seen, 100_000) == Progress::Working {}
    round
}

pub(crate) fn route(
    site: &Site,
    from: (f32, f32),
    to: (f32, f32),
) -> Result<Vec<(f32, f32)>, patrol::Obstacle> {
    let mut planner = RoutePlanner::new(&site.map);
    planner.begin(&site.map, from, to);
    loop {
        match planner.advance(&site.map, 2_000) {
            Step::Working => {}
            Step::Found => return Ok(planner.route().points.clone()),
            Step::None => return Err(planner.obstacle().unwrap()),
        }
    }
}

/// Points every 0.1 m along corners.
pub(crate) fn along(points: &[(f32, f32)]) -> Vec<(f32, f32)> {
    let mut samples: Vec<(f32, f32)> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let count = ((pair[0].0 - pair[1].0).hypot(pair[0].1 - pair[1].1) / 0.1).ceil().max(1.0);
        samples.extend((1..=count as usize).map(|k| {
            let t = k as f32 / count;
            (pair[0].0 + t * (pair[1].0 - pair[0].0), pair[0].1 + t * (pair[1].1 - pair[0].1))
        }));
    }
    samples
}

/// Flies the stops in order, leaving out those that would show nothing new; every place on the way.
pub(crate) fn fly(site: &Site, from: (f32, f32), round: &Round, seen: &mut Seen) -> Vec<(f32, f32)> {
    let mut here = from;
    let mut flown = vec![here];
    for stop in round.stops() {
        if stop.look
            && seen.gain_m2(&site.map, round.to_see(), stop.x, stop.y) < site.map.limits().least_gain_m2
        {
            continue;
        }
        let points = route(site, here, (stop.x, stop.y)).unwrap();
        for place in along(&points) {
            seen.mark(&site.map, place.0, place.1);
            flown.push(place);
        }
        here = *flown.last().unwrap();
    }
    flown
}

/// As [`fly`], and then what the round did not show after all, planned afresh: at most twice.
pub(crate) fn fly_all(site: &Site, from: (f32, f32), round: &Round, seen: &mut Seen) -> Vec<(f32, f32)> {
    let mut flown = fly(site, from, round, seen);
    for _ in 0..2 {
        let here = *flown.last().unwrap();
        flown.extend(fly(site, here, &plan_round(site, here, seen), seen));
    }
    flown
}

/// Coverage as the contract has it, on cells of about 0.2 m by rays on the plan itself: of the free cells
/// within 3 m and in sight of anywhere that the disc and 0.15 m can reach from the pad, the share that
/// came so near to the flight.
pub(crate) fn score(plan: &Plan, pad: (f32, f32), flown: &[(f32, f32)]) -> f64 {
    let field = DistanceField::of_not_free(plan, 3.0);
    let (width, height) = (plan.width(), plan.height());
    let mut reached = vec![false; width * height];
    let start = plan.cell_index(pad.0, pad.1).unwrap();
    let mut queue = vec![start];
    reached[start.1 * width + start.0] = true;
    while let Some((ix, iy)) = queue.pop() {
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let (Some(jx), Some(jy)) = (ix.checked_add_signed(dx), iy.checked_add_signed(dy)) else {
                continue;
            };
            if jx < width && jy < height && !reached[jy * width + jx] && field.at_cell(jx, jy) >= 0.37 {
                reached[jy * width + jx] = true;
                queue.push((jx, jy));
            }
        }
    }
    let sight = |a: (f32, f32), b: (f32, f32)| {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let d = dx.hypot(dy);
        d <= 3.0 && plan.cast_ray(a.0, a.1, dy.atan2(dx), d).is_none()
    };
    let stride = ((0.2 / plan.resolution()).round() as usize).max(1);
    let places: Vec<(f32, f32)> = (0..height)
        .step_by(stride)
        .flat_map(|iy| (0..width).step_by(stride).map(move |ix| (ix, iy)))
        .filter(|(ix, iy)| reached[iy * width + ix])
        .map(|(ix, iy)| plan.centre(ix, iy))
        .collect();
    let (mut seen, mut all) = (0, 0);
    for iy in (0..height).step_by(stride) {
        for ix in (0..width).step_by(stride) {
            if plan.cell(ix, iy) != Cell::Free {
                continue;
            }
            let here = plan.centre(ix, iy);
            if reached[iy * width + ix] || places.iter().any(|place| sight(*place, here)) {
                all += 1;
                seen += usize::from(flown.iter().any(|place| sight(*place, here)));
            }
        }
    }
    seen as f64 / f64::from(all)
}

pub(crate) fn length(points: &[(f32, f32)]) -> f32 {
    points.windows(2).map(|p| (p[0].0 - p[1].0).hypot(p[0].1 - p[1].1)).sum()
}

/// The route drawn over the plan, for a failing test and for the eye.
pub(crate) fn draw(site: &Site, flown: &[(f32, f32)], stops: &[(f32, f32)]) -> String {
    let raster = site.map.raster();
    let step = 2;
    let mut rows = Vec::new();
    for row in (0..raster.height).step_by(step).rev() {
        let mut line = String::new();
        for column in (0..raster.width).step_by(step) {
            let inside = |(x, y): &&(f32, f32)| {
                raster
                    .cell(*x, *y)
                    .map(|cell| raster.column_row(cell))
                    .is_some_and(|(c, r)| c / step == column / step && r / step == row / step)
            };
            let cells = (0..step * step).map(|k| {
                ((row + k / step).min(raster.height - 1)) * raster.width
                    + (column + k % step).min(raster.width - 1)
            });
            let wall = cells.into_iter().any(|cell| !site.map.is_floor(cell));
            line.push(if stops.iter().any(|p| inside(&p)) {
                'O'
            } else if flown.iter().any(|p| inside(&p)) {
                '*'
            } else if wall {
                '#'
            } else {
                ' '
            });
        }
        rows.push(line);
    }
    rows.join("\n")
}
