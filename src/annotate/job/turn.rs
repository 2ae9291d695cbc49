//! Turns of several clouds: put together, given to the threads, and written part by part.

use std::sync::Arc;
use std::time::Instant;

use super::channels::Added;
use super::pending::{CloudResult, PendingCloud, PendingItem, PendingTurn};
use super::state::Job;
use crate::annotate::checkpoint::CompletedCloud;
use crate::annotate::report::FrameReport;
use crate::annotate::turn::{AnnotatedTurn, annotate_turn};
use crate::error::{Error, Result};
use crate::frames::EncodedCloud;
use divmerge_recording::MessageHeader;
use divmerge_recording::workers::Workers;

impl Job<'_> {
    /// Takes a part of a turn. A turn is given to the threads when the next begins.
    pub(super) fn push_part(&mut self, bytes: u64, encoded: EncodedCloud) -> Result<()> {
        let whole = match (encoded.decode(), &mut self.assembler) {
            (Ok(message), Some(assembler)) => assembler.push(encoded.clone(), &message),
            (Err(error), _) => {
                let completed = CompletedCloud::Unreadable(error.to_string());
                let result = Workers::none().run(move || Ok(CloudResult::Completed(completed)));
                let cloud = Box::new(PendingCloud { encoded, followed: None, result });
                return self.push(bytes, PendingItem::Cloud(cloud));
            }
            (Ok(_), None) => None,
        };
        whole.map_or(Ok(()), |parts| self.push_turn(bytes, parts))
    }

    /// Gives the turns to the threads that no more parts come for.
    pub(super) fn push_last_turns(&mut self) -> Result<()> {
        let bytes = self.overview.file_size;
        let turns: Vec<_> = self.assembler.iter_mut().flat_map(|a| a.finish()).collect();
        turns.into_iter().try_for_each(|parts| self.push_turn(bytes, parts))
    }

    fn push_turn(&mut self, bytes: u64, parts: Vec<EncodedCloud>) -> Result<()> {
        let (config, types) = (Arc::clone(&self.config), self.options.types);
        let of_job = parts.clone();
        let result = self.workers.run(move || annotate_turn(&of_job, &config, &types));
        self.push(bytes, PendingItem::Turn(Box::new(PendingTurn { parts, result })))
    }

    /// Waits for what is made of a turn, and writes it.
    pub(super) fn turn(&mut self, turn: PendingTurn) -> Result<()> {
        let PendingTurn { parts, result } = turn;
        if self.is_in_place() {
            self.report.messages += parts.len() as u64;
        }
        let started = Instant::now();
        let result = result.wait();
        self.report.profile.wait.take_since(started, 0);
        match result {
            Ok(annotated) => self.annotated_turn(&parts, &annotated),
            Err(Error::Frame(problem)) => {
                let problem = problem.to_string();
                parts.iter().try_for_each(|part| self.unreadable(part, problem.clone()))
            }
            Err(error) => Err(error),
        }
    }

    fn annotated_turn(
        &mut self,
        parts: &[EncodedCloud],
        (clustered, annotated): &AnnotatedTurn,
    ) -> Result<()> {
        let Some((encoded, last)) = parts.last().zip(annotated.last()) else { return Ok(()) };
        for (part, made) in parts.iter().zip(annotated) {
            let Added { instances, objects } = self.channels_for(part.header.channel_id)?;
            let is_last = std::ptr::eq(part, encoded);
            let boxes = (objects, &made.objects);
            for (channel_id, message) in
                [(instances, &made.cloud)].into_iter().chain(is_last.then_some(boxes))
            {
                self.writer.write_message(&MessageHeader { channel_id, ..part.header }, message)?;
                self.report.annotations += 1;
            }
        }
        let report = FrameReport::new(clustered, &last.frame_id);
        self.count(encoded, &report, Some(last.times));
        let bytes = parts.iter().map(|part| part.data.len()).sum();
        self.report.profile.take(encoded, bytes, last);
        self.announce(encoded, clustered, last, &report)
    }
}
