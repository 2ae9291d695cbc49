//! What becomes known of a recording while it goes by: of a stream everything, of a file at the
//! start.

use super::state::Job;
use crate::annotate::added_topics::already_there;
use crate::error::Result;
use crate::frames::topics::clustered_topic;
use crate::frames::{INSTANCES, OBJECTS};
use crate::messages::clouds::CloudChannel;
use divmerge_recording::{Channel, Compression, Item, Record, SourceChunk};

impl Job<'_> {
    /// Says of a channel with clouds that cannot be read why.
    pub(super) fn warn_of_unreadable_clouds(&mut self, channel: &Channel) {
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
        self.names.insert(channel.topic.clone());
        self.warn_of_unreadable_clouds(channel);
        if self.parameters.follows {
            let wanted = &self.options.tracks.ego_motion;
            self.tracking.recorded.add_channel(&self.overview, channel, wanted);
        }
        if let Some(cloud) = clustered_topic(&self.overview, channel, &self.options.topics) {
            self.options.types.check(&self.overview, [cloud.format], self.options.form)?;
            let report = self.report.topics.entry(channel.topic.clone()).or_default();
            report.format = self.options.types.format(cloud.format);
            self.refuse_topics_beside(&cloud.topic)?;
            self.clouds.insert(channel.id, cloud);
            self.follow_topics();
        }
        let cloud =
            [INSTANCES, OBJECTS].into_iter().find_map(|end| channel.topic.strip_suffix(end));
        match cloud.is_some_and(|cloud| self.report.topics.contains_key(cloud)) {
            true => Err(already_there(&self.overview.path, channel.topic.clone())),
            false => Ok(()),
        }
    }

    /// Refuses a cloud topic if what would be added to it is there already.
    fn refuse_topics_beside(&self, cloud: &str) -> Result<()> {
        let mut added = [INSTANCES, OBJECTS].into_iter().map(|end| format!("{cloud}{end}"));
        match added.find(|added| self.names.contains(added)) {
            Some(added) => Err(already_there(&self.overview.path, added)),
            None => Ok(()),
        }
    }

    /// Of a stream, without a compression in the options, that of the first chunk is taken.
    pub(super) fn learn_compression(&mut self, chunk: &SourceChunk) {
        let is_first = std::mem::take(&mut self.awaits_compression);
        let found = Compression::of_name(chunk.compression()).filter(|_| is_first);
        if let Some(compression) = found {
            self.compression = compression;
            self.writer.set_compression(compression);
        }
    }
}
