//! Annotated slices: what they are, and whether they make up their recordings.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::run_parameters::RunParameters;
use super::slices::{Plan, Slice};
use crate::error::{Error, Result, SliceProblem};
use divmerge_recording::workers::Workers;
use divmerge_recording::{Metadata, Record, RecordingReader};

/// Name of the metadata record at the front of an annotated slice.
pub(super) const SLICE_METADATA: &str = "divmerge slice";

/// Opcode of the record behind the annotations of each part of the recording: what became of its
/// clouds, a line of JSON each. It is one of those that the format leaves to programs, and readers
/// pass over it.
pub(super) const CHECKPOINTS: u8 = 0xD5;

/// What a slice's metadata record holds.
pub(super) fn slice_metadata(
    slice: &Slice,
    parameters: &RunParameters,
) -> BTreeMap<String, String> {
    let json = |value: serde_json::Value| value.to_string();
    BTreeMap::from([
        ("slice".to_owned(), json(serde_json::json!(slice))),
        ("asked".to_owned(), json(serde_json::json!(parameters))),
    ])
}

/// An annotated slice.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceFile {
    /// The file.
    pub path: PathBuf,
    /// What it is a slice of.
    pub slice: Slice,
    pub(super) parameters: RunParameters,
}

impl SliceFile {
    /// Looks at an annotated slice.
    ///
    /// # Errors
    /// [`Error::Slices`] if the file is a recording but no slice of one; those of
    /// [`RecordingReader::open`].
    pub fn open(path: &Path) -> Result<Self> {
        let mut reader = RecordingReader::open_unhashed(path, &Workers::none())?;
        let no_slice = |problem| Error::Slices { of: path.to_owned(), problem };
        while let Some(record) = reader.next_record()? {
            let metadata = match record {
                Record::Header { .. } => continue,
                Record::Metadata(Metadata { name, metadata }) if name == SLICE_METADATA => metadata,
                _ => break,
            };
            let field = |name: &str| metadata.get(name).map_or("", String::as_str);
            let other = |error: serde_json::Error| {
                no_slice(SliceProblem::OtherVersion { reason: error.to_string() })
            };
            let slice = serde_json::from_str(field("slice")).map_err(other)?;
            let parameters = serde_json::from_str(field("asked")).map_err(other)?;
            return Ok(SliceFile { path: path.to_owned(), slice, parameters });
        }
        Err(no_slice(SliceProblem::NoSlice))
    }
}

/// Sorts slices by recording and by their place in it. Where the plan is not given, a recording of
/// which all slices are lost goes unnoticed.
///
/// # Errors
/// [`Error::Slices`] if one is lost, there twice, not of the plan, or was planned or made otherwise
/// than the others of its recording.
pub fn by_recording(slices: Vec<SliceFile>, plan: Option<&Plan>) -> Result<Vec<Vec<SliceFile>>> {
    if let Some(plan) = plan {
        check_plan(&slices, plan)?;
    }
    let mut recordings: BTreeMap<(PathBuf, PathBuf), Vec<SliceFile>> = BTreeMap::new();
    for slice in slices {
        let recording = (slice.slice.input.clone(), slice.slice.name.clone());
        recordings.entry(recording).or_default().push(slice);
    }
    let sorted = recordings.into_values().map(|mut slices| {
        slices.sort_by(|a, b| a.slice.number.cmp(&b.slice.number).then(a.path.cmp(&b.path)));
        check(&slices)?;
        Ok(slices)
    });
    sorted.collect()
}

/// Refuses slices that are not of a plan, or not all of it.
fn check_plan(slices: &[SliceFile], plan: &Plan) -> Result<()> {
    let planned: BTreeSet<&Slice> = plan.slices.iter().collect();
    if let Some(other) = slices.iter().find(|file| !planned.contains(&file.slice)) {
        let (of, problem) = (other.path.clone(), SliceProblem::NotPlanned);
        return Err(Error::Slices { of, problem });
    }
    let there: BTreeSet<&Slice> = slices.iter().map(|file| &file.slice).collect();
    let lost = plan.slices.iter().filter(|slice| !there.contains(slice));
    match lost.clone().next() {
        None => Ok(()),
        Some(first) => Err(missing(&first.input, lost.clone().map(Slice::file_name), lost.count())),
    }
}

/// An error that names the slices that are lost, or the first of so many.
fn missing(of: &Path, names: impl Iterator<Item = PathBuf>, count: usize) -> Error {
    const NAMED: usize = 10;
    let problem = SliceProblem::Missing { names: names.take(NAMED).collect(), count };
    Error::Slices { of: of.to_owned(), problem }
}

/// Refuses slices of one recording, in their order, that do not make up all of it.
pub(super) fn check(slices: &[SliceFile]) -> Result<()> {
    let Some(first) = slices.first() else {
        return Ok(());
    };
    let of = || first.slice.input.clone();
    let wrong = |problem| Err(Error::Slices { of: of(), problem });
    let files = |a: &SliceFile, b: &SliceFile| [a.path.clone(), b.path.clone()];
    for slice in slices {
        let (ours, theirs) = (&slice.slice, &first.slice);
        let is_other = (ours.count, ours.input_bytes) != (theirs.count, theirs.input_bytes);
        if is_other || ours.number >= ours.count {
            return wrong(SliceProblem::OtherPlan { files: files(first, slice) });
        }
        let differences = slice.parameters.differences(&first.parameters);
        if !differences.is_empty() {
            let files = files(first, slice);
            return wrong(SliceProblem::OtherParameters { files, differences });
        }
    }
    for two in slices.windows(2) {
        if two[0].slice.number == two[1].slice.number {
            let (slice, files) = (two[0].slice.file_name(), files(&two[0], &two[1]));
            return wrong(SliceProblem::Twice { slice, files });
        }
    }
    // The numbers differ and are below the count.
    if slices.len() < first.slice.count {
        let there: BTreeSet<usize> = slices.iter().map(|slice| slice.slice.number).collect();
        let lost = (0..first.slice.count).filter(|number| !there.contains(number));
        let names = lost.map(|number| Slice { number, ..first.slice.clone() }.file_name());
        return Err(missing(&of(), names, first.slice.count - slices.len()));
    }
    for two in slices.windows(2) {
        if two[0].slice.end != two[1].slice.start {
            return wrong(SliceProblem::OtherPlan { files: files(&two[0], &two[1]) });
        }
    }
    Ok(())
}
