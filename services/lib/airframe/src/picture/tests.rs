use super::*;
use crate::score::{Ending, Observation, Scorer};
use crate::world::{ClutterLevel, PadEntry, WorldFile};
use floorplan::{Plan, Sidecar};

#[test]
fn a_picture_shows_paths_calls_and_escapes_names() {
    let mut rows = vec!["#".repeat(102)];
    rows.extend((0..60).map(|_| format!("#{}#", " ".repeat(100))));
    rows.push("#".repeat(102));
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let plan = Plan::from_ascii(&rows, 0.1);
    let pad = Some(PadEntry { x_m: 2.0, y_m: 3.0, heading_deg: 0.0 });
    let file = WorldFile { pad, ..WorldFile::default() };
    let mut world = World::build(&plan, &Sidecar::default(), &file, ClutterLevel::Full, 3).expect("a world");
    let mut scorer = Scorer::new(&world, 0.225);
    let mut track = Track::default();
    for tick in 0..400 {
        let time_s = f64::from(tick) * 0.05;
        let (x, y) = (2.0 + 0.3 * time_s as f32, 3.0 + (time_s as f32 * 0.4).sin());
        world.advance(time_s, (x, y));
        let estimate = (tick % 100 > 10).then_some((x + 0.05, y, 0.0));
        scorer
            .observe(&world, &Observation { time_s, x, y, yaw: 0.0, airborne: true, estimate, p_lost: None });
        let clearance = world.clearance(x, y, 1.1, 0.2, 0.225);
        track.observe(
            &world,
            time_s,
            (x, y),
            estimate.map(|e| (e.0, e.1)),
            clearance,
            (1.1, 0.2, 0.225),
            [(1.0, 1.0)],
        );
    }
    let coverage = scorer.coverage().clone();
    let ending = Ending {
        seed: 3,
        contacts: 0,
        min_clearance_m: 0.1,
        landed: true,
        place: (2.0, 3.0),
        failsafes: Vec::new(),
        skipped: vec!["R&D <lab>: door closed".into()],
        stalled_s: 0.0,
        digest: 0,
    };
    let report = scorer.finish(&world, ending).report;
    let labels = [("Hall".to_owned(), 5.0, 3.0)];
    let picture = Picture {
        title: "A \"flight\"",
        world: &world,
        coverage: &coverage,
        track: &track,
        report: &report,
        labels: &labels,
    };
    let svg = picture.draw();
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("A &quot;flight&quot;") && svg.contains("R&amp;D &lt;lab&gt;"));
    assert!(svg.contains("landed on the pad") && svg.contains(">Hall<") && svg.contains("true path"));
    assert_eq!(svg.matches("<g").count(), svg.matches("</g>").count());
    // The estimate was absent four times: the line is broken and taken up again.
    let believed = svg.lines().find(|line| line.contains(BELIEVED)).expect("a line");
    assert_eq!(believed.matches('M').count(), 4);
    assert!(track.closest().windows(2).all(|w| w[0].clearance <= w[1].clearance));
    assert!(!svg.contains("http://") || svg.matches("http://").count() == 1, "self-contained");
}
