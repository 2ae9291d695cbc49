//! `divmerge annotate --dry-run`: what would be read, believed and written.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::Result;

use super::tasks::CheckedTask;
use crate::annotate::{AnnotateOptions, Form};
use crate::cli::arguments::parameters::changes;
use crate::cli::exit::{contradict, error_chain};
use crate::cli::layout::WantedLayouts;
use crate::cli::text::{counted, grouped};
use crate::frames::{CloudAt, CloudTopic, INSTANCES, OBJECTS, choose_topics, encoded_cloud_at};
use crate::range_image::RangeImage;
use crate::recording::{Overview, is_stream};

/// The run of a recording in words, a line each. Its first cloud of each topic is read.
pub fn text(
    task: &CheckedTask,
    options: &AnnotateOptions,
    layouts: WantedLayouts,
) -> Result<String> {
    let (input, output) = (task.input.as_path(), task.output.path());
    if is_stream(input) {
        contradict!("a stream is read once, and cannot be looked into: name a file");
    }
    let overview = Overview::read(input)?;
    let chosen = choose_topics(&overview, &options.topics, options.config.class_topic())?;
    let topics: BTreeMap<Arc<str>, CloudTopic> =
        chosen.into_values().map(|topic| (Arc::clone(&topic.topic), topic)).collect();
    let bytes = counted(overview.file_size, "byte");
    let mut text = format!("would read {} ({bytes})\n", input.display());
    for topic in topics.keys() {
        let clouds = overview
            .channels_of(topic)
            .filter_map(|channel| overview.message_counts.get(&channel.id).copied());
        let clouds = grouped(clouds.sum::<u64>());
        text += &format!("  {topic}: {clouds} clouds, {}\n", believed(task, options, topic));
    }
    text += &format!("with {}\n", options.config.pipeline.describe());
    for change in changes(&options.parameters()) {
        text += &format!("  {change}\n");
    }
    text += &format!("and write {}\n", output.display());
    for (name, topic) in &topics {
        let clouds = options.types.format(topic.format).type_name();
        let boxes = options.types.objects(options.types.format(topic.format))?;
        match options.form {
            Form::InPlace => text += &format!("  {name}: {clouds} with more fields\n"),
            Form::Beside | Form::Only => text += &format!("  {name}{INSTANCES}: {clouds}\n"),
        }
        text += &format!("  {name}{OBJECTS}: {}\n", boxes.name);
    }
    if options.form != Form::Only {
        text += "  and everything else that the input holds\n";
    }
    for layout in layouts.paths(output).into_iter().flatten() {
        text += &format!("and write {}\n", layout.display());
    }
    Ok(text)
}

/// Where the objects and the rows of a topic's first cloud come from.
fn believed(task: &CheckedTask, options: &AnnotateOptions, topic: &str) -> String {
    let first = || -> Result<String> {
        let encoded =
            encoded_cloud_at(&task.input, Some(topic), CloudAt::Frame(0), options.config.assemble)?;
        let wire = encoded.decode()?;
        let decoded = options.config.decode(&wire, &encoded.key(&wire))?;
        let image = RangeImage::new(&decoded.cloud, &options.config.pipeline.projection);
        let odd = decoded.odd_field.map_or(String::new(), |odd| format!(" ({})", odd.describe()));
        Ok(format!(
            "objects from {}{odd}; rows from {}, {} x {}",
            decoded.semantics,
            image.projection.describe(),
            image.rows(),
            image.columns()
        ))
    };
    first().unwrap_or_else(|error| {
        format!("of which the first cannot be read: {}", error_chain(&error))
    })
}
