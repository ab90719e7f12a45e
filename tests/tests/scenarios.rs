//! The machinery of the scenarios, over ten of them; `cargo xtask scenarios` flies all.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use sereno_tests::checkout;
use sereno_tests::scenarios::{Scenario, Settings, Verdict, failures, fly, load_all, load_known, run};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

fn directory() -> std::path::PathBuf {
    checkout().join("tests/scenarios")
}

fn settings(pictures: &Path) -> Settings {
    Settings { threads: 2, pictures: pictures.to_owned(), draw_all: false }
}

#[test]
fn every_file_is_read_and_no_two_fly_the_same() {
    let scenarios = load_all(&directory()).unwrap();
    assert!(scenarios.len() >= 80, "{}", scenarios.len());
    load_known(&directory(), &scenarios).unwrap();
    let flights: BTreeSet<String> = scenarios
        .iter()
        .map(|scenario| {
            let unnamed = Scenario { name: String::new(), about: String::new(), ..scenario.clone() };
            format!("{unnamed:?}")
        })
        .collect();
    assert_eq!(flights.len(), scenarios.len());
}

#[test]
fn nonsense_in_a_file_is_refused_by_name() {
    let good = "# Up and down.\n[[orders]]\norder = \"take-off\"\n[expect]\ncontacts = 0\n";
    assert!(Scenario::parse("good", good).is_ok());
    for (text, word) in [
        (good.replace("# Up and down.\n", ""), "comment"),
        (good.replace("contacts = 0", "contact = 0"), "contact"),
        (good.replace("contacts = 0", ""), "cannot fail"),
        (good.replace("contacts = 0", "failsafes = [\"gravity: fall\"]"), "gravity: fall"),
        (good.replace("contacts = 0", "no_failsafe_worse_than = \"panic\""), "panic"),
        (good.replace("contacts = 0", "failsafe_within_s = 1.0"), "failsafe_within_s"),
        (good.replace("take-off", "goto"), "goto needs it"),
        (good.replace("take-off\"", "take-off\"\nat_s = 3"), "begins the flight"),
        (good.replace("down.\n", "down.\nflight_s = 0.0\n"), "flight_s"),
        (
            good.replace(
                "[expect]",
                "[[orders]]\norder = \"hold\"\nat_s = 9\n[[orders]]\norder = \"land\"\nat_s = 3\n[expect]",
            ),
            "order of their times",
        ),
        (good.replace("[expect]", "[[faults]]\nkind = \"sonar-dead\"\n[expect]"), "sonars is missing"),
    ] {
        let error = format!("{:#}", Scenario::parse("bad", &text).unwrap_err());
        assert!(error.contains(word) && error.contains("bad.toml"), "{text}\n{error}");
    }
}

/// One of each family.
const TEN: [&str; 10] = [
    "sound-hover",
    "down-dead-hover",
    "down-dead-pad",
    "front-dead-hover",
    "sides-dead-goto",
    "serial-flipped-hover",
    "reboot-hover",
    "battery-cell-hover",
    "motor-weak-hover",
    "person-comes-hover",
];

#[test]
fn ten_of_them_end_as_expected() {
    let all = load_all(&directory()).unwrap();
    let known = load_known(&directory(), &all).unwrap();
    let ten: Vec<Scenario> = all.into_iter().filter(|s| TEN.contains(&s.name.as_str())).collect();
    assert_eq!(ten.len(), TEN.len());
    let pictures = tempfile::tempdir().unwrap();
    let report = run(&ten, &known, &settings(pictures.path()), |_| {}).unwrap();
    let bad: Vec<String> = report
        .scenarios
        .iter()
        .filter(|o| !matches!(o.verdict, Verdict::Passed | Verdict::KnownShortfall))
        .map(|o| format!("{}: {:?} {:?}", o.name, o.verdict, o.failures))
        .collect();
    assert!(report.is_good(), "{bad:#?}");
}

/// A flight in which nothing breaks, with expectations that are all false: each must be told, the picture drawn, and the
/// same list as a known shortfall is none to be alarmed about.
#[test]
fn expectations_that_are_false_fail_and_leave_a_picture() {
    let text = std::fs::read_to_string(directory().join("sound-hover.toml")).unwrap();
    let head = text.split("[expect]").next().unwrap();
    let wrong = "[expect]\nclearance_m = 1.4\nflies = false\nrefused = \"no\"\nlanded = false\non_pad = false\n\
                 within_m_of_start = 0.0\nphase = \"hover\"\nfailsafes = [\"lost: descend\"]\nends_by_s = 5.0\n\
                 touch_down_m_s = 0.0\nerror_m = 0.0\nreaches_m = 1.0\nheight_m = 0.5\narmings = 0\n";
    let scenario = Scenario::parse("wrong", &format!("{head}{wrong}")).unwrap();
    let pictures = tempfile::tempdir().unwrap();
    let settings = settings(pictures.path());
    let report = run(std::slice::from_ref(&scenario), &BTreeMap::new(), &settings, |_| {}).unwrap();
    let outcome = &report.scenarios[0];
    assert_eq!(outcome.verdict, Verdict::Failed);
    assert!(!report.is_good());
    assert_eq!(outcome.failures.len(), 14, "{:#?}", outcome.failures);
    assert!(outcome.failures.iter().all(|told| told.starts_with("expected")), "{:#?}", outcome.failures);
    let picture = std::fs::read_to_string(outcome.picture.as_ref().unwrap()).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("Scenario wrong"));

    let known = BTreeMap::from([("wrong".to_owned(), "it flies".to_owned())]);
    let report = run(std::slice::from_ref(&scenario), &known, &settings, |_| {}).unwrap();
    assert_eq!(report.scenarios[0].verdict, Verdict::KnownShortfall);
    assert!(report.is_good());

    // An entry that is no longer true is an error.
    let right = Scenario::parse("wrong", &format!("{head}[expect]\ncontacts = 0\n")).unwrap();
    let report = run(&[right], &known, &settings, |_| {}).unwrap();
    assert_eq!(report.scenarios[0].verdict, Verdict::NoLongerAShortfall);
    assert!(!report.is_good());
}

#[test]
fn a_flight_that_is_over_before_anything_breaks_fails() {
    let text = std::fs::read_to_string(directory().join("down-dead-hover.toml")).unwrap();
    let land = "[[orders]]\norder = \"land\"\nat_s = 3\n\n[[faults]]";
    let late = text.replace("[[faults]]", land).replace("from_s = 8", "from_s = 40");
    let head = late.split("[expect]").next().unwrap();
    let scenario = Scenario::parse("late", &format!("{head}[expect]\nlanded = true\n")).unwrap();
    let flown = fly(&scenario, &runtime::Cache::default()).unwrap();
    let told = failures(&scenario, &flown.seen);
    assert!(told.len() == 1 && told[0].contains("over before fault 1 began at 40 s"), "{told:?}");
    // Each fault counts by itself, and one that is there from the start always holds.
    let early = "[[faults]]\nkind = \"sonar-spikes\"\nsonars = [\"sides\"]\nshare = 0.01\n\n[expect]";
    let text = format!("{head}[expect]\nlanded = true\n").replace("[expect]", early);
    let text = text.replace("from_s = 40", "from_s = 2");
    let scenario = Scenario::parse("early", &text).unwrap();
    let flown = fly(&scenario, &runtime::Cache::default()).unwrap();
    assert_eq!(
        (flown.seen.begun.clone(), failures(&scenario, &flown.seen)),
        (vec![true; 2], Vec::<String>::new())
    );
}

/// In full flight no aircraft stands a moment later.
#[test]
fn a_stop_that_comes_too_late_fails() {
    let text = std::fs::read_to_string(directory().join("sides-dead-goto.toml")).unwrap();
    let head = text.split("[expect]").next().unwrap();
    let told = |within: &str| {
        let text = format!("{head}[expect]\nstopped_within_s = {within}\n");
        let scenario = Scenario::parse("stop", &text).unwrap();
        failures(&scenario, &fly(&scenario, &runtime::Cache::default()).unwrap().seen)
    };
    let late = told("0.1");
    assert!(late.len() == 1 && late[0].contains("to stop within 0.1 s of the fault"), "{late:?}");
    assert_eq!(told("5.0"), Vec::<String>::new());
}

#[test]
fn a_scenario_flies_the_same_twice() {
    let all = load_all(&directory()).unwrap();
    let scenario = all.iter().find(|s| s.name == "serial-flipped-hover").unwrap();
    let seen = || {
        let flown = fly(scenario, &runtime::Cache::default()).unwrap();
        (failures(scenario, &flown.seen), format!("{:?}", flown.seen))
    };
    assert_eq!(seen(), seen());
}
