//! `divmerge sweep`

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use divmerge::comparison::{MethodScores, measure};
use divmerge::pipeline::Config;
use divmerge::view::{Line, LineChart, line_charts};
use serde::Serialize;

use crate::Outcome;
use crate::arguments::{Preset, number};
use crate::objects::ObjectArguments;
use crate::table::{extension, output, table, write_json};
use crate::terminal::frame_bar;
use crate::truth::{TruthArguments, with_hint};

/// Draw quality and time over a parameter
///
/// Runs presets of divide and merge on clouds with truth for each value of one parameter. As it stands it is the
/// paper's trade-off figure: panoptic quality and milliseconds over the side of the voxels. Quality as in
/// `divmerge compare`; times are medians over the clouds on this machine, one thread.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    truth: TruthArguments,

    #[command(flatten)]
    objects: ObjectArguments,

    /// The parameter
    #[arg(long, value_enum, default_value_t = Parameter::Voxel, value_name = "PARAMETER")]
    over: Parameter,

    /// Its values [default: some around the presets']
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = number)]
    values: Vec<f64>,

    /// Presets to start from
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "LIST",
        default_value = "paper,authors,best"
    )]
    presets: Vec<Preset>,

    /// Write the result here: charts as .svg or .png, the table as .csv or .md, everything as .json; may be given
    /// again
    #[arg(short, long, value_name = "OUT", value_parser = output)]
    output: Vec<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// What is changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Parameter {
    /// Side of a voxel of the divide step, metres
    Voxel,
    /// Least angle beta between neighbours of one object, degrees
    Angle,
    /// Most columns from a pixel to its neighbour
    GapColumns,
    /// Most rows from a pixel to its neighbour
    GapRows,
    /// Two components merge where their share of votes in favour exceeds this
    MergeRatio,
    /// Instances seen in fewer pixels are dropped
    MinPoints,
}

impl Parameter {
    /// Values around the presets', what they are called on an axis, and whether they are spread by factors.
    fn usual(self) -> (&'static [f64], &'static str, bool) {
        match self {
            Parameter::Voxel => (&[2.0, 1.0, 0.5, 0.2, 0.1], "side of a voxel, m", true),
            Parameter::Angle => {
                (&[2.0, 5.0, 8.6, 10.0, 15.0, 20.0], "least angle beta, degrees", false)
            }
            Parameter::GapColumns => {
                (&[1.0, 2.0, 3.0, 5.0, 10.0], "columns to a neighbour, at most", true)
            }
            Parameter::GapRows => {
                (&[1.0, 2.0, 3.0, 5.0, 10.0], "rows to a neighbour, at most", true)
            }
            Parameter::MergeRatio => (
                &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9],
                "share of votes that merges",
                false,
            ),
            Parameter::MinPoints => {
                (&[0.0, 5.0, 10.0, 20.0, 30.0, 50.0], "pixels of an instance, at least", false)
            }
        }
    }

    fn set(self, config: &mut Config, value: f64) -> Result<()> {
        let whole = |least: f64| match value >= least && value.fract() == 0.0 {
            true => Ok(value as usize),
            false => bail!("--values {value}: must be whole numbers from {least} on"),
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
    for output in &arguments.output {
        crate::refuse_existing(output, arguments.force)?;
    }
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
    let mut method = arguments.objects.method(&arguments.truth.clouds.input)?;
    let frames = arguments.truth.open(&method)?.remaining();
    let bar = frame_bar("sweeping", frames * configs.len() as u64);
    let mut rows = Vec::with_capacity(configs.len());
    for (value, config) in configs {
        let preset = config.preset;
        method.config = config;
        let frames = arguments.truth.open(&method)?;
        let measured = measure(frames, &method, arguments.truth.min_points, || bar.inc(1));
        let measured = measured.map_err(with_hint)?;
        rows.push(Row { preset, value, measured });
    }
    bar.finish_and_clear();
    let head = ["preset", arguments.over.usual().1];
    let cells = rows.iter().map(|row| vec![row.preset.to_owned(), row.value.to_string()]);
    let table = table(&head, cells.zip(rows.iter().map(|row| &row.measured)));
    print!("{}", table.markdown());
    for output in &arguments.output {
        match extension(output).as_str() {
            "json" => write_json(output, &rows, arguments.force)?,
            "csv" | "md" => table.write(output, arguments.force)?,
            _ => draw(arguments, &rows, output)?,
        }
        println!("wrote {}", output.display());
    }
    Ok(Outcome::Done)
}

fn draw(arguments: &Arguments, rows: &[Row], output: &Path) -> Result<()> {
    const DPI: f64 = 192.0;
    let (_, x_name, is_log) = arguments.over.usual();
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
    let charts = [if sees_classes { quality } else { over }, time];
    let clouds = rows.first().map_or(0, |row| row.measured.frames);
    let title = format!("Divide and merge over the {x_name} ({clouds} clouds)");
    crate::figure::write(output, &line_charts(&title, &charts), DPI, arguments.force)?;
    Ok(())
}
