//! The table of states, by the clock.

use super::*;

const SECOND: Duration = Duration::from_secs(1);
const ORDER: u32 = 9;

struct Clocked {
    watch: Watch,
    now: Instant,
    airborne: bool,
    living: BTreeSet<String>,
}

impl Clocked {
    fn new() -> Self {
        let names = ["flight", "pilot", "sonar"].map(str::to_owned);
        let limits = Limits { land: 10 * SECOND, stop: 2 * SECOND };
        Self {
            watch: Watch::new(limits, names.clone().into_iter()),
            now: Instant::now(),
            airborne: false,
            living: names.into(),
        }
    }

    /// Everything that is due within `span`, in steps of 10 ms.
    fn pass(&mut self, span: Duration) -> Vec<Task> {
        let end = self.now + span;
        let mut tasks = Vec::new();
        while self.now < end {
            while let Some(task) = self.watch.due(self.airborne, ORDER, &self.living, self.now) {
                tasks.push(task);
            }
            self.now += Duration::from_millis(10);
        }
        tasks
    }

    fn gone(&mut self, service: &str) {
        assert!(self.living.remove(service));
    }
}

fn terminate(service: &str) -> Task {
    Task::Terminate(service.to_owned())
}

fn kill(service: &str) -> Task {
    Task::Kill(service.to_owned())
}

#[test]
fn while_the_supervisor_lives_nothing_is_done_whatever_happens() {
    let mut it = Clocked::new();
    it.watch.hurry();
    for airborne in [true, false, true] {
        it.airborne = airborne;
        assert_eq!(it.pass(100 * SECOND), []);
    }
    // Nor was the hurry meant for later.
    it.watch.orphaned(it.now);
    assert_eq!(it.pass(SECOND / 2), [Task::Land, Task::Order(ORDER)]);
}

#[test]
fn what_flies_is_landed_before_anything_ends() {
    let mut it = Clocked::new();
    it.airborne = true;
    it.watch.orphaned(it.now);
    let order = Task::Order(ORDER);
    assert_eq!(it.pass(3 * SECOND), [Task::Land, order.clone(), order.clone(), order]);
    it.airborne = false;
    assert_eq!(it.pass(SECOND), [Task::End("landed"), terminate("sonar")]);
    it.gone("sonar");
    assert_eq!(it.pass(SECOND), [terminate("pilot")]);
    it.gone("pilot");
    assert_eq!(it.pass(SECOND), [terminate("flight")]);
    it.gone("flight");
    assert_eq!(it.pass(SECOND), [Task::Leave]);
    assert_eq!(it.pass(100 * SECOND), []);
}

#[test]
fn a_pilot_on_the_ground_is_listened_to_before_it_is_believed() {
    let mut it = Clocked::new();
    it.watch.orphaned(it.now);
    assert_eq!(it.pass(LOOK / 2), []);
    it.airborne = true;
    assert_eq!(it.pass(SECOND / 10), [Task::Land, Task::Order(ORDER)]);

    let mut it = Clocked::new();
    it.watch.orphaned(it.now);
    assert_eq!(it.pass(LOOK), []);
    assert_eq!(it.pass(SECOND / 10), [Task::End("nothing flies"), terminate("sonar")]);
}

#[test]
fn a_landing_that_takes_too_long_is_not_waited_for() {
    let mut it = Clocked::new();
    it.airborne = true;
    it.watch.orphaned(it.now);
    assert_eq!(it.pass(10 * SECOND).len(), 11);
    let late = Task::End("not landed in time");
    assert_eq!(it.pass(SECOND), [late, terminate("sonar")]);
}

#[test]
fn who_does_not_end_is_killed_until_it_is_gone() {
    let mut it = Clocked::new();
    it.watch.orphaned(it.now);
    it.pass(LOOK);
    let end = Task::End("nothing flies");
    assert_eq!(it.pass(5 * SECOND), [end, terminate("sonar"), kill("sonar"), kill("sonar")]);
    it.gone("sonar");
    assert_eq!(it.pass(SECOND), [terminate("pilot")]);
}

#[test]
fn in_a_hurry_all_end_together() {
    let mut it = Clocked::new();
    it.airborne = true;
    it.watch.orphaned(it.now);
    it.pass(SECOND);
    it.watch.hurry();
    let end = Task::End("told not to wait");
    let all = ["sonar", "pilot", "flight"];
    assert_eq!(it.pass(HURRY), [vec![end], all.map(terminate).into()].concat());
    assert_eq!(it.pass(HURRY), all.map(kill));
    it.living.clear();
    assert_eq!(it.pass(HURRY), [Task::Leave]);
}

#[test]
fn what_is_of_no_known_service_ends_first() {
    let mut it = Clocked::new();
    it.living.insert("stranger".to_owned());
    it.watch.orphaned(it.now);
    it.pass(LOOK);
    assert_eq!(it.pass(SECOND).last(), Some(&terminate("stranger")));
    it.gone("stranger");
    assert_eq!(it.pass(SECOND), [terminate("sonar")]);
}
