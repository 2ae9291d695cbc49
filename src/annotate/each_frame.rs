//! Clusters the clouds of a recording one after the other; nothing is written.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use super::clustered::{cluster, remarks};
use super::config::AnnotateConfig;
use super::event::{ClusteredFrame, RunEvent};
use super::satisfiable::refuse_unsatisfiable;
use super::shown_truth::shown_truth;
use super::tracking::{FrameFollower, TrackOptions};
use super::warnings::CloudWarnings;
use crate::error::{Error, NoCloud, Result};
use crate::frames::assemble::Turns;
use crate::frames::walk::Walk;
use crate::frames::{EncodedCloud, Selection, TruthSource, choose_topics};
use divmerge_recording::{Overview, Record};

/// How many frames were visited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct VisitedFrames {
    /// Clouds clustered.
    pub frames: u64,
    /// Clouds that could not be read.
    pub unreadable: u64,
    /// Whether the input is cut off.
    pub is_cut_off: bool,
}

/// What [`for_each_frame`] calls on its way through a recording. A closure that takes a
/// [`RunEvent`] is one that wants no records.
pub trait FrameVisitor {
    /// Whether the visitor wants every record, also those without a selected cloud. Otherwise the
    /// walk ends behind the last selected cloud, and passes over chunks without one.
    fn wants_records(&self) -> bool {
        false
    }

    /// Where the truth of clouds is, if the visitor wants it, and whether somebody said so: then a
    /// cloud without it ends the walk, else it has none.
    fn truth(&self) -> Option<(&TruthSource, bool)> {
        None
    }

    /// How objects are followed, if the visitor wants their tracks.
    fn tracks(&self) -> Option<&TrackOptions> {
        None
    }

    /// Visits a record; the event of its cloud follows.
    ///
    /// # Errors
    /// Any error ends the walk.
    fn record(&mut self, _record: &Record) -> Result<()> {
        Ok(())
    }

    /// Visits a clustered cloud, a warning, or the progress.
    ///
    /// # Errors
    /// Any error ends the walk.
    fn event(&mut self, event: RunEvent) -> Result<()>;
}

impl<F: FnMut(RunEvent) -> Result<()>> FrameVisitor for F {
    fn event(&mut self, event: RunEvent) -> Result<()> {
        self(event)
    }
}

/// Clusters the selected clouds in the order of the file and hands each to the visitor. A cloud
/// that cannot be read is counted, with one warning at the end for each topic and kind. By the
/// file's index, chunks without a selected cloud are not read. Memory does not grow with the length
/// of the recording.
///
/// # Errors
/// [`Error::NoCloud`] if there is no topic, none has the frames, or none lies between the times;
/// [`Error::Recording`] if the input is damaged; [`Error::Io`]; [`Error::Boxes`] if boxes do not
/// fit a cloud; those of the visitor.
pub fn for_each_frame(
    input: &Path,
    selection: &Selection,
    config: &AnnotateConfig,
    visitor: &mut dyn FrameVisitor,
) -> Result<VisitedFrames> {
    let overview = Overview::read(input)?;
    let clouds = choose_topics(&overview, &selection.topics, config.class_topic())?;
    selection.refuse_missing(&overview, &clouds)?;
    refuse_unsatisfiable(&overview, &clouds, selection, config)?;
    let topics = clouds.iter().map(|(&id, cloud)| (id, Arc::clone(&cloud.topic))).collect();
    let topics_count = clouds.values().map(|cloud| &cloud.topic).collect::<BTreeSet<_>>().len();
    let mut turns = Turns::new(config.assemble, selection.frames);
    let needed = Selection { frames: turns.needed(), ..selection.clone() };
    let wants_records = visitor.wants_records();
    let mut walk = match wants_records {
        true => Walk::over_everything(&overview, topics, &needed)?,
        false => Walk::open(&overview, topics, &needed)?,
    };
    let tracks = visitor.tracks().filter(|tracks| tracks.applies_to(config));
    let follower = tracks.map(|tracks| FrameFollower::open(&overview, tracks)).transpose()?;
    let (visited, odd_clouds) = (VisitedFrames::default(), CloudWarnings::default());
    let mut visit = Visit { visited, odd_clouds, config, follower, visitor };
    while wants_records || !turns.are_past(topics_count) {
        let Some(step) = walk.next()? else { break };
        visit.visitor.record(&step.record)?;
        match &step.record {
            Record::Damaged { offset, damage } => {
                visit.event(RunEvent::Warning(&format!("{damage} (byte {offset})")))?;
            }
            Record::Truncated { offset, damage } => {
                visit.event(RunEvent::Warning(&format!("cut off: {damage} (byte {offset})")))?;
                visit.visited.is_cut_off = true;
            }
            Record::Message { .. } => {
                if let Some(cloud) = EncodedCloud::of_step(step, &clouds) {
                    turns.push(cloud);
                }
                visit.turns(&mut turns)?;
            }
            _ => continue,
        }
        let (bytes, total) = walk.progress();
        visit.event(RunEvent::Progress { bytes, total })?;
    }
    turns.finish();
    visit.turns(&mut turns)?;
    let visited = visit.finish()?;
    if visited.frames + visited.unreadable == 0 {
        let times_ns = overview.start_ns.zip(overview.end_ns);
        let (path, problem) = (input.to_owned(), NoCloud::NothingSelected { times_ns });
        return Err(Error::NoCloud { path, problem });
    }
    Ok(visited)
}

/// A walk on its way.
struct Visit<'a> {
    visited: VisitedFrames,
    odd_clouds: CloudWarnings,
    config: &'a AnnotateConfig,
    follower: Option<FrameFollower>,
    visitor: &'a mut dyn FrameVisitor,
}

impl Visit<'_> {
    fn event(&mut self, event: RunEvent) -> Result<()> {
        self.visitor.event(event)
    }

    fn turns(&mut self, turns: &mut Turns) -> Result<()> {
        while let Some(cloud) = turns.next() {
            self.cloud(&cloud)?;
        }
        Ok(())
    }

    fn cloud(&mut self, encoded: &EncodedCloud) -> Result<()> {
        let wire = encoded.decode().map_err(Error::from);
        let clustered = wire.and_then(|wire| {
            let clustered = cluster(&wire, &encoded.key(&wire), self.config)?;
            Ok((clustered, shown_truth(self.visitor.truth(), encoded, &wire)?, wire))
        });
        let (clustered, truth, wire) = match clustered {
            Ok(clustered) => clustered,
            Err(Error::Frame(problem)) => {
                self.visited.unreadable += 1;
                self.odd_clouds.take_unreadable(encoded, &problem.to_string());
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        self.visited.frames += 1;
        let remarks = remarks(&clustered);
        let remarks: Vec<String> = remarks.into_iter().map(|(_, problem)| problem).collect();
        self.event(RunEvent::Frame(ClusteredFrame {
            key: encoded.key(&wire),
            header: encoded.header,
            cloud: &clustered.cloud,
            stages: &clustered.stages,
            taxonomy: clustered.taxonomy.as_ref(),
            truth: truth.as_ref(),
            remarks: &remarks,
        }))?;
        let follower = self.follower.as_mut();
        let decided = follower.map(|follower| follower.push(encoded, &wire, &clustered));
        let mut decided = decided.into_iter().flatten();
        decided.try_for_each(|tracked| self.visitor.event(RunEvent::Tracked(&tracked)))
    }

    /// The tracks that are left, and one warning for each topic and kind.
    fn finish(mut self) -> Result<VisitedFrames> {
        for tracked in self.follower.as_mut().map(FrameFollower::finish).unwrap_or_default() {
            self.event(RunEvent::Tracked(&tracked))?;
        }
        for warning in std::mem::take(&mut self.odd_clouds).into_lines() {
            self.event(RunEvent::Warning(&warning))?;
        }
        Ok(self.visited)
    }
}
