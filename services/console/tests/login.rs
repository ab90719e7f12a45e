//! Claiming, logging in and out, passwords, back-off, the log.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::{Bench, PASSWORD};
use console::{LONGEST_MS, Role};
use serde_json::json;
use std::time::Duration;

fn claim(code: &str, email: &str) -> serde_json::Value {
    json!({ "code": code, "name": "Eva", "surname": "Sanz", "email": email, "password": PASSWORD })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_console_is_claimed_once_with_the_newest_code() {
    let mut bench = Bench::new(0).await;
    let old = bench.console().claim.clone().unwrap();
    let before = bench.client().get("/api/session").await.json();
    assert_eq!((&before["claimed"], &before["account"]), (&json!(false), &json!(null)));
    bench.restart().await;
    let code = bench.console().claim.clone().unwrap();
    assert_ne!(code, old, "a fresh one each start");
    let client = bench.client();
    assert_eq!(client.post("/api/claim", &claim(&old, "a@example.org")).await.status, 403);
    assert_eq!(client.post("/api/claim", &claim("", "a@example.org")).await.status, 403);
    let again = console::claim_again(&bench.config).await.unwrap();
    assert_eq!(client.post("/api/claim", &claim(&code, "a@example.org")).await.status, 403);
    // Ten at the same time: one gets it.
    let claims = (0..10).map(|k| {
        let (client, body) = (bench.client(), claim(&again, &format!("{k}@example.org")));
        tokio::spawn(async move { client.post("/api/claim", &body).await.status })
    });
    let mut got = Vec::new();
    for claim in claims.collect::<Vec<_>>() {
        got.push(claim.await.unwrap());
    }
    assert_eq!(got.iter().filter(|status| **status == 200).count(), 1, "{got:?}");
    assert!(got.iter().all(|status| [200, 409].contains(status)), "{got:?}");
    assert_eq!(client.get("/api/session").await.json()["claimed"], true);
    assert!(console::claim_again(&bench.config).await.is_err());
    bench.restart().await;
    assert!(bench.console().claim.is_none());
    assert_eq!(bench.client().post("/api/claim", &claim(&again, "x@example.org")).await.status, 409);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_code_and_the_passwords_are_nowhere_in_the_files() {
    let bench = Bench::new(0).await;
    let code = bench.console().claim.clone().unwrap();
    let eva = bench.claim().await;
    let cookie = eva.cookie.clone().unwrap();
    let token = cookie.split('=').nth(1).unwrap().to_owned();
    assert_eq!(token.len(), 64, "256 bits");
    let mut looked = 0;
    for entry in std::fs::read_dir(bench.folder.path().join("data")).unwrap() {
        let path = entry.unwrap().path();
        let mode = std::os::unix::fs::PermissionsExt::mode(&std::fs::metadata(&path).unwrap().permissions());
        assert_eq!(mode & 0o077, 0, "{}", path.display());
        let bytes = std::fs::read(&path).unwrap();
        for secret in [code.as_bytes(), token.as_bytes(), PASSWORD.as_bytes()] {
            assert!(!bytes.windows(secret.len()).any(|window| window == secret), "{}", path.display());
        }
        looked += 1;
    }
    assert!(looked >= 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_is_a_cookie_that_ends_on_the_server() {
    let mut bench = Bench::new(0).await;
    let eva = bench.claim().await;
    let reply = bench
        .client()
        .post("/api/login", &json!({ "email": " EVA@example.org", "password": PASSWORD }))
        .await;
    assert_eq!(reply.status, 200, "the case of an address does not matter");
    let cookie = reply.headers["set-cookie"].to_str().unwrap();
    for word in ["__Host-sereno=", "Secure", "HttpOnly", "SameSite=Strict", "Path=/"] {
        assert!(cookie.contains(word), "{cookie}");
    }
    assert_eq!(reply.json()["account"]["role"], "administrator");
    let mut second = bench.client();
    second.take_cookie(&reply);
    assert_ne!(second.cookie, eva.cookie);
    bench.restart().await;
    second.address = bench.console().address;
    second.origin = bench.client().origin;
    assert_eq!(second.get("/api/accounts").await.status, 200, "sessions outlive a restart");
    assert_eq!(second.post("/api/logout", &json!({})).await.status, 200);
    assert_eq!(second.get("/api/accounts").await.status, 401, "a replayed cookie");
    bench.restart().await;
    second.address = bench.console().address;
    assert_eq!(second.get("/api/accounts").await.status, 401, "also after a restart");
}

#[tokio::test(flavor = "multi_thread")]
async fn accounts_are_kept_by_administrators_and_one_remains() {
    let bench = Bench::new(0).await;
    let eva = bench.claim().await;
    let me = eva.get("/api/session").await.json()["account"]["id"].as_i64().unwrap();
    let new = |email: &str, password: &str| json!({ "name": "Ana", "surname": "Prieto", "email": email, "password": password, "role": "guard" });
    for (body, status, says) in [
        (new("EVA@Example.org", PASSWORD), 409, "another account"),
        (new("ana@example.org", "short"), 400, "12 to 256"),
        (new("ana@example.org", &"x".repeat(257)), 400, "12 to 256"),
        (new("ana", PASSWORD), 400, "email"),
        (new("a b@c", PASSWORD), 400, "email"),
        (json!({ "name": "Ana" }), 400, "missing field"),
        (json!({ "nmae": "Ana" }), 400, "unknown field"),
    ] {
        let reply = eva.post("/api/accounts", &body).await;
        assert_eq!(reply.status, status, "{}", reply.text);
        assert!(reply.json()["error"].as_str().unwrap().contains(says), "{}", reply.text);
    }
    assert_eq!(eva.post("/api/accounts", &new("ana@example.org", PASSWORD)).await.status, 201);
    let ana = bench.log_in("ana@example.org").await;
    let session = ana.get("/api/session").await.json();
    assert_eq!((&session["message"], &session["drones"]), (&json!("no drone assigned"), &json!([])));
    let change = eva.patch(&format!("/api/accounts/{me}"), &json!({ "role": "viewer" })).await;
    assert_eq!(change.status, 409, "{}", change.text);
    assert_eq!(eva.patch(&format!("/api/accounts/{me}"), &json!({ "disabled": true })).await.status, 409);
    assert_eq!(ana.patch("/api/session", &json!({ "language": "en" })).await.status, 200);
    assert_eq!(ana.patch("/api/session", &json!({ "language": "xx" })).await.status, 400);
    assert_eq!(ana.get("/api/session").await.json()["account"]["language"], "en");
    // A new password ends the other sessions, not this one.
    let other = bench.log_in("ana@example.org").await;
    let wrong = ana
        .post("/api/password", &json!({ "old": "not the old password", "new": "a new long password" }))
        .await;
    assert_eq!(wrong.status, 403);
    let right = ana.post("/api/password", &json!({ "old": PASSWORD, "new": "a new long password" })).await;
    assert_eq!(right.status, 200, "{}", right.text);
    assert_eq!(ana.get("/api/drones").await.status, 200);
    assert_eq!(other.get("/api/drones").await.status, 401);
    let accounts = eva.get("/api/accounts").await;
    assert!(!accounts.text.contains("argon2"), "no hash leaves the store");
    assert_eq!(accounts.json().as_array().unwrap().len(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn guessing_is_slowed_down_and_the_rightful_user_is_not_shut_out() {
    let bench = Bench::new(0).await;
    let eva = bench.claim().await;
    let guess = async |email: &str| {
        bench.client().post("/api/login", &json!({ "email": email, "password": "a wrong password" })).await
    };
    let mut heard = 0;
    let mut refused = None;
    for _ in 0..40 {
        let reply = guess("eva@example.org").await;
        match reply.status {
            401 => heard += 1,
            429 => refused = Some(reply),
            other => panic!("{other}"),
        }
    }
    assert_eq!(heard, 5, "with the clock standing still");
    let refused = refused.unwrap();
    assert_eq!(refused.headers["retry-after"], "1");
    assert!(refused.json()["error"].as_str().unwrap().contains("try again in 1 s"));
    // A day of guessing as fast as it is allowed.
    let mut guesses = 0;
    let began = bench.clock.0.load(std::sync::atomic::Ordering::SeqCst);
    for _ in 0..60 {
        let reply = guess("eva@example.org").await;
        if reply.status == 401 {
            guesses += 1;
        }
        bench.pass(Duration::from_secs(30));
    }
    let hours = (bench.clock.0.load(std::sync::atomic::Ordering::SeqCst) - began) as f64 / 3.6e6;
    assert!(guesses as f64 / hours <= 65.0, "{guesses} in {hours} h");
    // Who knows the password waits for no longer than is promised.
    bench.pass(Duration::from_millis(LONGEST_MS));
    bench.log_in("eva@example.org").await;
    let log = bench.log(&bench.log_in("eva@example.org").await).await;
    let failed = log.iter().filter(|line| line["kind"] == "failed").count();
    assert_eq!(failed, heard + guesses, "what was not heard does not fill the log");
    assert!(log.iter().any(|line| line["kind"] == "log-in" && line["address"] == "127.0.0.1"));
    drop(eva);
}

/// Medians of twelve on a noisy machine: a hash takes tens of milliseconds, a look-up without one less than one.
#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_user_costs_the_time_of_a_wrong_password() {
    let bench = Bench::new(0).await;
    let eva = bench.claim().await;
    let (_, _, email) = bench.account(&eva, Role::Guard, &[]).await;
    let mut times = [Vec::new(), Vec::new()];
    for k in 0..12 {
        for (at, email) in [(0, email.clone()), (1, format!("nobody{k}@example.org"))] {
            let began = std::time::Instant::now();
            let reply = bench
                .client()
                .post("/api/login", &json!({ "email": email, "password": "a wrong password" }))
                .await;
            times[at].push(began.elapsed().as_secs_f64());
            assert_eq!(reply.status, 401);
            assert_eq!(reply.json()["error"], "e-mail address or password are wrong");
            bench.pass(Duration::from_secs(61));
        }
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let (known, unknown) = (median(&mut times[0]), median(&mut times[1]));
    assert!(unknown > 0.4 * known && unknown < 2.5 * known, "{known} s and {unknown} s");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_log_is_only_added_to() {
    let bench = Bench::new(0).await;
    let eva = bench.claim().await;
    assert!(!bench.log(&eva).await.is_empty());
    let file = rusqlite::Connection::open(bench.folder.path().join("data/console.sqlite")).unwrap();
    for attack in
        ["DELETE FROM log", "UPDATE log SET account = 'x'", "INSERT OR REPLACE INTO log SELECT * FROM log"]
    {
        let refused = file.execute(attack, []);
        assert!(refused.is_err() || attack.starts_with("INSERT"), "{attack}");
    }
    assert!(bench.log(&eva).await.iter().all(|line| line["account"] != "x"));
    for limit in ["0", "501", "x", "-1"] {
        assert_eq!(eva.get(&format!("/api/log?limit={limit}")).await.status, 400);
    }
    let all = bench.log(&eva).await;
    let newest = all[0]["id"].as_i64().unwrap();
    let older = eva.get(&format!("/api/log?before={newest}&limit=1")).await.json();
    assert_eq!(older[0], all[1]);
}

#[tokio::test(flavor = "multi_thread")]
async fn every_answer_guards_the_browser() {
    let bench = Bench::new(0).await;
    for path in ["/", "/api/session", "/api/accounts", "/nowhere", "/app/none.js"] {
        let reply = bench.client().get(path).await;
        let header = |name: &str| reply.headers[name].to_str().unwrap().to_owned();
        let policy = header("content-security-policy");
        assert!(
            policy.contains("default-src 'self'") && policy.contains("frame-ancestors 'none'"),
            "{policy}"
        );
        assert!(!policy.contains("unsafe"));
        assert_eq!(header("x-content-type-options"), "nosniff");
        assert!(header("strict-transport-security").starts_with("max-age="));
        assert_eq!(header("referrer-policy"), "no-referrer");
        assert!(header("permissions-policy").contains("gamepad=(self)"));
    }
    assert_eq!(bench.client().get("/api/session").await.headers["cache-control"], "no-store");
    assert_eq!(bench.client().send("DELETE", "/api/session", "").await.status, 405);
}
