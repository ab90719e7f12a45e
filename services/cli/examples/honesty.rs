//! Puts the reports of several rehearsals together: how honest was P(lost) over all of them? Prints the figures and draws
//! the calibration plot.
//!
//! `cargo run --release -p cli --example honesty -- PLOT.svg REPORT.json...`
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use airframe::score::{Honesty, Report, calibration_svg, quantile};
use anyhow::{Context, Result};

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let plot = words.next().context("which SVG to write? honesty PLOT.svg REPORT.json...")?;
    let (mut all, mut flights) = (Honesty::default(), 0);
    for file in words {
        let text = std::fs::read_to_string(&file).with_context(|| file.clone())?;
        let report: Report = serde_json::from_str(&text).with_context(|| file.clone())?;
        all.add(&report.total.honesty);
        flights += report.total.flights;
        println!("{file}: {} flights, {:.1} h", report.total.flights, report.total.honesty.time_s / 3600.0);
    }
    let hours = all.time_s / 3600.0;
    let mut noticed: Vec<f32> = all.noticed_s.iter().flatten().map(|seconds| *seconds as f32).collect();
    let of = |noticed: &mut [f32], q: f64| {
        quantile(noticed, q).map_or_else(|| "-".into(), |s| format!("{s:.1} s"))
    };
    let wrong = 100.0 * all.wrong_while_sure_s / all.time_s.max(1e-9);
    let alarms = f64::from(all.false_alarms) / hours.max(1e-9);
    println!(
        "{flights} flights, {hours:.1} h: {wrong:.3} % wrong while sure, {:.1} s in a row at most; became wrong {} times, \
         {} of them without notice before it came right, the others noticed after {} in the median and {} at the 95th \
         percentile; {alarms:.2} false alarms an hour",
        all.longest_wrong_while_sure_s,
        all.noticed_s.len(),
        all.noticed_s.len() - noticed.len(),
        of(&mut noticed, 0.5),
        of(&mut noticed, 0.95),
    );
    for class in all.calibration.iter().filter(|class| class.time_s > 0.0) {
        println!(
            "  said {:>5.1} to {:>5.1} %: {:>8.0} s, {:>6.2} % wrong",
            100.0 * class.from,
            100.0 * class.to,
            class.time_s,
            100.0 * class.wrong_s / class.time_s
        );
    }
    let caption = format!("{flights} flights, {hours:.1} h in the air; the area of a dot is the time");
    std::fs::write(&plot, calibration_svg(&all, &caption)).with_context(|| plot.clone())?;
    println!("{plot}");
    Ok(())
}
