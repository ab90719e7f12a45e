//! Nonsense, floods and slow readers: a clear message or the end of that one connection, and the others go on.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use axum::body::{Body, Bytes};
use common::client::{Client, answer, closed, hear, say};
use common::{Bench, until};
use console::table::ROUTES;
use futures_util::{SinkExt, StreamExt, stream};
use serde_json::json;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_tungstenite::tungstenite::Message;

/// The page still answers, and an order still reaches the drone.
async fn all_is_well(eva: &Client, id: u64) {
    assert_eq!(eva.get("/api/session").await.status, 200);
    let mut socket = eva.open("/ws/telemetry?drone=north").await.unwrap();
    say(&mut socket, &json!({ "order": { "id": id, "verb": "hold" } })).await;
    assert_eq!(answer(&mut socket, id).await["accepted"], true);
}

#[tokio::test(flavor = "multi_thread")]
async fn junk_on_every_socket_is_told_so_and_reaches_no_drone() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let deep = "[".repeat(20_000);
    let junk = [
        "",
        "{",
        "null",
        "[]",
        "42",
        "\"x\"",
        "\u{0}",
        "{\"order\":7}",
        "{\"order\":{\"id\":-1,\"verb\":\"land\"}}",
        "{\"order\":{\"id\":1,\"verb\":\"land\",\"role\":\"administrator\"}}",
        "{\"subscribe\":\"**\"}",
        "{\"subscribe\":[\"**\"]}",
        "{\"subscribe\":[\"../../x\"]}",
        "{\"subscribe\":[7]}",
        "{\"x\":1e999}",
        deep.as_str(),
    ];
    for path in ROUTES.iter().filter(|route| route.is_socket()).map(|route| route.path) {
        let mut socket = eva.open(&format!("{path}?drone=north")).await.unwrap();
        let mut told = 0;
        for text in junk {
            // What is a JSON object is the drone's to judge.
            if path == "/ws/signal" && text.starts_with("{\"") {
                continue;
            }
            socket.send(Message::text(text)).await.unwrap();
            let error = hear(&mut socket, |value| value["error"].as_str().map(str::to_owned)).await;
            assert!(error.len() < 400, "{error}");
            told += 1;
        }
        assert!(told >= 8, "{path}");
        socket.send(Message::binary(vec![0xff; 100])).await.unwrap();
        assert_eq!(closed(&mut socket).await, Some(1008), "{path}: bytes");
        let mut socket = eva.open(&format!("{path}?drone=north")).await.unwrap();
        socket.send(Message::text("x".repeat(64 * 1024 + 1))).await.unwrap();
        closed(&mut socket).await;
        let mut socket = eva.open(&format!("{path}?drone=north")).await.unwrap();
        let flood = async {
            for _ in 0..2000 {
                if socket.send(Message::text("{}")).await.is_err() {
                    return;
                }
            }
        };
        flood.await;
        closed(&mut socket).await;
    }
    assert!(drone.orders().is_empty() && drone.heard.lock().unwrap().sticks.is_empty());
    all_is_well(&eva, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn sixty_four_mebibytes_are_not_taken() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let _drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let before = resident_kib();
    let huge = vec![b' '; 64 << 20];
    for path in ["/ws/telemetry?drone=north", "/ws/sticks?drone=north", "/ws/signal?drone=north"] {
        let mut socket = eva.open(path).await.unwrap();
        // The server hangs up in the middle.
        let _ = socket.send(Message::text(String::from_utf8(huge.clone()).unwrap())).await;
        closed(&mut socket).await;
    }
    drop(huge);
    // As one body, and as one that does not say how long it is.
    let chunk = Bytes::from(vec![b' '; 64 * 1024]);
    let endless = stream::iter((0..1024).map(move |_| Ok::<_, std::io::Error>(chunk.clone())));
    let port = bench.console().address.port();
    let raw = format!(
        "POST /api/login HTTP/1.1\r\nhost: localhost:{port}\r\norigin: https://localhost:{port}\r\ncontent-length: 67108864\r\n\r\n"
    );
    let mut stream = eva.connect().await;
    stream.write_all(raw.as_bytes()).await.unwrap();
    let _ = stream.write_all(&vec![b' '; 1 << 20]).await;
    let mut start = [0; 12];
    stream.read_exact(&mut start).await.unwrap();
    assert_eq!(&start, b"HTTP/1.1 413");
    let status = tokio::spawn({
        let eva = eva.clone();
        async move { eva.send("POST", "/api/login", Body::from_stream(endless)).await.status }
    });
    // The answer, or a connection that is closed before all was sent.
    assert!(status.await.map_or(true, |status| status == 413));
    assert!(resident_kib() < before + 200 * 1024, "the test's own copies are most of it");
    all_is_well(&eva, 1).await;
}

fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// One page stops reading; 4 000 messages of 64 KiB (250 MiB) pass it by. The other page gets the last one, and memory grows
/// by no more than the slots, the kernel's buffers being the kernel's.
#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_does_not_read_costs_neither_memory_nor_the_others_time() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut stalled = eva.open("/ws/telemetry?drone=north").await.unwrap();
    let mut reading = eva.open("/ws/telemetry?drone=north").await.unwrap();
    for socket in [&mut stalled, &mut reading] {
        say(socket, &json!({ "subscribe": ["navigation/grid"] })).await;
    }
    // Both are subscribed when both have heard something.
    for socket in [&mut stalled, &mut reading] {
        let mut every = tokio::time::interval(Duration::from_millis(50));
        loop {
            tokio::select! {
                message = socket.next() => if message.unwrap().unwrap().is_binary() { break },
                _ = every.tick() => drone.say_bytes("navigation/grid", vec![0; 16]).await,
            }
        }
    }
    let sent = 4_000_u32;
    let reader = tokio::spawn(async move {
        let mut seen = Vec::new();
        loop {
            let message = reading.next().await.unwrap().unwrap();
            if let Message::Binary(bytes) = message
                && bytes.len() > 100
            {
                let number = u32::from_le_bytes(bytes[16..20].try_into().unwrap());
                seen.push(number);
                if number == sent {
                    return seen;
                }
            }
        }
    });
    let before = resident_kib();
    let mut most = before;
    for k in 1..=sent {
        let mut bytes = k.to_le_bytes().to_vec();
        bytes.resize(64 * 1024, 7);
        drone.say_bytes("navigation/grid", bytes).await;
        if k % 100 == 0 {
            most = most.max(resident_kib());
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
    // Zenoh may have dropped the last one: say it until it is heard.
    let mut last = sent.to_le_bytes().to_vec();
    last.resize(64 * 1024, 7);
    let began = Instant::now();
    until("the reading page has the newest", async || {
        drone.say_bytes("navigation/grid", last.clone()).await;
        reader.is_finished()
    })
    .await;
    assert!(began.elapsed() < Duration::from_secs(10));
    let seen = reader.await.unwrap();
    assert!(seen.windows(2).all(|pair| pair[0] <= pair[1]), "never out of order");
    assert!(seen.len() > 50, "{}", seen.len());
    assert!(most < before + 60 * 1024, "grew from {before} to {most} KiB");
    // The stalled page can still say stop.
    say(&mut stalled, &json!({ "order": { "id": 1, "verb": "stop" } })).await;
    until("its stop", async || drone.orders().iter().any(|(key, _)| key.contains("/stop/"))).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_are_bounded_and_those_that_say_nothing_are_closed() {
    let mut bench = Bench::new(0).await;
    bench.config.https.connections = 12;
    bench.config.https.connections_an_address = 8;
    bench.restart().await;
    let client = bench.client();
    let mut idle = Vec::new();
    for _ in 0..8 {
        idle.push(tokio::net::TcpStream::connect(client.address).await.unwrap());
    }
    // All places of this address are taken: the ninth is hung up on.
    let mut ninth = tokio::net::TcpStream::connect(client.address).await.unwrap();
    let closed = tokio::time::timeout(Duration::from_secs(5), ninth.read(&mut [0; 1])).await;
    assert!(matches!(closed, Ok(Ok(0) | Err(_))));
    // Without a handshake they are closed after ten seconds, and there is room again.
    let began = Instant::now();
    let closed = tokio::time::timeout(Duration::from_secs(20), idle[0].read(&mut [0; 1])).await;
    assert!(matches!(closed, Ok(Ok(0) | Err(_))));
    assert!(began.elapsed() > Duration::from_secs(5));
    drop(idle);
    until("there is room again", async || {
        let again = client.clone();
        tokio::spawn(async move { again.get("/api/session").await.status })
            .await
            .is_ok_and(|status| status == 200)
    })
    .await;
}
