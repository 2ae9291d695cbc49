//! The summary at the end of a recording, read without the rest.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{self, op};

use crate::fields::{HEAD_LEN, split_head};
use crate::open::open;
use crate::parse::parse_record;

/// The footer record: head, two offsets and a checksum.
const FOOTER_LEN: u64 = (HEAD_LEN + 8 + 8 + 4) as u64;

/// A summary that was read.
pub(crate) struct Seen {
    /// Where it begins in the file.
    pub(crate) start: u64,
    /// Whether it has a checksum, which fits.
    pub(crate) has_crc: bool,
}

/// Visits the definitions, statistics and chunk indexes of the summary. `None` if there is no
/// summary or it is damaged; its checksum is checked, if it has one, behind the last record.
pub(crate) fn visit_summary(
    path: &Path,
    size: u64,
    mut visit: impl FnMut(records::Record),
) -> Option<Seen> {
    let mut file = open(path).ok()?;
    let end = size.checked_sub(FOOTER_LEN + mcap::MAGIC.len() as u64)?;
    let mut footer = [0; FOOTER_LEN as usize + 8];
    file.seek(SeekFrom::Start(end)).ok()?;
    file.read_exact(&mut footer).ok()?;
    let (footer, magic) = footer.split_at(FOOTER_LEN as usize);
    let (head, body) = footer.split_at(HEAD_LEN);
    if magic != mcap::MAGIC || split_head(head)? != (op::FOOTER, body.len() as u64) {
        return None;
    }
    let Ok(records::Record::Footer(places)) = parse_record(op::FOOTER, body) else {
        return None;
    };
    let mut left = match places.summary_start {
        0 => return None,
        start => end.checked_sub(start)?,
    };
    file.keep_end(places.summary_start).ok()?;
    file.seek(SeekFrom::Start(places.summary_start)).ok()?;
    let mut file = BufReader::new(file);
    let mut crc = crc32fast::Hasher::new();
    let mut record = Vec::new();
    while left > 0 {
        left = left.checked_sub(HEAD_LEN as u64)?;
        record.clear();
        (&mut file).take(HEAD_LEN as u64).read_to_end(&mut record).ok()?;
        let (opcode, length) = split_head(&record)?;
        left = left.checked_sub(length)?;
        (&mut file).take(length).read_to_end(&mut record).ok()?;
        crc.update(&record);
        let body = record.get(HEAD_LEN..).filter(|body| body.len() as u64 == length)?;
        if let op::SCHEMA | op::CHANNEL | op::STATISTICS | op::CHUNK_INDEX = opcode {
            visit(parse_record(opcode, body).ok()?);
        }
    }
    crc.update(&footer[..HEAD_LEN + 16]);
    let is_sound = places.summary_crc == 0 || places.summary_crc == crc.finalize();
    let has_crc = places.summary_crc != 0;
    is_sound.then_some(Seen { start: places.summary_start, has_crc })
}

/// Topics of the messages in the chunk at an offset; `None` if the summary does not list it.
pub(crate) fn topics_of_chunk(path: &Path, size: u64, offset: u64) -> Option<BTreeSet<String>> {
    let mut topics = BTreeMap::new();
    let mut channels = None;
    visit_summary(path, size, |record| match record {
        records::Record::Channel(channel) => {
            topics.insert(channel.id, channel.topic);
        }
        records::Record::ChunkIndex(chunk) if chunk.chunk_start_offset == offset => {
            channels = Some(chunk.message_index_offsets.into_keys());
        }
        _ => {}
    })?;
    Some(channels?.filter_map(|id| topics.remove(&id)).collect())
}
