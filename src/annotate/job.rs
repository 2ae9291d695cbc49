//! An annotation under way: parts of the input come in, clouds go to the threads, and everything is written in
//! the input's order.

use std::collections::{BTreeMap, VecDeque};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::message::{Annotated, Clustered, Method, annotate_message};
use super::profile::Profile;
use super::report::{METADATA_NAME, Report, TopicReport, metadata, remarks};
use super::topics::{
    CloudTopic, INSTANCES, OBJECTS, added_metadata, channel_metadata, choose, refuse_annotated,
};
use super::{Event, Frame, Options, place};
use crate::error::{Error, Result};
use crate::io::{
    Channel, CloudChannel, CloudFormat, CloudNumber, Item, MessageHeader, MessageSchema, Overview,
    Part, Position, Record, RecordingReader, RecordingWriter, SourceChunk, WriteOptions,
};
use crate::workers::{Ticket, Workers};

/// Bytes of the input's messages, for each thread, that may wait for clouds before them.
const WAITING_PER_THREAD: usize = 16 << 20;
/// The same, however many threads there are.
const MOST_WAITING: usize = 64 << 20;

/// Clouds that are clustered or wait for their turn: one for each thread, and one to follow.
fn most_clouds(threads: usize) -> usize {
    threads + 1
}

/// An annotation under way.
pub(super) struct Job<'a> {
    overview: &'a Overview,
    options: &'a Options,
    on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    workers: Workers,
    method: Arc<Method>,
    writer: RecordingWriter,
    /// What is to be written next, in its order.
    queue: VecDeque<Waiting>,
    /// Clouds and bytes of messages in the queue.
    queued: (usize, usize),
    total: u64,
    /// Topic and format of each channel whose clouds are annotated.
    clouds: BTreeMap<u16, (Arc<str>, CloudFormat)>,
    /// Channels added for each topic and format, once they are.
    added: BTreeMap<(Arc<str>, CloudFormat), Added>,
    /// Number of the next cloud of each topic.
    next_number: BTreeMap<Arc<str>, u64>,
    /// Warnings by topic and kind: how often, and where first.
    warned: BTreeMap<(String, &'static str), u64>,
    report: Report,
}

/// The channels added for a topic.
#[derive(Clone, Copy)]
struct Added {
    instances: u16,
    objects: u16,
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
}

/// A cloud being clustered.
struct Cloud {
    topic: Arc<str>,
    number: u64,
    header: MessageHeader,
    position: Position,
    message_len: usize,
    result: Ticket<Result<(Clustered, Annotated)>>,
}

impl What {
    fn is_ready(&mut self) -> bool {
        match self {
            What::Cloud(cloud) => cloud.result.is_ready(),
            What::Chunk(_) | What::Item(_) => true,
        }
    }

    /// Clouds and bytes of messages.
    fn size(&self) -> (usize, usize) {
        match self {
            What::Cloud(cloud) => (1, cloud.message_len),
            What::Item(Item::Message { data, .. }) => (0, data.len()),
            What::Item(Item::Record(_)) => (0, 0),
            What::Chunk(chunk) => (0, chunk.size()),
        }
    }
}

impl<'a> Job<'a> {
    pub(super) fn new(
        overview: &'a Overview,
        output: &Path,
        options: &'a Options,
        workers: &Workers,
        on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Self> {
        let clouds = choose(overview, &options.topics)?;
        refuse_annotated(overview, &clouds)?;
        options.types.check(overview, &clouds)?;
        let mut writer = RecordingWriter::create(
            output,
            &WriteOptions {
                profile: overview.profile.clone(),
                recorded_by: overview.library.clone(),
                compression: options.compression,
                force: options.force,
            },
        )?;
        writer.compress_on(workers);
        writer.reserve(overview);
        let topics = clouds.values().map(|have| {
            let format = options.types.format(have.format);
            (have.topic.clone(), TopicReport { format, ..TopicReport::default() })
        });
        let source = |CloudTopic { topic, format }: CloudTopic| (Arc::from(topic), format);
        let report = Report {
            input: overview.path.clone(),
            output: output.to_owned(),
            topics: topics.collect(),
            profile: Profile { threads: workers.threads(), ..Profile::default() },
            ..Report::default()
        };
        let mut job = Job {
            overview,
            options,
            on_event,
            workers: workers.clone(),
            method: Arc::new(options.method.clone()),
            writer,
            queue: VecDeque::new(),
            queued: (0, 0),
            total: overview.file_size,
            clouds: clouds.iter().map(|(&id, have)| (id, source(have.clone()))).collect(),
            added: BTreeMap::new(),
            next_number: BTreeMap::new(),
            warned: BTreeMap::new(),
            report,
        };
        job.warn_of_other_clouds();
        Ok(job)
    }

    fn warn_of_other_clouds(&mut self) {
        for channel in self.overview.channels.values() {
            if let CloudChannel::Unreadable(unreadable) = CloudChannel::of(self.overview, channel)
                && unreadable.is_cloud
            {
                let (topic, reason) = (&channel.topic, unreadable.reason);
                self.warn(format!("{topic}: passed through without annotation: {reason}"));
            }
        }
    }

    fn warn(&mut self, warning: String) {
        let _ = (self.on_event)(Event::Warning(&warning));
        self.report.warnings.push(warning);
    }

    /// Warns of something that may come again in every frame only the first time, and counts.
    fn warn_once(&mut self, topic: &str, kind: &'static str, position: Position, problem: &str) {
        let count = self.warned.entry((topic.to_owned(), kind)).or_default();
        *count += 1;
        if *count == 1 {
            self.warn(format!("{topic}: {problem} ({})", place(position)));
        }
    }

    /// Takes what comes next in the input, of which so many bytes have been read.
    pub(super) fn part(&mut self, part: Part, bytes: u64) -> Result<()> {
        match part {
            Part::Chunk(chunk) if self.stays(&chunk) => {
                let clouds: Vec<Item> =
                    chunk.items.iter().filter(|item| self.is_cloud(item)).cloned().collect();
                self.push(bytes, What::Chunk(chunk))?;
                clouds.iter().try_for_each(|item| self.push_cloud(bytes, item))
            }
            Part::Chunk(SourceChunk { items, .. }) | Part::Items(items) => {
                items.into_iter().try_for_each(|item| self.item(bytes, item))
            }
        }
    }

    /// Whether a chunk can be placed as it is.
    fn stays(&self, chunk: &SourceChunk) -> bool {
        let (first, last) = chunk.times();
        let is_kept =
            chunk.message_count() == 0 || !(self.is_outside(first) || self.is_outside(last));
        is_kept && chunk.compression() == self.options.compression.name()
    }

    fn is_cloud(&self, item: &Item) -> bool {
        matches!(item, Item::Message { header, .. } if self.clouds.contains_key(&header.channel_id))
    }

    fn is_outside(&self, log_time: u64) -> bool {
        self.options.from_ns.is_some_and(|from| log_time < from)
            || self.options.to_ns.is_some_and(|to| log_time >= to)
    }

    /// Takes a record that is copied by itself.
    fn item(&mut self, bytes: u64, item: Item) -> Result<()> {
        match &item {
            Item::Message { header, .. } if self.is_outside(header.log_time) => {
                if let Some((topic, _)) = self.clouds.get(&header.channel_id).cloned() {
                    self.count_cloud(&topic);
                }
                Ok(())
            }
            Item::Message { .. } if self.is_cloud(&item) => {
                self.push(bytes, What::Item(item.clone()))?;
                self.push_cloud(bytes, &item)
            }
            _ => self.push(bytes, What::Item(item)),
        }
    }

    /// Gives a cloud to the threads.
    fn push_cloud(&mut self, bytes: u64, item: &Item) -> Result<()> {
        let Item::Message { header, data, position } = item else {
            return Ok(());
        };
        let (topic, format) = self.clouds[&header.channel_id].clone();
        let number = self.count_cloud(&topic);
        let (method, message, name) = (Arc::clone(&self.method), data.clone(), Arc::clone(&topic));
        let types = self.options.types;
        let result = self.workers.run(move || {
            let mut annotated = Annotated::default();
            let which = CloudNumber { topic: &name, number };
            annotate_message(&message, format, which, &method, &types, &mut annotated)
                .map(|clustered| (clustered, annotated))
        });
        let (header, position, message_len) = (*header, *position, data.len());
        let cloud = Cloud { topic, number, header, position, message_len, result };
        self.push(bytes, What::Cloud(Box::new(cloud)))
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
        while self.queued.0 >= most_clouds(threads)
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
        }
    }

    fn progress(&mut self, bytes: u64) -> Result<()> {
        let total = self.total;
        match (self.on_event)(Event::Progress { bytes, total }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted { path: self.report.output.clone() }),
        }
    }

    fn record(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Damaged { offset, problem } => {
                self.warn(format!("{problem} (byte {offset})"));
            }
            Record::Truncated { offset, problem } => {
                let cut = format!(
                    "cut off: {problem} (byte {offset}); annotated up to the last readable message"
                );
                self.warn(cut.clone());
                self.report.truncated = Some(cut);
            }
            other => self.writer.copy(other)?,
        }
        Ok(())
    }

    fn cloud(&mut self, cloud: Cloud) -> Result<()> {
        let Cloud { topic, number, header, position, message_len, result } = cloud;
        let started = Instant::now();
        let result = result.wait();
        self.report.profile.wait.take_since(started, 0);
        let (clustered, annotated) = match result {
            Ok(found) => found,
            Err(error) if error.is_of_boxes() => return Err(error),
            Err(error) => {
                let report = self.report.topics.entry(topic.to_string()).or_default();
                report.unreadable += 1;
                self.warn(format!("{topic}: {error} ({}); not annotated", place(position)));
                return Ok(());
            }
        };
        let added = self.channels_for(header.channel_id)?;
        for (channel_id, message) in
            [(added.instances, &annotated.cloud), (added.objects, &annotated.objects)]
        {
            let header = MessageHeader { channel_id, ..header };
            self.writer.write_message(&header, message)?;
            self.report.annotations += 1;
        }
        let report = self.report.topics.entry(topic.to_string()).or_default();
        report.take(&annotated, &clustered.stages);
        let remarks = remarks(&clustered, &self.options.method.taxonomy);
        for &(kind, ref problem) in &remarks {
            self.warn_once(&topic, kind, position, problem);
        }
        let remarks: Vec<String> = remarks.into_iter().map(|(_, problem)| problem).collect();
        let frame = Frame {
            topic: &topic,
            number,
            log_time_ns: header.log_time,
            stamp_ns: annotated.stamp_ns,
            frame_id: &annotated.frame_id,
            cloud: &clustered.cloud,
            stages: &clustered.stages,
            remarks: &remarks,
        };
        self.report.profile.take(&frame, message_len, &annotated);
        let _ = (self.on_event)(Event::Frame(frame));
        Ok(())
    }

    /// The channels added for the topic of a cloud's channel, made at its first cloud.
    fn channels_for(&mut self, cloud_channel: u16) -> Result<Added> {
        let (topic, format) = self.clouds[&cloud_channel].clone();
        let written = self.options.types.format(format);
        if let Some(&added) = self.added.get(&(Arc::clone(&topic), written)) {
            return Ok(added);
        }
        let channel = &self.overview.channels[&cloud_channel];
        let instances = self.add_instances(channel, format, written)?;
        let schema = self.options.types.objects(written)?;
        let objects = self.add_channel(&format!("{topic}{OBJECTS}"), &schema, channel)?;
        let added = Added { instances, objects };
        self.added.insert((topic, written), added);
        Ok(added)
    }

    /// The channel of the annotated clouds: as the cloud's own where they are of its format.
    fn add_instances(
        &mut self,
        cloud: &Channel,
        format: CloudFormat,
        written: CloudFormat,
    ) -> Result<u16> {
        let topic = format!("{}{INSTANCES}", cloud.topic);
        if format == written {
            let (encoding, metadata) = (&cloud.message_encoding, channel_metadata(cloud, format));
            return self.writer.add_channel(&topic, cloud.schema_id, encoding, &metadata);
        }
        self.add_channel(&topic, &written.schema(), cloud)
    }

    /// A channel of a type of its own beside a cloud's.
    fn add_channel(&mut self, topic: &str, schema: &MessageSchema, cloud: &Channel) -> Result<u16> {
        let id = self.writer.add_type(schema)?;
        let metadata = added_metadata(topic, schema, cloud);
        self.writer.add_channel(topic, id, schema.message_encoding, &metadata)
    }

    /// Completes the output. The reader is at the end of the input.
    pub(super) fn finish(mut self, reader: RecordingReader) -> Result<Report> {
        self.settle_all()?;
        for channel in self.clouds.keys().copied().collect::<Vec<_>>() {
            self.channels_for(channel)?;
        }
        for ((topic, kind), count) in std::mem::take(&mut self.warned) {
            if count > 1 {
                self.warn(format!("{topic}: {count} clouds {kind}"));
            }
        }
        self.report.input_sha256 = reader.finish()?;
        let metadata = metadata(&self.report, &self.options.method);
        self.writer.write_metadata(METADATA_NAME, &metadata)?;
        (self.report.output_bytes, self.report.profile.write) = self.writer.finish_timed()?;
        Ok(self.report)
    }
}
