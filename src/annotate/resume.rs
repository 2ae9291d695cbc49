//! A run that was cut off, done again without clustering again what it had clustered.
//!
//! Beside the half written output lies a journal: the run's parameters, and a line for each
//! annotated cloud, with checksums of the cloud and of the two messages made of it, and with what
//! the report needs. A run that continues goes through the input from its beginning and writes an
//! output of its own, so that its bytes are those of a run that was never cut off; but where the
//! journal has the next cloud, and its messages are found in the half written output, those are
//! taken instead of being made again. Nothing of the old output is believed that its checksums do
//! not cover, so it may be cut off anywhere.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::checkpoint::{Checkpoint, CheckpointSource, StoredMessage};
use super::run_parameters::RunParameters;
use crate::error::{Conflict, Error, Result, SliceProblem};
use divmerge_recording::workers::Workers;
use divmerge_recording::{
    PartialFile, Record, RecordingReader, checksum, create_hidden, is_at, lock_left, open_left,
};

/// Where the journal of an output lies.
pub fn journal_of(output: &Path) -> PathBuf {
    PartialFile::name_for(output).with_extension("journal")
}

/// All that a run may leave beside its output, and the next one uses or removes.
pub fn hidden_files_of(output: &Path) -> [PathBuf; 4] {
    let (partial, journal) = (PartialFile::name_for(output), journal_of(output));
    [old(&partial), old(&journal), partial, journal]
}

/// Where a half written file and its journal lie while they are being used up.
fn old(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".old");
    path.with_file_name(name)
}

/// The journal being written.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
    is_kept: bool,
}

impl Journal {
    /// Starts a journal with the parameters of the run. The output must have been begun: only the
    /// run that writes it has a journal.
    pub(super) fn start(output: &Path, parameters: &RunParameters) -> Result<Self> {
        let path = journal_of(output);
        let file = create_hidden(&path)?;
        let mut journal = Journal { path, file, is_kept: false };
        journal.line(parameters)?;
        Ok(journal)
    }

    /// Adds a checkpoint.
    pub(super) fn add(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        self.line(checkpoint)
    }

    /// Leaves it for a run that continues.
    pub(super) fn keep(&mut self) {
        self.is_kept = true;
    }

    fn line(&mut self, value: &impl Serialize) -> Result<()> {
        let line = serde_json::json!(value).to_string() + "\n";
        self.file.write_all(line.as_bytes()).map_err(|source| io_error(&self.path, source))
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        // Once the output has its name, another run may have a journal of this name.
        if !self.is_kept && is_at(&self.file, &self.path) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// What a run that was cut off had done.
pub(super) struct CutOffRun {
    output: PathBuf,
    journal: BufReader<File>,
    recording: RecordingReader,
}

impl CutOffRun {
    /// What is left of a run for this output, if anything is. It is moved aside, so that the output
    /// can be begun anew.
    ///
    /// # Errors
    /// [`Error::Conflict`] if that run had other parameters, [`Error::Io`].
    pub(super) fn find(output: &Path, parameters: &RunParameters) -> Result<Option<Self>> {
        let (partial, journal) = (PartialFile::name_for(output), journal_of(output));
        check(output, &journal, parameters)?;
        check(output, &old(&journal), parameters)?;
        set_aside(&partial, &journal)?;
        let (Some(file), Some(_)) = (open_left(&old(&journal))?, open_left(&old(&partial))?) else {
            return Ok(None);
        };
        let mut journal = BufReader::new(file);
        let first_line = journal.read_line(&mut String::new());
        let recording = RecordingReader::open_unhashed(&old(&partial), &Workers::none());
        let (Ok(_), Ok(recording)) = (first_line, recording) else {
            return Ok(None);
        };
        Ok(Some(CutOffRun { output: output.to_owned(), journal, recording }))
    }
}

impl CheckpointSource for CutOffRun {
    /// The next line; one that is cut off is none.
    fn next(&mut self) -> Result<Option<Checkpoint>> {
        let mut line = String::new();
        let read = self.journal.read_line(&mut line);
        Ok(read.ok().and_then(|_| serde_json::from_str(&line).ok()))
    }

    /// The next message with that checksum, as far as the half written output can be read.
    fn message(&mut self, wanted: u32) -> Result<Option<StoredMessage>> {
        while let Ok(Some(record)) = self.recording.next_record() {
            if let Record::Message { data, .. } = record
                && checksum(&data) == wanted
            {
                return Ok(Some(StoredMessage { data: data.into_owned().into(), chunk: None }));
            }
        }
        Ok(None)
    }

    /// A cloud that is missing is annotated again.
    fn missing(&self, _problem: SliceProblem) -> Result<()> {
        Ok(())
    }

    fn changed(&self, topic: &str, number: u64) -> Error {
        let problem = Conflict::OtherCloud { topic: topic.to_owned(), number };
        Error::Conflict { path: self.output.clone(), problem }
    }
}

/// Removes what is left of a run that was continued.
pub(super) fn clean_up(output: &Path) {
    for path in [PartialFile::name_for(output), journal_of(output)] {
        let _ = std::fs::remove_file(old(&path));
    }
}

/// Refuses a journal of something else.
fn check(output: &Path, journal: &Path, parameters: &RunParameters) -> Result<()> {
    let Some(file) = open_left(journal)? else {
        return Ok(());
    };
    let mut line = String::new();
    let read = BufReader::new(file).read_line(&mut line);
    let Some(then) = read.ok().and_then(|_| serde_json::from_str::<RunParameters>(&line).ok())
    else {
        return Ok(());
    };
    let differences = parameters.differences(&then);
    if differences.is_empty() {
        return Ok(());
    }
    let problem = Conflict::OtherParameters { differences };
    Err(Error::Conflict { path: output.to_owned(), problem })
}

/// Moves a half written output and its journal aside, unless those that are there already go
/// farther: then a run that continued was itself cut off.
fn set_aside(partial: &Path, journal: &Path) -> Result<()> {
    let length = |path: &Path| path.metadata().map_or(0, |metadata| metadata.len());
    let is_farther = length(journal) > length(&old(journal));
    if !partial.exists() || !journal.exists() || !is_farther {
        return Ok(());
    }
    // Locked until both are moved: another run may be about to continue from them, too.
    let Some(_lock) = lock_left(partial)? else { return Ok(()) };
    for path in [partial, journal] {
        std::fs::rename(path, old(path)).map_err(|source| io_error(path, source))?;
    }
    Ok(())
}

fn io_error(path: &Path, source: std::io::Error) -> Error {
    Error::Io { path: path.to_owned(), source }
}
