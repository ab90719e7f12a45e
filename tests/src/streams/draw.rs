//! What is drawn for a stream: what is broken, and what the pilot is told wrongly.

use super::program::Program;
use super::teller::Offset;
use super::{FIRST_S, PERIOD_S, STREAM_S, STREAMS};
use airframe::simulation::faults::{Fault, FaultKind, SonarFault};
use core::f32::consts::PI;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// One stream.
#[derive(Clone, Debug)]
pub struct Stream {
    /// Seed of its commands.
    pub seed: u64,
    /// What the pilot is told wrongly.
    pub offset: Offset,
    /// What is broken.
    pub faults: Vec<Fault>,
}

/// Kinds of one sonar's faults.
const SONAR_FAULTS: usize = 7;

/// The streams of one flight. `sides` names the sonars around.
#[must_use]
pub fn draw(seed: u64, sides: &[String]) -> Vec<Stream> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5712_ea35);
    (0..STREAMS).map(|number| stream(&mut random, number, sides)).collect()
}

fn stream(random: &mut Xoshiro256PlusPlus, number: usize, sides: &[String]) -> Stream {
    let from_s = FIRST_S + PERIOD_S * number as f64;
    let mut faults = Vec::new();
    let mut breaks = |kind| {
        faults.push(Fault { from_s: Some(from_s), until_s: Some(from_s + STREAM_S), kind });
    };
    match random.random_range(0..100) {
        0..30 => {}
        30..70 => breaks(one_sonar(random, sides)),
        70..85 => (0..2).for_each(|_| breaks(one_sonar(random, sides))),
        85..88 => breaks(FaultKind::Sonars { sonars: vec!["sides".to_owned()], does: SonarFault::Dead }),
        88..91 => breaks(FaultKind::FlowSilent),
        91..94 => breaks(one_down(random)),
        _ => breaks(FaultKind::Gust {
            m_s2: random.random_range(0.2..0.6),
            degrees: random.random_range(-180.0..180.0),
        }),
    }
    Stream { seed: random.random(), offset: offset(random), faults }
}

fn one_sonar(random: &mut Xoshiro256PlusPlus, sides: &[String]) -> FaultKind {
    let which = random.random_range(0..sides.len());
    let does = match random.random_range(0..SONAR_FAULTS) {
        0 => SonarFault::Dead,
        1 => SonarFault::Deaf,
        2 => SonarFault::Stuck { metres: random.random_bool(0.5).then(|| random.random_range(0.3..4.0)) },
        3 => SonarFault::Spikes { share: random.random_range(0.05..0.5) },
        4 => SonarFault::Crosstalk { hears: sides[(which + 1) % sides.len()].clone() },
        5 => SonarFault::Taped,
        _ => SonarFault::Turned { degrees: random.random_range(-25.0..25.0) },
    };
    FaultKind::Sonars { sonars: vec![sides[which].clone()], does }
}

fn one_down(random: &mut Xoshiro256PlusPlus) -> FaultKind {
    let does = match random.random_range(0..3) {
        0 => SonarFault::Dead,
        1 => SonarFault::Spikes { share: random.random_range(0.05..0.5) },
        _ => SonarFault::Taped,
    };
    FaultKind::Sonars { sonars: vec!["down".to_owned()], does }
}

/// Most streams are as wrong as a filter that tracks; one in five is as wrong as one that slipped along a corridor, and one
/// in twenty is wrong altogether. Half of them know it.
fn offset(random: &mut Xoshiro256PlusPlus) -> Offset {
    let off_m = match random.random_range(0..20) {
        0 => random.random_range(0.5..2.0),
        1..5 => random.random_range(0.15..0.5),
        _ => random.random_range(0.0..0.15f32),
    };
    let direction = random.random_range(-PI..PI);
    let honest = random.random_bool(0.5);
    Offset {
        x_m: off_m * direction.cos(),
        y_m: off_m * direction.sin(),
        heading_rad: random.random_range(-0.1..0.1),
        // 0.5 m is what the failsafe takes for uncertain.
        sigma_m: if honest { off_m.clamp(0.03, 0.45) } else { 0.03 },
    }
}

impl Stream {
    /// What is asked for, in a word.
    #[must_use]
    pub fn kind(&self) -> super::Kind {
        Program::draw(self.seed, 0.5, 1.0).kind
    }

    /// What is broken, in words.
    #[must_use]
    pub fn broken(&self) -> String {
        let words = self.faults.iter().map(|fault| format!("{:?}", fault.kind));
        let text = words.collect::<Vec<_>>().join(", ");
        if text.is_empty() { "nothing".to_owned() } else { text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_says_all_and_everything_is_drawn() {
        let sides = ["front".to_owned(), "left".to_owned(), "rear".to_owned()];
        let words = |seed| format!("{:?}", draw(seed, &sides));
        assert_eq!(words(7), words(7));
        assert_ne!(words(7), words(8));
        let all: String = (0..60).map(words).collect();
        for word in
            ["Dead", "Deaf", "Stuck", "Spikes", "Crosstalk", "Taped", "Turned", "FlowSilent", "Gust", "down"]
        {
            assert!(all.contains(word), "{word} is never drawn");
        }
        let streams: Vec<Stream> = (0..60).flat_map(|seed| draw(seed, &sides)).collect();
        let off = |s: &&Stream| s.offset.x_m.hypot(s.offset.y_m);
        assert!(streams.iter().any(|s| s.faults.is_empty()) && streams.iter().any(|s| s.faults.len() == 2));
        assert!(
            streams.iter().any(|s| off(&s) > 1.0) && streams.iter().filter(|s| off(s) < 0.15).count() > 300
        );
    }
}
