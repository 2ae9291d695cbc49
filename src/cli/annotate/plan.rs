//! What a run would do.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::Result;

use super::tasks::CheckedTask;
use crate::annotate::{AnnotateOptions, Form};
use crate::cli::dry_run::DryRun;
use crate::cli::layout::WantedLayouts;
use crate::frames::{CloudTopic, INSTANCES, OBJECTS, choose_topics};

/// The run of a recording in words, a line each. Its first cloud of each topic is read.
pub fn text(
    task: &CheckedTask,
    options: &AnnotateOptions,
    layouts: WantedLayouts,
) -> Result<String> {
    let output = task.output.path();
    let (mut plan, overview) = DryRun::of_recording(&task.input)?;
    let chosen = choose_topics(&overview, &options.topics, options.config.class_topic())?;
    let topics: BTreeMap<Arc<str>, CloudTopic> =
        chosen.into_values().map(|topic| (Arc::clone(&topic.topic), topic)).collect();
    let limits = [("--from", options.from_ns), ("--to", options.to_ns)];
    let limits = limits.into_iter().filter(|(_, time)| time.is_some()).map(|(name, _)| name);
    let limits: Vec<&str> = limits.collect();
    for topic in topics.keys() {
        plan.topic(&overview, topic, &options.config, &limits);
    }
    plan.method(&options.config, &options.parameters());
    plan.writes(output.display());
    for (name, topic) in &topics {
        let clouds = options.types.format(topic.format).type_name();
        let boxes = options.types.objects(options.types.format(topic.format))?;
        match options.form {
            Form::InPlace => plan.line(format_args!("  {name}: {clouds} with more fields")),
            Form::Beside | Form::Only => plan.line(format_args!("  {name}{INSTANCES}: {clouds}")),
        }
        plan.line(format_args!("  {name}{OBJECTS}: {}", boxes.name));
    }
    if options.form != Form::Only {
        plan.line("  and everything else that the input holds");
    }
    for layout in layouts.paths(output).into_iter().flatten() {
        plan.writes(layout.display());
    }
    Ok(plan.text().to_owned())
}
