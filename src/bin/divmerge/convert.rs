//! `divmerge convert`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use divmerge::io::WriteOptions;
use divmerge::io::scans::{Columns, FolderOptions, ScanFolder, Stamps, Written};
use divmerge::io::semantic_kitti::sequence::{CLOUD_TOPIC, Sequence, SequenceOptions, sequences};
use divmerge::{Error, Taxonomy};

use crate::annotate::Compress;
use crate::arguments::positive;
use crate::terminal::{frame_bar, grouped};
use crate::{Outcome, interrupt, refuse_existing};
use divmerge::annotate::moments::since_1970;

/// Make a recording of scans that are files
///
/// A ROS 2 recording (MCAP) that annotate, figure, explain, view and any ROS tool open. Everything is looked through
/// first: files that are missing, too many, too short or unreadable are each named, and then nothing is written.
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

/// Sequences of SemanticKITTI or KITTI odometry: clouds, poses, calibration, times, truth
///
/// Clouds (x y z intensity, FLOAT32) go to /velodyne_points; with --labels they also have label and true_instance
/// (UINT16), with --predictions predicted_label and predicted_instance. Stamps, log and publish times are those of
/// times.txt after --start; without times.txt scans are ten a second. poses.txt and the Tr of calib.txt give
/// /tf, the scanner in map, where map is the scanner's own frame at the first scan, and /tf_static, camera_0 on the
/// scanner; P0 to P3 give /camera_N/camera_info; calib.txt itself is attached. What is not there is said.
#[derive(Args)]
#[command(after_long_help = "\
Examples:\n\
\x20 divmerge convert semantickitti dataset -o 04.mcap --sequence 04 --labels\n\
\x20 divmerge convert semantickitti dataset/sequences/04 -o 04.mcap\n\
\x20 divmerge convert semantickitti dataset -o recordings/ --labels          (00.mcap, 01.mcap, ...)\n\
\x20 divmerge convert semantickitti dataset -o test/ --sequence 11,12 --predictions network")]
struct SemanticKitti {
    /// The folder that holds sequences/NN/velodyne, or a sequence's own folder
    root: PathBuf,

    /// The recording to write; for several sequences a folder, which gets NN.mcap for each
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Only these sequences, such as 00,04 [default: all]
    #[arg(long = "sequence", value_delimiter = ',', value_name = "NN,...")]
    sequences: Vec<String>,

    /// Take the truth from sequences/NN/labels too
    #[arg(long)]
    labels: bool,

    /// Take another method's labels from sequences/NN/predictions (or labels) below this folder too
    #[arg(long, value_name = "ROOT")]
    predictions: Option<PathBuf>,

    /// Classes that labels may have: a YAML file in semantic-kitti-api's form [default: SemanticKITTI's]
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,

    #[command(flatten)]
    writing: Writing,
}

/// A folder of .bin, .pcd or .npy files, a cloud each
///
/// Files are taken in the order of their names, numbers by their value (2 before 10). Fields, types and rows are kept
/// as they are: .pcd of any encoding (ascii, binary, binary_compressed); .npy of N x C or H x W x C numbers or of
/// named records; .bin of float32 columns, which --columns names.
///
/// If all names are times since 1970 (seconds, or milli-, micro- or nanoseconds by their number of digits), these are
/// the stamps; else scans are evenly spaced.
#[derive(Args)]
#[command(after_long_help = "\
Examples:\n\
\x20 divmerge convert folder scans -o scans.mcap\n\
\x20 divmerge convert folder nuscenes/sweeps/LIDAR_TOP -o sweeps.mcap --columns x,y,z,intensity,ring --rate 20\n\
\x20 divmerge convert folder velodyne -o labelled.mcap --labels labels")]
struct Folder {
    /// The folder; hidden files in it are passed over
    folder: PathBuf,

    /// The recording to write
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Scans a second, whatever the names of the files [default: times from the names, else 10]
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,

    /// Topic of the clouds
    #[arg(long, value_name = "T", default_value = "/points")]
    topic: String,

    /// Coordinate frame of the clouds
    #[arg(long, value_name = "NAME", default_value = "lidar")]
    frame_id: String,

    /// Names of the columns of .bin files and plain .npy arrays; _ leaves one out
    /// [default: x,y,z,intensity; further ones of an array: column_5, ...]
    #[arg(long, visible_alias = "fields", value_name = "NAME,...")]
    columns: Option<Columns>,

    /// Folder of .label files with the names of the scans: fields label and true_instance
    #[arg(long, value_name = "DIR")]
    labels: Option<PathBuf>,

    #[command(flatten)]
    writing: Writing,
}

#[derive(Args)]
struct Writing {
    /// Time of the start, seconds since 1970, where only times from the start are known
    /// [default: 946684800, 1 January 2000]
    #[arg(long, value_name = "SECONDS", value_parser = since_1970)]
    start: Option<u64>,

    /// Compression of the recording
    #[arg(long, value_enum, default_value_t = Compress::Zstd)]
    compression: Compress,

    /// Replace existing recordings
    #[arg(long)]
    force: bool,
}

impl Writing {
    fn options(&self) -> WriteOptions {
        let (compression, force) = (self.compression.into(), self.force);
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
    let taxonomy = match &arguments.taxonomy {
        Some(path) => divmerge::taxonomy_file::read_taxonomy(path)?,
        None => Taxonomy::semantic_kitti(),
    };
    let chosen = chosen(&arguments.root, &arguments.sequences)?;
    let outputs = outputs(&arguments.output, &chosen)?;
    for output in &outputs {
        refuse_existing(output, arguments.writing.force)?;
    }
    let sequences = opened(arguments, &chosen)?;
    if outputs.first() != Some(&arguments.output) {
        let at = || arguments.output.display().to_string();
        std::fs::create_dir_all(&arguments.output).with_context(at)?;
    }
    for (sequence, output) in sequences.iter().zip(&outputs) {
        for note in &sequence.notes {
            eprintln!("note: sequence {}: {note}", sequence.name);
        }
        let bar = frame_bar(&format!("sequence {}", sequence.name), sequence.len() as u64);
        let written = sequence.write(&taxonomy, output, &arguments.writing.options(), || {
            bar.inc(1);
            interrupt::wish()
        });
        bar.finish_and_clear();
        let written = written.context("nothing written")?;
        print(&written, output, &format!("sequence {} on {CLOUD_TOPIC}", sequence.name));
    }
    Ok(Outcome::Done)
}

/// Names and folders of the sequences asked for.
fn chosen(root: &Path, wanted: &[String]) -> Result<Vec<(String, PathBuf)>> {
    let there = sequences(root)?;
    if wanted.is_empty() {
        return Ok(there);
    }
    for name in wanted {
        if !there.iter().any(|(other, _)| other == name) {
            let root = root.display();
            bail!("{root}: no sequence {name} with scans; there is: {}", listed(&there));
        }
    }
    Ok(there.into_iter().filter(|(name, _)| wanted.contains(name)).collect())
}

fn listed(sequences: &[(String, PathBuf)]) -> String {
    sequences.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
}

/// A recording for each sequence: `output` itself, or NN.mcap in it, which is a folder, made if it is not there.
fn outputs(output: &Path, sequences: &[(String, PathBuf)]) -> Result<Vec<PathBuf>> {
    let is_named_folder = output.as_os_str().as_encoded_bytes().ends_with(b"/");
    if !output.is_dir() && !is_named_folder {
        return match sequences {
            [_] => Ok(vec![output.to_owned()]),
            several => bail!(
                "{} is one recording, and there are the sequences {}: choose one with --sequence, or \
                 give a folder ({}/)",
                output.display(),
                listed(several),
                output.with_extension("").display()
            ),
        };
    }
    Ok(sequences.iter().map(|(name, _)| output.join(format!("{name}.mcap"))).collect())
}

/// The sequences, all looked through before any is written.
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
    refuse_existing(&arguments.output, arguments.writing.force)?;
    let options = FolderOptions {
        columns: arguments.columns.clone(),
        rate: arguments.rate,
        start_ns: arguments.writing.start,
        labels: arguments.labels.clone(),
    };
    let scans = ScanFolder::open(&arguments.folder, &options).context("nothing written")?;
    if !scans.left_aside.is_empty() {
        eprintln!("note: left aside: {}", some_of(&scans.left_aside));
    }
    let bar = frame_bar("converting", scans.len() as u64);
    let (topic, frame_id) = (&arguments.topic, &arguments.frame_id);
    let options = arguments.writing.options();
    let written = scans.write(&arguments.output, topic, frame_id, &options, || {
        bar.inc(1);
        interrupt::wish()
    });
    bar.finish_and_clear();
    let written = written.context("nothing written")?;
    let times = match scans.stamps {
        Stamps::Names => "times from the names of the files".to_owned(),
        Stamps::Rate(rate) => format!("{rate} a second"),
    };
    print(
        &written,
        &arguments.output,
        &format!("{} files on {topic}, {times}", scans.format.ending()),
    );
    Ok(Outcome::Done)
}

/// The first names of many.
fn some_of(names: &[String]) -> String {
    const NAMED: usize = 10;
    let more = match names.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    names[..names.len().min(NAMED)].join(", ") + &more
}

fn print(written: &Written, output: &Path, what: &str) {
    for left_out in &written.left_out {
        eprintln!("note: left out: {left_out}");
    }
    println!(
        "wrote {} ({} bytes, {} clouds with {} points, from {what})",
        output.display(),
        grouped(written.bytes),
        grouped(written.clouds),
        grouped(written.points)
    );
    println!("    fields: {}", written.layout);
}
