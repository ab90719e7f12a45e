//! Changes of the building, through files, supervisor and services.

use crate::client::{ANSWER, Client, SILENCE};
use crate::system::{System, wait_until};
use crate::{accepted, connect};
use ipc_types::Verb;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// Decoding a plan and asking the supervisor, on a loaded machine too.
const CHANGE: Duration = Duration::from_secs(20);

fn about(client: &Client) -> Value {
    let about = client.ask(&client.keys.about(), None, ANSWER).unwrap_or_default();
    serde_json::from_slice(&about).unwrap_or_default()
}

/// Asks for a change under a name; `None` when nobody answers.
fn change_as(
    client: &mut Client,
    name: &str,
    building: &Value,
    plan: Option<(Value, Vec<u8>)>,
    patience: Duration,
) -> Option<Value> {
    let revision = about(client)["revision"].clone();
    change_from(client, name, (building, &revision), plan, patience)
}

/// Asks for a change that was made from the building of a revision.
fn change_from(
    client: &mut Client,
    name: &str,
    (building, revision): (&Value, &Value),
    plan: Option<(Value, Vec<u8>)>,
    patience: Duration,
) -> Option<Value> {
    let mut text = client.order(Verb::Hold);
    text["made_from"] = revision.clone();
    text["building"] = building.clone();
    let picture = plan.map(|(place, picture)| {
        text["plan"] = place;
        picture
    });
    let payload = Some(text.to_string().into_bytes());
    let answer = client.ask_with(&client.keys.edit(name), payload, picture, patience)?;
    Some(serde_json::from_slice(&answer).unwrap())
}

fn files(system: &System) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(system.deploy().join("plans")).unwrap().flatten();
    entries.map(|entry| (entry.path(), std::fs::read(entry.path()).unwrap())).collect()
}

fn pids(system: &System) -> BTreeMap<String, u64> {
    let overview = system.sereno(&["ps", "--json"]).stdout;
    let overview: Value = serde_json::from_slice(&overview).unwrap_or_default();
    let rows = overview["services"].as_array().cloned().unwrap_or_default();
    rows.iter()
        .filter(|row| row["state"] == "running")
        .filter_map(|row| Some((row["name"].as_str()?.to_owned(), row["pid"].as_u64()?)))
        .collect()
}

/// Waits until every service runs and none of them is one of the old.
fn wait_anew(system: &System, old: &BTreeMap<String, u64>) {
    wait_until("everything starts anew", || {
        let now = pids(system);
        now.len() == old.len() && now.iter().all(|(name, pid)| old.get(name) != Some(pid))
    });
    system.wait_bridge("certificates known");
}

pub(crate) fn who_may_not_changes_nothing(system: &System) {
    let before = (files(system), pids(system));
    let (mut installer, mut guard) = (connect(system, "installer"), connect(system, "guard"));
    let building = about(&guard)["building"].clone();
    let said = change_as(&mut guard, "guard", &building, None, CHANGE).unwrap();
    assert_eq!(said["accepted"], false);
    assert!(said["text"].as_str().unwrap().contains("a guard may not change the building"), "{said}");
    assert_eq!(change_as(&mut guard, "installer", &building, None, SILENCE), None, "another's name");
    let mut refused = |building: &Value, plan: Option<(Value, Vec<u8>)>, what: &str| {
        // At the pace that the drone allows.
        std::thread::sleep(Duration::from_millis(600));
        let said = change_as(&mut installer, "installer", building, plan, CHANGE).unwrap();
        assert_eq!(said["accepted"], false, "{said}");
        assert!(said["text"].as_str().unwrap().contains(what), "{what}: {said}");
    };
    let mut wrong = building.clone();
    wrong["round"]["order"] = json!(["Attic"]);
    refused(&wrong, None, "`round.order` is \"Attic\"");
    let mut wrong = building.clone();
    wrong["pad"]["x"] = json!(-50.0);
    refused(&wrong, None, "the pad at (-50.00");
    let place = json!({ "resolution_m": 0.05, "origin_x_m": 0.0, "origin_y_m": 0.0 });
    refused(&building, Some((place.clone(), b"no picture".to_vec())), "not a PGM or PNG image");
    refused(&building, Some((place, vec![0; 1_100_000])), "allowed are at most");
    assert_eq!((files(system), pids(system)), before, "nothing was written, nobody started anew");
}

pub(crate) fn a_round_is_taken_over(system: &System) {
    let mut installer = connect(system, "installer");
    let mut building = about(&installer)["building"].clone();
    let rooms: Vec<String> = building["rooms"]
        .as_array()
        .unwrap()
        .iter()
        .map(|room| room["name"].as_str().unwrap().to_owned())
        .collect();
    building["round"]["leave_out"] = json!([rooms[1]]);
    building["privacy"] = json!([{ "name": "Desk", "rectangle": [1.0, 1.0, 1.5, 1.5] }]);
    let old = pids(system);
    let revision = about(&installer)["revision"].clone();
    // Two installers began with the same building: the first is obeyed, the second writes over nothing.
    let said = change_from(&mut installer, "installer", (&building, &revision), None, CHANGE).unwrap();
    assert_eq!(said["accepted"], true, "{said}");
    wait_anew(system, &old);
    let mut second = connect(system, "installer");
    wait_until("another building is told", || {
        let now = about(&second)["revision"].clone();
        now.is_string() && now != revision
    });
    let before = (files(system), pids(system));
    let mut other = building.clone();
    other["privacy"] = json!([]);
    let said = change_from(&mut second, "installer", (&other, &revision), None, CHANGE).unwrap();
    let overtaken = "the building was changed meanwhile by installer: load it anew";
    assert_eq!((&said["accepted"], &said["text"]), (&json!(false), &json!(overtaken)));
    assert_eq!((files(system), pids(system)), before, "nothing was written, nobody started anew");
    let client = connect(system, "viewer");
    wait_until("the new round is told", || {
        about(&client)["building"]["round"]["leave_out"] == json!([rooms[1]])
    });
    assert_eq!(about(&client)["building"]["privacy"][0]["name"], "Desk");
    let plans = system.deploy().join("plans");
    assert!(plans.join("two-rooms.rooms.yaml.previous").is_file(), "what was is kept");
}

pub(crate) fn a_plan_is_taken_over(system: &System) {
    let mut installer = connect(system, "installer");
    // A hall of 8 m by 6 m.
    let drawn = image::GrayImage::from_fn(160, 120, |x, y| {
        let wall = x < 2 || y < 2 || x > 157 || y > 117;
        image::Luma([if wall { 0 } else { 254 }])
    });
    let mut png = std::io::Cursor::new(Vec::new());
    drawn.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let place = json!({ "resolution_m": 0.05, "origin_x_m": 0.0, "origin_y_m": 0.0 });
    let building = json!({ "pad": { "x": 2.0, "y": 3.0, "heading_deg": 0.0 },
        "rooms": [{ "name": "New hall", "rectangle": [0.1, 0.1, 7.9, 5.9] }] });
    let old = pids(system);
    let plan = Some((place, png.into_inner()));
    let said = change_as(&mut installer, "installer", &building, plan, CHANGE).unwrap();
    assert_eq!(said["accepted"], true, "{said}");
    wait_anew(system, &old);
    let client = connect(system, "viewer");
    wait_until("the new plan is told", || about(&client)["plan"]["width"] == 160);
    assert_eq!(about(&client)["building"]["rooms"][0]["name"], "New hall");
}

pub(crate) fn not_in_the_air(system: &System) {
    let (mut installer, mut guard) = (connect(system, "installer"), connect(system, "guard"));
    accepted(&mut guard, Verb::TakeOff);
    wait_until("it flies", || {
        let overview = system.sereno(&["ps", "--json"]).stdout;
        serde_json::from_slice::<Value>(&overview).is_ok_and(|overview| overview["airborne"] == true)
    });
    let building = about(&installer)["building"].clone();
    let before = (files(system), pids(system));
    let said = change_as(&mut installer, "installer", &building, None, CHANGE).unwrap();
    assert_eq!((&said["accepted"], &said["text"]), (&json!(false), &json!("the drone flies: land first")));
    let reload = system.sereno(&["reload"]);
    assert!(!reload.status.success());
    assert!(String::from_utf8_lossy(&reload.stderr).contains("land first"));
    assert_eq!((files(system), pids(system)), before);
}
