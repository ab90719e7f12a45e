//! The lease of the sticks: random streams against what DESIGN 4 promises, and each rule by itself.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use control::{Axes, Flip, Hand, Lease, StickInput, SticksHeard, Terms, Under};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::collections::BTreeSet;

const MS: u64 = 1_000_000;
const STEP: u64 = 20 * MS;
const TERMS: Terms = Terms { hover_s: 0.25, lease_s: 1.0, spare_s: 0.04, neutral: 0.08 };
const STANDING: Under = Under::Hand { stands: true };

fn input(lease: u64, sequence: u64, made_ns: u64, forward: f32) -> StickInput {
    StickInput {
        lease,
        sequence,
        made_ns,
        axes: Axes::checked(forward, 0.0, 0.0, 0.0).unwrap(),
        held: true,
        height_hold: true,
        heading_hold: true,
        arm: None,
    }
}

/// A holder who moves his hand each 20 ms, and the drone under it.
struct Rig {
    lease: Lease<u32>,
    now: u64,
    sequence: u64,
    number: u64,
}

impl Rig {
    fn granted() -> Self {
        let mut lease = Lease::default();
        let now = 5_000 * MS;
        let number = lease.ask(now, 1, &TERMS).unwrap();
        Self { lease, now, sequence: 0, number }
    }

    fn hear(&mut self, change: impl Fn(&mut StickInput)) -> SticksHeard {
        self.sequence += 1;
        let mut new = input(self.number, self.sequence, self.now, 0.0);
        change(&mut new);
        self.lease.hear(self.now, &new, &TERMS)
    }

    fn step(&mut self, under: Under) -> Option<f32> {
        let ended = self.lease.step(self.now, under, &TERMS);
        self.now += STEP;
        ended
    }

    fn until(&mut self, under: Under, hand: Hand, change: impl Fn(&mut StickInput)) {
        for _ in 0..10 {
            self.hear(&change);
            self.step(under);
            if self.lease.hand() == hand {
                return;
            }
        }
        panic!("{:?} instead of {hand:?}", self.lease.hand());
    }

    fn following() -> Self {
        let mut rig = Self::granted();
        rig.until(STANDING, Hand::Following, |_| {});
        rig
    }
}

#[test]
fn it_stops_passes_neutral_and_then_follows_while_the_button_is_held() {
    let mut rig = Rig::granted();
    for _ in 0..20 {
        rig.hear(|_| {});
        rig.step(Under::Hand { stands: false });
        assert_eq!(rig.lease.hand(), Hand::Stopping);
    }
    for _ in 0..20 {
        rig.hear(|new| new.axes.turn = 0.09);
        rig.step(STANDING);
        assert_eq!(rig.lease.hand(), Hand::AwaitingNeutral);
        assert_eq!(rig.lease.followed(), None);
    }
    rig.hear(|new| (new.axes.turn, new.held) = (-0.08, false));
    rig.step(STANDING);
    assert_eq!(rig.lease.hand(), Hand::Ready);
    for _ in 0..20 {
        rig.hear(|new| (new.axes.forward, new.held) = (1.0, false));
        rig.step(STANDING);
        assert_eq!((rig.lease.hand(), rig.lease.followed()), (Hand::Ready, None));
    }
    rig.hear(|new| new.axes.forward = 1.0);
    rig.step(Under::Hand { stands: false });
    assert_eq!(rig.lease.hand(), Hand::Following);
    assert_eq!(rig.lease.followed().unwrap().axes.forward, 1.0);
    rig.hear(|new| (new.axes.forward, new.held) = (1.0, false));
    rig.step(Under::Hand { stands: false });
    assert_eq!((rig.lease.hand(), rig.lease.followed()), (Hand::Ready, None));
}

/// The same value again and again is no sign of life, however often and under whatever clock it is sent.
#[test]
fn input_that_is_repeated_grows_old() {
    let mut rig = Rig::following();
    let began = rig.now;
    let frozen = input(rig.number, rig.sequence + 1, began, 1.0);
    assert_eq!(rig.lease.hear(began, &frozen, &TERMS), SticksHeard::Taken);
    let mut silent = None;
    loop {
        // Some layer repeats it and calls it new.
        let again = StickInput { made_ns: rig.now, ..frozen };
        if rig.now > began {
            assert_eq!(rig.lease.hear(rig.now, &again, &TERMS), SticksHeard::Repeated);
        }
        let ended = rig.lease.step(rig.now, STANDING, &TERMS);
        let since_s = (rig.now - began) as f64 * 1e-9;
        if rig.lease.hand() == Hand::Silent {
            silent.get_or_insert(since_s);
        }
        assert!(since_s <= 0.25 || rig.lease.followed().is_none());
        if let Some(age_s) = ended {
            assert!((1.0..1.0 + 0.021).contains(&since_s) && (f64::from(age_s) - since_s).abs() < 1e-3);
            break;
        }
        rig.now += STEP;
        assert!(since_s < 2.0, "never ended");
    }
    assert!(silent.unwrap() <= 0.25, "{silent:?}");
    assert_eq!((rig.lease.hand(), rig.lease.number()), (Hand::Free, 0));
}

#[test]
fn who_is_heard_again_stops_and_passes_neutral_again() {
    let mut rig = Rig::following();
    for _ in 0..15 {
        rig.step(STANDING);
    }
    assert_eq!(rig.lease.hand(), Hand::Silent);
    for _ in 0..30 {
        rig.hear(|new| new.axes.forward = 1.0);
        rig.step(STANDING);
        assert!(matches!(rig.lease.hand(), Hand::Stopping | Hand::AwaitingNeutral), "{:?}", rig.lease.hand());
    }
    rig.until(STANDING, Hand::Following, |_| {});
}

#[test]
fn what_comes_late_or_out_of_order_is_no_newer_than_it_is() {
    let mut rig = Rig::following();
    for _ in 0..30 {
        rig.hear(|_| {});
        rig.step(STANDING);
    }
    let (now, number, sequence) = (rig.now, rig.number, rig.sequence);
    assert_eq!(rig.lease.hear(now, &input(number, sequence + 5, now, 0.5), &TERMS), SticksHeard::Taken);
    for earlier in [sequence + 4, sequence + 5, 0] {
        let late = input(number, earlier, now + 5 * MS, -1.0);
        assert_eq!(rig.lease.hear(now, &late, &TERMS), SticksHeard::Repeated);
    }
    // A queue that is 400 ms long: new inputs all the time, and every one too old to be flown.
    for k in 6..40 {
        rig.now += STEP;
        let late = input(number, sequence + k, rig.now - 400 * MS, 1.0);
        assert_eq!(rig.lease.hear(rig.now, &late, &TERMS), SticksHeard::Taken);
        assert_eq!(rig.lease.step(rig.now, STANDING, &TERMS), None);
        assert_eq!(rig.lease.hand(), Hand::Silent);
    }
    // One of before the grant is nobody's.
    let mut rig = Rig::granted();
    let before = input(rig.number, 1, rig.now - 1, 0.0);
    assert_eq!(rig.lease.hear(rig.now, &before, &TERMS), SticksHeard::Foreign);
}

#[test]
fn a_grant_that_is_never_used_ends_too() {
    let mut rig = Rig::granted();
    let mut steps = 0;
    while rig.step(STANDING).is_none() {
        steps += 1;
        assert_eq!(rig.lease.followed(), None);
        assert!(steps <= 50);
    }
    assert_eq!(steps, 50);
}

#[test]
fn the_arm_switch_counts_only_when_it_is_seen_to_move_under_this_lease() {
    let arm = |rig: &mut Rig, arm| {
        rig.hear(|new| new.arm = arm);
        rig.lease.take_flip()
    };
    let mut rig = Rig::granted();
    assert_eq!(arm(&mut rig, Some(true)), None, "on already when the lease began");
    assert_eq!(arm(&mut rig, None), None);
    assert_eq!(arm(&mut rig, Some(true)), None);
    assert_eq!(arm(&mut rig, Some(false)), Some(Flip::Off));
    assert_eq!(arm(&mut rig, Some(true)), Some(Flip::On));
    assert_eq!(rig.lease.take_flip(), None, "once");
    let mut rig = Rig::granted();
    assert_eq!(arm(&mut rig, Some(false)), None, "off already: it does not land at once");
    assert_eq!(arm(&mut rig, Some(true)), Some(Flip::On));
    // Too late to be obeyed, and the next in time still is a move.
    rig.hear(|new| (new.arm, new.made_ns) = (Some(false), new.made_ns));
    assert_eq!(rig.lease.take_flip(), Some(Flip::Off));
    rig.now += 500 * MS;
    let made_ns = rig.now - 300 * MS;
    rig.hear(|new| (new.arm, new.made_ns) = (Some(true), made_ns));
    assert_eq!(rig.lease.take_flip(), None);
    assert_eq!(arm(&mut rig, Some(true)), Some(Flip::On));
}

#[test]
fn on_the_ground_and_on_the_way_nothing_is_followed() {
    let mut rig = Rig::granted();
    rig.until(Under::Ground, Hand::Ready, |_| {});
    for _ in 0..10 {
        rig.hear(|new| new.axes.up = 1.0);
        rig.step(Under::Ground);
        assert_eq!((rig.lease.hand(), rig.lease.followed()), (Hand::Ready, None));
    }
    for _ in 0..10 {
        rig.hear(|new| new.axes.up = 1.0);
        rig.step(Under::Other);
        assert_eq!((rig.lease.hand(), rig.lease.followed()), (Hand::Stopping, None));
    }
}

#[test]
fn axes_that_are_none_are_refused_and_the_middle_is_still() {
    for bad in [f32::NAN, f32::INFINITY, 1.001, -1.001, 1e30] {
        assert_eq!(Axes::checked(bad, 0.0, 0.0, 0.0), None);
        assert_eq!(Axes::checked(0.0, 0.0, 0.0, bad), None);
    }
    let axes = Axes::checked(1.0, -1.0, 0.08, -0.54).unwrap().beyond(0.08);
    assert_eq!((axes.forward, axes.left, axes.up), (1.0, -1.0, 0.0));
    assert!((axes.turn + 0.5).abs() < 1e-6);
}

/// A model beside it: who may hold, by the times of grants and inputs alone.
#[derive(Default)]
struct Model {
    holder: Option<u32>,
    newest_ns: u64,
    numbers: BTreeSet<u64>,
}

/// Two guards (each with two connections) race for the sticks while one of them at times falls silent, lets go, or sends
/// under old numbers, and who keeps the lease is restarted. 1000 interleavings of 400 events each.
#[test]
fn two_askers_never_both_hold_and_no_number_comes_back() {
    let (mut granted, mut refused, mut expired, mut followed, mut restarts) = (0, 0, 0, 0, 0);
    for seed in 0..1000 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut lease = Lease::<u32>::default();
        let mut model = Model::default();
        // What each guard was told, and his newest input.
        let mut told = [0u64; 4];
        let mut sequence = [0u64; 4];
        let mut passed_neutral = false;
        let mut now = 1_000 * MS + seed;
        for _ in 0..400 {
            now += random.random_range(0..60) * MS;
            let who = random.random_range(0..4u32);
            let his = who as usize;
            let over = now - model.newest_ns >= 1_000 * MS;
            match random.random_range(0..100) {
                0..15 => match lease.ask(now, who, &TERMS) {
                    Ok(number) if model.holder == Some(who) && !over => assert_eq!(number, told[his]),
                    Ok(number) => {
                        assert!(model.holder.is_none() || over, "seed {seed}: two holders");
                        assert!(model.numbers.last().is_none_or(|last| number > *last), "seed {seed}");
                        assert!(model.numbers.insert(number) && number > 0);
                        (model.holder, model.newest_ns, told[his]) = (Some(who), now, number);
                        passed_neutral = false;
                        granted += 1;
                    }
                    Err(holder) => {
                        assert!(model.holder == Some(holder) && holder != who && !over, "seed {seed}");
                        refused += 1;
                    }
                },
                15..75 => {
                    // Old numbers of earlier leases, his own and somebody else's, are sent as well.
                    let number = if random.random_bool(0.9) { told[his] } else { told[(his + 1) % 4] };
                    sequence[his] += u64::from(random.random_bool(0.9));
                    let age = random.random_range(0..40) * MS;
                    let made_ns = now - age;
                    let deflection = if random.random_bool(0.5) { 0.0 } else { 1.0 };
                    let heard = lease.hear(now, &input(number, sequence[his], made_ns, deflection), &TERMS);
                    let holds = model.holder.is_some_and(|holder| told[holder as usize] == number);
                    assert!(heard != SticksHeard::Taken || holds, "seed {seed}");
                    if heard == SticksHeard::Taken {
                        model.newest_ns = made_ns;
                    }
                }
                75..80 => {
                    let let_go = lease.release(&who);
                    assert_eq!(let_go, model.holder == Some(who), "seed {seed}");
                    if let_go {
                        model.holder = None;
                    }
                }
                80..81 => {
                    // All that a restart leaves, or nothing at all; that takes a tenth of a second.
                    let kept = if random.random_bool(0.5) { lease.number() } else { 0 };
                    lease = Lease::after(kept);
                    model.holder = None;
                    now += 100 * MS;
                    restarts += 1;
                }
                81..84 => now += random.random_range(0..1_200) * MS,
                _ => {}
            }
            let neutral_known = lease.hand() == Hand::AwaitingNeutral;
            let ended = lease.step(now, STANDING, &TERMS);
            let over = model.holder.is_some() && now - model.newest_ns >= 1_000 * MS;
            assert_eq!(ended.is_some(), over, "seed {seed}");
            if over {
                model.holder = None;
                expired += 1;
            }
            assert_eq!(lease.holder().copied(), model.holder, "seed {seed}");
            match lease.hand() {
                Hand::Ready if neutral_known => passed_neutral = true,
                Hand::Free | Hand::Stopping | Hand::AwaitingNeutral | Hand::Silent => passed_neutral = false,
                Hand::Ready => assert!(passed_neutral, "seed {seed}"),
                Hand::Following => {
                    assert!(passed_neutral, "seed {seed}: followed without neutral");
                    assert!(now - model.newest_ns <= 250 * MS, "seed {seed}: followed what is old");
                    let flown = lease.followed().unwrap();
                    assert_eq!(Some(flown.lease), model.holder.map(|h| told[h as usize]), "seed {seed}");
                    followed += 1;
                }
            }
        }
    }
    // Everything that is promised was put to the test.
    for (count, least) in
        [(granted, 10_000), (refused, 10_000), (expired, 1_000), (followed, 5_000), (restarts, 2_000)]
    {
        assert!(count > least, "{granted} {refused} {expired} {followed} {restarts}");
    }
}
