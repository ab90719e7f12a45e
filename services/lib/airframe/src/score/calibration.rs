//! The calibration plot of P(lost): how often what was said was so.

use super::honesty::{Class, Honesty};
use std::fmt::Write;

/// Pixels of the plot, and around it.
const SIDE_PX: f64 = 420.0;
const LEFT_PX: f64 = 70.0;
const TOP_PX: f64 = 40.0;
/// Both axes are logarithmic from here to 1.
const LEAST: f64 = 1e-4;
/// Seconds in a class that a dot of one pixel stands for; its area grows with the time.
const SECONDS_PX: f64 = 4.0;

/// Draws the classes as an SVG: what was said (the middle of a class) against the share of that time in which the
/// estimate was more than a metre off. Dots on the line are honest, dots over it are overconfident.
#[must_use]
pub fn calibration_svg(honesty: &Honesty, caption: &str) -> String {
    let mut body = String::new();
    let bottom = TOP_PX + SIDE_PX;
    let at = |share: f64| (1.0 - share.clamp(LEAST, 1.0).log10() / LEAST.log10()) * SIDE_PX;
    let _ = writeln!(
        body,
        "<rect x=\"{LEFT_PX}\" y=\"{TOP_PX}\" width=\"{SIDE_PX}\" height=\"{SIDE_PX}\" fill=\"none\" stroke=\"#000\"/>\n\
         <path d=\"M{LEFT_PX} {bottom}L{:.1} {TOP_PX}\" stroke=\"#888\" stroke-dasharray=\"5 4\"/>",
        LEFT_PX + SIDE_PX
    );
    for (share, text) in [(1e-4, "0.01"), (1e-3, "0.1"), (1e-2, "1"), (1e-1, "10"), (1.0, "100")] {
        let _ = writeln!(
            body,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
            LEFT_PX + at(share),
            bottom + 16.0,
            LEFT_PX - 6.0,
            bottom - at(share) + 4.0
        );
    }
    for class in honesty.calibration.iter().filter(|class| class.time_s > 0.0) {
        let said = middle(class);
        let wrong = class.wrong_s / class.time_s;
        let radius = (class.time_s / SECONDS_PX).sqrt().clamp(2.0, 14.0);
        let _ = writeln!(
            body,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius:.1}\" fill=\"#1f77b4\" fill-opacity=\"0.7\"><title>said {:.1} to \
             {:.1} %: {:.0} s, {:.2} % wrong</title></circle>",
            LEFT_PX + at(said),
            bottom - at(wrong),
            100.0 * class.from,
            100.0 * class.to,
            class.time_s,
            100.0 * wrong
        );
    }
    let (width, height) = (LEFT_PX + SIDE_PX + 20.0, bottom + 60.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" font-family=\"sans-serif\" \
         font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}<text x=\"{LEFT_PX}\" \
         y=\"24\" font-size=\"13\">P(lost): said, and so</text>\n<text x=\"{:.1}\" y=\"{:.1}\" \
         text-anchor=\"middle\">P(lost) as said, %</text>\n<text x=\"18\" y=\"{:.1}\" text-anchor=\"middle\" \
         transform=\"rotate(-90 18 {:.1})\">of that time more than 1 m off, %</text>\n<text x=\"8\" y=\"{:.1}\" \
         fill=\"#333\">{}</text>\n</svg>\n",
        LEFT_PX + 0.5 * SIDE_PX,
        bottom + 32.0,
        TOP_PX + 0.5 * SIDE_PX,
        TOP_PX + 0.5 * SIDE_PX,
        bottom + 52.0,
        caption.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
    )
}

/// Where a class is drawn: between its edges, in the middle of their logarithms.
fn middle(class: &Class) -> f64 {
    (class.from.max(1e-3) * class.to).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_honest_class_lies_on_the_line_and_empty_ones_are_not_drawn() {
        let class = |from: f64, to: f64, time_s: f64, wrong_s: f64| Class { from, to, time_s, wrong_s };
        let honesty = Honesty {
            calibration: vec![
                class(0.1, 0.1, 100.0, 10.0),
                class(0.01, 0.01, 100.0, 100.0),
                class(0.5, 0.6, 0.0, 0.0),
            ],
            ..Honesty::default()
        };
        let svg = calibration_svg(&honesty, "a < b");
        assert_eq!(svg.matches("<circle").count(), 2);
        // A tenth is three quarters of the way along both axes.
        assert!(svg.contains("cx=\"385.0\" cy=\"145.0\""), "{svg}");
        assert!(svg.contains("cx=\"280.0\" cy=\"40.0\""), "said 1 %, always wrong: {svg}");
        assert!(svg.contains("a &lt; b") && svg.ends_with("</svg>\n"));
    }
}
