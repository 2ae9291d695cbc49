//! Keyword arguments that several functions share, and what they ask for.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use divmerge::Taxonomy;
use divmerge::annotate::{AnnotateConfig, ObjectOptions, ObjectSource};
use divmerge::cloud::sensor_frame::SensorFrame;
use divmerge::cloud::{CloudFrames, Crop, Ego, LengthUnit, SensorOrigin};
use divmerge::comparison::DIVIDE_AND_MERGE;
use divmerge::comparison::methods::{self, BOXES};
use divmerge::error::spelling::did_you_mean;
use divmerge::frames::{EgoBodies, recorded_transforms};
use divmerge::parameters::{ParameterSet, SettingError};
use divmerge::pipeline::{BirdsEyeMerge, Config, Overrides, Preset};
use divmerge::recording::address::put_secrets_aside;
use divmerge::semantics::GroundParams;
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use serde_json::Value;

use crate::by_name::{keyword, path_of, takes_settings, unexpected};
use crate::environment;
use crate::errors::{raised, type_of, wrong, wrong_type};
use crate::taxonomy::PyTaxonomy;

/// How clouds are cut into instances.
#[derive(Default)]
pub struct Parameters {
    overrides: Overrides,
    /// Paths of parameters and their values.
    settings: Vec<(String, Value)>,
    /// Those of them that were given by keyword.
    by_keyword: Vec<&'static str>,
    /// Another method in the place of divide and merge.
    method: Option<String>,
    /// What the ids of classes mean, where that is said.
    pub taxonomy: Option<Py<PyTaxonomy>>,
    /// How the frame of the clouds stands, where that is said.
    pub sensor_frame: Option<SensorFrame>,
    /// Where sensors stand, where that is said.
    pub sensor_origins: Vec<SensorOrigin>,
    /// The unit of a recording's clouds, where that is said.
    unit: Option<LengthUnit>,
    /// Which returns of a recording's clouds are looked at.
    crop: Crop,
    /// Whether the vehicle that carries the sensor is to be found in a recording.
    finds_ego: bool,
}

/// Names of all of them.
pub const ALL: &[&str] = &[
    "taxonomy",
    "preset",
    "voxel",
    "angle",
    "gap_columns",
    "gap_rows",
    "min_points",
    "bev",
    "method",
    "set",
    "rows",
    "columns",
    "fov",
    "sensor_frame",
];

/// Those that are not about classes.
pub const WITHOUT_CLASSES: &[&str] = ALL.split_at(1).1;

/// Names of those about the coordinates in a recording's clouds.
pub const COORDINATES: &[&str] =
    &["units", "sensor_origin", "min_range", "max_range", "crop", "ego"];

/// Why the method of boxes cannot be had here.
pub const NEEDS_BOXES: &str = "`boxes` needs boxes, which only the command line reads";

impl Parameters {
    /// Takes the arguments of a function that takes those names, and gives `other` the ones that
    /// are not about the method. None is as good as nothing said.
    pub fn take<'py>(
        function: &str,
        names: &[&[&str]],
        arguments: Option<&Bound<'py, PyDict>>,
        mut other: impl FnMut(&str, &Bound<'py, PyAny>) -> PyResult<()>,
    ) -> PyResult<Self> {
        let (mut parameters, mut by_name) = (Parameters::default(), Vec::new());
        for (name, value) in arguments.into_iter().flatten() {
            let name: String = name.extract()?;
            if !names.iter().any(|names| names.contains(&name.as_str())) {
                let path = path_of(&name).filter(|_| takes_settings(names));
                let path = path.ok_or_else(|| unexpected(function, &name, names))?;
                if !value.is_none() {
                    by_name.push((path.to_owned(), setting_of(&name, &value)?));
                    parameters.by_keyword.push(path);
                }
                continue;
            }
            if !value.is_none() && !parameters.set(&name, &value)? {
                other(&name, &value)?;
            }
        }
        parameters.settings.append(&mut by_name);
        Ok(parameters)
    }

    /// Whether it is one of them.
    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
        let overrides = &mut self.overrides;
        match name {
            "preset" => overrides.preset = preset(name, value)?,
            "voxel" => overrides.voxel = Some(number(name, value)?),
            "angle" => overrides.angle = Some(number(name, value)?),
            "gap_columns" => overrides.gap_columns = Some(whole(name, value)?),
            "gap_rows" => overrides.gap_rows = Some(whole(name, value)?),
            "min_points" => overrides.min_points = Some(whole(name, value)?),
            "bev" => overrides.bev = Some(choice(name, value, &BirdsEyeMerge::NAMES)?),
            "rows" => overrides.rows = Some(whole(name, value)?),
            "columns" => overrides.columns = Some(whole(name, value)?),
            "fov" => overrides.field_of_view = Some(pair(name, value)?),
            "set" => self.settings = settings(name, value)?,
            "method" => self.method = Some(text(name, value)?),
            "taxonomy" => self.taxonomy = Some(PyTaxonomy::of(value)?),
            "sensor_frame" => self.sensor_frame = Some(parsed(name, value)?),
            "sensor_origin" => {
                let each = names(name, value)?.into_iter().map(|text| text.parse());
                let origins: Result<_, String> = each.collect();
                self.sensor_origins = origins.map_err(|problem| wrong(name, problem))?;
            }
            "units" => self.unit = Some(parsed(name, value)?),
            "min_range" => self.crop.min_range = Some(number(name, value)?),
            "max_range" => self.crop.max_range = Some(number(name, value)?),
            "crop" => self.crop.region = Some(parsed(name, value)?),
            "ego" => match parsed(name, value)? {
                Ego::Block(block) => self.crop.ego = Some(block),
                Ego::Auto => self.finds_ego = true,
            },
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Every parameter.
    pub fn all(&self, taxonomy: &Taxonomy) -> PyResult<ParameterSet> {
        let config = self.config(taxonomy)?;
        let mut parameters = ParameterSet::of(&config, &GroundParams::default());
        let settings = self.settings.iter().map(|(path, value)| (path.as_str(), value));
        parameters.set_all(settings).map_err(|error| self.raised(error))?;
        Ok(parameters)
    }

    /// Paths of parameters and their values, which it has no more.
    pub fn take_settings(&mut self) -> Vec<(String, Value)> {
        std::mem::take(&mut self.settings)
    }

    /// What is wrong with a parameter, by the name by which it was given.
    pub fn raised(&self, error: SettingError) -> PyErr {
        let is_keyword = |path: &String| self.by_keyword.contains(&path.as_str());
        match &error {
            SettingError::Wrong { path, value, wanted, nearest } if is_keyword(path) => {
                let near = nearest.first();
                let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                wrong(&keyword(path), format!("must be {wanted}, got {value}{near}"))
            }
            SettingError::Off { path, group, remedy } if is_keyword(path) => {
                let problem = format!("has no effect while `{group}` is off: set {remedy} first");
                wrong(&keyword(path), problem)
            }
            _ => raised(error),
        }
    }

    /// The parameters of the pipeline, without those of `set`.
    fn config(&self, taxonomy: &Taxonomy) -> PyResult<Config> {
        let mut config = self.overrides.config().map_err(raised)?;
        config.other_method = match self.method.as_deref() {
            None | Some(DIVIDE_AND_MERGE) => None,
            Some(BOXES) => return Err(wrong("method", NEEDS_BOXES)),
            Some(name) => Some(methods::named(name, taxonomy).ok_or_else(|| {
                let known = methods::NAMES.into_iter().filter(|name| *name != BOXES);
                let known = known.collect::<Vec<_>>().join(", ");
                let near = did_you_mean(name, [DIVIDE_AND_MERGE].iter().chain(&methods::NAMES));
                let known = format!("use {DIVIDE_AND_MERGE}, {known}{near}");
                wrong("method", format!("`{name}` is no method: {known}"))
            })?),
        };
        Ok(config)
    }

    /// What is done to each cloud of a recording.
    pub fn annotate_config(
        &self,
        py: Python<'_>,
        mut objects: ObjectOptions,
        recording: &Path,
    ) -> PyResult<AnnotateConfig> {
        objects.taxonomy = self.taxonomy.as_ref().map(|taxonomy| taxonomy.get().inner.clone());
        let library = &mut objects.network.runtime.library;
        if matches!(objects.source, ObjectSource::Onnx(_)) && library.is_none() {
            *library = environment::onnxruntime(py)?;
        }
        let sensor_frame = self.sensor_frame.unwrap_or_default();
        let (unit, crop) = (self.unit, self.crop);
        let opened = py.detach(|| -> divmerge::Result<_> {
            let transforms = recorded_transforms(&sensor_frame, recording)?;
            let sensor_origins = self.sensor_origins.clone();
            let frames = CloudFrames { sensor_frame, transforms, sensor_origins };
            Ok((objects.config(recording)?, frames))
        });
        let (config, frames) = opened.map_err(raised)?;
        let parameters = self.all(&config.taxonomy)?;
        let ego = py.detach(|| match self.finds_ego {
            true => {
                let unit = unit.unwrap_or_default();
                EgoBodies::find(recording, unit, &frames, &parameters.projection)
            }
            false => Ok(EgoBodies::default()),
        });
        let config = config.with_parameters(&parameters);
        Ok(AnnotateConfig { unit, crop, ego: ego.map_err(raised)?, frames, ..config })
    }
}

/// A preset by its name.
pub fn preset(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Preset> {
    choice(name, value, &Preset::ALL.map(|preset| (preset.name(), preset)))
}

/// One of some words, and what it stands for.
pub fn choice<T: Clone>(name: &str, value: &Bound<'_, PyAny>, words: &[(&str, T)]) -> PyResult<T> {
    let said = text(name, value)?;
    words
        .iter()
        .find(|(word, _)| *word == said)
        .map(|(_, stands_for)| stands_for.clone())
        .ok_or_else(|| {
            let words: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            let near = did_you_mean(&said, &words);
            wrong(name, format!("`{said}` is none of {}{near}", words.join(", ")))
        })
}

/// A text that is read as the command line reads it.
pub fn parsed<T: FromStr<Err = String>>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<T> {
    text(name, value)?.parse().map_err(|problem| wrong(name, problem))
}

/// A text.
pub fn text(name: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    match value.cast::<PyString>() {
        Ok(text) => Ok(text.to_str()?.to_owned()),
        Err(_) => Err(wrong_type(name, format!("expected str, got {}", type_of(value)))),
    }
}

/// A number.
pub fn number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let problem = |_| wrong_type(name, format!("expected a number, got {}", type_of(value)));
    value.extract().map_err(problem)
}

/// A whole number from 0 on.
pub fn whole(name: &str, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    value.extract().map_err(|error: PyErr| {
        match error.is_instance_of::<PyOverflowError>(value.py()) {
            true => wrong(name, "expected a whole number from 0 on"),
            false => wrong_type(name, format!("expected a whole number, got {}", type_of(value))),
        }
    })
}

/// A whole number of 1 to some other.
pub fn within(name: &str, value: &Bound<'_, PyAny>, most: usize) -> PyResult<usize> {
    match whole(name, value)? {
        number if (1..=most).contains(&number) => Ok(number),
        number => Err(wrong(name, format!("expected 1 to {most}, got {number}"))),
    }
}

/// Paths of parameters and their values.
fn settings(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Value)>> {
    let problem = || wrong_type(name, "expected a dict of paths of parameters and their values");
    let entries = value.cast::<PyDict>().map_err(|_| problem())?.iter();
    let entries = entries.map(|(path, value)| {
        let path = path.extract::<String>().map_err(|_| problem())?;
        let value = setting_of(&path, &value)?;
        Ok((path, value))
    });
    entries.collect()
}

/// The value of a parameter with a path or keyword.
fn setting_of(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let problem = || wrong_type(name, format!("cannot be of type {}", type_of(value)));
    setting(value).ok_or_else(problem)
}

/// True or false, a number, a text, or several of these.
fn setting(value: &Bound<'_, PyAny>) -> Option<Value> {
    if value.is_instance_of::<PyBool>() {
        return value.extract::<bool>().ok().map(Value::from);
    }
    if value.is_instance_of::<PyInt>() {
        return value.extract::<i64>().ok().map(Value::from);
    }
    if value.is_instance_of::<PyString>() {
        return value.extract::<String>().ok().map(Value::from);
    }
    if value.is_instance_of::<PyFloat>() || value.extract::<f64>().is_ok() {
        // JSON has no NaN: as text it is refused with its name.
        let number = value.extract::<f64>().ok()?;
        return Some(match number.is_finite() {
            true => Value::from(number),
            false => Value::from(number.to_string()),
        });
    }
    let items = value.try_iter().ok()?;
    items.map(|item| setting(&item.ok()?)).collect::<Option<Vec<Value>>>().map(Value::from)
}

fn pair(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    let problem = "expected two numbers, the upper and the lower elevation in degrees";
    value.extract().map_err(|_| wrong_type(name, problem))
}

/// A path: text or an `os.PathLike`.
pub fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let problem = |_| wrong_type(name, format!("expected a path, got {}", type_of(value)));
    value.extract().map_err(problem)
}

/// A recording: a path, or an address, of which what is secret is put aside.
pub fn recording(path: PathBuf) -> PathBuf {
    path.to_str().map(put_secrets_aside).unwrap_or(path)
}

/// A path, or several.
pub fn paths(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<PathBuf>> {
    match value.extract::<PathBuf>() {
        Ok(one) => Ok(vec![one]),
        Err(_) => value
            .try_iter()
            .map_err(|_| wrong_type(name, format!("expected paths, got {}", type_of(value))))?
            .map(|one| path(name, &one?))
            .collect(),
    }
}

/// Names of things: a text, or several.
pub fn names(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    if value.cast::<PyString>().is_ok() {
        return Ok(vec![text(name, value)?]);
    }
    let several = value.try_iter().map_err(|_| {
        wrong_type(name, format!("expected str or several, got {}", type_of(value)))
    })?;
    several.map(|one| text(name, &one?)).collect()
}
