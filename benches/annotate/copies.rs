//! Ways to write a recording again, compared.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use divmerge::annotate::AnnotateOptions;
use divmerge::recording::workers::Workers;
use divmerge::recording::{
    Compression, Item, MessageHeader, Overview, Part, ReadFilter, Record, RecordingReader,
    RecordingWriter, WriteOptions,
};

use super::cost::Cost;
use super::{GOAL_PASS, GOAL_RATIO, Messages, PICTURE, PICTURES, mean, profile, profile_of};

/// Ways to write a recording again.
pub(super) struct Copies<'a> {
    pub(super) input: &'a Path,
    pub(super) output: PathBuf,
    pub(super) street: &'a Messages,
}

impl Copies<'_> {
    pub(super) fn compare(&self, frames: usize, rounds: usize) {
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
        print_ratios(best_of(rounds, frames, &runs));
    }

    /// The same for a drive of which clouds are a small part.
    pub(super) fn compare_with_cameras(&self, frames: usize, rounds: usize) {
        println!(
            "{frames} frames with {PICTURES} pictures of {:.0} MB each, which cannot be \
             compressed; best of {rounds} \
             rounds, ms per frame\n",
            PICTURE as f64 / 1e6
        );
        let unchecked = AnnotateOptions { unchecked: true, ..AnnotateOptions::default() };
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
        println!("\n| ratio | wall | processor |\n| --- | ---: | ---: |");
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
            let (Part::Chunk(divmerge::recording::SourceChunk { items, .. }) | Part::Items(items)) =
                part;
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
        self.copy(threads, adds, &copy_as_it_is);
    }

    /// Chunks as they are, not even opened.
    fn unopened(&self, threads: usize) {
        let filter = ReadFilter { unopened: Some(Compression::Zstd), ..ReadFilter::default() };
        self.copy_filtered(threads, false, &filter, &copy_as_it_is);
    }

    fn copy(&self, threads: usize, adds: bool, take: &dyn Fn(&mut RecordingWriter, &Part)) {
        self.copy_filtered(threads, adds, &ReadFilter::default(), take);
    }

    fn copy_filtered(
        &self,
        threads: usize,
        adds: bool,
        filter: &ReadFilter,
        take: &dyn Fn(&mut RecordingWriter, &Part),
    ) {
        let overview = Overview::read(self.input).expect("a drive");
        let options = WriteOptions { force: true, ..WriteOptions::default() };
        let mut writer = RecordingWriter::create(&self.output, &options).expect("a writer");
        let workers = Workers::start(threads);
        writer.compress_on(&workers);
        let mut reader =
            RecordingReader::open_filtered(&overview, filter, &workers).expect("a drive");
        let mut number = 0;
        while let Some(part) = reader.next_part().expect("whole") {
            take(&mut writer, &part);
            let (Part::Chunk(divmerge::recording::SourceChunk { items, .. }) | Part::Items(items)) =
                &part;
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

/// Writes a chunk as it is, and records that are in none.
fn copy_as_it_is(writer: &mut RecordingWriter, part: &Part) {
    match part {
        Part::Chunk(chunk) => writer.copy_chunk(chunk).expect("copied"),
        Part::Items(items) => {
            for item in items {
                let Item::Record(record) = item else { panic!("a message without a chunk") };
                writer.copy(record).expect("copied");
            }
        }
    }
}

/// What each part bought: a run, whether on two threads, over another.
fn print_ratios([a1, a2, m, p1, p2, v1, v2, pm, pp2, pv1, pv2, pu1, pu2]: [Cost; 13]) {
    println!("\n| ratio | wall | processor | on 2 idle cores | goal |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    let most = format!("at most {GOAL_RATIO}");
    let least = format!("at least {GOAL_PASS}");
    let (one, two) = (false, true);
    let ratios = [
        ("annotate, 2 threads / mcap's writer and additions", (a2, two), (m, one), &*most),
        ("annotate / plain copy and additions, 2 threads each", (a2, two), (p2, two), &most),
        ("annotate / plain copy and additions, 1 thread each", (a1, one), (p1, one), ""),
        ("annotate / chunks as they are and additions, 2 threads each", (a2, two), (v2, two), ""),
        ("annotate / chunks as they are and additions, 1 thread each", (a1, one), (v1, one), ""),
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
    ];
    for (name, (above, above_shares), (below, below_shares), goal) in ratios {
        let idle = above.idle(above_shares) / below.idle(below_shares);
        let (wall, all) = (above.wall / below.wall, above.all / below.all);
        println!("| {name} | {wall:.2} | {all:.2} | {idle:.2} | {goal} |");
    }
    println!();
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
        "| way | wall ms | processor ms | of these, the thread that reads and writes | \
         ms on 2 idle cores |"
    );
    println!("| --- |{}", " ---: |".repeat(4));
    for ((name, _), Cost { wall, all, alone }) in runs.iter().zip(best) {
        let idle = Cost { wall, all, alone }.idle(name.contains("2 threads"));
        println!("| {name} | {wall:.1} | {all:.1} | {alone:.1} | {idle:.1} |");
    }
    best
}
