//! `divmerge compare`

use std::path::PathBuf;
use std::process::Stdio;

use anyhow::{Context, Result, bail};
use clap::Args;
use clap::error::ErrorKind;
use serde::{Deserialize, Serialize};

use crate::annotate::AnnotateConfig;
use crate::cli::arguments::boxes::BoxArguments;
use crate::cli::arguments::objects::ObjectArguments;
use crate::cli::arguments::parameters::{ContenderParameterArguments, changes};
use crate::cli::arguments::truth::TruthArguments;
use crate::cli::arguments::values::positive;
use crate::cli::exit::{NotThere, Outcome, WRONG_USAGE, WrongUsage};
use crate::cli::invocation;
use crate::cli::output::{Outputs, chart_or_table};
use crate::cli::progress::frame_bar;
use crate::cli::table::{measurements, write_measurements};
use crate::cli::terminal;
use crate::cli::text::{counted, peak_memory};
use crate::comparison::methods::BOXES;
use crate::comparison::{Contender, MethodScores, USUAL_CONTENDERS, check_settings, measure};
use crate::view::{Line, LineChart};

/// Compare methods on clouds with truth
///
/// All methods cluster the same objects of the same clouds, with the same projection and
/// back-projection; preset `authors` projects as its source code does. Quality is panoptic quality
/// by semantic-kitti-api's rules, as the mean over the classes with at least 50 points of truth;
/// over- and under-segmentation entropy over the true things, in nats per cloud (lower is better);
/// time in milliseconds, as the median over the clouds on one thread of this machine; memory is the
/// peak of a process that runs this method alone.
///
/// The methods other than divide and merge are implemented here from their papers; the times are
/// those of these implementations.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    truth: TruthArguments,

    #[command(flatten)]
    objects: ObjectArguments,

    /// Presets of divide and merge (best, paper, authors) and other methods
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "LIST",
        value_parser = str::parse::<Contender>,
        default_value = USUAL_CONTENDERS
    )]
    methods: Vec<Contender>,

    #[command(flatten)]
    boxes: BoxArguments,

    /// Also preset `paper` with these voxel sizes in metres, such as 2,1,0.5,0.2,0.1
    #[arg(long, value_delimiter = ',', value_name = "M,...", value_parser = positive)]
    voxels: Vec<f64>,

    #[command(flatten)]
    parameters: ContenderParameterArguments,

    /// Write a chart (.svg, .pdf or .png), the table (.csv or .md) or all measurements (.json); may
    /// be repeated
    #[arg(short, long, value_name = "OUT", value_parser = chart_or_table)]
    output: Vec<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,

    /// Measure one contender, by its number, and print JSON: each is measured in its own process
    #[arg(long, hide = true)]
    one: Option<usize>,
}

/// A row of the table.
#[derive(Serialize, Deserialize)]
struct Row {
    method: String,
    #[serde(flatten)]
    measured: MethodScores,
    /// Peak memory of the process in bytes, where the system reports it.
    peak_memory: Option<u64>,
}

impl Row {
    fn peak_mebibytes(&self) -> String {
        let mebibytes = |bytes: u64| format!("{:.0}", bytes as f64 / f64::from(1 << 20));
        self.peak_memory.map_or("-".into(), mebibytes)
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let voxels = arguments.voxels.iter().map(|&side| Contender::Voxel(side));
    let contenders: Vec<Contender> = arguments.methods.iter().copied().chain(voxels).collect();
    if let Some(place) = arguments.one {
        let contender = *contenders.get(place).context("--one beyond the methods")?;
        println!("{}", serde_json::to_string(&measure_here(arguments, contender)?)?);
        return Ok(Outcome::Done);
    }
    arguments.boxes.source(contenders.contains(&Contender::Method(BOXES)))?;
    check_settings(&contenders, &arguments.parameters.set, &AnnotateConfig::default())
        .map_err(|error| WrongUsage(ErrorKind::ValueValidation, format!("--set: {error}")))?;
    let inputs = arguments.truth.clouds.files().chain(arguments.objects.files());
    let outputs = Outputs::new(inputs.chain(arguments.boxes.files()), arguments.force)
        .files(&arguments.output)?;
    let rows = (0..contenders.len()).map(measure_apart).collect::<Result<Vec<Row>>>()?;
    let cells = rows.iter().map(|row| vec![row.method.clone()]);
    let mut table = measurements(&["method"], cells.zip(rows.iter().map(|row| &row.measured)));
    let peaks: Vec<String> = rows.iter().map(Row::peak_mebibytes).collect();
    // A column in which all methods are alike says nothing.
    if rows.len() == 1 || peaks.iter().any(|peak| *peak != peaks[0]) {
        table.push_column("MiB", peaks.into_iter());
    }
    print!("{}", table.markdown());
    let clouds = rows.first().map_or(0, |row| row.measured.frames);
    let title =
        format!("{} on {}", counted(rows.len() as u64, "method"), counted(clouds as u64, "cloud"));
    let charts = || (title.clone(), charts(&rows));
    write_measurements(&outputs, &rows, &table, charts)?;
    Ok(Outcome::Done)
}

fn measure_here(arguments: &Arguments, contender: Contender) -> Result<Row> {
    let objects = arguments.objects.config(&arguments.truth.clouds.input)?;
    let mut method = contender.with_settings(&objects, &arguments.parameters.set)?;
    if terminal::is_verbose() {
        let changed = changes(&method.parameters());
        changed.iter().for_each(|change| eprintln!("{}: {change}", contender.name()));
    }
    if contender == Contender::Method(BOXES) {
        let (source, taxonomy) = (arguments.boxes.source(true)?, &method.taxonomy);
        method.boxes =
            BoxArguments::open(source.as_ref(), &arguments.truth.clouds.input, taxonomy)?;
        let mut parameters = method.parameters();
        arguments.boxes.set(&mut parameters)?;
        method = method.with_parameters(&parameters);
    }
    let frames = arguments.truth.clouds.open(&method)?;
    let bar = frame_bar(&contender.name(), frames.remaining());
    let measured = measure(frames, &method, arguments.truth.min_points, || bar.inc(1));
    let measured = measured.map_err(|error| arguments.truth.clouds.with_hint(error))?;
    bar.finish_and_clear();
    Ok(Row { method: contender.name(), measured, peak_memory: peak_memory() })
}

/// Runs this program again for one contender, so that none shares memory or caches with another.
fn measure_apart(place: usize) -> Result<Row> {
    let mut again = invocation::again()?;
    again.arg("--one").arg(place.to_string());
    let output = again.stdout(Stdio::piped()).stderr(Stdio::inherit()).output()?;
    if output.status.code() == Some(i32::from(WRONG_USAGE)) {
        return Err(NotThere("nothing was compared".to_owned()).into());
    }
    if !output.status.success() {
        bail!("nothing was compared");
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// Quality over time, and the two entropies. `paper` with other voxel sizes is one line.
fn charts(rows: &[Row]) -> Vec<LineChart> {
    let lines = |point: &dyn Fn(&MethodScores) -> Option<[f64; 2]>| -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        for row in rows {
            let name = row.method.split(", ").next().unwrap_or_default().to_owned();
            let point = point(&row.measured);
            let is_voxel = row.method.contains(", ");
            match lines.iter_mut().find(|line| line.name == format!("{name}, by voxel")) {
                Some(line) if is_voxel => line.points.extend(point),
                _ => {
                    let name = if is_voxel { format!("{name}, by voxel") } else { name };
                    lines.push(Line { name, points: point.into_iter().collect() });
                }
            }
        }
        lines
    };
    let quality = LineChart {
        title: "Quality and time".into(),
        x_name: "ms from object mask to instances, median".into(),
        y_name: "mean PQ of things, %".into(),
        is_log: true,
        lines: lines(&|m| m.things.map(|things| [m.cut_ms, things.pq * 100.0])),
        ..LineChart::default()
    };
    let entropies = LineChart {
        title: "Over- and under-segmentation".into(),
        x_name: "over-segmentation entropy, nats per cloud".into(),
        y_name: "under-segmentation entropy, nats per cloud".into(),
        lines: lines(&|m| Some([m.over.0, m.under.0])),
        ..LineChart::default()
    };
    let has_quality = rows.iter().any(|row| row.measured.things.is_some());
    if has_quality { vec![quality, entropies] } else { vec![entropies] }
}
