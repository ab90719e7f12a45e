//! What encoding a frame costs, of the simulated picture and of the test pattern.
//!
//! `cargo run --release -p camera --example cost`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example")]

use camera::{Encoder, Pattern, Source};
use ipc_types::{Format, VIDEO_BYTES};
use std::time::Instant;

fn main() {
    println!("assembler parts: {}", if camera::HAS_ASSEMBLER { "yes" } else { "no (install nasm)" });
    let mut out = vec![0; VIDEO_BYTES];
    for (width, height, fps, bitrate) in
        [(640, 480, 30, 1_000_000), (1280, 720, 15, 2_000_000), (1920, 1080, 15, 4_000_000)]
    {
        let format = Format { width, height, fps, bitrate };
        let (mut encoder, mut source) = (Encoder::new(10.0), Pattern::default());
        let mut costs: Vec<f64> = (0..150u64)
            .filter_map(|k| {
                let frame = source.frame(1_000_000_000 + k * 70_000_000, Some(&format))?;
                let began = Instant::now();
                encoder.encode(frame, &format, false, &mut out).unwrap();
                Some(began.elapsed().as_secs_f64() * 1e3)
            })
            .collect();
        costs.sort_by(f64::total_cmp);
        println!(
            "{width}x{height}: least {:.2} ms, median {:.2} ms a frame",
            costs[0],
            costs[costs.len() / 2]
        );
    }
}
