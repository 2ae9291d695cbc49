//! What is known of a job's input, and what begins with it.

use std::collections::BTreeMap;
use std::path::Path;

use crate::annotate::checkpoint::CompletedClouds;
use crate::annotate::form::Form;
use crate::annotate::options::AnnotateOptions;
use crate::annotate::profile::Profile;
use crate::annotate::report::{AnnotationReport, TopicReport};
use crate::annotate::resume::{CutOffRun, Journal, clean_up};
use crate::annotate::run_parameters::RunParameters;
use crate::annotate::satisfiable::refuse_unsatisfiable;
use crate::annotate::tracking::RecordedMotion;
use crate::error::Result;
use crate::frames::{CloudTopic, Selection, choose_topics, transforms_at_rest};
use divmerge_recording::workers::Workers;
use divmerge_recording::{Overview, ReadFilter, RecordingWriter, STANDARD_STREAM, WriteOptions};

/// What a job is told of its input.
pub(in crate::annotate) struct JobInput {
    pub(in crate::annotate) overview: Overview,
    pub(in crate::annotate) parameters: RunParameters,
    /// Topic and format of each channel whose clouds are annotated; empty of a stream, whose
    /// channels become known as they come.
    pub(super) clouds: BTreeMap<u16, CloudTopic>,
    pub(super) is_stream: bool,
}

impl JobInput {
    /// A stream.
    pub(in crate::annotate) fn of_stream(overview: Overview, options: &AnnotateOptions) -> Self {
        let parameters = RunParameters::new(&overview, options);
        JobInput { overview, parameters, clouds: BTreeMap::new(), is_stream: true }
    }

    /// A file.
    ///
    /// # Errors
    /// Those of [`choose_topics`] and of the check of the message types.
    pub(in crate::annotate) fn of_file(
        overview: Overview,
        parameters: RunParameters,
    ) -> Result<Self> {
        let RunParameters { topics, class_topic, types, form, .. } = &parameters;
        let clouds = choose_topics(&overview, topics, class_topic.as_deref())?;
        types.check(&overview, clouds.values().map(|cloud| cloud.format), *form)?;
        Ok(JobInput { overview, parameters, clouds, is_stream: false })
    }

    /// Refuses options of a file that none of its clouds can satisfy.
    ///
    /// # Errors
    /// Those of [`refuse_unsatisfiable`].
    pub(in crate::annotate) fn refuse_unsatisfiable(
        &self,
        options: &AnnotateOptions,
    ) -> Result<()> {
        let AnnotateOptions { from_ns, to_ns, config, .. } = options;
        let selection = Selection { from_ns: *from_ns, to_ns: *to_ns, ..Selection::default() };
        refuse_unsatisfiable(&self.overview, &self.clouds, &selection, config)
    }

    /// Opens the output, its journal if the run can be resumed, and what a run before it completed.
    pub(super) fn open_output(
        &self,
        output: &Path,
        options: &AnnotateOptions,
        workers: &Workers,
    ) -> Result<(Option<CompletedClouds>, RecordingWriter, Option<Journal>)> {
        let JobInput { overview, parameters, .. } = self;
        let is_resumable = (options.resume || options.resumable)
            && output != STANDARD_STREAM
            && options.config.assemble.is_none();
        let completed = match options.resume && is_resumable {
            true => CutOffRun::find(output, parameters)?,
            false => None,
        };
        let mut writer = RecordingWriter::create(
            output,
            &WriteOptions {
                profile: overview.profile.clone(),
                recorded_by: overview.library.clone(),
                compression: parameters.compression,
                force: options.force,
            },
        )?;
        writer.compress_on(workers);
        if is_resumable && !options.resume {
            clean_up(output);
        }
        let journal = is_resumable.then(|| Journal::start(output, parameters)).transpose()?;
        Ok((completed.map(CompletedClouds::new), writer, journal))
    }

    /// What is recorded of where the sensor is, as far as it is wanted and known beforehand.
    ///
    /// # Errors
    /// Those of `RecordedMotion::refuse_missing`.
    pub(super) fn recorded_motion(&self, options: &AnnotateOptions) -> Result<RecordedMotion> {
        let JobInput { overview, parameters, is_stream, .. } = self;
        if !parameters.follows || options.slice.is_some() {
            return Ok(RecordedMotion::default());
        }
        let wanted = &options.tracks.ego_motion;
        let recorded = RecordedMotion::of_channels(overview, wanted);
        if *is_stream {
            return Ok(recorded);
        }
        recorded.refuse_missing(overview, wanted)?;
        Ok(match recorded.is_empty() {
            true => RecordedMotion::default(),
            false => recorded.with_frames_at_rest(transforms_at_rest(&overview.path)),
        })
    }

    /// What is to be read.
    pub(super) fn filter(
        &self,
        options: &AnnotateOptions,
        recorded: &RecordedMotion,
    ) -> ReadFilter {
        let numbered = self.clouds.iter().map(|(&id, cloud)| (id, cloud.topic.to_string()));
        let numbered = numbered.chain(recorded.channels());
        ReadFilter {
            unopened: options.unchecked.then_some(self.parameters.compression),
            others: options.form != Form::Only && options.slice.is_none(),
            bytes: options.slice.as_ref().map_or(0..u64::MAX, |slice| slice.start..slice.end),
            from_ns: options.from_ns,
            to_ns: options.to_ns,
            numbered: numbered.collect(),
            skims_large_chunks: true,
            ..ReadFilter::default()
        }
    }

    /// The report before anything is done.
    pub(super) fn report(
        &self,
        output: &Path,
        options: &AnnotateOptions,
        workers: &Workers,
    ) -> AnnotationReport {
        let topics = self.clouds.values().map(|cloud| {
            let format = options.types.format(cloud.format);
            (cloud.topic.to_string(), TopicReport { format, ..TopicReport::default() })
        });
        AnnotationReport {
            input: self.overview.path.clone(),
            output: output.to_owned(),
            input_bytes: self.overview.file_size,
            from_ns: options.from_ns,
            to_ns: options.to_ns,
            form: options.form.describe(),
            topics: topics.collect(),
            profile: Profile { threads: workers.threads(), ..Profile::default() },
            ..AnnotationReport::default()
        }
    }
}
