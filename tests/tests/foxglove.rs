//! `sereno foxglove`: from a flying system over mutual TLS to whatever speaks Foxglove's WebSocket on this machine.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

#[path = "bridge/system.rs"]
#[allow(dead_code, reason = "the tests of the bridge need more of it")]
mod system;

use foxglove::Decode;
use foxglove::messages::{CompressedVideo, FrameTransform, Grid, PoseInFrame, PosesInFrame, SceneUpdate};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use sereno_tests::{checkout, programs};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;
use system::{System, Way, free_endpoint, wait_until};
use tokio::net::TcpStream;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error, Message};

/// Whoever waits this long waits in vain, on a loaded machine too.
const LONG: Duration = Duration::from_secs(120);

/// `sereno foxglove`, ended with the test.
struct Passing {
    program: Child,
    says: BufReader<ChildStdout>,
}

impl Passing {
    fn start(system: &System, words: &[&str]) -> Self {
        let mut program = Command::new(programs().join("sereno"))
            .arg("--remote")
            .arg(system.authority.client_config("viewer"))
            .args(["--json", "foxglove"])
            .args(words)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let says = BufReader::new(program.stdout.take().unwrap());
        Self { program, says }
    }

    /// The next line that it prints.
    fn line(&mut self) -> Value {
        let mut line = String::new();
        self.says.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line:?}"))
    }

    /// Ends it as Ctrl-C does: what it counted, and what it had to say meanwhile.
    fn end(mut self) -> (Value, String) {
        let pid = rustix::process::Pid::from_child(&self.program);
        rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
        let counted = self.line();
        let mut complaints = String::new();
        self.program.stderr.take().unwrap().read_to_string(&mut complaints).unwrap();
        assert!(self.program.wait().unwrap().success(), "{complaints}");
        (counted, complaints)
    }
}

impl Drop for Passing {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// An app: channels by topic, subscribed by name.
struct App {
    socket: WebSocketStream<TcpStream>,
    channels: BTreeMap<String, Value>,
    names: Vec<String>,
}

/// A message of a channel.
struct Shown {
    topic: String,
    time_ns: u64,
    bytes: Vec<u8>,
}

/// Shakes hands as a page of this origin does, or as a program, which has none.
async fn shake(url: &str, origin: Option<&str>) -> Result<WebSocketStream<TcpStream>, Error> {
    let stream = TcpStream::connect(url.strip_prefix("ws://").unwrap()).await.unwrap();
    let mut request = url.into_client_request().unwrap();
    request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().unwrap());
    if let Some(origin) = origin {
        request.headers_mut().insert("origin", origin.parse().unwrap());
    }
    Ok(tokio_tungstenite::client_async(request, stream).await?.0)
}

impl App {
    async fn connect(url: &str, origin: Option<&str>) -> Self {
        let socket = shake(url, origin).await.unwrap();
        let mut app = Self { socket, channels: BTreeMap::new(), names: Vec::new() };
        let mut greeted = false;
        while app.channels.is_empty() {
            let said = app.text().await;
            if said["op"] == "serverInfo" {
                assert_eq!(said["name"], "Sereno: sereno-1");
                assert_eq!(said["capabilities"], json!([]), "nothing comes in by it");
                greeted = true;
            }
            for channel in said["channels"].as_array().into_iter().flatten() {
                app.channels.insert(channel["topic"].as_str().unwrap().to_owned(), channel.clone());
            }
        }
        assert!(greeted);
        app
    }

    async fn next(&mut self) -> Message {
        self.socket.next().await.expect("it stays connected").unwrap()
    }

    async fn text(&mut self) -> Value {
        loop {
            if let Message::Text(text) = self.next().await {
                return serde_json::from_str(&text).unwrap();
            }
        }
    }

    async fn say(&mut self, words: &Value) {
        self.socket.send(Message::text(words.to_string())).await.unwrap();
    }

    async fn subscribe(&mut self, topics: &[&str]) {
        let asked: Vec<_> = topics
            .iter()
            .map(|topic| {
                self.names.push((*topic).to_owned());
                json!({ "id": self.names.len() - 1, "channelId": self.channels[*topic]["id"] })
            })
            .collect();
        self.say(&json!({ "op": "subscribe", "subscriptions": asked })).await;
    }

    async fn subscribe_all(&mut self) {
        let topics: Vec<_> = self.channels.keys().cloned().collect();
        self.subscribe(&topics.iter().map(String::as_str).collect::<Vec<_>>()).await;
    }

    /// The next message of any channel.
    async fn message(&mut self) -> Shown {
        loop {
            let Message::Binary(bytes) = self.next().await else { continue };
            if bytes.first() == Some(&1) {
                let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap()) as usize;
                let time_ns = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
                let topic = self.names[subscription].clone();
                return Shown { topic, time_ns, bytes: bytes[13..].to_vec() };
            }
        }
    }
}

/// Types of the units in an H.264 access unit.
fn units(data: &[u8]) -> Vec<u8> {
    data.windows(4).filter(|window| window[..3] == [0, 0, 1]).map(|window| window[3] & 31).collect()
}

/// Whether a decoder can begin with this: it has a sequence parameter set.
fn is_key(bytes: &[u8]) -> bool {
    let frame = CompressedVideo::decode(bytes).unwrap();
    assert_eq!(frame.format, "h264");
    units(&frame.data).contains(&7)
}

/// Where a pose is.
fn place(bytes: &[u8]) -> (f64, f64) {
    let shown = PoseInFrame::decode(bytes).unwrap();
    assert_eq!(shown.frame_id, "plan");
    let position = shown.pose.unwrap().position.unwrap();
    (position.x, position.y)
}

/// Every topic that the shipped layout names, with the field if it names one.
fn topics_of_the_layout() -> Vec<String> {
    let text = std::fs::read_to_string(checkout().join("deploy/foxglove/sereno.json")).unwrap();
    let layout: Value = serde_json::from_str(&text).unwrap();
    let mut topics = Vec::new();
    for panel in layout["configById"].as_object().unwrap().values() {
        topics.extend(panel["topics"].as_object().into_iter().flatten().map(|(topic, _)| topic.clone()));
        let paths = panel["paths"].as_array().into_iter().flatten().map(|path| &path["value"]);
        let single = [&panel["topicPath"], &panel["imageMode"]["imageTopic"]];
        topics.extend(paths.chain(single).filter_map(Value::as_str).map(str::to_owned));
    }
    topics
}

/// Whether a path of the layout, `/topic.field`, leads somewhere.
fn leads_somewhere(app: &App, path: &str) -> bool {
    let (topic, field) = path.split_once('.').unwrap_or((path, ""));
    let Some(channel) = app.channels.get(topic) else { return false };
    let schema: Value = serde_json::from_str(channel["schema"].as_str().unwrap()).unwrap_or_default();
    field.is_empty() || schema["properties"][field]["type"].is_string()
}

#[test]
fn an_app_on_this_machine_sees_the_drone_fly() {
    let endpoint = free_endpoint();
    let system = System::start(Way::Direct, &endpoint);
    system.wait_bridge(&endpoint);
    refuses(&system);

    let mut passing = Passing::start(&system, &["--port", "0", "--origin", "http://viewer.example:8080"]);
    let said = passing.line();
    let url = said["url"].as_str().unwrap().to_owned();
    assert!(url.starts_with("ws://127.0.0.1:"), "{url}");
    assert_eq!(said["origins"], json!(["https://app.foxglove.dev", "file://", "http://viewer.example:8080"]));
    let port = url.rsplit(':').next().unwrap();
    let taken = system.remote("viewer", &["foxglove", "--port", port]);
    let text = String::from_utf8_lossy(&taken.stderr).into_owned();
    assert!(!taken.status.success() && text.contains(port) && text.contains("--port"), "{text}");

    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        within("doors", only_its_own_pages_come_in(&url)).await;
        let mut app = App::connect(&url, Some("file://")).await;
        layout_and_schemas_hold(&app);
        within("refusals", nothing_comes_in(&mut app)).await;
        let mut stalled = App::connect(&url, None).await;
        stalled.subscribe_all().await;
        within("flight", it_flies(&mut app, &system)).await;
        within("a second app", a_late_app_sees_plan_and_picture(&url)).await;
        within("a stalled app", who_does_not_read_loses_messages(&mut app, &mut stalled)).await;
        within("silence", silence_is_said(&mut app, &system)).await;
    });
    let (counted, complaints) = passing.end();
    assert!(counted["passed"].as_u64().unwrap() > 100, "{counted}");
    assert_eq!(counted["not_understood"], 0, "{complaints}");
    let lost = counted["lost"].as_u64().unwrap();
    assert!(
        lost * 20 < counted["passed"].as_u64().unwrap(),
        "one app stood still, and the drone was heard: {counted}"
    );
    for words in ["sereno-1 is silent", "sereno-1 is heard again", "https://evil.example"] {
        assert_eq!(complaints.matches(words).count(), 1, "{words}: {complaints}");
    }
}

async fn within<T>(what: &str, done: impl Future<Output = T>) -> T {
    tokio::time::timeout(LONG, done).await.unwrap_or_else(|_| panic!("in vain: {what}"))
}

/// What is refused before anything is shown.
fn refuses(system: &System) {
    let alone = system.sereno(&["foxglove"]);
    assert!(!alone.status.success() && String::from_utf8_lossy(&alone.stderr).contains("--remote"));
    for words in [["--origin", "null"], ["--origin", "*"], ["--address", "0.0.0.0"], ["--port", "65536"]] {
        let refused = system.remote("viewer", &["foxglove", words[0], words[1]]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success() && said.contains(words[0]), "{said}");
    }
    let stranger = system.remote("revoked", &["foxglove", "--port", "0"]);
    assert!(!stranger.status.success() && stranger.stdout.is_empty());
}

/// A page of strangers that this machine's browser has open cannot watch.
async fn only_its_own_pages_come_in(url: &str) {
    for stranger in ["https://evil.example", "null", "http://localhost:8080"] {
        match shake(url, Some(stranger)).await {
            Err(Error::Http(answer)) => assert_eq!(answer.status(), 403, "{stranger}"),
            other => panic!("{stranger}: {other:?}"),
        }
    }
    for known in [None, Some("https://app.foxglove.dev"), Some("http://viewer.example:8080")] {
        assert!(!App::connect(url, known).await.channels.is_empty());
    }
}

fn layout_and_schemas_hold(app: &App) {
    let named = topics_of_the_layout();
    assert!(named.len() > 10, "{named:?}");
    for path in named {
        assert!(leads_somewhere(app, &path), "the layout shows {path}, which nobody sends");
    }
    assert!(!leads_somewhere(app, "/localization/pose.nothing") && !leads_somewhere(app, "/nothing"));
    for (topic, schema, encoding) in [
        ("/pose", "foxglove.PoseInFrame", "protobuf"),
        ("/frames", "foxglove.FrameTransform", "protobuf"),
        ("/uncertainty", "foxglove.SceneUpdate", "protobuf"),
        ("/particles", "foxglove.PosesInFrame", "protobuf"),
        ("/plan", "foxglove.Grid", "protobuf"),
        ("/certainty", "foxglove.Grid", "protobuf"),
        ("/sonar", "foxglove.SceneUpdate", "protobuf"),
        ("/round", "foxglove.SceneUpdate", "protobuf"),
        ("/video", "foxglove.CompressedVideo", "protobuf"),
        ("/pilot/state", "sereno.PilotState", "json"),
    ] {
        let channel = &app.channels[topic];
        assert_eq!(
            (&channel["schemaName"], &channel["encoding"]),
            (&json!(schema), &json!(encoding)),
            "{topic}"
        );
    }
    for bytes in ["/camera/video", "/localization/particles", "/navigation/grid"] {
        assert!(!app.channels.contains_key(bytes), "{bytes} has its well-known form only");
    }
}

/// Whatever would come in is refused.
async fn nothing_comes_in(app: &mut App) {
    for words in [
        json!({ "op": "advertise", "channels": [{ "id": 1, "topic": "/operator/command", "encoding": "json", "schemaName": "" }] }),
        json!({ "op": "getParameters", "parameterNames": [], "id": "1" }),
        json!({ "op": "setParameters", "parameters": [{ "name": "a", "value": 1 }], "id": "2" }),
        json!({ "op": "fetchAsset", "uri": "file:///etc/passwd", "requestId": 3 }),
        json!({ "op": "subscribeConnectionGraph" }),
        json!({ "op": "what is this" }),
    ] {
        app.say(&words).await;
        let said = app.text().await;
        assert_eq!((&said["op"], &said["level"]), (&json!("status"), &json!(2)), "{words}: {said}");
    }
}

/// On its pad, then on its round: what is shown is what it says, and moves.
async fn it_flies(app: &mut App, system: &System) {
    let wanted = [
        "/pose",
        "/localization/pose",
        "/frames",
        "/uncertainty",
        "/particles",
        "/plan",
        "/certainty",
        "/sonar",
        "/round",
        "/video",
        "/pilot/state",
    ];
    app.subscribe(&wanted).await;
    let now_ns = || std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64;
    // Of deploy/plans/two-rooms.rooms.yaml.
    let pad = (1.9, 3.3);
    let (mut first, mut said) = (BTreeMap::new(), BTreeMap::new());
    let (mut key, mut compared, mut farthest, mut ordered) = (false, 0, 0.0_f64, false);
    while first.len() < wanted.len() || !key || compared < 20 || farthest < 1.0 {
        let Shown { topic, time_ns, bytes } = app.message().await;
        assert!(now_ns().abs_diff(time_ns) < LONG.as_nanos() as u64, "{topic}: on this machine's clock");
        match topic.as_str() {
            "/localization/pose" => {
                let pose: Value = serde_json::from_slice(&bytes).unwrap();
                said.insert(time_ns, (pose["x_m"].as_f64().unwrap(), pose["y_m"].as_f64().unwrap()));
            }
            "/pose" => {
                let (x, y) = place(&bytes);
                let away = (x - pad.0).hypot(y - pad.1);
                assert!(ordered || away < 0.4, "it stands on its pad, not at {x} {y}");
                farthest = farthest.max(away);
                if let Some(said) = said.get(&time_ns) {
                    assert!((x - said.0).hypot(y - said.1) < 1e-9, "{x} {y}: {said:?}");
                    compared += 1;
                }
                if !ordered {
                    start_round(system);
                    ordered = true;
                }
            }
            "/video" => key |= is_key(&bytes),
            _ => {}
        }
        first.entry(topic).or_insert(bytes);
    }
    let frame = FrameTransform::decode(first["/frames"].as_slice()).unwrap();
    assert_eq!((frame.parent_frame_id.as_str(), frame.child_frame_id.as_str()), ("plan", "drone"));
    let cloud = PosesInFrame::decode(first["/particles"].as_slice()).unwrap().poses;
    assert!((100..=1000).contains(&cloud.len()), "{}", cloud.len());
    let plan = Grid::decode(first["/plan"].as_slice()).unwrap();
    let rows = plan.data.len() / plan.row_stride as usize;
    assert!(rows > 10 && plan.column_count > 10 && plan.data.contains(&0) && plan.data.contains(&255));
    assert_eq!(Grid::decode(first["/certainty"].as_slice()).unwrap().column_count, 81);
    for drawn in ["/sonar", "/uncertainty", "/round"] {
        SceneUpdate::decode(first[drawn].as_slice()).unwrap();
    }
    assert!(serde_json::from_slice::<Value>(&first["/pilot/state"]).unwrap()["phase"].is_u64());
}

/// Orders the round, again while the pilot is not ready.
fn start_round(system: &System) {
    wait_until("the round starts", || system.remote("guard", &["patrol", "start"]).status.success());
}

/// Who comes later is shown the plan, too, and a picture that a decoder can begin with.
async fn a_late_app_sees_plan_and_picture(url: &str) {
    let mut late = App::connect(url, None).await;
    late.subscribe(&["/plan", "/video"]).await;
    let (mut plan, mut key) = (false, false);
    while !(plan && key) {
        let shown = late.message().await;
        match shown.topic.as_str() {
            "/plan" => plan = true,
            _ => key |= is_key(&shown.bytes),
        }
    }
}

/// Sequence of the next pose.
async fn sequence(app: &mut App) -> u64 {
    loop {
        let shown = app.message().await;
        if shown.topic == "/localization/pose" {
            let pose: Value = serde_json::from_slice(&shown.bytes).unwrap();
            return pose["header"]["sequence"].as_u64().unwrap();
        }
    }
}

/// Poses that go by while one app does not read: with what the flight took, some megabytes more than the system buffers.
const POSES_MISSED: usize = 300;

/// An app that has not read for a while missed more than a second of poses, twenty a second, and goes on with newer ones; the
/// others were shown what came.
async fn who_does_not_read_loses_messages(app: &mut App, stalled: &mut App) {
    let mut newest = 0;
    for _ in 0..POSES_MISSED {
        newest = sequence(app).await;
    }
    let mut last = sequence(stalled).await;
    let mut widest = 0;
    while last < newest {
        let next = sequence(stalled).await;
        widest = widest.max(next - last);
        last = next;
    }
    assert!(widest > 20, "it was never more than {widest} poses behind, so this shows nothing");
}

/// A bridge that is gone is said to be, and is followed again when it is back.
async fn silence_is_said(app: &mut App, system: &System) {
    assert!(system.sereno(&["hold", "bridge"]).status.success());
    loop {
        let said = app.text().await;
        if said["op"] == "status" {
            assert_eq!((&said["id"], &said["level"]), (&json!("silent"), &json!(1)), "{said}");
            break;
        }
    }
    let gone_ns = std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64;
    assert!(system.sereno(&["release", "bridge"]).status.success());
    loop {
        let said = app.text().await;
        if said["op"] == "removeStatus" {
            assert_eq!(said["statusIds"], json!(["silent"]), "{said}");
            break;
        }
    }
    loop {
        let shown = app.message().await;
        if shown.topic == "/pose" && shown.time_ns > gone_ns {
            break;
        }
    }
}
