//! Connections: TLS, limits in number and time, HTTP/1.1.

use crate::gate::From;
use axum::Router;
use axum::body::Body;
use axum::http::{HeaderValue, Request, Response, StatusCode, header};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::HashMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio_rustls::TlsAcceptor;

/// A handshake takes no longer.
const HANDSHAKE: Duration = Duration::from_secs(10);
/// Nor do the headers of a request, the wait for the next one included.
const HEADERS: Duration = Duration::from_secs(15);
/// Headers and what has come of a body.
const READ_BYTES: usize = 64 * 1024;
/// In the kernel for each connection: a slow page gets what is new, not what lies there from long ago.
const SEND_BYTES: u32 = 128 * 1024;
/// Connections that wait to be accepted.
const BACKLOG: u32 = 128;

/// Listens.
///
/// # Errors
/// The system's, with the address.
pub(crate) fn listen(address: SocketAddr) -> Result<TcpListener, std::io::Error> {
    let open = || {
        let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
        socket.set_reuseaddr(true)?;
        // Accepted connections inherit it.
        socket.set_send_buffer_size(SEND_BYTES)?;
        socket.bind(address)?;
        socket.listen(BACKLOG)
    };
    open()
        .map_err(|reason| std::io::Error::new(reason.kind(), format!("cannot listen on {address}: {reason}")))
}

/// How many connections there are, in all and from each address.
#[derive(Debug)]
pub(crate) struct Places {
    most: usize,
    most_an_address: usize,
    taken: Mutex<HashMap<IpAddr, usize>>,
}

/// One connection's place; given back when dropped.
#[derive(Debug)]
struct Place {
    places: Arc<Places>,
    address: IpAddr,
}

impl Places {
    pub(crate) fn new(most: usize, most_an_address: usize) -> Arc<Self> {
        Arc::new(Self { most, most_an_address, taken: Mutex::new(HashMap::new()) })
    }

    fn take(self: &Arc<Self>, address: IpAddr) -> Option<Place> {
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        if taken.values().sum::<usize>() >= self.most {
            return None;
        }
        let own = taken.entry(address).or_insert(0);
        if *own >= self.most_an_address {
            return None;
        }
        *own += 1;
        Some(Place { places: self.clone(), address })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.taken.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(own) = taken.get_mut(&self.address) {
            *own -= 1;
            if *own == 0 {
                taken.remove(&self.address);
            }
        }
    }
}

/// Serves the router on TLS for ever.
pub(crate) async fn serve(listener: TcpListener, tls: TlsAcceptor, places: Arc<Places>, router: Router) {
    loop {
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                // Out of file descriptors, most likely: some will be given back.
                tracing::warn!("cannot accept a connection: {error}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        // Whoever comes when it is full is hung up on: his browser tries again.
        let Some(place) = places.take(peer.ip().to_canonical()) else { continue };
        tokio::spawn(connection(stream, tls.clone(), place, router.clone()));
    }
}

async fn connection(stream: TcpStream, tls: TlsAcceptor, place: Place, router: Router) {
    let address = place.address;
    // Small frames at once: sticks.
    let _ = stream.set_nodelay(true);
    let Ok(Ok(stream)) = tokio::time::timeout(HANDSHAKE, tls.accept(stream)).await else { return };
    let held = Held(Arc::new(place));
    let service = hyper::service::service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(From(address));
        request.extensions_mut().insert(held.clone());
        TowerToHyperService::new(router.clone()).call(request)
    });
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS)
        .max_buf_size(READ_BYTES)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades()
        .await;
    if let Err(error) = served {
        tracing::debug!("a connection from {address} ended: {error}");
    }
}

/// A connection's place, in the hands of its requests: a WebSocket keeps it until it is closed.
#[derive(Clone, Debug)]
#[allow(dead_code, reason = "held, not read")]
pub(crate) struct Held(Arc<Place>);

/// Sends browsers that come without TLS to where it is.
pub(crate) async fn redirect(listener: TcpListener, port: u16, places: Arc<Places>) {
    loop {
        let Ok((stream, peer)) = listener.accept().await else {
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        let Some(place) = places.take(peer.ip().to_canonical()) else { continue };
        tokio::spawn(async move {
            let _place = place;
            let service = hyper::service::service_fn(move |request: Request<Incoming>| async move {
                Ok::<_, std::convert::Infallible>(elsewhere(&request, port))
            });
            let served = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(HANDSHAKE)
                .keep_alive(false)
                .max_buf_size(READ_BYTES)
                .serve_connection(TokioIo::new(stream), service);
            let _ = tokio::time::timeout(HANDSHAKE, served).await;
        });
    }
}

/// Only the host is taken from the request, and only if it looks like one.
fn elsewhere<B>(request: &Request<B>, port: u16) -> Response<Body> {
    let mut response = Response::new(Body::empty());
    let host = request
        .headers()
        .get(header::HOST)
        .and_then(|host| host.to_str().ok())
        .and_then(|host| host.parse::<axum::http::uri::Authority>().ok())
        .filter(|host| !host.as_str().contains('@'));
    let place = host.map(|host| match port {
        443 => format!("https://{}/", host.host()),
        port => format!("https://{}:{port}/", host.host()),
    });
    match place.and_then(|place| HeaderValue::from_str(&place).ok()) {
        Some(place) => {
            *response.status_mut() = StatusCode::PERMANENT_REDIRECT;
            response.headers_mut().insert(header::LOCATION, place);
        }
        None => *response.status_mut() = StatusCode::BAD_REQUEST,
    }
    response
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_browser_without_tls_is_sent_to_the_same_host_and_nowhere_else() {
        let ask = |host: &str, port| {
            let request = Request::builder().uri("/x?y").header("host", host).body(()).unwrap();
            let response = elsewhere(&request, port);
            response.headers().get(header::LOCATION).map(|place| place.to_str().unwrap().to_owned())
        };
        assert_eq!(ask("drone.local", 443).as_deref(), Some("https://drone.local/"));
        assert_eq!(ask("drone.local:80", 8443).as_deref(), Some("https://drone.local:8443/"));
        assert_eq!(ask("[::1]:80", 8443).as_deref(), Some("https://[::1]:8443/"));
        assert_eq!(ask("a@evil.example", 443), None);
        assert_eq!(ask("a b", 443), None);
    }

    #[test]
    fn places_are_counted_in_all_and_from_each_address() {
        let places = Places::new(3, 2);
        let at = |k: u8| IpAddr::from([10, 0, 0, k]);
        let first = places.take(at(1)).unwrap();
        let _second = places.take(at(1)).unwrap();
        assert!(places.take(at(1)).is_none());
        let _third = places.take(at(2)).unwrap();
        assert!(places.take(at(3)).is_none());
        drop(first);
        assert!(places.take(at(3)).is_some());
        assert_eq!(places.taken.lock().unwrap().len(), 2);
    }
}
