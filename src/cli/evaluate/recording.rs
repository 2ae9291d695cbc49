//! Scores of an annotated recording, by fields of truth or label files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde::Serialize;

use super::arguments::Arguments;
use super::scores::{print, refuse};
use crate::cli::annotated::{annotated, find_annotated};
use crate::cli::arguments::truth::TRUTH_HINT;
use crate::cli::exit::{NotThere, contradict, error_chain};
use crate::cli::output::OutputFile;
use crate::cli::progress::frame_bar;
use crate::cli::text::counted;
use crate::datasets::semantic_kitti::label_pairs::{label_file, stray_label_files};
use crate::datasets::semantic_kitti::read_labels;
use crate::error::FrameError;
use crate::evaluate::{Evaluation, MetricSet, ScanLabels, Scores};
use crate::frames::{EncodedCloud, EncodedClouds};
use crate::messages::annotation::object_field;

/// The JSON file.
#[derive(Serialize)]
struct RecordingScores<'a> {
    input: &'a Path,
    labels: Option<&'a PathBuf>,
    taxonomy: &'a str,
    min_points: u64,
    topics: Vec<TopicScores>,
}

/// A topic and its scores.
#[derive(Serialize)]
struct TopicScores {
    topic: String,
    #[serde(flatten)]
    figures: Scores,
}

pub fn run(
    arguments: &Arguments,
    input: &Path,
    metrics: &MetricSet,
    json: Option<&OutputFile>,
) -> Result<()> {
    let topics = topics(arguments, input)?;
    let (mut scored, mut problems) = (Vec::new(), Vec::new());
    for topic in topics {
        let figures = score(arguments, input, &topic, metrics, &mut problems)?;
        scored.push(TopicScores { topic, figures });
    }
    refuse(problems)?;
    for (number, TopicScores { topic, figures }) in scored.iter().enumerate() {
        let blank = if number == 0 { "" } else { "\n" };
        print!("{blank}{topic}: ");
        print(figures);
    }
    if let Some(json) = json {
        let value = RecordingScores {
            input,
            labels: arguments.of_recording.labels.as_ref(),
            taxonomy: &metrics.taxonomy.name,
            min_points: metrics.min_points,
            topics: scored,
        };
        json.write_json(&value)?;
    }
    Ok(())
}

/// The annotated topics `T/instances`, or those requested as `T` or `T/instances`.
fn topics(arguments: &Arguments, input: &Path) -> Result<Vec<String>> {
    let annotated = annotated(input)?;
    let mut chosen = Vec::new();
    for topic in &arguments.topic {
        let Some(found) = find_annotated(&annotated, topic) else {
            let (input, topics) = (input.display(), annotated.join(", "));
            let problem =
                format!("{input}: no annotated topic `{topic}`; annotated topics: {topics}");
            return Err(NotThere(problem).into());
        };
        chosen.push(found.clone());
    }
    if chosen.is_empty() {
        chosen.clone_from(&annotated);
    }
    if chosen.len() > 1 && arguments.of_recording.labels.is_some() {
        contradict!("--labels is for one topic; choose it with --topic: {}", annotated.join(", "));
    }
    Ok(chosen)
}

/// Scores a topic and adds the problems of its clouds to `problems`.
fn score(
    arguments: &Arguments,
    input: &Path,
    topic: &str,
    metrics: &MetricSet,
    problems: &mut Vec<String>,
) -> Result<Scores> {
    let messages = EncodedClouds::open(input, Some(topic), 0..=u64::MAX)?;
    let count = messages.message_count();
    if let Some(folder) = arguments.of_recording.labels.as_ref() {
        problems.extend(unmatched(folder, count)?);
    }
    let bar = frame_bar("scoring", count);
    let mut sums = Evaluation::new(*metrics);
    let mut lacking = BTreeMap::new();
    let mut seen = 0;
    for message in messages {
        let place = format!("{}: cloud {seen} of {topic}", input.display());
        let added = message
            .map_err(anyhow::Error::from)
            .and_then(|message| add(arguments, &message, &place, &mut sums));
        if let Err(error) = added {
            match error.downcast_ref() {
                Some(FrameError::MissingField { name, .. }) => {
                    lacking.entry(name.clone()).or_insert((0, error_chain(&error))).0 += 1;
                }
                _ => problems.push(error_chain(&error)),
            }
        }
        seen += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    for (field, (clouds, first)) in lacking {
        if clouds == seen {
            let hint = if arguments.of_recording.names(&field) { TRUTH_HINT } else { "" };
            return Err(NotThere(format!("{first}{hint}")).into());
        }
        let all = counted(seen, "cloud");
        problems.push(format!("{clouds} of {all} of {topic} lack the field `{field}`: {first}"));
    }
    if seen < count {
        problems.push(format!(
            "{}: {topic} has {count} clouds, of which {seen} can be read",
            input.display()
        ));
    }
    sums.end_sequence();
    Ok(sums.scores())
}

fn add(
    arguments: &Arguments,
    message: &EncodedCloud,
    place: &str,
    sums: &mut Evaluation,
) -> Result<()> {
    let context = || place.to_owned();
    let wire = message.decode().with_context(context)?;
    let column = |name: &str| wire.column_u32(name).with_context(context);
    let own = |class: &str, instance: &str| {
        Ok::<_, anyhow::Error>(ScanLabels::of_columns(&column(class)?, column(instance)?))
    };
    let usual = if arguments.over_time { object_field(&wire) } else { "instance" };
    let instance_field = arguments.instance_field.as_deref().unwrap_or(usual);
    let found = own(&arguments.class_field, instance_field)?;
    let truth = &arguments.of_recording;
    let truth = match &truth.labels {
        None => own(&truth.true_class_field, &truth.true_instance_field)?,
        Some(folder) => {
            let path = label_file(folder, message.number);
            if !path.exists() {
                return Ok(()); // named already
            }
            let words = read_labels(&path)?;
            if words.len() != found.class.len() {
                let (labels, points) = (words.len(), found.class.len());
                bail!("{}: {labels} labels for {points} points", path.display());
            }
            ScanLabels::of_words(words)
        }
    };
    let needs_cloud = sums.needs_cloud(&found);
    let cloud = needs_cloud.then(|| wire.to_cloud(None).with_context(context)).transpose()?;
    Ok(sums.add(message.log_time_ns(), (&found, place), (&truth, place), cloud.as_ref())?)
}

/// Label files without a cloud, and clouds without a label file.
fn unmatched(folder: &Path, clouds: u64) -> Result<Vec<String>> {
    let stray = stray_label_files(folder, clouds)?.into_iter();
    let total = counted(clouds, "cloud");
    let stray = stray.map(|path| format!("{}: no such cloud; there are {total}", path.display()));
    let files = (0..clouds).map(|number| label_file(folder, number));
    let missing = files.filter(|path| !path.exists());
    let missing = missing.map(|path| format!("{}: no such file for this cloud", path.display()));
    Ok(stray.chain(missing).collect())
}
