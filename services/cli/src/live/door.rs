//! The door before Foxglove's server, which asks nobody who he is and looks at no `Origin`: any page that a browser on this
//! machine has open could watch by it. So the server listens on an address of this machine that is drawn at random
//! ([`hidden_address`]), and the known one belongs to this door. It opens to programs, which send no `Origin`, and to pages
//! of listed origins; then it passes bytes on and looks no further. Connections, heads and waits are bounded.

use rustix::net::sockopt;
use std::collections::BTreeSet;
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Foxglove in a browser, and its desktop app, whose page is a file.
pub(crate) const FOXGLOVE: [&str; 2] = ["https://app.foxglove.dev", "file://"];
/// Apps at the same time.
const MOST: usize = 8;
/// A browser sends all cookies that any port of this host has set.
const HEAD_BYTES: usize = 16 * 1024;
const HEAD_FIELDS: usize = 64;
/// For so long the head of a request may take.
const PATIENCE: Duration = Duration::from_secs(5);
/// What waits in the system for an app that does not read; what else waits, the server counts and drops.
const BUFFER_BYTES: usize = 64 * 1024;
/// Refused origins that are named, each once.
const NAMED: usize = 16;
/// How much of a refused origin is printed.
const ORIGIN_CHARACTERS: usize = 100;

/// An address of this machine that no page can guess: one of sixteen million, whose port is one of thousands.
///
/// # Errors
/// When the system has no random numbers.
pub(crate) fn hidden_address() -> Result<Ipv4Addr, getrandom::Error> {
    let mut drawn = [0; 3];
    getrandom::fill(&mut drawn)?;
    // 1 to 254 each: never the known address, and never the broadcast address of 127.0.0.0/8.
    let [a, b, c] = drawn.map(|byte| 1 + byte % 254);
    Ok(Ipv4Addr::new(127, a.max(1), b, c))
}

/// An origin as browsers send it: `scheme://host`, with a port that is not the scheme's own, without a path.
///
/// # Errors
/// What is wrong, and what is allowed. `null` is none: it is what any page sends from a sandboxed frame.
pub(crate) fn origin(text: &str) -> Result<String, String> {
    let refused = || {
        format!("{text:?} is no origin: allowed are a scheme, :// and a host, as in http://localhost:8080")
    };
    let (scheme, host) = text.split_once("://").ok_or_else(refused)?;
    let scheme_is_one = scheme.starts_with(|first: char| first.is_ascii_lowercase())
        && scheme.chars().all(|one| one.is_ascii_lowercase() || one.is_ascii_digit() || "+-.".contains(one));
    let host_is_one = !host.is_empty()
        && host.chars().all(|one| {
            one.is_ascii_lowercase()
                || one.is_ascii_digit()
                || matches!(one, '.' | '-' | ':' | '[' | ']' | '_')
        });
    if scheme_is_one && host_is_one { Ok(text.to_owned()) } else { Err(refused()) }
}

/// What comes of the beginning of a request.
#[derive(Debug, PartialEq, Eq)]
enum Verdict {
    /// It has not ended yet.
    More,
    Open,
    /// Status and sentence of the answer.
    Refused(&'static str, String),
    /// The page that asks is on no list.
    Stranger(String),
}

fn judge(head: &[u8], allowed: &[String]) -> Verdict {
    let mut fields = [httparse::EMPTY_HEADER; HEAD_FIELDS];
    let mut request = httparse::Request::new(&mut fields);
    match request.parse(head) {
        Ok(httparse::Status::Partial) if head.len() < HEAD_BYTES => return Verdict::More,
        Ok(httparse::Status::Partial) => {
            let sentence = format!("the request's head is longer than {HEAD_BYTES} bytes");
            return Verdict::Refused("431 Request Header Fields Too Large", sentence);
        }
        Err(error) => return Verdict::Refused("400 Bad Request", format!("this is no request: {error}")),
        Ok(httparse::Status::Complete(_)) => {}
    }
    let origins = request.headers.iter().filter(|field| field.name.eq_ignore_ascii_case("origin"));
    for field in origins {
        if !allowed.iter().any(|known| known.as_bytes() == field.value) {
            let shown =
                String::from_utf8_lossy(field.value).chars().take(ORIGIN_CHARACTERS).collect::<String>();
            return Verdict::Stranger(manifest::one_line(&shown));
        }
    }
    Verdict::Open
}

fn refuse(mut stream: &TcpStream, status: &str, sentence: &str) -> io::Result<()> {
    let length = sentence.len();
    let answer = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{sentence}"
    );
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.write_all(answer.as_bytes())?;
    stream.shutdown(Shutdown::Write)
}

/// The known address, taken; nobody comes in yet.
#[derive(Debug)]
pub(crate) struct Door {
    listener: TcpListener,
    address: SocketAddr,
}

/// What all connections share.
#[derive(Debug)]
struct Doorkeeper {
    allowed: Vec<String>,
    inner: SocketAddr,
    inside: AtomicUsize,
    named: Mutex<BTreeSet<String>>,
}

impl Door {
    /// Takes 127.0.0.1 with this port, or any that is free for 0.
    ///
    /// # Errors
    /// When the port is taken.
    pub(crate) fn take(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let address = listener.local_addr()?;
        Ok(Self { listener, address })
    }

    pub(crate) const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Lets programs and pages of these origins through to `inner`, until the program ends.
    ///
    /// # Errors
    /// When the system has no more threads.
    pub(crate) fn open(self, inner: SocketAddr, allowed: Vec<String>) -> io::Result<()> {
        let keeper = Arc::new(Doorkeeper {
            allowed,
            inner,
            inside: AtomicUsize::new(0),
            named: Mutex::new(BTreeSet::new()),
        });
        thread::Builder::new().name("door".into()).spawn(move || {
            for stream in self.listener.incoming() {
                match stream {
                    Ok(stream) => admit(&keeper, stream),
                    // No descriptor is left; one that is closed meanwhile helps.
                    Err(_) => thread::sleep(Duration::from_millis(100)),
                }
            }
        })?;
        Ok(())
    }
}

/// One who is inside, or asks to be.
struct Guest(Arc<Doorkeeper>);

impl Drop for Guest {
    fn drop(&mut self) {
        self.0.inside.fetch_sub(1, Ordering::AcqRel);
    }
}

fn admit(keeper: &Arc<Doorkeeper>, stream: TcpStream) {
    let before = keeper.inside.fetch_add(1, Ordering::AcqRel);
    let guest = Guest(Arc::clone(keeper));
    if before >= MOST {
        // Who does not hear it sees the connection end.
        let _ = refuse(&stream, "503 Service Unavailable", &format!("{MOST} apps are connected already"));
        return;
    }
    // Without another thread the stream is dropped here, and its owner sees that.
    let _ = thread::Builder::new().name("guest".into()).spawn(move || {
        // Whoever has gone away needs no words.
        let _ = guest.0.receive(&stream);
        drop(guest);
    });
}

impl Doorkeeper {
    fn receive(&self, stream: &TcpStream) -> io::Result<()> {
        let until = Instant::now() + PATIENCE;
        let (mut head, mut part) = (Vec::new(), [0; 2048]);
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return refuse(stream, "408 Request Timeout", "the request did not end within 5 s");
            }
            stream.set_read_timeout(Some(left))?;
            let count = (&mut &*stream).read(&mut part)?;
            if count == 0 {
                return Ok(());
            }
            head.extend_from_slice(part.get(..count).unwrap_or_default());
            match judge(&head, &self.allowed) {
                Verdict::More => {}
                Verdict::Open => return self.pass(stream, &head),
                Verdict::Refused(status, sentence) => return refuse(stream, status, &sentence),
                Verdict::Stranger(origin) => {
                    self.name(&origin);
                    return refuse(stream, "403 Forbidden", &format!("pages of {origin} may not watch"));
                }
            }
        }
    }

    /// Says once which page asked in vain, and how it would be let in.
    fn name(&self, origin: &str) {
        let mut named = self.named.lock().unwrap_or_else(PoisonError::into_inner);
        if named.len() < NAMED && named.insert(origin.to_owned()) {
            eprintln!("a page of {origin} wanted to watch and was refused; --origin lets a page watch");
        }
    }

    /// Bytes both ways until one side ends.
    fn pass(&self, client: &TcpStream, head: &[u8]) -> io::Result<()> {
        let server = TcpStream::connect_timeout(&self.inner, PATIENCE)?;
        client.set_read_timeout(None)?;
        client.set_nodelay(true)?;
        server.set_nodelay(true)?;
        sockopt::set_socket_send_buffer_size(client, BUFFER_BYTES)?;
        sockopt::set_socket_recv_buffer_size(&server, BUFFER_BYTES)?;
        (&mut &server).write_all(head)?;
        let end = |sides: [&TcpStream; 2]| {
            for side in sides {
                // One that has ended already cannot be ended again.
                let _ = side.shutdown(Shutdown::Both);
            }
        };
        thread::scope(|scope| {
            thread::Builder::new().name("guest out".into()).spawn_scoped(scope, || {
                let _ = io::copy(&mut &server, &mut &*client);
                end([client, &server]);
            })?;
            let _ = io::copy(&mut &*client, &mut &server);
            end([client, &server]);
            Ok(())
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "tests")]
mod tests;
