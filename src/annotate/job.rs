//! An annotation under way: parts of the input come in, clouds go to the threads, and everything is written in
//! the input's order.

use std::collections::{BTreeMap, VecDeque};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use super::asked::Asked;
use super::message::{Annotated, Method, annotate_message};
use super::notes::Done;
use super::profile::Profile;
use super::report::{METADATA_NAME, Report, TopicReport, metadata};
use super::resume::{CutOff, Journal, clean_up, journal_of};
use super::topics::{CloudTopic, choose, choose_beside, refuse_annotated};
use super::{Event, Form, Options, place};
use crate::error::{Error, Result};
use crate::io::{
    CloudFormat, CloudNumber, Compression, Item, Overview, Part, Position, ReadFilter, Record,
    RecordingReader, RecordingWriter, STANDARD_STREAM, SourceChunk, WriteOptions,
};
use crate::workers::Workers;
use batch::Batch;
use channels::Added;
use cloud::{Cloud, CloudItem, Made};

mod batch;
mod channels;
mod cloud;
mod slice;
mod stream;

/// Bytes of the input's messages, for each thread, that may wait for clouds before them.
const WAITING_PER_THREAD: usize = 16 << 20;
/// The same, however many threads there are.
const MOST_WAITING: usize = 64 << 20;

/// Clouds that are clustered or wait for their turn: one for each thread, and one to follow; where several go through a
/// network together, as many batches as keep four threads busy.
fn most_clouds(threads: usize, batch: usize) -> usize {
    match batch {
        0 | 1 => threads + 1,
        batch => threads.min(4) * batch + 1,
    }
}

/// An annotation under way.
pub(super) struct Job<'a> {
    pub(super) overview: Overview,
    options: &'a Options,
    on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    workers: Workers,
    method: Arc<Method>,
    asked: Asked,
    writer: RecordingWriter,
    /// What is to be written next, in its order.
    queue: VecDeque<Waiting>,
    /// Clouds and bytes of messages in the queue.
    queued: (usize, usize),
    total: u64,
    /// Topic and format of each channel whose clouds are annotated.
    clouds: BTreeMap<u16, (Arc<str>, CloudFormat)>,
    pub(super) wanted: ReadFilter,
    compression: Compression,
    /// Whether topics and the rest become known only as they come.
    is_stream: bool,
    /// Whether the compression is still to be taken from the first chunk.
    awaits_compression: bool,
    /// Channels for each topic and format of what is added, once they are there.
    added: BTreeMap<(Arc<str>, CloudFormat), Added>,
    /// Number of the next cloud of each topic.
    next_number: BTreeMap<Arc<str>, u64>,
    /// Warnings by topic and kind: how often, and where first.
    warned: BTreeMap<(String, String), u64>,
    report: Report,
    journal: Option<Journal>,
    /// Clouds that were annotated before.
    done: Option<Box<dyn Done>>,
    /// Of a slice: what became of the clouds since the last note that was written.
    notes: Vec<u8>,
    /// Clouds that wait to go through a network together.
    batch: Batch,
}

/// Something to be written, and how many bytes of the input are read when it is.
struct Waiting {
    bytes: u64,
    what: What,
}

enum What {
    Chunk(SourceChunk),
    Item(Item),
    Cloud(Box<Cloud>),
    /// The end of a part of the input, where a slice is annotated.
    End,
}

impl What {
    fn is_ready(&mut self) -> bool {
        match self {
            What::Cloud(cloud) => cloud.result.is_ready(),
            What::Chunk(_) | What::Item(_) | What::End => true,
        }
    }

    /// Clouds and bytes of messages.
    fn size(&self) -> (usize, usize) {
        match self {
            What::Cloud(cloud) => (1, cloud.item.message.len()),
            What::Item(Item::Message { data, .. }) => (0, data.len()),
            What::Item(Item::Record(_)) | What::End => (0, 0),
            What::Chunk(chunk) => (0, chunk.size()),
        }
    }
}

impl<'a> Job<'a> {
    pub(super) fn new(
        overview: Overview,
        asked: Asked,
        output: &Path,
        options: &'a Options,
        workers: &Workers,
        on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Self> {
        let clouds = choose_beside(&overview, &asked.topics, asked.class_topic.as_deref())?;
        asked.types.check(&overview, clouds.values().map(|cloud| cloud.format), asked.form)?;
        let mut job = Self::with(overview, asked, clouds, output, options, workers, on_event)?;
        refuse_annotated(&job.overview, job.wanted.numbered.values())?;
        job.writer.reserve(&job.overview);
        for channel in job.overview.channels.clone().into_values() {
            job.warn_of_other_cloud(&channel);
        }
        // All of them now: their ids must not depend on which clouds can be read.
        for channel in job.clouds.keys().copied().collect::<Vec<_>>() {
            job.channels_for(channel)?;
        }
        job.begin_slice()?;
        Ok(job)
    }

    /// Takes clouds that were annotated before from there.
    pub(super) fn take_from(&mut self, done: Box<dyn Done>) {
        self.done = Some(done);
    }

    /// The same for a stream, whose topics are not known yet.
    pub(super) fn of_stream(
        overview: Overview,
        output: &Path,
        options: &'a Options,
        workers: &Workers,
        on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Self> {
        let asked = Asked::of(&overview, options);
        let none = BTreeMap::new();
        let mut job = Self::with(overview, asked, none, output, options, workers, on_event)?;
        job.writer.reserve_all_but_the_highest();
        job.is_stream = true;
        Ok(job)
    }

    fn with(
        overview: Overview,
        asked: Asked,
        clouds: BTreeMap<u16, CloudTopic>,
        output: &Path,
        options: &'a Options,
        workers: &Workers,
        on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Self> {
        let compression = asked.compression;
        let is_resumable = (options.resume || options.resumable) && output != STANDARD_STREAM;
        let done = match options.resume && is_resumable {
            true => CutOff::find(output, &asked)?.map(|cut_off| Box::new(cut_off) as Box<dyn Done>),
            false => None,
        };
        let mut writer = RecordingWriter::create(
            output,
            &WriteOptions {
                profile: overview.profile.clone(),
                recorded_by: overview.library.clone(),
                compression,
                force: options.force,
            },
        )?;
        if is_resumable && !options.resume {
            clean_up(output);
        }
        let journal = is_resumable.then(|| Journal::start(output, &asked)).transpose()?;
        writer.compress_on(workers);
        let wanted = ReadFilter {
            unopened: options.unchecked.then_some(compression),
            others: options.form != Form::Only && options.slice.is_none(),
            bytes: options.slice.as_ref().map_or(0..u64::MAX, |slice| slice.start..slice.end),
            from_ns: options.from_ns,
            to_ns: options.to_ns,
            numbered: clouds.iter().map(|(&id, cloud)| (id, cloud.topic.clone())).collect(),
            ..ReadFilter::default()
        };
        let topics = clouds.values().map(|cloud| {
            let format = options.types.format(cloud.format);
            (cloud.topic.clone(), TopicReport { format, ..TopicReport::default() })
        });
        let report = Report {
            input: overview.path.clone(),
            output: output.to_owned(),
            input_bytes: overview.file_size,
            from_ns: options.from_ns,
            to_ns: options.to_ns,
            form: options.form.describe(),
            topics: topics.collect(),
            profile: Profile { threads: workers.threads(), ..Profile::default() },
            ..Report::default()
        };
        Ok(Job {
            total: overview.file_size,
            overview,
            is_stream: false,
            options,
            on_event,
            workers: workers.clone(),
            method: Arc::new(options.method.clone()),
            asked,
            writer,
            queue: VecDeque::new(),
            queued: (0, 0),
            wanted,
            compression,
            awaits_compression: options.compression.is_none(),
            clouds: clouds
                .into_iter()
                .map(|(id, cloud)| (id, (cloud.topic.into(), cloud.format)))
                .collect(),
            added: BTreeMap::new(),
            next_number: BTreeMap::new(),
            warned: BTreeMap::new(),
            report,
            journal,
            done,
            notes: Vec::new(),
            batch: Batch::of(&options.method),
        })
    }

    fn warn(&mut self, warning: String) {
        let _ = (self.on_event)(Event::Warning(&warning));
        self.report.warnings.push(warning);
    }

    /// Warns of something that may come again in every frame only the first time, and counts.
    fn warn_once(&mut self, topic: &str, kind: &str, position: Position, problem: &str) {
        let count = self.warned.entry((topic.to_owned(), kind.to_owned())).or_default();
        *count += 1;
        if *count == 1 {
            self.warn(format!("{topic}: {problem} ({})", place(position)));
        }
    }

    /// Takes what comes next in the input, of which so many bytes have been read.
    pub(super) fn part(&mut self, part: Part, bytes: u64) -> Result<()> {
        if self.is_stream {
            let (Part::Chunk(SourceChunk { items, .. }) | Part::Items(items)) = &part;
            self.learn(items)?;
            if let Part::Chunk(chunk) = &part {
                self.learn_compression(chunk);
            }
        }
        match part {
            Part::Chunk(chunk) if self.stays(&chunk) => {
                let clouds: Vec<Item> = self.clouds_of(&chunk).cloned().collect();
                self.push(bytes, What::Chunk(chunk))?;
                clouds.iter().try_for_each(|item| self.push_cloud(bytes, item))
            }
            Part::Chunk(SourceChunk { items, .. }) | Part::Items(items) => {
                items.into_iter().try_for_each(|item| self.item(bytes, item))?;
                match self.options.slice {
                    Some(_) => self.push(bytes, What::End),
                    None => Ok(()),
                }
            }
        }
    }

    /// Whether what the input holds is in the output, too.
    fn copies(&self) -> bool {
        self.options.form != Form::Only && self.options.slice.is_none()
    }

    /// Whether a chunk can be placed as it is.
    fn stays(&self, chunk: &SourceChunk) -> bool {
        let (first, last) = chunk.times();
        let is_kept = chunk.message_count() == 0
            || (self.wanted.is_in_window(first) && self.wanted.is_in_window(last));
        let may_stay = match self.options.form {
            Form::Beside => true,
            Form::InPlace => self.clouds_of(chunk).next().is_none(),
            Form::Only => false,
        };
        may_stay && self.copies() && is_kept && chunk.compression() == self.compression.name()
    }

    fn clouds_of<'c>(&'c self, chunk: &'c SourceChunk) -> impl Iterator<Item = &'c Item> {
        chunk.items.iter().filter(|item| self.is_cloud(item))
    }

    fn is_cloud(&self, item: &Item) -> bool {
        matches!(item, Item::Message { header, .. } if self.clouds.contains_key(&header.channel_id))
    }

    /// Takes a record that is copied by itself.
    fn item(&mut self, bytes: u64, item: Item) -> Result<()> {
        match &item {
            Item::Message { header, position, .. }
                if !self.wanted.is_in_window(header.log_time) || !self.is_in_slice(*position) =>
            {
                if let Some((topic, _)) = self.clouds.get(&header.channel_id).cloned() {
                    self.count_cloud(&topic);
                }
                Ok(())
            }
            Item::Record(Record::Skipped { counts }) => {
                for (channel, count) in counts {
                    let topic = Arc::clone(&self.clouds[channel].0);
                    *self.next_number.entry(topic).or_default() += count;
                }
                Ok(())
            }
            Item::Message { .. } if self.is_cloud(&item) => {
                if self.options.form == Form::Beside && self.copies() {
                    self.push(bytes, What::Item(item.clone()))?;
                }
                self.push_cloud(bytes, &item)
            }
            _ if self.is_left_out(&item) => Ok(()),
            _ => self.push(bytes, What::Item(item)),
        }
    }

    /// Whether nothing is done about something that is no cloud: all but damage, if annotations alone are wanted.
    fn is_left_out(&self, item: &Item) -> bool {
        let is_damage =
            matches!(item, Item::Record(Record::Damaged { .. } | Record::Truncated { .. }));
        !self.copies() && !is_damage
    }

    /// Gives a cloud to the threads.
    fn push_cloud(&mut self, bytes: u64, item: &Item) -> Result<()> {
        let Item::Message { header, data, position } = item else {
            return Ok(());
        };
        let (topic, format) = self.clouds[&header.channel_id].clone();
        let number = self.count_cloud(&topic);
        let before = match &mut self.done {
            Some(done) => done.take(&topic, number, data)?,
            None => None,
        };
        let (method, message, name) = (Arc::clone(&self.method), data.clone(), Arc::clone(&topic));
        let types = self.options.types;
        let result = match before {
            Some(before) => Workers::none().run(move || Ok(Made::Before(before))),
            None if self.batch.size > 1 => self.batch_cloud(message, format, name, number),
            None => self.workers.run(move || {
                let mut annotated = Annotated::default();
                let which = CloudNumber { topic: &name, number };
                annotate_message(&message, format, which, &method, &types, &mut annotated)
                    .map(|clustered| Made::Now(Box::new(clustered), annotated))
            }),
        };
        let (header, position, message) = (*header, *position, data.clone());
        let item = CloudItem { topic, number, header, position, message };
        self.push(bytes, What::Cloud(Box::new(Cloud { item, result })))
    }

    /// The number of a topic's next cloud.
    fn count_cloud(&mut self, topic: &Arc<str>) -> u64 {
        let next = self.next_number.entry(Arc::clone(topic)).or_default();
        *next += 1;
        *next - 1
    }

    /// Queues something, and writes what is ready. Where more is waiting than keeps the threads busy, this waits
    /// for the front of it.
    fn push(&mut self, bytes: u64, what: What) -> Result<()> {
        let (clouds, size) = what.size();
        self.queued = (self.queued.0 + clouds, self.queued.1 + size);
        self.queue.push_back(Waiting { bytes, what });
        let most = &mut self.report.profile.most_clouds_in_flight;
        *most = (*most).max(self.queued.0);
        let threads = self.workers.threads();
        while self.queued.0 >= most_clouds(threads, self.batch.size)
            || self.queued.1 > MOST_WAITING.min(threads * WAITING_PER_THREAD)
            || self.queue.front_mut().is_some_and(|next| next.what.is_ready())
        {
            self.settle()?;
        }
        Ok(())
    }

    /// Writes all that is waiting.
    pub(super) fn settle_all(&mut self) -> Result<()> {
        while !self.queue.is_empty() {
            self.settle()?;
        }
        Ok(())
    }

    /// Writes what is at the front.
    fn settle(&mut self) -> Result<()> {
        if self.queue.front_mut().is_some_and(|next| !next.what.is_ready()) {
            self.run_batch();
        }
        let Some(Waiting { bytes, what }) = self.queue.pop_front() else {
            return Ok(());
        };
        let (clouds, size) = what.size();
        self.queued = (self.queued.0 - clouds, self.queued.1 - size);
        match what {
            What::Chunk(chunk) => {
                self.writer.copy_chunk(&chunk)?;
                self.report.messages += chunk.message_count();
                self.progress(bytes)
            }
            What::Item(Item::Message { header, data, .. }) => {
                self.writer.write_message(&header, &data)?;
                self.report.messages += 1;
                self.progress(bytes)
            }
            What::Item(Item::Record(record)) => self.record(&record),
            What::Cloud(cloud) => {
                self.cloud(*cloud)?;
                self.progress(bytes)
            }
            What::End => self.end_part(),
        }
    }

    fn progress(&mut self, bytes: u64) -> Result<()> {
        let (bytes, total) = self.of_slice(bytes);
        match (self.on_event)(Event::Progress { bytes, total }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted { path: self.report.output.clone() }),
        }
    }

    fn record(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Damaged { offset, damage } => {
                self.warn(format!("{damage} (byte {offset})"));
            }
            Record::Truncated { offset, damage } => {
                let cut = format!(
                    "cut off: {damage} (byte {offset}); annotated up to the last readable message"
                );
                self.warn(cut.clone());
                self.report.truncated = Some(cut);
            }
            other => self.writer.copy(other)?,
        }
        Ok(())
    }

    /// Ends with an error; what an interrupted run had done is left if it can be resumed.
    pub(super) fn give_up(mut self, error: Error) -> Error {
        if let (Error::Interrupted { .. }, Some(journal)) = (&error, &mut self.journal) {
            journal.keep();
            let partial = self.writer.leave();
            let journal = journal_of(&self.report.output);
            return Error::Left { partial, journal };
        }
        error
    }

    /// Completes the output. The reader is at the end of the input.
    pub(super) fn finish(mut self, mut reader: RecordingReader) -> Result<Report> {
        if let Err(error) = self.settle_all() {
            return Err(self.give_up(error));
        }
        if self.is_stream {
            choose(&self.overview, &self.options.topics)?;
        }
        if let Some(done) = &mut self.done {
            done.finish()?;
        }
        for channel in self.clouds.keys().copied().collect::<Vec<_>>() {
            self.channels_for(channel)?;
        }
        for ((topic, kind), count) in std::mem::take(&mut self.warned) {
            if count > 1 {
                self.warn(format!("{topic}: {count} clouds {kind}"));
            }
        }
        if self.options.slice.is_none() {
            self.report.input_sha256 = reader.finish()?;
        }
        self.report.input_bytes_read = reader.bytes_read();
        self.report.fetched = reader.fetched();
        if self.options.slice.is_none() {
            self.writer.write_declared()?;
            let metadata = metadata(&self.report, &self.asked.method);
            self.writer.write_metadata(METADATA_NAME, &metadata)?;
        }
        (self.report.output_bytes, self.report.profile.write) = self.writer.finish_timed()?;
        if self.journal.is_some() {
            drop(self.done.take());
            clean_up(&self.report.output);
        }
        Ok(self.report)
    }
}
