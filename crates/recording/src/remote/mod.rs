//! A remote object, read like a file: in large pieces, some of which are fetched while one is read.

mod object;
mod store;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use self::object::{Bytes, Object, UnderWay};
use crate::input::{Fetched, Input};

/// Bytes of a piece: at a gigabit a second, the delay of a request is a small part of its time.
const PIECE: u64 = 8 << 20;
/// Pieces in memory, the one that is being read included.
const PIECES: usize = 4;
/// Bytes of the first piece of a run of unknown length.
const FIRST: u64 = 1 << 20;
/// How much larger each piece is than the one before, up to [`PIECE`].
const GROWTH: u64 = 4;
/// Gaps smaller than this are fetched, to save a request.
const SMALL_GAP: u64 = 1 << 20;

/// An object that is read.
pub(crate) struct RemoteFile {
    object: Arc<Object>,
    position: u64,
    /// What is being read: where it starts, and its bytes.
    piece: Option<(u64, Bytes)>,
    under_way: VecDeque<UnderWay>,
    /// What will be read, in order.
    stretches: Option<Vec<Range<u64>>>,
    /// Where the next piece starts that is asked for.
    next: u64,
    /// Bytes of that piece, at most.
    length: u64,
    /// Pieces that were read one behind the other.
    run: usize,
}

impl RemoteFile {
    /// Opens the object at an address.
    pub(crate) fn open(address: &Path) -> io::Result<Self> {
        Object::open(address).map(Self::of)
    }

    fn of(object: Arc<Object>) -> Self {
        RemoteFile {
            object,
            position: 0,
            piece: None,
            under_way: VecDeque::new(),
            stretches: None,
            next: 0,
            length: FIRST,
            run: 0,
        }
    }

    /// Copies bytes that have been fetched; returns how many.
    fn at_hand(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let position = self.position;
        let is_in = |&(start, ref bytes): &(u64, Bytes)| {
            (start..start + bytes.len() as u64).contains(&position)
        };
        let piece = match self.piece.as_ref().filter(|&piece| is_in(piece)) {
            Some(piece) => Some(piece.clone()),
            None => self.object.kept(position)?,
        };
        let Some((start, bytes)) = piece.filter(is_in) else {
            return Ok(0);
        };
        let bytes = &bytes[(position - start) as usize..];
        let length = bytes.len().min(into.len());
        into[..length].copy_from_slice(&bytes[..length]);
        self.position += length as u64;
        Ok(length)
    }

    /// Waits for the piece at the position.
    fn fetch(&mut self) -> io::Result<()> {
        self.piece = None;
        let position = self.position;
        while self.under_way.pop_front_if(|piece| piece.range.end <= position).is_some() {}
        let is_coming = |piece: &UnderWay| piece.range.contains(&position);
        let is_under_way = self.under_way.front().is_some_and(is_coming);
        // A read where the last piece ended continues the run.
        let goes_on =
            is_under_way || self.next > 0 && self.expected_from(self.next).start == position;
        self.run = if goes_on { self.run + 1 } else { 0 };
        if !is_under_way {
            self.begin();
        }
        let piece = self.under_way.pop_front().ok_or(ErrorKind::UnexpectedEof)?;
        // A run of three pieces will go on.
        while self.under_way.len() < self.run.saturating_sub(1).min(PIECES - 1) && self.ask() {}
        let start = piece.range.start;
        self.piece = Some((start, self.object.take(piece)?));
        Ok(())
    }

    /// Asks for the piece at the position, which is not under way.
    fn begin(&mut self) {
        let position = self.position;
        self.under_way.clear();
        self.next = position;
        let expected = self.expected_from(position);
        if expected.start != position {
            let end = self.object.start_of_end().min(position + FIRST);
            return self.ask_for(position..end);
        }
        if self.run == 0 {
            // A short expected stretch is fetched whole.
            let is_short = self.stretches.is_some() && expected.end - position <= PIECE;
            self.length = if is_short { PIECE } else { FIRST };
        }
        self.ask();
    }

    /// Asks for the next piece, if there is one.
    fn ask(&mut self) -> bool {
        let Range { start, end } = self.expected_from(self.next);
        let range = start..end.min(start + self.length);
        if range.is_empty() {
            return false;
        }
        self.length = (self.length * GROWTH).min(PIECE);
        self.ask_for(range);
        true
    }

    fn ask_for(&mut self, range: Range<u64>) {
        self.next = range.end;
        self.under_way.push_back(self.object.ask(range));
    }

    /// The rest of the expected stretch at a place, or the next behind it, up to the end of the
    /// object that is kept.
    fn expected_from(&self, place: u64) -> Range<u64> {
        let end = self.object.start_of_end();
        match &self.stretches {
            None => place..end,
            Some(stretches) => match stretches.iter().find(|stretch| stretch.end > place) {
                Some(stretch) => stretch.start.max(place)..stretch.end.min(end),
                None => end..end,
            },
        }
    }
}

impl Input for RemoteFile {
    fn size(&self) -> io::Result<u64> {
        Ok(self.object.size)
    }

    fn expect(&mut self, stretches: Vec<Range<u64>>) {
        let mut joined: Vec<Range<u64>> = Vec::new();
        for stretch in stretches.into_iter().filter(|stretch| !stretch.is_empty()) {
            match joined.last_mut() {
                Some(last) if stretch.start.saturating_sub(last.end) < SMALL_GAP => {
                    last.end = last.end.max(stretch.end);
                }
                _ => joined.push(stretch),
            }
        }
        self.stretches = Some(joined);
    }

    fn keep_end(&mut self, from: u64) -> io::Result<()> {
        self.object.keep_end(from)
    }

    fn object_id(&self) -> Option<u64> {
        Some(self.object.id)
    }

    fn fetched(&self) -> Option<Fetched> {
        Some(self.object.fetched())
    }
}

impl Read for RemoteFile {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut read = 0;
        while read < into.len() && self.position < self.object.size {
            match self.at_hand(&mut into[read..])? {
                0 => self.fetch()?,
                length => read += length,
            }
        }
        Ok(read)
    }
}

impl Seek for RemoteFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let (from, by) = match to {
            SeekFrom::Start(position) => (position, 0),
            SeekFrom::End(by) => (self.object.size, by),
            SeekFrom::Current(by) => (self.position, by),
        };
        let position = from.checked_add_signed(by).ok_or(ErrorKind::InvalidInput)?;
        self.position = position;
        Ok(position)
    }
}
