//! The failsafe table: its numbers, every set of flags, and that nothing gets milder by getting worse.
#![allow(clippy::unwrap_used, reason = "tests")]

use control::{Action, Cause, Evidence, Policy, judge, table};
use proptest::prelude::*;

fn flying() -> Evidence {
    Evidence { airborne: true, autonomous: true, ..Default::default() }
}

#[test]
fn the_numbers_of_the_design() {
    let p = Policy::default();
    let at = |change: fn(&mut Evidence, f32), seconds: f32| {
        let mut e = flying();
        change(&mut e, seconds);
        let j = judge(&e, &p);
        (j.cause, j.action)
    };
    assert_eq!(at(|_, _| {}, 0.0), (Cause::None, Action::None));
    let height = |e: &mut Evidence, s| e.height_silent_s = s;
    assert_eq!(at(height, 0.29), (Cause::None, Action::None));
    assert_eq!(at(height, 0.31), (Cause::HeightUnknown, Action::Hover));
    assert_eq!(at(height, 1.01), (Cause::HeightUnknown, Action::Descend));
    let pose = |e: &mut Evidence, s| e.pose_uncertain_s = s;
    assert_eq!(at(pose, 0.99), (Cause::None, Action::None));
    assert_eq!(at(pose, 1.01), (Cause::PoseUncertain, Action::Hover));
    assert_eq!(at(pose, 20.1), (Cause::Lost, Action::Descend));
    assert_eq!(at(|e, s| e.adrift_s = s, 1.4), (Cause::None, Action::None));
    assert_eq!(at(|e, s| e.adrift_s = s, 1.6), (Cause::Lost, Action::Descend));
    let sonars = |e: &mut Evidence, s| e.all_sonars_silent_s = s;
    assert_eq!(at(sonars, 0.51), (Cause::AllSonarsSilent, Action::Hover));
    assert_eq!(at(sonars, 5.1), (Cause::AllSonarsSilent, Action::Land));
    let unknown = |e: &mut Evidence, s| e.charge_unknown_s = s;
    assert_eq!(at(unknown, 9.9), (Cause::None, Action::None));
    assert_eq!(at(unknown, 10.1), (Cause::BatteryReturn, Action::Return));
    assert_eq!(at(|e, s| e.home_uncovered_s = s, 2.9), (Cause::None, Action::None));
    assert_eq!(at(|e, s| e.home_uncovered_s = s, 3.1), (Cause::BatteryReturn, Action::Return));
    assert_eq!(at(|e, s| e.cell_low_s = s, 9.9), (Cause::None, Action::None));
    assert_eq!(at(|e, s| e.cell_low_s = s, 10.1), (Cause::BatteryReturn, Action::Return));
    assert_eq!(at(|e, s| e.cell_empty_s = s, 2.1), (Cause::BatteryLand, Action::Land));
    assert_eq!(at(|e, s| e.tilt_s = s, 0.31), (Cause::Tilt, Action::Cut));
    assert_eq!(at(|e, s| e.side_sonar_silent_s = s, 9.0), (Cause::SideSonarSilent, Action::None));
    assert_eq!(at(|e, _| e.operator = Some(Action::Land), 0.0), (Cause::Operator, Action::Land));
}

#[test]
fn the_most_severe_of_any_set_of_causes_wins() {
    // Every subset of fourteen flags, each far beyond its times.
    let p = Policy::default();
    type Failure = (fn(&mut Evidence), Action);
    let set: [Failure; 14] = [
        (|e| e.navigation_silent_s = 1.0, Action::Hover),
        (|e| e.side_sonar_silent_s = 9.0, Action::None),
        (|e| e.pose_uncertain_s = 2.0, Action::Hover),
        (|e| e.all_sonars_silent_s = 6.0, Action::Land),
        (|e| e.home_uncovered_s = 4.0, Action::Return),
        (|e| e.charge_unknown_s = 11.0, Action::Return),
        (|e| e.cell_low_s = 11.0, Action::Return),
        (|e| e.cell_empty_s = 3.0, Action::Land),
        (|e| e.few_walls_s = 6.0, Action::Descend),
        (|e| e.adrift_s = 4.0, Action::Descend),
        (|e| e.height_silent_s = 2.0, Action::Descend),
        (|e| e.link_silent_s = 2.0, Action::Hover),
        (|e| e.tilt_s = 1.0, Action::Cut),
        (|e| e.operator = Some(Action::Hover), Action::Hover),
    ];
    for flags in 0u32..1 << set.len() {
        let mut e = flying();
        let mut expected = Action::None;
        for (bit, (change, action)) in set.iter().enumerate() {
            if flags & (1 << bit) != 0 {
                change(&mut e);
                expected = expected.max(*action);
            }
        }
        let judged = judge(&e, &p);
        assert_eq!(judged.action, expected, "{flags:b}");
        assert_eq!(flags != 0, judged.causes != 0);
        assert!(judged.cause == Cause::None || judged.causes & judged.cause.bit() != 0);
        e.airborne = false;
        assert_eq!(judge(&e, &p).action, Action::None);
    }
}

#[test]
fn navigation_matters_only_to_those_who_follow_it() {
    let e = Evidence { airborne: true, autonomous: false, navigation_silent_s: 99.0, ..Default::default() };
    assert_eq!(judge(&e, &Policy::default()).action, Action::None);
}

fn evidence() -> impl Strategy<Value = Evidence> {
    (proptest::collection::vec(prop_oneof![Just(0.0f32), 0.0f32..90.0], 14), any::<bool>(), 0usize..7)
        .prop_map(|(s, autonomous, operator)| Evidence {
            airborne: true,
            autonomous,
            navigation_silent_s: s[0],
            side_sonar_silent_s: s[1],
            all_sonars_silent_s: s[2],
            pose_uncertain_s: s[3],
            few_walls_s: s[4],
            home_uncovered_s: s[5],
            cell_low_s: s[6],
            cell_empty_s: s[7],
            height_silent_s: s[8],
            link_silent_s: s[9],
            tilt_s: s[10],
            adrift_s: s[11],
            charge_unknown_s: s[12],
            searching_s: s[13],
            operator: Action::ALL.get(operator).copied(),
        })
}

proptest! {
    #[test]
    fn what_lasts_longer_is_never_judged_milder(e in evidence(), which in 0usize..13, more in 0.0f32..60.0) {
        let p = Policy::default();
        let before = judge(&e, &p);
        let mut worse = e;
        let field = match which {
            0 => &mut worse.navigation_silent_s,
            1 => &mut worse.side_sonar_silent_s,
            2 => &mut worse.all_sonars_silent_s,
            3 => &mut worse.pose_uncertain_s,
            4 => &mut worse.few_walls_s,
            5 => &mut worse.home_uncovered_s,
            6 => &mut worse.cell_low_s,
            7 => &mut worse.cell_empty_s,
            8 => &mut worse.height_silent_s,
            9 => &mut worse.link_silent_s,
            10 => &mut worse.adrift_s,
            11 => &mut worse.charge_unknown_s,
            _ => &mut worse.tilt_s,
        };
        *field += more;
        let after = judge(&worse, &p);
        prop_assert!(after.action >= before.action);
        prop_assert_eq!(after.causes & before.causes, before.causes);
    }
}

#[test]
fn unsafe_numbers_are_refused() {
    assert!(Policy::default().validate().is_ok());
    let error = Policy { height_descend_s: 0.1, ..Default::default() }.validate().unwrap_err();
    assert!(error.to_string().contains("failsafe.height_descend_s"), "{error}");
    assert!(Policy { land_volts: 3.9, ..Default::default() }.validate().is_err());
}

#[test]
fn every_row_acts_exactly_when_its_time_has_come() {
    let p = Policy::default();
    for row in table(&Evidence::default(), &p) {
        assert!(row.after_s.is_finite() && !row.what.is_empty(), "{row:?}");
        assert_ne!(row.cause, Cause::None);
    }
    let e = Evidence { airborne: true, cell_low_s: f32::NAN, ..Default::default() };
    assert_eq!(judge(&e, &p).action, Action::Return, "what cannot be measured is not taken for good");
}
