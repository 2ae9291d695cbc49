//! Output files and folders.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use divmerge::datasets::bag::{Bag, METADATA_FILE};
use divmerge::recording::address::is_remote;
use divmerge::recording::{Overview, write_file};
use divmerge::view::{self, Canvas};
use serde::Serialize;

/// Refuses to replace a file without `--force`, and to write to an address.
pub fn refuse_existing(output: &Path, force: bool) -> Result<()> {
    refuse_address(output)?;
    if !force && output.symlink_metadata().is_ok() {
        bail!("{} exists; use --force to replace it", output.display());
    }
    Ok(())
}

/// Refuses to write to an address.
pub fn refuse_address(output: &Path) -> Result<()> {
    if is_remote(output) {
        bail!("{}: cannot write to an address; name a file or folder", output.display());
    }
    Ok(())
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

/// Writes the `metadata.yaml` of those recordings of a bag that were made in a folder, and returns
/// its name; `None` if there are none.
pub fn write_metadata(bag: &Bag, folder: &Path, made: &[PathBuf]) -> Result<Option<PathBuf>> {
    let outputs = bag.files.iter().map(|file| folder.join(Bag::unpacked_name(file)));
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

/// Writes a value as JSON.
pub fn write_json(output: &Path, value: &impl Serialize, force: bool) -> Result<()> {
    let text = serde_json::to_string_pretty(value)? + "\n";
    Ok(write_file(output, text.as_bytes(), force)?)
}

/// Writes a picture as .svg or .png, and returns its size in bytes.
pub fn write_picture(output: &Path, canvas: &Canvas, dpi: f64, force: bool) -> Result<u64> {
    let bytes = if extension(output) == "svg" {
        view::svg(canvas).into_bytes()
    } else {
        let [width, height] = view::size_in_pixels(canvas, dpi);
        let too_large = || format!("a picture of {width} x {height} pixels is too large");
        view::png(canvas, dpi).with_context(too_large)?
    };
    write_file(output, &bytes, force)?;
    Ok(bytes.len() as u64)
}

/// The extension of a path in lower case, without the dot.
pub fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Reads the name of a picture.
pub fn picture(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["png", "svg"])
}

/// Reads the name of a chart or a table.
pub fn chart_or_table(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["svg", "png", "csv", "md", "json"])
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
