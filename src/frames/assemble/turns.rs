//! Turns as they follow each other: each is one cloud.

use std::borrow::Cow;
use std::collections::{BTreeSet, VecDeque};
use std::ops::{Bound, RangeBounds};
use std::sync::Arc;

use super::assembler::Assembler;
use super::setting::Assemble;
use crate::error::frame;
use crate::frames::encoded::EncodedCloud;
use crate::messages::clouds::{CloudFormat, CloudMessage};
use divmerge_recording::{MessageRange, is_past};

/// Takes clouds in the order of the file, and gives those that are clustered: the same ones, or the
/// turns that they are put together to.
pub(crate) struct Turns {
    assembler: Option<Assembler>,
    /// Turns with a message of these numbers are given.
    wanted: MessageRange,
    ready: VecDeque<EncodedCloud>,
    /// Topics whose messages are past the wanted ones and their turns.
    past: BTreeSet<Arc<str>>,
}

impl Turns {
    pub(crate) fn new(how: Option<Assemble>, wanted: MessageRange) -> Self {
        let assembler = how.map(Assembler::new);
        Turns { assembler, wanted, ready: VecDeque::new(), past: BTreeSet::new() }
    }

    /// The numbers of the messages that must be read for the wanted turns: as many as there may be,
    /// since a turn may begin anywhere.
    pub(crate) fn needed(&self) -> MessageRange {
        match self.assembler {
            None => self.wanted,
            Some(_) => (Bound::Unbounded, Bound::Unbounded),
        }
    }

    /// Takes the next cloud.
    pub(crate) fn push(&mut self, encoded: EncodedCloud) {
        let Some(assembler) = &mut self.assembler else {
            return self.ready.push_back(encoded);
        };
        // A message that cannot be read belongs to no turn; whoever decodes it says why.
        let before = match encoded.decode() {
            Ok(message) => assembler.push(encoded.clone(), &message),
            Err(_) => return self.give(vec![encoded]),
        };
        if let Some(parts) = before {
            if is_past(&self.wanted, encoded.number) {
                self.past.insert(Arc::clone(&encoded.topic));
            }
            self.give(parts);
        }
    }

    /// No more clouds come.
    pub(crate) fn finish(&mut self) {
        let turns: Vec<_> = self.assembler.iter_mut().flat_map(Assembler::finish).collect();
        turns.into_iter().for_each(|parts| self.give(parts));
    }

    /// Gives the cloud of these messages, if one of them is wanted.
    fn give(&mut self, parts: Vec<EncodedCloud>) {
        if parts.iter().any(|part| self.wanted.contains(&part.number)) {
            match turn(parts) {
                Ok(turn) => self.ready.push_back(turn),
                Err(parts) => self.ready.extend(parts),
            }
        }
    }

    /// The next turn that is complete.
    pub(crate) fn next(&mut self) -> Option<EncodedCloud> {
        self.ready.pop_front()
    }

    /// Whether all of so many topics are past what is wanted. The last turns of theirs are given by
    /// [`finish`](Self::finish).
    pub(crate) fn are_past(&self, topics: usize) -> bool {
        self.assembler.is_some() && self.past.len() >= topics
    }
}

/// The messages of a turn as one; the messages themselves, if there is one or their format cannot
/// hold them together.
fn turn(parts: Vec<EncodedCloud>) -> Result<EncodedCloud, Vec<EncodedCloud>> {
    let [_, .., last] = parts.as_slice() else { return Err(parts) };
    match joined(&parts) {
        Ok((format, data)) => {
            let last = last.clone();
            Ok(EncodedCloud { format, data: data.into(), parts: parts.into(), ..last })
        }
        Err(_) => Err(parts),
    }
}

/// The message that holds the points of all messages.
fn joined(parts: &[EncodedCloud]) -> frame::Result<(CloudFormat, Vec<u8>)> {
    let messages: Vec<CloudMessage> =
        parts.iter().map(EncodedCloud::decode).collect::<frame::Result<_>>()?;
    let joined = joined_messages(&messages);
    let written = joined.reformatted(joined.format.written())?;
    let mut data = Vec::new();
    written.encode(&mut data)?;
    Ok((written.format, data))
}

/// What was made of the message of a turn as one message for each of its parts, which have the
/// stamps of the parts: the fields that were added to all points are shared out among them.
///
/// # Errors
/// Those of [`CloudFormat::decode`] and [`CloudMessage::encode`].
pub(crate) fn shared_out(
    parts: &[EncodedCloud],
    (format, whole): (CloudFormat, &[u8]),
) -> frame::Result<Vec<Vec<u8>>> {
    let whole = format.decode(whole)?;
    let point_step = whole.point_step as usize;
    let (mut shared, mut column) = (Vec::with_capacity(parts.len()), 0);
    for part in parts {
        let part = part.decode()?;
        let bytes = part.width as usize * point_step;
        let rows = whole.rows().flat_map(|row| &row[column..column + bytes]);
        let message = CloudMessage {
            stamp_sec: part.stamp_sec,
            stamp_nanosec: part.stamp_nanosec,
            width: part.width,
            row_step: part.width.wrapping_mul(whole.point_step),
            is_dense: part.is_dense,
            data: Cow::Owned(rows.copied().collect()),
            fields: whole.fields.clone(),
            frame_id: whole.frame_id.clone(),
            ..whole
        };
        column += bytes;
        let mut encoded = Vec::new();
        message.encode(&mut encoded)?;
        shared.push(encoded);
    }
    Ok(shared)
}

/// The points of all messages, which have the same rows: each row has those of the first message,
/// then those of the second, and so on.
fn joined_messages(messages: &[CloudMessage]) -> CloudMessage<'static> {
    let last = &messages[messages.len() - 1];
    let width: u32 = messages.iter().map(|message| message.width).sum();
    let mut rows: Vec<_> = messages.iter().map(CloudMessage::rows).collect();
    let mut data = Vec::with_capacity(messages.iter().map(|message| message.data.len()).sum());
    for _row in 0..last.height {
        for rows in &mut rows {
            data.extend_from_slice(rows.next().unwrap_or_default());
        }
    }
    CloudMessage {
        width,
        row_step: width.wrapping_mul(last.point_step),
        is_dense: messages.iter().all(|message| message.is_dense),
        data: Cow::Owned(data),
        fields: last.fields.clone(),
        frame_id: last.frame_id.clone(),
        ..*last
    }
}
