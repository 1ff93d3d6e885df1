//! A log watched over a WebSocket: what is served, and that play, pause and seek do what they say. The client is written
//! out here from RFC 6455 and the Foxglove protocol's description, so that it shares no code with the server.

use crate::command::{Background, Place, signal};
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// What a server says.
#[derive(Debug)]
enum Said {
    Json(serde_json::Value),
    /// Subscription, time, bytes.
    Message(u32, u64, Vec<u8>),
    Time(u64),
    Playback(State),
}

/// 0 playing, 1 paused, 3 ended.
#[derive(Clone, Debug, PartialEq)]
struct State {
    status: u8,
    time_ns: u64,
    rate: f32,
    sought: bool,
    request: String,
}

/// Asks to watch, with more lines in the head of the request; what is answered.
fn ask(address: &str, lines: &str) -> (TcpStream, String) {
    let mut stream = TcpStream::connect(address).expect("the server listens");
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a socket");
    write!(
        stream,
        "GET / HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n{lines}\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    )
    .expect("a socket");
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).expect("an answer");
        head.push(byte[0]);
    }
    (stream, String::from_utf8(head).expect("text"))
}

struct Watcher {
    stream: TcpStream,
    /// Messages that came while something else was waited for: subscription, time, bytes.
    passed_by: VecDeque<(u32, u64, Vec<u8>)>,
}

impl Watcher {
    fn connect(address: &str) -> Watcher {
        let (stream, head) = ask(address, "");
        // The accept key of RFC 6455's own example.
        assert!(head.starts_with("HTTP/1.1 101") && head.contains("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), "{head}");
        Watcher { stream, passed_by: VecDeque::new() }
    }

    /// Sends a frame: text is opcode 1, binary 2. Clients mask what they send; a mask of zeros changes nothing.
    fn send(&mut self, opcode: u8, payload: &[u8]) {
        let mut frame = vec![0x80 | opcode, 0x80 | 126];
        frame.extend_from_slice(&(payload.len() as u16).to_be_bytes());
        frame.extend_from_slice(&[0; 4]);
        frame.extend_from_slice(payload);
        self.stream.write_all(&frame).expect("a socket");
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        let mut bytes = vec![0; count];
        self.stream.read_exact(&mut bytes).expect("the server goes on");
        bytes
    }

    fn hear(&mut self) -> Said {
        loop {
            let head = self.bytes(2);
            let length = match head[1] & 0x7f {
                126 => usize::from(u16::from_be_bytes(self.bytes(2).try_into().expect("2 bytes"))),
                127 => u64::from_be_bytes(self.bytes(8).try_into().expect("8 bytes")) as usize,
                length => usize::from(length),
            };
            let bytes = self.bytes(length);
            let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"));
            let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes"));
            match (head[0] & 0x0f, bytes.first()) {
                (1, _) => return Said::Json(serde_json::from_slice(&bytes).expect("JSON")),
                (2, Some(1)) => return Said::Message(u32_at(1), u64_at(5), bytes[13..].to_vec()),
                (2, Some(2)) => return Said::Time(u64_at(1)),
                (2, Some(5)) => {
                    let request = String::from_utf8(bytes[19..].to_vec()).expect("text");
                    let rate = f32::from_bits(u32_at(10));
                    let (status, time_ns, sought) = (bytes[1], u64_at(2), bytes[14] == 1);
                    return Said::Playback(State { status, time_ns, rate, sought, request });
                }
                _ => {}
            }
        }
    }

    fn json(&mut self, op: &str) -> serde_json::Value {
        loop {
            if let Said::Json(said) = self.hear()
                && said["op"] == op
            {
                return said;
            }
        }
    }

    /// Asks to play (0) or pause (1), and returns the answer.
    fn control(&mut self, command: u8, rate: f32, seek_ns: Option<u64>, request: &str) -> State {
        let mut bytes = vec![3, command];
        bytes.extend_from_slice(&rate.to_le_bytes());
        bytes.push(u8::from(seek_ns.is_some()));
        bytes.extend_from_slice(&seek_ns.unwrap_or(0).to_le_bytes());
        bytes.extend_from_slice(&(request.len() as u32).to_le_bytes());
        bytes.extend_from_slice(request.as_bytes());
        self.passed_by.clear();
        self.send(2, &bytes);
        loop {
            let said = self.hear();
            match said {
                Said::Playback(state) if state.request == request => return state,
                // The answer and what comes of it travel in two queues: either may come first.
                Said::Message(of, time_ns, bytes) => self.passed_by.push_back((of, time_ns, bytes)),
                _ => {}
            }
        }
    }

    /// The next message of a subscription for which `wanted` holds.
    fn message(&mut self, subscription: u32, wanted: impl Fn(u64) -> bool) -> (u64, Vec<u8>) {
        let is_it = |of: u32, time_ns: u64| of == subscription && wanted(time_ns);
        if let Some(at) = self.passed_by.iter().position(|&(of, time_ns, _)| is_it(of, time_ns))
            && let Some((_, time_ns, bytes)) = self.passed_by.remove(at)
        {
            return (time_ns, bytes);
        }
        loop {
            match self.hear() {
                Said::Message(of, time_ns, bytes) if is_it(of, time_ns) => return (time_ns, bytes),
                Said::Message(of, time_ns, bytes) => self.passed_by.push_back((of, time_ns, bytes)),
                _ => {}
            }
        }
    }
}

#[test]
fn a_log_is_played_paused_and_sought() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run"]);
    let mut server = Background::start(place.command(&["view", "run/log.mcap", "--port", "0", "--paused"]));
    server.wait_for("ws://127.0.0.1:");
    let address = server.seen.rsplit("ws://").next().expect("an address").trim().to_owned();
    let mut watcher = Watcher::connect(&address);
    let info = watcher.json("serverInfo");
    let capabilities = info["capabilities"].to_string();
    assert!(capabilities.contains("playbackControl") && capabilities.contains("time"), "{info}");
    let mut channels = watcher.json("advertise")["channels"].as_array().expect("channels").clone();
    while channels.len() < 7 {
        channels.extend_from_slice(watcher.json("advertise")["channels"].as_array().expect("channels"));
    }
    let topics: Vec<_> = channels.iter().map(|channel| channel["topic"].as_str().expect("a topic")).collect();
    for topic in ["/scene", "/tf", "/rings/poses", "/camera/image", "/camera/calibration", "/metrics", "/log"]
    {
        assert!(topics.contains(&topic), "{topic} is not in {topics:?}");
    }
    // Subscription k is that of channel k.
    let subscriptions: Vec<_> = (0..)
        .zip(&channels)
        .map(|(id, channel)| serde_json::json!({"id": id, "channelId": channel["id"]}))
        .collect();
    let subscribe = serde_json::json!({"op": "subscribe", "subscriptions": subscriptions});
    watcher.send(1, subscribe.to_string().as_bytes());
    let of = |topic: &str| topics.iter().position(|other| *other == topic).expect("it is there") as u32;
    // Whoever comes gets the scene and what is there now.
    watcher.message(of("/scene"), |_| true);
    assert_eq!(watcher.message(of("/metrics"), |_| true).0, 0);
    // Seeking shows the step, the state and the last picture of that time, and stays there.
    let state = watcher.control(1, 1.0, Some(41_500_000), "seek");
    let expected =
        State { status: 1, time_ns: 41_500_000, rate: 1.0, sought: true, request: "seek".to_owned() };
    assert_eq!(state, expected);
    let metrics: serde_json::Value =
        serde_json::from_slice(&watcher.message(of("/metrics"), |time_ns| time_ns > 0).1).expect("JSON");
    assert_eq!(metrics["step"], 41, "{metrics}");
    watcher.message(of("/rings/poses"), |time_ns| time_ns == 41_000_000);
    let image = watcher.message(of("/camera/image"), |time_ns| time_ns == 41_000_000).1;
    // Frames are at steps 0, 17, 33 and 50.
    let png = place.bytes("run/frames/0002.png");
    assert!(image.windows(png.len()).any(|part| part == png), "not the picture of frame 2");
    // Playing goes on from there to the end, at the rate that is asked for.
    let state = watcher.control(0, 0.25, None, "play");
    assert_eq!((state.status, state.rate, state.sought), (0, 0.25, false));
    watcher.message(of("/metrics"), |time_ns| time_ns > 41_000_000);
    let ended = loop {
        if let Said::Playback(state) = watcher.hear() {
            break state;
        }
    };
    assert_eq!((ended.status, ended.time_ns), (3, 60_000_000), "{ended:?}");
    loop {
        if let Said::Time(time_ns) = watcher.hear() {
            assert!(time_ns <= 60_000_000);
            if time_ns == 60_000_000 {
                break;
            }
        }
    }
    // Back to the start.
    assert_eq!(watcher.control(1, 1.0, Some(0), "back").time_ns, 0);
    watcher.message(of("/metrics"), |time_ns| time_ns == 0);
    signal(server.child.id(), "INT");
    assert_eq!(server.finish(), Some(0), "{}", server.seen);
}

#[test]
fn what_cannot_be_served_is_refused() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    let text = place.expect(2, &["view", "run/log.mcap", "--port", &port]);
    assert!(text.contains(&port) && text.contains("--port"), "{text}");
    assert!(place.expect(2, &["view", "run/log.mcap", "--rate=-1"]).contains("--rate"));
    place.expect(2, &["view", "tiny.toml"]);
}

#[test]
fn web_pages_from_elsewhere_are_not_let_in() {
    let place = Place::new();
    place.expect(0, &["run", "tiny.toml", "--out", "run", "--no-render"]);
    let view = ["view", "run/log.mcap", "--port", "0", "--paused", "--origin", "https://app.foxglove.dev"];
    let mut server = Background::start(place.command(&view));
    server.wait_for("serving");
    let address = server.seen.trim().rsplit("ws://").next().expect("an address").to_owned();
    for (origin, status) in [
        ("https://evil.example", "403"),
        ("null", "403"),
        ("http://localhost.evil.example", "403"),
        ("http://localhost:8080", "101"),
        ("https://app.foxglove.dev", "101"),
    ] {
        let (_, head) = ask(&address, &format!("Origin: {origin}\r\n"));
        assert!(head.starts_with(&format!("HTTP/1.1 {status}")), "{origin}: {head}");
    }
    server.wait_for("--origin \"https://evil.example\"");
    signal(server.child.id(), "INT");
    assert_eq!(server.finish(), Some(0), "{}", server.seen);
}
