//! Clouds in arrays, clustered.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Numbers};
use crate::cloud_run::Objects;
use crate::clustering::{Columns, of_arrays, of_points, run, upright};
use crate::frame::Frame;
use crate::parameters::{Parameters, WITHOUT_CLASSES};
use crate::result::ClusterResult;

#[pyfunction]
#[pyo3(
    signature = (points, semantics=None, **parameters),
    text_signature = "(points, semantics=None, *, confidence=None, ring=None, source=None, \
        taxonomy=None, preset='best', voxel=None, angle=None, gap_columns=None, gap_rows=None, \
        min_points=None, bev=None, method=None, set=None, \
        rows=None, columns=None, fov=None, \
        sensor_frame=None, **parameters)"
)]
/// Cuts a LiDAR cloud into object instances.
///
/// points: (N, 3) or (N, 4), or organised (H, W, 3) or (H, W, 4): x, y, z in metres, sensor at the
/// origin, z up unless `sensor_frame` says otherwise; a fourth column is not read. C-contiguous
/// float32 is read in place, other real numbers and strides are converted first. NaN, infinity and
/// the origin are no returns. Anything with `__array__` or `__dlpack__` will do, as a tensor on the
/// CPU; or a `Frame`. semantics: which points are objects. None: a frame's own classes, else ground
/// removal; (N,) integers: class ids of the taxonomy (of ids above 65535, as SemanticKITTI's words,
/// the low 16 bits); (N,) bool: objects are marked; "ground": ground removal; "all": every return.
/// confidence: (N,) probability of each class, 0 to 1. ring, source: (N,) beam number, and sensor
/// in a cloud merged of several, 0 to 65535. taxonomy: what class ids mean, a Taxonomy or the path
/// of a YAML file; SemanticKITTI's if not said. preset: "best", "paper" or "authors", the
/// parameters to start from; each of the following overrides one. voxel: side of a voxel of the
/// divide step, metres. angle: least angle beta between neighbours of one object, degrees.
/// gap_columns, gap_rows: most columns and rows from a pixel to its neighbour. min_points:
/// instances seen in fewer pixels are dropped. bev: merge on the bird's-eye plane: "off", "size",
/// "box", "rectangle" or "hull". method: another method in place of divide and merge:
/// "depth-clustering", "scan-line-run", "euclidean", "dbscan", "supervoxel", "alpine" or
/// "one-per-class". set: any parameters by path, as {"cluster.tree.gap": 0.02}; `parameters` lists
/// them with their keywords, which set them too, as tree_gap=0.02. rows, columns, fov: rows of
/// equal elevation, columns of the full circle, and (upper, lower) elevation in degrees of the
/// range image, in place of what is found in the cloud. sensor_frame: how the points' frame stands:
/// where x, y and z look ("rfu", "frd", ...), or roll, pitch and yaw of the sensor in degrees
/// ("180,0,0").
///
/// Other threads of Python run meanwhile.
pub fn cluster<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    semantics: Option<&Bound<'py, PyAny>>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<ClusterResult> {
    let (columns, parameters) = Columns::take(parameters)?;
    match points.cast::<Frame>() {
        Ok(frame) => frame.get().cluster_with(py, semantics, &columns, &parameters),
        Err(_) => of_points(py, points, semantics, &columns, &parameters),
    }
}

#[pyfunction]
#[pyo3(
    signature = (x, y, z, mask, **parameters),
    text_signature = "(x, y, z, mask, *, preset='best', voxel=None, angle=None, gap_columns=None, \
        gap_rows=None, min_points=None, bev=None, method=None, set=None, \
        rows=None, columns=None, fov=None, \
        sensor_frame=None, **parameters)"
)]
/// Cuts the objects of an organised range image into instances, as the paper's own Python function
/// does.
///
/// x, y, z: (H, W) metres, a row per beam and a column per moment; NaN, infinity or the origin
/// where nothing came back. mask: (H, W) bool, or integers of which 0 is no object.
///
/// Instances are told by the mask and the geometry alone, without classes. The parameters are those
/// of `cluster`; arrays of the result are (H, W).
pub fn cluster_image<'py>(
    py: Python<'py>,
    x: &Bound<'py, PyAny>,
    y: &Bound<'py, PyAny>,
    z: &Bound<'py, PyAny>,
    mask: &Bound<'py, PyAny>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<ClusterResult> {
    let parameters =
        Parameters::take("cluster_image", &[WITHOUT_CLASSES], parameters, |_, _| Ok(()))?;
    let (cloud, shape) = arrays::image_points([("x", x), ("y", y), ("z", z)])?;
    let (Numbers::Marks(marks) | Numbers::Whole(marks)) =
        arrays::numbers("mask", mask, &shape, |number| number != 0)?;
    let cloud = upright(cloud, parameters.sensor_frame)?;
    run(py, of_arrays(py, cloud, Objects::Marked(marks), &parameters)?, shape)
}
