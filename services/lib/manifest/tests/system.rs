//! The manifest: what is refused, with which words, and what the shipped one says.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use manifest::{Criticality, Manifest, ManifestError, Restart, RestartPolicy};
use std::time::Duration;

const KNOWN: [&str; 28] = [
    "sonar/ranges",
    "flow/motion",
    "sim/ping",
    "sim/echo",
    "sim/truth",
    "flight/attitude",
    "flight/state",
    "flight/power",
    "localization/pose",
    "localization/particles",
    "navigation/grid",
    "navigation/polar",
    "navigation/setpoint",
    "navigation/patrol",
    "pilot/channels",
    "pilot/state",
    "operator/sticks",
    "operator/command",
    "sim/shutter",
    "sim/view",
    "camera/picture",
    "camera/video",
    "camera/still",
    "camera/wish",
    "signal/in",
    "signal/out",
    "health",
    "trace",
];

const SMALL: &str = r#"
[system]
name = "s"
plan = "p.yaml"
vehicle = "v.toml"
[service.sonar]
run = "sereno-sonar"
tick_hz = 200
publishes = { "sonar/ranges" = { hz = 16.7, deadline_ms = 150 } }
[service.pilot]
run = "sereno-pilot"
tick_hz = 50
publishes = { "pilot/state" = { hz = 5, retained = true } }
subscribes = { "sonar/ranges" = { depth = 8, wake = true }, "operator/sticks" = {} }
"#;

fn shipped() -> (Manifest, Manifest) {
    let system = Manifest::parse("system.toml", include_str!("../../../../deploy/system.toml")).unwrap();
    let simulated = system.overlay("sim.toml", include_str!("../../../../deploy/sim.toml")).unwrap();
    (system, simulated)
}

/// The sentence with which a manifest is refused, by its reader or by its check.
fn refusal(text: &str) -> String {
    match Manifest::parse("m.toml", text) {
        Err(e) => e.to_string(),
        Ok(m) => match m.check(&KNOWN) {
            Err(e) => e.to_string(),
            Ok(()) => panic!("accepted:\n{text}"),
        },
    }
}

#[test]
fn the_shipped_manifests_hold_together() {
    let (system, simulated) = shipped();
    assert_eq!(system.problems(&KNOWN), []);
    assert_eq!(simulated.problems(&KNOWN), []);
    assert!(!system.services.contains_key("simulator") && simulated.services.contains_key("simulator"));
    assert!(simulated.system.simulated && !system.system.simulated);
    assert_eq!(simulated.system.world, "worlds/demo.toml");
    assert_eq!(simulated.services["flight"].devices["controller"], "@run/controller");
    assert_eq!(system.services["flight"].devices["controller"], "/dev/ttyAMA0");
    // What the overlay does not name stays.
    assert_eq!(simulated.services["flight"].tick_hz, 200.0);
    assert!(simulated.services["flight"].subscribes["pilot/channels"].wake);
    // Every known topic is somebody's.
    let topics = simulated.topics();
    for known in KNOWN.iter().filter(|k| k.contains('/')) {
        assert!(topics.iter().any(|t| t.name == *known), "{known}");
    }
    // Nobody but scorers sees the truth.
    let scorers = simulated.services.values().filter(|s| s.scorer).map(|s| s.name.as_str());
    assert_eq!(scorers.collect::<Vec<_>>(), ["bridge"], "shows what is true in a simulation");
    assert!(system.services.values().all(|s| !s.scorer));
    assert!(
        simulated.tools["cli"].may_read("sim/truth") && !simulated.tools["supervisor"].may_read("sim/truth")
    );
    let kept: Vec<_> = topics.iter().filter(|t| t.retained).map(|t| t.name.as_str()).collect();
    assert_eq!(kept, ["localization/particles", "navigation/patrol", "pilot/state"]);
}

#[test]
fn services_start_by_criticality_then_priority() {
    let (_, simulated) = shipped();
    let names: Vec<_> = simulated.start_order().iter().map(|s| s.name.as_str()).collect();
    let first = ["simulator", "flight", "pilot", "sonar", "flow", "localization", "navigation"];
    assert_eq!(names[..first.len()], first);
    assert!(names[first.len()..].contains(&"camera"), "what merely shows something comes last: {names:?}");
}

#[test]
fn what_is_left_out_has_a_default() {
    let m = Manifest::parse("m.toml", SMALL).unwrap();
    m.check(&KNOWN).unwrap();
    let pilot = &m.services["pilot"];
    assert_eq!((pilot.criticality, pilot.restart), (Criticality::Mission, Restart::Always));
    assert_eq!(pilot.subscribes["operator/sticks"].depth, 4);
    assert_eq!(pilot.retained().collect::<Vec<_>>(), ["pilot/state"]);
    assert!(pilot.may_publish("health/pilot") && pilot.may_publish("pilot/state"));
    assert!(!pilot.may_publish("health/sonar") && !pilot.may_publish("pilot/channels"));
    let ranges = m.topics().into_iter().find(|t| t.name == "sonar/ranges").unwrap();
    assert_eq!((ranges.publishers, ranges.subscribers), (vec!["sonar".into()], vec!["pilot".into()]));
    assert_eq!((ranges.hz, ranges.deadline_ms, ranges.depth), (16.7, 150, 8));
}

#[test]
fn syntax_errors_name_file_and_line() {
    let e = Manifest::parse("m.toml", &SMALL.replace("tick_hz = 200", "tick = 200")).unwrap_err();
    assert!(matches!(&e, ManifestError::Syntax { line: 8, .. }), "{e:?}");
    assert!(e.to_string().starts_with("m.toml:8: unknown field `tick`"), "{e}");
    let e = refusal(&SMALL.replace("tick_hz = 200", "tick_hz = \"fast\""));
    assert!(e.starts_with("m.toml:8: ") && !e.contains('\n'), "{e}");
    let e = refusal(&SMALL.replace("tick_hz = 200", "restart = \"sometimes\""));
    assert!(e.contains("sometimes") && e.contains("on-failure"), "{e}");
    assert!(refusal("[system").starts_with("m.toml:1: "));
}

#[test]
fn ranges_are_named() {
    for (from, to, says) in [
        ("tick_hz = 200", "tick_hz = 5000", "service.sonar.tick_hz = 5000: allowed is 0 to 1000"),
        ("tick_hz = 200", "tick_hz = nan", "service.sonar.tick_hz = NaN: allowed is 0 to 1000"),
        ("tick_hz = 200", "tick_hz = 1\npriority = 100", "service.sonar.priority = 100: allowed is 0 to 99"),
        (
            "tick_hz = 200",
            "tick_hz = 1\nheartbeat_ms = -1",
            "service.sonar.heartbeat_ms = -1: allowed is 50 to 60000",
        ),
        ("hz = 16.7", "hz = -1", "service.sonar.publishes.\"sonar/ranges\".hz = -1: allowed is 0 to 1000"),
        ("depth = 8", "depth = 0", "service.pilot.subscribes.\"sonar/ranges\".depth = 0: allowed is 1 to 64"),
        ("run = \"sereno-sonar\"", "run = \"bin/x\"", "a file name without directory, or an absolute path"),
        ("name = \"s\"", "name = \"S 1\"", "system.name = S 1: allowed is 1 to 32 of a-z, 0-9 and -"),
        (
            "tick_hz = 200",
            "tick_hz = 1\ndevices = { a = \"gpio\" }",
            "service.sonar.devices.a = gpio: allowed is",
        ),
        ("tick_hz = 200", "tick_hz = 1\ndevices = { a = \"@run/../x\" }", "service.sonar.devices.a"),
        ("[service.sonar]", "[service.'../x']", "service.../x = ../x: allowed is"),
        ("tick_hz = 200\n", "\n", "service.sonar.tick_hz is missing: nothing wakes this service"),
        ("run = \"sereno-pilot\"\n", "\n", "service.pilot.run is missing"),
        ("plan = \"p.yaml\"\n", "\n", "system.plan is missing"),
    ] {
        let text = SMALL.replacen(from, to, 1);
        assert_ne!(text, SMALL, "{from}");
        let said = refusal(&text);
        assert!(said.starts_with("m.toml: ") && said.contains(says), "{to}: {said}");
    }
}

#[test]
fn wiring_that_does_not_fit_is_refused() {
    let with = |more: &str| format!("{SMALL}{more}");
    for (text, says) in [
        (
            SMALL.replace("sonar/ranges\" = { hz", "sonar/rangs\" = { hz"),
            "no such topic; did you mean sonar/ranges?",
        ),
        (with("[service.b]\nrun='b'\ntick_hz=1\npublishes={'sonar/ranges'={}}"), "already published by b"),
        (with("[service.b]\nrun='b'\ntick_hz=1\nsubscribes={'flight/state'={}}"), "no service publishes it"),
        (with("[service.b]\nrun='b'\ntick_hz=1\nsubscribes={'health/nobody'={}}"), "no service publishes it"),
        (with("[service.b]\nrun='b'\ntick_hz=1\npublishes={'health/b'={}}"), "without saying so"),
        (
            with(
                "[service.b]\nrun='b'\ntick_hz=1\npublishes={'sim/truth'={}}\n[service.c]\nrun='c'\ntick_hz=1\nsubscribes={'sim/truth'={}}",
            ),
            "service.c.subscribes.\"sim/truth\": only scorers may read the truth",
        ),
        (
            with(
                "[service.b]\nrun='b'\ntick_hz=1\ndevices={x='/dev/a'}\n[service.c]\nrun='c'\ntick_hz=1\ndevices={y='/dev/a'}",
            ),
            "/dev/a is already given to service.b.devices.x; a device has one owner",
        ),
        (with("[tool.t]\npublishes=['pilot/channels']"), "tools may publish only what people say"),
    ] {
        let said = refusal(&text);
        assert!(said.contains(says), "wanted {says:?}, got {said:?}");
    }
    // The same things done right.
    for text in [
        with("[service.b]\nrun='b'\ntick_hz=1\nsubscribes={'health/pilot'={}}"),
        with(
            "[service.b]\nrun='b'\ntick_hz=1\npublishes={'sim/truth'={}}\n[service.c]\nrun='c'\ntick_hz=1\nscorer=true\nsubscribes={'sim/truth'={}}",
        ),
        with("[tool.t]\npublishes=['operator/command']"),
    ] {
        Manifest::parse("m.toml", &text).unwrap().check(&KNOWN).unwrap();
    }
}

#[test]
fn a_simulation_opens_no_real_device() {
    let base = Manifest::parse(
        "m.toml",
        &SMALL.replace("tick_hz = 200", "tick_hz = 200\ndevices = { gpio = \"/dev/gpiochip0\" }"),
    )
    .unwrap();
    base.check(&KNOWN).unwrap();
    let e = base.overlay("sim.toml", "[system]\nsimulated = true").unwrap().check(&KNOWN).unwrap_err();
    assert_eq!(
        e.to_string(),
        "m.toml + sim.toml: service.sonar.devices.gpio: /dev/gpiochip0 is a real device; in simulation only @run/NAME is allowed"
    );
    let sim = "[system]\nsimulated = true\n[service.sonar]\ndevices = { gpio = \"@run/gpio\" }";
    base.overlay("sim.toml", sim).unwrap().check(&KNOWN).unwrap();
}

#[test]
fn an_overlay_is_read_as_strictly_as_its_base() {
    let base = Manifest::parse("m.toml", SMALL).unwrap();
    let e = base.overlay("sim.toml", "[service.sonar]\nspeed = 1").unwrap_err();
    assert!(e.to_string().starts_with("sim.toml:2: unknown field `speed`"), "{e}");
    let e = base.overlay("sim.toml", "[service.new]\ntick_hz = 1").unwrap_err();
    assert!(e.to_string().contains("service.new.run is missing"), "{e}");
}

#[test]
fn restarts_are_immediate_then_back_off_to_a_cap() {
    let policy = RestartPolicy::default();
    let delays: Vec<u128> = (1..10).map(|n| policy.delay(n).as_millis()).collect();
    assert_eq!(delays, [0, 50, 100, 200, 400, 800, 1600, 2000, 2000]);
    assert_eq!(policy.delay(u32::MAX), Duration::from_secs(2));
}

#[test]
fn the_graph_shows_every_topic_and_reader() {
    let (_, simulated) = shipped();
    let graph = simulated.graph();
    for line in [
        "    pilot ==>|pilot/channels| flight",
        "    sonar ==>|sonar/ranges| localization",
        "    sonar -->|sonar/ranges| pilot",
        "    localization -.->|localization/particles| localization",
        "    operator ==>|operator/command| pilot",
        "    operator -->|operator/command| navigation",
        "    sonar ==>|sim/ping| simulator",
    ] {
        assert!(graph.lines().any(|l| l == line), "{line}\n{graph}");
    }
    let edges = graph.lines().filter(|l| l.contains('|')).count();
    let drawn = |topic: &&String| !topic.starts_with("health/") && !topic.starts_with("trace/");
    // A topic may have several writers: one edge from each to every reader.
    let writers = |topic: &String| {
        let writers = simulated.services.values().filter(|s| s.publishes.contains_key(topic)).count();
        let tools = graph.lines().any(|l| l.starts_with("    cli ") && l.contains(&format!("|{topic}|")));
        if topic.starts_with("operator/") { 1 } else { writers + usize::from(tools) }
    };
    let readers: usize =
        simulated.services.values().flat_map(|s| s.subscribes.keys().filter(drawn)).map(writers).sum();
    assert_eq!(edges, readers);
    let table = simulated.table();
    assert!(table.lines().any(|l| l.starts_with("pilot/state") && l.contains("pilot (kept)")), "{table}");
    assert!(table.lines().any(|l| l.starts_with("flow ") && l.contains("flow=@run/flow")), "{table}");
}

proptest::proptest! {
    #[test]
    fn no_text_panics(text in ".{0,200}") {
        let _ = Manifest::parse("m.toml", &text);
    }

    #[test]
    fn no_change_of_a_good_manifest_panics(at in 0usize..400, text in "[ -~\n]{0,6}") {
        let mut broken = SMALL.to_owned();
        let at = at.min(broken.len());
        broken.insert_str(at, &text);
        if let Ok(m) = Manifest::parse("m.toml", &broken) {
            let _ = (m.problems(&KNOWN), m.graph(), m.table());
        }
    }
}

#[test]
fn a_pad_is_a_place_and_a_heading() {
    let with = |pad: &str| {
        Manifest::parse("m.toml", &SMALL.replace("name = \"s\"", &format!("name = \"s\"\n{pad}")))
    };
    assert_eq!(with("").unwrap().system.pad, None);
    assert_eq!(with("pad = [1.5, -2.0, 90.0]").unwrap().system.pad, Some([1.5, -2.0, 90.0]));
    let said = |pad: &str| with(pad).unwrap_err().to_string();
    assert!(said("pad = [1.0, 99999.0, 0.0]").contains("system.pad: y = 99999: allowed is -10000 to 10000"));
    assert!(said("pad = [1.0, nan, 0.0]").contains("system.pad: y = NaN"));
    assert!(said("pad = [1.0, 2.0, 400.0]").contains("system.pad: heading = 400: allowed is -360 to 360"));
    assert!(said("pad = [1.0, 2.0]").starts_with("m.toml:"), "{}", said("pad = [1.0, 2.0]"));
}

#[test]
fn a_message_is_one_plain_line_whatever_the_file_says() {
    let texts = [
        SMALL.replace("name = \"s\"", r#"name = "s\nall is well""#),
        SMALL.replace(
            "name = \"s\"",
            r#"name = "s"
"\u001b[2J" = 1"#,
        ),
        format!("{SMALL}\n[service.\"a\\nb\"]\nrun = \"x\"\n"),
    ];
    for text in texts {
        let error = Manifest::parse("m.toml", &text).unwrap_err().to_string();
        assert!(!error.chars().any(char::is_control), "{error:?}");
    }
    let wired = format!("{SMALL}\n[service.more]\nrun = \"x\"\ntick_hz = 1.0\npublishes.\"a\\nb\" = {{}}\n");
    let problems = Manifest::parse("m.toml", &wired).unwrap().problems(&KNOWN);
    assert!(problems.iter().any(|problem| problem.to_string().contains(r"a\nb")), "{problems:?}");
    assert!(!problems.iter().any(|problem| problem.to_string().contains('\n')), "{problems:?}");
}
