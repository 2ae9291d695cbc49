//! An annotation under way.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::{Bound, ControlFlow};
use std::path::Path;
use std::sync::Arc;

use super::batch::Batch;
use super::channels::{Added, AddedChannels};
use super::cloud_job::CloudJob;
use super::followed::Tracking;
use super::job_input::JobInput;
use super::pending::Queue;
use crate::annotate::added_topics::refuse_annotated;
use crate::annotate::checkpoint::CompletedClouds;
use crate::annotate::config::AnnotateConfig;
use crate::annotate::event::RunEvent;
use crate::annotate::form::Form;
use crate::annotate::options::AnnotateOptions;
use crate::annotate::report::AnnotationReport;
use crate::annotate::resume::Journal;
use crate::annotate::run_parameters::RunParameters;
use crate::annotate::tracking::TopicFollower;
use crate::annotate::warnings::CloudWarnings;
use crate::error::{Conflict, Error, Result};
use crate::frames::assemble::{PartWatch, Turns};
use crate::frames::topics::{topic_count, topic_names};
use crate::frames::{CloudCounter, CloudTopic};
use divmerge_recording::workers::Workers;
use divmerge_recording::{Compression, Overview, ReadFilter, RecordingWriter};

/// An annotation under way.
pub(in crate::annotate) struct Job<'a> {
    pub(in crate::annotate) overview: Overview,
    pub(super) options: &'a AnnotateOptions,
    pub(super) on_event: &'a mut dyn FnMut(RunEvent) -> ControlFlow<()>,
    pub(super) workers: Workers,
    pub(super) config: Arc<AnnotateConfig>,
    pub(super) parameters: RunParameters,
    pub(super) writer: RecordingWriter,
    /// What is to be written next, in its order.
    pub(super) queue: Queue,
    /// Topic and format of each channel whose clouds are annotated.
    pub(super) clouds: BTreeMap<u16, CloudTopic>,
    pub(in crate::annotate) filter: ReadFilter,
    pub(super) compression: Compression,
    /// Whether topics and the rest become known only as they come.
    pub(super) is_stream: bool,
    /// Of a stream: the topics that have come.
    pub(super) names: BTreeSet<String>,
    /// Whether the compression is still to be taken from the first chunk.
    pub(super) awaits_compression: bool,
    pub(super) added: AddedChannels,
    pub(super) counter: CloudCounter,
    /// Puts clouds together to turns, if that is asked for.
    pub(super) turns: Turns,
    /// Whether clouds look like parts of turns, if they are not put together.
    pub(super) watch: PartWatch,
    /// What is odd about clouds.
    pub(super) odd_clouds: CloudWarnings,
    pub(super) report: AnnotationReport,
    pub(super) journal: Option<Journal>,
    /// Clouds that a run before completed.
    pub(super) completed: Option<CompletedClouds>,
    /// Of a slice: what became of the clouds since the last checkpoints that were written.
    pub(super) checkpoints: Vec<u8>,
    /// Clouds that wait to go through a network together.
    pub(super) batch: Batch,
    /// Clouds whose objects are followed.
    pub(super) tracking: Tracking,
    /// Whether what was completed is of slices, whose tracks are still to be found.
    pub(super) joins_slices: bool,
}

impl<'a> Job<'a> {
    /// Begins the output.
    ///
    /// # Errors
    /// [`crate::error::Error::Conflict`] if the input has an output's topic, or a run is to be
    /// resumed that had other parameters; those of [`RecordingWriter::create`].
    pub(in crate::annotate) fn new(
        input: JobInput,
        output: &Path,
        options: &'a AnnotateOptions,
        workers: &Workers,
        on_event: &'a mut dyn FnMut(RunEvent) -> ControlFlow<()>,
    ) -> Result<Self> {
        let recorded = input.recorded_motion(options)?;
        let (completed, writer, journal) = input.open_output(output, options, workers)?;
        let report = input.report(output, options, workers);
        let filter = input.filter(options, &recorded);
        let JobInput { overview, parameters, clouds, is_stream } = input;
        let config = Arc::new(options.config.clone());
        let mut job = Job {
            report,
            filter,
            overview,
            is_stream,
            names: BTreeSet::new(),
            options,
            on_event,
            workers: workers.clone(),
            batch: Batch::new(
                Arc::clone(&config),
                CloudJob::new(options, journal.is_some() || options.slice.is_some()),
            ),
            config,
            writer,
            queue: Queue::default(),
            compression: parameters.compression,
            parameters,
            awaits_compression: options.compression.is_none(),
            clouds,
            added: AddedChannels::new(options.types, options.form == Form::InPlace),
            counter: CloudCounter::default(),
            turns: Turns::new(options.config.assemble, (Bound::Unbounded, Bound::Unbounded)),
            watch: PartWatch::default(),
            odd_clouds: CloudWarnings::default(),
            journal,
            completed,
            checkpoints: Vec::new(),
            tracking: Tracking::new(recorded),
            joins_slices: false,
        };
        match is_stream {
            true => job.writer.reserve_all_but_the_highest(),
            false => job.declare_channels()?,
        }
        Ok(job)
    }

    fn declare_channels(&mut self) -> Result<()> {
        self.follow_topics();
        let (names, clouds) = (topic_names(&self.overview), self.clouds.values());
        refuse_annotated(&self.overview.path, &names, clouds.map(|cloud| &cloud.topic))?;
        self.writer.reserve(&self.overview);
        for channel in self.overview.channels.clone().into_values() {
            self.warn_of_unreadable_clouds(&channel);
        }
        // All of them now: their ids must not depend on which clouds can be read.
        self.declare_added()?;
        self.begin_slice()
    }

    /// Follows the objects of the topics that are known, if they are to be followed.
    pub(super) fn follow_topics(&mut self) {
        if !self.parameters.follows {
            return;
        }
        for CloudTopic { topic, .. } in self.clouds.values() {
            let several = self.is_stream || topic_count(&self.overview, topic) != Some(1);
            if several && !self.tracking.follows(topic) {
                self.tracking.follow(topic, TopicFollower::new(&self.options.tracks));
            }
        }
    }

    /// Declares the channels of what is added, where that has not been done yet.
    pub(super) fn declare_added(&mut self) -> Result<()> {
        for channel in self.clouds.keys().copied().collect::<Vec<_>>() {
            self.channels_for(channel)?;
        }
        Ok(())
    }

    /// The channels of what is added to a channel's clouds.
    pub(super) fn channels_for(&mut self, cloud_channel: u16) -> Result<Added> {
        let cloud = &self.clouds[&cloud_channel];
        let added = self.added.of_clouds(cloud_channel, cloud, &self.overview, &mut self.writer);
        added.map_err(|error| match error {
            Error::Recording(divmerge_recording::Error::TooManyChannels) => {
                self.too_many_channels()
            }
            error => error,
        })
    }

    fn too_many_channels(&self) -> Error {
        let topics: BTreeSet<&str> = self.clouds.values().map(|cloud| &*cloud.topic).collect();
        let (channels, topics) = (self.overview.channels.len(), topics.len());
        let problem = Conflict::TooManyChannels { channels, topics };
        Error::Conflict { path: self.overview.path.clone(), problem }
    }

    /// Takes clouds from slices, which are joined.
    pub(in crate::annotate) fn take_from(&mut self, completed: CompletedClouds) {
        self.completed = Some(completed);
        self.joins_slices = true;
    }

    /// Warns of what was odd about clouds.
    pub(super) fn warn_of_clouds(&mut self) {
        for warning in std::mem::take(&mut self.odd_clouds).into_lines() {
            self.warn(warning);
        }
    }

    /// Warns of something that concerns one channel alone.
    pub(super) fn warn(&mut self, warning: String) {
        let _ = (self.on_event)(RunEvent::Warning(&warning));
        self.report.warnings.push(warning);
    }
}
