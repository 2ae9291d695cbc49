//! A session over one recording: its topics, and the clouds and runs that were asked for last.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use serde::Serialize;
use serde_json::{Value, json};

use super::cloud::{DecodedBy, InspectedCloud};
use super::run::Run;
use super::setting::{self, Setting};
use super::survey_state::Survey;
use crate::annotate::AnnotateConfig;
use crate::diagnose::explain::ExplanationReport;
use crate::error::Result;
use crate::frames::topics::{message_count, topic_names};
use crate::frames::{CloudAt, Selection, TruthSource, choose_topics, encoded_cloud_at};
use crate::view::{ColourTables, ColourTracker};
use divmerge_core::pipeline::Preset;
use divmerge_recording::{Overview, is_remote};

/// Clouds that are kept, and runs: the two settings of a frame, those of the frame before, and what
/// a slider has just left.
const CLOUDS_KEPT: usize = 3;
const RUNS_KEPT: usize = 6;

/// What a session is opened with.
#[derive(Debug, Clone)]
pub struct SessionOptions {
    /// The recording.
    pub input: PathBuf,
    /// Topic that is shown first; by default the first with clouds.
    pub topic: Option<String>,
    /// Frame that is shown first.
    pub frame: u64,
    /// How clouds are clustered as long as the page changes nothing.
    pub config: AnnotateConfig,
    /// Where the truth is.
    pub truth: TruthSource,
    /// Whether somebody said so: then a cloud without truth is an error.
    pub is_truth_said: bool,
    /// The options that were given, as words of a command line.
    pub words: Vec<String>,
    /// Joins words into a command line that a shell reads back.
    pub command_line: fn(&[String]) -> String,
}

/// A topic with clouds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TopicClouds {
    /// Its name.
    pub topic: String,
    /// Its clouds.
    pub clouds: u64,
}

/// A recording that is looked at.
pub struct Session {
    /// What it was opened with.
    pub(super) options: SessionOptions,
    /// The topics with clouds.
    pub(super) topics: Vec<TopicClouds>,
    /// The topic that is shown first.
    pub(super) first_topic: String,
    /// Log time of the first message, nanoseconds.
    pub(super) start_ns: u64,
    /// The worst of many clouds.
    pub(super) survey: Survey,
    /// Number of the latest question about changes; an older search is called off.
    latest_search: AtomicU64,
    kept: Mutex<Kept>,
    /// Requests that are being answered.
    requests: Mutex<usize>,
    /// Told when the last of them was.
    is_idle: Condvar,
}

/// A request that is being answered, until this is dropped.
pub(super) struct Request<'a>(&'a Session);

impl Drop for Request<'_> {
    fn drop(&mut self) {
        let mut requests = held(&self.0.requests);
        *requests -= 1;
        if *requests == 0 {
            self.0.is_idle.notify_all();
        }
    }
}

#[derive(Default)]
struct Kept {
    clouds: Vec<Arc<InspectedCloud>>,
    runs: Vec<Arc<Run>>,
    changes: Option<(Searched, ExplanationReport)>,
}

/// What was searched for changes: topic, frame, setting and points.
pub(super) type Searched = (String, u64, Setting, Vec<usize>);

impl Session {
    /// Opens a recording; its messages are not read.
    ///
    /// # Errors
    /// Those of [`Overview::read`], and [`Error::NoCloud`](crate::Error::NoCloud) if there is no
    /// topic with clouds or not the one that is named, or no topic has the frame.
    pub fn open(options: SessionOptions) -> Result<Self> {
        let overview = Overview::read(&options.input)?;
        let named: Vec<String> = options.topic.iter().cloned().collect();
        let chosen = choose_topics(&overview, &named, options.config.class_topic())?;
        if options.frame > 0 {
            let first = Selection::of_frames(options.frame..=options.frame);
            first.refuse_missing(&overview, &chosen)?;
        }
        let all = choose_topics(&overview, &[], options.config.class_topic()).unwrap_or_default();
        let is_cloud =
            |name: &str| chosen.values().chain(all.values()).any(|have| &*have.topic == name);
        let count = |name: &str| {
            overview.channels_of(name).map(|channel| message_count(&overview, channel.id)).sum()
        };
        let topics: Vec<TopicClouds> = topic_names(&overview)
            .into_iter()
            .filter(|name| is_cloud(name))
            .map(|name| TopicClouds { topic: name.to_owned(), clouds: count(name) })
            .collect();
        let first = chosen.values().find(|have| count(&have.topic) > 0);
        let first_topic = first.or(chosen.values().next()).map(|have| have.topic.to_string());
        Ok(Session {
            start_ns: overview.start_ns.unwrap_or(0),
            first_topic: first_topic.unwrap_or_default(),
            topics,
            options,
            survey: Survey::default(),
            latest_search: AtomicU64::new(0),
            kept: Mutex::default(),
            requests: Mutex::default(),
            is_idle: Condvar::new(),
        })
    }

    /// A frame, clustered by a setting.
    ///
    /// # Errors
    /// Those of [`encoded_cloud_at`], of decoding, and of the setting.
    pub(super) fn run(&self, topic: &str, frame: u64, setting: &Setting) -> Result<Arc<Run>> {
        let is_it = |run: &Run| {
            let message = &run.cloud.message;
            &*message.topic == topic && message.holds(frame) && run.setting == *setting
        };
        let kept = take(&mut self.kept().runs, |run| is_it(run), RUNS_KEPT);
        if let Some(run) = kept {
            return Ok(run);
        }
        let config = setting.config(&self.options.config)?;
        let cloud = self.cloud(topic, frame, &config)?;
        let run = Arc::new(Run::new(cloud, setting.clone(), config));
        self.kept().runs.push(Arc::clone(&run));
        Ok(run)
    }

    /// A frame decoded as a configuration asks for.
    fn cloud(
        &self,
        topic: &str,
        frame: u64,
        config: &AnnotateConfig,
    ) -> Result<Arc<InspectedCloud>> {
        let by = DecodedBy::of(config);
        let is_it = |cloud: &InspectedCloud| {
            let message = &cloud.message;
            &*message.topic == topic && message.holds(frame) && cloud.decoded_by == by
        };
        let kept = take(&mut self.kept().clouds, |cloud| is_it(cloud), CLOUDS_KEPT);
        if let Some(cloud) = kept {
            return Ok(cloud);
        }
        let at = CloudAt::Frame(frame);
        let message = encoded_cloud_at(&self.options.input, Some(topic), at, config.assemble)?;
        let truth = (&self.options.truth, self.options.is_truth_said);
        let cloud = Arc::new(InspectedCloud::decode(message, config, truth)?);
        self.kept().clouds.push(Arc::clone(&cloud));
        Ok(cloud)
    }

    /// Colour number of each instance of a run: its id where nothing is changed, as in figures;
    /// else that of the same object there, so that an object keeps its colour.
    ///
    /// # Errors
    /// Those of [`Session::run`].
    pub(super) fn colours(&self, run: &Run) -> Result<Vec<u32>> {
        let mut colours = ColourTracker::default();
        if run.setting != Setting::default() {
            let message = &run.cloud.message;
            let unchanged = self.run(&message.topic, message.number, &Setting::default())?;
            colours.colour_numbers(&unchanged.stages.instances);
        }
        Ok(colours.colour_numbers(&run.stages.instances))
    }

    /// Says that a request is being answered: work in the background waits meanwhile.
    pub(super) fn is_asked(&self) -> Request<'_> {
        *held(&self.requests) += 1;
        Request(self)
    }

    /// Waits until no request is being answered.
    pub(super) fn wait_until_idle(&self) {
        let requests = held(&self.requests);
        drop(self.is_idle.wait_while(requests, |requests| *requests > 0));
    }

    /// Says that a new search begins; returns its number.
    pub(super) fn begin_search(&self) -> u64 {
        self.latest_search.fetch_add(1, Ordering::SeqCst) + 1
    }

    /// Whether no search has begun since the one of that number.
    pub(super) fn is_latest_search(&self, number: u64) -> bool {
        self.latest_search.load(Ordering::SeqCst) == number
    }

    /// The explanation with its changes, if that was the last search that came to its end.
    pub(super) fn known_changes(&self, searched: &Searched) -> Option<ExplanationReport> {
        let kept = self.kept();
        let (_, report) = kept.changes.as_ref().filter(|(own, _)| own == searched)?;
        Some(report.clone())
    }

    /// Keeps the explanation of a search that came to its end.
    pub(super) fn keep_changes(&self, searched: Searched, report: &ExplanationReport) {
        self.kept().changes = Some((searched, report.clone()));
    }

    /// What a page needs to know once.
    pub(super) fn facts(&self) -> Value {
        let name = self.options.input.file_name().unwrap_or(self.options.input.as_os_str());
        json!({
            "name": name.to_string_lossy(),
            "is_remote": is_remote(&self.options.input),
            "topics": self.topics,
            "topic": self.first_topic,
            "frame": self.options.frame,
            "colours": ColourTables::new(),
            "presets": Preset::ALL.map(Preset::name),
            "preset": self.options.config.pipeline.preset,
            "methods": setting::method_names(),
            "method": self.options.config.pipeline.method_name(),
            "parameters": setting::parameters(),
            "parameters_over_time": setting::parameters_over_time(),
        })
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        held(&self.kept)
    }
}

/// What is behind a lock, also if a thread ended in the midst of it.
fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The item that is asked for, which becomes the latest; of too many the eldest is dropped.
fn take<T>(kept: &mut Vec<Arc<T>>, is_it: impl Fn(&T) -> bool, most: usize) -> Option<Arc<T>> {
    if let Some(place) = kept.iter().position(|item| is_it(item)) {
        let item = kept.remove(place);
        kept.push(Arc::clone(&item));
        return Some(item);
    }
    while kept.len() >= most {
        kept.remove(0);
    }
    None
}
