//! What was encoded, decoded again.
#![allow(clippy::unwrap_used, reason = "tests")]

use camera::{Encoder, Frame, Pattern, Source, StillError, Stills};
use ipc_types::{Format, STILL_BYTES, VIDEO_BYTES};
use openh264::decoder::Decoder;
use openh264::formats::YUVSource;

const FORMAT: Format = Format { width: 640, height: 480, fps: 30, bitrate: 2_000_000 };
const FRAME_NS: u64 = 33_400_000;

struct Bench {
    source: Pattern,
    encoder: Encoder,
    decoder: Decoder,
    now: u64,
    out: Vec<u8>,
}

/// One frame encoded: its size, whether it is a key frame, and how well the decoded luma fits.
struct Outcome {
    bytes: Vec<u8>,
    key: bool,
    psnr_db: f64,
}

impl Bench {
    fn new() -> Self {
        Self {
            source: Pattern::default(),
            encoder: Encoder::new(10.0),
            decoder: Decoder::new().unwrap(),
            now: 1_000_000_000,
            out: vec![0; VIDEO_BYTES],
        }
    }

    fn frame(&mut self, format: &Format, key: bool) -> Outcome {
        self.now += FRAME_NS.max(1_000_000_001 / u64::from(format.fps));
        let frame = self.source.frame(self.now, Some(format)).unwrap();
        let encoded = self.encoder.encode(frame, format, key, &mut self.out).unwrap();
        let bytes = self.out[..encoded.length].to_vec();
        let decoded = self.decoder.decode(&bytes).unwrap().unwrap();
        assert_eq!(decoded.dimensions(), (format.width as usize, format.height as usize));
        let psnr_db = psnr(&frame, &decoded);
        Outcome { bytes, key: encoded.key, psnr_db }
    }
}

fn psnr(frame: &Frame<'_>, decoded: &impl YUVSource) -> f64 {
    let (width, stride) = (frame.width as usize, decoded.strides().0);
    let sum: u64 = (0..frame.height as usize)
        .flat_map(|row| (0..width).map(move |column| (row, column)))
        .map(|(row, column)| {
            let (a, b) = (frame.planes[0][row * width + column], decoded.y()[row * stride + column]);
            u64::from(a.abs_diff(b)).pow(2)
        })
        .sum();
    let mean = sum.max(1) as f64 / (width * frame.height as usize) as f64;
    10.0 * (255.0 * 255.0 / mean).log10()
}

#[test]
fn what_is_decoded_is_what_was_seen_and_the_first_frame_is_a_key_frame() {
    let mut bench = Bench::new();
    let first = bench.frame(&FORMAT, false);
    assert!(first.key && first.psnr_db > 35.0, "{}", first.psnr_db);
    // Sequence parameter set: baseline (66), constrained to what main decodes too.
    let sps = first.bytes.windows(5).find(|w| w[..4] == [0, 0, 0, 1] && w[4] & 31 == 7).unwrap();
    let at = first.bytes.windows(5).position(|w| w == sps).unwrap() + 5;
    assert_eq!(first.bytes[at], 66);
    assert_eq!(first.bytes[at + 1] & 0x40, 0x40, "constraint_set1_flag: constrained baseline");
    let mut spent = 0;
    for k in 1..60 {
        let outcome = bench.frame(&FORMAT, false);
        assert!(!outcome.key && outcome.psnr_db > 32.0, "frame {k}: {}", outcome.psnr_db);
        spent += outcome.bytes.len();
    }
    let rate = spent as f64 * 8.0 / 2.0;
    assert!(rate < 2.5e6, "{rate} bit/s");
}

#[test]
fn a_key_frame_comes_when_it_is_asked_for_and_can_be_decoded_alone() {
    let mut bench = Bench::new();
    for _ in 0..5 {
        bench.frame(&FORMAT, false);
    }
    let key = bench.frame(&FORMAT, true);
    assert!(key.key);
    let mut fresh = Decoder::new().unwrap();
    assert!(fresh.decode(&key.bytes).unwrap().is_some(), "it carries its parameter sets");
    assert!(!bench.frame(&FORMAT, false).key);
}

#[test]
fn a_new_size_begins_with_a_key_frame() {
    let mut bench = Bench::new();
    for _ in 0..10 {
        bench.frame(&FORMAT, false);
    }
    let large = Format { width: 1280, height: 720, fps: 15, bitrate: 3_000_000 };
    assert!(bench.encoder.begins_with(1280, 720));
    assert!(bench.frame(&large, false).key);
    assert!(!bench.frame(&large, false).key);
    assert!(bench.frame(&FORMAT, false).key, "and back");
}

/// A picture that costs bits: every pixel moves, by a fixed generator.
fn restless(number: u64) -> Vec<u8> {
    let mut state = number.wrapping_mul(0x9e37_79b9) as u32 | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 27) as u8
    };
    (0..640 * 480 * 3 / 2).map(|at| (at / 640 % 200) as u8 + 20 + next()).collect()
}

#[test]
fn the_bitrate_follows_what_is_wished_for_without_a_key_frame() {
    let mut encoder = Encoder::new(60.0);
    let mut out = vec![0; VIDEO_BYTES];
    let mut number = 0;
    let mut spend = |fps: u32, bitrate: u32| -> f64 {
        let mut spent = 0;
        // The first second is for the rate control to find the new level.
        for k in 0..3 * fps {
            number += 1;
            let planes = restless(number);
            let (y, rest) = planes.split_at(640 * 480);
            let (u, v) = rest.split_at(320 * 240);
            let frame = Frame {
                capture_ns: number * 1_000_000_000 / u64::from(fps),
                number,
                width: 640,
                height: 480,
                stride: 640,
                planes: [y, u, v],
            };
            let format = Format { fps, bitrate, ..FORMAT };
            let encoded = encoder.encode(frame, &format, false, &mut out).unwrap();
            assert_eq!(encoded.key, number == 1);
            spent += if k >= fps { encoded.length } else { 0 };
        }
        spent as f64 * 4.0
    };
    let (high, low, again) = (spend(30, 4_000_000), spend(15, 800_000), spend(30, 4_000_000));
    assert!(
        (2e6..6e6).contains(&high) && (2e6..6e6).contains(&again),
        "{high} and {again} bit/s for 4 Mbit/s"
    );
    assert!(low < 1.8e6, "{low} bit/s for 0.8 Mbit/s");
}

#[test]
fn a_frame_that_does_not_fit_is_refused_and_the_next_is_a_key_frame() {
    let mut bench = Bench::new();
    bench.frame(&FORMAT, false);
    bench.now += FRAME_NS;
    let frame = bench.source.frame(bench.now, Some(&FORMAT)).unwrap();
    let error = bench.encoder.encode(frame, &FORMAT, true, &mut [0; 100]).unwrap_err().to_string();
    assert!(error.contains("640x480") && error.contains("does not fit"), "{error}");
    assert!(bench.frame(&FORMAT, false).key);
}

/// A still is decoded by another decoder than it was made by, and shows the bars of the pattern in their colours.
#[test]
fn a_still_is_a_jpeg_of_the_frame_at_most_720_wide() {
    let mut source = Pattern::default();
    let mut stills = Stills::default();
    let mut out = vec![0; STILL_BYTES];
    for (width, height, wanted) in
        [(640, 480, (640, 480)), (1280, 720, (640, 360)), (1920, 1080, (640, 360)), (160, 120, (160, 120))]
    {
        let format = Format { width, height, fps: 10, bitrate: 1_000_000 };
        let frame = source.frame(u64::from(width) * 1_000_000_000, Some(&format)).unwrap();
        let taken = stills.take(&frame, &mut out).unwrap();
        assert_eq!((taken.width, taken.height), wanted);
        let jpeg = image::load_from_memory_with_format(&out[..taken.length], image::ImageFormat::Jpeg);
        let picture = jpeg.unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), wanted);
        // The middle of the second bar is yellow, of the sixth red.
        for (bar, wanted) in [(1, [191, 191, 0]), (5, [191, 0, 0])] {
            let pixel = picture.get_pixel((2 * bar + 1) * taken.width / 16, taken.height / 4).0;
            let near = pixel.iter().zip(wanted).all(|(a, b): (&u8, u8)| a.abs_diff(b) < 16);
            assert!(near, "{width}x{height}: bar {bar} is {pixel:?}, wanted {wanted:?}");
        }
    }
}

#[test]
fn a_still_that_does_not_fit_is_made_coarser_and_then_refused() {
    let noise: Vec<u8> = (0_u32..640 * 480).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let frame = Frame {
        capture_ns: 1,
        number: 1,
        width: 640,
        height: 480,
        stride: 640,
        planes: [&noise, &noise[..640 * 120], &noise[..640 * 120]],
    };
    let mut out = vec![0; STILL_BYTES];
    let mut stills = Stills::default();
    let taken = stills.take(&frame, &mut out).unwrap();
    assert!(taken.quality < 80 && taken.length <= STILL_BYTES, "{taken:?}");
    let error = stills.take(&frame, &mut out[..1000]).unwrap_err();
    assert_eq!(error, StillError::TooLarge { width: 640, height: 480, room: 1000 });
    let short = Frame { planes: [&noise[..640], &noise, &noise], ..frame };
    assert_eq!(stills.take(&short, &mut out).unwrap_err(), StillError::Broken);
}
