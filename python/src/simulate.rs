//! Simulated drives.

use std::ops::ControlFlow;
use std::path::PathBuf;

use divmerge::datasets::drive::write_drive_in;
use divmerge::messages::clouds::CloudFormat;
use divmerge::recording::WriteOptions;
use divmerge::simulate::Drive;
use pyo3::prelude::*;

use crate::annotate::COMPRESSIONS;
use crate::errors::{exists_already, raised};
use crate::parameters::{choice, parsed};

/// Messages of a recording.
const ENCODINGS: [(&str, CloudFormat); 5] = [
    ("ros2", CloudFormat::Ros2),
    ("ros1", CloudFormat::Ros1),
    ("foxglove-protobuf", CloudFormat::FoxgloveProtobuf),
    ("foxglove-json", CloudFormat::FoxgloveJson),
    ("foxglove-ros2", CloudFormat::FoxgloveRos2),
];

#[pyfunction]
#[pyo3(
    signature = (
        out, *, sensor=None, scene=None, frames=50, seed=1, encoding=None, compression=None,
        force=false
    ),
    text_signature = "(out, *, sensor='hdl-64e', scene='street', frames=50, seed=1, \
        encoding='ros2', compression='zstd', force=False)"
)]
#[expect(clippy::too_many_arguments, reason = "they are the keywords of a Python function")]
/// Writes a simulated drive with truth as a recording, and returns its bytes: what `divmerge
/// simulate` writes.
///
/// Its clouds on /lidar/points carry `label` (SemanticKITTI's class) and `true_instance`. `sensor`:
/// "hdl-64e", "vlp-16", "os1-128", ...; `scene`: "street", "parking", "crowd", "hills", "yard"
/// or "traffic"; `frames`: a tenth of a second each; `encoding`: "ros2", "ros1",
/// "foxglove-protobuf", "foxglove-json" or "foxglove-ros2".
pub fn simulate<'py>(
    py: Python<'py>,
    out: PathBuf,
    sensor: Option<&Bound<'py, PyAny>>,
    scene: Option<&Bound<'py, PyAny>>,
    frames: usize,
    seed: u64,
    encoding: Option<&Bound<'py, PyAny>>,
    compression: Option<&Bound<'py, PyAny>>,
    force: bool,
) -> PyResult<u64> {
    use divmerge::simulate::{Scene, Sensor};
    let sensor = sensor.map_or(Ok(Sensor::Hdl64e), |sensor| parsed("sensor", sensor))?;
    let scene = scene.map_or(Ok(Scene::Street), |scene| parsed("scene", scene))?;
    let of = |encoding| choice("encoding", encoding, &ENCODINGS);
    let format = encoding.map_or(Ok(CloudFormat::Ros2), of)?;
    let of = |compression| choice("compression", compression, &COMPRESSIONS);
    let compression = compression.map(of).transpose()?;
    if !force && out.symlink_metadata().is_ok() {
        return Err(exists_already(&out));
    }
    let usual = WriteOptions::default();
    let compression = compression.unwrap_or(usual.compression);
    let options = WriteOptions { compression, force, ..usual };
    let mut failure = None;
    let written = py.detach(|| {
        let drive = Drive::new(sensor, scene, seed);
        write_drive_in(&drive, (format, frames), &out, &options, |_| {
            failure = Python::attach(|py| py.check_signals()).err();
            if failure.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    match failure {
        Some(failure) => Err(failure),
        None => written.map_err(raised),
    }
}
