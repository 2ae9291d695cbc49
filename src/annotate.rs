//! The main job: a recording in, the same recording with instances out.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::instances::{Instance, Reason};
use crate::io::{
    self, Channel, Compression, MARKER_ARRAY_NAME, MARKER_ARRAY_SCHEMA, MarkerBox, MessageHeader,
    Overview, PointAnnotation, PointCloud2, Position, Record, RecordingReader, RecordingWriter,
    WriteOptions,
};
use crate::pipeline::{self, Config, StageTimes, Stages};
use crate::semantics::{GroundParams, MaskSource};
use crate::taxonomy::Taxonomy;

pub use crate::io::frames::{is_cloud, is_readable_cloud};

/// Name of the metadata record that says how a recording was annotated.
pub const METADATA_NAME: &str = "divmerge";

/// Where the object mask of a recording's clouds comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Semantics {
    /// A field `label`, `semantic`, `class_id` or `class_ids` if the cloud has one, else ground removal.
    Auto,
    /// The field of that name.
    Field(String),
    /// Ground removal.
    Ground,
    /// Every return is an object.
    All,
}

/// What is done to each cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// Where objects come from.
    pub semantics: Semantics,
    /// What the ids of a semantic field mean.
    pub taxonomy: Taxonomy,
    /// Ground removal.
    pub ground: GroundParams,
    /// Projection and clustering.
    pub config: Config,
}

/// A cloud as the method sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded<'a> {
    /// The cloud, with classes if they are asked for.
    pub cloud: PointCloud,
    /// Where its object mask comes from.
    pub mask: MaskSource<'a>,
    /// The same in words, as in `field:label`.
    pub semantics: String,
}

impl Method {
    /// The cloud in a message, and where its object mask comes from.
    ///
    /// # Errors
    /// Those of [`PointCloud2::to_cloud`]; [`Error::MissingField`] if the field that should hold the
    /// classes is not there.
    pub fn decode(&self, wire: &PointCloud2) -> Result<Decoded<'_>> {
        let field = match &self.semantics {
            Semantics::Auto => wire.semantic_field(),
            Semantics::Field(name) => Some(name.as_str()),
            Semantics::Ground | Semantics::All => None,
        };
        let cloud = wire.to_cloud(field)?;
        let (mask, semantics) = match (&self.semantics, field) {
            (Semantics::All, _) => (MaskSource::All, "all".to_owned()),
            (_, Some(field)) => (MaskSource::Classes(&self.taxonomy), format!("field:{field}")),
            (_, None) => (MaskSource::NotGround(&self.ground), "ground".to_owned()),
        };
        Ok(Decoded { cloud, mask, semantics })
    }
}

/// What is done to a recording.
#[derive(Debug, Clone, PartialEq)]
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

/// What was done.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// The input.
    pub input: PathBuf,
    /// The output.
    pub output: PathBuf,
    /// Bytes of the output.
    pub output_bytes: u64,
    /// SHA-256 of the input.
    pub input_sha256: String,
    /// Messages copied.
    pub messages: u64,
    /// Per cloud topic.
    pub topics: BTreeMap<String, TopicReport>,
    /// Where and how the input is cut off.
    pub truncated: Option<String>,
    /// Everything that was warned of.
    pub warnings: Vec<String>,
}

impl Report {
    /// Whether every cloud was annotated and the input was whole.
    pub fn is_complete(&self) -> bool {
        self.truncated.is_none() && self.topics.values().all(|topic| topic.unreadable == 0)
    }
}

/// What was done to one topic.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TopicReport {
    /// Clouds annotated.
    pub frames: u64,
    /// Clouds passed through without annotation because they cannot be read.
    pub unreadable: u64,
    /// Points of the annotated clouds.
    pub points: u64,
    /// Instances found, all frames together.
    pub instances: u64,
    /// Where objects came from, and in how many frames.
    pub semantics: BTreeMap<String, u64>,
    /// How the range image was made, and in how many frames.
    pub projection: BTreeMap<String, u64>,
    /// Points per reason; `instance` counts those that have one.
    pub reasons: BTreeMap<&'static str, u64>,
    /// Milliseconds per frame.
    #[serde(flatten)]
    pub times: FrameTimes,
}

/// Mean milliseconds per frame, message bytes to message bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct FrameTimes {
    /// Message to cloud.
    pub decode_ms: f64,
    /// Cloud to labels.
    #[serde(flatten)]
    pub stages: StageTimes,
    /// Labels to messages.
    pub encode_ms: f64,
}

impl FrameTimes {
    /// All of it.
    pub fn total_ms(&self) -> f64 {
        self.decode_ms + self.stages.total_ms() + self.encode_ms
    }

    fn each(&mut self) -> [&mut f64; 7] {
        let stages = &mut self.stages;
        [
            &mut self.decode_ms,
            &mut stages.projection_ms,
            &mut stages.mask_ms,
            &mut stages.divide_ms,
            &mut stages.merge_ms,
            &mut stages.labels_ms,
            &mut self.encode_ms,
        ]
    }

    /// Takes one more frame into the mean over `frames` frames.
    fn take(&mut self, mut frame: FrameTimes, frames: u64) {
        for (mean, value) in self.each().into_iter().zip(frame.each()) {
            *mean += (*value - *mean) / frames as f64;
        }
    }
}

/// One annotated cloud.
#[derive(Debug, Clone, Default)]
pub struct Annotated {
    /// The message of `T/instances`.
    pub cloud: Vec<u8>,
    /// The message of `T/objects`.
    pub objects: Vec<u8>,
    /// Coordinate frame of the cloud.
    pub frame_id: String,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// Milliseconds.
    pub times: FrameTimes,
}

/// Whether a topic is one that an earlier annotation added beside its cloud topic.
pub fn is_annotation(overview: &Overview, topic: &str) -> bool {
    topic
        .strip_suffix(INSTANCES)
        .is_some_and(|cloud| overview.channels_of(&format!("{cloud}{OBJECTS}")).next().is_some())
}

const INSTANCES: &str = "/instances";
const OBJECTS: &str = "/objects";

/// A cloud out of a message, clustered.
#[derive(Debug, Clone, PartialEq)]
pub struct Clustered {
    /// The cloud.
    pub cloud: PointCloud,
    /// Every intermediate of its run.
    pub stages: Stages,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// Milliseconds from message to cloud.
    pub decode_ms: f64,
}

/// Clusters the cloud in a message.
///
/// # Errors
/// Those of [`PointCloud2::to_cloud`]; [`Error::MissingField`] if the field that should hold the classes
/// is not there.
pub fn cluster(wire: &PointCloud2, method: &Method) -> Result<Clustered> {
    let started = Instant::now();
    let Decoded { cloud, mask, semantics } = method.decode(wire)?;
    let decode_ms = started.elapsed().as_secs_f64() * 1e3;
    let stages = pipeline::run(&cloud, mask, &method.config);
    Ok(Clustered { cloud, stages, semantics, decode_ms })
}

/// Clusters the cloud in a message and writes the two messages that annotate it into `annotated`, whose
/// memory is used again.
///
/// # Errors
/// Those of [`PointCloud2::parse`] and [`cluster`].
pub fn annotate_message(
    message: &[u8],
    method: &Method,
    annotated: &mut Annotated,
) -> Result<Clustered> {
    let started = Instant::now();
    let wire = PointCloud2::parse(message)?;
    let parse_ms = started.elapsed().as_secs_f64() * 1e3;
    let clustered = cluster(&wire, method)?;

    let started = Instant::now();
    let stages = &clustered.stages;
    let reason: Vec<u8> = stages.labels.reason.iter().map(|&reason| reason as u8).collect();
    let annotation = PointAnnotation {
        instance: &stages.labels.instance,
        component: &stages.labels.component,
        semantic: &stages.labels.semantic,
        reason: &reason,
    };
    io::annotated_cloud(&wire, &annotation, &mut annotated.cloud)?;
    let boxes: Vec<MarkerBox> = stages.instances.iter().map(marker).collect();
    let (seconds, nanoseconds) = (wire.stamp_sec, wire.stamp_nanosec);
    let frame = &wire.frame_id;
    io::marker_array(wire.byte_order, seconds, nanoseconds, frame, &boxes, &mut annotated.objects);
    annotated.frame_id.clone_from(frame);
    annotated.stamp_ns = wire.stamp_ns();
    annotated.semantics.clone_from(&clustered.semantics);
    annotated.times = FrameTimes {
        decode_ms: parse_ms + clustered.decode_ms,
        stages: stages.times,
        encode_ms: started.elapsed().as_secs_f64() * 1e3,
    };
    Ok(clustered)
}

fn marker(instance: &Instance) -> MarkerBox {
    MarkerBox {
        id: instance.id,
        centre: instance.bounds.centre,
        yaw: instance.bounds.yaw,
        size: instance.bounds.size,
        text: format!("{} {}", instance.id, instance.class_name).trim_end().to_owned(),
    }
}

/// Annotates a recording.
///
/// Everything in the input is copied unchanged; each cloud message is followed by one on `T/instances`
/// and one on `T/objects`. A cloud that cannot be read is passed through, warned of and counted. The
/// output appears under its name when it is complete, or not at all. Memory does not grow with the
/// length of the recording.
///
/// # Errors
/// [`Error::Recording`] if the input is damaged (a cut-off input is none: it is annotated as far as it
/// goes), [`Error::NoCloud`], [`Error::Conflict`] if the input already has an output's topic or is the
/// output,
/// [`Error::Io`] and [`Error::Write`]; [`Error::Interrupted`] if `on_event` breaks off at a progress event.
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

fn refuse_same_file(input: &Path, output: &Path) -> Result<()> {
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
        let clustered = match annotate_message(data, &self.options.method, &mut annotated) {
            Ok(clustered) => clustered,
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
        let remarks = remarks(stages, &self.options.method.taxonomy);
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

impl TopicReport {
    fn take(&mut self, annotated: &Annotated, stages: &Stages) {
        self.frames += 1;
        self.points += stages.labels.reason.len() as u64;
        self.instances += stages.instances.len() as u64;
        *self.semantics.entry(annotated.semantics.clone()).or_default() += 1;
        *self.projection.entry(describe_image(stages)).or_default() += 1;
        for (reason, count) in Reason::ALL.into_iter().zip(stages.labels.counts()) {
            *self.reasons.entry(reason.describe()).or_default() += count;
        }
        self.times.take(annotated.times, self.frames);
    }
}

fn describe_image(stages: &Stages) -> String {
    let image = &stages.image;
    format!("{}, {} x {}", image.projection.describe(), image.rows(), image.columns())
}

pub(crate) fn place(position: Position) -> String {
    format!(
        "message {} of the chunk at byte {}",
        position.index_in_chunk + 1,
        position.chunk_offset
    )
}

/// What is odd about a cloud that could be read: a word for the kind, and a sentence.
pub fn remarks(stages: &Stages, taxonomy: &Taxonomy) -> Vec<(&'static str, String)> {
    let counts = stages.labels.counts();
    let points = stages.labels.reason.len() as u64;
    let returns = points - counts[Reason::NoReturn as usize];
    let shadowed = stages.image.shadowed_count() as u64;
    let mut remarks = Vec::new();
    if points == 0 {
        remarks.push(("without points", "a cloud without points".to_owned()));
    } else if returns == 0 {
        let problem = format!("none of {points} points is a return: all NaN or at the origin");
        remarks.push(("without returns", problem));
    } else if shadowed * 5 > returns * 4 {
        let problem = format!(
            "{shadowed} of {returns} returns lie behind a nearer one in the same pixel of the {} x {} \
             range image ({})",
            stages.image.rows(),
            stages.image.columns(),
            stages.image.projection.describe()
        );
        remarks.push(("with most returns shadowed", problem));
    }
    if stages.mask.unknown_ids > 0 {
        let problem = format!(
            "{} points have a class that the taxonomy `{}` does not know",
            stages.mask.unknown_ids, taxonomy.name
        );
        remarks.push(("with unknown classes", problem));
    }
    remarks
}

/// The channels whose clouds are clustered, with their topics.
///
/// # Errors
/// [`Error::NoCloud`] if there is none, or none of a topic that was asked for.
pub fn choose(overview: &Overview, topics: &[String]) -> Result<BTreeMap<u16, String>> {
    let readable: BTreeMap<u16, String> = overview
        .channels
        .values()
        .filter(|channel| is_readable_cloud(overview, channel))
        .filter(|channel| !is_annotation(overview, &channel.topic))
        .map(|channel| (channel.id, channel.topic.clone()))
        .collect();
    let no_cloud = |problem: String| Error::NoCloud { path: overview.path.clone(), problem };
    if readable.is_empty() {
        return Err(no_cloud(format!("no cloud topic that can be read; {}", list(overview))));
    }
    if let Some(missing) = topics.iter().find(|&topic| !readable.values().any(|have| have == topic))
    {
        let known = readable.values().map(String::as_str).collect::<Vec<_>>().join(", ");
        return Err(no_cloud(format!("no readable cloud topic `{missing}`; there is: {known}")));
    }
    Ok(readable
        .into_iter()
        .filter(|(_, topic)| topics.is_empty() || topics.contains(topic))
        .collect())
}

/// Refuses a recording that has the topics that would be added.
fn refuse_annotated(overview: &Overview, clouds: &BTreeMap<u16, String>) -> Result<()> {
    for topic in clouds.values() {
        for end in [INSTANCES, OBJECTS] {
            let added = format!("{topic}{end}");
            if overview.channels_of(&added).next().is_some() {
                let problem =
                    format!("already has a topic {added}: annotate the recording it was made from");
                let path = overview.path.clone();
                return Err(Error::Conflict { path, problem });
            }
        }
    }
    Ok(())
}

fn list(overview: &Overview) -> String {
    if overview.channels.is_empty() {
        return "it has no topic at all".into();
    }
    let describe = |channel: &Channel| {
        let schema = overview.schema_of(channel.id).map(|schema| schema.name.as_str());
        format!("{} ({})", channel.topic, schema.unwrap_or("no schema"))
    };
    let topics: Vec<String> = overview.channels.values().map(describe).collect();
    format!("its topics: {}", topics.join(", "))
}

const QOS: &str = "offered_qos_profiles";

/// Quality-of-service metadata for an added channel: the cloud's own where it has some, else rosbag2's
/// form of reliable, volatile, keep the last ten.
fn qos(cloud: &Channel) -> BTreeMap<String, String> {
    const DEFAULT: &str = "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n";
    let own = cloud.metadata.get(QOS).filter(|own| !own.trim().is_empty());
    let profile = own.map_or(DEFAULT, String::as_str);
    BTreeMap::from([(QOS.to_owned(), profile.to_owned())])
}

/// Metadata of the instances' channel: of the same type as the cloud, so with the same type hash.
fn channel_metadata(cloud: &Channel, qos: &BTreeMap<String, String>) -> BTreeMap<String, String> {
    let mut metadata = cloud.metadata.clone();
    metadata.extend(qos.clone());
    metadata
}

/// The metadata record: version, parameters, the input's hash, counts per reason.
fn metadata(report: &Report, method: &Method) -> BTreeMap<String, String> {
    let json = |value: serde_json::Value| value.to_string();
    let mut metadata = BTreeMap::from([
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("input_sha256".to_owned(), report.input_sha256.clone()),
        ("preset".to_owned(), method.config.preset.to_owned()),
        ("taxonomy".to_owned(), method.taxonomy.name.clone()),
        ("parameters".to_owned(), json(serde_json::json!(method.config))),
        ("ground".to_owned(), json(serde_json::json!(method.ground))),
    ]);
    if let Some(cut) = &report.truncated {
        metadata.insert("truncated".to_owned(), cut.clone());
    }
    for (topic, report) in &report.topics {
        let value = serde_json::json!({
            "frames": report.frames,
            "unreadable": report.unreadable,
            "points": report.points,
            "instances": report.instances,
            "semantics": report.semantics,
            "projection": report.projection,
            "reasons": report.reasons,
        });
        metadata.insert(format!("topic {topic}"), json(value));
    }
    metadata
}
