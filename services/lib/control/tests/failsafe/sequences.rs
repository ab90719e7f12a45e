//! A million random flights through the table.
//!
//! Seeded, so that each run is the same. What is asserted is not that of any row but of the whole: what may never happen
//! in whatever order conditions come and go.

use crate::design::{grounds_after_s, locks_out_after_s};
use control::{Action, Cause, Condition, Failsafe, Flags, Judgement, OperatorLost, Policy, Stage, TakeOver};

const SEQUENCES: u64 = 1_000_000;
const STEPS: usize = 8;
const COUNT: usize = Condition::ALL.len();
/// The longest time that a condition outlives its last sign, and a step more: `battery_clear_s`.
const GONE_S: f64 = 3.1;
/// Between two steps, seconds: from one of the pilot's to longer than any time of the table.
const GAPS_S: [f64; 10] = [0.02, 0.02, 0.1, 0.2, 0.3, 0.7, 1.3, 4.0, 9.0, 65.0];

/// Splitmix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// How often each claim was put to the test.
#[derive(Default)]
struct Tried {
    lasting: u64,
    cut: u64,
    landing: u64,
    grounded: u64,
    free_to_arm: u64,
    locked_out: u64,
    by_hand: u64,
    for_ever: u64,
}

struct Sequence {
    failsafe: Failsafe,
    /// The same, told "for ever" where this one is told what is no number.
    twin: Option<Failsafe>,
    policy: Policy,
    now_s: f64,
    stage: Stage,
    /// Since when each condition has been so without interruption.
    since_s: [Option<f64>; COUNT],
    /// When each was so last.
    last_s: [f64; COUNT],
    judged: Judgement,
    /// An emergency landing has begun and nobody has ended it.
    landing: bool,
    cut: bool,
    /// The last step was told of something that has been so for ever.
    for_ever: bool,
    /// In this flight something has locked a human out.
    shut: bool,
}

impl Sequence {
    fn new(random: &mut Random) -> Self {
        let operator_lost = [OperatorLost::Hold, OperatorLost::Return, OperatorLost::Land][random.below(3)];
        Self {
            failsafe: Failsafe::default(),
            twin: (random.below(4) == 0).then(Failsafe::default),
            policy: Policy { operator_lost, ..Policy::default() },
            now_s: 1.0,
            stage: Stage::Grounded,
            since_s: [None; COUNT],
            last_s: [f64::NEG_INFINITY; COUNT],
            judged: Judgement::NOTHING,
            landing: false,
            cut: false,
            for_ever: false,
            shut: false,
        }
    }

    fn lasted_s(&self, condition: Condition) -> f64 {
        self.since_s[condition as usize].map_or(0.0, |since| self.now_s - since)
    }

    /// Not so for longer than anything is remembered.
    fn long_gone(&self, condition: Condition) -> bool {
        self.since_s[condition as usize].is_none() && self.now_s - self.last_s[condition as usize] > GONE_S
    }

    fn step(&mut self, random: &mut Random, tried: &mut Tried) {
        let (before, stage_before) = (self.judged, self.stage);
        let all_steady =
            Condition::ALL.iter().all(|c| self.since_s[*c as usize].is_some() || self.long_gone(*c));
        let held = self.since_s;
        self.now_s += GAPS_S[random.below(GAPS_S.len())];
        if random.below(3) == 0 {
            self.stage = Stage::ALL[random.below(Stage::ALL.len())];
        }
        let for_ever = self.twin.is_some() && random.below(3) == 0;
        let mut flags = Flags::default();
        let mut twin_flags = Flags::default();
        for &condition in Condition::ALL {
            let k = condition as usize;
            // Half of the causes of a step go at the next one; few begin at once.
            let is_so = if self.since_s[k].is_some() { random.below(5) > 0 } else { random.below(9) == 0 };
            self.since_s[k] = if is_so { self.since_s[k].or(Some(self.now_s)) } else { None };
            if is_so {
                self.last_s[k] = self.now_s;
            }
            if matches!(condition, Condition::Adrift | Condition::HeightSilent) {
                let (seconds, twin_seconds) = if for_ever && is_so {
                    self.since_s[k] = Some(f64::NEG_INFINITY);
                    (f32::NAN, f32::INFINITY)
                } else {
                    (self.lasted_s(condition) as f32, self.lasted_s(condition) as f32)
                };
                flags.set_lasted(condition, seconds);
                twin_flags.set_lasted(condition, twin_seconds);
            } else {
                flags.set(condition, is_so);
                twin_flags.set(condition, is_so);
            }
        }
        let now = (self.now_s * 1e9) as u64;
        self.judged = self.failsafe.step(now, &flags, self.stage, &self.policy);
        if let Some(twin) = &mut self.twin {
            assert_eq!(twin.step(now, &twin_flags, self.stage, &self.policy), self.judged);
            tried.for_ever += u64::from(for_ever);
        }
        // Told "for ever" once, it is not so afterwards.
        for since in &mut self.since_s {
            if *since == Some(f64::NEG_INFINITY) {
                *since = Some(self.now_s);
            }
        }
        let lasts = !self.for_ever && (0..COUNT).all(|k| held[k].is_none() || self.since_s[k] == held[k]);
        self.for_ever = for_ever;
        self.check(before, stage_before, all_steady && lasts, tried);
    }

    fn check(&mut self, before: Judgement, stage_before: Stage, lasts: bool, tried: &mut Tried) {
        let judged = self.judged;
        if lasts && self.stage == stage_before {
            tried.lasting += 1;
            assert!(judged.action >= before.action, "{before:?} {judged:?}: milder while its causes last");
            assert_eq!(judged.causes & before.causes, before.causes);
        }
        let taken = self.stage == Stage::Manual && stage_before != Stage::Manual;
        // A human may have ended it.
        self.landing &= !(taken && before.take_over != TakeOver::No);
        if self.stage == Stage::Grounded {
            (self.landing, self.cut, self.shut) = (false, false, false);
            assert_eq!((judged.action, judged.causes), (Action::None, 0));
        } else if self.cut {
            tried.cut += 1;
            assert_eq!((judged.action, judged.take_over), (Action::Cut, TakeOver::No));
            assert!(judged.no_arming >= Cause::Tilt);
        } else if self.landing {
            tried.landing += 1;
            assert!(judged.action >= Action::Land, "{before:?} {judged:?}: an emergency landing went back");
            assert_ne!(judged.no_arming, Cause::None);
        }
        self.cut |= judged.action == Action::Cut;
        let emergency = judged.action >= Action::Land && judged.cause != Cause::Operator;
        self.landing |= emergency;
        if self.for_ever {
            // Whatever that was has lasted longer than is known here.
            self.shut = true;
            return;
        }
        self.check_arming(tried);
        self.check_lock_out(tried);
    }

    /// Whoever wants to arm is refused while a cause holds that says so, and not without one.
    fn check_arming(&self, tried: &mut Tried) {
        let judged = self.judged;
        let holds = |condition: &Condition| {
            grounds_after_s(*condition)
                .is_some_and(|after| self.lasted_s(*condition) > f64::from(after) + 1e-3)
        };
        if Condition::ALL.iter().any(holds) {
            tried.grounded += 1;
            assert_ne!(judged.no_arming, Cause::None);
        }
        let grounding = |condition: &&Condition| grounds_after_s(**condition).is_some();
        if self.stage == Stage::Grounded
            && Condition::ALL.iter().filter(grounding).all(|condition| self.long_gone(*condition))
        {
            tried.free_to_arm += 1;
            assert_eq!(judged.no_arming, Cause::None);
        }
    }

    /// A human is locked out by what the table says and by nothing else.
    fn check_lock_out(&mut self, tried: &mut Tried) {
        let judged = self.judged;
        let shuts = |condition: &Condition| {
            locks_out_after_s(*condition)
                .is_some_and(|after| self.lasted_s(*condition) > f64::from(after) + 1e-3)
        };
        let might =
            |condition: &Condition| locks_out_after_s(*condition).is_some() && !self.long_gone(*condition);
        let in_the_air = self.stage.in_the_air();
        let (shuts, might) = (Condition::ALL.iter().any(shuts), Condition::ALL.iter().any(might));
        self.shut |= in_the_air && might;
        if in_the_air && shuts {
            tried.locked_out += 1;
            assert_eq!(judged.take_over, TakeOver::No);
        }
        if !self.shut {
            assert_ne!(judged.take_over, TakeOver::No, "locked out by nothing");
            if self.stage == Stage::Manual && judged.action != Action::None {
                tried.by_hand += 1;
                assert!(
                    judged.lease_over
                        || judged.cause == Cause::OperatorSilent
                        || judged.cause == Cause::Operator
                );
            }
        }
    }
}

#[test]
fn no_order_of_events_breaks_what_the_table_promises() {
    let mut random = Random(20_261_115);
    let mut tried = Tried::default();
    for _ in 0..SEQUENCES {
        let mut sequence = Sequence::new(&mut random);
        for _ in 0..STEPS {
            sequence.step(&mut random, &mut tried);
        }
    }
    // Each claim was put to the test often.
    let least = [
        tried.lasting,
        tried.cut,
        tried.landing,
        tried.grounded,
        tried.free_to_arm,
        tried.locked_out,
        tried.by_hand,
        tried.for_ever,
    ];
    assert!(least.iter().all(|times| *times > 10_000), "{least:?}");
}
