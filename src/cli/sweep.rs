//! `divmerge sweep`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use clap::error::ErrorKind;
use serde::Serialize;

use crate::cli::arguments::method::PRESETS;
use crate::cli::arguments::objects::ObjectArguments;
use crate::cli::arguments::parameters::ParameterArguments;
use crate::cli::arguments::truth::TruthArguments;
use crate::cli::arguments::values::{number, one_of};
use crate::cli::exit::{Outcome, WrongUsage};
use crate::cli::output::{Outputs, chart_or_table};
use crate::cli::progress::frame_bar;
use crate::cli::table::{measurements, write_measurements};
use crate::cli::text::counted;
use crate::comparison::{MethodScores, measure};
use crate::parameters::{ParameterKind, ParameterSet, registry};
use crate::pipeline::Preset;
use crate::view::{Line, LineChart};

/// Measure quality and time over a parameter
///
/// Runs presets of divide and merge on clouds with truth for each value of one parameter. The
/// default is the paper's trade-off figure: panoptic quality and time over the voxel size. Quality
/// as in `divmerge compare`; times are medians over the clouds on one thread of this machine.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    truth: TruthArguments,

    #[command(flatten)]
    objects: ObjectArguments,

    /// The parameter: voxel (metres), angle (degrees), gap-columns, gap-rows, merge-ratio,
    /// min-points, or the path of any number (`divmerge params`), in its own unit
    #[arg(long, default_value = "voxel", value_name = "PARAMETER", value_parser = swept)]
    over: SweptParameter,

    /// Its values [default: a range around the presets' for those with short names]
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = number)]
    values: Vec<f64>,

    /// Presets to start from
    #[arg(
        long,
        value_parser = one_of(PRESETS),
        value_delimiter = ',',
        value_name = "LIST",
        default_value = "paper,authors,best"
    )]
    presets: Vec<Preset>,

    #[command(flatten)]
    parameters: ParameterArguments,

    /// Write charts (.svg, .pdf or .png), the table (.csv or .md) or all measurements (.json); may
    /// be repeated
    #[arg(short, long, value_name = "OUT", value_parser = chart_or_table)]
    output: Vec<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// A parameter with values around the presets'.
#[derive(Clone, Copy)]
struct Usual {
    /// Its name at the command line, beside its path.
    name: &'static str,
    path: &'static str,
    values: &'static [f64],
    /// Its name on an axis.
    axis: &'static str,
    is_log: bool,
    /// Ends a value, as a unit.
    unit: &'static str,
}

const USUAL: &[Usual] = &[
    Usual {
        name: "voxel",
        path: "cluster.voxel",
        values: &[2.0, 1.0, 0.5, 0.2, 0.1],
        axis: "voxel size, m",
        is_log: true,
        unit: "",
    },
    Usual {
        name: "angle",
        path: "cluster.condition.angle",
        values: &[2.0, 5.0, 8.6, 10.0, 15.0, 20.0],
        axis: "minimum angle beta, degrees",
        is_log: false,
        unit: "deg",
    },
    Usual {
        name: "gap-columns",
        path: "cluster.gap_columns",
        values: &[1.0, 2.0, 3.0, 5.0, 10.0],
        axis: "maximum column distance",
        is_log: true,
        unit: "",
    },
    Usual {
        name: "gap-rows",
        path: "cluster.gap_rows",
        values: &[1.0, 2.0, 3.0, 5.0, 10.0],
        axis: "maximum row distance",
        is_log: true,
        unit: "",
    },
    Usual {
        name: "merge-ratio",
        path: "cluster.merge_ratio",
        values: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9],
        axis: "vote share to merge",
        is_log: false,
        unit: "",
    },
    Usual {
        name: "min-points",
        path: "cluster.min_pixels",
        values: &[0.0, 5.0, 10.0, 20.0, 30.0, 50.0],
        axis: "minimum pixels of an instance",
        is_log: false,
        unit: "",
    },
];

/// The parameter to change.
#[derive(Debug, Clone, PartialEq)]
struct SweptParameter {
    path: String,
    /// Values around the presets'; none for most.
    values: &'static [f64],
    axis: String,
    is_log: bool,
    unit: &'static str,
}

/// Reads a short name, or the path of a number.
fn swept(text: &str) -> Result<SweptParameter, String> {
    if let Some(usual) = USUAL.iter().find(|usual| usual.name == text) {
        let Usual { path, values, axis, is_log, unit, .. } = *usual;
        let (path, axis) = (path.to_owned(), axis.to_owned());
        return Ok(SweptParameter { path, values, axis, is_log, unit });
    }
    let all = ParameterSet::with_all_parts();
    all.get(text).map_err(|error| error.to_string())?;
    let parameter = registry().iter().find(|parameter| parameter.path == text);
    match parameter.map(|parameter| (&parameter.kind, &parameter.unit)) {
        Some((ParameterKind::Number { .. } | ParameterKind::Whole { .. }, unit)) => {
            let unit = unit.as_ref().map_or(String::new(), |unit| format!(", {unit}"));
            let (path, axis) = (text.to_owned(), format!("{text}{unit}"));
            Ok(SweptParameter { path, values: &[], axis, is_log: false, unit: "" })
        }
        _ => Err("takes no numbers".to_owned()),
    }
}

impl SweptParameter {
    /// Its name at the head of a column.
    fn head(&self) -> String {
        let name = self.path.rsplit('.').next().unwrap_or(&self.path);
        if self.unit.is_empty() { name.to_owned() } else { format!("{name}, degrees") }
    }

    fn set(&self, parameters: &mut ParameterSet, value: f64) -> Result<(), WrongUsage> {
        let text = format!("{value}{}", self.unit);
        parameters.set(&self.path, &text.into()).map_err(|error| {
            WrongUsage(ErrorKind::ValueValidation, format!("--values {value}: {error}"))
        })
    }
}

/// A row of the table.
#[derive(Serialize)]
struct Row {
    preset: &'static str,
    value: f64,
    #[serde(flatten)]
    measured: MethodScores,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let inputs = arguments.truth.clouds.files().chain(arguments.objects.files());
    let inputs = inputs.chain(arguments.parameters.files());
    let outputs = Outputs::new(inputs, arguments.force).files(&arguments.output)?;
    let values = match (arguments.values.as_slice(), arguments.over.values) {
        ([], []) => {
            let problem = format!("--over {} needs --values", arguments.over.path);
            return Err(WrongUsage(ErrorKind::MissingRequiredArgument, problem).into());
        }
        ([], usual) => usual,
        (values, _) => values,
    };
    let mut sets = Vec::new();
    for &preset in &arguments.presets {
        let usual = arguments.parameters.of_preset(preset)?;
        for &value in values {
            let mut parameters = usual.clone();
            arguments.over.set(&mut parameters, value)?;
            sets.push((value, parameters));
        }
    }
    let mut method = arguments.objects.config(&arguments.truth.clouds.input)?;
    let frames = arguments.truth.clouds.open(&method)?.remaining();
    let bar = frame_bar("sweeping", frames * sets.len() as u64);
    let mut rows = Vec::with_capacity(sets.len());
    for (value, parameters) in sets {
        let preset = parameters.preset;
        method = method.with_parameters(&parameters);
        let frames = arguments.truth.clouds.open(&method)?;
        let measured = measure(frames, &method, arguments.truth.min_points, || bar.inc(1));
        let measured = measured.map_err(|error| arguments.truth.clouds.with_hint(error))?;
        rows.push(Row { preset, value, measured });
    }
    bar.finish_and_clear();
    let head = arguments.over.head();
    let head = ["preset", head.as_str()];
    let cells = rows.iter().map(|row| vec![row.preset.to_owned(), row.value.to_string()]);
    let table = measurements(&head, cells.zip(rows.iter().map(|row| &row.measured)));
    print!("{}", table.markdown());
    let charts = || charts(&arguments.over, &rows);
    write_measurements(&outputs, &rows, &table, charts)?;
    Ok(Outcome::Done)
}

/// A title, and quality and time over the parameter.
fn charts(over: &SweptParameter, rows: &[Row]) -> (String, Vec<LineChart>) {
    let SweptParameter { axis: x_name, is_log, .. } = over;
    let mut x_ticks: Vec<f64> = rows.iter().map(|row| row.value).collect();
    x_ticks.sort_by(f64::total_cmp);
    x_ticks.dedup();
    let chart = |title: &str, y_name: &str, figure: &dyn Fn(&MethodScores) -> Option<f64>| {
        let line = |rows: &[Row]| {
            let mut points: Vec<[f64; 2]> =
                rows.iter().filter_map(|row| Some([row.value, figure(&row.measured)?])).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            Line { name: rows[0].preset.to_owned(), points }
        };
        LineChart {
            title: title.into(),
            x_name: x_name.clone(),
            y_name: y_name.into(),
            is_log: *is_log && x_ticks.iter().all(|&tick| tick > 0.0),
            x_ticks: x_ticks.clone(),
            lines: rows.chunk_by(|a, b| a.preset == b.preset).map(line).collect(),
        }
    };
    let quality = chart("Quality", "mean PQ of things, %", &|m| m.things.map(|t| t.pq * 100.0));
    let over = chart("Over-segmentation", "entropy, nats per cloud", &|m| Some(m.over.0));
    let time = chart("Time", "ms from object mask to instances, median", &|m| Some(m.cut_ms));
    let sees_classes = rows.iter().any(|row| row.measured.things.is_some());
    let charts = vec![if sees_classes { quality } else { over }, time];
    let clouds = rows.first().map_or(0, |row| row.measured.frames);
    let clouds = counted(clouds as u64, "cloud");
    (format!("Divide and merge over the {x_name} ({clouds})"), charts)
}
