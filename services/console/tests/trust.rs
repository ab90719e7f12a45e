//! A phone is told to trust the owner's authority: by a page for anybody, a certificate, and a code for administrators.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::Bench;
use console::Role;
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;

#[tokio::test(flavor = "multi_thread")]
async fn anybody_is_told_how_and_compares_what_is_downloaded() {
    let mut bench = Bench::new(0).await;
    let nobody = bench.client();
    for path in ["/trust", "/trust/sereno-ca.crt"] {
        assert_eq!(nobody.get(path).await.status, 404, "{path}: nothing is offered that nobody has named");
    }
    let eva = bench.claim().await;
    let offer = eva.get("/api/trust").await.json();
    assert_eq!((&offer["offered"], &offer["fingerprint"]), (&false.into(), &serde_json::Value::Null));
    assert_eq!(eva.get("/api/trust/qr.svg").await.status, 404);

    bench.config.https.authority = Some(bench.authority.pem.clone());
    bench.restart().await;
    let nobody = bench.client();
    let crt = nobody.get("/trust/sereno-ca.crt").await;
    assert_eq!(
        (crt.status, &crt.headers["content-type"]),
        (200, &"application/x-x509-ca-cert".parse().unwrap())
    );
    let known = CertificateDer::from_pem_file(&bench.authority.pem).unwrap();
    assert_eq!(crt.bytes, known.as_ref(), "DER, and nothing else");

    let digest = ring::digest::digest(&ring::digest::SHA256, &crt.bytes);
    let digits: String = digest.as_ref().iter().map(|byte| format!("{byte:02X}")).collect();
    let page = nobody.get("/trust").await;
    assert_eq!(
        (page.status, &page.headers["content-type"]),
        (200, &"text/html; charset=utf-8".parse().unwrap())
    );
    let plain = page.text.replace("</span> <span>", "");
    assert_eq!(plain.matches(&format!("<span>{digits}</span>")).count(), 2, "in both languages");
    assert!(page.text.contains("lang=\"en\"") && page.text.contains("lang=\"es\""));
    assert!(!page.text.contains("<script") && !page.text.contains("style="), "the page obeys its own policy");
    let policy = page.headers["content-security-policy"].to_str().unwrap();
    assert!(policy.starts_with("default-src 'self';") && !policy.contains("unsafe"), "{policy}");
    // All that it refers to is there.
    for part in page.text.split("=\"/").skip(1) {
        let path = part.split('"').next().unwrap();
        assert_eq!(nobody.get(&format!("/{path}")).await.status, 200, "/{path}");
    }

    let mut eva = bench.log_in("eva@example.org").await;
    let offer = eva.get("/api/trust").await.json();
    assert_eq!(offer["fingerprint"].as_str().unwrap().replace(' ', ""), digits);
    let code = eva.get("/api/trust/qr.svg").await;
    assert_eq!((code.status, &code.headers["content-type"]), (200, &"image/svg+xml".parse().unwrap()));
    assert!(code.text.contains("<svg") && !code.text.contains("<script"));
    let (guard, _, _) = bench.account(&eva, Role::Guard, &["*"]).await;
    assert_eq!(guard.get("/api/trust/qr.svg").await.status, 403);
    eva.cookie = None;
    assert_eq!(eva.get("/api/trust/qr.svg").await.status, 401);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_console_that_would_give_a_key_away_does_not_start() {
    let mut bench = Bench::new(0).await;
    let key = bench.authority.identity("other").key;
    bench.config.https.authority = Some(key.clone());
    drop(bench.console.take());
    let started = console::Console::start(&bench.config, console::Page::Embedded, bench.clock.clone()).await;
    let error = started.err().expect("refused").to_string();
    assert!(error.contains("holds a private key") && error.contains(&key.display().to_string()), "{error}");
}
