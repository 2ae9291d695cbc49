//! The outputs of a command. All are checked before the command begins, and only what was checked
//! can be written.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Serialize;

use crate::annotate::resume::hidden_files_of;
use crate::cli::exit::RefusedOutput;
use crate::datasets::bag::{Bag, METADATA_FILE};
use crate::datasets::semantic_kitti::write_labels;
use crate::recording::address::is_remote;
use crate::recording::{
    Overview, STANDARD_STREAM, check_folder, check_output, is_same_file, open_left, write_file,
};
use crate::view::{self, Canvas};

/// How deep the files of an input folder lie, at most: ROOT/sequences/NN/velodyne/FILE and a few
/// more.
const DEPTH: usize = 8;

/// Checks the outputs of a command: none may be one of its inputs or another output, and only with
/// `--force` may they replace older files.
pub struct Outputs<'a> {
    inputs: Vec<&'a Path>,
    force: bool,
    known: BTreeSet<PathBuf>,
}

impl<'a> Outputs<'a> {
    /// Of a command with these inputs: files, and folders with the data in them.
    pub fn new(inputs: impl IntoIterator<Item = &'a Path>, force: bool) -> Self {
        Outputs { inputs: inputs.into_iter().collect(), force, known: BTreeSet::new() }
    }

    /// Checks a file in a folder that exists.
    pub fn file(&mut self, path: &Path) -> Result<OutputFile, RefusedOutput> {
        let file = self.file_in_made_folder(path)?;
        check_folder(path).map_err(RefusedOutput::of)?;
        Ok(file)
    }

    /// Checks a file that may be none.
    pub fn optional(&mut self, path: Option<&Path>) -> Result<Option<OutputFile>, RefusedOutput> {
        path.map(|path| self.file(path)).transpose()
    }

    /// Checks files in folders that exist.
    pub fn files(&mut self, paths: &[PathBuf]) -> Result<Vec<OutputFile>, RefusedOutput> {
        paths.iter().map(|path| self.file(path)).collect()
    }

    /// Checks a recording in a folder that exists. Standard output is always free.
    pub fn recording(&mut self, path: &Path) -> Result<OutputFile, RefusedOutput> {
        if path == STANDARD_STREAM {
            return Ok(OutputFile { path: path.to_owned(), force: self.force });
        }
        refuse_other_format(path)?;
        self.file(path)
    }

    /// Checks a file in a folder that the command makes.
    pub fn file_in_made_folder(&mut self, path: &Path) -> Result<OutputFile, RefusedOutput> {
        self.checked(path, self.force)
    }

    /// Checks a file that replaces the one of an earlier run, also without `--force`.
    pub fn file_again(&mut self, path: &Path) -> Result<OutputFile, RefusedOutput> {
        self.checked(path, true)
    }

    fn checked(&mut self, path: &Path, force: bool) -> Result<OutputFile, RefusedOutput> {
        refuse_address(path)?;
        let refuse = |problem: &str| Err(RefusedOutput(format!("{} {problem}", path.display())));
        let exists = path.symlink_metadata().is_ok();
        if exists && let Some(input) = self.inputs.iter().find(|input| holds(input, path, DEPTH)) {
            return refuse(&match is_same_file(input, path) {
                true => format!("is the input {}; name another output", input.display()),
                false => format!("is in the input {}; name another output", input.display()),
            });
        }
        if exists && !force {
            return refuse("exists; use --force to replace it");
        }
        check_output(path, force).map_err(RefusedOutput::of)?;
        // Something planted under a name that the run uses or removes.
        for hidden in hidden_files_of(path) {
            open_left(&hidden).map_err(RefusedOutput::of)?;
        }
        match self.is_new(place(path)) {
            true => Ok(OutputFile { path: path.to_owned(), force }),
            false => refuse("is the name of two outputs; give each its own"),
        }
    }

    /// Notes an output, unless it is one already, or one of both is the folder of the other.
    fn is_new(&mut self, place: PathBuf) -> bool {
        // Paths below a folder follow it in order.
        let next = self.known.range(place.clone()..).next();
        let is_taken = next.is_some_and(|next| next.starts_with(&place))
            || place.ancestors().any(|folder| self.known.contains(folder));
        !is_taken && self.known.insert(place)
    }
}

/// Endings of the files that are read from folders. Recordings are named one by one.
const DATA: &[&str] = &["bin", "label", "npy", "pcd", "txt", "yaml"];

/// Whether an input is the file, or a folder with data that holds it.
fn holds(input: &Path, file: &Path, depth: usize) -> bool {
    if !input.is_dir() {
        return is_same_file(input, file);
    }
    let entries = std::fs::read_dir(input).into_iter().flatten().flatten();
    let mut paths = entries.map(|entry| entry.path());
    paths.any(|path| match path.is_dir() {
        true => depth > 0 && holds(&path, file, depth - 1),
        false => DATA.contains(&extension(&path).as_str()) && is_same_file(&path, file),
    })
}

/// A path that is the same for all names of a file that does not exist yet.
fn place(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| *folder != "").unwrap_or(Path::new("."));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.join(path.file_name().unwrap_or_default())
}

/// Refuses a recording whose name says that it is of another format.
fn refuse_other_format(path: &Path) -> Result<(), RefusedOutput> {
    const OTHERS: &[&str] = &[
        "bag", "bin", "csv", "db3", "html", "json", "las", "laz", "npy", "pcap", "pcd", "pdf",
        "ply", "png", "rrd", "svg", "yaml", "yml", "zst",
    ];
    let extension = extension(path);
    if !OTHERS.contains(&extension.as_str()) {
        return Ok(());
    }
    Err(RefusedOutput(format!(
        "{}: recordings are written as MCAP, not as .{extension}; name it {}",
        path.display(),
        path.with_extension("mcap").display()
    )))
}

/// Refuses to write to an address.
pub fn refuse_address(output: &Path) -> Result<(), RefusedOutput> {
    match is_remote(output) {
        false => Ok(()),
        true => Err(RefusedOutput(format!(
            "{}: cannot write to an address; name a file or folder",
            output.display()
        ))),
    }
}

/// A file that a command may write. It appears under its name when it is complete.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputFile {
    path: PathBuf,
    force: bool,
}

impl OutputFile {
    /// Its name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it may replace another file.
    pub fn force(&self) -> bool {
        self.force
    }

    /// Writes it.
    pub fn write(&self, bytes: &[u8]) -> Result<()> {
        Ok(write_file(&self.path, bytes, self.force)?)
    }

    /// Writes a value as JSON.
    pub fn write_json(&self, value: &impl Serialize) -> Result<()> {
        self.write((serde_json::to_string_pretty(value)? + "\n").as_bytes())
    }

    /// Writes label words.
    pub fn write_labels(&self, words: &[u32]) -> Result<()> {
        Ok(write_labels(&self.path, words)?)
    }

    /// Writes a picture as .svg, .pdf or .png, and returns its size in bytes.
    pub fn write_picture(&self, canvas: &Canvas, dpi: f64) -> Result<u64> {
        let bytes = match extension(&self.path).as_str() {
            "svg" => view::svg(canvas).into_bytes(),
            "pdf" => view::pdf(canvas),
            _ => {
                let [width, height] = view::size_in_pixels(canvas, dpi);
                let too_large = || format!("a picture of {width} x {height} pixels is too large");
                view::png(canvas, dpi).with_context(too_large)?
            }
        };
        self.write(&bytes)?;
        Ok(bytes.len() as u64)
    }

    /// Writes the `metadata.yaml` of those recordings of a bag that were made beside it, and
    /// returns its name; `None` if there are none.
    pub fn write_metadata(&self, bag: &Bag, made: &[PathBuf]) -> Result<Option<PathBuf>> {
        let outputs = bag.files.iter();
        let outputs = outputs.map(|file| self.path.with_file_name(Bag::unpacked_name(file)));
        let outputs = outputs.filter(|output| made.contains(output));
        let overviews: Vec<Overview> =
            outputs.map(|output| Overview::read(&output)).collect::<Result<_, _>>()?;
        if overviews.is_empty() {
            return Ok(None);
        }
        self.write(bag.metadata_of(&overviews).as_bytes())?;
        Ok(Some(self.path.clone()))
    }
}

/// Makes a folder and those above it, unless it exists.
pub fn make_folder(folder: &Path) -> Result<()> {
    refuse_address(folder)?;
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))
}

/// Makes the folder of a file, unless it exists.
pub fn make_parent(file: &Path) -> Result<()> {
    file.parent().map_or(Ok(()), make_folder)
}

/// The name of a bag's description in a folder.
pub fn metadata_in(folder: &Path) -> PathBuf {
    folder.join(METADATA_FILE)
}

/// Whether a path is named as a recording.
pub fn is_recording(path: &Path) -> bool {
    extension(path) == "mcap"
}

/// The extension of a path in lower case, without the dot.
pub fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Reads the name of a picture.
pub fn picture(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["png", "svg", "pdf"])
}

/// Reads the name of a chart or a table.
pub fn chart_or_table(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["svg", "png", "pdf", "csv", "md", "json"])
}

/// Reads the name of a Rerun recording; the viewer recognizes it by its extension.
pub fn rrd(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["rrd"])
}

fn with_extension(text: &str, extensions: &[&str]) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match extensions.contains(&extension(&path).as_str()) {
        true => Ok(path),
        false => Err(format!("must end in .{}", extensions.join(", ."))),
    }
}
