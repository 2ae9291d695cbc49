//! `divmerge compare`

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use divmerge::Taxonomy;
use divmerge::comparison::{MethodScores, measure};
use divmerge::pipeline::Config;
use divmerge::view::{Line, LineChart, line_charts};
use serde::{Deserialize, Serialize};

use crate::Outcome;
use crate::arguments::{Cutter, Preset, positive};
use crate::boxes::BoxArguments;
use crate::objects::ObjectArguments;
use crate::table::{extension, output, table, write_json};
use crate::terminal::frame_bar;
use crate::truth::{TruthArguments, with_hint};

/// Compare methods on clouds with truth
///
/// Every method cuts the same objects of the same clouds, with the same projection and back-projection, so that only the
/// clustering differs; preset `authors` projects as its source does. Panoptic quality by semantic-kitti-api's
/// rules, as means over the classes that truth has with 50 points or more; over- and under-segmentation entropy over the
/// true things, in nats per cloud, less is better; milliseconds are medians over the clouds on this machine, one
/// thread; memory is the peak of a process that runs the method alone.
///
/// The methods other than divide and merge are written here from their papers; their speed is that of these
/// versions.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    truth: TruthArguments,

    #[command(flatten)]
    objects: ObjectArguments,

    /// Which ones: presets of divide and merge (best, paper, authors) and other methods
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "LIST",
        value_parser = contender,
        default_value = "best,paper,authors,alpine,euclidean,dbscan,scan-line-run,depth-clustering,supervoxel,one-per-class"
    )]
    methods: Vec<Contender>,

    #[command(flatten)]
    boxes: BoxArguments,

    /// Beside them preset `paper` with voxels of these sides in metres, such as 2,1,0.5,0.2,0.1
    #[arg(long, value_delimiter = ',', value_name = "M,...", value_parser = positive)]
    voxels: Vec<f64>,

    /// Write the result here: a chart as .svg or .png, the table as .csv or .md, everything as .json; may be given
    /// again
    #[arg(short, long, value_name = "OUT", value_parser = output)]
    output: Vec<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,

    /// Measure only this one, by its place, and print JSON: how the command measures each in a process of its own.
    #[arg(long, hide = true)]
    one: Option<usize>,
}

/// One that takes part.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Contender {
    Preset(Preset),
    Voxel(f64),
    Other(Cutter),
}

impl Contender {
    fn name(self) -> String {
        let of_value = |value: &dyn Fn() -> Option<clap::builder::PossibleValue>| {
            value().map_or(String::new(), |value| value.get_name().to_owned())
        };
        match self {
            Contender::Preset(preset) => of_value(&|| preset.to_possible_value()),
            Contender::Voxel(side) => format!("paper, {side} m"),
            Contender::Other(cutter) => of_value(&|| cutter.to_possible_value()),
        }
    }

    fn config(self, taxonomy: &Taxonomy) -> Config {
        match self {
            Contender::Preset(preset) => preset.config(),
            Contender::Voxel(side) => {
                let mut config = Config::paper();
                config.cluster.voxel = side;
                config
            }
            Contender::Other(cutter) => {
                Config { baseline: cutter.baseline(taxonomy), ..Config::best() }
            }
        }
    }
}

/// A row of the table.
#[derive(Serialize, Deserialize)]
struct Row {
    method: String,
    #[serde(flatten)]
    measured: MethodScores,
    /// Peak of the process in bytes, where the system tells.
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
    arguments.boxes.source(contenders.contains(&Contender::Other(Cutter::Boxes)));
    for output in &arguments.output {
        crate::refuse_existing(output, arguments.force)?;
    }
    let mut rows = Vec::with_capacity(contenders.len());
    for place in 0..contenders.len() {
        rows.push(measure_apart(place)?);
    }
    let cells = rows.iter().map(|row| vec![row.method.clone()]);
    let mut table = table(&["method"], cells.zip(rows.iter().map(|row| &row.measured)));
    table.push_column("peak, MiB", rows.iter().map(Row::peak_mebibytes));
    print!("{}", table.markdown());
    for output in &arguments.output {
        match extension(output).as_str() {
            "json" => write_json(output, &rows, arguments.force)?,
            "csv" | "md" => table.write(output, arguments.force)?,
            _ => draw(&rows, output, arguments.force)?,
        }
        println!("wrote {}", output.display());
    }
    Ok(Outcome::Done)
}

fn draw(rows: &[Row], output: &Path, force: bool) -> Result<()> {
    const DPI: f64 = 192.0;
    let frames = rows.first().map_or(0, |row| row.measured.frames);
    let title = format!("{} methods on {frames} clouds", rows.len());
    crate::figure::write(output, &line_charts(&title, &charts(rows)), DPI, force)?;
    Ok(())
}

fn measure_here(arguments: &Arguments, contender: Contender) -> Result<Row> {
    let mut method = arguments.objects.method(&arguments.truth.clouds.input)?;
    method.config = contender.config(&method.taxonomy);
    if contender == Contender::Other(Cutter::Boxes) {
        let (source, taxonomy) = (arguments.boxes.source(true), &method.taxonomy);
        method.boxes =
            BoxArguments::open(source.as_ref(), &arguments.truth.clouds.input, taxonomy)?;
        arguments.boxes.set(&mut method.config);
    }
    let frames = arguments.truth.open(&method)?;
    let bar = frame_bar(&contender.name(), frames.remaining());
    let measured = measure(frames, &method, arguments.truth.min_points, || bar.inc(1));
    let measured = measured.map_err(with_hint)?;
    bar.finish_and_clear();
    Ok(Row { method: contender.name(), measured, peak_memory: peak_memory() })
}

/// Runs this program again for one of the methods, so that none has the memory or the caches of another.
fn measure_apart(place: usize) -> Result<Row> {
    let mut again = Command::new(std::env::current_exe()?);
    again.args(std::env::args_os().skip(1)).arg("--one").arg(place.to_string());
    let output = again.stdout(Stdio::piped()).stderr(Stdio::inherit()).output()?;
    if !output.status.success() {
        bail!("nothing compared");
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// The greatest resident size of this process so far, where the system tells (Linux).
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

/// Quality over time, and the two entropies; `paper` with other voxels is a line.
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

fn contender(text: &str) -> Result<Contender, String> {
    if let Ok(preset) = Preset::from_str(text, false) {
        return Ok(Contender::Preset(preset));
    }
    match Cutter::from_str(text, false) {
        Ok(Cutter::DivideAndMerge) => Ok(Contender::Preset(Preset::Best)),
        Ok(cutter) => Ok(Contender::Other(cutter)),
        Err(_) => {
            let presets = Preset::value_variants().iter().filter_map(ValueEnum::to_possible_value);
            let cutters = Cutter::value_variants().iter().filter_map(ValueEnum::to_possible_value);
            let names: Vec<String> =
                presets.chain(cutters).map(|value| value.get_name().to_owned()).collect();
            Err(format!("use some of {}", names.join(", ")))
        }
    }
}
