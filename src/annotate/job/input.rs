//! What comes in: chunks that stay as they are, records that are copied, clouds for the threads.

use std::sync::Arc;

use super::cloud_job::CloudJob;
use super::pending::{CloudResult, Pending, PendingCloud, PendingItem, most_clouds};
use super::state::Job;
use crate::annotate::form::Form;
use crate::annotate::message::cluster_message;
use crate::error::Result;
use crate::frames::{CloudTopic, EncodedCloud};
use divmerge_recording::workers::Workers;
use divmerge_recording::{Item, Part, Record, SourceChunk};

impl Job<'_> {
    /// Takes what comes next in the input, of which so many bytes have been read.
    pub(in crate::annotate) fn part(&mut self, part: Part, bytes: u64) -> Result<()> {
        if self.is_stream {
            let (Part::Chunk(SourceChunk { items, .. }) | Part::Items(items)) = &part;
            self.learn(items)?;
            if let Part::Chunk(chunk) = &part {
                self.learn_compression(chunk);
            }
        }
        match part {
            Part::Chunk(chunk) if self.stays(&chunk) => {
                let concerns = |item: &&Item| self.is_cloud(item) || self.says_pose(item);
                let items: Vec<Item> = chunk.items.iter().filter(concerns).cloned().collect();
                self.push(bytes, PendingItem::Chunk(chunk))?;
                items.iter().try_for_each(|item| {
                    self.pass(bytes, item)?;
                    match self.is_cloud(item) {
                        true => self.push_cloud(bytes, item),
                        false => Ok(()),
                    }
                })
            }
            part => {
                let items = match part {
                    Part::Chunk(chunk) if self.copies() => chunk.into_items(),
                    Part::Chunk(SourceChunk { items, .. }) | Part::Items(items) => items,
                };
                items.into_iter().try_for_each(|item| self.item(bytes, item))?;
                match self.options.slice {
                    Some(_) => self.push(bytes, PendingItem::EndOfPart),
                    None => Ok(()),
                }
            }
        }
    }

    /// Whether what the input holds is in the output, too.
    pub(super) fn copies(&self) -> bool {
        self.options.form != Form::Only && self.options.slice.is_none()
    }

    /// Whether a chunk can be placed as it is.
    fn stays(&self, chunk: &SourceChunk) -> bool {
        let (first, last) = chunk.times();
        let is_kept = chunk.message_count() == 0
            || (self.filter.is_in_window(first) && self.filter.is_in_window(last));
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

    fn says_pose(&self, item: &Item) -> bool {
        let takes = |channel| self.tracking.recorded.takes(channel);
        matches!(item, Item::Message { header, .. } if takes(header.channel_id))
    }

    /// Takes a record that is copied by itself.
    fn item(&mut self, bytes: u64, item: Item) -> Result<()> {
        self.pass(bytes, &item)?;
        match &item {
            Item::Message { header, position, .. }
                if !self.filter.is_in_window(header.log_time) || !self.is_in_slice(*position) =>
            {
                if let Some(cloud) = self.clouds.get(&header.channel_id) {
                    self.counter.skip(&cloud.topic, 1);
                }
                Ok(())
            }
            Item::Record(Record::Skipped { counts }) => {
                for (channel, &count) in counts {
                    if let Some(cloud) = self.clouds.get(channel) {
                        self.counter.skip(&cloud.topic, count);
                    }
                }
                Ok(())
            }
            Item::Message { .. } if self.is_cloud(&item) => {
                if self.options.form == Form::Beside && self.copies() {
                    self.push(bytes, PendingItem::Item(item.clone()))?;
                }
                self.push_cloud(bytes, &item)
            }
            _ if self.is_left_out(&item) => Ok(()),
            // Attached files can be large, so that they do not wait behind clouds.
            Item::Record(record @ Record::Attachment { .. }) => {
                self.settle_all()?;
                self.record(record)
            }
            _ => self.push(bytes, PendingItem::Item(item)),
        }
    }

    /// Whether nothing is done about something that is no cloud: all but damage, if annotations
    /// alone are wanted.
    fn is_left_out(&self, item: &Item) -> bool {
        let is_damage =
            matches!(item, Item::Record(Record::Damaged { .. } | Record::Truncated { .. }));
        !self.copies() && !is_damage
    }

    /// Takes a cloud, and gives those to the threads that are complete.
    fn push_cloud(&mut self, bytes: u64, item: &Item) -> Result<()> {
        let Item::Message { header, data, position } = item else {
            return Ok(());
        };
        let CloudTopic { topic, format } = self.clouds[&header.channel_id].clone();
        let number = self.counter.count(&topic);
        let (header, position, data) = (*header, *position, data.clone());
        let parts = Arc::default();
        let encoded = EncodedCloud { topic, number, parts, header, format, data, position };
        self.turns.push(encoded);
        self.push_turns(bytes)
    }

    /// Gives the turns to the threads that no more clouds come for.
    pub(super) fn push_last_turns(&mut self) -> Result<()> {
        self.turns.finish();
        self.push_turns(self.overview.file_size)
    }

    fn push_turns(&mut self, bytes: u64) -> Result<()> {
        while let Some(encoded) = self.turns.next() {
            self.push_turn(bytes, encoded)?;
        }
        Ok(())
    }

    /// Gives a cloud to the threads that is one message, or one of several put together.
    fn push_turn(&mut self, bytes: u64, encoded: EncodedCloud) -> Result<()> {
        let completed = match &mut self.completed {
            Some(completed) => completed.take(&encoded.topic, encoded.number, &encoded.data)?,
            None => None,
        };
        let is_followed = self.tracking.follows(&encoded.topic);
        let result = match completed {
            Some(completed) => Workers::none().run(move || Ok(CloudResult::Completed(completed))),
            None if self.batch.size > 1 => {
                self.batch.push((encoded.clone(), is_followed), &self.workers)
            }
            None => {
                let (config, job) = (Arc::clone(&self.config), self.cloud_job(is_followed));
                let encoded = encoded.clone();
                self.workers.run(move || {
                    let writing = job.writing(&config);
                    let written = cluster_message(&encoded, writing)?;
                    CloudResult::of(&encoded, written, (writing, job.is_of_slice))
                })
            }
        };
        let (followed, result) = match is_followed && self.options.slice.is_none() {
            true => {
                let (number, result) = self.tracking.push(encoded.clone(), bytes, result);
                (Some(number), result)
            }
            false => (None, result),
        };
        let cloud = Box::new(PendingCloud { encoded, followed, result });
        self.push(bytes, PendingItem::Cloud(cloud))
    }

    /// What is done to a cloud.
    fn cloud_job(&self, is_followed: bool) -> CloudJob {
        let job = CloudJob::new(self.options, self.writes_checkpoints());
        CloudJob { tracks: job.tracks.filter(|_| is_followed), ..job }
    }

    /// Queues something, and writes what is ready. Where more is waiting than keeps the threads
    /// busy, this waits for the front of it.
    pub(super) fn push(&mut self, bytes: u64, item: PendingItem) -> Result<()> {
        let is_cloud = matches!(item, PendingItem::Cloud(_));
        self.queue.push(Pending { bytes, item });
        // One that came is in flight, however fast it was clustered.
        let in_flight = self.queue.clouds() - self.tracking.waiting();
        let most = &mut self.report.profile.most_clouds_in_flight;
        *most = (*most).max(in_flight).max(usize::from(is_cloud));
        self.settle_ready(bytes)
    }

    /// Writes what is ready, and waits where more is under way than keeps the threads busy.
    pub(super) fn settle_ready(&mut self, bytes: u64) -> Result<()> {
        let (threads, batch) = (self.workers.threads(), self.batch.size);
        loop {
            self.observe_ready(bytes)?;
            let is_ready = self.queue.is_first_ready() == Some(true);
            if !is_ready && self.first_is_undecided() {
                if !self.waits_for_clouds(most_clouds(threads, batch)) {
                    return Ok(());
                }
            } else if is_ready || self.queue.is_full(threads, batch) {
                self.settle()?;
            } else {
                return Ok(());
            }
        }
    }

    /// Whether the front of the queue waits for tracks, which may need more of the input.
    fn first_is_undecided(&self) -> bool {
        self.queue.first_followed().is_some_and(|number| self.tracking.is_undecided(number))
    }
}
