//! A whole frame on one core, milliseconds per stage.
//!
//! First from the decoded cloud to a label per point, on the labelled scans of
//! ../shared/data/semantickitti where they are: the scan that takes the median time and the one
//! that takes the longest, and the ratio to copying the cloud's columns once, measured in the same
//! run. Then worst cases, built here. Then from message bytes to annotated message bytes, on
//! simulated frames and on those of ../shared/data/recordings where they are, and the ratio to
//! copying the annotated bytes once.
//!
//! `cargo bench --bench frame` (`-- --quick` for a tenth of the rounds).

use std::path::Path;
use std::time::Instant;

use divmerge::annotate::{
    AnnotateConfig, Annotated, FrameTimes, MessageTypes, Semantics, annotate_message,
};
use divmerge::datasets::drive::cloud_message;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::CloudFormat;
use divmerge::pipeline::{self, Config, StageTimes};
use divmerge::recording::{Record, RecordingReader};
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

/// The most that the median frame may take from message to message, in milliseconds.
const GOAL_MS: f64 = 25.0;
/// The most that the median scan may take from cloud to labels with `best`, in milliseconds.
const SCAN_GOAL_MS: f64 = 3.0;
/// The same of the slowest scan.
const SLOWEST_SCAN_GOAL_MS: f64 = 10.0;
/// The most that the worst case may take.
const WORST_GOAL_MS: f64 = 100.0;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let rounds = if quick { 2 } else { 20 };
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    cloud_to_labels(&data.join("semantickitti"), rounds);
    worst_cases(rounds.min(5));
    message_to_message(&data.join("recordings"), rounds);
}

/// Frames in which 100,000 points are of one class and lie in some 5,000 pieces: a hedge of people
/// all around, so many metres deep.
fn worst_cases(rounds: usize) {
    println!(
        "worst cases, decoded cloud to labels, ms, best of {rounds} rounds; goal: total at most \
         {WORST_GOAL_MS} ms\n"
    );
    print_scan_head();
    for depth in [1.0, 3.0, 6.0] {
        let scan = measure(&hedge(depth), &Config::best(), rounds);
        print_scan("best", &format!("hedge, {depth} m deep"), &scan, Some(WORST_GOAL_MS));
    }
    println!();
}

/// Patches of 4 rows x 5 columns, each at a range of its own.
fn hedge(depth: f64) -> PointCloud {
    const PERSON: u16 = 30;
    const ROWS: usize = 64;
    const COLUMNS: usize = 1600;
    let (mut x, mut y, mut z) = (vec![], vec![], vec![]);
    for point in 0..ROWS * COLUMNS {
        let (row, column) = (point / COLUMNS, point % COLUMNS);
        let patch = (column / 5) * 7919 + (row / 4) * 104_729;
        let range = 9.0 + depth * (patch % 1000) as f64 / 1000.0;
        let azimuth = std::f64::consts::TAU * column as f64 / COLUMNS as f64;
        let elevation = (10.0 - 30.0 * row as f64 / ROWS as f64).to_radians();
        x.push((range * azimuth.cos()) as f32);
        y.push((range * azimuth.sin()) as f32);
        z.push((range * elevation.tan()) as f32);
    }
    let cloud = PointCloud::new(x, y, z).and_then(|cloud| cloud.organised(ROWS, COLUMNS));
    let cloud = cloud.and_then(|cloud| cloud.with_class(vec![PERSON; ROWS * COLUMNS]));
    cloud.expect("columns of one length")
}

/// Milliseconds of one scan: the fastest round, and the fastest copy.
struct Scan {
    points: usize,
    objects: usize,
    instances: usize,
    times: StageTimes,
    copy_ms: f64,
}

fn cloud_to_labels(data: &Path, rounds: usize) {
    let scans = labelled_scans(data).unwrap_or_default();
    if scans.is_empty() {
        println!("(no {}: real scans skipped)", data.display());
        return;
    }
    let clouds: Vec<PointCloud> = scans.iter().map(read_cloud).collect();
    println!("decoded cloud to labels, {} scans, ms, best of {rounds} rounds each\n", scans.len());
    print_scan_head();
    for config in [Config::best(), Config::paper()] {
        let mut measured: Vec<Scan> =
            clouds.iter().map(|cloud| measure(cloud, &config, rounds)).collect();
        measured.sort_by(|a, b| a.times.total_ms().total_cmp(&b.times.total_ms()));
        let is_best = config.preset == Config::best().preset;
        let goals = [SCAN_GOAL_MS, SLOWEST_SCAN_GOAL_MS].map(|goal| is_best.then_some(goal));
        print_scan(config.preset, "median", &measured[measured.len() / 2], goals[0]);
        print_scan(config.preset, "slowest", &measured[measured.len() - 1], goals[1]);
    }
    println!();
}

fn read_cloud(scan: &LabelledScan) -> PointCloud {
    let words = read_labels(&scan.labels).expect("labels");
    let classes = words.iter().map(|&word| word as u16).collect();
    read_scan(&scan.scan).expect("a scan").with_class(classes).expect("a label for each point")
}

fn measure(cloud: &PointCloud, config: &Config, rounds: usize) -> Scan {
    let taxonomy = Taxonomy::semantic_kitti();
    let (mut points, mut objects, mut instances) = (0, 0, 0);
    let (mut times, mut copy_ms) = (None::<StageTimes>, f64::INFINITY);
    for _ in 0..rounds {
        let started = Instant::now();
        let copy = std::hint::black_box(cloud).clone();
        std::hint::black_box(&copy);
        copy_ms = copy_ms.min(started.elapsed().as_secs_f64() * 1e3);
        let stages = pipeline::run(&copy, MaskSource::Classes(&taxonomy), config);
        (points, objects) = (stages.labels.reason.len(), stages.objects.len());
        instances = stages.instances.len();
        let faster = times.is_none_or(|best| stages.times.total_ms() < best.total_ms());
        times = if faster { Some(stages.times) } else { times };
    }
    Scan { points, objects, instances, times: times.unwrap_or_default(), copy_ms }
}

/// The head of a table in Markdown: a column of words and some of numbers.
fn print_head(words: &str, numbers: &[&str]) {
    println!("| {words:<34} | {} |", numbers.join(" | "));
    println!("| {} |{}", "-".repeat(34), " ---: |".repeat(numbers.len()));
}

fn print_scan_head() {
    let numbers = [
        "points",
        "objects",
        "instances",
        "project",
        "mask",
        "divide",
        "merge",
        "label",
        "total",
        "/copy",
        "goal",
    ];
    print_head("preset, scan", &numbers);
}

fn print_scan(preset: &str, which: &str, scan: &Scan, goal_ms: Option<f64>) {
    let Scan { points, objects, instances, times, copy_ms } = scan;
    let total = times.total_ms();
    println!(
        "| {:<34} | {points:>8} | {objects:>8} | {instances:>9} | {:>7.2} | {:>7.2} | {:>7.2} | \
         {:>7.2} | {:>7.2} | {total:>7.2} | {:>7.1} | {} |",
        format!("{preset}, {which}"),
        times.projection_ms,
        times.mask_ms,
        times.divide_ms,
        times.merge_ms,
        times.labels_ms,
        total / copy_ms,
        if goal_ms.is_some_and(|goal| total > goal) { "over" } else { "" },
    );
}

fn message_to_message(data: &Path, rounds: usize) {
    println!("message to message, ms, median of {rounds} rounds; goal: total at most {GOAL_MS} ms");
    let mut sets: Vec<(String, Vec<Vec<u8>>)> = [Scene::Street, Scene::Parking, Scene::Crowd]
        .map(|scene| (format!("simulated {scene}"), simulated(scene)))
        .into();
    match recorded(&data.join("semantickitti_04_ros2.mcap")) {
        Some(messages) => sets.push(("SemanticKITTI 04".into(), messages)),
        None => println!("(no {}: real frames skipped)", data.display()),
    }
    let numbers = [
        "points", "objects", "decode", "project", "mask", "divide", "merge", "label", "encode",
        "total", "/copy", "goal",
    ];
    println!();
    print_head("frames, mask, preset", &numbers);
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

fn report(
    name: &str,
    messages: &[Vec<u8>],
    semantics: &Semantics,
    pipeline: Config,
    rounds: usize,
) {
    let method =
        AnnotateConfig { semantics: semantics.clone(), pipeline, ..AnnotateConfig::default() };
    let mut frames: Vec<(f64, FrameTimes, f64, usize, usize)> = Vec::new();
    let mut annotated = Annotated::default();
    let encoded = |message: &Vec<u8>| EncodedCloud::of_message(CloudFormat::Ros2, message.clone());
    let clouds: Vec<EncodedCloud> = messages.iter().map(encoded).collect();
    for _ in 0..rounds {
        for cloud in &clouds {
            let types = MessageTypes::default();
            let clustered =
                annotate_message(cloud, &method, &types, &mut annotated).expect("annotated");
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
        "| {:<34} | {points:>8} | {objects:>8} | {:>7.2} | {:>7.2} | {:>7.2} | {:>7.2} | {:>7.2} | \
         {:>7.2} | {:>7.2} | {total:>7.2} | {:>7.1} | {} |",
        format!("{name}, {mask}, {}", method.pipeline.preset),
        times.decode_ms,
        stages.projection_ms,
        stages.mask_ms,
        stages.divide_ms,
        stages.merge_ms,
        stages.labels_ms,
        times.encode_ms,
        total / copy,
        if total > GOAL_MS { "over" } else { "" },
    );
}

/// Milliseconds to copy some bytes into fresh memory.
fn copy_ms(bytes: &[u8]) -> f64 {
    let started = Instant::now();
    let copy = std::hint::black_box(bytes).to_vec();
    std::hint::black_box(&copy);
    started.elapsed().as_secs_f64() * 1e3
}
