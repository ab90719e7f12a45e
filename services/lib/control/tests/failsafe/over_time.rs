//! The table over time: what clears, what is kept, what a human overrules, and what a loss would end in.

use control::{
    Action, Cause, Clears, Condition, Failsafe, Flags, Judgement, Loss, Memory, OperatorLost, Policy, Stage,
    TABLE, TakeOver,
};

const STEP_NS: u64 = 20_000_000;

/// A drone whose conditions are told every 20 ms.
struct Flight {
    failsafe: Failsafe,
    flags: Flags,
    stage: Stage,
    policy: Policy,
    now: u64,
}

impl Flight {
    fn new(stage: Stage) -> Self {
        Self {
            failsafe: Failsafe::default(),
            flags: Flags::default(),
            stage,
            policy: Policy::default(),
            now: 7_000_000_000,
        }
    }

    fn tell(&mut self, condition: Condition, is_so: bool) -> &mut Self {
        self.flags.set(condition, is_so);
        self
    }

    /// In this stage from now on.
    fn enter(&mut self, stage: Stage) -> Judgement {
        self.stage = stage;
        self.run(0.02)
    }

    /// What is said in the end of so many seconds.
    fn run(&mut self, seconds: f32) -> Judgement {
        for _ in 0..(seconds / 0.02).round() as u64 {
            self.now += STEP_NS;
            self.failsafe.step(self.now, &self.flags, self.stage, &self.policy);
        }
        self.failsafe.judged()
    }
}

/// Steps from the first word to the first in which it acts are one more than its time has.
#[test]
fn each_condition_clears_after_its_time_without_it() {
    let clears = [
        (Condition::SideSonarSilent, 0.5),
        (Condition::PoseUncertain, 0.5),
        (Condition::Searching, 0.5),
        (Condition::FewWalls, 0.5),
        (Condition::ChargeUnknown, 0.5),
        (Condition::CellEmpty, 0.5),
        (Condition::HomeUncovered, 3.0),
        (Condition::CellLow, 3.0),
        (Condition::LinkSilent, 0.2),
        (Condition::TiltedOver, 0.05),
        (Condition::NavigationSilent, 0.0),
        (Condition::OperatorSilent, 0.0),
        (Condition::AllSonarsSilent, 0.0),
        (Condition::Adrift, 0.0),
        (Condition::HeightSilent, 0.0),
        (Condition::LandOrdered, 0.0),
    ];
    assert_eq!(clears.len(), Condition::ALL.len());
    for (condition, clear_s) in clears {
        let mut flight = Flight::new(Stage::Autonomous);
        let lasts_s = if condition == Condition::Searching { 121.0 } else { 12.0 };
        let long_enough = flight.tell(condition, true).run(lasts_s);
        assert_ne!(long_enough.causes, 0, "{condition:?}");
        flight.tell(condition, false);
        if clear_s > 0.05 {
            assert_ne!(flight.run(clear_s - 0.03).causes, 0, "{condition:?} is forgotten early");
            assert_eq!(flight.run(0.06).causes, 0, "{condition:?} is not forgotten");
        } else {
            assert_eq!(flight.run(0.08).causes, 0, "{condition:?} is not forgotten");
        }
        // A short return begins anew.
        flight.tell(condition, true).run(0.04);
        let again = flight.failsafe.judged().causes;
        assert_eq!(again != 0, matches!(condition, Condition::SideSonarSilent | Condition::LandOrdered));
    }
}

#[test]
fn what_comes_and_goes_with_single_messages_goes_on() {
    let mut flight = Flight::new(Stage::Airborne);
    for _ in 0..30 {
        flight.tell(Condition::PoseUncertain, true).run(0.3);
        flight.tell(Condition::PoseUncertain, false).run(0.4);
    }
    assert_eq!(flight.failsafe.judged().action, Action::Descend);
}

#[test]
fn a_hover_ends_with_its_cause_and_a_landing_does_not() {
    let mut flight = Flight::new(Stage::Autonomous);
    assert_eq!(flight.run(1.0), Judgement::NOTHING);
    let silent_ns = flight.now + STEP_NS;
    let hover = flight.tell(Condition::PoseUncertain, true).run(3.0);
    assert_eq!((hover.action, hover.cause), (Action::Hover, Cause::PoseUncertain));
    assert_eq!(flight.failsafe.since_ns(), silent_ns + 1_000_000_000);
    assert_eq!(flight.tell(Condition::PoseUncertain, false).run(1.0), Judgement::NOTHING);
    assert_eq!(flight.failsafe.since_ns(), 0);

    let descent = flight.tell(Condition::PoseUncertain, true).run(21.0);
    assert_eq!((descent.action, descent.cause), (Action::Descend, Cause::Lost));
    let since_ns = flight.failsafe.since_ns();
    flight.run(1.0);
    assert_eq!(flight.failsafe.since_ns(), since_ns);
    // Found again: the place is held, but it is still a landing.
    let landing = flight.tell(Condition::PoseUncertain, false).run(60.0);
    assert_eq!((landing.action, landing.cause, landing.causes), (Action::Land, Cause::Lost, 0));
    assert_eq!(landing.no_arming, Cause::Lost);
    assert!(flight.failsafe.since_ns() > since_ns);
    assert_eq!(flight.enter(Stage::Armed).action, Action::Land);
    assert_eq!(flight.enter(Stage::Grounded), Judgement::NOTHING);
    assert_eq!(flight.enter(Stage::Airborne), Judgement::NOTHING, "another flight");
}

#[test]
fn a_battery_that_said_return_says_so_until_it_lands_and_a_silent_one_until_it_speaks() {
    for condition in [Condition::CellLow, Condition::HomeUncovered] {
        let mut flight = Flight::new(Stage::Autonomous);
        flight.tell(condition, true).run(11.0);
        let later = flight.tell(condition, false).run(30.0);
        assert_eq!((later.action, later.cause), (Action::Return, Cause::BatteryReturn), "{condition:?}");
        // Something worse comes and goes meanwhile.
        assert_eq!(flight.tell(Condition::CellEmpty, true).run(2.1).action, Action::Land);
        assert_eq!(flight.tell(Condition::CellEmpty, false).run(9.0).cause, Cause::BatteryLand);
        assert_eq!(flight.enter(Stage::Grounded).action, Action::None);
    }
    let mut flight = Flight::new(Stage::Autonomous);
    assert_eq!(flight.tell(Condition::ChargeUnknown, true).run(11.0).action, Action::Return);
    assert_eq!(flight.tell(Condition::ChargeUnknown, false).run(0.6), Judgement::NOTHING);
}

#[test]
fn a_cut_is_final_until_the_motors_are_off_on_the_ground() {
    let mut flight = Flight::new(Stage::Airborne);
    assert_eq!(flight.tell(Condition::TiltedOver, true).run(0.5).action, Action::Cut);
    flight.tell(Condition::TiltedOver, false);
    for stage in [Stage::Armed, Stage::Airborne, Stage::Manual, Stage::Autonomous, Stage::Armed] {
        flight.enter(stage);
        let judged = flight.run(5.0);
        assert_eq!((judged.action, judged.cause), (Action::Cut, Cause::Tilt), "{stage:?}");
        assert_eq!((judged.take_over, judged.no_arming), (TakeOver::No, Cause::Tilt), "{stage:?}");
        assert!(judged.lease_over);
    }
    assert_eq!(flight.enter(Stage::Grounded), Judgement::NOTHING);
}

#[test]
fn an_order_to_land_is_taken_back_by_who_gave_it() {
    let mut flight = Flight::new(Stage::Airborne);
    flight.flags.set_lasted(Condition::LandOrdered, f32::INFINITY);
    let ordered = flight.run(0.02);
    assert_eq!((ordered.action, ordered.cause), (Action::Land, Cause::Operator), "at once");
    assert_eq!(ordered.no_arming, Cause::None);
    flight.flags.set_lasted(Condition::LandOrdered, 0.0);
    assert_eq!(flight.run(0.02), Judgement::NOTHING);
}

#[test]
fn a_human_overrules_what_acted_when_he_took_the_sticks_until_it_comes_anew() {
    let mut flight = Flight::new(Stage::Autonomous);
    let hover = flight.tell(Condition::PoseUncertain, true).run(2.0);
    assert_eq!((hover.action, hover.take_over), (Action::Hover, TakeOver::AfterStop));
    let flown = flight.enter(Stage::Manual);
    assert_eq!((flown.action, flown.causes), (Action::None, Cause::PoseUncertain.bit()));
    assert_eq!((flown.take_over, flown.lease_over), (TakeOver::Yes, false));
    assert_eq!(flight.run(10.0).action, Action::None);
    // 20 s of it are another row, which begins while he flies.
    let descent = flight.run(9.0);
    assert_eq!((descent.action, descent.cause, descent.lease_over), (Action::Descend, Cause::Lost, true));
    // He has lost the sticks; he may ask for them again, and then it has acted before.
    assert_eq!(flight.enter(Stage::Airborne).action, Action::Descend);
    assert_eq!(flight.enter(Stage::Manual).action, Action::None);
    // Gone and come anew, it acts on him.
    flight.tell(Condition::PoseUncertain, false).run(1.0);
    let anew = flight.tell(Condition::PoseUncertain, true).run(1.5);
    assert_eq!((anew.action, anew.lease_over), (Action::Hover, true));
    // Let go of, what he overruled acts again if it still holds.
    let mut flight = Flight::new(Stage::Airborne);
    flight.tell(Condition::CellLow, true).run(11.0);
    assert_eq!(flight.enter(Stage::Manual).action, Action::None);
    assert_eq!(flight.run(5.0).action, Action::None);
    assert_eq!(flight.enter(Stage::Airborne).action, Action::Return);
}

#[test]
fn a_human_ends_a_landing_only_where_the_table_lets_him() {
    let cases = [
        (Condition::NavigationSilent, 61.0, true),
        (Condition::PoseUncertain, 21.0, true),
        (Condition::CellLow, 11.0, true),
        (Condition::HomeUncovered, 4.0, true),
        (Condition::AllSonarsSilent, 6.0, false),
        (Condition::FewWalls, 6.0, false),
        (Condition::Adrift, 2.0, false),
        (Condition::CellEmpty, 3.0, false),
        (Condition::HeightSilent, 2.0, false),
        (Condition::LinkSilent, 6.0, false),
        (Condition::TiltedOver, 1.0, false),
    ];
    for (condition, seconds, free) in cases {
        let mut flight = Flight::new(Stage::Autonomous);
        let before = flight.tell(condition, true).run(seconds);
        assert!(before.action >= Action::Return, "{condition:?}");
        assert_eq!(before.take_over == TakeOver::No, !free, "{condition:?}");
        // It goes, and what it began goes on.
        let kept = flight.tell(condition, false).run(4.0);
        assert_eq!(kept.action, before.action.kept(), "{condition:?}");
        assert_eq!(kept.take_over == TakeOver::No, !free, "{condition:?}");
        flight.enter(Stage::Manual);
        let by_hand = flight.run(1.0);
        assert_eq!(by_hand.action == Action::None, free, "{condition:?}");
        let let_go = flight.enter(Stage::Airborne);
        assert_eq!(let_go.action == Action::None, free, "{condition:?}: nothing resumes by itself");
    }
    // Who takes the sticks although something locks him out ends nothing, until he has let go of them.
    let mut flight = Flight::new(Stage::Airborne);
    flight.tell(Condition::PoseUncertain, true).run(21.0);
    flight.tell(Condition::PoseUncertain, false).run(1.0);
    let shut = flight.tell(Condition::AllSonarsSilent, true).run(1.0);
    assert_eq!((shut.action, shut.take_over), (Action::Land, TakeOver::No));
    assert_eq!(flight.enter(Stage::Manual).action, Action::Land);
    let held = flight.tell(Condition::AllSonarsSilent, false).run(1.0);
    assert_eq!((held.action, held.take_over), (Action::Land, TakeOver::AfterStop));
    flight.enter(Stage::Airborne);
    assert_eq!(flight.enter(Stage::Manual).action, Action::None);
    // What begins while he flies is kept like any other.
    let mut flight = Flight::new(Stage::Manual);
    flight.run(1.0);
    flight.tell(Condition::PoseUncertain, true).run(21.0);
    assert_eq!(flight.tell(Condition::PoseUncertain, false).run(2.0).action, Action::Land);
}

#[test]
fn what_a_loss_would_end_in_is_asked_of_the_flight_as_it_is() {
    let ends = |flight: &Flight| {
        Loss::ALL.iter().map(|loss| flight.failsafe.if_lost(*loss, &flight.policy)).collect::<Vec<_>>()
    };
    use Action::{Cut, Descend, Hover, Land, None, Return};
    let mut flight = Flight::new(Stage::Grounded);
    flight.run(1.0);
    assert_eq!(ends(&flight), [None; 7], "on the ground");
    flight.enter(Stage::Airborne);
    assert_eq!(ends(&flight), [Descend, None, Descend, Land, None, Land, Return]);
    flight.enter(Stage::Autonomous);
    assert_eq!(ends(&flight), [Descend, None, Descend, Land, Land, Land, Return]);
    flight.enter(Stage::Manual);
    assert_eq!(ends(&flight), [Descend, Hover, Descend, Land, None, Land, Return]);
    flight.policy.operator_lost = OperatorLost::Return;
    assert_eq!(ends(&flight)[1], Return);
    // Asking changes nothing, and what is wrong already counts.
    assert_eq!(flight.run(0.02), Judgement::NOTHING);
    flight.enter(Stage::Autonomous);
    flight.tell(Condition::PoseUncertain, true).run(6.0);
    assert_eq!(ends(&flight), [Descend, Hover, Descend, Descend, Land, Descend, Return]);
    flight.tell(Condition::TiltedOver, true).run(1.0);
    assert_eq!(ends(&flight), [Cut; 7]);
}

#[test]
fn a_restart_forgets_no_landing_and_no_cut() {
    for row in TABLE {
        let mut flight = Flight::new(Stage::Airborne);
        flight.failsafe = Failsafe::resumed(row.cause, row.action, 3);
        assert_eq!(Memory::of(row.cause, row.action).is_empty(), flight.failsafe.since_ns() == 0);
        let judged = flight.run(0.1);
        // A return of the battery is kept for whichever reason it began.
        let kept = row.clears == Clears::Landed || row.cause == Cause::BatteryReturn;
        let expected = if kept { (row.action.kept(), row.cause) } else { (Action::None, Cause::None) };
        assert_eq!((judged.action, judged.cause), expected, "{row:?}");
        assert!(!kept || judged.take_over >= row.take_over);
        assert_eq!(flight.enter(Stage::Grounded), Judgement::NOTHING);
    }
    // Landing already when it was restarted: it began when it began.
    let mut flight = Flight::new(Stage::Airborne);
    flight.failsafe = Failsafe::resumed(Cause::Lost, Action::Land, 3);
    let judged = flight.failsafe.judged();
    assert_eq!((judged.action, judged.cause), (Action::Land, Cause::Lost));
    assert_eq!(flight.run(1.0).action, Action::Land);
    assert_eq!(flight.failsafe.since_ns(), 3);
    assert!(Memory::of(Cause::Lost, Action::Return).is_empty());
    assert!(Memory::of(Cause::None, Action::None).is_empty());
    assert!(!Memory::of(Cause::Tilt, Action::Cut).is_empty());
}
