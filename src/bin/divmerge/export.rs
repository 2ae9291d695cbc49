//! `divmerge export`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::annotate::is_annotation;
use divmerge::io::frames::CloudMessages;
use divmerge::io::semantic_kitti::write_labels;
use divmerge::io::{Overview, PointCloud2};

use crate::terminal::{frame_bar, grouped};
use crate::{Outcome, refuse_existing};

/// Write a recording's classes and instances as SemanticKITTI label files
///
/// One `.label` file a cloud, 000000.label and on in the order of the file, a word a point in the order of the
/// cloud: class in the low 16 bits, instance in the high. In a folder sequences/NN/predictions they can be scored
/// (`divmerge evaluate`) and handed in. For the truth of a simulated drive:
/// --topic /lidar/points --class-field label --instance-field true_instance
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP), such as `divmerge annotate` writes
    input: PathBuf,

    /// Folder for the label files; made if it is not there
    #[arg(long, value_name = "DIR")]
    labels: PathBuf,

    /// The topic whose clouds have the fields [default: the first annotated one]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Field of the classes
    #[arg(long, default_value = "semantic", value_name = "NAME")]
    class_field: String,

    /// Field of the instances
    #[arg(long, default_value = "instance", value_name = "NAME")]
    instance_field: String,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let topic = match &arguments.topic {
        Some(topic) => topic.clone(),
        None => annotated_topic(&arguments.input)?,
    };
    let messages = CloudMessages::open(&arguments.input, Some(&topic), 0..=u64::MAX)?;
    std::fs::create_dir_all(&arguments.labels)
        .with_context(|| arguments.labels.display().to_string())?;
    let (bar, mut points, mut files) = (frame_bar("exporting", messages.message_count()), 0, 0);
    for message in messages {
        let message = message?;
        let words = words(&message.data, arguments)
            .with_context(|| format!("frame {} of `{topic}`", message.number))?;
        let file = arguments.labels.join(format!("{:06}.label", message.number));
        refuse_existing(&file, arguments.force)?;
        write_labels(&file, &words)?;
        points += words.len() as u64;
        files += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    println!(
        "wrote {} label files with {} points of `{topic}` into {}",
        grouped(files),
        grouped(points),
        arguments.labels.display()
    );
    Ok(Outcome::Done)
}

fn annotated_topic(input: &Path) -> Result<String> {
    let overview = Overview::read(input)?;
    let topics = overview.channels.values().map(|channel| &channel.topic);
    let annotated = topics.filter(|topic| is_annotation(&overview, topic)).min();
    let Some(topic) = annotated else {
        bail!("{}: no annotated topic (run `divmerge annotate`, or say --topic)", input.display());
    };
    Ok(topic.clone())
}

/// The label words of a cloud.
fn words(data: &[u8], arguments: &Arguments) -> Result<Vec<u32>> {
    let cloud = PointCloud2::parse(data)?;
    let column = |name: &str| -> Result<Vec<u32>> {
        let values = cloud.column_u32(name)?;
        match values.iter().find(|&&value| value > u32::from(u16::MAX)) {
            Some(value) => bail!("`{name}` is {value}, and a label has 16 bits for it"),
            None => Ok(values),
        }
    };
    let (classes, instances) =
        (column(&arguments.class_field)?, column(&arguments.instance_field)?);
    Ok(classes.iter().zip(instances).map(|(class, instance)| class | instance << 16).collect())
}
