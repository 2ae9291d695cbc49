//! Whole recordings: annotating against plain copies that add the same bytes, chunks taken over as
//! they are against compressing them again, what a frame costs by sensor and stage, the part that
//! no core can share, and memory by length.
//!
//! The drive is the simulator's street under an HDL-64E: 50 frames, over and over. Runs of a round
//! follow one another, and each figure is the best of all rounds, so that ratios are of one machine
//! in one state. Beside the time on the clock stands the time on processors (Linux), which other
//! work on the machine does not count in: of the whole process, and of the one thread that reads,
//! hashes, copies and writes. On n idle cores a frame takes the larger of the latter and an n-th of
//! the former.
//!
//! `cargo bench --bench annotate` (`-- --quick` for a look; `-- --copies` for the copies alone; `--
//! --frames 1000 --rounds 1` for a long drive).

mod copies;
mod cost;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, Annotated, MessageTypes, Profile, RunEvent, annotate,
    annotate_message,
};
use divmerge::datasets::drive::{CLOUD_TOPIC, cloud_message};
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::CloudFormat;
use divmerge::messages::definitions::{MARKER_ARRAY, POINT_CLOUD2};
use divmerge::recording::workers::Workers;
use divmerge::recording::{MessageHeader, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use copies::Copies;
use cost::Cost;

/// The most that annotating may take, times a plain copy.
const GOAL_RATIO: f64 = 1.15;

/// How much faster chunks are to be taken over than compressed again.
const GOAL_PASS: f64 = 5.0;

/// Bytes of a picture, and pictures to a frame: ten times the bytes of the clouds in the file.
const PICTURE: usize = 1 << 20;

const PICTURES: usize = 20;

/// Frames that differ.
const LOOP: usize = 50;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)?.parse::<usize>().ok()
    };
    let quick = arguments.iter().any(|argument| argument == "--quick");
    let frames = value("--frames").unwrap_or(if quick { 10 } else { 100 });
    let rounds = value("--rounds").unwrap_or(if quick { 1 } else { 3 });
    let folder = tempfile::tempdir().expect("a folder");
    let street = Messages::simulate(Sensor::Hdl64e, frames.min(LOOP));
    let input = folder.path().join("drive.mcap");
    street.write(frames, &input);
    let copies = Copies { input: &input, output: folder.path().join("out.mcap"), street: &street };
    copies.compare(frames, rounds);
    let cameras = folder.path().join("cameras.mcap");
    let few = frames.min(30);
    street.write_with_cameras(few, &cameras);
    let copies = Copies { input: &cameras, output: copies.output, street: &street };
    copies.compare_with_cameras(few, rounds);
    let _ = std::fs::remove_file(&cameras);
    if arguments.iter().any(|argument| argument == "--copies") {
        return;
    }
    let mut lengths = if quick { vec![10, 20] } else { vec![100, 300, frames.max(300)] };
    lengths.dedup();
    memory(&street, &lengths, folder.path());
    sensors(if quick { 3 } else { 20 }, rounds, folder.path());
}

/// Messages of a drive: clouds, and what annotating adds to each.
struct Messages {
    clouds: Vec<Vec<u8>>,
    added: Vec<[Vec<u8>; 2]>,
}

impl Messages {
    fn simulate(sensor: Sensor, frames: usize) -> Self {
        let drive = Drive::new(sensor, Scene::Street, 1);
        let (method, mut annotated) = (AnnotateConfig::default(), Annotated::default());
        let mut messages = Messages { clouds: Vec::new(), added: Vec::new() };
        for number in 0..frames {
            let mut message = Vec::new();
            cloud_message(&drive.frame(number), &mut message).expect("a simulated frame");
            let encoded = EncodedCloud::of_message(CloudFormat::Ros2, message.clone());
            annotate_message(&encoded, &method, &MessageTypes::default(), &mut annotated)
                .expect("annotated");
            messages.clouds.push(message);
            messages.added.push([annotated.cloud.clone(), annotated.objects.clone()]);
        }
        messages
    }

    /// The same with pictures to each frame, in chunks as recorders make them: a message of a
    /// megabyte fills one.
    fn write_with_cameras(&self, frames: usize, path: &Path) {
        let file = BufWriter::new(File::create(path).expect("a file"));
        let options = mcap::WriteOptions::new().profile("ros2").compression_threads(0);
        let options = options.compression(Some(mcap::Compression::Zstd)).compression_level(1);
        let mut writer = options.create(file).expect("a writer");
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let none = BTreeMap::new();
        let (name, text) = (POINT_CLOUD2.name, &POINT_CLOUD2.data);
        let schema = writer.add_schema(name, "ros2msg", text).expect("a schema");
        let clouds = writer.add_channel(schema, CLOUD_TOPIC, "cdr", &none).expect("a channel");
        let image = "sensor_msgs/msg/CompressedImage";
        let schema = writer.add_schema(image, "ros2msg", b"uint8[] data").expect("a schema");
        let camera = writer.add_channel(schema, "/camera", "cdr", &none).expect("a channel");
        let mut picture = vec![0; PICTURE];
        for number in 0..frames {
            let message = &self.clouds[number % self.clouds.len()];
            writer.write_to_known_channel(&header(clouds, number), message).expect("written");
            for _ in 0..PICTURES {
                random.fill_bytes(&mut picture);
                writer.write_to_known_channel(&header(camera, number), &picture).expect("written");
            }
        }
        writer.finish().expect("finished");
    }

    /// Writes so many frames, over and over.
    fn write(&self, frames: usize, path: &Path) {
        let options = WriteOptions { profile: "ros2".into(), ..WriteOptions::default() };
        let mut writer = RecordingWriter::create(path, &options).expect("a writer");
        writer.compress_on(&Workers::start(Workers::per_core()));
        let [channel_id, ..] = define(&mut writer);
        for number in 0..frames {
            let message = &self.clouds[number % self.clouds.len()];
            writer.write_message(&header(channel_id, number), message).expect("written");
        }
        writer.finish().expect("finished");
    }
}

fn header(channel_id: u16, number: usize) -> MessageHeader {
    let time = number as u64 * 100_000_000;
    MessageHeader { channel_id, sequence: number as u32, log_time: time, publish_time: time }
}

/// The channels of clouds, instances and objects, in this order and always under the same ids.
fn define(writer: &mut RecordingWriter) -> [u16; 3] {
    let none = BTreeMap::new();
    let cloud = POINT_CLOUD2.add_to(writer).expect("a schema");
    let markers = MARKER_ARRAY.add_to(writer).expect("a schema");
    [("", cloud), ("/added", cloud), ("/boxes", markers)].map(|(end, schema)| {
        let topic = format!("{CLOUD_TOPIC}{end}");
        writer.add_channel(&topic, schema, "cdr", &none).expect("a channel")
    })
}

fn mean(sizes: impl ExactSizeIterator<Item = usize>) -> f64 {
    let count = sizes.len().max(1);
    sizes.sum::<usize>() as f64 / 1e6 / count as f64
}

fn profile(input: &Path, output: &Path, threads: usize) -> Profile {
    profile_of(input, output, threads, &AnnotateOptions::default())
}

fn profile_of(input: &Path, output: &Path, threads: usize, options: &AnnotateOptions) -> Profile {
    let options = AnnotateOptions { threads, force: true, ..options.clone() };
    let go_on = &mut |_: RunEvent| ControlFlow::Continue(());
    annotate(input, output, &options, go_on).expect("annotated").profile
}

/// The most memory of the command, by the length of the drive.
fn memory(street: &Messages, lengths: &[usize], folder: &Path) {
    println!("memory at its peak, MB, of `divmerge annotate`\n");
    println!("| frames | 1 thread | 2 threads | 8 threads |\n| ---: | ---: | ---: | ---: |");
    let [input, output] = ["long.mcap", "long.annotated.mcap"].map(|name| folder.join(name));
    for &frames in lengths {
        let _ = std::fs::remove_file(&input);
        street.write(frames, &input);
        let peak = |threads: &str| {
            let run = Command::new(env!("CARGO_BIN_EXE_divmerge"))
                .args(["annotate", "--force", "--profile", "--threads", threads, "-o"])
                .args([&output, &input])
                .output()
                .expect("the command");
            let text = String::from_utf8_lossy(&run.stdout).into_owned();
            let line = text.lines().find_map(|line| line.strip_prefix("memory at its peak: "));
            line.unwrap_or("?").trim_end_matches(" MB").to_owned()
        };
        println!("| {frames} | {} | {} | {} |", peak("1"), peak("2"), peak("8"));
    }
    println!();
}

/// What a frame costs by sensor, on one thread by stage and on two by thread, and what follows for
/// more cores.
fn sensors(frames: usize, rounds: usize, folder: &Path) {
    println!(
        "{frames} frames of each sensor, best of {rounds} rounds, ms per frame: stages by the \
         clock on one"
    );
    println!("thread, then time on processors with two, and what follows for idle cores\n");
    println!(
        "| sensor | points | decompress | cluster | encode | compress | all | thread that reads \
         and writes \
         | frames/s on 1 core | 2 | 4 | 8 | 16 | 32 |"
    );
    println!("| --- |{}", " ---: |".repeat(13));
    let [input, output] = ["sensor.mcap", "sensor.annotated.mcap"].map(|name| folder.join(name));
    for sensor in [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Hdl64e, Sensor::Os1_128] {
        let messages = Messages::simulate(sensor, frames);
        let _ = std::fs::remove_file(&input);
        messages.write(frames, &input);
        let runs = (0..rounds).map(|_| profile(&input, &output, 1));
        let best = runs.min_by(|a, b| a.wall_ms.total_cmp(&b.wall_ms)).expect("a round");
        let cost = |_| Cost::of(frames, || drop(profile(&input, &output, 2)));
        let cost = (0..rounds).map(cost).fold(Cost::MOST, Cost::least);
        print_sensor(&format!("{sensor}"), points(&messages.clouds), &best, cost, frames as f64);
    }
}

/// Mean points of a frame.
fn points(clouds: &[Vec<u8>]) -> f64 {
    let count =
        |message: &Vec<u8>| CloudFormat::Ros2.decode(message).expect("a cloud").point_count();
    clouds.iter().map(count).sum::<usize>() as f64 / clouds.len() as f64
}

/// A core more helps until what one thread does alone is what remains.
fn print_sensor(name: &str, points: f64, profile: &Profile, cost: Cost, frames: f64) {
    let stages = [profile.read.unpack, profile.cluster, profile.encode, profile.write.compress];
    let stages = stages.map(|steps| format!("{:.2}", steps.ms / frames)).join(" | ");
    let Cost { all, alone, .. } = cost;
    let rates = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0].map(|cores: f64| 1e3 / alone.max(all / cores));
    let rates = rates.map(|rate| format!("{rate:.0}")).join(" | ");
    println!("| {name} | {points:.0} | {stages} | {all:.2} | {alone:.2} | {rates} |");
}
