//! Which recordings are annotated into which files: one, several, or those of rosbag2 folders.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::cli::exit::{RefusedOutput, contradict};
use crate::cli::layout::{Layout, WantedLayouts};
use crate::cli::output::{OutputFile, Outputs, is_recording, make_folder, metadata_in};
use crate::datasets::bag::{Bag, METADATA_FILE};
use crate::recording::{STANDARD_STREAM, is_stream};

/// A recording and its output.
#[derive(Debug, PartialEq, Eq)]
pub struct Task {
    pub input: PathBuf,
    pub output: PathBuf,
}

/// All recordings of one run.
pub struct Tasks {
    pub tasks: Vec<Task>,
    /// rosbag2 folders and their output folders.
    bags: Vec<(Bag, PathBuf)>,
    /// Whether the output is a folder.
    pub has_folder: bool,
}

impl Tasks {
    /// Finds the recordings of the inputs and names their outputs. Nothing is written yet.
    pub fn new(inputs: &[PathBuf], output: &Path) -> Result<Self> {
        let mut tasks = Tasks { tasks: Vec::new(), bags: Vec::new(), has_folder: false };
        match inputs {
            [input] if is_stream(input) || !input.is_dir() => tasks.add_single(input, output)?,
            inputs => {
                tasks.has_folder = true;
                for input in inputs {
                    tasks.add(input, output, inputs.len() == 1)?;
                }
                refuse_file(output)?;
            }
        }
        tasks.refuse_same_output()?;
        Ok(tasks)
    }

    fn add_single(&mut self, input: &Path, output: &Path) -> Result<()> {
        let output = match output.is_dir() {
            true if is_stream(input) => {
                contradict!("{}: is a folder; name a file in it", output.display())
            }
            true => output.join(name(input)?),
            false => output.to_owned(),
        };
        self.tasks.push(Task { input: input.to_owned(), output });
        Ok(())
    }

    /// Adds one of several inputs. The recordings of a single rosbag2 folder go into the output
    /// folder itself.
    fn add(&mut self, input: &Path, output: &Path, is_alone: bool) -> Result<()> {
        if is_stream(input) {
            contradict!("{}: annotate a stream on its own, without other inputs", input.display());
        }
        if !input.is_dir() {
            let output = output.join(name(input)?);
            self.tasks.push(Task { input: input.to_owned(), output });
            return Ok(());
        }
        if !input.join(METADATA_FILE).is_file() {
            contradict!(
                "{}: the folder has no {METADATA_FILE}; name the recordings in it",
                input.display()
            );
        }
        let bag = Bag::open(input)?;
        let folder = if is_alone { output.to_owned() } else { output.join(name(input)?) };
        let of_file = |file: &String| Task {
            input: input.join(file),
            output: folder.join(Bag::unpacked_name(file)),
        };
        self.tasks.extend(bag.files.iter().map(of_file));
        self.bags.push((bag, folder));
        Ok(())
    }

    fn refuse_same_output(&self) -> Result<(), RefusedOutput> {
        let mut inputs = BTreeMap::new();
        for Task { input, output } in &self.tasks {
            if let Some(other) = inputs.insert(output, input) {
                return Err(RefusedOutput(format!(
                    "{} and {} would both be written to {}; give them different folders",
                    other.display(),
                    input.display(),
                    output.display()
                )));
            }
        }
        Ok(())
    }

    /// The files that are read.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let recordings = self.tasks.iter().map(|task| task.input.clone());
        recordings.chain(self.bags.iter().map(|(bag, _)| metadata_in(&bag.folder))).collect()
    }

    /// Leaves out recordings whose output exists, and returns those outputs.
    pub fn skip_finished(&mut self) -> Vec<PathBuf> {
        if !self.has_folder {
            return Vec::new();
        }
        let (done, left) = std::mem::take(&mut self.tasks)
            .into_iter()
            .partition(|task: &Task| task.output.exists());
        self.tasks = left;
        done.into_iter().map(|task| task.output).collect()
    }

    /// Checks the outputs. Nothing is written yet.
    pub fn check(
        self,
        outputs: &mut Outputs,
        layouts: WantedLayouts,
    ) -> Result<CheckedTasks, RefusedOutput> {
        let mut tasks = Vec::new();
        for Task { input, output } in self.tasks {
            let output = match self.has_folder {
                true => outputs.file_in_made_folder(&output)?,
                false => outputs.recording(&output)?,
            };
            let layout = Layout::beside(output.path(), layouts, outputs)?;
            tasks.push(CheckedTask { input, output, layout });
        }
        let mut bags = Vec::new();
        for (bag, folder) in self.bags {
            // An interrupted run may have left it beside its recordings.
            let is_made = |file: &String| folder.join(Bag::unpacked_name(file)).exists();
            let file = match bag.files.iter().any(is_made) {
                true => outputs.file_again(&metadata_in(&folder))?,
                false => outputs.file_in_made_folder(&metadata_in(&folder))?,
            };
            bags.push((bag, file));
        }
        Ok(CheckedTasks { tasks, bags, has_folder: self.has_folder })
    }
}

/// A recording and its output, which was checked.
pub struct CheckedTask {
    pub input: PathBuf,
    pub output: OutputFile,
    pub layout: Layout,
}

/// All recordings of one run, whose outputs were checked.
pub struct CheckedTasks {
    pub tasks: Vec<CheckedTask>,
    /// rosbag2 folders and the `metadata.yaml` of their outputs.
    bags: Vec<(Bag, OutputFile)>,
    /// Whether the output is a folder.
    pub has_folder: bool,
}

impl CheckedTasks {
    /// Makes the folders of the outputs.
    pub fn make_folders(&self) -> Result<()> {
        if self.has_folder {
            for folder in self.tasks.iter().filter_map(|task| task.output.path().parent()) {
                make_folder(folder)?;
            }
        }
        Ok(())
    }

    /// Writes the `metadata.yaml` of each output folder of a rosbag2 folder, and returns their
    /// names.
    pub fn finish(&self, made: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        for (bag, file) in &self.bags {
            written.extend(file.write_metadata(bag, made)?);
        }
        Ok(written)
    }
}

/// The name of what is made of a recording.
fn name(path: &Path) -> Result<&OsStr> {
    let name = path.file_name();
    let name = name.with_context(|| format!("{}: does not name a file", path.display()))?;
    Ok(name.to_str().map_or(name, |name| OsStr::new(Bag::unpacked_name(name))))
}

fn refuse_file(output: &Path) -> Result<(), RefusedOutput> {
    let is_folder = output.is_dir();
    if output == STANDARD_STREAM || !is_folder && (output.exists() || is_recording(output)) {
        return Err(RefusedOutput(format!(
            "{}: several recordings, or those of a rosbag2 folder, need a folder as output",
            output.display()
        )));
    }
    Ok(())
}
