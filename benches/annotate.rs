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

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use divmerge::annotate::{
    Annotated, Event, MessageTypes, Method, Options, Profile, annotate, annotate_message,
};
use divmerge::io::drive::{CLOUD_TOPIC, cloud_message};
use divmerge::io::{
    CloudFormat, CloudNumber, Compression, Item, MARKER_ARRAY, MessageHeader, Overview,
    POINT_CLOUD2, Part, ReadFilter, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::workers::Workers;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

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
        let (method, mut annotated) = (Method::default(), Annotated::default());
        let mut messages = Messages { clouds: Vec::new(), added: Vec::new() };
        for number in 0..frames {
            let mut message = Vec::new();
            cloud_message(&drive.frame(number), &mut message).expect("a simulated frame");
            let which = CloudNumber { topic: CLOUD_TOPIC, number: number as u64 };
            annotate_message(
                &message,
                CloudFormat::Ros2,
                which,
                &method,
                &MessageTypes::default(),
                &mut annotated,
            )
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

/// Ways to write a recording again.
struct Copies<'a> {
    input: &'a Path,
    output: PathBuf,
    street: &'a Messages,
}

impl Copies<'_> {
    fn compare(&self, frames: usize, rounds: usize) {
        let bytes = std::fs::metadata(self.input).expect("a drive").len();
        println!(
            "{frames} frames of an HDL-64E, {:.1} MB each as a message, {:.1} MB in the file, \
             {:.1} MB added; \
             {} cores; best of {rounds} rounds, ms per frame\n",
            mean(self.street.clouds.iter().map(Vec::len)),
            bytes as f64 / 1e6 / frames as f64,
            mean(self.street.added.iter().map(|added| added[0].len() + added[1].len())),
            Workers::per_core()
        );
        let runs: [(&str, &dyn Fn()); 13] = [
            ("annotate, 1 thread", &|| self.annotate(1)),
            ("annotate, 2 threads", &|| self.annotate(2)),
            ("plain copy and additions, mcap's writer", &|| self.mcap(true)),
            ("plain copy and additions, 1 thread", &|| self.again(1, true)),
            ("plain copy and additions, 2 threads", &|| self.again(2, true)),
            ("chunks as they are and additions, 1 thread", &|| self.verbatim(1, true)),
            ("chunks as they are and additions, 2 threads", &|| self.verbatim(2, true)),
            ("plain copy, mcap's writer", &|| self.mcap(false)),
            ("plain copy, 2 threads", &|| self.again(2, false)),
            ("chunks as they are, 1 thread", &|| self.verbatim(1, false)),
            ("chunks as they are, 2 threads", &|| self.verbatim(2, false)),
            ("chunks unopened, 1 thread", &|| self.unopened(1)),
            ("chunks unopened, 2 threads", &|| self.unopened(2)),
        ];
        let best = best_of(rounds, frames, &runs);
        println!("\n| ratio | by the clock | of processors | on 2 idle cores | goal |");
        println!("| --- | ---: | ---: | ---: | ---: |");
        let [a1, a2, m, p1, p2, v1, v2, pm, pp2, pv1, pv2, pu1, pu2] = best;
        let most = format!("at most {GOAL_RATIO}");
        let least = format!("at least {GOAL_PASS}");
        let (one, two) = (false, true);
        for (name, (above, above_shares), (below, below_shares), goal) in [
            (
                "annotate, 2 threads / mcap's writer and additions",
                (a2, two),
                (m, one),
                most.as_str(),
            ),
            ("annotate / plain copy and additions, 2 threads each", (a2, two), (p2, two), &most),
            ("annotate / plain copy and additions, 1 thread each", (a1, one), (p1, one), ""),
            (
                "annotate / chunks as they are and additions, 2 threads each",
                (a2, two),
                (v2, two),
                "",
            ),
            (
                "annotate / chunks as they are and additions, 1 thread each",
                (a1, one),
                (v1, one),
                "",
            ),
            ("annotate, 1 thread / 2 threads", (a1, one), (a2, two), ""),
            (
                "plain copy / chunks as they are, additions with both, 2 threads",
                (p2, two),
                (v2, two),
                "",
            ),
            ("mcap's writer / chunks as they are, 1 thread", (pm, one), (pv1, one), &least),
            ("plain copy / chunks as they are, 2 threads each", (pp2, two), (pv2, two), &least),
            ("mcap's writer / chunks unopened, 1 thread", (pm, one), (pu1, one), &least),
            ("plain copy / chunks unopened, 2 threads each", (pp2, two), (pu2, two), &least),
        ] {
            let idle = above.idle(above_shares) / below.idle(below_shares);
            let (wall, all) = (above.wall / below.wall, above.all / below.all);
            println!("| {name} | {wall:.2} | {all:.2} | {idle:.2} | {goal} |");
        }
        println!();
    }

    /// The same for a drive of which clouds are a small part.
    fn compare_with_cameras(&self, frames: usize, rounds: usize) {
        println!(
            "{frames} frames with {PICTURES} pictures of {:.0} MB each, which cannot be \
             compressed; best of {rounds} \
             rounds, ms per frame\n",
            PICTURE as f64 / 1e6
        );
        let unchecked = Options { unchecked: true, ..Options::default() };
        let runs: [(&str, &dyn Fn()); 8] = [
            ("the system's copy of the file", &|| {
                std::fs::copy(self.input, &self.output).expect("copied");
                File::open(&self.output).and_then(|file| file.sync_all()).expect("on the disk");
            }),
            ("plain copy, mcap's writer", &|| self.mcap(false)),
            ("plain copy, 2 threads", &|| self.again(2, false)),
            ("chunks as they are, 2 threads", &|| self.verbatim(2, false)),
            ("chunks unopened, 2 threads", &|| self.unopened(2)),
            ("annotate, 2 threads", &|| self.annotate(2)),
            ("annotate --unchecked, 1 thread", &|| {
                profile_of(self.input, &self.output, 1, &unchecked);
            }),
            ("annotate --unchecked, 2 threads", &|| {
                profile_of(self.input, &self.output, 2, &unchecked);
            }),
        ];
        let [_, pm, p2, v2, u2, a2, _, c2] = best_of(rounds, frames, &runs);
        println!("\n| ratio | by the clock | of processors |\n| --- | ---: | ---: |");
        for (name, above, below) in [
            ("annotate / plain copy, 2 threads each", a2, p2),
            ("annotate --unchecked / plain copy, 2 threads each", c2, p2),
            ("annotate, 2 threads / mcap's writer", a2, pm),
            ("plain copy / chunks as they are, 2 threads each", p2, v2),
            ("plain copy / chunks unopened, 2 threads each", p2, u2),
        ] {
            println!("| {name} | {:.2} | {:.2} |", above.wall / below.wall, above.all / below.all);
        }
        println!();
    }

    fn annotate(&self, threads: usize) {
        profile(self.input, &self.output, threads);
    }

    /// Record by record through `mcap`'s own writer, compressed again with our settings.
    fn mcap(&self, adds: bool) {
        let file = BufWriter::with_capacity(1 << 20, File::create(&self.output).expect("a file"));
        let mut writer = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Zstd))
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(Some(4 << 20))
            .disable_seeking(true)
            .create(mcap::write::NoSeek::new(file))
            .expect("a writer");
        let mut reader = RecordingReader::open(self.input).expect("a drive");
        let mut number = 0;
        while let Some(record) = reader.next_record().expect("whole") {
            match &record {
                Record::Schema(schema) => {
                    let (id, name) = (schema.id, &schema.name);
                    writer.add_schema_with_id(id, name, &schema.encoding, &schema.data).map(drop)
                }
                Record::Channel(channel) => {
                    let (id, schema, topic) = (channel.id, channel.schema_id, &channel.topic);
                    let (encoding, metadata) = (&channel.message_encoding, &channel.metadata);
                    writer.add_channel_with_id(id, schema, topic, encoding, metadata).map(drop)
                }
                Record::Message { header, data, .. } => {
                    writer.write_to_known_channel(header, data).expect("written");
                    for (message, channel_id) in self.added(number, adds).zip(2..) {
                        let header = MessageHeader { channel_id, ..*header };
                        writer.write_to_known_channel(&header, message).expect("written");
                    }
                    number += 1;
                    Ok(())
                }
                _ => Ok(()),
            }
            .expect("written");
        }
        writer.finish().expect("finished");
        let file = writer.into_inner().into_inner().into_inner().expect("flushed");
        file.sync_all().expect("on the disk");
    }

    /// Record by record, every chunk compressed again.
    fn again(&self, threads: usize, adds: bool) {
        self.copy(threads, adds, &|writer, part| {
            let (Part::Chunk(divmerge::io::SourceChunk { items, .. }) | Part::Items(items)) = part;
            for item in items {
                match item {
                    Item::Message { header, data, .. } => writer.write_message(header, data),
                    Item::Record(record) => writer.copy(record),
                }
                .expect("copied");
            }
        });
    }

    /// Chunks as they are.
    fn verbatim(&self, threads: usize, adds: bool) {
        self.copy(threads, adds, &|writer, part| match part {
            Part::Chunk(chunk) => writer.copy_chunk(chunk).expect("copied"),
            Part::Items(items) => {
                for item in items {
                    let Item::Record(record) = item else { panic!("a message without a chunk") };
                    writer.copy(record).expect("copied");
                }
            }
        });
    }

    /// Chunks as they are, not even opened.
    fn unopened(&self, threads: usize) {
        let wanted = ReadFilter { unopened: Some(Compression::Zstd), ..ReadFilter::default() };
        self.copy_wanted(threads, false, &wanted, &|writer, part| match part {
            Part::Chunk(chunk) => writer.copy_chunk(chunk).expect("copied"),
            Part::Items(items) => {
                for item in items {
                    let Item::Record(record) = item else { panic!("a message without a chunk") };
                    writer.copy(record).expect("copied");
                }
            }
        });
    }

    fn copy(&self, threads: usize, adds: bool, take: &dyn Fn(&mut RecordingWriter, &Part)) {
        self.copy_wanted(threads, adds, &ReadFilter::default(), take);
    }

    fn copy_wanted(
        &self,
        threads: usize,
        adds: bool,
        wanted: &ReadFilter,
        take: &dyn Fn(&mut RecordingWriter, &Part),
    ) {
        let overview = Overview::read(self.input).expect("a drive");
        let options = WriteOptions { force: true, ..WriteOptions::default() };
        let mut writer = RecordingWriter::create(&self.output, &options).expect("a writer");
        let workers = Workers::start(threads);
        writer.compress_on(&workers);
        let mut reader =
            RecordingReader::open_filtered(&overview, wanted, &workers).expect("a drive");
        let mut number = 0;
        while let Some(part) = reader.next_part().expect("whole") {
            take(&mut writer, &part);
            let (Part::Chunk(divmerge::io::SourceChunk { items, .. }) | Part::Items(items)) = &part;
            for item in items {
                let Item::Message { header, .. } = item else { continue };
                for (message, channel_id) in self.added(number, adds).zip(2..) {
                    let header = MessageHeader { channel_id, ..*header };
                    writer.write_message(&header, message).expect("written");
                }
                number += 1;
            }
        }
        reader.finish().expect("hashed");
        writer.finish().expect("finished");
    }

    /// What is added to a frame, for the channels 2 and 3.
    fn added(&self, number: usize, adds: bool) -> impl Iterator<Item = &Vec<u8>> {
        let added = &self.street.added;
        added[number % added.len()].iter().take(if adds { 2 } else { 0 })
    }
}

/// The best of all rounds of each run, as a table and as values.
fn best_of<const N: usize>(
    rounds: usize,
    frames: usize,
    runs: &[(&str, &dyn Fn()); N],
) -> [Cost; N] {
    let mut best = [Cost::MOST; N];
    for _ in 0..rounds {
        for ((_, run), best) in runs.iter().zip(&mut best) {
            *best = best.least(Cost::of(frames, run));
        }
    }
    println!(
        "| way | ms by the clock | ms of processors | of these, the thread that reads and writes | \
         ms on 2 idle cores |"
    );
    println!("| --- |{}", " ---: |".repeat(4));
    for ((name, _), Cost { wall, all, alone }) in runs.iter().zip(best) {
        let idle = Cost { wall, all, alone }.idle(name.contains("2 threads"));
        println!("| {name} | {wall:.1} | {all:.1} | {alone:.1} | {idle:.1} |");
    }
    best
}

/// Milliseconds a frame.
#[derive(Clone, Copy)]
struct Cost {
    wall: f64,
    /// On processors, all threads.
    all: f64,
    /// On processors, the thread that called.
    alone: f64,
}

impl Cost {
    const MOST: Cost = Cost { wall: f64::INFINITY, all: f64::INFINITY, alone: f64::INFINITY };

    fn of(frames: usize, run: impl FnOnce()) -> Self {
        let (all, alone, started) = (process_ms(), thread_ms(), Instant::now());
        run();
        let wall = started.elapsed().as_secs_f64() * 1e3;
        let per_frame = |ms: f64| ms / frames as f64;
        Cost {
            wall: per_frame(wall),
            all: per_frame(process_ms() - all),
            alone: per_frame(thread_ms() - alone),
        }
    }

    fn least(self, other: Cost) -> Self {
        Cost {
            wall: self.wall.min(other.wall),
            all: self.all.min(other.all),
            alone: self.alone.min(other.alone),
        }
    }

    /// On idle cores, two if the work is shared.
    fn idle(self, is_shared: bool) -> f64 {
        if is_shared { self.alone.max(self.all / 2.0) } else { self.all }
    }
}

/// Milliseconds that this process was on processors, in steps of a hundredth of a second.
fn process_ms() -> f64 {
    const MS_PER_TICK: f64 = 10.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // User and system time are the 12th and 13th behind the command's name in brackets.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks = fields.skip(11).take(2).filter_map(|field| field.parse::<f64>().ok());
    ticks.sum::<f64>() * MS_PER_TICK
}

/// Milliseconds that this thread was on a processor.
fn thread_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let ns = stat.split_whitespace().next().and_then(|field| field.parse::<f64>().ok());
    ns.unwrap_or(f64::NAN) / 1e6
}

fn mean(sizes: impl ExactSizeIterator<Item = usize>) -> f64 {
    let count = sizes.len().max(1);
    sizes.sum::<usize>() as f64 / 1e6 / count as f64
}

fn profile(input: &Path, output: &Path, threads: usize) -> Profile {
    profile_of(input, output, threads, &Options::default())
}

fn profile_of(input: &Path, output: &Path, threads: usize, options: &Options) -> Profile {
    let options = Options { threads, force: true, ..options.clone() };
    let go_on = &mut |_: Event| ControlFlow::Continue(());
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
