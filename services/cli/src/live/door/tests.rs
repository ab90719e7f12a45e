use super::*;
use std::sync::mpsc::{Receiver, channel};

const HEAD: &str = "GET / HTTP/1.1\r\nHost: localhost:8765\r\nUpgrade: websocket\r\n";

fn known() -> Vec<String> {
    FOXGLOVE.map(str::to_owned).to_vec()
}

fn verdict(more: &str) -> Verdict {
    judge(format!("{HEAD}{more}\r\n").as_bytes(), &known())
}

/// A door before something that answers each byte with the same, and tells of each connection.
fn house() -> (SocketAddr, Receiver<()>) {
    let inner = TcpListener::bind((hidden_address().unwrap(), 0)).unwrap();
    let door = Door::take(0).unwrap();
    let address = door.address();
    door.open(inner.local_addr().unwrap(), known()).unwrap();
    let (came, comes) = channel();
    thread::spawn(move || {
        for stream in inner.incoming() {
            let stream = stream.unwrap();
            let _ = came.send(());
            thread::spawn(move || io::copy(&mut &stream, &mut &stream));
        }
    });
    (address, comes)
}

fn knock(address: SocketAddr, more: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    stream.write_all(format!("{HEAD}{more}\r\n").as_bytes()).unwrap();
    stream
}

fn answer(mut stream: TcpStream) -> String {
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    text
}

#[test]
fn programs_and_foxglove_come_in_and_pages_of_strangers_do_not() {
    assert_eq!(verdict(""), Verdict::Open, "a program sends none");
    for own in FOXGLOVE {
        assert_eq!(verdict(&format!("origin: {own}\r\n")), Verdict::Open, "{own}");
    }
    for stranger in [
        "https://evil.example",
        "null",
        "http://localhost:8765",
        "https://app.foxglove.dev.evil.example",
        "https://app.foxglove.dev:8443",
        "http://app.foxglove.dev",
        "file:///tmp/page.html",
        "",
    ] {
        let said = verdict(&format!("ORIGIN: {stranger}\r\n"));
        assert_eq!(said, Verdict::Stranger(stranger.to_owned()), "{stranger:?}");
    }
    let two = "Origin: https://app.foxglove.dev\r\nOrigin: https://evil.example\r\n";
    assert_eq!(verdict(two), Verdict::Stranger("https://evil.example".to_owned()));
}

#[test]
fn what_is_no_request_is_refused_and_half_of_one_is_waited_for() {
    assert_eq!(judge(HEAD.as_bytes(), &known()), Verdict::More);
    assert_eq!(judge(b"", &known()), Verdict::More);
    let junk: Vec<u8> = (0..=255).collect();
    assert!(matches!(judge(&junk, &known()), Verdict::Refused("400 Bad Request", _)));
    let long = format!("{HEAD}Cookie: {}", "x".repeat(HEAD_BYTES));
    assert!(
        matches!(judge(long.as_bytes(), &known()), Verdict::Refused(status, _) if status.starts_with("431"))
    );
    let many = format!("{HEAD}{}\r\n", "A: b\r\n".repeat(HEAD_FIELDS));
    assert!(matches!(judge(many.as_bytes(), &known()), Verdict::Refused("400 Bad Request", _)));
    let said = verdict(&format!("Origin: https://{}\r\n", "y".repeat(4000)));
    assert!(matches!(said, Verdict::Stranger(origin) if origin.len() == ORIGIN_CHARACTERS));
}

#[test]
fn bytes_go_both_ways_and_a_stranger_never_gets_so_far() {
    let (address, comes) = house();
    let stranger = answer(knock(address, "Origin: https://evil.example\r\n"));
    assert!(stranger.starts_with("HTTP/1.1 403 Forbidden\r\n"), "{stranger}");
    assert!(stranger.ends_with("pages of https://evil.example may not watch"), "{stranger}");
    assert!(comes.try_recv().is_err(), "nobody was let in");

    let mut program = knock(address, "");
    comes.recv_timeout(Duration::from_secs(30)).unwrap();
    program.write_all(b"and more").unwrap();
    let mut heard = vec![0; HEAD.len() + 2 + 8];
    program.read_exact(&mut heard).unwrap();
    assert_eq!(heard, format!("{HEAD}\r\nand more").into_bytes());
}

#[test]
fn no_more_come_in_than_there_is_room_for_and_who_leaves_makes_room() {
    let (address, comes) = house();
    let mut inside: Vec<_> = (0..MOST).map(|_| knock(address, "")).collect();
    for _ in 0..MOST {
        comes.recv_timeout(Duration::from_secs(30)).unwrap();
    }
    let late = answer(knock(address, ""));
    assert!(late.starts_with("HTTP/1.1 503"), "{late}");
    drop(inside.pop());
    let until = Instant::now() + Duration::from_secs(30);
    // Its place is free when the door has noticed.
    while comes.try_recv().is_err() {
        assert!(Instant::now() < until, "a place became free");
        inside.push(knock(address, ""));
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn an_origin_is_a_scheme_and_a_host() {
    for good in ["http://localhost:8080", "https://viewer.example.org", "http://[::1]:8080", "app://viewer"] {
        assert_eq!(origin(good).as_deref(), Ok(good));
    }
    for bad in [
        "null",
        "*",
        "",
        "localhost:8080",
        "http://",
        "://host",
        "http://a/b",
        "https://*",
        "HTTP://a",
        "http://a b",
    ] {
        let said = origin(bad).unwrap_err();
        assert!(said.contains(bad) && said.contains("allowed"), "{said}");
    }
}

#[test]
fn the_address_behind_the_door_is_this_machines_and_not_the_known_one() {
    let drawn: BTreeSet<_> = (0..64).map(|_| hidden_address().unwrap()).collect();
    // Sixty-four draws of sixteen million: that two are alike happens once in eight thousand runs, that five are never.
    assert!(drawn.len() >= 60, "{}", drawn.len());
    for address in drawn {
        assert!(address.is_loopback() && address != Ipv4Addr::LOCALHOST);
        TcpListener::bind((address, 0)).unwrap();
    }
}
