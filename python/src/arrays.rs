//! NumPy arrays in, columns out; and columns in, NumPy arrays out.

use std::sync::Mutex;

use divmerge::{PointCloud, PointColumns};
use numpy::{
    Element, PyArray1, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::errors::{type_of, wrong, wrong_type};

/// An array of anything that is one, has `__array__` or `__dlpack__`, or is a sequence of numbers.
pub fn array<'py>(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = object.cast::<PyUntypedArray>() {
        return Ok(array.clone());
    }
    let py = object.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    let made = if !object.hasattr(intern!(py, "__array__"))?
        && object.hasattr(intern!(py, "__dlpack__"))?
    {
        numpy.call_method1(intern!(py, "from_dlpack"), (object,))?
    } else {
        numpy.call_method1(intern!(py, "asarray"), (object,))?
    };
    let made: Bound<'_, PyUntypedArray> = made.cast_into().map_err(|_| no_array(name, object))?;
    // What NumPy knows nothing of becomes an array of one object.
    match made.ndim() == 0 && kind(&made) == b'O' {
        true => Err(no_array(name, object)),
        false => Ok(made),
    }
}

fn no_array(name: &str, object: &Bound<'_, PyAny>) -> PyErr {
    wrong_type(name, format!("expected an array, got {}", type_of(object)))
}

/// `(2, 3)`, as Python writes it.
pub fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// The kind of an array's numbers: NumPy's letter.
fn kind(array: &Bound<'_, PyUntypedArray>) -> u8 {
    array.dtype().kind()
}

/// The same array as C-contiguous numbers of a type; itself if it is that already.
fn plain<'py, T: Element>(
    array: &Bound<'py, PyUntypedArray>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    if let Ok(typed) = array.cast::<PyArrayDyn<T>>()
        && typed.is_c_contiguous()
        && typed.readonly().as_slice().is_ok()
    {
        return Ok(typed.clone());
    }
    let py = array.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    let made = numpy.call_method1(
        intern!(py, "require"),
        (array, T::get_dtype(py), PyList::new(py, ["C", "ALIGNED"])?),
    )?;
    Ok(made.cast_into()?)
}

/// Numbers that can be read as floats, of a shape.
fn floats<'py>(
    name: &str,
    array: &Bound<'py, PyUntypedArray>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    match kind(array) {
        b'f' | b'i' | b'u' => plain(array),
        // Types that NumPy does not know itself, such as bfloat16, convert if they can.
        b'V' => plain(array).map_err(|_| not_numbers(name, array)),
        _ => Err(not_numbers(name, array)),
    }
}

fn not_numbers(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyErr {
    wrong_type(name, format!("expected real numbers, got dtype {}", array.dtype()))
}

fn same_shape(name: &str, array: &Bound<'_, PyUntypedArray>, shape: &[usize]) -> PyResult<()> {
    match array.shape() == shape {
        true => Ok(()),
        false => {
            let [expected, got] = [shape, array.shape()].map(shape_text);
            Err(wrong(name, format!("expected {expected}, got {got}")))
        }
    }
}

/// A column of floats.
pub fn column(name: &str, object: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f32>> {
    let array = array(name, object)?;
    same_shape(name, &array, shape)?;
    let numbers = floats(name, &array)?;
    let numbers = numbers.readonly();
    Ok(numbers.as_slice()?.to_vec())
}

/// Whole numbers, or marks.
pub enum Numbers<T> {
    /// Whole numbers.
    Whole(Vec<T>),
    /// True and false.
    Marks(Vec<bool>),
}

/// A column of whole numbers of 32 bits as whatever is made of them, or of booleans.
pub fn numbers<T>(
    name: &str,
    object: &Bound<'_, PyAny>,
    shape: &[usize],
    make: impl Fn(u32) -> T,
) -> PyResult<Numbers<T>> {
    let array = array(name, object)?;
    same_shape(name, &array, shape)?;
    macro_rules! whole {
        ($type:ty) => {{
            let numbers = plain::<$type>(&array)?;
            let numbers = numbers.readonly();
            let numbers = numbers.as_slice()?;
            // All bits of all numbers, the sign over the upper half of those below 0.
            if numbers.iter().fold(0, |bits, &number| bits | number as u64) > u64::from(u32::MAX) {
                return Err(too_large(name, numbers.iter().map(|&number| number.into())));
            }
            Ok(Numbers::Whole(numbers.iter().map(|&number| make(number as u32)).collect()))
        }};
    }
    match (kind(&array), array.dtype().itemsize()) {
        (b'b', _) => {
            let marks = plain::<bool>(&array)?;
            let marks = marks.readonly();
            Ok(Numbers::Marks(marks.as_slice()?.to_vec()))
        }
        (b'u', 1) => whole!(u8),
        (b'u', 2) => whole!(u16),
        (b'u', 4) => whole!(u32),
        (b'u', 8) => whole!(u64),
        (b'i', 1) => whole!(i8),
        (b'i', 2) => whole!(i16),
        (b'i', 4) => whole!(i32),
        (b'i', 8) => whole!(i64),
        _ if array.shape().contains(&0) => Ok(Numbers::Whole(Vec::new())),
        _ => Err(wrong_type(name, format!("expected integers, got dtype {}", array.dtype()))),
    }
}

fn too_large(name: &str, mut numbers: impl Iterator<Item = i128>) -> PyErr {
    let found = numbers.find(|number| !(0..=i128::from(u32::MAX)).contains(number));
    let found = found.map_or(String::new(), |number| format!(", got {number}"));
    wrong(name, format!("expected numbers of 0 to {}{found}", u32::MAX))
}

/// A column of numbers that fit 16 bits.
pub fn short_numbers(name: &str, object: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<u16>> {
    let short = |number: u32| {
        u16::try_from(number)
            .map_err(|_| wrong(name, format!("expected numbers of 0 to 65535, got {number}")))
    };
    whole_numbers(name, object, shape)?.into_iter().map(short).collect()
}

/// A column of numbers of 32 bits.
pub fn whole_numbers(name: &str, object: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<u32>> {
    match numbers(name, object, shape, |number| number)? {
        Numbers::Whole(numbers) => Ok(numbers),
        Numbers::Marks(_) => Err(wrong_type(name, "expected integers, got dtype bool")),
    }
}

/// Points of an array (..., 3 or 4), and the shape before its last axis: (N,) or (H, W).
pub fn points(object: &Bound<'_, PyAny>) -> PyResult<(PointColumns, Vec<usize>)> {
    let array = array("points", object)?;
    let shape = array.shape().to_vec();
    let ([shape @ .., step @ (3 | 4)], 2 | 3) = (&shape[..], shape.len()) else {
        let problem = "expected (N, 3), (N, 4), (H, W, 3) or (H, W, 4) float32";
        return Err(wrong("points", format!("{problem}, got {}", shape_text(&shape))));
    };
    check_count(shape)?;
    let mut cloud = columns();
    if array.dtype().is_equiv_to(&f64::get_dtype(array.py())) {
        let numbers = plain::<f64>(&array)?;
        split(*step, numbers.readonly().as_slice()?, |number| number as f32, &mut cloud);
    } else {
        let numbers = floats("points", &array)?;
        split(*step, numbers.readonly().as_slice()?, |number| number, &mut cloud);
    }
    set_shape(&mut cloud, shape);
    Ok((cloud, shape.to_vec()))
}

/// Points of an organised cloud in three arrays (H, W).
pub fn image_points(axes: [(&str, &Bound<'_, PyAny>); 3]) -> PyResult<(PointColumns, Vec<usize>)> {
    let first = array(axes[0].0, axes[0].1)?;
    let shape = first.shape().to_vec();
    if shape.len() != 2 {
        let got = shape_text(&shape);
        return Err(wrong(axes[0].0, format!("expected (H, W) float32, got {got}")));
    }
    check_count(&shape)?;
    let [x, y, z] = axes.map(|(name, object)| column(name, object, &shape));
    let mut cloud = PointColumns { x: x?, y: y?, z: z?, ..PointColumns::default() };
    set_shape(&mut cloud, &shape);
    Ok((cloud, shape))
}

/// Points are numbered in 32 bits.
fn check_count(shape: &[usize]) -> PyResult<()> {
    match shape.iter().try_fold(1_usize, |count, &side| count.checked_mul(side)) {
        Some(count) if count < u32::MAX as usize => Ok(()),
        _ => Err(wrong("points", format!("too many: {}", shape_text(shape)))),
    }
}

fn set_shape(cloud: &mut PointColumns, shape: &[usize]) {
    [cloud.height, cloud.width] = match *shape {
        [height, width] => [height, width],
        _ => [1, cloud.x.len()],
    };
}

/// One pass over points of so many numbers each, 3 or 4.
fn split<T: Copy>(
    step: usize,
    numbers: &[T],
    single: impl Fn(T) -> f32 + Copy,
    cloud: &mut PointColumns,
) {
    match step {
        3 => split_each::<T, 3>(numbers, single, cloud),
        _ => split_each::<T, 4>(numbers, single, cloud),
    }
}

fn split_each<T: Copy, const STEP: usize>(
    numbers: &[T],
    single: impl Fn(T) -> f32,
    cloud: &mut PointColumns,
) {
    let (points, _) = numbers.as_chunks::<STEP>();
    for column in [&mut cloud.x, &mut cloud.y, &mut cloud.z] {
        column.resize(points.len(), 0.0);
    }
    let places = cloud.x.iter_mut().zip(&mut cloud.y).zip(&mut cloud.z);
    for (point, ((x, y), z)) in points.iter().zip(places) {
        (*x, *y, *z) = (single(point[0]), single(point[1]), single(point[2]));
    }
}

/// Columns that are used again: memory that the system has just given costs more to touch than the
/// points to copy.
static COLUMNS: Mutex<Vec<PointColumns>> = Mutex::new(Vec::new());

/// Most clouds whose columns are kept.
const KEPT: usize = 4;

/// A cloud whose columns may have room already, and hold what is not to be read.
fn columns() -> PointColumns {
    let kept = COLUMNS.lock().ok().and_then(|mut kept| kept.pop());
    kept.unwrap_or_default()
}

/// Keeps the columns of a cloud that nobody needs any more.
pub fn keep_columns(cloud: PointCloud) {
    if let Ok(mut kept) = COLUMNS.lock()
        && kept.len() < KEPT
    {
        let PointColumns { x, y, z, .. } = cloud.into_columns();
        kept.push(PointColumns { x, y, z, ..PointColumns::default() });
    }
}

/// A column as an array of a shape, without a copy.
pub fn shaped<'py, T: Element>(
    py: Python<'py>,
    column: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let array = PyArray1::from_vec(py, column);
    match shape.len() {
        1 => Ok(array.into_any()),
        _ => Ok(array.reshape(shape.to_vec())?.into_any()),
    }
}

/// An array of records: a field for each of some columns (K,) or (K, n).
pub fn records<'py>(
    py: Python<'py>,
    count: usize,
    columns: &[(&str, Bound<'py, PyAny>)],
) -> PyResult<Bound<'py, PyAny>> {
    let fields = PyList::empty(py);
    for (name, column) in columns {
        let shape: Vec<usize> = column.getattr(intern!(py, "shape"))?.extract()?;
        let inner = PyTuple::new(py, &shape[1..])?;
        fields.append((name, column.getattr(intern!(py, "dtype"))?, inner))?;
    }
    let numpy = py.import(intern!(py, "numpy"))?;
    let options = PyDict::new(py);
    options.set_item("dtype", fields)?;
    let made = numpy.call_method("empty", (count,), Some(&options))?;
    for (name, column) in columns {
        made.set_item(name, column)?;
    }
    Ok(made)
}
