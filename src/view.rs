//! `view`: a log for Foxglove and Lichtblick to watch, live, over a WebSocket: they play, pause and seek.

use crate::failure::{Exit, Failure, Outcome};
use crate::resimulate::States;
use crate::terminal::say;
use crate::{log_file, origin, stop};
use clap::Args;
use foxglove::websocket::{
    Capability, ChannelView, Client, PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus,
    ServerListener,
};
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer};
use recorder::export::{ExportError, Put, Viewer};
use recorder::{Kind, Log, StateSource};
use schemas::log_time_ns;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

#[derive(Args)]
#[command(
    after_help = "Example:\n  chainmail view out/drop/log.mcap\n\nThen, in Foxglove or Lichtblick: open a connection, \
                        Foxglove WebSocket, ws://localhost:8765. Ctrl-C ends it."
)]
pub struct Arguments {
    /// The log
    log: PathBuf,
    /// Address to listen on; on another than this machine's own, whoever reaches it can watch
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    host: String,
    /// Port to listen on; 0 takes a free one
    #[arg(long, value_name = "PORT", default_value_t = 8765)]
    port: u16,
    /// A web page that may watch, besides those of this machine, as in https://app.foxglove.dev; may be given again
    #[arg(long, value_name = "URL")]
    origin: Vec<String>,
    /// Simulated seconds in a second of time
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    rate: f32,
    /// Begin at rest
    #[arg(long)]
    paused: bool,
}

/// Time between two looks at the clock: what is shown moves at most so often.
const TICK: Duration = Duration::from_millis(16);

pub fn run(arguments: &Arguments) -> Outcome {
    stop::flag();
    if !(arguments.rate > 0.0 && arguments.rate.is_finite()) {
        return Err(Failure::input(format!("--rate {}: expected a positive number", arguments.rate)));
    }
    let log = log_file::open_whole(&arguments.log)?;
    let mut stage = Stage::new(&log)?;
    let player = Arc::new(Player::new(stage.end_ns(), !arguments.paused, arguments.rate));
    let context = Context::new();
    let channels = channels(&context)?;
    let cannot_serve = |error: &dyn std::fmt::Display| {
        let (host, port) = (&arguments.host, arguments.port);
        Failure::input(format!("cannot serve on {host}:{port}: {error}; another --port may be free"))
    };
    let listener = TcpListener::bind((arguments.host.as_str(), arguments.port));
    let listener = listener.map_err(|error| cannot_serve(&error))?;
    let address = listener.local_addr().map_err(|error| cannot_serve(&error))?;
    let hidden = origin::hidden_address();
    let server = WebSocketServer::new()
        .name("chainmail")
        .bind(hidden.to_string(), 0)
        .capabilities([Capability::Time])
        .playback_time_range(0, stage.end_ns())
        .listener(player.clone())
        .context(&context)
        .start_blocking()
        .map_err(|error| cannot_serve(&error))?;
    origin::guard(listener, (hidden, server.port()).into(), arguments.origin.clone());
    say(format!("serving {} on ws://{}:{}", log.file(), arguments.host, address.port()));
    let mut shown = Shown::default();
    let mut before = Instant::now();
    while !stop::requested() {
        let now = Instant::now();
        let tick = player.advance(now - before);
        before = now;
        server.broadcast_time(tick.position_ns);
        stage.show(&tick, &mut shown, &mut |channel, time_ns, bytes| {
            channels[channel].log_with_meta(bytes, PartialMetadata::with_log_time(time_ns));
            Ok(())
        })?;
        if tick.ended {
            server.broadcast_playback_state(player.state(&player.lock(), false, None));
        }
        std::thread::park_timeout(TICK);
    }
    server.stop().wait_blocking();
    Ok(Exit::Done)
}

fn channels(context: &Arc<Context>) -> Result<Vec<Arc<RawChannel>>, Failure> {
    let build = |channel: recorder::export::ViewChannel| {
        ChannelBuilder::new(channel.topic)
            .schema(Schema::new(channel.schema_name, channel.schema_encoding, channel.schema))
            .message_encoding(channel.encoding)
            .context(context)
            .build_raw()
            .map_err(Failure::lost)
    };
    Viewer::channels().into_iter().map(build).collect()
}

/// What there is to show.
struct Stage<'a> {
    viewer: Viewer<'a>,
    states: States<'a>,
    last_step: u64,
}

/// What was shown last.
#[derive(Default)]
struct Shown {
    step: Option<u64>,
    frame: Option<u64>,
}

impl<'a> Stage<'a> {
    fn new(log: &'a Log) -> Result<Stage<'a>, Failure> {
        let viewer = Viewer::new(log).map_err(failure)?;
        let last_step = (log.count(Kind::Step) as u64).saturating_sub(1);
        let states = States::new(log, crate::default_threads().get());
        Ok(Stage { viewer, states, last_step })
    }

    fn time_ns(&self, step: u64) -> u64 {
        log_time_ns(step as f64 * self.viewer.scene().time.time_step_s)
    }

    fn end_ns(&self) -> u64 {
        self.time_ns(self.last_step)
    }

    /// The last step at or before a time.
    fn step_at(&self, time_ns: u64) -> u64 {
        let (mut low, mut high) = (0, self.last_step);
        while low < high {
            let middle = high - (high - low) / 2;
            if self.time_ns(middle) <= time_ns {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        low
    }

    /// Sends what is new at a time, or everything to somebody who has just come or has sought.
    fn show(&mut self, tick: &Tick, shown: &mut Shown, put: &mut Put) -> Result<(), Failure> {
        let step = self.step_at(tick.position_ns);
        if tick.anew {
            *shown = Shown::default();
            self.viewer.put_scene(tick.position_ns, put).map_err(failure)?;
        }
        if shown.step == Some(step) {
            return Ok(());
        }
        shown.step = Some(step);
        let scene = self.viewer.scene();
        let time_ns = self.viewer.put_metrics(step, put).map_err(failure)?;
        if let Some(state) = self.states.state(step).map_err(log_file::failure)? {
            self.viewer.put_state(&state, time_ns, put).map_err(failure)?;
        }
        let frame = (0..=step).rev().find_map(|step| scene.time.frame_at(step));
        if frame != shown.frame
            && let Some(frame) = frame
        {
            shown.frame = Some(frame);
            self.viewer.put_frame(frame, time_ns, put).map_err(failure)?;
        }
        if step == self.last_step {
            self.viewer.put_end(time_ns, put).map_err(failure)?;
        }
        Ok(())
    }
}

fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::Log(error) => log_file::failure(error),
        error => Failure::lost(error),
    }
}

/// Where the playback is, moved by the clock and by those who watch.
struct Player {
    end_ns: u64,
    playback: Mutex<Playback>,
}

struct Playback {
    position_ns: f64,
    playing: bool,
    /// Simulated seconds in a second of time.
    rate: f32,
    /// Whether everything is to be sent again.
    anew: bool,
}

/// One look at the clock.
struct Tick {
    position_ns: u64,
    anew: bool,
    /// Whether the end was reached just now.
    ended: bool,
}

impl Player {
    fn new(end_ns: u64, playing: bool, rate: f32) -> Player {
        Player { end_ns, playback: Mutex::new(Playback { position_ns: 0.0, playing, rate, anew: true }) }
    }

    fn lock(&self) -> MutexGuard<'_, Playback> {
        // Nothing in here is ever half done.
        self.playback.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn advance(&self, elapsed: Duration) -> Tick {
        let mut playback = self.lock();
        let mut ended = false;
        if playback.playing {
            playback.position_ns += elapsed.as_secs_f64() * 1e9 * f64::from(playback.rate);
            if playback.position_ns >= self.end_ns as f64 {
                playback.position_ns = self.end_ns as f64;
                playback.playing = false;
                ended = true;
            }
        }
        let anew = std::mem::take(&mut playback.anew);
        Tick { position_ns: playback.position_ns as u64, anew, ended }
    }

    fn state(&self, playback: &Playback, did_seek: bool, request_id: Option<String>) -> PlaybackState {
        let position_ns = playback.position_ns as u64;
        let status = match playback.playing {
            true => PlaybackStatus::Playing,
            false if position_ns >= self.end_ns => PlaybackStatus::Ended,
            false => PlaybackStatus::Paused,
        };
        let playback_speed = playback.rate;
        PlaybackState { status, current_time: position_ns, playback_speed, did_seek, request_id }
    }
}

impl ServerListener for Player {
    fn on_subscribe(&self, _: Client, _: ChannelView) {
        self.lock().anew = true;
    }

    fn on_playback_control_request(&self, request: PlaybackControlRequest) -> Option<PlaybackState> {
        let mut playback = self.lock();
        if let Some(time_ns) = request.seek_time {
            playback.position_ns = if time_ns < self.end_ns { time_ns } else { self.end_ns } as f64;
            playback.anew = true;
        }
        if request.playback_speed > 0.0 && request.playback_speed.is_finite() {
            playback.rate = request.playback_speed;
        }
        let at_the_end = playback.position_ns as u64 >= self.end_ns;
        playback.playing = request.playback_command == PlaybackCommand::Play && !at_the_end;
        Some(self.state(&playback, request.seek_time.is_some(), Some(request.request_id)))
    }
}
