//! The numbers: each row acts from its time on and no sooner, and each number has bounds.

use control::{
    Action, Cause, Condition, Evidence, Memory, OperatorLost, Policy, RangeError, Stage, TABLE, TakeOver,
    judge,
};

fn judged(conditions: &[Condition], lasted_s: f32, policy: &Policy) -> (Action, Cause) {
    let mut evidence = Evidence::new(Stage::Autonomous);
    for &condition in conditions {
        evidence.set(condition, lasted_s);
    }
    let (judged, _) = judge(&evidence, &Memory::default(), policy);
    (judged.action, judged.cause)
}

#[test]
fn each_row_acts_from_its_time_on() {
    use Condition as If;
    let nothing = (Action::None, Cause::None);
    let navigation = (Action::Hover, Cause::NavigationSilent);
    let operator = (Action::Hover, Cause::OperatorSilent);
    let pose = (Action::Hover, Cause::PoseUncertain);
    let sonars = (Action::Hover, Cause::AllSonarsSilent);
    let height = (Action::Hover, Cause::HeightUnknown);
    let link = (Action::Hover, Cause::LinkDown);
    let home = (Action::Return, Cause::BatteryReturn);
    let lost = (Action::Descend, Cause::Lost);
    type Case<'a> = (&'a [If], f32, (Action, Cause), (Action, Cause));
    let cases: [Case<'_>; 20] = [
        (&[If::NavigationSilent], 0.1, nothing, navigation),
        (&[If::NavigationSilent], 60.0, navigation, (Action::Land, Cause::NavigationSilent)),
        (&[If::OperatorSilent], 0.25, nothing, operator),
        (&[If::PoseUncertain], 1.0, nothing, pose),
        (&[If::PoseUncertain], 20.0, pose, lost),
        (&[If::Searching], 120.0, nothing, lost),
        (&[If::FewWalls], 5.0, nothing, lost),
        (&[If::Adrift], 1.5, nothing, lost),
        (&[If::AllSonarsSilent], 0.5, nothing, sonars),
        (&[If::AllSonarsSilent], 5.0, sonars, (Action::Land, Cause::AllSonarsSilent)),
        (&[If::HomeUncovered], 3.0, nothing, home),
        (&[If::ChargeUnknown], 10.0, nothing, home),
        (&[If::CellLow], 10.0, nothing, home),
        (&[If::CellEmpty], 2.0, nothing, (Action::Land, Cause::BatteryLand)),
        (&[If::HeightSilent], 0.3, nothing, height),
        (&[If::HeightSilent], 1.0, height, (Action::Descend, Cause::HeightUnknown)),
        (&[If::LinkSilent], 1.0, nothing, link),
        (&[If::LinkSilent], 5.0, link, (Action::Land, Cause::LinkDown)),
        (&[If::TiltedOver], 0.3, nothing, (Action::Cut, Cause::Tilt)),
        (&[If::PoseUncertain, If::AllSonarsSilent], 5.0, sonars, lost),
    ];
    let policy = Policy::default();
    for (conditions, after_s, before, from_then_on) in cases {
        assert_eq!(judged(conditions, after_s.next_down(), &policy), before, "{conditions:?} {after_s}");
        assert_eq!(judged(conditions, after_s, &policy), from_then_on, "{conditions:?} {after_s}");
        assert_eq!(judged(conditions, after_s.next_up(), &policy), from_then_on, "{conditions:?} {after_s}");
    }
    let both = [If::LinkSilent, If::PoseUncertain];
    assert_eq!(judged(&both, 5f32.next_down(), &policy), link);
    assert_eq!(judged(&both, 5.0, &policy), (Action::Descend, Cause::LinkDown));
    // Together means both for so long.
    let evidence = Evidence::new(Stage::Airborne).with(If::PoseUncertain, 9.0);
    let long = |sonars_s| judge(&evidence.with(If::AllSonarsSilent, sonars_s), &Memory::default(), &policy).0;
    assert_eq!(long(4.9).action, Action::Hover);
    assert_eq!(long(5.0).action, Action::Descend);
    // What needs no time acts as soon as there is any.
    assert_eq!(judged(&[If::SideSonarSilent], 0.0, &policy), nothing);
    assert_eq!(judged(&[If::SideSonarSilent], 1e-6, &policy), (Action::None, Cause::SideSonarSilent));
    assert_eq!(judged(&[If::LandOrdered], 1e-6, &policy), (Action::Land, Cause::Operator));
}

#[test]
fn who_is_silent_with_the_sticks_loses_them_and_the_policy_says_what_then() {
    let answers = [
        (OperatorLost::Hold, Action::Hover),
        (OperatorLost::Return, Action::Return),
        (OperatorLost::Land, Action::Land),
    ];
    for (operator_lost, action) in answers {
        let policy = Policy { operator_lost, ..Policy::default() };
        let at = |lasted_s| {
            let evidence = Evidence::new(Stage::Manual).with(Condition::OperatorSilent, lasted_s);
            let (_, holding) = judge(&Evidence::new(Stage::Manual), &Memory::default(), &policy);
            judge(&evidence, &holding, &policy).0
        };
        assert_eq!((at(0.24).action, at(0.24).lease_over), (Action::None, false));
        assert_eq!((at(0.25).action, at(0.25).lease_over), (Action::Hover, false));
        assert_eq!((at(1f32.next_down()).action, at(1f32.next_down()).lease_over), (Action::Hover, false));
        assert_eq!((at(1.0).action, at(1.0).lease_over), (action, true), "{operator_lost:?}");
        assert_ne!(at(1.0).take_over, TakeOver::No, "whoever is heard again may ask for them");
        // A loss for good is none of the others.
        assert_eq!(at(f32::INFINITY).action, action, "{operator_lost:?}");
    }
}

#[test]
fn what_cannot_be_measured_has_been_so_for_ever() {
    for policy in [OperatorLost::Hold, OperatorLost::Land]
        .map(|operator_lost| Policy { operator_lost, ..Policy::default() })
    {
        for &condition in Condition::ALL {
            let nan = judged(&[condition], f32::NAN, &policy);
            assert_eq!(nan, judged(&[condition], f32::INFINITY, &policy), "{condition:?}");
            assert_ne!(nan, (Action::None, Cause::None), "{condition:?}");
        }
    }
}

#[test]
fn navigation_matters_only_to_those_who_follow_it() {
    for &stage in Stage::ALL {
        let evidence = Evidence::new(stage).with(Condition::NavigationSilent, 99.0);
        let (judged, _) = judge(&evidence, &Memory::default(), &Policy::default());
        assert_eq!(judged.action == Action::Land, stage == Stage::Autonomous, "{stage:?}");
        assert_eq!(judged.causes != 0, stage == Stage::Autonomous, "{stage:?}");
    }
}

/// A row whose action comes later is more severe: nothing gets milder by lasting.
#[test]
fn what_lasts_longer_is_never_judged_milder() {
    let policy = Policy::default();
    let times = [0.0, 0.05, 0.1, 0.25, 0.3, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 60.0, 1e6, f32::NAN];
    for &one in Condition::ALL {
        for &other in Condition::ALL {
            for other_s in times {
                let base = Evidence::new(Stage::Autonomous).with(other, other_s);
                let mut before = judge(&base, &Memory::default(), &policy).0;
                for one_s in times {
                    if one == other {
                        continue;
                    }
                    let (now, _) = judge(&base.with(one, one_s), &Memory::default(), &policy);
                    assert!(now.action >= before.action, "{one:?} {one_s} with {other:?} {other_s}");
                    assert_eq!(now.causes & before.causes, before.causes, "{one:?} {one_s}");
                    before = now;
                }
            }
        }
    }
}

#[test]
fn every_row_names_a_cause_and_what_it_is_made_of() {
    for row in TABLE {
        assert_ne!(row.cause, Cause::None);
        assert!(!row.conditions.is_empty(), "{row:?}");
    }
    // Every condition is in some row, and every answer to a lost operator has one.
    for condition in Condition::ALL {
        assert!(TABLE.iter().any(|row| row.conditions.contains(condition)), "{condition:?}");
    }
    assert_eq!(TABLE.iter().filter_map(|row| row.only).count(), 3);
}

type Bounds = (fn(&mut Policy, f32), &'static str, f32, f32);

macro_rules! bounds {
    ($($key:ident in $low:literal ..= $high:literal,)*) => {
        [$((|policy: &mut Policy, value| policy.$key = value, stringify!($key), $low, $high),)*]
    };
}

#[test]
fn every_number_has_bounds_and_who_leaves_them_is_told() {
    let all: [Bounds; 32] = bounds! {
        navigation_hover_s in 0.0..=2.0,
        navigation_land_s in 5.0..=600.0,
        operator_hover_s in 0.1..=1.0,
        operator_lease_s in 0.25..=5.0,
        p_lost in 0.001..=0.5,
        sigma_m in 0.1..=2.0,
        pose_stale_s in 0.1..=2.0,
        pose_hover_s in 0.1..=5.0,
        pose_land_s in 2.0..=120.0,
        walls_land_s in 1.0..=60.0,
        drift_land_s in 0.5..=60.0,
        sonars_hover_s in 0.1..=2.0,
        sonars_land_s in 1.0..=30.0,
        home_return_s in 0.5..=30.0,
        power_stale_s in 1.0..=10.0,
        power_return_s in 1.0..=60.0,
        return_volts in 3.3..=4.0,
        return_s in 1.0..=60.0,
        land_volts in 3.0..=3.5,
        land_s in 0.5..=20.0,
        home_reserve in 0.1..=2.0,
        height_hold_s in 0.1..=1.0,
        height_descend_s in 0.3..=5.0,
        link_stale_s in 0.3..=3.0,
        link_hover_s in 0.3..=5.0,
        link_land_s in 1.0..=60.0,
        tilt_deg in 40.0..=80.0,
        tilt_s in 0.1..=1.0,
        clear_s in 0.1..=3.0,
        battery_clear_s in 0.5..=30.0,
        link_clear_s in 0.0..=3.0,
        tilt_clear_s in 0.0..=0.5,
    };
    let with = |set: fn(&mut Policy, f32), value: f32| -> Result<(), RangeError> {
        let mut policy = Policy::default();
        set(&mut policy, value);
        policy.validate()
    };
    assert_eq!(Policy::default().validate(), Ok(()));
    for (set, key, low, high) in all {
        assert_eq!(with(set, low), Ok(()), "{key} = {low}");
        assert_eq!(with(set, high), Ok(()), "{key} = {high}");
        for value in [low.next_down(), high.next_up(), f32::NAN] {
            let error = with(set, value).unwrap_err();
            // A lower bound may be the other number of a pair.
            assert!(error.to_string().contains("failsafe."), "{error}");
            if value.is_nan() {
                assert_eq!(error.field, format!("failsafe.{key}"), "{error}");
            }
        }
    }
}

#[test]
fn the_later_of_two_times_is_never_the_earlier_one() {
    let refused = |policy: Policy| policy.validate().unwrap_err().field;
    let usual = Policy::default();
    assert_eq!(
        refused(Policy { operator_hover_s: 0.9, operator_lease_s: 0.8, ..usual }),
        "failsafe.operator_lease_s"
    );
    assert_eq!(refused(Policy { pose_hover_s: 4.0, pose_land_s: 3.0, ..usual }), "failsafe.pose_land_s");
    assert_eq!(
        refused(Policy { sonars_hover_s: 1.8, sonars_land_s: 1.5, ..usual }),
        "failsafe.sonars_land_s"
    );
    assert_eq!(
        refused(Policy { height_hold_s: 0.8, height_descend_s: 0.7, ..usual }),
        "failsafe.height_descend_s"
    );
    assert_eq!(refused(Policy { link_hover_s: 4.0, link_land_s: 3.0, ..usual }), "failsafe.link_land_s");
    assert_eq!(refused(Policy { return_volts: 3.3, land_volts: 3.4, ..usual }), "failsafe.land_volts");
}
