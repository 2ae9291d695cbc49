//! A cloud message of a recording, still encoded.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::key::CloudKey;
use super::last_decoded;
use super::topics::CloudTopic;
use super::walk::{WalkStep, describe_position};
use crate::error::frame;
use crate::messages::clouds::{CloudFormat, CloudMessage};
use divmerge_recording::{MessageHeader, Position, Record, SharedBytes};

/// A cloud message, still encoded, and which one of its recording it is.
#[derive(Debug, Clone)]
pub struct EncodedCloud {
    /// Its topic.
    pub topic: Arc<str>,
    /// Its number on the topic in the order of the file, from 0; unreadable clouds count.
    pub number: u64,
    /// The messages that are put together in it; none if it is one message. Number, header and
    /// place are those of the last.
    pub parts: Arc<[EncodedCloud]>,
    /// Channel, sequence, log and publish time.
    pub header: MessageHeader,
    /// Format of the message.
    pub format: CloudFormat,
    /// The message.
    pub data: SharedBytes,
    /// Where it lies.
    pub position: Position,
}

impl EncodedCloud {
    /// A message by itself: cloud 0 of a topic without a name.
    pub fn of_message(format: CloudFormat, data: Vec<u8>) -> Self {
        let header = MessageHeader { channel_id: 0, sequence: 0, log_time: 0, publish_time: 0 };
        EncodedCloud {
            topic: "".into(),
            number: 0,
            parts: Arc::default(),
            header,
            format,
            data: data.into(),
            position: Position { chunk_offset: 0, index_in_chunk: 0 },
        }
    }

    /// The cloud of a step, if it is a selected message of these channels.
    pub(crate) fn of_step(step: WalkStep, clouds: &BTreeMap<u16, CloudTopic>) -> Option<Self> {
        let (Record::Message { header, data, position }, Some(number)) = (step.record, step.number)
        else {
            return None;
        };
        let CloudTopic { topic, format } = clouds.get(&header.channel_id)?.clone();
        let data = data.into_owned().into();
        Some(EncodedCloud { topic, number, parts: Arc::default(), header, format, data, position })
    }

    /// The cloud in it.
    ///
    /// # Errors
    /// Those of [`CloudFormat::decode`].
    pub fn decode(&self) -> frame::Result<CloudMessage<'_>> {
        last_decoded::note(&self.topic, self.number, self.position);
        self.format.decode(&self.data)
    }

    /// What identifies it, with what its decoded header says.
    pub fn key<'a>(&'a self, cloud: &'a CloudMessage) -> CloudKey<'a> {
        CloudKey::new(&self.topic, self.number, cloud)
    }

    /// When it was logged, nanoseconds since 1970.
    pub fn log_time_ns(&self) -> u64 {
        self.header.log_time
    }

    /// Which one it is in words, as in `frame 3 of /points`.
    pub fn describe(&self) -> String {
        format!("{} of {}", self.frames(), self.topic)
    }

    /// Its number in words, as in `frame 3`; of a turn `frames 3 to 38`.
    pub fn frames(&self) -> String {
        match self.first_number() {
            first if first == self.number => format!("frame {first}"),
            first => format!("frames {first} to {}", self.number),
        }
    }

    /// The number of the first of its messages.
    pub fn first_number(&self) -> u64 {
        self.parts.first().map_or(self.number, |first| first.number)
    }

    /// Whether a message of that number of its topic is it, or is put together in it.
    pub(crate) fn holds(&self, number: u64) -> bool {
        (self.first_number()..=self.number).contains(&number)
    }

    /// How many messages it is.
    pub(crate) fn messages(&self) -> u64 {
        self.parts.len().max(1) as u64
    }

    /// Bytes in memory of its message and of those that are put together in it.
    pub(crate) fn bytes(&self) -> usize {
        self.data.len() + self.parts.iter().map(|part| part.data.len()).sum::<usize>()
    }

    /// Where it lies, in words.
    pub(crate) fn place(&self) -> String {
        describe_position(self.position)
    }
}
