//! What comes in: chunks that stay as they are, records that are copied, clouds for the threads.

use std::sync::Arc;

use super::pending::{CloudResult, Pending, PendingCloud, PendingItem};
use super::state::Job;
use crate::annotate::form::Form;
use crate::annotate::message::{Annotated, annotate_message};
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
                let clouds: Vec<Item> = self.clouds_of(&chunk).cloned().collect();
                self.push(bytes, PendingItem::Chunk(chunk))?;
                clouds.iter().try_for_each(|item| self.push_cloud(bytes, item))
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

    /// Takes a record that is copied by itself.
    fn item(&mut self, bytes: u64, item: Item) -> Result<()> {
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
                    self.counter.skip(&self.clouds[channel].topic, count);
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

    /// Gives a cloud to the threads.
    fn push_cloud(&mut self, bytes: u64, item: &Item) -> Result<()> {
        let Item::Message { header, data, position } = item else {
            return Ok(());
        };
        let CloudTopic { topic, format } = self.clouds[&header.channel_id].clone();
        let number = self.counter.count(&topic);
        if self.assembler.is_some() {
            let (header, position, data) = (*header, *position, data.clone());
            let encoded = EncodedCloud { topic, number, header, format, data, position };
            return self.push_part(bytes, encoded);
        }
        let completed = match &mut self.completed {
            Some(completed) => completed.take(&topic, number, data)?,
            None => None,
        };
        let (header, position, data) = (*header, *position, data.clone());
        let encoded = EncodedCloud { topic, number, header, format, data, position };
        let result = match completed {
            Some(completed) => Workers::none().run(move || Ok(CloudResult::Completed(completed))),
            None if self.batch.size > 1 => self.batch.push(encoded.clone(), &self.workers),
            None => {
                let (config, types) = (Arc::clone(&self.config), self.options.types);
                let encoded = encoded.clone();
                self.workers.run(move || {
                    let mut annotated = Annotated::default();
                    annotate_message(&encoded, &config, &types, &mut annotated)
                        .map(|clustered| CloudResult::Annotated(Box::new(clustered), annotated))
                })
            }
        };
        self.push(bytes, PendingItem::Cloud(Box::new(PendingCloud { encoded, result })))
    }

    /// Queues something, and writes what is ready. Where more is waiting than keeps the threads
    /// busy, this waits for the front of it.
    pub(super) fn push(&mut self, bytes: u64, item: PendingItem) -> Result<()> {
        self.queue.push(Pending { bytes, item });
        let most = &mut self.report.profile.most_clouds_in_flight;
        *most = (*most).max(self.queue.clouds());
        while self.queue.is_full(self.workers.threads(), self.batch.size)
            || self.queue.is_first_ready() == Some(true)
        {
            self.settle()?;
        }
        Ok(())
    }
}
