//! A recording's clouds triaged one after the other; if asked for, the recording is written again
//! with a topic `T/suspicion` for each cloud topic `T`.

use std::collections::BTreeMap;
use std::path::Path;

use super::score::{Triage, triage};
use super::suspect::{Suspect, SuspectKind, TriageParams};
use crate::annotate::{
    AnnotateConfig, ClusteredFrame, FrameVisitor, RunEvent, VisitedFrames, added_metadata,
    for_each_frame, refuse_same_file, refuse_topic,
};
use crate::diagnose::explain;
use crate::error::{Conflict, Error, Result};
use crate::frames::{CloudTopic, Selection, choose_topics};
use crate::messages::diagnostics::{Diagnostic, Level, diagnostic_array, diagnostic_schema};
use crate::messages::ros::{ByteOrder, Layout};
use divmerge_recording::{
    Compression, MessageHeader, Overview, Record, RecordingWriter, WriteOptions,
};

/// Added to the name of a cloud's topic.
pub const SUSPICION: &str = "/suspicion";

/// Suspects of this score or more are reported as errors, because they are likelier right than
/// wrong; the others are reported as warnings.
pub const ERROR: f64 = 0.5;

/// Suspects of a lower score, such as splinters of a few points, are counted in a message but not
/// listed.
pub const LEAST: f64 = 0.01;

/// The recording that is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriageOutput<'a> {
    /// The file.
    pub path: &'a Path,
    /// Its compression.
    pub compression: Compression,
    /// Whether an existing file may be replaced.
    pub force: bool,
}

/// The result of triage over a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Triaged {
    /// The clouds that were visited.
    pub visited: VisitedFrames,
    /// Bytes of the output, if there is one.
    pub output_bytes: Option<u64>,
}

/// Called with each triaged cloud.
pub type OnFrame<'a> = dyn FnMut(&ClusteredFrame, &Triage) -> Result<()> + 'a;

/// Triages the selected clouds of a recording in the order of the file. With an output, everything
/// in the input is copied unchanged, whatever is selected, and each triaged cloud is followed by a
/// message on `T/suspicion` ([`diagnostics`]). The output appears under its name when it is
/// complete, or not at all. Memory does not grow with the length of the recording.
///
/// # Errors
/// Those of [`for_each_frame`], of `on_event` and of `on_frame`; [`Error::Conflict`] if the output
/// is the input or the input has a topic `T/suspicion` already.
pub fn triage_recording(
    input: &Path,
    output: Option<TriageOutput>,
    (selection, method, params): (&Selection, &AnnotateConfig, &TriageParams),
    on_event: &mut dyn FnMut(RunEvent) -> Result<()>,
    on_frame: &mut OnFrame,
) -> Result<Triaged> {
    let overview = Overview::read(input)?;
    let copy = output.map(|output| Copy::new(&overview, &output, &selection.topics)).transpose()?;
    let mut job = Job { method, params, on_event, on_frame, copy };
    let visited = for_each_frame(input, selection, method, &mut job)?;
    let output_bytes = job.copy.map(Copy::finish).transpose()?;
    Ok(Triaged { visited, output_bytes })
}

struct Job<'a> {
    method: &'a AnnotateConfig,
    params: &'a TriageParams,
    on_event: &'a mut dyn FnMut(RunEvent) -> Result<()>,
    on_frame: &'a mut OnFrame<'a>,
    copy: Option<Copy<'a>>,
}

impl FrameVisitor for Job<'_> {
    fn wants_records(&self) -> bool {
        self.copy.is_some()
    }

    fn record(&mut self, record: &Record) -> Result<()> {
        self.copy.as_mut().map_or(Ok(()), |copy| copy.record(record))
    }

    fn event(&mut self, event: RunEvent) -> Result<()> {
        if let RunEvent::Frame(frame) = &event {
            let found = triage_frame(frame, self.method, self.params);
            if let Some(copy) = &mut self.copy {
                copy.suspicion(frame, &found)?;
            }
            (self.on_frame)(frame, &found)?;
        }
        (self.on_event)(event)
    }
}

/// Triages a cloud of a recording that a method has clustered.
pub fn triage_frame(
    frame: &ClusteredFrame,
    method: &AnnotateConfig,
    params: &TriageParams,
) -> Triage {
    let ClusteredFrame { cloud, stages, .. } = *frame;
    let (mask, config) = (method.mask(cloud), &method.pipeline);
    let mut found = triage(&explain::ClusteredCloud { cloud, mask, config, stages }, params);
    for suspect in &mut found.suspects {
        suspect.position = cloud.recorded(suspect.position);
    }
    found
}

/// The recording that is being written.
struct Copy<'a> {
    overview: &'a Overview,
    writer: RecordingWriter,
    /// Channel of each `T/suspicion`, by T.
    channels: BTreeMap<String, u16>,
    scratch: Vec<u8>,
}

impl<'a> Copy<'a> {
    fn new(overview: &'a Overview, output: &TriageOutput, topics: &[String]) -> Result<Self> {
        refuse(overview, output.path, topics)?;
        let mut writer = RecordingWriter::create(
            output.path,
            &WriteOptions {
                profile: overview.profile.clone(),
                recorded_by: overview.library.clone(),
                compression: output.compression,
                force: output.force,
            },
        )?;
        writer.reserve(overview);
        Ok(Copy { overview, writer, channels: BTreeMap::new(), scratch: Vec::new() })
    }

    fn record(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Damaged { .. } | Record::Truncated { .. } => Ok(()),
            _ => Ok(self.writer.copy(record)?),
        }
    }

    /// Adds the message about a cloud.
    fn suspicion(&mut self, frame: &ClusteredFrame, found: &Triage) -> Result<()> {
        let header = frame.header;
        let channel_id = self.channel(frame.key.topic, header.channel_id)?;
        let diagnostics = diagnostics(frame.key.topic, found);
        let (sec, nanosec) = split(frame.key.stamp_ns);
        let layout = layout(self.overview, header.channel_id)?;
        let mut message = std::mem::take(&mut self.scratch);
        diagnostic_array(layout, (sec, nanosec), frame.key.frame_id, &diagnostics, &mut message);
        self.writer.write_message(&MessageHeader { channel_id, ..header }, &message)?;
        self.scratch = message;
        Ok(())
    }

    fn channel(&mut self, topic: &str, of_cloud: u16) -> Result<u16> {
        if let Some(&channel) = self.channels.get(topic) {
            return Ok(channel);
        }
        let cloud = &self.overview.channels[&of_cloud];
        let schema = diagnostic_schema(layout(self.overview, of_cloud)?);
        let id = schema.add_to(&mut self.writer)?;
        let added = format!("{topic}{SUSPICION}");
        let metadata = added_metadata(&added, &schema, cloud);
        let channel = self.writer.add_channel(&added, id, schema.message_encoding, &metadata)?;
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }

    fn finish(self) -> Result<u64> {
        Ok(self.writer.finish()?)
    }
}

/// The layout of messages beside those of a channel's clouds.
fn layout(overview: &Overview, channel: u16) -> Result<Layout> {
    let cloud = &overview.channels[&channel];
    match cloud.message_encoding.as_str() {
        "cdr" => Ok(Layout::Cdr(ByteOrder::Little)),
        "ros1" => Ok(Layout::Ros1),
        other => {
            let problem =
                Conflict::NotRos { topic: cloud.topic.clone(), encoding: other.to_owned() };
            Err(Error::Conflict { path: overview.path.clone(), problem })
        }
    }
}

/// Seconds and nanoseconds of a stamp.
fn split(stamp_ns: i64) -> (i32, u32) {
    const SECOND: i64 = 1_000_000_000;
    (stamp_ns.div_euclid(SECOND) as i32, stamp_ns.rem_euclid(SECOND) as u32)
}

/// Refuses an output that is the input, and an input that has the topics that would be added or
/// cannot have them.
fn refuse(overview: &Overview, output: &Path, topics: &[String]) -> Result<()> {
    refuse_same_file(&overview.path, output)?;
    for (id, CloudTopic { topic, .. }) in choose_topics(overview, topics, None)? {
        layout(overview, id)?;
        refuse_topic(overview, format!("{topic}{SUSPICION}"))?;
    }
    Ok(())
}

/// A frame's suspects as diagnostics: first the frame with its score and its number of suspects of
/// each kind, then each suspect of score [`LEAST`] or more with its figures.
pub fn diagnostics(topic: &str, found: &Triage) -> Vec<Diagnostic> {
    let of =
        |kind: SuspectKind| found.suspects.iter().filter(|suspect| suspect.kind == kind).count();
    let mut values = vec![
        ("score", number(found.score)),
        ("suspects", found.suspects.len().to_string()),
        ("instances", found.instances.len().to_string()),
    ];
    values.extend(SuspectKind::ALL.map(|kind| (kind.key(), of(kind).to_string())));
    let worst = found.suspects.first();
    let frame = Diagnostic {
        level: worst.map_or(Level::Ok, level),
        name: "frame".into(),
        message: worst.map_or("nothing suspect".into(), |suspect| suspect.sentence.clone()),
        hardware_id: topic.to_owned(),
        values,
    };
    let worth = found.suspects.iter().filter(|suspect| suspect.score >= LEAST);
    let each = worth.map(|suspect| diagnostic(topic, suspect));
    std::iter::once(frame).chain(each).collect()
}

fn level(suspect: &Suspect) -> Level {
    if suspect.score >= ERROR { Level::Error } else { Level::Warn }
}

fn diagnostic(topic: &str, suspect: &Suspect) -> Diagnostic {
    let [x, y, z] = suspect.position;
    let mut values = vec![("score", number(suspect.score)), ("evidence", number(suspect.evidence))];
    values.extend([("x", number(x)), ("y", number(y)), ("z", number(z))]);
    values.extend([("measured", number(suspect.measured)), ("bound", number(suspect.bound))]);
    values.push(("unit", suspect.unit.to_owned()));
    let names = ["instance", "other_instance"];
    let concerns = names.into_iter().zip(&suspect.concerns);
    values.extend(concerns.map(|(name, concern)| (name, concern.instance.to_string())));
    Diagnostic {
        level: level(suspect),
        name: suspect.kind.name().into(),
        message: suspect.sentence.clone(),
        hardware_id: topic.to_owned(),
        values,
    }
}

/// With four decimals.
fn number(value: f64) -> String {
    format!("{value:.4}")
}
