//! How far the survey of many clouds has come, and what it found.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard};

use serde::Serialize;

use super::setting::Setting;

/// Most cases that are listed.
const MOST_CASES: usize = 600;

/// A survey in the background; a new one takes the place of the one before.
#[derive(Default)]
pub(super) struct Survey {
    state: Mutex<SurveyState>,
}

/// How far a survey has come, and what it found.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct SurveyState {
    /// Number of the survey, from 1; 0 is none.
    pub number: u64,
    /// The topic that is looked through.
    pub topic: String,
    /// The parameters.
    pub setting: Setting,
    /// Messages that were looked at: clouds, or parts of them.
    pub done: u64,
    /// Messages to look at.
    pub of: u64,
    /// Whether it is over.
    pub is_over: bool,
    /// Whether objects were followed over time.
    pub is_followed: bool,
    /// What kept it from going on.
    pub problem: Option<String>,
    /// The cases, the worst first.
    pub cases: Vec<SurveyCase>,
    /// The track of each instance, by frame and id, once objects were followed.
    #[serde(skip)]
    pub tracks: Arc<HashMap<(u64, u32), u32>>,
}

/// A case to look at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SurveyCase {
    /// `triage` or `failures`.
    pub source: &'static str,
    /// Number of the cloud on its topic.
    pub frame: u64,
    /// How likely it is a failure, 0 to 1; 1 of a failure that is known.
    pub score: f64,
    /// What is wrong, in a word or two.
    pub kind: String,
    /// What of the method did it, of a failure.
    pub cause: Option<&'static str>,
    /// A sentence.
    pub sentence: String,
    /// The instance; 0 is none.
    pub instance: u32,
    /// The instance or the true object in words.
    pub title: String,
    /// Class of the instance, or of the true object.
    pub class: String,
    /// Points of the object.
    pub size: u64,
    /// One or two points to look at, by index.
    pub points: Vec<usize>,
    /// Their positions, metres, the recording's frame.
    pub at: Vec<[f64; 3]>,
    /// The object over time, once it is followed; 0 is none.
    pub track: u32,
    /// A picture of the range image around it, PNG in base64.
    pub thumbnail: Option<String>,
}

impl Survey {
    /// How far it is, and what was found.
    pub fn state(&self) -> SurveyState {
        self.lock().clone()
    }

    /// The object over time that each instance of a frame is, by its id, as far as the survey
    /// followed them with the same parameters.
    pub fn tracks(&self, topic: &str, frame: u64, setting: &Setting) -> BTreeMap<u32, u32> {
        let state = self.lock();
        if state.topic != topic || state.setting != *setting {
            return BTreeMap::new();
        }
        let of_frame = state.tracks.iter().filter(|((number, _), _)| *number == frame);
        of_frame.map(|(&(_, id), &track)| (id, track)).collect()
    }

    /// Ends the survey that goes on; what it has found stays.
    pub fn stop(&self) -> SurveyState {
        let mut state = self.lock();
        if !state.is_over {
            state.number += 1;
            state.is_over = true;
        }
        state.clone()
    }

    /// The state, held.
    pub fn lock(&self) -> MutexGuard<'_, SurveyState> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Changes the state of a survey unless another has taken its place; whether it has not.
    pub fn update(&self, number: u64, change: impl FnOnce(&mut SurveyState)) -> bool {
        let mut state = self.lock();
        let is_current = state.number == number;
        if is_current {
            change(&mut state);
        }
        is_current
    }
}

/// The failures, and then the suspects, the worst first; not more than can be listed.
pub(super) fn worst_first(cases: &mut Vec<SurveyCase>) {
    cases.sort_by(|a, b| {
        let by_score = b.score.total_cmp(&a.score).then(b.size.cmp(&a.size));
        by_score.then((a.frame, a.instance).cmp(&(b.frame, b.instance)))
    });
    cases.truncate(MOST_CASES);
}
