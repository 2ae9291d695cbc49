//! The table of all suspects, written frame by frame.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::ranking::recorded_positions;
use super::score::Triage;
use super::suspect::Suspect;
use crate::annotate::ClusteredFrame;
use crate::error::{Error, Result};
use crate::text::csv_line;
use divmerge_recording::PartialFile;

/// A CSV file of suspects. The first write error is kept and returned at the end.
pub struct SuspectTable {
    file: BufWriter<File>,
    partial: PartialFile,
    written: std::io::Result<()>,
    path: PathBuf,
}

const COLUMNS: &str = "topic,frame,log_time_ns,seconds,score,kind,evidence,instance,\
                       other_instance,x,y,z,measured,bound,unit,frame_score,sentence,command";

impl SuspectTable {
    /// Begins a file, which appears when it is complete.
    ///
    /// # Errors
    /// Those of the operating system, and that of a file that exists, unless `force`.
    pub fn create(path: &Path, force: bool) -> Result<Self> {
        let (file, partial) = PartialFile::create(path, force)?;
        let mut file = BufWriter::new(file);
        let written = writeln!(file, "{COLUMNS}");
        Ok(SuspectTable { file, partial, written, path: path.to_owned() })
    }

    /// Adds the suspects of a frame. `command` explains the points at some positions.
    pub fn add(
        &mut self,
        frame: &ClusteredFrame,
        seconds: f64,
        found: &Triage,
        command: impl Fn(&[[f64; 3]]) -> String,
    ) {
        for suspect in found.suspects.iter().filter(|suspect| suspect.score > 0.0) {
            let at = recorded_positions(frame.cloud, &suspect.points);
            let line = csv_line(&cells(frame, seconds, found.score, suspect, command(&at)));
            if self.written.is_ok() {
                self.written = self.file.write_all(line.as_bytes());
            }
        }
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// Those of writing.
    pub fn finish(mut self) -> Result<()> {
        let written = self.written.and_then(|()| self.file.flush());
        written.map_err(|source| Error::Io { path: self.path.clone(), source })?;
        drop(self.file);
        Ok(self.partial.put()?)
    }
}

fn cells(
    frame: &ClusteredFrame,
    seconds: f64,
    frame_score: f64,
    suspect: &Suspect,
    command: String,
) -> [String; 18] {
    let instance = |place: usize| {
        suspect.concerns.get(place).map_or(String::new(), |concern| concern.instance.to_string())
    };
    let [x, y, z] = suspect.position.map(|along| format!("{along:.3}"));
    [
        frame.key.topic.to_owned(),
        frame.key.number.to_string(),
        frame.header.log_time.to_string(),
        format!("{seconds:.3}"),
        format!("{:.4}", suspect.score),
        suspect.kind.name().to_owned(),
        format!("{:.4}", suspect.evidence),
        instance(0),
        instance(1),
        x,
        y,
        z,
        format!("{:.4}", suspect.measured),
        format!("{:.4}", suspect.bound),
        suspect.unit.to_owned(),
        format!("{frame_score:.4}"),
        suspect.sentence.clone(),
        command,
    ]
}
