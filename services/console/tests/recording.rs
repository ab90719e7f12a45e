//! Recordings: begun, ended, shown, erased; what an incident keeps; and what a crash, junk and a full disk leave of them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::client::{Client, hear};
use common::drone::Drone;
use common::video::{Camera, LARGE, SMALL, encoding, send};
use common::{Bench, until};
use console::{RecordingConfig, Role};
use serde_json::{Value, json};
use shiguredo_mp4::demux::{Fmp4FileDemuxer, Input};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const KEEPS: RecordingConfig =
    RecordingConfig { enabled: true, retention_h: 24, most_gib: 5, free_gib: 1, rolling_s: 30 };

/// A console that keeps pictures, claimed, and a drone that is there.
async fn rig(keeps: RecordingConfig) -> (Bench, Client, Drone) {
    let mut bench = Bench::new(1).await;
    bench.config.recording = keeps;
    bench.restart().await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    (bench, eva, drone)
}

async fn list(client: &Client) -> Value {
    let answer = client.get("/api/drones/north/recordings").await;
    assert_eq!(answer.status, 200, "{}", answer.text);
    answer.json()
}

async fn recordings(client: &Client) -> Vec<Value> {
    list(client).await["recordings"].as_array().unwrap().clone()
}

/// A console that dies without a word, whatever becomes of the test.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        // SIGKILL.
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// Films until the list satisfies `done`.
async fn film_until(
    what: &str,
    camera: &mut Camera,
    drone: &Drone,
    client: &Client,
    done: impl Fn(&[Value]) -> bool,
) {
    let began = std::time::Instant::now();
    while !done(&recordings(client).await) {
        assert!(began.elapsed() < common::DEADLINE, "never: {what}");
        camera.send(drone, 15).await;
    }
}

async fn start(client: &Client) {
    let began = client.post("/api/drones/north/recordings", &json!({})).await;
    assert_eq!(began.status, 201, "{}", began.text);
}

async fn stop(client: &Client) {
    assert_eq!(client.post("/api/drones/north/recordings/stop", &json!({})).await.status, 200);
}

/// What is in a file: pictures, key frames, milliseconds.
fn read(bytes: &[u8]) -> (usize, usize, u64) {
    if bytes.is_empty() {
        return (0, 0, 0);
    }
    let mut demuxer = Fmp4FileDemuxer::new();
    let (mut frames, mut keys, mut ticks) = (0, 0, 0);
    loop {
        while let Some(wanted) = demuxer.required_input() {
            let from = bytes.len().min(wanted.position as usize);
            let to = wanted.size.map_or(bytes.len(), |size| bytes.len().min(from + size));
            demuxer.handle_input(Input { position: wanted.position, data: &bytes[from..to] });
        }
        let Some(sample) = demuxer.next_sample().unwrap() else { break };
        let nal = &bytes[sample.data_offset as usize..][..sample.data_size];
        assert_eq!(
            u32::from_be_bytes(nal[..4].try_into().unwrap()) as usize + 4,
            nal.len(),
            "one slice a picture"
        );
        assert!(frames > 0 || sample.keyframe, "it begins with a key frame");
        frames += 1;
        keys += usize::from(sample.keyframe);
        ticks += u64::from(sample.duration);
    }
    (frames, keys, ticks / 90)
}

fn path_of(recording: &Value) -> String {
    format!("/api/drones/north/recordings/{}/film.mp4", recording["id"])
}

/// What the drone hears on the keys of wishes.
async fn wishes(drone: &Drone) -> Arc<Mutex<Vec<Value>>> {
    let heard: Arc<Mutex<Vec<Value>>> = Arc::default();
    let to = heard.clone();
    drone
        .session
        .declare_subscriber(format!("sereno/{}/wish/console", drone.name))
        .callback(move |sample| {
            to.lock().unwrap().push(serde_json::from_slice(&sample.payload().to_bytes()).unwrap());
        })
        .background()
        .await
        .unwrap();
    heard
}

#[tokio::test(flavor = "multi_thread")]
async fn a_guard_records_shows_and_takes_away_and_an_administrator_erases() {
    let (bench, eva, drone) = rig(KEEPS).await;
    let wishes = wishes(&drone).await;
    let (guard, _, email) = bench.account(&eva, Role::Guard, &["north"]).await;
    let mut page = guard.open("/ws/telemetry?drone=north").await.unwrap();
    assert_eq!(guard.get("/api/session").await.json()["recording"]["keeps"], true);
    start(&guard).await;
    let now =
        hear(&mut page, |value| value["recording"]["since_ms"].as_u64().map(|_| value["recording"].clone()))
            .await;
    assert_eq!(now["account"], email.as_str());
    until("the camera is asked", async || {
        wishes.lock().unwrap().iter().any(|wish| {
            wish["video"] == json!({ "width": 1280, "height": 720, "fps": 15 }) && wish["rolling"] == false
        })
    })
    .await;
    let mut camera = Camera::new(SMALL);
    film_until("a file", &mut camera, &drone, &guard, |all| !all.is_empty()).await;
    camera.send(&drone, 90).await;
    // The picture becomes larger: another file of the same recording.
    camera.film(LARGE);
    film_until("a second file", &mut camera, &drone, &guard, |all| all.len() == 2).await;
    camera.send(&drone, 60).await;
    until("written while it is recorded", async || {
        let open = recordings(&guard).await[0].clone();
        open["ended_ms"].is_null() && read(&guard.get(&path_of(&open)).await.bytes).0 >= 15
    })
    .await;
    stop(&guard).await;
    hear(&mut page, |value| {
        (value["recording"]["since_ms"].is_null() && value.get("recording").is_some()).then_some(())
    })
    .await;
    let all = recordings(&guard).await;
    let (second, first) = (&all[0], &all[1]);
    assert_eq!(
        (&first["width"], &first["height"], &first["follows"]),
        (&json!(320), &json!(240), &Value::Null)
    );
    assert_eq!((&second["width"], &second["follows"]), (&json!(480), &first["id"]));
    assert_eq!((&first["account"], &first["incident"]), (&json!(email), &Value::Null));

    let whole = guard.get(&path_of(first)).await;
    assert_eq!((whole.status, &whole.headers["content-type"]), (200, &"video/mp4".parse().unwrap()));
    assert_eq!(first["bytes"], whole.bytes.len());
    let (frames, keys, length_ms) = read(&whole.bytes);
    assert!(frames >= 90 && keys >= 3, "{frames} pictures, {keys} of them key frames");
    // Fifteen a second by the drone's clock, however fast they came.
    assert!(length_ms.abs_diff(frames as u64 * 200 / 3) < 70, "{length_ms} ms for {frames}");
    assert_eq!(first["ended_ms"].as_u64().unwrap() - first["started_ms"].as_u64().unwrap(), length_ms);

    // Browsers seek by ranges.
    for (range, status, part) in [
        ("bytes=0-", 206, &whole.bytes[..]),
        ("bytes=100-199", 206, &whole.bytes[100..200]),
        ("bytes=-50", 206, &whole.bytes[whole.bytes.len() - 50..]),
        ("bytes=0-1,5-6", 200, &whole.bytes[..]),
        ("bytes=99999999-", 416, &[][..]),
    ] {
        let answer = guard.get_with(&path_of(first), &[("range", range)]).await;
        assert_eq!((answer.status, &answer.bytes[..]), (status, part), "{range}");
    }
    let taken = guard.get(&format!("{}?download", path_of(first))).await;
    assert_eq!(
        taken.headers["content-disposition"],
        format!("attachment; filename=\"recording-{}.mp4\"", first["id"])
    );

    let folder = bench.config.data.join("recordings");
    let mode = |path: &std::path::Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&folder), 0o700);
    let files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path()).collect();
    assert_eq!(files.len(), 2);
    assert!(files.iter().all(|file| mode(file) == 0o600));

    // Another drone's path does not lead to it, and a guard may not erase.
    let elsewhere = path_of(first).replace("north", "south");
    assert_eq!(eva.get(&elsewhere).await.status, 404);
    let erase = format!("/api/drones/north/recordings/{}/erase", first["id"]);
    assert_eq!(guard.post(&erase, &json!({})).await.status, 403);
    assert_eq!(eva.post(&erase, &json!({})).await.status, 200);
    assert_eq!(eva.post(&erase, &json!({})).await.status, 404);
    assert_eq!(guard.get(&path_of(first)).await.status, 404);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    let log = bench.log(&eva).await;
    for (verb, who) in [
        ("start", &*email),
        ("play", &email),
        ("download", &email),
        ("stop", &email),
        ("erase", "eva@example.org"),
    ] {
        assert!(
            log.iter()
                .any(|line| line["kind"] == "recording" && line["verb"] == verb && line["account"] == who),
            "{verb}: {log:?}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_incident_keeps_the_seconds_before_it_with_place_and_holder() {
    let (bench, eva, drone) = rig(KEEPS).await;
    let wishes = wishes(&drone).await;
    let (guard, _, email) = bench.account(&eva, Role::Guard, &["north"]).await;
    until("it flies, and a small picture is asked for", async || {
        drone.say("pilot/state", &json!({ "phase": 2, "cause": 0, "action": 0, "holder": "ana" })).await;
        drone
            .say("localization/pose", &json!({ "x_m": 4.0, "y_m": 2.0, "heading_rad": 1.0, "searching": 0 }))
            .await;
        let wishes = wishes.lock().unwrap();
        wishes.iter().any(|wish| wish["rolling"] == true && wish["video"]["width"] == 640)
    })
    .await;
    let mut camera = Camera::new(SMALL);
    // A minute, of which half is kept.
    camera.send(&drone, 900).await;
    assert!(recordings(&guard).await.is_empty(), "nothing is written while nothing happens");
    let plain =
        guard.post("/api/drones/north/incidents", &json!({ "text": "no pictures", "keep": false })).await;
    assert_eq!((plain.status, plain.json().get("pictures")), (201, None));
    let marked =
        guard.post("/api/drones/north/incidents", &json!({ "text": "a window is open" })).await.json();
    assert_eq!((&marked["pictures"], &marked["trouble"]), (&json!(true), &json!("")));
    film_until("a clip that has ended", &mut camera, &drone, &guard, |all| {
        all.first().is_some_and(|clip| clip["ended_ms"].is_u64())
    })
    .await;
    let all = recordings(&guard).await;
    assert_eq!(all.len(), 1, "{all:?}");
    let clip = &all[0];
    assert_eq!((&clip["incident"], &clip["account"]), (&marked["id"], &json!(email)));
    let (frames, _, length_ms) = read(&guard.get(&path_of(clip)).await.bytes);
    assert!(frames >= 450 && length_ms >= 30_000, "{frames} pictures, {length_ms} ms");
    let before_ms = marked["time_ms"].as_u64().unwrap() - clip["started_ms"].as_u64().unwrap();
    assert!((28_000..=42_000).contains(&before_ms), "{before_ms} ms before the mark");
    let incident = guard.get("/api/drones/north/incidents").await.json()[0].clone();
    assert_eq!(
        (&incident["id"], &incident["holder"], &incident["x_m"]),
        (&marked["id"], &json!("ana"), &json!(4.0))
    );
    // A day and an hour later it is gone, and the log says why.
    bench.pass(Duration::from_secs(25 * 3600));
    let eva = bench.log_in("eva@example.org").await;
    until("it is erased by age", async || recordings(&eva).await.is_empty()).await;
    let log = bench.log(&eva).await;
    assert!(
        log.iter().any(|line| line["answer"].as_str().unwrap().contains("it is older than 24 h")),
        "{log:?}"
    );
    assert_eq!(std::fs::read_dir(bench.config.data.join("recordings")).unwrap().count(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn junk_is_counted_and_lost_pictures_do_not_spoil_the_file() {
    let (bench, eva, drone) = rig(KEEPS).await;
    let wishes = wishes(&drone).await;
    start(&eva).await;
    let mut camera = Camera::new(SMALL);
    film_until("a file", &mut camera, &drone, &eva, |all| !all.is_empty()).await;
    let asked =
        || wishes.lock().unwrap().iter().filter_map(|wish| wish["key_requests"].as_u64()).max().unwrap_or(0);
    let before = asked();
    let good = camera.next();
    for junk in [Vec::new(), vec![0; 7], vec![0xff; 5000], good[..good.len() - 1].to_vec(), vec![0; 300_000]]
    {
        send(&drone, junk, &encoding()).await;
    }
    send(&drone, good.clone(), "application/octet-stream;schema=sereno/Video/0000000000000000").await;
    until("six that are no video", async || list(&eva).await["refused"] == 6).await;
    // One picture is lost (it came as another layout): what follows waits for a key frame, which is asked for.
    camera.send(&drone, 1).await;
    until("a key frame is asked for", async || asked() > before).await;
    camera.send(&drone, 90).await;
    stop(&eva).await;
    let all = recordings(&eva).await;
    assert_eq!(all.len(), 1, "{all:?}");
    let bytes = eva.get(&path_of(&all[0])).await.bytes;
    assert!(read(&bytes).0 >= 60);
    drop(bench);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_disk_that_is_nearly_full_and_a_console_that_keeps_nothing_say_so() {
    let (bench, eva, _drone) = rig(RecordingConfig { free_gib: 1_000_000, ..KEEPS }).await;
    let refused = eva.post("/api/drones/north/recordings", &json!({})).await;
    assert_eq!(refused.status, 507);
    assert!(refused.text.contains("less than the 1000000 GiB to be left free"), "{}", refused.text);
    let marked = eva.post("/api/drones/north/incidents", &json!({ "text": "smoke" })).await;
    assert_eq!(
        (marked.status, &marked.json()["pictures"]),
        (201, &json!(false)),
        "the incident itself is kept"
    );
    assert!(list(&eva).await["now"]["trouble"].as_str().unwrap().contains("GiB free"));
    drop(bench);

    let (bench, eva, _drone) = rig(RecordingConfig::default()).await;
    let session = eva.get("/api/session").await.json();
    assert_eq!(session["recording"], json!({ "keeps": false, "reason": "this console keeps no pictures" }));
    let refused = eva.post("/api/drones/north/recordings", &json!({})).await;
    assert_eq!((refused.status, refused.json()), (409, json!({ "error": "this console keeps no pictures" })));
    assert_eq!(list(&eva).await["keeps"], false);
    let marked = eva.post("/api/drones/north/incidents", &json!({ "text": "smoke" })).await;
    assert_eq!((marked.status, marked.json().get("pictures")), (201, None));
    assert!(!bench.config.data.join("recordings").exists());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_survives_a_console_that_is_killed() {
    let mut bench = Bench::new(1).await;
    let drone = bench.drone(0, "north").await;
    bench.console = None;
    let file = bench.folder.path().join("console.toml");
    let text = "data = \"data\"\n[https]\nlisten = \"127.0.0.1:0\"\ncertificate = \"https.pem\"\nkey = \"https.key\"\n\
         connections = 64\nconnections_an_address = 64\n[zenoh]\nclient = \"console.json5\"\n\
         [session]\nidle_min = 60\nabsolute_h = 12\n[recording]\nenabled = true\n";
    std::fs::write(&file, text).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_sereno-console"))
        .arg("--config")
        .arg(&file)
        .stdout(Stdio::piped())
        .spawn()
        .map(Killed)
        .unwrap();
    let mut lines = BufReader::new(child.0.stdout.take().unwrap()).lines();
    let address = lines.next().unwrap().unwrap();
    let address = address.strip_prefix("the watch room: https://").unwrap().trim_end_matches('/').to_owned();
    let claim = lines.next().unwrap().unwrap();
    let mut eva = Client::new(address.parse().unwrap(), &bench.authority.pem);
    let body = json!({ "code": claim.rsplit(' ').next().unwrap(), "name": "Eva", "surname": "Sanz", "email": "eva@example.org",
        "password": common::PASSWORD });
    let claimed = eva.post("/api/claim", &body).await;
    assert_eq!(claimed.status, 200, "{}", claimed.text);
    eva.take_cookie(&claimed);
    bench.sees(&eva, "north", true).await;
    start(&eva).await;
    let mut camera = Camera::new(SMALL);
    film_until("a file", &mut camera, &drone, &eva, |all| !all.is_empty()).await;
    camera.send(&drone, 100).await;
    until("some seconds are on the disk", async || {
        let open = recordings(&eva).await[0].clone();
        read(&eva.get(&path_of(&open)).await.bytes).0 >= 75
    })
    .await;
    drop(child);

    bench.config.recording = KEEPS;
    // The clock of the killed one was the system's.
    let now_ms =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_millis() as u64;
    bench.clock.0.store(now_ms, std::sync::atomic::Ordering::SeqCst);
    bench.restart().await;
    let eva = bench.log_in("eva@example.org").await;
    let all = recordings(&eva).await;
    assert_eq!(all.len(), 1);
    assert!(all[0]["ended_ms"].is_u64(), "{all:?}");
    let bytes = eva.get(&path_of(&all[0])).await.bytes;
    assert_eq!(all[0]["bytes"], bytes.len());
    let (frames, _, length_ms) = read(&bytes);
    assert!(frames >= 75, "{frames}");
    assert_eq!(all[0]["ended_ms"].as_u64().unwrap() - all[0]["started_ms"].as_u64().unwrap(), length_ms);
}
