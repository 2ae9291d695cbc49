//! What it costs to annotate a recording in slices: the slices and their join against one run over
//! the whole, and the bytes that each reads and writes.
//!
//! The drive is the simulator's street under an HDL-64E, by itself and with twenty pictures of a
//! megabyte to each cloud, which cannot be compressed, in the same chunks. Everything runs on one
//! thread, so that times on processors (Linux, user and system) are those of a core; rounds follow
//! one another, and each figure is the best of all.
//!
//! `cargo bench --bench slices` (`-- --quick` for a look, `-- --shards 16` for other slices).

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use divmerge::annotate::slices::{plan, recordings};
use divmerge::annotate::{
    AnnotateOptions, JoinOptions, RunEvent, SliceFile, annotate, by_recording, join,
};
use divmerge::datasets::drive::write_drive;
use divmerge::recording::{
    MessageHeader, Overview, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use divmerge::simulate::{Drive, Scene, Sensor};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Bytes of a picture, and pictures to a frame.
const PICTURE: usize = 1 << 20;
const PICTURES: u32 = 20;

fn go_on(_: RunEvent) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)?.parse::<usize>().ok()
    };
    let quick = arguments.iter().any(|argument| argument == "--quick");
    let frames = value("--frames").unwrap_or(if quick { 20 } else { 200 });
    let rounds = value("--rounds").unwrap_or(if quick { 1 } else { 3 });
    let shards = value("--shards").unwrap_or(8);

    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("drive.mcap");
    let drive = Drive::new(Sensor::Hdl64e, Scene::Street, 1);
    let written =
        write_drive(
            &drive,
            frames,
            &input,
            &WriteOptions::default(),
            |_| ControlFlow::Continue(()),
        );
    written.expect("a drive");
    println!("Clouds alone: {frames} frames in {shards} slices; for each frame, on one thread\n");
    let bench = Bench { input: input.clone(), folder: folder.path(), shards };
    bench.compare(frames, rounds);
    let few = frames.min(30);
    let cameras = folder.path().join("cameras.mcap");
    add_pictures(&input, few, &cameras);
    println!("\nWith pictures: {few} frames in {shards} slices\n");
    Bench { input: cameras, ..bench }.compare(few, rounds);
}

/// Writes the first frames of a drive with pictures behind each cloud.
fn add_pictures(drive: &Path, frames: usize, output: &Path) {
    let mut reader = RecordingReader::open(drive).expect("a drive");
    let mut writer = RecordingWriter::create(output, &WriteOptions::default()).expect("a writer");
    let overview = Overview::read(drive).expect("a drive");
    writer.reserve(&overview);
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut picture = vec![0; PICTURE];
    let (mut camera, mut clouds) = (None, 0);
    while let Some(record) = reader.next_record().expect("a record") {
        writer.copy(&record).expect("copied");
        let Record::Message { header, data, .. } = record else { continue };
        if data.len() < PICTURE {
            continue;
        }
        let channel_id = *camera.get_or_insert_with(|| {
            let schema =
                writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"uint8[] data");
            let schema = schema.expect("a schema");
            writer.add_channel("/camera", schema, "cdr", &BTreeMap::new()).expect("a channel")
        });
        for sequence in 0..PICTURES {
            random.fill_bytes(&mut picture);
            let header = MessageHeader { channel_id, sequence, ..header };
            writer.write_message(&header, &picture).expect("written");
        }
        clouds += 1;
        if clouds == frames {
            break;
        }
    }
    writer.finish().expect("finished");
}

struct Bench<'a> {
    input: PathBuf,
    folder: &'a Path,
    shards: usize,
}

/// What a step took.
#[derive(Clone, Copy, Default)]
struct Cost {
    clock_ms: f64,
    processor_ms: f64,
    read: u64,
    written: u64,
}

impl Cost {
    fn min(self, other: Cost) -> Cost {
        Cost {
            clock_ms: self.clock_ms.min(other.clock_ms),
            processor_ms: self.processor_ms.min(other.processor_ms),
            ..self
        }
    }
}

/// What a step took that says how many bytes it read and wrote.
fn cost(step: impl FnOnce() -> (u64, u64)) -> Cost {
    let (started, before) = (Instant::now(), processor_ms());
    let (read, written) = step();
    let clock_ms = started.elapsed().as_secs_f64() * 1e3;
    Cost { clock_ms, processor_ms: processor_ms() - before, read, written }
}

impl Bench<'_> {
    fn compare(&self, frames: usize, rounds: usize) {
        let mut best: Option<[Cost; 4]> = None;
        for _ in 0..rounds {
            let costs = self.round();
            best = Some(match best {
                None => costs,
                Some(best) => std::array::from_fn(|i| best[i].min(costs[i])),
            });
        }
        let costs = best.expect("a round");
        let per_frame = |figure: f64| figure / frames as f64;
        println!("| step | ms by the clock | ms of processors | MB read | MB written |");
        println!("| --- | ---: | ---: | ---: | ---: |");
        for (name, cost) in ["plan", "slices", "join", "one run over the whole"].iter().zip(costs) {
            let [clock, processors] = [cost.clock_ms, cost.processor_ms].map(per_frame);
            let [read, written] =
                [cost.read, cost.written].map(|bytes| per_frame(bytes as f64) / 1e6);
            println!("| {name} | {clock:.2} | {processors:.2} | {read:.2} | {written:.2} |");
        }
        let [plan, slices, join, whole] = costs.map(|cost| cost.processor_ms);
        println!("\nslices / one run: {:.2} of the time on processors", slices / whole);
        println!("join / one run: {:.2}", join / whole);
        println!("plan, slices and join / one run: {:.2}", (plan + slices + join) / whole);
    }

    fn round(&self) -> [Cost; 4] {
        let mut slices = Vec::new();
        let plan_cost = cost(|| {
            let recordings = recordings(std::slice::from_ref(&self.input)).expect("a recording");
            slices = plan(&recordings, self.shards, &[]).expect("a plan");
            (0, 0)
        });
        let options = AnnotateOptions { threads: 1, force: true, ..AnnotateOptions::default() };
        let mut files = Vec::new();
        let slices_cost = cost(|| {
            let one = |slice: &divmerge::annotate::Slice| {
                let output = self.folder.join(slice.file_name());
                let options = AnnotateOptions { slice: Some(slice.clone()), ..options.clone() };
                let report = annotate(&self.input, &output, &options, &mut go_on).expect("a slice");
                files.push(output);
                (report.input_bytes_read, report.output_bytes)
            };
            slices.iter().map(one).fold((0, 0), |all, one| (all.0 + one.0, all.1 + one.1))
        });
        let output = self.folder.join("joined.mcap");
        let join_cost = cost(|| {
            let opened = files.iter().map(|file| SliceFile::open(file).expect("a slice")).collect();
            let slices = by_recording(opened, None).expect("all slices").remove(0);
            let options = JoinOptions { threads: 1, force: true, ..JoinOptions::default() };
            let report = join(&slices, &output, &options, &mut go_on).expect("joined");
            (report.input_bytes_read + slices_cost.written, report.output_bytes)
        });
        let whole = self.folder.join("whole.mcap");
        let whole_cost = cost(|| {
            let report = annotate(&self.input, &whole, &options, &mut go_on).expect("annotated");
            (report.input_bytes_read, report.output_bytes)
        });
        let same = std::fs::read(&output).expect("joined") == std::fs::read(&whole).expect("whole");
        assert!(same, "the joined recording is not that of one run");
        [plan_cost, slices_cost, join_cost, whole_cost]
    }
}

/// Milliseconds that this process was on processors; not a number where Linux does not say.
fn processor_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let ns = stat.split_whitespace().next().and_then(|field| field.parse::<f64>().ok());
    ns.unwrap_or(f64::NAN) / 1e6
}
