//! Recordings cut into slices, which any worker can annotate, and joined again.

use std::path::PathBuf;

use divmerge::annotate::slices::{self, Plan, Slice};
use divmerge::annotate::{self as library, JoinOptions, SliceFile};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::annotate::{from_json, reported, run};
use crate::errors::{exists_already, raised, wrong, wrong_type};
use crate::parameters::{names, paths, recording, within};
use crate::watch;

#[pyfunction]
#[pyo3(signature = (inputs, shards, *, topics=None))]
/// Cuts recordings into slices by their indexes alone, as `divmerge plan` does. Returns a dict a
/// slice, of plain numbers and text, to be sent to whoever annotates it; the slices of a recording
/// follow one another.
///
/// inputs: recordings (MCAP), folders of rosbag2, or other folders, of which every .mcap file is
/// meant; one or several. shards: how many slices in all; each recording gets at least one. topics:
/// share out the clouds of these topics alone, one or several; all if not said.
///
/// Of each: `input`, `input_bytes`, `name` (where what is made of the recording goes below a
/// folder), `number` and `count` (from 0, among the slices of the recording), `start` and `end`
/// (bytes in which its chunks begin), `clouds`, `from_ns` and `to_ns` (log times of its chunks,
/// nanoseconds since 1970, or None).
pub fn plan<'py>(
    py: Python<'py>,
    inputs: &Bound<'py, PyAny>,
    shards: &Bound<'py, PyAny>,
    topics: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let inputs: Vec<PathBuf> = paths("inputs", inputs)?.into_iter().map(recording).collect();
    let shards = within("shards", shards, u32::MAX as usize)?;
    let topics = topics.map(|topics| names("topics", topics)).transpose()?.unwrap_or_default();
    let planned = py.detach(|| slices::plan(&slices::recordings(&inputs)?, shards, &topics));
    from_json(py, &Plan::new(planned.map_err(raised)?).to_json())?.get_item("slices")
}

#[pyfunction]
#[pyo3(
    signature = (slice, folder, *, input=None, **parameters),
    text_signature = "(slice, folder, *, input=None, semantics='auto', taxonomy=None, \
        preset='best', voxel=None, angle=None, gap_columns=None, gap_rows=None, min_points=None, \
        bev=None, method=None, set=None, \
        rows=None, columns=None, fov=None, sensor_frame='auto', \
        units=None, sensor_origin=(), min_range=None, max_range=None, crop=None, ego=None, \
        topics=(), \
        from_=None, to=None, objects=None, flavor='auto', compression=None, unchecked=False, \
        only=False, in_place=False, resume=False, force=False, threads=None, progress=None, \
        tolerance=0.01, model_config=None, model_image='auto', remission_scale=None, batch=None, \
        runtime='auto', onnxruntime=None, device='auto', **parameters)"
)]
/// Annotates a slice of a plan into a folder, as `divmerge annotate --slice` does; `join` puts
/// slices together. Returns the report, whose `output` is the file.
///
/// slice: one of `plan`.
/// folder: where it goes, under a name of its own; made if it is not there.
/// input: where the recording is, if not where it was planned.
///
/// All else is as for `annotate`, and has to be the same for all slices of a recording.
pub fn annotate_slice<'py>(
    py: Python<'py>,
    slice: &Bound<'py, PyAny>,
    folder: PathBuf,
    input: Option<PathBuf>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let json = py.import(intern!(py, "json"))?.call_method1(intern!(py, "dumps"), (slice,));
    let json: String =
        json.map_err(|_| wrong_type("slice", "expected one of plan()"))?.extract()?;
    let slice: Slice = serde_json::from_str(&json).map_err(|error| wrong("slice", error))?;
    let input = input.map_or_else(|| slice.input.clone(), recording);
    let out = folder.join(slice.file_name());
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder)?;
    }
    run(py, "annotate_slice", (&input, &out), parameters, Some(slice))
}

#[pyfunction]
#[pyo3(
    signature = (slices, out, *, input=None, force=false, threads=None, progress=None),
    text_signature = "(slices, out, *, input=None, force=False, threads=None, progress=None)"
)]
/// Puts the annotated slices of one recording together, as `divmerge join` does: the bytes that
/// `annotate` writes of the whole recording with the same parameters. Returns the report.
///
/// slices: the files that `annotate_slice` wrote, in any order. One that is missing or there twice
/// is a `divmerge.Error` that names it. out: the annotated recording, which appears when it is
/// whole. input: where the recording is, if not where it was planned. force: replace an existing
/// output. threads, progress: as for `annotate`.
pub fn join<'py>(
    py: Python<'py>,
    slices: &Bound<'py, PyAny>,
    out: PathBuf,
    input: Option<PathBuf>,
    force: bool,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let files = paths("slices", slices)?;
    let threads = threads.map(|threads| within("threads", threads, 1024)).transpose()?;
    let progress = progress.map(|said| watch::progress("progress", said)).transpose()?.flatten();
    let sorted = py.detach(|| {
        let opened = files.iter().map(|file| SliceFile::open(file)).collect::<Result<_, _>>()?;
        library::by_recording(opened, None)
    });
    let sorted = sorted.map_err(raised)?;
    let [slices] = sorted.as_slice() else {
        return Err(wrong(
            "slices",
            format!("expected those of one recording, got {}", sorted.len()),
        ));
    };
    if !force && out.symlink_metadata().is_ok() {
        return Err(exists_already(&out));
    }
    let options = JoinOptions { input: input.map(recording), force, threads: threads.unwrap_or(0) };
    reported(py, progress, |see| library::join(slices, &out, &options, see))
}
