//! `--dry-run`: what would be read, believed and written.

use std::collections::BTreeSet;
use std::fmt::{Display, Write};
use std::path::Path;

use anyhow::Result;
use clap::Args;

use crate::annotate::AnnotateConfig;
use crate::cli::arguments::parameters::changes;
use crate::cli::exit::{contradict, error_chain};
use crate::cli::text::counted;
use crate::frames::{CloudAt, choose_topics, encoded_cloud_at};
use crate::parameters::ParameterSet;
use crate::range_image::RangeImage;
use crate::recording::{Overview, is_stream};

/// Whether nothing is to be done.
#[derive(Args)]
pub struct DryRunArgument {
    /// Say what would be read, believed and written, and do nothing; the first cloud of each topic
    /// is read for it
    #[arg(long)]
    pub dry_run: bool,
}

/// What a run would do, a line each.
#[derive(Default)]
pub struct DryRun(String);

impl DryRun {
    /// Of a run that reads a recording.
    pub fn of_recording(input: &Path) -> Result<(Self, Overview)> {
        if is_stream(input) {
            contradict!("a stream is read once, and cannot be looked into: name a file");
        }
        let overview = Overview::read(input)?;
        let mut plan = DryRun::default();
        let bytes = counted(overview.file_size, "byte");
        plan.line(format_args!("would read {} ({bytes})", input.display()));
        Ok((plan, overview))
    }

    /// Of a run that clusters clouds of a recording; without names of all its topics, and of all
    /// clouds but for what arguments leave out.
    pub fn of_clouds(
        input: &Path,
        topics: &[String],
        config: &AnnotateConfig,
        limits: &[&str],
    ) -> Result<Self> {
        let (mut plan, overview) = DryRun::of_recording(input)?;
        let chosen = choose_topics(&overview, topics, config.class_topic())?;
        let topics: BTreeSet<&str> = chosen.values().map(|topic| &*topic.topic).collect();
        for topic in topics {
            plan.topic(&overview, topic, config, limits);
        }
        plan.method(config, &config.parameters());
        Ok(plan)
    }

    /// Adds a line.
    pub fn line(&mut self, text: impl Display) {
        let _ = writeln!(self.0, "{text}");
    }

    /// Adds what is believed of the clouds of a topic, some of which arguments leave out.
    pub fn topic(
        &mut self,
        overview: &Overview,
        topic: &str,
        config: &AnnotateConfig,
        limits: &[&str],
    ) {
        let clouds = counted(clouds_of(overview, topic), "cloud");
        let limited = match limits {
            [] => String::new(),
            limits => format!(" (those of {} alone)", limits.join(" and ")),
        };
        let believed = self::believed(&overview.path, topic, config);
        self.line(format_args!("  {topic}: {clouds}{limited}, {believed}"));
    }

    /// Adds how the clouds are clustered, and which parameters are not the preset's.
    pub fn method(&mut self, config: &AnnotateConfig, parameters: &ParameterSet) {
        self.line(format_args!("with {}", config.pipeline.describe()));
        for change in changes(parameters) {
            self.line(format_args!("  {change}"));
        }
    }

    /// Adds an output.
    pub fn writes(&mut self, output: impl Display) {
        self.line(format_args!("and write {output}"));
    }

    /// The lines.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Prints the lines.
    pub fn print(&self) {
        print!("{}", self.0);
    }
}

/// Number of clouds of a topic, by the recording's index.
pub fn clouds_of(overview: &Overview, topic: &str) -> u64 {
    let channels = overview.channels_of(topic);
    channels.filter_map(|channel| overview.message_counts.get(&channel.id)).sum()
}

/// Where the objects and the rows of a topic's first cloud come from.
fn believed(input: &Path, topic: &str, config: &AnnotateConfig) -> String {
    let first = || -> Result<String> {
        let encoded = encoded_cloud_at(input, Some(topic), CloudAt::Frame(0), config.assemble)?;
        let wire = encoded.decode()?;
        let decoded = config.decode(&wire, &encoded.key(&wire))?;
        let image = RangeImage::new(&decoded.cloud, &config.pipeline.projection);
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
