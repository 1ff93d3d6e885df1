//! Who may watch: a door before the server for viewers, which does not look at where a connection comes from.
//!
//! The one thing to know: any web page that is open in a browser on this machine can connect to servers on it, and a browser
//! says in the header `Origin` which page asks. Programs that are no browsers send none. The door reads the head of each
//! connection, refuses pages that were not allowed, and passes on everything else. The server behind it listens on a
//! loopback address that is drawn at random, so that no page finds the way around the door.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// A browser's request has some 500 bytes before the first empty line.
const HEAD_BYTES_MAX: usize = 16 << 10;
/// Who does not say within this time what is wanted goes.
const HEAD_PATIENCE: Duration = Duration::from_secs(5);
/// Connections at a time.
const CONNECTIONS_MAX: usize = 64;

/// A loopback address that nobody guesses: one of 16 million.
pub fn hidden_address() -> Ipv4Addr {
    let [_, a, b, c, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    // 127.0.0.0 and 127.255.255.255 are no addresses.
    Ipv4Addr::new(127, a, b, if c == 0 || c == 255 { 7 } else { c })
}

/// Lets the connections of `listener` through to `inner`, as long as the process lives.
pub fn guard(listener: TcpListener, inner: SocketAddr, allowed: Vec<String>) {
    let (allowed, open) = (Arc::new(allowed), Arc::new(AtomicUsize::new(0)));
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            if open.load(Ordering::Relaxed) >= CONNECTIONS_MAX {
                continue;
            }
            open.fetch_add(1, Ordering::Relaxed);
            let (allowed, open) = (Arc::clone(&allowed), Arc::clone(&open));
            thread::spawn(move || {
                // Whoever goes away in the middle has gone; there is nobody to tell.
                let _ = pass(stream, inner, &allowed);
                open.fetch_sub(1, Ordering::Relaxed);
            });
        }
    });
}

/// Carries one connection.
fn pass(mut outer: TcpStream, inner: SocketAddr, allowed: &[String]) -> io::Result<()> {
    outer.set_read_timeout(Some(HEAD_PATIENCE))?;
    let head = read_head(&mut outer)?;
    if let Some(origin) = refused_origin(&head, allowed) {
        crate::terminal::say(format!(
            "refused the web page {origin:?}: if it is to watch, add --origin {origin:?}"
        ));
        return outer.write_all(b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    }
    outer.set_read_timeout(None)?;
    let mut server = TcpStream::connect(inner)?;
    outer.set_nodelay(true)?;
    server.set_nodelay(true)?;
    server.write_all(&head)?;
    let (mut from_server, mut to_viewer) = (server.try_clone()?, outer.try_clone()?);
    let back = thread::spawn(move || {
        let copied = io::copy(&mut from_server, &mut to_viewer);
        let _ = to_viewer.shutdown(Shutdown::Both);
        copied
    });
    let copied = io::copy(&mut outer, &mut server);
    let _ = server.shutdown(Shutdown::Both);
    let _ = back.join();
    copied.map(drop)
}

/// What comes up to the first empty line, and what came with it.
fn read_head(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    let mut bytes = [0; 1024];
    while !head.windows(4).any(|four| four == b"\r\n\r\n") {
        let count = stream.read(&mut bytes)?;
        if count == 0 || head.len() + count > HEAD_BYTES_MAX {
            return Err(io::Error::new(ErrorKind::InvalidData, "no head of a request"));
        }
        head.extend_from_slice(&bytes[..count]);
    }
    Ok(head)
}

/// The web page that asks, if it may not.
fn refused_origin(head: &[u8], allowed: &[String]) -> Option<String> {
    let end = head.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(head.len());
    let text = String::from_utf8_lossy(&head[..end]);
    let origins = text.lines().skip(1).filter_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.trim().eq_ignore_ascii_case("origin").then(|| value.trim().to_owned())
    });
    origins.into_iter().find(|origin| !may_watch(origin, allowed))
}

/// Pages of this machine may, and what the user names. `null` is said by pages that hide where they come from.
fn may_watch(origin: &str, allowed: &[String]) -> bool {
    if allowed.iter().any(|allowed| allowed.trim_end_matches('/').eq_ignore_ascii_case(origin)) {
        return true;
    }
    let Some((scheme, rest)) = origin.split_once("://") else { return false };
    let host = match rest.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => rest.split([':', '/']).next().unwrap_or_default(),
    };
    let is_loopback = host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback());
    match scheme {
        // The desktop programs.
        "file" => true,
        "http" | "https" => host == "localhost" || is_loopback,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_from_elsewhere_are_refused() {
        let allowed = ["https://app.foxglove.dev/".to_owned()];
        for origin in [
            "http://localhost:8080",
            "http://127.0.0.1",
            "https://127.9.9.9:1",
            "http://[::1]:3000",
            "file://",
            "https://app.foxglove.dev",
        ] {
            assert!(may_watch(origin, &allowed), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "http://localhost.evil.example",
            "http://127.0.0.1.evil.example",
            "http://128.0.0.1",
            "null",
            "",
            "ftp://localhost",
            "https://app.foxglove.dev.evil.example",
        ] {
            assert!(!may_watch(origin, &allowed), "{origin}");
        }
    }

    #[test]
    fn the_header_is_found_however_it_is_written() {
        let head = |lines: &str| {
            format!("GET / HTTP/1.1\r\n{lines}\r\n\r\nOrigin: http://not.a.header").into_bytes()
        };
        assert_eq!(refused_origin(&head("Host: localhost"), &[]), None);
        assert_eq!(refused_origin(&head("oRiGiN:http://localhost"), &[]), None);
        assert_eq!(
            refused_origin(&head("ORIGIN:  https://evil.example "), &[]),
            Some("https://evil.example".to_owned())
        );
        let two = head("Origin: http://localhost\r\nOrigin: https://evil.example");
        assert_eq!(refused_origin(&two, &[]), Some("https://evil.example".to_owned()));
    }

    #[test]
    fn hidden_addresses_are_loopback_and_differ() {
        let addresses: std::collections::BTreeSet<_> = (0..100).map(|_| hidden_address()).collect();
        assert!(addresses.iter().all(Ipv4Addr::is_loopback) && addresses.len() > 90);
    }
}
