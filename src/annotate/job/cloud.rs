//! A cloud whose turn has come: what annotates it is written, with a checkpoint, and counted.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use super::channels::Added;
use super::pending::{CloudResult, PendingCloud};
use super::state::Job;
use crate::annotate::checkpoint::{Checkpoint, CloudOutcome, CompletedCloud};
use crate::annotate::clustered::Clustered;
use crate::annotate::event::{ClusteredFrame, RunEvent};
use crate::annotate::form::Form;
use crate::annotate::report::FrameReport;
use crate::annotate::shown_truth::shown_truth;
use crate::annotate::times::FrameTimes;
use crate::annotate::writing::Annotated;
use crate::error::{Error, Result};
use crate::frames::assemble::shared_out;
use crate::frames::{CloudKey, EncodedCloud};
use divmerge_recording::{MessageHeader, SourceChunk, checksum};

/// A message that annotates a cloud, and the chunk that it lies in if it was made before.
type Message<'a> = (&'a [u8], Option<&'a Arc<SourceChunk>>);

impl Job<'_> {
    /// Waits for what is made of a cloud, and writes it.
    pub(super) fn cloud(&mut self, cloud: PendingCloud) -> Result<()> {
        let PendingCloud { encoded, result, .. } = cloud;
        self.report.messages += if self.is_in_place() { encoded.messages() } else { 0 };
        let started = Instant::now();
        let result = result.wait();
        self.report.profile.wait.take_since(started, 0);
        match result {
            Ok(CloudResult::Annotated(clustered, annotated, kept)) => {
                let report = FrameReport::new(&clustered, &annotated.frame_id);
                if self.config.assemble.is_none() {
                    self.watch.take(&encoded.topic, &clustered.cloud, annotated.stamp_ns);
                }
                self.written(&encoded, &annotated, (&report, kept))?;
                self.announce(&encoded, &clustered, &annotated, &report)
            }
            Ok(CloudResult::Tracked(report, annotated, kept)) => {
                self.written(&encoded, &annotated, (&report, kept))
            }
            Ok(CloudResult::Joined(report, annotated)) => {
                let messages = [(&*annotated.cloud, None), (&*annotated.objects, None)];
                self.add(&encoded, messages, (&report, None), None)
            }
            Ok(CloudResult::Untracked(..)) => unreachable!("its tracks are decided"),
            Ok(CloudResult::Completed(CompletedCloud::Annotated(report, messages, stored))) => {
                let [cloud, objects] = &messages;
                let messages = [cloud, objects].map(|made| (&*made.data, made.chunk.as_ref()));
                let kept = stored.map(|stored| stored.to_text());
                self.add(&encoded, messages, (&report, kept), None)
            }
            Ok(CloudResult::Completed(CompletedCloud::Unreadable(problem))) => {
                self.unreadable(&encoded, problem)
            }
            Err(Error::Frame(problem)) => self.unreadable(&encoded, problem.to_string()),
            Err(error) => Err(error),
        }
    }

    /// Whether annotated clouds stand in the place of the clouds.
    fn is_in_place(&self) -> bool {
        self.options.form == Form::InPlace && self.copies()
    }

    /// Writes the messages that annotate a cloud, with what a checkpoint keeps of it.
    fn written(
        &mut self,
        encoded: &EncodedCloud,
        annotated: &Annotated,
        report: (&FrameReport, Option<String>),
    ) -> Result<()> {
        let messages = [(&*annotated.cloud, None), (&*annotated.objects, None)];
        self.add(encoded, messages, report, Some(annotated.times))?;
        self.report.profile.take(encoded, encoded.data.len(), annotated);
        Ok(())
    }

    /// Announces a clustered cloud.
    pub(super) fn announce(
        &mut self,
        encoded: &EncodedCloud,
        clustered: &Clustered,
        annotated: &Annotated,
        report: &FrameReport,
    ) -> Result<()> {
        let remarks: Vec<String> =
            report.remarks.iter().map(|(_, problem)| problem.clone()).collect();
        let wanted = self.options.shown_truth.as_ref();
        let wanted = wanted.map(|(source, is_said)| (source, *is_said));
        let truth = match wanted {
            Some(_) => shown_truth(wanted, encoded, &encoded.decode()?)?,
            None => None,
        };
        let frame = ClusteredFrame {
            key: CloudKey {
                topic: &encoded.topic,
                number: encoded.number,
                stamp_ns: annotated.stamp_ns,
                frame_id: &annotated.frame_id,
            },
            header: encoded.header,
            cloud: &clustered.cloud,
            stages: &clustered.stages,
            taxonomy: clustered.taxonomy.as_ref(),
            truth: truth.as_ref(),
            remarks: &remarks,
        };
        self.tell(RunEvent::Frame(frame))
    }

    /// Tells whoever looks on what happened.
    pub(super) fn tell(&mut self, event: RunEvent) -> Result<()> {
        match (self.on_event)(event) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted { path: self.report.output.clone() }),
        }
    }

    /// Counts what a report says of a cloud, and what it took unless that was done before.
    pub(super) fn count(
        &mut self,
        encoded: &EncodedCloud,
        report: &FrameReport,
        times: Option<FrameTimes>,
    ) {
        self.report.topics.entry(encoded.topic.to_string()).or_default().take(report, times);
        for (kind, problem) in &report.remarks {
            self.odd_clouds.take(encoded, kind, problem);
        }
    }

    /// Writes the messages that annotate a cloud, and their checkpoint.
    fn add(
        &mut self,
        encoded: &EncodedCloud,
        messages: [Message; 2],
        (report, observed): (&FrameReport, Option<String>),
        times: Option<FrameTimes>,
    ) -> Result<()> {
        if !encoded.parts.is_empty() {
            self.add_to_parts(encoded, messages.map(|(message, _)| message))?;
            self.count(encoded, report, times);
            return Ok(());
        }
        let Added { instances, objects } = self.channels_for(encoded.header.channel_id)?;
        for (channel_id, (message, chunk)) in [instances, objects].into_iter().zip(messages) {
            if let Some(chunk) = chunk {
                self.writer.offer(chunk);
            }
            self.writer.write_message(&MessageHeader { channel_id, ..encoded.header }, message)?;
            self.report.annotations += 1;
        }
        if self.writes_checkpoints() {
            let [instances, objects] = messages.map(|(message, _)| checksum(message));
            let report = report.clone();
            let outcome = CloudOutcome::Annotated { instances, objects, report, observed };
            self.checkpoint(encoded, outcome)?;
        }
        self.count(encoded, report, times);
        Ok(())
    }

    /// Writes what annotates the messages of a turn; its boxes stand with the last.
    fn add_to_parts(&mut self, turn: &EncodedCloud, [cloud, boxes]: [&[u8]; 2]) -> Result<()> {
        let format = self.options.types.format(turn.format);
        let shared = shared_out(&turn.parts, (format, cloud))?;
        for (part, message) in turn.parts.iter().zip(&shared) {
            let Added { instances, .. } = self.channels_for(part.header.channel_id)?;
            let header = MessageHeader { channel_id: instances, ..part.header };
            self.writer.write_message(&header, message)?;
        }
        let Added { objects, .. } = self.channels_for(turn.header.channel_id)?;
        self.writer.write_message(&MessageHeader { channel_id: objects, ..turn.header }, boxes)?;
        self.report.annotations += shared.len() as u64 + 1;
        Ok(())
    }

    /// Passes a cloud through that cannot be read, or the messages of a turn.
    fn unreadable(&mut self, encoded: &EncodedCloud, problem: String) -> Result<()> {
        let parts = encoded.parts.iter();
        parts.clone().try_for_each(|part| self.unreadable(part, problem.clone()))?;
        if parts.len() > 0 {
            return Ok(());
        }
        let EncodedCloud { topic, header, data, .. } = encoded;
        self.report.topics.entry(topic.to_string()).or_default().unreadable += 1;
        self.odd_clouds.take_unreadable(encoded, &problem);
        if self.writes_checkpoints() {
            self.checkpoint(encoded, CloudOutcome::Unreadable { problem })?;
        }
        if self.is_in_place() {
            self.writer.write_message(header, data)?;
        }
        Ok(())
    }

    pub(super) fn writes_checkpoints(&self) -> bool {
        self.journal.is_some() || self.options.slice.is_some()
    }

    /// Writes what became of a cloud, for a run that continues and for the slices to be joined.
    fn checkpoint(&mut self, encoded: &EncodedCloud, outcome: CloudOutcome) -> Result<()> {
        let EncodedCloud { topic, number, data, .. } = encoded;
        let (topic, number, cloud) = (topic.to_string(), *number, checksum(data));
        let checkpoint = Checkpoint { topic, number, cloud, outcome };
        if self.options.slice.is_some() {
            self.checkpoints.extend(serde_json::json!(checkpoint).to_string().into_bytes());
            self.checkpoints.push(b'\n');
        }
        match &mut self.journal {
            Some(journal) => journal.add(&checkpoint),
            None => Ok(()),
        }
    }
}
