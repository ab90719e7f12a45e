//! Every set of flags, in every stage, at times between and beyond all of the table's.

use crate::design::{Wrong, grounds_after_s};
use control::{
    Action, Cause, Condition, Evidence, Failsafe, Flags, Judgement, Memory, OperatorLost, Policy, Stage,
    judge,
};

const LOST: [OperatorLost; 3] = [OperatorLost::Hold, OperatorLost::Return, OperatorLost::Land];
const SETS: u32 = 1 << Condition::ALL.len();

fn policy(operator_lost: OperatorLost) -> Policy {
    Policy { operator_lost, ..Policy::default() }
}

fn compare(judged: &Judgement, wrong: Wrong, stage: Stage, lost: OperatorLost) {
    let (action, cause, locked_out) = wrong.answer(stage, lost);
    assert_eq!((judged.action, judged.cause), (action, cause), "{wrong:?} {stage:?} {lost:?}");
    assert_eq!(judged.take_over == control::TakeOver::No, locked_out, "{wrong:?} {stage:?}");
    let grounds = |condition: &Condition| {
        wrong.flags & (1 << *condition as u32) != 0
            && grounds_after_s(*condition).is_some_and(|after| wrong.lasted_s >= after)
    };
    let grounded = Condition::ALL.iter().any(grounds);
    assert_eq!(judged.no_arming != Cause::None, grounded, "{wrong:?} {stage:?}");
}

/// All 2^16 sets of conditions x 5 stages x 3 answers to a lost operator x 13 times.
#[test]
fn the_answer_to_every_set_of_conditions_is_that_of_the_design() {
    // Each lies between two neighbouring times of the table.
    let times = [0.05, 0.2, 0.28, 0.4, 0.7, 1.2, 1.7, 2.5, 4.0, 7.0, 15.0, 30.0, 130.0];
    for flags in 0..SETS {
        for lasted_s in times {
            let wrong = Wrong { flags, lasted_s };
            for &stage in Stage::ALL {
                let mut evidence = Evidence::new(stage);
                for &condition in Condition::ALL {
                    if flags & (1 << condition as u32) != 0 {
                        evidence.set(condition, lasted_s);
                    }
                }
                for lost in LOST {
                    // He who holds the sticks held them before it began.
                    let (_, memory) = judge(&Evidence::new(stage), &Memory::default(), &policy(lost));
                    let (judged, _) = judge(&evidence, &memory, &policy(lost));
                    compare(&judged, wrong, stage, lost);
                }
            }
        }
    }
}

/// The same through the machine that times them: told at 0 s and again after 1000 s.
#[test]
fn so_is_the_answer_to_every_set_of_flags_that_has_settled() {
    const SETTLED_S: u64 = 1000;
    for flags in 0..SETS {
        let mut told = Flags::default();
        let mut nothing_yet = Flags::default();
        for &condition in Condition::ALL {
            let is_so = flags & (1 << condition as u32) != 0;
            if matches!(condition, Condition::Adrift | Condition::HeightSilent) {
                told.set_lasted(condition, if is_so { SETTLED_S as f32 } else { 0.0 });
            } else {
                told.set(condition, is_so);
                nothing_yet.set(condition, is_so);
            }
        }
        for &stage in Stage::ALL {
            for lost in LOST {
                let policy = policy(lost);
                let mut failsafe = Failsafe::default();
                let first = failsafe.step(0, &nothing_yet, stage, &policy);
                assert_eq!(first.action, Action::None, "nothing has lasted yet");
                let judged = failsafe.step(SETTLED_S * 1_000_000_000, &told, stage, &policy);
                compare(&judged, Wrong { flags, lasted_s: SETTLED_S as f32 }, stage, lost);
                assert_eq!(failsafe.judged(), judged);
            }
        }
    }
}

#[test]
fn the_causes_that_hold_are_all_told_in_the_air_and_none_on_the_ground() {
    let policy = Policy::default();
    let evidence = |stage| {
        Evidence::new(stage)
            .with(Condition::SideSonarSilent, 0.1)
            .with(Condition::PoseUncertain, 2.0)
            .with(Condition::CellLow, 11.0)
            .with(Condition::TiltedOver, 0.1)
    };
    let causes = |stage| judge(&evidence(stage), &Memory::default(), &policy).0.causes;
    let expected = Cause::SideSonarSilent.bit() | Cause::PoseUncertain.bit() | Cause::BatteryReturn.bit();
    for stage in [Stage::Airborne, Stage::Autonomous, Stage::Manual] {
        assert_eq!(causes(stage), expected, "{stage:?}: overruled or not");
    }
    assert_eq!((causes(Stage::Grounded), causes(Stage::Armed)), (0, 0));
}
