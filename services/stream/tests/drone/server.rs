//! Serves a page of viewers and carries its messages.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

/// What the drone says to viewers, each with its number.
pub(super) type Outbox = Arc<Mutex<VecDeque<(usize, String)>>>;

#[derive(Clone)]
struct Ends {
    page: &'static str,
    say: mpsc::Sender<(usize, String)>,
    done: mpsc::Sender<String>,
    mark: mpsc::Sender<String>,
    outbox: Outbox,
}

/// Serves the page and carries its messages.
pub(super) struct Server {
    pub(super) address: std::net::SocketAddr,
    /// What the viewers say, each with its number.
    pub(super) said: mpsc::Receiver<(usize, String)>,
    pub(super) results: mpsc::Receiver<String>,
    /// How far the page is, in words of its own.
    pub(super) marks: mpsc::Receiver<String>,
    pub(super) outbox: Outbox,
}

impl Server {
    pub(super) fn start(page: &'static str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let (say, said) = mpsc::channel();
        let (done, results) = mpsc::channel();
        let (mark, marks) = mpsc::channel();
        let outbox = Outbox::default();
        let ends = Ends { page, say, done, mark, outbox: Arc::clone(&outbox) };
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let ends = ends.clone();
                std::thread::spawn(move || serve(stream, &ends));
            }
        });
        Self { address, said, results, marks, outbox }
    }
}

fn serve(stream: TcpStream, ends: &Ends) {
    let _ = stream.set_nodelay(true);
    let mut writer = stream.try_clone().unwrap();
    let mut reader = BufReader::new(stream);
    loop {
        let mut request = String::new();
        if reader.read_line(&mut request).unwrap_or(0) == 0 {
            return;
        }
        let mut length = 0;
        loop {
            let mut line = String::new();
            if reader.read_line(&mut line).unwrap_or(0) == 0 {
                return;
            }
            if line.trim().is_empty() {
                break;
            }
            if let Some(value) = line.to_lowercase().strip_prefix("content-length:") {
                length = value.trim().parse().unwrap();
            }
        }
        let mut body = vec![0; length];
        if reader.read_exact(&mut body).is_err() {
            return;
        }
        let body = String::from_utf8(body).unwrap();
        let path = request.split(' ').nth(1).unwrap_or("/").to_owned();
        let (name, query) = path.split_once('?').unwrap_or((&path, ""));
        let taken = |all: &Outbox| -> Vec<(usize, String)> { all.lock().unwrap().drain(..).collect() };
        let (kind, text) = match name {
            "/clock" => ("text/plain", (runtime::monotonic_ns() / 1000).to_string()),
            "/say" => {
                let viewer = query.strip_prefix("viewer=").map_or(0, |number| number.parse().unwrap());
                let _ = ends.say.send((viewer, body));
                ("text/plain", String::new())
            }
            "/result" => {
                let _ = ends.done.send(body);
                ("text/plain", String::new())
            }
            "/mark" => {
                let _ = ends.mark.send(query.to_owned());
                ("text/plain", String::new())
            }
            "/poll" => {
                std::thread::sleep(Duration::from_millis(10));
                let all: Vec<String> = taken(&ends.outbox).into_iter().map(|(_, text)| text).collect();
                ("application/json", format!("[{}]", all.join(",")))
            }
            "/poll_all" => {
                let all: Vec<String> = taken(&ends.outbox)
                    .into_iter()
                    .map(|(viewer, text)| format!("[{viewer},{text}]"))
                    .collect();
                ("application/json", format!("[{}]", all.join(",")))
            }
            _ => ("text/html", ends.page.to_owned()),
        };
        let head =
            format!("HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\r\n", text.len());
        if writer.write_all((head + &text).as_bytes()).is_err() {
            return;
        }
    }
}
