//! Keyword arguments about where a recording's objects come from.

use divmerge::annotate::{ObjectOptions, ObjectSource};
use divmerge::network::NetworkImage;
use divmerge::network::runtime::{Device, RuntimeKind};
use divmerge::pipeline::overrides::limits;
use pyo3::prelude::*;

use crate::errors::wrong;
use crate::parameters::{choice, number, parsed, path, paths, within};

/// Names of the arguments about where a recording's objects come from.
pub const OBJECTS: &[&str] = &[
    "semantics",
    "tolerance",
    "model_config",
    "model_image",
    "remission_scale",
    "runtime",
    "onnxruntime",
    "device",
    "batch",
];

/// Sets one of them.
pub fn set_objects(
    objects: &mut ObjectOptions,
    name: &str,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let network = &mut objects.network;
    match name {
        "semantics" => objects.source = parsed::<ObjectSource>(name, value)?,
        "tolerance" => {
            let seconds = limits::not_negative(number(name, value)?);
            objects.tolerance_ns = (seconds.map_err(|p| wrong(name, p))? * 1e9).round() as u64;
        }
        "model_config" => network.config = paths(name, value)?,
        "model_image" => {
            network.image = choice(
                name,
                value,
                &[("auto", NetworkImage::Auto), ("clustering", NetworkImage::Clustering)],
            )?;
        }
        "remission_scale" => {
            let scale = limits::above_zero(number(name, value)?).map_err(|p| wrong(name, p))?;
            network.remission_scale = Some(scale as f32);
        }
        "batch" => network.batch = within(name, value, 256)?,
        "runtime" => {
            network.runtime.kind = choice(
                name,
                value,
                &[
                    ("auto", RuntimeKind::Auto),
                    ("onnxruntime", RuntimeKind::OnnxRuntime),
                    ("tract", RuntimeKind::Tract),
                ],
            )?;
        }
        "onnxruntime" => network.runtime.library = Some(path(name, value)?),
        "device" => {
            network.runtime.device = choice(
                name,
                value,
                &[
                    ("auto", Device::Auto),
                    ("cpu", Device::Cpu),
                    ("cuda", Device::Cuda),
                    ("tensorrt", Device::TensorRt),
                ],
            )?;
        }
        _ => {}
    }
    Ok(())
}
