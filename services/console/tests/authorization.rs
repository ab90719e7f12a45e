//! Who may do what: every route and every message of the table, tried by everybody.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::client::{Client, answer, hear, say};
use common::{Bench, until};
use console::Role;
use console::table::{Action, Least, MESSAGES, Method, Names, ROUTES, Route, Says};
use serde_json::json;
use std::time::Duration;

/// Somebody who tries: who he is to the drone `north`.
struct Person {
    what: &'static str,
    client: Client,
    email: Option<String>,
    /// Role and whether `north` is his, of a session that counts.
    is: Option<(Role, bool)>,
}

async fn people(bench: &Bench, eva: &Client) -> Vec<Person> {
    let mut people = Vec::new();
    let mut add = |what, client, email, is| people.push(Person { what, client, email, is });
    add("no session", bench.client(), None, None);
    let mut forged = bench.client();
    forged.cookie = Some(format!("__Host-sereno={}", "0".repeat(64)));
    add("a forged cookie", forged, None, None);
    let (out, _, _) = bench.account(eva, Role::Administrator, &["*"]).await;
    assert_eq!(out.post("/api/logout", &json!({})).await.status, 200);
    add("a replayed cookie after logging out", out, None, None);
    let (disabled, id, _) = bench.account(eva, Role::Administrator, &["*"]).await;
    assert_eq!(eva.patch(&format!("/api/accounts/{id}"), &json!({ "disabled": true })).await.status, 200);
    add("a disabled administrator", disabled, None, None);
    for (what, role, drones) in [
        ("viewer", Role::Viewer, &["north"][..]),
        ("guard", Role::Guard, &["north"][..]),
        ("guard of another drone", Role::Guard, &["south"][..]),
        ("guard without a drone", Role::Guard, &[][..]),
        ("installer", Role::Installer, &["north"][..]),
        ("administrator", Role::Administrator, &["*"][..]),
        ("administrator of another drone", Role::Administrator, &["south"][..]),
    ] {
        let (client, _, email) = bench.account(eva, role, drones).await;
        add(what, client, Some(email), Some((role, drones == ["north"] || drones == ["*"])));
    }
    people
}

fn may(route: &Route, is: Option<(Role, bool)>) -> bool {
    match (route.least, is) {
        (Least::Anybody, _) => true,
        (Least::Account(_), None) => false,
        (Least::Account(least), Some((role, his))) => role >= least && (his || route.names == Names::NoDrone),
    }
}

async fn ask(client: &Client, route: &Route) -> u16 {
    let path = route
        .path
        .replace("{drone}", "north")
        .replace("{id}", "999999")
        .replace("{*path}", "no-such-file.js");
    if route.is_socket() {
        return match client.open(&format!("{path}?drone=north")).await {
            Ok(_) => 101,
            Err(status) => status,
        };
    }
    match route.method {
        Method::Get => client.get(&path).await.status,
        Method::Post => client.post(&path, &json!({})).await.status,
        Method::Patch => client.patch(&path, &json!({})).await.status,
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_route_is_open_to_those_in_the_table_and_to_nobody_else() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let _drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut tried = 0;
    for mut person in people(&bench, &eva).await {
        for route in ROUTES {
            let status = ask(&person.client, route).await;
            let allowed = may(route, person.is);
            assert_eq!(
                !matches!(status, 401 | 403),
                allowed,
                "{} asks {:?} {}: {status}",
                person.what,
                route.method,
                route.path
            );
            // What is allowed was understood as far as the handler; without an account one is told to log in.
            if allowed {
                assert_ne!(status, 500);
            } else {
                assert_eq!(status, if person.is.is_none() { 401 } else { 403 });
            }
            if allowed
                && route.action == Action::LogOut
                && let Some(email) = &person.email
            {
                person.client = bench.log_in(email).await;
            }
            tried += 1;
        }
    }
    assert_eq!(tried, 11 * ROUTES.len());
    // Expired: the sessions that have just been good.
    let (guard, _, _) = bench.account(&eva, Role::Administrator, &["*"]).await;
    assert_eq!(guard.get("/api/accounts").await.status, 200);
    bench.pass(Duration::from_secs(3601));
    for route in ROUTES {
        let status = ask(&guard, route).await;
        assert_eq!(status == 401, route.least != Least::Anybody, "expired asks {}: {status}", route.path);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_changes_something_must_come_from_our_own_page() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let _drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let port = bench.console().address.port();
    for origin in [
        None,
        Some("https://evil.example".to_owned()),
        Some("null".to_owned()),
        Some(format!("http://localhost:{port}")),
        Some(format!("https://localhost:{}", port ^ 1)),
        Some(format!("https://localhost.evil.example:{port}")),
        Some(format!("https://evil.example/https://localhost:{port}")),
        Some("https://".to_owned()),
    ] {
        let mut from = eva.clone();
        from.origin = origin.clone();
        for route in ROUTES.iter().filter(|route| route.needs_origin()) {
            assert_eq!(ask(&from, route).await, 403, "{} from {origin:?}", route.path);
        }
    }
    assert_eq!(eva.get("/api/accounts").await.status, 200, "nobody was logged out by it");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_message_is_open_to_those_in_the_table_and_to_nobody_else() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut opened = 0;
    for person in people(&bench, &eva).await {
        for message in MESSAGES {
            let path = ROUTES.iter().find(|route| route.action == message.socket).unwrap().path;
            let Ok(mut socket) = person.client.open(&format!("{path}?drone=north")).await else { continue };
            opened += 1;
            let (role, _) = person.is.unwrap();
            let allowed = role >= message.least;
            let before = (drone.orders().len(), drone.heard.lock().unwrap().sticks.len());
            match message.says {
                Says::Order(verb) => {
                    let mut order = json!({ "id": 5, "verb": verb });
                    if verb == "goto" {
                        order["x_m"] = json!(1.0);
                        order["y_m"] = json!(1.0);
                    }
                    say(&mut socket, &json!({ "order": order })).await;
                    answer(&mut socket, 5).await;
                    let reached = drone.orders().len() > before.0;
                    assert_eq!(reached, allowed, "{} says {verb}", person.what);
                    if reached {
                        let (key, order) = drone.orders().pop().unwrap();
                        assert_eq!(key, format!("sereno/north/command/{verb}/console"));
                        assert_eq!(order["role"], role.word());
                        assert_eq!(order["account"].as_str(), person.email.as_deref());
                    }
                }
                Says::Frame => {
                    assert!(allowed);
                    let frame = json!({ "lease": 1, "input_sequence": 1, "beacon_ns": 1, "since_ms": 0.0, "forward": 0.0,
                        "left": 0.0, "up": 0.0, "turn": 0.0, "held": false, "height_hold": true,
                        "heading_hold": true, "arm": "absent" });
                    say(&mut socket, &frame).await;
                    until("the frame", async || drone.heard.lock().unwrap().sticks.len() > before.1).await;
                }
                Says::Signal => {
                    assert!(allowed);
                    say(&mut socket, &json!({ "type": "call" })).await;
                }
                Says::Subscribe => {
                    assert!(allowed);
                    say(&mut socket, &json!({ "subscribe": ["pilot/state"] })).await;
                    let mut every = tokio::time::interval(Duration::from_millis(50));
                    let heard = hear(&mut socket, |value| (value["topic"] == "pilot/state").then_some(()));
                    tokio::pin!(heard);
                    loop {
                        tokio::select! {
                            () = &mut heard => break,
                            _ = every.tick() => drone.say("pilot/state", &json!({ "phase": 0 })).await,
                        }
                    }
                }
            }
        }
    }
    let on_all = MESSAGES.len();
    let on_viewers = MESSAGES.iter().filter(|message| message.socket != Action::Sticks).count();
    assert_eq!(
        opened,
        on_viewers + 3 * on_all,
        "viewer, guard, installer and administrator of this drone, nobody else"
    );
}
