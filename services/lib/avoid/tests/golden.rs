//! The committed figures are what this code draws.
#![allow(clippy::unwrap_used, unreachable_pub, dead_code, reason = "tests, sharing code with an example")]

#[path = "../examples/figures/drawings.rs"]
mod drawings;
#[path = "../examples/figures/scenes.rs"]
mod scenes;
#[path = "../examples/figures/svg.rs"]
mod svg;
#[path = "../examples/figures/world.rs"]
mod world;

use std::path::Path;

/// Largest file: a reader's browser draws it at once, and a change of one shows in review.
const MOST_BYTES: usize = 60 * 1024;

#[test]
fn the_committed_figures_are_drawn_by_this_code() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/figures");
    let figures = drawings::all();
    assert_eq!(figures.len(), 12);
    for (name, drawn) in figures {
        assert!(drawn.len() < MOST_BYTES, "{name}: {} bytes", drawn.len());
        let committed = std::fs::read_to_string(directory.join(name)).unwrap();
        assert!(committed == drawn, "{name} is out of date: `cargo xtask figures` draws it again");
    }
}

#[test]
fn figure_3_6_is_the_table_of_the_thesis_with_its_sign() {
    let thesis = "\
-135\t\t\t-90\t\t\t-45
\t-135\t\t-90\t\t-45\t
\t\t-135\t-90\t-45\t\t
±180\t±180\t±180\t\t0\t0\t0
\t\t135\t90\t45\t\t
\t135\t\t90\t\t45\t
135\t\t\t90\t\t\t45";
    let ours: Vec<String> = drawings::angle_table()
        .into_iter()
        .map(|row| row.into_iter().map(Option::unwrap_or_default).collect::<Vec<_>>().join("\t"))
        .collect();
    assert_eq!(ours.join("\n"), thesis);
}
