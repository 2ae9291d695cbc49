//! What becomes known of a recording while it goes by: of a stream everything, of a file at the start.

use super::Job;
use crate::annotate::topics::{CloudTopic, chosen, refuse_annotated};
use crate::error::Result;
use crate::io::{Channel, CloudChannel, Compression, Item, Record, SourceChunk};

impl Job<'_> {
    /// Says of a channel with clouds that cannot be read why.
    pub(super) fn warn_of_other_cloud(&mut self, channel: &Channel) {
        if let CloudChannel::Unreadable(unreadable) = CloudChannel::of(&self.overview, channel)
            && unreadable.is_cloud
        {
            let (topic, reason) = (&channel.topic, unreadable.reason);
            self.warn(format!("{topic}: passed through without annotation: {reason}"));
        }
    }

    /// Takes the definitions of a stream as they come, before the messages behind them.
    pub(super) fn learn(&mut self, items: &[Item]) -> Result<()> {
        for item in items {
            match item {
                Item::Record(Record::Schema(schema)) => {
                    self.overview.schemas.insert(schema.id, schema.clone());
                }
                Item::Record(Record::Channel(channel)) => self.learn_channel(channel)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn learn_channel(&mut self, channel: &Channel) -> Result<()> {
        self.overview.channels.insert(channel.id, channel.clone());
        self.warn_of_other_cloud(channel);
        if let Some(cloud) = chosen(&self.overview, channel, &self.options.topics) {
            let CloudTopic { topic, format } = cloud;
            self.options.types.check(&self.overview, [format], self.options.form)?;
            let report = self.report.topics.entry(topic.clone()).or_default();
            report.format = self.options.types.format(format);
            self.clouds.insert(channel.id, (topic.as_str().into(), format));
            self.wanted.numbered.insert(channel.id, topic);
        }
        refuse_annotated(&self.overview, self.wanted.numbered.values())
    }

    /// Of a stream, where no compression was asked for, that of the first chunk is taken.
    pub(super) fn learn_compression(&mut self, chunk: &SourceChunk) {
        let is_first = std::mem::take(&mut self.awaits_compression);
        let found = Compression::of_name(chunk.compression()).filter(|_| is_first);
        if let Some(compression) = found {
            self.compression = compression;
            self.writer.set_compression(compression);
        }
    }
}
