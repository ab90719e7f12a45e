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
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use system::{System, Way, free_endpoint};
use tokio::net::TcpStream;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

/// Whoever waits this long waits in vain.
const LONG: Duration = Duration::from_secs(60);

/// `sereno foxglove`, ended with the test.
struct Passing(Child);

impl Drop for Passing {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An app: channels by topic, subscribed by name.
struct App {
    socket: WebSocketStream<TcpStream>,
    channels: BTreeMap<String, Value>,
    names: Vec<String>,
}

impl App {
    async fn connect(url: &str) -> Self {
        let stream = TcpStream::connect(url.strip_prefix("ws://").unwrap()).await.unwrap();
        let mut request = url.into_client_request().unwrap();
        request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().unwrap());
        let (socket, _) = tokio_tungstenite::client_async(request, stream).await.unwrap();
        let mut app = Self { socket, channels: BTreeMap::new(), names: Vec::new() };
        while app.channels.is_empty() {
            let Message::Text(text) = app.next().await else { continue };
            let said: Value = serde_json::from_str(&text).unwrap();
            if said["op"] == "serverInfo" {
                assert_eq!(said["name"], "Sereno: sereno-1");
                assert_eq!(said["capabilities"], json!([]), "nothing comes in by it");
            }
            for channel in said["channels"].as_array().into_iter().flatten() {
                app.channels.insert(channel["topic"].as_str().unwrap().to_owned(), channel.clone());
            }
        }
        app
    }

    async fn next(&mut self) -> Message {
        tokio::time::timeout(LONG, self.socket.next()).await.expect("something comes").unwrap().unwrap()
    }

    async fn subscribe(&mut self, topics: &[&str]) {
        let asked: Vec<_> = topics
            .iter()
            .map(|topic| {
                self.names.push((*topic).to_owned());
                json!({ "id": self.names.len() - 1, "channelId": self.channels[*topic]["id"] })
            })
            .collect();
        let text = json!({ "op": "subscribe", "subscriptions": asked }).to_string();
        self.socket.send(Message::text(text)).await.unwrap();
    }

    /// The next message of any channel: topic, time, bytes.
    async fn message(&mut self) -> (String, u64, Vec<u8>) {
        loop {
            let Message::Binary(bytes) = self.next().await else { continue };
            if bytes.first() == Some(&1) {
                let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap()) as usize;
                let time_ns = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
                return (self.names[subscription].clone(), time_ns, bytes[13..].to_vec());
            }
        }
    }
}

/// Types of the units in an H.264 access unit.
fn units(data: &[u8]) -> Vec<u8> {
    data.windows(4).filter(|window| window[..3] == [0, 0, 1]).map(|window| window[3] & 31).collect()
}

/// Every topic that the shipped layout names.
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
fn an_app_on_this_machine_sees_the_drone() {
    let endpoint = free_endpoint();
    let system = System::start(Way::Direct, &endpoint);
    system.wait_bridge(&endpoint);

    let refused = system.remote("viewer", &["foxglove", "--port", "0", "--address", "0.0.0.0"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("--everybody-may-watch"), "{said}");
    let alone = system.sereno(&["foxglove"]);
    assert!(!alone.status.success() && String::from_utf8_lossy(&alone.stderr).contains("--remote"));

    let mut passing = Command::new(programs().join("sereno"))
        .arg("--remote")
        .arg(system.authority.client_config("viewer"))
        .args(["--json", "foxglove", "--port", "0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map(Passing)
        .unwrap();
    let mut line = String::new();
    BufReader::new(passing.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let said: Value = serde_json::from_str(&line).unwrap();
    let url = said["url"].as_str().unwrap().to_owned();
    assert!(url.starts_with("ws://127.0.0.1:"), "{url}");

    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(look(&url));

    let pid = rustix::process::Pid::from_child(&passing.0);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
    assert!(passing.0.wait().unwrap().success());
}

async fn look(url: &str) {
    let mut app = App::connect(url).await;
    for path in topics_of_the_layout() {
        assert!(leads_somewhere(&app, &path), "the layout shows {path}, which nobody sends");
    }
    let schema = |topic: &str| app.channels[topic]["schemaName"].as_str().unwrap().to_owned();
    assert_eq!(
        (schema("/pose").as_str(), schema("/pilot/state").as_str()),
        ("foxglove.PoseInFrame", "sereno.PilotState")
    );
    assert!(!app.channels.contains_key("/sim/truth.bytes") && !app.channels.contains_key("/camera/video"));

    let wanted = [
        "/pose",
        "/frames",
        "/uncertainty",
        "/particles",
        "/plan",
        "/certainty",
        "/sonar",
        "/video",
        "/pilot/state",
    ];
    app.subscribe(&wanted).await;
    let mut first = BTreeMap::new();
    let mut key = None;
    let now_ns = || std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64;
    while first.len() < wanted.len() || key.is_none() {
        let (topic, time_ns, bytes) = app.message().await;
        assert!(now_ns().abs_diff(time_ns) < LONG.as_nanos() as u64, "{topic}: on this machine's clock");
        if topic == "/video" {
            let frame = CompressedVideo::decode(bytes.as_slice()).unwrap();
            assert_eq!(frame.format, "h264");
            key = key.or_else(|| units(&frame.data).contains(&7).then_some(()));
        }
        first.entry(topic).or_insert(bytes);
    }
    let pose = PoseInFrame::decode(first["/pose"].as_slice()).unwrap();
    let place = pose.pose.unwrap().position.unwrap();
    // It stands on the pad of deploy/plans/two-rooms.rooms.yaml.
    let pad = (1.9, 3.3);
    assert_eq!(pose.frame_id, "plan");
    assert!((place.x - pad.0).hypot(place.y - pad.1) < 0.4, "{place:?}");
    let frame = FrameTransform::decode(first["/frames"].as_slice()).unwrap();
    assert_eq!((frame.parent_frame_id.as_str(), frame.child_frame_id.as_str()), ("plan", "drone"));
    let cloud = PosesInFrame::decode(first["/particles"].as_slice()).unwrap().poses;
    assert!((100..=1000).contains(&cloud.len()), "{}", cloud.len());
    let plan = Grid::decode(first["/plan"].as_slice()).unwrap();
    let rows = plan.data.len() / plan.row_stride as usize;
    assert!(rows > 10 && plan.column_count > 10 && plan.data.contains(&0) && plan.data.contains(&255));
    assert_eq!(Grid::decode(first["/certainty"].as_slice()).unwrap().column_count, 81);
    assert!(SceneUpdate::decode(first["/sonar"].as_slice()).is_ok());
    assert!(serde_json::from_slice::<Value>(&first["/pilot/state"]).unwrap()["phase"].is_u64());

    // Who comes later is shown the plan, too, and a picture that a decoder can begin with.
    let mut second = App::connect(url).await;
    second.subscribe(&["/plan", "/video"]).await;
    let (mut seen, mut key) = (false, false);
    while !(seen && key) {
        let (topic, _, bytes) = second.message().await;
        match topic.as_str() {
            "/plan" => seen = true,
            _ => key |= units(&CompressedVideo::decode(bytes.as_slice()).unwrap().data).contains(&7),
        }
    }
}
