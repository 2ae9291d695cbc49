//! What is to be annotated into which file: one recording, several, or the recordings of a bag.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use divmerge::io::bag::METADATA_FILE;
use divmerge::io::{Bag, Overview, STANDARD_STREAM, is_stream, write_file};

/// A recording, and where it goes.
#[derive(Debug, PartialEq, Eq)]
pub struct Task {
    pub input: PathBuf,
    pub output: PathBuf,
}

/// Everything that one call is to do.
pub struct Tasks {
    pub tasks: Vec<Task>,
    /// Bags, and the folders that their recordings go to.
    bags: Vec<(Bag, PathBuf)>,
    /// Whether the output is a folder.
    pub has_folder: bool,
}

impl Tasks {
    /// Sorts out what the inputs are. Nothing is written yet.
    pub fn new(inputs: &[PathBuf], output: &Path) -> Result<Self> {
        let mut tasks = Tasks { tasks: Vec::new(), bags: Vec::new(), has_folder: false };
        match inputs {
            [input] if is_stream(input) || !input.is_dir() => tasks.add_single(input, output)?,
            inputs => {
                refuse_no_folder(output)?;
                tasks.has_folder = true;
                for input in inputs {
                    tasks.add(input, output, inputs.len() == 1)?;
                }
            }
        }
        tasks.refuse_same_output()?;
        Ok(tasks)
    }

    fn add_single(&mut self, input: &Path, output: &Path) -> Result<()> {
        let output = match output.is_dir() {
            true if is_stream(input) => {
                bail!("{}: is a folder; name the file in it", output.display())
            }
            true => output.join(name(input)?),
            false => output.to_owned(),
        };
        self.tasks.push(Task { input: input.to_owned(), output });
        Ok(())
    }

    /// Adds one of several inputs, or a bag, whose recordings go into the output itself if it is alone.
    fn add(&mut self, input: &Path, output: &Path, is_alone: bool) -> Result<()> {
        if is_stream(input) {
            bail!("{}: a stream can be annotated by itself alone", input.display());
        }
        if !input.is_dir() {
            let output = output.join(name(input)?);
            self.tasks.push(Task { input: input.to_owned(), output });
            return Ok(());
        }
        if !input.join(METADATA_FILE).is_file() {
            bail!(
                "{}: a folder without {METADATA_FILE}; name the recordings in it",
                input.display()
            );
        }
        let bag = Bag::open(input)?;
        let folder = if is_alone { output.to_owned() } else { output.join(name(input)?) };
        let of_file = |file: &String| Task { input: input.join(file), output: folder.join(file) };
        self.tasks.extend(bag.files.iter().map(of_file));
        self.bags.push((bag, folder));
        Ok(())
    }

    fn refuse_same_output(&self) -> Result<()> {
        let mut inputs = BTreeMap::new();
        for Task { input, output } in &self.tasks {
            if let Some(other) = inputs.insert(output, input) {
                bail!(
                    "{} and {} would both become {}; annotate them into different folders",
                    other.display(),
                    input.display(),
                    output.display()
                );
            }
        }
        Ok(())
    }

    /// Leaves out what a run that was cut off had finished, and returns those outputs.
    pub fn leave_out_done(&mut self) -> Vec<PathBuf> {
        if !self.has_folder {
            return Vec::new();
        }
        let (done, left) = std::mem::take(&mut self.tasks)
            .into_iter()
            .partition(|task: &Task| task.output.exists());
        self.tasks = left;
        done.into_iter().map(|task| task.output).collect()
    }

    /// Refuses to replace what is there, and makes the folders.
    pub fn prepare(&self, force: bool) -> Result<()> {
        let written = self.tasks.iter().filter(|task| task.output.as_path() != STANDARD_STREAM);
        for task in written {
            crate::refuse_existing(&task.output, force)?;
        }
        for (bag, folder) in &self.bags {
            // One that belongs to recordings of which a run was cut off is made anew.
            let is_resumed = bag.files.iter().any(|file| folder.join(file).exists());
            crate::refuse_existing(&folder.join(METADATA_FILE), force || is_resumed)?;
        }
        if self.has_folder {
            for folder in self.tasks.iter().filter_map(|task| task.output.parent()) {
                std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            }
        }
        Ok(())
    }

    /// Writes the `metadata.yaml` of each bag of which a recording was made, and returns their names.
    pub fn finish(&self, made: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        for (bag, folder) in &self.bags {
            written.extend(write_metadata(bag, folder, made)?);
        }
        Ok(written)
    }
}

/// Writes the `metadata.yaml` of the recordings that were made of a bag in a folder, if there are such, and returns its name.
pub fn write_metadata(bag: &Bag, folder: &Path, made: &[PathBuf]) -> Result<Option<PathBuf>> {
    let outputs = bag.files.iter().map(|file| folder.join(file));
    let outputs = outputs.filter(|output| made.contains(output));
    let overviews: Vec<Overview> =
        outputs.map(|output| Overview::read(&output)).collect::<Result<_, _>>()?;
    if overviews.is_empty() {
        return Ok(None);
    }
    let path = folder.join(METADATA_FILE);
    write_file(&path, bag.metadata_of(&overviews).as_bytes(), true)?;
    Ok(Some(path))
}

fn name(path: &Path) -> Result<&std::ffi::OsStr> {
    path.file_name().with_context(|| format!("{}: not the name of a file", path.display()))
}

fn refuse_no_folder(output: &Path) -> Result<()> {
    if output == STANDARD_STREAM || output.is_file() {
        bail!("{}: several recordings, or those of a bag, go into a folder", output.display());
    }
    Ok(())
}
