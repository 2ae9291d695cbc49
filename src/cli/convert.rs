//! `divmerge convert`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};

use crate::Error;
use crate::annotate::time_spec::since_1970;
use crate::cli::arguments::objects::taxonomy;
use crate::cli::arguments::values::{COMPRESSIONS, one_of, positive};
use crate::cli::dry_run::{DryRun, DryRunArgument};
use crate::cli::exit::Outcome;
use crate::cli::interrupt;
use crate::cli::output::{OutputFile, Outputs, make_folder};
use crate::cli::progress::frame_bar;
use crate::cli::text::{counted, listed};
use crate::datasets::scans::{Columns, FolderOptions, ScanFolder, StampSource, WriteSummary};
use crate::datasets::semantic_kitti::sequence::{
    CLOUD_TOPIC, Sequence, SequenceOptions, sequences,
};
use crate::recording::{Compression, WriteOptions};

/// Convert scans in files to a recording
///
/// Writes a ROS 2 recording (MCAP). All files are checked first: if any are missing, superfluous,
/// too short or unreadable, each is named and nothing is written.
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    source: Source,
}

#[derive(Subcommand)]
enum Source {
    #[command(name = "semantickitti")]
    SemanticKitti(SemanticKitti),
    Folder(Folder),
}

/// Convert sequences of SemanticKITTI or KITTI odometry
///
/// Clouds (x y z intensity, FLOAT32) are written to /velodyne_points; --labels adds label and
/// true_instance (UINT16), --predictions predicted_label and predicted_instance. Stamps, log and
/// publish times are those of times.txt after --start; without times.txt, ten scans per second.
/// poses.txt and Tr of calib.txt become /tf (the scanner in map, the scanner's frame at the first
/// scan) and /tf_static (camera_0 on the scanner); P0 to P3 become /camera_N/camera_info;
/// calib.txt is attached. Missing files are reported.
#[derive(Args)]
#[command(after_long_help = "\
Examples:\n\
\x20 divmerge convert semantickitti dataset -o 04.mcap --sequence 04 --labels\n\
\x20 divmerge convert semantickitti dataset/sequences/04 -o 04.mcap\n\
\x20 divmerge convert semantickitti dataset -o recordings/ --labels   (00.mcap, 01.mcap, ...)\n\
\x20 divmerge convert semantickitti dataset -o test/ --sequence 11,12 --predictions network")]
struct SemanticKitti {
    /// The folder with sequences/NN/velodyne, or the folder of one sequence
    root: PathBuf,

    /// The recording to write; for several sequences a folder for NN.mcap of each
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Only these sequences, such as 00,04 [default: all]
    #[arg(long = "sequence", value_delimiter = ',', value_name = "NN,...")]
    sequences: Vec<String>,

    /// Add the truth from sequences/NN/labels
    #[arg(long)]
    labels: bool,

    /// Add another method's labels from sequences/NN/predictions (or labels) below this folder
    #[arg(long, value_name = "ROOT")]
    predictions: Option<PathBuf>,

    /// Classes of the labels: a YAML file in semantic-kitti-api's form [default: SemanticKITTI]
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,

    #[command(flatten)]
    writing: Writing,
}

/// Convert a folder of .bin, .pcd or .npy files, one for each cloud
///
/// Files are sorted by name, numbers by value (2 before 10). Fields, types and rows are kept: .pcd
/// of any encoding (ascii, binary, binary_compressed); .npy of N x C or H x W x C numbers or of
/// named records; .bin of float32 columns, named by --columns.
///
/// If all names are times since 1970 (seconds, milli-, micro- or nanoseconds, by their number of
/// digits), these are the stamps; else scans are evenly spaced.
#[derive(Args)]
#[command(after_long_help = "\
Examples:\n\
\x20 divmerge convert folder scans -o scans.mcap\n\
\x20 divmerge convert folder nuscenes/sweeps/LIDAR_TOP -o sweeps.mcap \\\n\
\x20     --columns x,y,z,intensity,ring --rate 20\n\
\x20 divmerge convert folder velodyne -o labelled.mcap --labels labels")]
struct Folder {
    /// The folder; hidden files are skipped
    folder: PathBuf,

    /// The recording to write
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Scans per second, whatever the file names [default: times from the names, else 10]
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,

    /// Topic of the clouds
    #[arg(long, value_name = "T", default_value = "/points")]
    topic: String,

    /// Coordinate frame of the clouds
    #[arg(long, value_name = "NAME", default_value = "lidar")]
    frame_id: String,

    /// Names of the columns of .bin files and plain .npy arrays; _ skips a column [default:
    /// x,y,z,intensity; further columns of an array: column_5, ...]
    #[arg(long, visible_alias = "fields", value_name = "NAME,...")]
    columns: Option<Columns>,

    /// Folder of .label files named as the scans; adds the fields label and true_instance
    #[arg(long, value_name = "DIR")]
    labels: Option<PathBuf>,

    #[command(flatten)]
    writing: Writing,
}

#[derive(Args)]
struct Writing {
    /// Start time in seconds since 1970, if only times from the start are known [default:
    /// 946684800, 1 January 2000]
    #[arg(long, value_name = "SECONDS", value_parser = since_1970)]
    start: Option<u64>,

    /// Compression of the recording
    #[arg(long, default_value = "zstd", value_parser = one_of(COMPRESSIONS))]
    compression: Compression,

    #[command(flatten)]
    dry_run: DryRunArgument,

    /// Replace existing recordings
    #[arg(long)]
    force: bool,
}

impl Writing {
    fn options(&self) -> WriteOptions {
        let (compression, force) = (self.compression, self.force);
        WriteOptions { compression, force, ..WriteOptions::default() }
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    match &arguments.source {
        Source::SemanticKitti(arguments) => semantic_kitti(arguments),
        Source::Folder(arguments) => folder(arguments),
    }
}

fn semantic_kitti(arguments: &SemanticKitti) -> Result<Outcome> {
    let taxonomy = taxonomy(arguments.taxonomy.as_deref())?;
    let chosen = chosen(&arguments.root, &arguments.sequences)?;
    let outputs = outputs(arguments, &chosen)?;
    let sequences = opened(arguments, &chosen)?;
    if arguments.writing.dry_run.dry_run {
        for (sequence, output) in sequences.iter().zip(&outputs) {
            let scans = counted(sequence.len() as u64, "scan");
            let notes = sequence.notes.iter().map(|note| format!("\n  note: {note}"));
            let notes: String = notes.collect();
            let mut plan = DryRun::default();
            plan.line(format_args!("would read sequence {} ({scans}){notes}", sequence.name));
            plan.writes(format_args!("{}\n  {CLOUD_TOPIC}", output.path().display()));
            plan.print();
        }
        return Ok(Outcome::Done);
    }
    if outputs.iter().any(|output| output.path() != arguments.output) {
        make_folder(&arguments.output)?;
    }
    for (sequence, output) in sequences.iter().zip(&outputs) {
        for note in &sequence.notes {
            eprintln!("note: sequence {}: {note}", sequence.name);
        }
        let bar = frame_bar(&format!("sequence {}", sequence.name), sequence.len() as u64);
        let written =
            sequence.write(&taxonomy, output.path(), &arguments.writing.options(), || {
                bar.inc(1);
                interrupt::check()
            });
        bar.finish_and_clear();
        let written = written.context("nothing written")?;
        print(&written, output.path(), &format!("sequence {} on {CLOUD_TOPIC}", sequence.name));
    }
    Ok(Outcome::Done)
}

/// Names and folders of the requested sequences.
fn chosen(root: &Path, requested: &[String]) -> Result<Vec<(String, PathBuf)>> {
    let found = sequences(root)?;
    if requested.is_empty() {
        return Ok(found);
    }
    for name in requested {
        if !found.iter().any(|(other, _)| other == name) {
            let root = root.display();
            bail!("{root}: no sequence {name} with scans; sequences: {}", names(&found));
        }
    }
    Ok(found.into_iter().filter(|(name, _)| requested.contains(name)).collect())
}

fn names(sequences: &[(String, PathBuf)]) -> String {
    sequences.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The recording of each sequence: `output` itself, or NN.mcap in it if it is a folder.
fn outputs(arguments: &SemanticKitti, sequences: &[(String, PathBuf)]) -> Result<Vec<OutputFile>> {
    let SemanticKitti { root, output, predictions, taxonomy, writing, .. } = arguments;
    let inputs = [Some(root), predictions.as_ref(), taxonomy.as_ref()].into_iter().flatten();
    let mut outputs = Outputs::new(inputs.map(PathBuf::as_path), writing.force);
    let is_named_folder = output.as_os_str().as_encoded_bytes().ends_with(b"/");
    if !output.is_dir() && !is_named_folder {
        return match sequences {
            [_] => Ok(vec![outputs.recording(output)?]),
            several => bail!(
                "{} is one recording for the sequences {}: choose one with --sequence, or name a \
                 folder ({}/)",
                output.display(),
                names(several),
                output.with_extension("").display()
            ),
        };
    }
    let of_sequence = |(name, _): &(String, PathBuf)| {
        outputs.file_in_made_folder(&output.join(format!("{name}.mcap")))
    };
    Ok(sequences.iter().map(of_sequence).collect::<Result<_, _>>()?)
}

/// Opens and checks all sequences.
fn opened(arguments: &SemanticKitti, chosen: &[(String, PathBuf)]) -> Result<Vec<Sequence>> {
    let options = SequenceOptions {
        labels: arguments.labels,
        predictions: arguments.predictions.clone(),
        start_ns: arguments.writing.start,
    };
    let (mut sequences, mut problems) = (Vec::new(), Vec::new());
    for (name, folder) in chosen {
        match Sequence::open(name, folder, &options) {
            Ok(sequence) => sequences.push(sequence),
            Err(error @ Error::Folder { .. }) => problems.push(error.to_string()),
            Err(other) => return Err(other.into()),
        }
    }
    if !problems.is_empty() {
        bail!("nothing written: {}", problems.join("\n"));
    }
    Ok(sequences)
}

fn folder(arguments: &Folder) -> Result<Outcome> {
    let inputs = std::iter::once(&arguments.folder).chain(&arguments.labels);
    let inputs = inputs.map(PathBuf::as_path);
    let output = Outputs::new(inputs, arguments.writing.force).recording(&arguments.output)?;
    let options = FolderOptions {
        columns: arguments.columns.clone(),
        rate: arguments.rate,
        start_ns: arguments.writing.start,
        labels: arguments.labels.clone(),
    };
    let scans = ScanFolder::open(&arguments.folder, &options).context("nothing written")?;
    if !scans.left_aside.is_empty() {
        eprintln!("note: skipped: {}", listed(&scans.left_aside, 10));
    }
    let times = match scans.stamps {
        StampSource::Names => "times from the file names".to_owned(),
        StampSource::Rate(rate) => format!("{rate} per second"),
    };
    if arguments.writing.dry_run.dry_run {
        let mut plan = DryRun::default();
        plan.line(format_args!(
            "would read {} in {}, {times}",
            counted(scans.len() as u64, &format!("{} file", scans.format.ending())),
            arguments.folder.display()
        ));
        plan.writes(format_args!("{}\n  {}", output.path().display(), arguments.topic));
        plan.print();
        return Ok(Outcome::Done);
    }
    let bar = frame_bar("converting", scans.len() as u64);
    let (topic, frame_id) = (&arguments.topic, &arguments.frame_id);
    let options = arguments.writing.options();
    let written = scans.write(output.path(), topic, frame_id, &options, || {
        bar.inc(1);
        interrupt::check()
    });
    bar.finish_and_clear();
    let written = written.context("nothing written")?;
    print(&written, output.path(), &format!("{} files on {topic}, {times}", scans.format.ending()));
    Ok(Outcome::Done)
}

fn print(written: &WriteSummary, output: &Path, source: &str) {
    for left_out in &written.left_out {
        eprintln!("note: skipped: {left_out}");
    }
    println!(
        "wrote {} ({}, {} with {}, from {source})",
        output.display(),
        counted(written.bytes, "byte"),
        counted(written.clouds, "cloud"),
        counted(written.points, "point")
    );
    println!("    fields: {}", written.layout);
}
