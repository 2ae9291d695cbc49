//! The worst of many clouds, looked for in the background: what triage suspects, what failures
//! there are where there is truth, and which instances are one object over time.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::cloud::InspectedCloud;
use super::requests::{Outcome, Problem, SurveyRequest};
use super::run::Run;
use super::scores::{FoundFailure, found_failures};
use super::session::Session;
use super::setting::Setting;
use super::survey_state::{SurveyCase, SurveyState, worst_first};
use crate::annotate::{AnnotateConfig, FollowedDrive, TrackOptions, follow_drive};
use crate::diagnose::failures::ObjectOrigin;
use crate::diagnose::triage::ranking::recorded_positions;
use crate::diagnose::triage::{Triage, TriageParams, triage};
use crate::error::{Error, Result};
use crate::frames::EncodedClouds;
use crate::view::thumbnail;
use divmerge_core::over_time::InstanceTrack;

/// Most frames of a survey.
const MOST_FRAMES: u64 = 2000;
/// Most cases of a frame that are listed.
const MOST_OF_FRAME: usize = 24;
/// Height over width of the whole range image in thumbnails, and their width over height.
const THUMBNAIL: (f64, f64) = (1.0 / 8.0, 3.0);

impl Session {
    /// Begins to look through some frames of a topic, in a thread of its own.
    ///
    /// # Errors
    /// If the setting is wrong, or there are no such frames.
    pub(super) fn begin_survey(self: &Arc<Self>, asked: SurveyRequest) -> Outcome<()> {
        let config = asked.setting.config(&self.options.config)?;
        let known = self.topics.iter().find(|known| known.topic == asked.topic);
        let clouds = known.map_or(0, |known| known.clouds);
        let [first, end] = asked.frames;
        let frames = first..end.min(clouds).min(first.saturating_add(MOST_FRAMES));
        if frames.is_empty() {
            let problem = format!(
                "{} has {clouds} clouds: there are none from {first} to {end}",
                asked.topic
            );
            return Err(Problem::wrong(problem));
        }
        let number = {
            let mut state = self.survey.lock();
            *state = SurveyState {
                number: state.number + 1,
                topic: asked.topic.clone(),
                setting: asked.setting.clone(),
                of: frames.end - frames.start,
                ..SurveyState::default()
            };
            state.number
        };
        let session = Arc::clone(self);
        std::thread::spawn(move || {
            let job = Job { session: &session, number, config };
            let ended = job.look_through(&asked, frames);
            session.survey.update(number, |state| {
                state.is_over = true;
                state.problem = ended.err().map(|error| error.to_string());
            });
        });
        Ok(())
    }
}

/// A survey that goes on.
struct Job<'a> {
    session: &'a Session,
    number: u64,
    config: AnnotateConfig,
}

impl Job<'_> {
    fn look_through(&self, asked: &SurveyRequest, frames: Range<u64>) -> Result<()> {
        let input = &self.session.options.input;
        let last = frames.end - 1;
        let (topic, assemble) = (Some(asked.topic.as_str()), self.config.assemble);
        let clouds = EncodedClouds::open_assembled(input, topic, frames.start..=last, assemble)?;
        let mut several = false;
        for (number, message) in clouds.enumerate() {
            self.session.wait_until_idle();
            let message = message?;
            several = number > 0;
            let messages = message.messages();
            let found = self.of_cloud(InspectedCloud::decode(
                message,
                &self.config,
                (&self.session.options.truth, self.session.options.is_truth_said),
            ));
            let found = match found {
                Err(Error::Frame(_)) => Vec::new(),
                found => found?,
            };
            let goes_on = self.session.survey.update(self.number, |state| {
                state.done = (state.done + messages).min(state.of);
                state.cases.extend(found);
                worst_first(&mut state.cases);
            });
            if !goes_on {
                return Ok(());
            }
        }
        if several && self.config.pipeline.other_method.is_none() {
            self.follow(asked, frames.start..=last)?;
        }
        Ok(())
    }

    /// The cases of a cloud.
    fn of_cloud(&self, cloud: Result<InspectedCloud>) -> Result<Vec<SurveyCase>> {
        let setting = Setting::default();
        let run = Run::new(Arc::new(cloud?), setting, self.config.clone());
        let scene = run.scene(self.session.start_ns, Vec::new());
        let picture = |points: &[usize]| {
            let (aspect, shape) = THUMBNAIL;
            thumbnail(&scene, points, aspect, shape).map(|png| BASE64.encode(png))
        };
        let suspects = suspects(&run);
        let failures = found_failures(&run).into_iter().map(|found| failure(&run, found));
        let mut cases: Vec<SurveyCase> =
            suspects.into_iter().take(MOST_OF_FRAME).chain(failures.take(MOST_OF_FRAME)).collect();
        for case in &mut cases {
            case.thumbnail = picture(&case.points);
        }
        Ok(cases)
    }

    /// Follows objects over the frames and notes which cases are of one.
    fn follow(&self, asked: &SurveyRequest, frames: std::ops::RangeInclusive<u64>) -> Result<()> {
        let input = &self.session.options.input;
        let options = TrackOptions::default();
        let mut goes_on = |_| match self.session.survey.update(self.number, |_| {}) {
            true => {
                self.session.wait_until_idle();
                Ok(())
            }
            false => Err(Error::Interrupted { path: input.clone() }),
        };
        let asked = (Some(asked.topic.as_str()), frames);
        let drive = match follow_drive(input, asked, (&self.config, &options), &mut goes_on) {
            Err(Error::Interrupted { .. }) => return Ok(()),
            drive => drive?,
        };
        let tracks = tracks(&drive);
        self.session.survey.update(self.number, |state| {
            state.is_followed = true;
            for case in &mut state.cases {
                let track = tracks.get(&(case.frame, case.instance));
                case.track = track.copied().unwrap_or(0);
            }
            state.tracks = Arc::new(tracks);
        });
        Ok(())
    }
}

/// The track of each instance, by frame and id.
fn tracks(drive: &FollowedDrive) -> HashMap<(u64, u32), u32> {
    let of_cloud = drive.clouds.iter().flat_map(|cloud| {
        cloud.instances.iter().map(|found| ((cloud.number, found.id), track_of(&found.track)))
    });
    of_cloud.collect()
}

/// The track of an instance, of one of several objects that of its first cell.
fn track_of(track: &InstanceTrack) -> u32 {
    match track {
        InstanceTrack::Whole(track) => *track,
        InstanceTrack::Parts(of_cell) => of_cell.first().copied().unwrap_or(0),
    }
}

/// What triage suspects in a run.
fn suspects(run: &Run) -> Vec<SurveyCase> {
    if run.config.pipeline.other_method.is_some() {
        return Vec::new();
    }
    let found: Triage = triage(&run.clustered(), &TriageParams::default());
    let instances = &run.stages.instances;
    let of_case = |case: &crate::diagnose::triage::Case| {
        let suspect = &found.suspects[case.suspects[0]];
        let instance = case.instance.and_then(|id| instances.get(id as usize - 1));
        SurveyCase {
            source: "triage",
            frame: run.cloud.message.number,
            score: case.score,
            kind: suspect.kind.name().to_owned(),
            cause: None,
            sentence: suspect.sentence.clone(),
            instance: case.instance.unwrap_or(0),
            title: instance.map(|instance| instance.title()).unwrap_or_default(),
            class: instance.map_or_else(String::new, class_of),
            size: instance.map_or(0, |instance| u64::from(instance.points)),
            at: recorded_positions(&run.cloud.cloud, &suspect.points),
            points: suspect.points.clone(),
            track: 0,
            thumbnail: None,
        }
    };
    found.cases().iter().map(of_case).collect()
}

fn class_of(instance: &divmerge_core::cloud::Instance) -> String {
    match &instance.coarse_class {
        Some(coarse) => coarse.class.name().to_owned(),
        None => instance.class_name.clone(),
    }
}

/// A failure of a run as a case.
fn failure(run: &Run, found: FoundFailure) -> SurveyCase {
    let FoundFailure { failure, sentence, at } = found;
    let judged = &failure.judged;
    let instance = match failure.side {
        ObjectOrigin::Found => judged.object.id,
        ObjectOrigin::True => judged.parts.first().map_or(0, |part| part.object.id),
    };
    let whose = match failure.side {
        ObjectOrigin::True => "true",
        ObjectOrigin::Found => "found",
    };
    SurveyCase {
        source: "failures",
        frame: run.cloud.message.number,
        score: 1.0,
        kind: judged.verdict.name().to_owned(),
        cause: Some(failure.cause.step()),
        sentence,
        instance,
        title: format!("{whose} {}", judged.class_name).trim_end().to_owned(),
        class: judged.class_name.clone(),
        size: judged.points,
        points: failure.show.clone(),
        at,
        track: 0,
        thumbnail: None,
    }
}
