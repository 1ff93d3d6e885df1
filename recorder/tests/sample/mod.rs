//! A made-up run whose messages keep every promise of a log, small enough to be cut at every byte.
#![allow(dead_code)] // each test file uses a part of it

use prost::Message as _;
use recorder::{Kind, Log, LogWriter, Message, Sequencer};
use schemas::end::{End, Outcome};
use schemas::frame::{CompressedImage, FrameInfo};
use schemas::plan::Plan;
use schemas::scene::{Scene, SceneRecord};
use schemas::state::{BodyState, ContactState, StateHeader};
use schemas::step::{Audit, StageHashes, StepRecord};
use schemas::{Hash, chain, log_time_ns, state, wire};

/// What to make up.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub rings: u32,
    /// Steps of the plan, 0.01 s each; a frame is taken at every other step.
    pub steps_planned: u64,
    /// Steps done; fewer than planned is an interrupted run.
    pub steps: u64,
    pub state_every: u64,
    pub renderer: bool,
}

impl Default for Run {
    fn default() -> Run {
        Run { rings: 2, steps_planned: 6, steps: 6, state_every: 1, renderer: true }
    }
}

/// The messages of a run, each kind in the order in which it is sent.
#[derive(Clone, Debug, Default)]
pub struct Messages(pub [Vec<Message<'static>>; 6]);

impl Run {
    pub fn scene(&self) -> Scene {
        let text = format!(
            "[time]\nduration_s = {}\ntime_step_s = 0.01\nframes_per_second = 50.0\n\
             [record]\nstate_every = {}\n[material.steel]\n\
             [[weave]]\npattern = \"chain\"\nrows = 1\ncolumns = {}\nmajor_radius_m = 0.5\n\
             minor_radius_m = 0.1\nring_mass_kg = 1.0\nmaterial = \"steel\"\n\
             [render]\nwidth_px = 2\nheight_px = 2\n",
            self.steps_planned as f64 * 0.01,
            self.state_every,
            self.rings
        );
        Scene::parse(&text, &[]).expect("a scene")
    }

    pub fn messages(&self) -> Messages {
        let scene = self.scene();
        let mut messages = Messages::default();
        let mut push = |kind: Kind, time_ns: u64, bytes: Vec<u8>| {
            messages.0[kind.index()].push(Message::new(kind, time_ns, bytes));
        };
        let record = SceneRecord::new(scene.clone(), Plan::default());
        push(Kind::Scene, 0, serde_json::to_vec(&record).expect("JSON"));
        let mut chained_hash = Hash::default();
        let (mut state_count, mut keyframe_count) = (0, 0);
        for step in 0..=self.steps {
            let mut bytes = Vec::new();
            let state_hash = encode_state(step, self.rings, &mut bytes);
            let sim_time_s = step as f64 * 0.01;
            let time_ns = log_time_ns(sim_time_s);
            if scene.state_is_recorded(step) || step == self.steps {
                state_count += 1;
                push(Kind::State, time_ns, bytes);
            }
            chained_hash = chain(&chained_hash, &state_hash);
            let record = step_record(&scene, step, state_hash, chained_hash);
            push(Kind::Step, time_ns, serde_json::to_vec(&record).expect("JSON"));
            if scene.time.frame_at(step).is_some() {
                if self.renderer {
                    let info = frame_info(&scene, keyframe_count, step, state_hash);
                    let image = CompressedImage::png(time_ns, png(step as u8));
                    push(Kind::Frame, time_ns, image.encode_to_vec());
                    push(Kind::FrameInfo, time_ns, serde_json::to_vec(&info).expect("JSON"));
                }
                keyframe_count += 1;
            }
        }
        let outcome =
            if self.steps == self.steps_planned { Outcome::Completed } else { Outcome::Interrupted };
        let end = End { outcome, step_count: self.steps, state_count, keyframe_count, chained_hash };
        push(Kind::End, log_time_ns(self.steps as f64 * 0.01), wire::encode(&end));
        messages
    }

    /// The run's messages in the order of the log.
    pub fn in_order(&self) -> Vec<Message<'static>> {
        let mut sequencer = Sequencer::new(self.renderer);
        let mut ordered = Vec::new();
        // One kind after the other; the bound on what waits is not asked for here.
        for message in self.messages().0.into_iter().flatten() {
            sequencer.push(message).expect("a place");
        }
        while let Some(message) = sequencer.next().expect("a place") {
            ordered.push(message);
        }
        assert!(sequencer.is_done() && sequencer.pending_count() == 0);
        ordered
    }

    pub fn log_bytes(&self) -> Vec<u8> {
        write(&self.in_order(), self.renderer)
    }

    pub fn log(&self) -> Log {
        Log::from_bytes("sample", self.log_bytes()).expect("a log")
    }
}

/// Writes messages as they come.
pub fn write(messages: &[Message], renderer: bool) -> Vec<u8> {
    let mut writer = LogWriter::create(Vec::new(), renderer).expect("memory");
    for message in messages {
        writer.write(message).expect("a valid message");
    }
    writer.finish().expect("memory").0
}

/// Bodies of a step: no two numbers alike.
pub fn bodies(step: u64, rings: u32) -> Vec<BodyState> {
    let value =
        |ring: u32, field: u32| f64::from(ring) + f64::from(field) / 16.0 + step as f64 * 1e-3 + 1.0 / 3.0;
    let body = |ring: u32| BodyState {
        position_m: [0, 1, 2].map(|axis| value(ring, axis)),
        orientation: [3, 4, 5, 6].map(|axis| value(ring, axis)),
        linear_velocity_m_per_s: [7, 8, 9].map(|axis| value(ring, axis)),
        angular_velocity_rad_per_s: [10, 11, 12].map(|axis| value(ring, axis)),
    };
    (0..rings).map(body).collect()
}

fn encode_state(step: u64, rings: u32, bytes: &mut Vec<u8>) -> Hash {
    let contact =
        ContactState { body_b: 1, mid_cos: 1.0, spring_m: [1e-3 * step as f64; 3], ..Default::default() };
    let contacts = if rings > 1 { &[contact][..] } else { &[] };
    let header = StateHeader { step, sim_time_s: step as f64 * 0.01, ..Default::default() };
    state::encode(&header, &bodies(step, rings), contacts, bytes)
}

fn step_record(scene: &Scene, step: u64, state_hash: Hash, chained_hash: Hash) -> StepRecord {
    let audit =
        scene.time.is_audited(step).then_some(Audit { links: 1, links_intact: 1, gap_min_m: Some(0.01) });
    StepRecord {
        step,
        sim_time_s: step as f64 * 0.01,
        candidate_pairs: 1,
        contacts: 1,
        kinetic_energy_j: 0.1 * step as f64,
        gravity_energy_j: 1.0 - 0.1 * step as f64,
        contact_energy_j: 0.0,
        dissipated_energy_j: 0.0,
        penetration_m: 1e-4 * step as f64,
        penetration_beyond_bound: None,
        surface_samples: None,
        error_estimate_m: None,
        drive_work_j: None,
        reactions: None,
        audit,
        stages: StageHashes {
            candidate_pairs: Hash::of(b"pairs").short(),
            contacts: Hash::of(&step.to_le_bytes()).short(),
            forces: Hash::of(&state_hash.0).short(),
            state: state_hash.short(),
        },
        state_hash,
        chained_hash,
    }
}

fn frame_info(scene: &Scene, frame: u64, step: u64, state_hash: Hash) -> FrameInfo {
    FrameInfo {
        frame,
        step,
        sim_time_s: step as f64 * 0.01,
        state_hash,
        film_hash: Hash::of(&[step as u8]),
        samples: 64,
        first_non_finite: None,
        environment_hash: None,
        rays: 4,
        non_finite_samples: 0,
        render: scene.render.clone(),
        plan: Plan::default(),
    }
}

/// A PNG of 2 x 2 pixels of one grey.
pub fn png(grey: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().expect("memory").write_image_data(&[grey; 12]).expect("memory");
    bytes
}

/// Bytes before the first body of a state.
pub const BODIES_AT: usize = size_of::<StateHeader>() + 8;

/// The run again, with states changed from a step on, and all hashes made anew: a run that went another way.
pub fn another_run(run: Run, change: impl Fn(u64, &mut Vec<u8>)) -> Vec<u8> {
    let mut chained_hash = Hash::default();
    let mut hashes = Vec::new();
    let mut messages = run.in_order();
    for message in &mut messages {
        let bytes = message.bytes.to_mut();
        match message.kind {
            Kind::State => {
                change(state::decode_header(bytes).expect("a state").step, bytes);
                let hash = state::hash_of(bytes);
                bytes[24..56].copy_from_slice(&hash.0);
                hashes.push(hash);
            }
            Kind::Step => {
                let mut record: StepRecord = serde_json::from_slice(bytes).expect("a record");
                record.state_hash = *hashes.last().expect("every state is logged");
                record.stages.state = record.state_hash.short();
                chained_hash = chain(&chained_hash, &record.state_hash);
                record.chained_hash = chained_hash;
                *bytes = serde_json::to_vec(&record).expect("JSON");
            }
            Kind::FrameInfo => {
                let mut info: FrameInfo = serde_json::from_slice(bytes).expect("an info");
                info.state_hash = hashes[info.step as usize];
                *bytes = serde_json::to_vec(&info).expect("JSON");
            }
            Kind::End => {
                let end: End = wire::decode(bytes).expect("an end");
                *bytes = wire::encode(&End { chained_hash, ..end });
            }
            Kind::Scene | Kind::Frame => {}
        }
    }
    write(&messages, run.renderer)
}

/// Flips a bit of a number of a body in a state message.
pub fn flip(bytes: &mut [u8], body: usize, field: usize, bit: u32) {
    let at = BODIES_AT + 104 * body + 8 * field;
    let mut number: [u8; 8] = bytes[at..at + 8].try_into().expect("8 bytes");
    number = (u64::from_le_bytes(number) ^ (1 << bit)).to_le_bytes();
    bytes[at..at + 8].copy_from_slice(&number);
}

/// Alters a message where it lies; with `mend_crc`, its chunk's checksum is made right again.
pub fn alter_in_file(
    log: &[u8],
    (kind, index): (Kind, usize),
    mend_crc: bool,
    alter: impl Fn(&mut [u8]),
) -> Vec<u8> {
    let mut bytes = log.to_vec();
    let opened = Log::from_bytes("a", bytes.clone()).expect("a log");
    let message = opened.nth(kind, index).expect("a message").bytes.into_owned();
    let at = bytes.windows(message.len()).position(|window| window == message).expect("it lies in the file");
    alter(&mut bytes[at..at + message.len()]);
    if mend_crc {
        let mut offset = 8;
        while offset < at {
            let length =
                u64::from_le_bytes(bytes[offset + 1..offset + 9].try_into().expect("8 bytes")) as usize;
            let end = offset + 9 + length;
            if bytes[offset] == 6 && end > at {
                // A chunk's body: two times, size, CRC, an empty text, size, records.
                let crc = crc32fast::hash(&bytes[offset + 9 + 40..end]);
                bytes[offset + 33..offset + 37].copy_from_slice(&crc.to_le_bytes());
            }
            offset = end;
        }
    }
    bytes
}
