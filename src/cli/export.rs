//! `divmerge export`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::cli::annotated::annotated;
use crate::cli::dry_run::{DryRun, DryRunArgument};
use crate::cli::exit::{Outcome, contradict, error_chain};
use crate::cli::output::{OutputFile, Outputs, make_folder, refuse_address};
use crate::cli::progress::frame_bar;
use crate::cli::text::counted;
use crate::datasets::scans::SOURCE;
use crate::datasets::semantic_kitti::label_pairs::{label_file, stray_label_files};
use crate::datasets::semantic_kitti::sequence::SEQUENCE_KEY;
use crate::frames::{EncodedCloud, EncodedClouds, find_metadata};
use crate::messages::annotation::object_field;
use crate::recording::{Metadata, Overview};

/// Write classes and instances as SemanticKITTI label files
///
/// One .label file for each cloud, from 000000.label on, with one word for each point: class in the
/// low 16 bits, instance in the high. With --root they are written to
/// ROOT/sequences/NN/predictions, where `divmerge evaluate` scores them; NN is the sequence that
/// `divmerge convert` noted in the recording, or --sequence. Nothing is written if a file exists.
#[derive(Args)]
#[command(after_long_help = "\
Examples:\n\
\x20 divmerge export annotated.mcap --labels predictions\n\
\x20 divmerge export annotated/*.mcap --root mine\n\
\x20 divmerge export simulated.mcap --labels truth --topic /lidar/points --class-field label \\\n\
\x20     --instance-field true_instance")]
pub struct Arguments {
    /// Annotated recordings (MCAP); more than one only with --root
    #[arg(required = true)]
    inputs: Vec<PathBuf>,

    /// Folder for the label files of one recording; created if missing
    #[arg(long, value_name = "DIR", required_unless_present = "root", conflicts_with = "root")]
    labels: Option<PathBuf>,

    /// Folder for sequences: label files are written to sequences/NN/predictions below it
    #[arg(long, value_name = "ROOT")]
    root: Option<PathBuf>,

    /// Sequence of the one recording, if it does not name it itself
    #[arg(long, value_name = "NN", requires = "root")]
    sequence: Option<String>,

    /// Topic of the clouds with the fields [default: the first annotated topic]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Field of the classes
    #[arg(long, default_value = "semantic", value_name = "NAME")]
    class_field: String,

    /// Field of the instances [default: `track` where clouds have it, else `instance`]
    #[arg(long, value_name = "NAME")]
    instance_field: Option<String>,

    #[command(flatten)]
    dry_run: DryRunArgument,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// A recording and the folder that its labels go to.
struct Export<'a> {
    input: &'a Path,
    topic: String,
    labels: PathBuf,
    /// A file for each cloud.
    files: Vec<OutputFile>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let mut exports = exports(arguments)?;
    let inputs = arguments.inputs.iter().map(PathBuf::as_path);
    let mut outputs = Outputs::new(inputs, arguments.force);
    for export in &mut exports {
        export.files = label_files(export, &mut outputs)?;
    }
    if arguments.dry_run.dry_run {
        return dry_run(&exports, arguments);
    }
    let mut outcome = Outcome::Done;
    for export in &exports {
        write(export, arguments)?;
        if !Overview::read(export.input)?.is_complete {
            eprintln!("warning: {}: cut off; clouds may be missing", export.input.display());
            outcome = Outcome::Incomplete;
        }
    }
    Ok(outcome)
}

/// Says what would be done. The first cloud of each recording is read.
fn dry_run(exports: &[Export], arguments: &Arguments) -> Result<Outcome> {
    for Export { input, topic, labels, files } in exports {
        let (mut plan, _) = DryRun::of_recording(input)?;
        let count = counted(files.len() as u64, "cloud");
        let first = EncodedClouds::open(input, Some(topic), 0..=0)?.next().transpose()?;
        let believed = match first.map(|message| fields(&message, arguments)).transpose() {
            Ok(Some([class, instance])) => {
                format!("classes from `{class}`, instances from `{instance}`")
            }
            Ok(None) => "none can be read".to_owned(),
            Err(error) => format!("of which the first cannot be read: {}", error_chain(&error)),
        };
        plan.line(format_args!("  {topic}: {count}, {believed}"));
        let files = counted(files.len() as u64, "label file");
        plan.writes(format_args!("{files} to {}", labels.display()));
        plan.print();
    }
    Ok(Outcome::Done)
}

/// The fields of a cloud that are read, after reading them.
fn fields(message: &EncodedCloud, arguments: &Arguments) -> Result<[String; 2]> {
    words(message, arguments)?;
    let usual = object_field(&message.decode()?);
    let instance = arguments.instance_field.as_deref().unwrap_or(usual);
    Ok([arguments.class_field.clone(), instance.to_owned()])
}

/// What goes where, before anything is written.
fn exports(arguments: &Arguments) -> Result<Vec<Export<'_>>> {
    let several = arguments.inputs.len() > 1;
    if several && (arguments.labels.is_some() || arguments.sequence.is_some()) {
        contradict!("{} recordings cannot go to one folder; use --root", arguments.inputs.len());
    }
    let mut input_of = BTreeMap::new();
    let mut exports = Vec::with_capacity(arguments.inputs.len());
    for input in &arguments.inputs {
        let labels = match (&arguments.labels, &arguments.root) {
            (Some(labels), _) => labels.clone(),
            (None, root) => {
                let root = root.as_deref().unwrap_or(Path::new("."));
                let name = sequence(input, arguments.sequence.as_deref())?;
                check_name(&name, input)?;
                if let Some(other) = input_of.insert(name.clone(), input) {
                    let (input, other) = (input.display(), other.display());
                    contradict!(
                        "{other} and {input} are both sequence {name}; export them separately"
                    );
                }
                root.join("sequences").join(name).join("predictions")
            }
        };
        let topic = match &arguments.topic {
            Some(topic) => topic.clone(),
            None => annotated(input)?.swap_remove(0),
        };
        exports.push(Export { input, topic, labels, files: Vec::new() });
    }
    Ok(exports)
}

/// The sequence of a recording: as told, or as noted in it.
fn sequence(input: &Path, told: Option<&str>) -> Result<String> {
    if let Some(told) = told {
        return Ok(told.to_owned());
    }
    let names_it = |metadata: &Metadata| {
        metadata.name == SOURCE && metadata.metadata.contains_key(SEQUENCE_KEY)
    };
    if let Some(metadata) = find_metadata(input, names_it)? {
        return Ok(metadata.metadata[SEQUENCE_KEY].clone());
    }
    contradict!("{}: does not name its sequence; give --sequence", input.display())
}

/// A sequence is a folder of that name and nothing else: a recording may say anything.
fn check_name(name: &str, input: &Path) -> Result<()> {
    let mut parts = Path::new(name).components();
    match (parts.next(), parts.next()) {
        (Some(std::path::Component::Normal(part)), None) if part == name => Ok(()),
        _ => bail!("{}: `{name}` is not a valid name of a sequence", input.display()),
    }
}

/// The label file of each cloud. Files of that name that belong to no cloud are an error.
fn label_files(export: &Export, outputs: &mut Outputs) -> Result<Vec<OutputFile>> {
    refuse_address(&export.labels)?;
    let clouds = EncodedClouds::open(export.input, Some(&export.topic), 0..=u64::MAX)?;
    let name = |number| label_file(&export.labels, number);
    let files =
        (0..clouds.message_count()).map(|number| outputs.file_in_made_folder(&name(number)));
    let files: Vec<OutputFile> = files.collect::<Result<_, _>>()?;
    if !export.labels.exists() {
        return Ok(files);
    }
    if let Some(stray) = stray_label_files(&export.labels, clouds.message_count())?.first() {
        bail!(
            "{} belongs to none of the {} clouds of {}; remove it or choose another folder",
            stray.display(),
            clouds.message_count(),
            export.input.display()
        );
    }
    Ok(files)
}

fn write(export: &Export, arguments: &Arguments) -> Result<()> {
    let Export { input, topic, labels, files } = export;
    let messages = EncodedClouds::open(input, Some(topic), 0..=u64::MAX)?;
    make_folder(labels)?;
    let (bar, mut points, mut written) = (frame_bar("exporting", messages.message_count()), 0, 0);
    for message in messages {
        let message = message?;
        let words = words(&message, arguments).with_context(|| {
            format!("{}: frame {} of `{topic}`", input.display(), message.number)
        })?;
        // A file that grows may have more clouds than when it was opened.
        let Some(file) = files.get(message.number as usize) else { break };
        file.write_labels(&words)?;
        points += words.len() as u64;
        written += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    println!(
        "wrote {} with {} of `{topic}` to {}",
        counted(written, "label file"),
        counted(points, "point"),
        labels.display()
    );
    Ok(())
}

/// The label words of a cloud.
fn words(message: &EncodedCloud, arguments: &Arguments) -> Result<Vec<u32>> {
    let cloud = message.decode()?;
    let column = |name: &str| -> Result<Vec<u32>> {
        let values = cloud.column_u32(name)?;
        match values.iter().find(|&&value| value > u32::from(u16::MAX)) {
            Some(value) => bail!("`{name}` is {value}; labels hold at most 65535"),
            None => Ok(values),
        }
    };
    let usual = object_field(&cloud);
    let instance_field = arguments.instance_field.as_deref().unwrap_or(usual);
    let (classes, instances) = (column(&arguments.class_field)?, column(instance_field)?);
    Ok(classes.iter().zip(instances).map(|(class, instance)| class | instance << 16).collect())
}
