//! The main job: a recording in, the same recording with instances out.

mod message;
mod report;
mod topics;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::io::{
    CloudNumber, Compression, MARKER_ARRAY_NAME, MARKER_ARRAY_SCHEMA, MessageHeader, Overview,
    Position, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use crate::pipeline::Stages;

pub use crate::io::frames::{is_cloud, is_readable_cloud};
pub use message::{Annotated, Clustered, Decoded, Method, Semantics, annotate_message, cluster};
use report::metadata;
pub use report::{FrameTimes, METADATA_NAME, Report, TopicReport, remarks};
pub(crate) use topics::qos;
use topics::{INSTANCES, OBJECTS, channel_metadata, refuse_annotated};
pub use topics::{choose, is_annotation};

/// What is done to a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// What is done to each cloud.
    pub method: Method,
    /// Cloud topics to annotate; none means all.
    pub topics: Vec<String>,
    /// Earliest log time in nanoseconds; earlier messages are left out of the output.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds from which on messages are left out of the output.
    pub to_ns: Option<u64>,
    /// Compression of the output.
    pub compression: Compression,
    /// Whether an existing output may be replaced.
    pub force: bool,
}

/// One clustered cloud of a recording, for whoever looks on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<'a> {
    /// Topic of the cloud.
    pub topic: &'a str,
    /// Number of the cloud on its topic, from 0; unreadable clouds count.
    pub number: u64,
    /// When the cloud was logged, nanoseconds since 1970.
    pub log_time_ns: u64,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Coordinate frame of the cloud.
    pub frame_id: &'a str,
    /// The cloud.
    pub cloud: &'a PointCloud,
    /// What became of it.
    pub stages: &'a Stages,
    /// What is odd about it, in words.
    pub remarks: &'a [String],
}

/// What happened on the way, as it happens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// So many bytes of the input have been read.
    Progress {
        /// Bytes read.
        bytes: u64,
        /// Bytes of the input.
        total: u64,
    },
    /// Something the user should know; complete with topic and place.
    Warning(&'a str),
    /// A cloud has been clustered.
    Frame(Frame<'a>),
}

/// Annotates a recording.
///
/// Everything in the input is copied unchanged; each cloud message is followed by one on `T/instances`
/// and one on `T/objects`. A cloud that cannot be read is passed through, warned of and counted. The
/// output appears under its name when it is complete, or not at all. Memory does not grow with the
/// length of the recording, but for the boxes of a topic where those are asked for.
///
/// # Errors
/// [`Error::Recording`] if the input is damaged (a cut-off input is none: it is annotated as far as it
/// goes), [`Error::NoCloud`], [`Error::Conflict`] if the input already has an output's topic or is the
/// output,
/// [`Error::Io`] and [`Error::Write`]; [`Error::Boxes`] if boxes do not fit a cloud; [`Error::Interrupted`] if `on_event` breaks off at a progress event.
pub fn annotate(
    input: &Path,
    output: &Path,
    options: &Options,
    on_event: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<Report> {
    refuse_same_file(input, output)?;
    let overview = Overview::read(input)?;
    let mut job = Job::new(&overview, output, options, on_event)?;
    let mut reader = RecordingReader::open(input)?;
    let total = reader.file_size();
    while let Some(record) = reader.next_record()? {
        let bytes = job.record(&record)?;
        if bytes > 0 {
            let bytes = reader.offset();
            if (job.on_event)(Event::Progress { bytes, total }).is_break() {
                return Err(Error::Interrupted { path: output.to_owned() });
            }
        }
    }
    let hash = reader.finish()?;
    job.finish(hash)
}

pub(crate) fn refuse_same_file(input: &Path, output: &Path) -> Result<()> {
    match (input.canonicalize(), output.canonicalize()) {
        (Ok(from), Ok(to)) if from == to => Err(Error::Conflict {
            path: input.to_owned(),
            problem: "the output is the input itself, which is never touched".into(),
        }),
        _ => Ok(()),
    }
}

/// An annotation under way.
struct Job<'a> {
    overview: &'a Overview,
    options: &'a Options,
    on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    writer: RecordingWriter,
    /// Topic of each channel whose clouds are annotated.
    clouds: BTreeMap<u16, String>,
    /// Channels added for each topic, once they are: instances and objects.
    added: BTreeMap<String, (u16, u16)>,
    /// Number of the next cloud of each topic.
    next_number: BTreeMap<String, u64>,
    /// Memory for the messages of the next cloud.
    scratch: Annotated,
    /// Warnings by topic and kind: how often, and where first.
    warned: BTreeMap<(String, &'static str), u64>,
    report: Report,
}

impl<'a> Job<'a> {
    fn new(
        overview: &'a Overview,
        output: &Path,
        options: &'a Options,
        on_event: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Self> {
        let clouds = choose(overview, &options.topics)?;
        refuse_annotated(overview, &clouds)?;
        let mut writer = RecordingWriter::create(
            output,
            &WriteOptions {
                profile: overview.profile.clone(),
                recorded_by: overview.library.clone(),
                compression: options.compression,
                force: options.force,
            },
        )?;
        writer.reserve(overview);
        let topics = clouds.values().map(|topic| (topic.clone(), TopicReport::default()));
        let report = Report {
            input: overview.path.clone(),
            output: output.to_owned(),
            topics: topics.collect(),
            ..Report::default()
        };
        let mut job = Job {
            overview,
            options,
            on_event,
            writer,
            clouds,
            added: BTreeMap::new(),
            next_number: BTreeMap::new(),
            scratch: Annotated::default(),
            warned: BTreeMap::new(),
            report,
        };
        job.warn_of_other_clouds();
        Ok(job)
    }

    fn warn_of_other_clouds(&mut self) {
        for channel in self.overview.channels.values() {
            if !is_cloud(self.overview, channel) || is_readable_cloud(self.overview, channel) {
                continue;
            }
            let schema = self.overview.schema_of(channel.id).map(|schema| schema.name.as_str());
            self.warn(format!(
                "{}: {} in encoding `{}` cannot be read yet; passed through without annotation",
                channel.topic,
                schema.unwrap_or("no schema"),
                channel.message_encoding
            ));
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

    /// Copies a record and annotates it if it is a cloud. Returns the bytes of a message.
    fn record(&mut self, record: &Record) -> Result<usize> {
        match record {
            Record::Message { header, data, position } => {
                let topic = self.clouds.get(&header.channel_id).cloned();
                let number = topic.as_ref().map(|topic| self.count_cloud(topic));
                if self.is_outside(header.log_time) {
                    return Ok(data.len());
                }
                self.writer.copy(record)?;
                self.report.messages += 1;
                if let Some((topic, number)) = topic.zip(number) {
                    self.cloud(&topic, number, header, data, *position)?;
                }
                return Ok(data.len());
            }
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
        Ok(0)
    }

    fn is_outside(&self, log_time: u64) -> bool {
        self.options.from_ns.is_some_and(|from| log_time < from)
            || self.options.to_ns.is_some_and(|to| log_time >= to)
    }

    /// The number of a topic's next cloud.
    fn count_cloud(&mut self, topic: &str) -> u64 {
        let next = self.next_number.entry(topic.to_owned()).or_default();
        *next += 1;
        *next - 1
    }

    fn cloud(
        &mut self,
        topic: &str,
        number: u64,
        header: &MessageHeader,
        data: &[u8],
        position: Position,
    ) -> Result<()> {
        let mut annotated = std::mem::take(&mut self.scratch);
        let which = CloudNumber { topic, number };
        let clustered = match annotate_message(data, which, &self.options.method, &mut annotated) {
            Ok(clustered) => clustered,
            Err(error) if error.is_of_boxes() => return Err(error),
            Err(error) => {
                let report = self.report.topics.entry(topic.to_owned()).or_default();
                report.unreadable += 1;
                self.warn(format!("{topic}: {error} ({}); not annotated", place(position)));
                return Ok(());
            }
        };
        let (instances, objects) = self.channels_for(topic, header.channel_id)?;
        for (channel_id, message) in [(instances, &annotated.cloud), (objects, &annotated.objects)]
        {
            let header = MessageHeader { channel_id, ..*header };
            self.writer.write_message(&header, message)?;
        }
        let report = self.report.topics.entry(topic.to_owned()).or_default();
        let stages = &clustered.stages;
        report.take(&annotated, stages);
        let remarks = remarks(&clustered, &self.options.method.taxonomy);
        for &(kind, ref problem) in &remarks {
            self.warn_once(topic, kind, position, problem);
        }
        let remarks: Vec<String> = remarks.into_iter().map(|(_, problem)| problem).collect();
        let _ = (self.on_event)(Event::Frame(Frame {
            topic,
            number,
            log_time_ns: header.log_time,
            stamp_ns: annotated.stamp_ns,
            frame_id: &annotated.frame_id,
            cloud: &clustered.cloud,
            stages,
            remarks: &remarks,
        }));
        self.scratch = annotated;
        Ok(())
    }

    /// The channels added for a topic, made at its first cloud.
    fn channels_for(&mut self, topic: &str, cloud_channel: u16) -> Result<(u16, u16)> {
        if let Some(&channels) = self.added.get(topic) {
            return Ok(channels);
        }
        let channel = &self.overview.channels[&cloud_channel];
        let metadata = qos(channel);
        let markers = MARKER_ARRAY_SCHEMA.as_bytes();
        let marker_schema = self.writer.add_schema(MARKER_ARRAY_NAME, "ros2msg", markers)?;
        let mut add = |end: &str, schema: u16, metadata: &BTreeMap<String, String>| {
            self.writer.add_channel(&format!("{topic}{end}"), schema, "cdr", metadata)
        };
        let instances = add(INSTANCES, channel.schema_id, &channel_metadata(channel, &metadata))?;
        let objects = add(OBJECTS, marker_schema, &metadata)?;
        self.added.insert(topic.to_owned(), (instances, objects));
        Ok((instances, objects))
    }

    fn finish(mut self, hash: String) -> Result<Report> {
        for (channel, topic) in self.clouds.clone() {
            self.channels_for(&topic, channel)?;
        }
        for ((topic, kind), count) in std::mem::take(&mut self.warned) {
            if count > 1 {
                self.warn(format!("{topic}: {count} clouds {kind}"));
            }
        }
        self.report.input_sha256 = hash;
        let metadata = metadata(&self.report, &self.options.method);
        self.writer.write_metadata(METADATA_NAME, &metadata)?;
        self.report.output_bytes = self.writer.finish()?;
        Ok(self.report)
    }
}

pub(crate) fn place(position: Position) -> String {
    format!(
        "message {} of the chunk at byte {}",
        position.index_in_chunk + 1,
        position.chunk_offset
    )
}
