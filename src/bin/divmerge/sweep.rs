//! `divmerge sweep`

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use divmerge::comparison::{MethodScores, measure};
use divmerge::pipeline::{Config, Preset};
use divmerge::view::{Line, LineChart};
use serde::Serialize;

use crate::arguments::method::PRESETS;
use crate::arguments::objects::ObjectArguments;
use crate::arguments::truth::TruthArguments;
use crate::arguments::values::{number, one_of};
use crate::exit::Outcome;
use crate::output::{Outputs, chart_or_table};
use crate::progress::frame_bar;
use crate::table::{measurements, write_measurements};
use crate::text::counted;

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

    /// The parameter
    #[arg(long, value_enum, default_value_t = Parameter::Voxel, value_name = "PARAMETER")]
    over: Parameter,

    /// Its values [default: a range around the presets']
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

    /// Write charts (.svg or .png), the table (.csv or .md) or all measurements (.json); may be
    /// repeated
    #[arg(short, long, value_name = "OUT", value_parser = chart_or_table)]
    output: Vec<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// The parameter to change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Parameter {
    /// Voxel size of the divide step, metres
    Voxel,
    /// Minimum angle beta between neighbouring pixels of one object, degrees
    Angle,
    /// Maximum column distance between neighbouring pixels
    GapColumns,
    /// Maximum row distance between neighbouring pixels
    GapRows,
    /// Share of votes in favour above which two components merge
    MergeRatio,
    /// Instances seen in fewer pixels are dropped
    MinPoints,
}

impl Parameter {
    /// Values around the presets', the name on an axis, and whether the axis is logarithmic.
    fn usual(self) -> (&'static [f64], &'static str, bool) {
        match self {
            Parameter::Voxel => (&[2.0, 1.0, 0.5, 0.2, 0.1], "voxel size, m", true),
            Parameter::Angle => {
                (&[2.0, 5.0, 8.6, 10.0, 15.0, 20.0], "minimum angle beta, degrees", false)
            }
            Parameter::GapColumns => (&[1.0, 2.0, 3.0, 5.0, 10.0], "maximum column distance", true),
            Parameter::GapRows => (&[1.0, 2.0, 3.0, 5.0, 10.0], "maximum row distance", true),
            Parameter::MergeRatio => {
                (&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9], "vote share to merge", false)
            }
            Parameter::MinPoints => {
                (&[0.0, 5.0, 10.0, 20.0, 30.0, 50.0], "minimum pixels of an instance", false)
            }
        }
    }

    fn set(self, config: &mut Config, value: f64) -> Result<()> {
        let whole = |least: f64| match value >= least && value.fract() == 0.0 {
            true => Ok(value as usize),
            false => bail!("--values {value}: must be a whole number from {least} on"),
        };
        let params = &mut config.cluster;
        match self {
            Parameter::Voxel if value > 0.0 => params.voxel = value,
            Parameter::Voxel => bail!("--values {value}: must be above 0"),
            Parameter::Angle if (0.0..90.0).contains(&value) => {
                params.condition.angle = value.to_radians();
            }
            Parameter::Angle => bail!("--values {value}: must be in 0..90"),
            Parameter::GapColumns => params.gap_columns = whole(1.0)?,
            Parameter::GapRows => params.gap_rows = whole(1.0)?,
            Parameter::MergeRatio if (0.0..=1.0).contains(&value) => params.merge_ratio = value,
            Parameter::MergeRatio => bail!("--values {value}: must be in 0..=1"),
            Parameter::MinPoints => params.min_pixels = whole(0.0)?,
        }
        Ok(())
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
    let outputs = Outputs::new(inputs, arguments.force).files(&arguments.output)?;
    let values = match arguments.values.as_slice() {
        [] => arguments.over.usual().0,
        values => values,
    };
    let mut configs = Vec::new();
    for preset in &arguments.presets {
        for &value in values {
            let mut config = preset.config();
            arguments.over.set(&mut config, value)?;
            configs.push((value, config));
        }
    }
    let mut method = arguments.objects.config(&arguments.truth.clouds.input)?;
    let frames = arguments.truth.clouds.open(&method)?.remaining();
    let bar = frame_bar("sweeping", frames * configs.len() as u64);
    let mut rows = Vec::with_capacity(configs.len());
    for (value, config) in configs {
        let preset = config.preset;
        method.pipeline = config;
        let frames = arguments.truth.clouds.open(&method)?;
        let measured = measure(frames, &method, arguments.truth.min_points, || bar.inc(1));
        let measured = measured.map_err(|error| arguments.truth.clouds.with_hint(error))?;
        rows.push(Row { preset, value, measured });
    }
    bar.finish_and_clear();
    let head = ["preset", arguments.over.usual().1];
    let cells = rows.iter().map(|row| vec![row.preset.to_owned(), row.value.to_string()]);
    let table = measurements(&head, cells.zip(rows.iter().map(|row| &row.measured)));
    print!("{}", table.markdown());
    let charts = || charts(arguments.over, &rows);
    write_measurements(&outputs, &rows, &table, charts)?;
    Ok(Outcome::Done)
}

/// A title, and quality and time over the parameter.
fn charts(over: Parameter, rows: &[Row]) -> (String, Vec<LineChart>) {
    let (_, x_name, is_log) = over.usual();
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
            x_name: x_name.into(),
            y_name: y_name.into(),
            is_log: is_log && x_ticks.iter().all(|&tick| tick > 0.0),
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
