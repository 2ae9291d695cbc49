//! A whole frame, message bytes to annotated message bytes, on one core: milliseconds per stage, and the
//! ratio to copying the annotated bytes once, measured in the same run.
//!
//! `cargo bench --bench frame` (`-- --quick` for a tenth of the frames). Simulated frames always; those
//! of ../shared/data/recordings where it is there.

use std::path::Path;
use std::time::Instant;

use divmerge::annotate::{Annotated, FrameTimes, Method, Semantics, annotate_message};
use divmerge::io::drive::cloud_message;
use divmerge::io::{Record, RecordingReader};
use divmerge::pipeline::Config;
use divmerge::simulate::{Drive, Scene, Sensor};

/// The most that the median frame may take, in milliseconds.
const GOAL_MS: f64 = 25.0;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let rounds = if quick { 2 } else { 20 };
    println!("median of {rounds} rounds, ms per frame; goal: total at most {GOAL_MS} ms");
    println!(
        "{:<34} {:>8} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7}",
        "frames, mask, preset",
        "points",
        "objects",
        "decode",
        "project",
        "mask",
        "divide",
        "merge",
        "label",
        "encode",
        "total",
        "/copy"
    );
    let mut sets: Vec<(String, Vec<Vec<u8>>)> = [Scene::Street, Scene::Parking, Scene::Crowd]
        .map(|scene| (format!("simulated {scene}"), simulated(scene)))
        .into();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/recordings");
    match recorded(&data.join("semantickitti_04_ros2.mcap")) {
        Some(messages) => sets.push(("SemanticKITTI 04".into(), messages)),
        None => println!("(no {}: real frames skipped)", data.display()),
    }
    for (name, messages) in &sets {
        for semantics in [Semantics::Auto, Semantics::Ground] {
            for config in [Config::best(), Config::paper()] {
                report(name, messages, &semantics, config, rounds);
            }
        }
    }
}

fn simulated(scene: Scene) -> Vec<Vec<u8>> {
    let drive = Drive::new(Sensor::Hdl64e, scene, 1);
    let message = |number: usize| {
        let mut message = Vec::new();
        cloud_message(&drive.frame(number * 10), &mut message).expect("a simulated frame");
        message
    };
    (0..3).map(message).collect()
}

fn recorded(path: &Path) -> Option<Vec<Vec<u8>>> {
    let mut reader = RecordingReader::open(path).ok()?;
    let mut messages = Vec::new();
    while let Some(record) = reader.next_record().expect("a whole recording") {
        if let Record::Message { data, .. } = record
            && data.len() > 1_000_000
        {
            messages.push(data.into_owned());
        }
    }
    Some(messages)
}

fn report(name: &str, messages: &[Vec<u8>], semantics: &Semantics, config: Config, rounds: usize) {
    let method = Method { semantics: semantics.clone(), config, ..Method::default() };
    let mut frames: Vec<(f64, FrameTimes, f64, usize, usize)> = Vec::new();
    let mut annotated = Annotated::default();
    for _ in 0..rounds {
        for message in messages {
            let clustered = annotate_message(message, &method, &mut annotated).expect("annotated");
            let stages = &clustered.stages;
            let copy = copy_ms(&annotated.cloud);
            let (points, objects) = (stages.labels.reason.len(), stages.objects.len());
            let times = annotated.times;
            frames.push((times.total_ms(), times, copy, points, objects));
        }
    }
    frames.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (total, times, copy, points, objects) = frames[frames.len() / 2];
    let mask = if *semantics == Semantics::Ground { "ground" } else { "things" };
    let stages = times.stages;
    println!(
        "{:<34} {points:>8} {objects:>8} {:>7.2} {:>7.2} {:>7.2} {:>7.2} {:>7.2} {:>7.2} {:>7.2} {total:>7.2} {:>7.1}{}",
        format!("{name}, {mask}, {}", method.config.preset),
        times.decode_ms,
        stages.projection_ms,
        stages.mask_ms,
        stages.divide_ms,
        stages.merge_ms,
        stages.labels_ms,
        times.encode_ms,
        total / copy,
        if total > GOAL_MS { "  over the goal" } else { "" },
    );
}

/// Milliseconds to copy some bytes into fresh memory.
fn copy_ms(bytes: &[u8]) -> f64 {
    let started = Instant::now();
    let copy = std::hint::black_box(bytes).to_vec();
    std::hint::black_box(&copy);
    started.elapsed().as_secs_f64() * 1e3
}
