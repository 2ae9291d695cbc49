//! The files of `--report`.

use std::path::Path;

use anyhow::Result;

use crate::cli::output::{OutputFile, Outputs, make_folder};
use crate::cli::progress::frame_bar;
use crate::view::case_pages::{CaseReport, is_one_file};

/// Draws and explains the cases and writes their pages to `path`; `entry` is the file to open.
pub fn write(
    report: &CaseReport,
    path: &Path,
    entry: &OutputFile,
    outputs: &mut Outputs,
) -> Result<()> {
    let bar = frame_bar("drawing", report.ranking.cases.len() as u64);
    let pages = report.files(path, || bar.inc(1))?;
    bar.finish_and_clear();
    let mut files = vec![entry.clone()];
    for (name, _) in &pages[1..] {
        files.push(outputs.file_in_made_folder(&path.join(name))?);
    }
    if !is_one_file(path) {
        make_folder(path)?;
    }
    // The index last: if it exists, the rest does.
    for (file, (_, page)) in files.iter().zip(&pages).rev() {
        file.write(page.as_bytes())?;
    }
    Ok(())
}
