//! Clusters the clouds of a recording one after the other, for whoever wants to look at them; nothing is
//! written.

use std::collections::BTreeMap;
use std::ops::{Bound, RangeBounds};
use std::path::Path;

use crate::annotate::{self, CloudTopic, Event, Frame, Method, cluster, remarks};
use crate::error::{Error, Result};
pub use crate::io::FrameRange;
use crate::io::recording::is_past;
use crate::io::{
    CloudNumber, MessageHeader, Overview, Position, ReadFilter, Record, RecordingReader,
};
use crate::workers::Workers;

/// Which clouds are clustered.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Cloud topics; none means all.
    pub topics: Vec<String>,
    /// Numbers of the clouds on each topic.
    pub frames: FrameRange,
    /// Earliest log time in nanoseconds.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds from which on clouds are left out.
    pub to_ns: Option<u64>,
}

impl Default for Selection {
    fn default() -> Self {
        let frames = (Bound::Unbounded, Bound::Unbounded);
        Selection { topics: Vec::new(), frames, from_ns: None, to_ns: None }
    }
}

/// What was seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Clouds clustered.
    pub frames: u64,
    /// Clouds that could not be read.
    pub unreadable: u64,
    /// Whether the input is cut off.
    pub is_cut_off: bool,
}

/// Clusters the selected clouds in the order of the file and hands each to `on_event`, whose error ends it.
/// A cloud that cannot be read is warned of and counted. By the file's index, chunks without a selected cloud are not
/// read. Memory does not grow with the length of the
/// recording.
///
/// # Errors
/// [`Error::NoCloud`] if there is no topic, none has the frames, or none lies between the times,
/// [`Error::Recording`] if the input is damaged, [`Error::Io`], [`Error::Boxes`] if boxes do not fit a cloud, and
/// those of `on_event`.
pub fn replay(
    input: &Path,
    selection: &Selection,
    method: &Method,
    on_event: &mut dyn FnMut(Event) -> Result<()>,
) -> Result<Replayed> {
    play(input, selection, method, &mut Onlooker(on_event))
}

/// Someone who sees a recording go by.
pub trait Watcher {
    /// Whether records are wanted that hold no selected cloud; else the recording is left where the last
    /// selected cloud was.
    fn wants_all(&self) -> bool;

    /// A record, before its cloud is clustered.
    ///
    /// # Errors
    /// Whatever ends the replay.
    fn record(&mut self, record: &Record) -> Result<()>;

    /// What happened; as in [`replay`].
    ///
    /// # Errors
    /// Whatever ends the replay.
    fn event(&mut self, event: Event) -> Result<()>;
}

/// Sees events alone.
struct Onlooker<'a>(&'a mut dyn FnMut(Event) -> Result<()>);

impl Watcher for Onlooker<'_> {
    fn wants_all(&self) -> bool {
        false
    }

    fn record(&mut self, _: &Record) -> Result<()> {
        Ok(())
    }

    fn event(&mut self, event: Event) -> Result<()> {
        (self.0)(event)
    }
}

/// As [`replay`], for someone who wants to see the records too.
///
/// # Errors
/// Those of [`replay`] and of the watcher.
pub fn play(
    input: &Path,
    selection: &Selection,
    method: &Method,
    watcher: &mut dyn Watcher,
) -> Result<Replayed> {
    let overview = Overview::read(input)?;
    let clouds = annotate::choose_beside(&overview, &selection.topics, method.class_topic())?;
    refuse_missing(&overview, &clouds, selection)?;
    let mut reader = match watcher.wants_all() {
        true => RecordingReader::open(input)?,
        false => {
            let wanted = selection.wanted(&clouds);
            RecordingReader::open_filtered(&overview, &wanted, &Workers::none())?
        }
    };
    let total = reader.file_size();
    let mut tally = Tally::default();
    while let Some(record) = reader.next_record()? {
        watcher.record(&record)?;
        match &record {
            Record::Message { header, data, position } => {
                let Some(source) = clouds.get(&header.channel_id) else {
                    continue;
                };
                let number = tally.count(&source.topic);
                if selection.contains(number, header.log_time) {
                    tally.cluster(source, number, (header, data, *position), method, watcher)?;
                }
            }
            Record::Skipped { counts } => tally.pass(&clouds, counts),
            Record::Damaged { offset, damage } => {
                watcher.event(Event::Warning(&format!("{damage} (byte {offset})")))?;
            }
            Record::Truncated { offset, damage } => {
                watcher.event(Event::Warning(&format!("cut off: {damage} (byte {offset})")))?;
                tally.replayed.is_cut_off = true;
            }
            _ => continue,
        }
        let is_seen = !watcher.wants_all();
        let is_past = |source: &CloudTopic| is_past(&selection.frames, tally.seen(&source.topic));
        if is_seen && clouds.values().all(is_past) {
            break;
        }
        let bytes = reader.offset();
        watcher.event(Event::Progress { bytes, total })?;
    }
    if tally.replayed.frames + tally.replayed.unreadable == 0 {
        let problem = "no cloud lies in the frames and times asked for".to_owned();
        return Err(Error::NoCloud { path: input.to_owned(), problem });
    }
    Ok(tally.replayed)
}

impl Selection {
    /// Refuses a selection that the recording has nothing for, as far as its index tells.
    ///
    /// # Errors
    /// [`Error::NoCloud`], and those of [`Overview::read`].
    pub fn check(&self, input: &Path) -> Result<()> {
        let overview = Overview::read(input)?;
        refuse_missing(&overview, &annotate::choose(&overview, &self.topics)?, self)
    }

    fn contains(&self, number: u64, log_time: u64) -> bool {
        self.frames.contains(&number)
            && self.from_ns.is_none_or(|from| log_time >= from)
            && self.to_ns.is_none_or(|to| log_time < to)
    }

    fn wanted(&self, clouds: &BTreeMap<u16, CloudTopic>) -> ReadFilter {
        ReadFilter {
            from_ns: self.from_ns,
            to_ns: self.to_ns,
            numbered: clouds.iter().map(|(&id, cloud)| (id, cloud.topic.clone())).collect(),
            numbers: self.frames,
            others: false,
            ..ReadFilter::default()
        }
    }

    /// The last frame that was named.
    fn last_named(&self) -> Option<u64> {
        match (self.frames.0, self.frames.1) {
            (_, Bound::Excluded(end)) => end.checked_sub(1),
            (_, Bound::Included(last)) => Some(last),
            (Bound::Included(first), Bound::Unbounded) => Some(first),
            _ => None,
        }
    }
}

/// Refuses frames that no topic has.
fn refuse_missing(
    overview: &Overview,
    clouds: &BTreeMap<u16, CloudTopic>,
    selection: &Selection,
) -> Result<()> {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (channel, source) in clouds {
        *counts.entry(&source.topic).or_default() +=
            overview.message_counts.get(channel).unwrap_or(&0);
    }
    let Some(last) = selection.last_named().filter(|&last| counts.values().all(|&n| n <= last))
    else {
        return Ok(());
    };
    let each = counts.iter().map(|(topic, count)| match count {
        0 => format!("{topic} has no cloud"),
        count => format!("{topic} has {count} clouds, numbered 0 to {}", count - 1),
    });
    let problem = format!("there is no frame {last}: {}", each.collect::<Vec<_>>().join("; "));
    Err(Error::NoCloud { path: overview.path.clone(), problem })
}

/// How many clouds have come by.
#[derive(Default)]
struct Tally {
    next: BTreeMap<String, u64>,
    replayed: Replayed,
}

impl Tally {
    fn seen(&self, topic: &str) -> u64 {
        self.next.get(topic).copied().unwrap_or(0)
    }

    /// The number of a topic's next cloud.
    fn count(&mut self, topic: &str) -> u64 {
        let next = self.next.entry(topic.to_owned()).or_default();
        *next += 1;
        *next - 1
    }

    /// Counts clouds that were passed over.
    fn pass(&mut self, clouds: &BTreeMap<u16, CloudTopic>, counts: &BTreeMap<u16, u64>) {
        for (channel, count) in counts {
            *self.next.entry(clouds[channel].topic.clone()).or_default() += count;
        }
    }

    fn cluster(
        &mut self,
        source: &CloudTopic,
        number: u64,
        (header, data, position): (&MessageHeader, &[u8], Position),
        method: &Method,
        watcher: &mut dyn Watcher,
    ) -> Result<()> {
        let topic = source.topic.as_str();
        let which = CloudNumber { topic, number };
        let wire = source.format.decode(data);
        let clustered = wire.and_then(|wire| Ok((cluster(&wire, which, method)?, wire)));
        let (clustered, wire) = match clustered {
            Ok(clustered) => clustered,
            Err(error) if error.ends_the_run() => return Err(error),
            Err(error) => {
                self.replayed.unreadable += 1;
                let place = annotate::place(position);
                return watcher.event(Event::Warning(&format!("{topic}: {error} ({place})")));
            }
        };
        self.replayed.frames += 1;
        let remarks = remarks(&clustered, &method.taxonomy);
        let remarks: Vec<String> = remarks.into_iter().map(|(_, problem)| problem).collect();
        watcher.event(Event::Frame(Frame {
            topic,
            number,
            log_time_ns: header.log_time,
            stamp_ns: wire.stamp_ns(),
            frame_id: &wire.frame_id,
            cloud: &clustered.cloud,
            stages: &clustered.stages,
            remarks: &remarks,
        }))
    }
}
