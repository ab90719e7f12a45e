//! Junk on the signal path: sentences, ended sessions, and the process stays as it was.
//!
//! Needs the programs of a release build.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod drone;

use drone::Drone;
use serde_json::{Value, json};

const CALL: &str = r#"{"call":{"width":320,"height":240,"fps":15,"mode":"watch"}}"#;

fn sdp(lines: &[&str]) -> String {
    lines.iter().map(|line| format!("{line}\r\n")).collect()
}

/// Answers that are none, each a mutilation that parsers have stumbled over.
fn answers() -> Vec<String> {
    let head = ["v=0", "o=- 1 2 IN IP4 127.0.0.1", "s=-", "t=0 0"];
    let with = |more: &[&str]| sdp(&[&head[..], more].concat());
    let media = "m=video 9 UDP/TLS/RTP/SAVPF 102";
    let secrets = ["a=ice-ufrag:abcd", "a=ice-pwd:abcdefghijklmnopqrstuvwx", "a=setup:active", "a=mid:0"];
    let fingerprint = format!("a=fingerprint:sha-256 {}", ["AB"; 32].join(":"));
    vec![
        String::new(),
        "v=0".to_owned(),
        "\u{0}\u{1}\u{2}".to_owned(),
        "v=1\r\n".repeat(1000),
        with(&[]),
        with(&[media]),
        with(&["m=video 99999999999 UDP/TLS/RTP/SAVPF 102"]),
        with(&["m=video 9 UDP/TLS/RTP/SAVPF 256 -1 x"]),
        with(&[&[media, "a=rtpmap:102 H264/90000"][..], &secrets].concat()),
        with(&[&[media, "a=rtpmap:102 H264/0", &fingerprint][..], &secrets].concat()),
        with(&[&[media, "a=rtpmap:102 VP8/90000", &fingerprint][..], &secrets].concat()),
        with(&[&[media, "a=fingerprint:sha-256 ZZ", "a=rtpmap:102 H264/90000"][..], &secrets].concat()),
        with(&[&[media, "a=fingerprint:md5 AB:CD", "a=extmap:0 x", "a=extmap:999 y"][..], &secrets].concat()),
        with(&[&[media, "a=ssrc:99999999999999 cname:x", "a=candidate:junk"][..], &secrets].concat()),
        with(&["m=audio 9 RTP/AVP 0", "m=application 9 UDP/DTLS/SCTP webrtc-datachannel"]),
        with(&[media; 300]),
        "a=".repeat(8000),
    ]
}

#[test]
fn junk_ends_its_own_session_at_most_and_the_process_stays() {
    let mut drone = Drone::start("");
    let kind = |value: &Value| value.as_object().unwrap().keys().next().unwrap().clone();
    for (number, text) in [
        "",
        "null",
        "[]",
        "{",
        "{}",
        "\"call\"",
        r#"{"call":null}"#,
        r#"{"call":{},"answer":{}}"#,
        r#"{"call":{"width":1e99,"height":480,"fps":30}}"#,
        r#"{"dance":{"\u0000":1}}"#,
        r#"{"answer":{"sdp":"v=0"}}"#,
        r#"{"candidate":{"candidate":"x"}}"#,
    ]
    .iter()
    .enumerate()
    {
        let session = format!("junk{number}");
        drone.say(&session, text);
        let heard = drone.hear(&session).unwrap_or_else(|| panic!("nothing is said to {text}"));
        assert_eq!(kind(&heard), "error", "{text}: {heard}");
    }
    let deep = format!("{}{}", "[".repeat(20_000), "]".repeat(20_000));
    drone.say("deep", &deep);
    assert_eq!(kind(&drone.hear("deep").unwrap()), "error");

    for (number, answer) in answers().into_iter().enumerate() {
        let session = format!("sdp{number}");
        drone.say(&session, CALL);
        while kind(&drone.hear(&session).expect("an offer")) != "offer" {}
        for candidate in
            ["", "candidate:", "candidate:1 1 udp 1 999.1.1.1 70000 typ host", "candidate:1 1 tcp x y z"]
        {
            drone.say(
                &session,
                &json!({ "candidate": { "candidate": candidate, "sdpMid": "9" } }).to_string(),
            );
        }
        drone.say(&session, &json!({ "answer": { "sdp": answer } }).to_string());
        drone.say(&session, r#"{"hang_up":{"reason":"enough"}}"#);
        // Its own junk, or the hang-up, ends it.
        loop {
            let heard = drone.hear(&session).unwrap_or_else(|| panic!("no end after {answer:?}"));
            if kind(&heard) == "hang_up" {
                break;
            }
        }
        assert!(drone.lives("stream"), "ended by {answer:?}");
    }
    // Too many candidates in one session.
    drone.say("flood", CALL);
    while kind(&drone.hear("flood").expect("an offer")) != "offer" {}
    for port in 0..70 {
        drone.say(
            "flood",
            &json!({ "candidate": { "candidate": format!("candidate:1 1 udp 1 10.0.0.1 {port} typ host") } })
                .to_string(),
        );
        let _ = drone.lives("stream");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let end = loop {
        let heard = drone.hear("flood").expect("an end");
        if kind(&heard) == "hang_up" {
            break heard;
        }
    };
    assert_eq!(end["hang_up"]["reason"], "more than 64 candidates");
    // And a good one is offered video as before.
    drone.say("good", CALL);
    assert_eq!(kind(&drone.hear("good").unwrap()), "offer");
    assert!(drone.lives("stream"));
}
