//! What who runs a console does: certificates, folders, signals.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::Bench;
use common::certificates::Authority;
use common::client::Client;
use console::{Store, StoreError};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Tests run as root, who may write where others may not: what nobody can write stands in for a read-only folder.
#[tokio::test(flavor = "multi_thread")]
async fn a_folder_or_file_that_cannot_be_used_is_named_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    let error = Store::open(&file).unwrap_err().to_string();
    assert!(error.starts_with(&format!("the console's data folder {}", file.display())), "{error}");
    let error = Store::open(Path::new("/proc/no-such-place")).unwrap_err().to_string();
    assert!(error.contains("/proc/no-such-place") && !error.contains('\n'), "{error}");
    // A folder where the file belongs.
    let taken = tempfile::tempdir().unwrap();
    std::fs::create_dir(taken.path().join("console.sqlite")).unwrap();
    let error = Store::open(taken.path()).unwrap_err().to_string();
    assert!(error.contains("console.sqlite"), "{error}");
    // No database at all.
    let damaged = tempfile::tempdir().unwrap();
    std::fs::write(damaged.path().join("console.sqlite"), "this is no database, for sure ".repeat(100))
        .unwrap();
    let error = Store::open(damaged.path()).unwrap_err().to_string();
    assert!(error.contains("file is not a database"), "{error}");
    // One of a newer program.
    let newer = tempfile::tempdir().unwrap();
    drop(Store::open(newer.path()).unwrap());
    let file = rusqlite::Connection::open(newer.path().join("console.sqlite")).unwrap();
    file.pragma_update(None, "user_version", 99).unwrap();
    drop(file);
    assert!(matches!(Store::open(newer.path()), Err(StoreError::Newer { found: 99, .. })));
}

/// The device that is always full.
#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_says_so() {
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink("/dev/full", folder.path().join("console.sqlite")).unwrap();
    let error = Store::open(folder.path()).unwrap_err().to_string();
    assert!(error.starts_with("the console's d") && error.contains("console.sqlite"), "{error}");
    assert!(!error.contains('\n'));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_certificate_is_taken_and_nobody_is_logged_out() {
    let bench = Bench::new(0).await;
    let eva = bench.claim().await;
    let mut kept = eva.connect().await;
    let second = tempfile::tempdir().unwrap();
    let other = Authority::new(second.path());
    let fresh = other.identity("https");
    std::fs::copy(&fresh.key, &bench.config.https.key).unwrap();
    std::fs::copy(&fresh.certificate, &bench.config.https.certificate).unwrap();
    // Without being told: by the change of the files.
    let mut moved = Client::new(eva.address, &other.pem);
    moved.cookie.clone_from(&eva.cookie);
    common::until("the new certificate", async || {
        let moved = moved.clone();
        tokio::spawn(async move { moved.get("/api/accounts").await.status })
            .await
            .is_ok_and(|status| status == 200)
    })
    .await;
    // A connection that was there before goes on.
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let request =
        format!("GET /api/session HTTP/1.1\r\nhost: localhost\r\ncookie: {}\r\n\r\n", eva.cookie.unwrap());
    kept.write_all(request.as_bytes()).await.unwrap();
    let mut start = [0; 12];
    kept.read_exact(&mut start).await.unwrap();
    assert_eq!(&start, b"HTTP/1.1 200");
    // A wrong one is refused by name and the one in use stays.
    std::fs::write(&bench.config.https.certificate, "nonsense").unwrap();
    let error = bench.console().read_certificate_again().unwrap_err().to_string();
    assert!(error.contains("https.pem") && error.contains("no certificate"), "{error}");
    assert_eq!(moved.get("/api/accounts").await.status, 200);
    std::fs::copy(&fresh.certificate, &bench.config.https.certificate).unwrap();
    let unrelated = other.identity("unrelated");
    std::fs::copy(&unrelated.key, &bench.config.https.key).unwrap();
    let error = bench.console().read_certificate_again().unwrap_err().to_string();
    assert!(error.contains("https.key"), "{error}");
    assert_eq!(moved.get("/api/accounts").await.status, 200);
}

/// The program itself: what it prints, SIGHUP, the claim, the end; and a failure in one sentence.
#[tokio::test(flavor = "multi_thread")]
async fn the_program_says_where_it_is_and_how_to_claim_it() {
    let bench = Bench::new(0).await;
    let config = bench.folder.path().join("console.toml");
    let text = "data = \"program-data\"\n[https]\nlisten = \"127.0.0.1:0\"\ncertificate = \"https.pem\"\nkey = \"https.key\"\n\
         connections = 64\nconnections_an_address = 64\n[zenoh]\nclient = \"console.json5\"\n\
         [session]\nidle_min = 60\nabsolute_h = 12\n";
    std::fs::write(&config, text).unwrap();
    let program = || {
        let mut program = Command::new(env!("CARGO_BIN_EXE_sereno-console"));
        program.arg("--config").arg(&config);
        program
    };
    let mut child = program().stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let address = lines.next().unwrap().unwrap();
    let address = address.strip_prefix("the watch room: https://").unwrap().trim_end_matches('/').to_owned();
    let claim = lines.next().unwrap().unwrap();
    let claim = claim.rsplit(' ').next().unwrap().to_owned();
    let client = Client::new(address.parse().unwrap(), &bench.authority.pem);
    assert_eq!(client.get("/api/session").await.json()["claimed"], false);
    let again = program().arg("--claim").output().unwrap();
    let again = String::from_utf8(again.stdout).unwrap();
    let fresh = again.trim().strip_prefix("claim code: ").unwrap();
    assert_ne!(fresh, claim);
    let body = serde_json::json!({ "code": fresh, "name": "Eva", "surname": "Sanz", "email": "eva@example.org",
        "password": common::PASSWORD });
    assert_eq!(client.post("/api/claim", &body).await.status, 200);
    let refused = program().arg("--claim").output().unwrap();
    assert!(!refused.status.success());
    assert_eq!(
        String::from_utf8_lossy(&refused.stderr),
        "sereno-console: this console has been claimed already\n"
    );
    let signal = |name: &str| {
        assert!(Command::new("kill").arg(name).arg(child.id().to_string()).status().unwrap().success());
    };
    signal("-HUP");
    assert_eq!(lines.next().unwrap().unwrap(), "the page's certificate was read again");
    signal("-TERM");
    assert!(child.wait().unwrap().success());

    for (from, to, says) in [
        ("idle_min = 60", "idle_min = 0", "session.idle_min = 0 is out of range: allowed is 1..=1440"),
        ("https.pem", "gone.pem", "gone.pem"),
        ("console.json5", "gone.json5", "gone.json5"),
        ("program-data", "/proc/1/nowhere", "/proc/1/nowhere"),
    ] {
        std::fs::write(&config, text.replace(from, to)).unwrap();
        let failed = program().output().unwrap();
        let said = String::from_utf8_lossy(&failed.stderr).into_owned();
        assert!(!failed.status.success());
        assert!(
            said.starts_with("sereno-console: ") && said.contains(says) && said.trim().lines().count() == 1,
            "{said}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_second_port_only_redirects() {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let mut bench = Bench::new(0).await;
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    bench.config.https.redirect = Some(free);
    bench.restart().await;
    let mut stream = tokio::net::TcpStream::connect(free).await.unwrap();
    stream
        .write_all(b"POST /api/login HTTP/1.1\r\nhost: drone.local\r\ncontent-length: 0\r\n\r\n")
        .await
        .unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).await.unwrap();
    let port = bench.console().address.port();
    assert!(text.starts_with("HTTP/1.1 308"), "{text}");
    assert!(text.contains(&format!("location: https://drone.local:{port}/\r\n")), "{text}");
}
