//! An annotated recording against the truth in it or beside it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use divmerge::annotate::annotated_topics;
use divmerge::evaluate::{Evaluation, MetricSet, ScanLabels, Scores};
use divmerge::io::frames::CloudMessages;
use divmerge::io::semantic_kitti::read_labels;
use divmerge::io::{CloudMessage, Overview};
use serde::Serialize;

use super::{Arguments, print, refuse, write_json};
use crate::terminal::frame_bar;

/// What goes into the JSON file.
#[derive(Serialize)]
struct Written<'a> {
    input: &'a Path,
    labels: Option<&'a PathBuf>,
    taxonomy: &'a str,
    min_points: u64,
    topics: Vec<OfTopic>,
}

/// A topic and its figures.
#[derive(Serialize)]
struct OfTopic {
    topic: String,
    #[serde(flatten)]
    figures: Scores,
}

pub fn run(arguments: &Arguments, input: &Path, metrics: &MetricSet) -> Result<()> {
    let topics = topics(arguments, input)?;
    let (mut scored, mut problems) = (Vec::new(), Vec::new());
    for topic in topics {
        let figures = score(arguments, input, &topic, metrics, &mut problems)?;
        scored.push(OfTopic { topic, figures });
    }
    refuse(problems)?;
    for (number, OfTopic { topic, figures }) in scored.iter().enumerate() {
        let blank = if number == 0 { "" } else { "\n" };
        print!("{blank}{topic}: ");
        print(figures);
    }
    if let Some(path) = &arguments.json {
        let written = Written {
            input,
            labels: arguments.of_recording.labels.as_ref(),
            taxonomy: &metrics.taxonomy.name,
            min_points: metrics.min_points,
            topics: scored,
        };
        write_json(path, &written)?;
    }
    Ok(())
}

/// The annotated topics, `T/instances`, or those of them that are asked for as `T` or `T/instances`.
fn topics(arguments: &Arguments, input: &Path) -> Result<Vec<String>> {
    let overview = Overview::read(input)?;
    let annotated = annotated_topics(&overview);
    let known = || annotated.iter().copied().collect::<Vec<_>>().join(", ");
    if annotated.is_empty() {
        bail!("{}: no annotated topic (run `divmerge annotate`)", input.display());
    }
    let mut chosen = Vec::new();
    for topic in &arguments.topic {
        let added = format!("{topic}/instances");
        let found = annotated.iter().find(|&&have| have == topic || have == added);
        match found {
            Some(found) => chosen.push((*found).to_owned()),
            None => {
                bail!("{}: no annotated topic `{topic}`; there is: {}", input.display(), known())
            }
        }
    }
    if chosen.is_empty() {
        chosen = annotated.iter().map(|&topic| topic.to_owned()).collect();
    }
    if chosen.len() > 1 && arguments.of_recording.labels.as_ref().is_some() {
        bail!("--labels is for one topic; say --topic, one of: {}", known());
    }
    Ok(chosen)
}

/// Scores a topic; what is wrong with its clouds is added to `problems`.
fn score(
    arguments: &Arguments,
    input: &Path,
    topic: &str,
    metrics: &MetricSet,
    problems: &mut Vec<String>,
) -> Result<Scores> {
    let messages = CloudMessages::open(input, Some(topic), 0..=u64::MAX)?;
    let count = messages.message_count();
    if let Some(folder) = arguments.of_recording.labels.as_ref() {
        problems.extend(unmatched(folder, count)?);
    }
    let bar = frame_bar("scoring", count);
    let mut sums = Evaluation::new(*metrics);
    let mut seen = 0;
    for message in messages {
        let place = format!("{}: cloud {seen} of {topic}", input.display());
        let added = message
            .map_err(anyhow::Error::from)
            .and_then(|message| add(arguments, &message, &place, metrics, &mut sums));
        problems.extend(added.err().map(|error| crate::told(&error)));
        seen += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
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
    message: &CloudMessage,
    place: &str,
    metrics: &MetricSet,
    sums: &mut Evaluation,
) -> Result<()> {
    let context = || place.to_owned();
    let wire = message.decode().with_context(context)?;
    let column = |name: &str| wire.column_u32(name).with_context(context);
    let own = |class: &str, instance: &str| {
        Ok::<_, anyhow::Error>(ScanLabels::of_columns(&column(class)?, column(instance)?))
    };
    let found = own(&arguments.class_field, &arguments.instance_field)?;
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
    let cloud = metrics.entropy.then(|| wire.to_cloud(None).with_context(context)).transpose()?;
    Ok(sums.add((&found, place), (&truth, place), cloud.as_ref())?)
}

fn label_file(folder: &Path, number: u64) -> PathBuf {
    folder.join(format!("{number:06}.label"))
}

/// Label files without a cloud, and clouds without a label file.
fn unmatched(folder: &Path, clouds: u64) -> Result<Vec<String>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut files = BTreeSet::new();
    for entry in entries {
        let path = entry.with_context(|| folder.display().to_string())?.path();
        if path.extension().is_some_and(|end| end == "label") {
            files.insert(path);
        }
    }
    let expected: BTreeSet<PathBuf> =
        (0..clouds).map(|number| label_file(folder, number)).collect();
    let without_cloud = files.difference(&expected);
    let without_cloud =
        without_cloud.map(|path| format!("{}: no such cloud, there are {clouds}", path.display()));
    let missing = expected.difference(&files);
    let missing =
        missing.map(|path| format!("{}: there is a cloud, but no such file", path.display()));
    Ok(without_cloud.chain(missing).collect())
}
