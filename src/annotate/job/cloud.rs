//! Clouds whose turn has come: what was made of them is written, noted and counted.

use std::sync::Arc;
use std::time::Instant;

use super::Job;
use super::channels::Added;
use crate::annotate::message::{Annotated, Clustered};
use crate::annotate::notes::{Before, Note, Noted};
use crate::annotate::report::{FrameReport, FrameTimes};
use crate::annotate::{Event, Form, Frame, place};
use crate::error::Result;
use crate::io::{MessageHeader, Position, SharedBytes, SourceChunk, checksum};
use crate::workers::Ticket;

/// A cloud of the input.
pub(super) struct CloudItem {
    pub(super) topic: Arc<str>,
    pub(super) number: u64,
    pub(super) header: MessageHeader,
    pub(super) position: Position,
    pub(super) message: SharedBytes,
}

/// A cloud being clustered.
pub(super) struct Cloud {
    pub(super) item: CloudItem,
    pub(super) result: Ticket<Result<Made>>,
}

/// What becomes of a cloud: it is clustered, or was before.
pub(super) enum Made {
    Now(Box<Clustered>, Annotated),
    Before(Before),
}

/// A message that annotates a cloud, and the chunk that it lies in if it was made before.
type Message<'a> = (&'a [u8], Option<&'a Arc<SourceChunk>>);

impl Job<'_> {
    /// Waits for what is made of a cloud, and writes it.
    pub(super) fn cloud(&mut self, cloud: Cloud) -> Result<()> {
        let Cloud { item, result } = cloud;
        self.report.messages += u64::from(self.is_in_place());
        let started = Instant::now();
        let result = result.wait();
        self.report.profile.wait.take_since(started, 0);
        match result {
            Ok(Made::Now(clustered, annotated)) => self.clustered(&item, &clustered, &annotated),
            Ok(Made::Before(Before::Annotated(report, [cloud, objects]))) => {
                let messages = [&cloud, &objects].map(|given| (&*given.data, given.chunk.as_ref()));
                self.add(&item, messages, &report, None)
            }
            Ok(Made::Before(Before::Unreadable(problem))) => self.unreadable(&item, problem),
            Err(error) if error.ends_the_run() => Err(error),
            Err(error) => self.unreadable(&item, error.to_string()),
        }
    }

    /// Whether annotated clouds stand in the place of the clouds.
    fn is_in_place(&self) -> bool {
        self.options.form == Form::InPlace && self.copies()
    }

    fn clustered(
        &mut self,
        item: &CloudItem,
        clustered: &Clustered,
        annotated: &Annotated,
    ) -> Result<()> {
        let taxonomy = &self.options.method.taxonomy;
        let report = FrameReport::new(clustered, &annotated.frame_id, taxonomy);
        let messages = [(&*annotated.cloud, None), (&*annotated.objects, None)];
        self.add(item, messages, &report, Some(annotated.times))?;
        let remarks: Vec<String> =
            report.remarks.iter().map(|(_, problem)| problem.clone()).collect();
        let frame = Frame {
            topic: &item.topic,
            number: item.number,
            log_time_ns: item.header.log_time,
            stamp_ns: annotated.stamp_ns,
            frame_id: &annotated.frame_id,
            cloud: &clustered.cloud,
            stages: &clustered.stages,
            remarks: &remarks,
        };
        self.report.profile.take(&frame, item.message.len(), annotated);
        let _ = (self.on_event)(Event::Frame(frame));
        Ok(())
    }

    /// Writes the messages that annotate a cloud, and takes note of them.
    fn add(
        &mut self,
        item: &CloudItem,
        messages: [Message; 2],
        report: &FrameReport,
        times: Option<FrameTimes>,
    ) -> Result<()> {
        let Added { instances, objects } = self.channels_for(item.header.channel_id)?;
        for (channel_id, (message, chunk)) in [instances, objects].into_iter().zip(messages) {
            if let Some(chunk) = chunk {
                self.writer.offer(chunk);
            }
            self.writer.write_message(&MessageHeader { channel_id, ..item.header }, message)?;
            self.report.annotations += 1;
        }
        if self.takes_notes() {
            let [instances, objects] = messages.map(|(message, _)| checksum(message));
            let report = report.clone();
            self.note(item, Noted::Annotated { instances, objects, report })?;
        }
        self.report.topics.entry(item.topic.to_string()).or_default().take(report, times);
        for (kind, problem) in &report.remarks {
            self.warn_once(&item.topic, kind, item.position, problem);
        }
        Ok(())
    }

    /// Passes a cloud through that cannot be read.
    fn unreadable(&mut self, item: &CloudItem, problem: String) -> Result<()> {
        let CloudItem { topic, header, position, message, .. } = item;
        self.report.topics.entry(topic.to_string()).or_default().unreadable += 1;
        self.warn(format!("{topic}: {problem} ({}); not annotated", place(*position)));
        if self.takes_notes() {
            self.note(item, Noted::Unreadable { problem })?;
        }
        if self.is_in_place() {
            self.writer.write_message(header, message)?;
        }
        Ok(())
    }

    fn takes_notes(&self) -> bool {
        self.journal.is_some() || self.options.slice.is_some()
    }

    /// Notes what became of a cloud, for a run that continues and for the slices to be joined.
    fn note(&mut self, item: &CloudItem, outcome: Noted) -> Result<()> {
        let CloudItem { topic, number, message, .. } = item;
        let cloud = checksum(message);
        let note = Note { topic: topic.to_string(), number: *number, cloud, outcome };
        if self.options.slice.is_some() {
            self.notes.extend(serde_json::json!(note).to_string().into_bytes());
            self.notes.push(b'\n');
        }
        match &mut self.journal {
            Some(journal) => journal.note(&note),
            None => Ok(()),
        }
    }
}
