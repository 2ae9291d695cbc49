//! The parameters of a run, read and set by path.

use std::sync::{Arc, LazyLock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::SettingError;
use super::kind::ParameterKind;
use super::parameter::{Parameter, nearest};
use super::schema::{add_parameters, schema_of};
use super::tree::{KeyOrder, find, find_mut};
use crate::cluster::Method;
use crate::cluster::params::{ClusterParams, Region};
use crate::over_time::TrackParams;
use crate::over_time::ego_motion::{EgoMotionParams, ScanParams};
use crate::pipeline::overrides::limits;
use crate::pipeline::{Config, Preset, SegmentVote, VehicleStrips};
use crate::range_image::ProjectionParams;
use crate::semantics::{GroundBleed, GroundParams, Smoothing};

/// Every parameter of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterSet {
    /// Name of the preset these parameters started from.
    #[serde(skip)]
    pub preset: &'static str,
    /// From cloud to range image.
    pub projection: ProjectionParams,
    /// How given classes are corrected by those around them; off: taken as they are.
    pub smoothing: Option<Smoothing>,
    /// How the ground is taken out of objects whose classes a network found; off: not at all.
    pub bleed: Option<GroundBleed>,
    /// How segments decide on the classes of their points where a network's bleed onto the ground;
    /// off: not at all.
    pub segment_vote: Option<SegmentVote>,
    /// Which long, low strips are no vehicles where a network's classes bleed onto the ground; off:
    /// all are.
    pub vehicle_strips: Option<VehicleStrips>,
    /// Ground removal, where there are no classes or a network's.
    pub ground: GroundParams,
    /// Divide, merge and what follows.
    pub cluster: ClusterParams,
    /// Objects followed from cloud to cloud.
    pub tracks: TrackParams,
    /// What registration keeps of a cloud.
    pub registration: ScanParams,
    /// The sensor's motion estimated from the clouds.
    pub ego_motion: EgoMotionParams,
    /// Another method in place of ours, whose parameters are under `method`.
    #[serde(skip)]
    pub other_method: Option<Arc<dyn Method>>,
}

/// Begins the paths of the parameters of another method.
const METHOD: &str = "method.";

impl ParameterSet {
    /// The parameters of a preset.
    pub fn of_preset(preset: Preset) -> Self {
        Self::of(&preset.config(), &GroundParams::default())
    }

    /// Preset `best` with every part of the method on, each with the values of the preset that has
    /// it: what a part has that is switched on.
    pub fn with_all_parts() -> Self {
        let mut all = ParameterSet::of_preset(Preset::Best);
        let (paper, authors) = (ClusterParams::paper(), ClusterParams::authors());
        all.cluster.birds_eye = paper.birds_eye;
        all.cluster.condition.gate = authors.condition.gate;
        all.cluster.condition.rays = authors.condition.rays;
        all
    }

    /// Those of a pipeline and of the ground removal; over time the usual ones.
    pub fn of(config: &Config, ground: &GroundParams) -> Self {
        ParameterSet {
            preset: config.preset,
            projection: config.projection.clone(),
            smoothing: config.smoothing,
            bleed: config.bleed,
            segment_vote: config.segment_vote,
            vehicle_strips: config.vehicle_strips,
            ground: ground.clone(),
            cluster: config.cluster.clone(),
            tracks: TrackParams::default(),
            registration: ScanParams::default(),
            ego_motion: EgoMotionParams::default(),
            other_method: config.other_method.clone(),
        }
    }

    /// Those of the pipeline.
    pub fn config(&self) -> Config {
        Config {
            preset: self.preset,
            projection: self.projection.clone(),
            smoothing: self.smoothing,
            bleed: self.bleed,
            segment_vote: self.segment_vote,
            vehicle_strips: self.vehicle_strips,
            cluster: self.cluster.clone(),
            other_method: self.other_method.clone(),
        }
    }

    /// All parameters, with those of another method.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut all = registry().to_vec();
        if let Some(method) = &self.other_method {
            let order = keys(&method.parameters());
            add_parameters(&method.schema(), METHOD.trim_end_matches('.'), &order, &mut all);
        }
        all
    }

    /// The value of a parameter: a number, true or false, a name, or a list; `None` if the part of
    /// the method that it belongs to is off.
    ///
    /// # Errors
    /// [`SettingError::Unknown`].
    pub fn get(&self, path: &str) -> Result<Option<Value>, SettingError> {
        let parameter = self.parameter(path)?;
        let (tree, below) = self.tree(path);
        Ok(find(&tree, below).map(|value| parameter.said(value)))
    }

    /// Sets a parameter. A text is read as at a command line: `0.3`, `8 deg`, `true`, `1,2`. A part
    /// that is switched on has its usual values.
    ///
    /// # Errors
    /// [`SettingError`]; nothing has changed then.
    pub fn set(&mut self, path: &str, value: &Value) -> Result<(), SettingError> {
        self.set_all([(path, value)])
    }

    /// Sets several parameters, one after the other.
    ///
    /// # Errors
    /// [`SettingError`]; nothing has changed then.
    pub fn set_all<'a>(
        &mut self,
        settings: impl IntoIterator<Item = (&'a str, &'a Value)>,
    ) -> Result<(), SettingError> {
        let mut changed = self.clone();
        for (path, value) in settings {
            changed = changed.with(path, value)?;
        }
        changed.check()?;
        *self = changed;
        Ok(())
    }

    /// The same with one parameter set, whether or not it fits the others.
    fn with(&self, path: &str, value: &Value) -> Result<Self, SettingError> {
        let parameter = self.parameter(path)?;
        let wrong = || SettingError::Wrong {
            path: path.to_owned(),
            value: value.as_str().map_or_else(|| value.to_string(), str::to_owned),
            wanted: parameter.wanted(),
            nearest: parameter.nearest_choices(value),
        };
        let value = parameter.read(value).ok_or_else(wrong)?;
        let (mut tree, below) = self.tree(path);
        let Some(place) = find_mut(&mut tree, below) else { return Err(self.off(path)) };
        match placed(&parameter, &value, place) {
            Some(value) => *place = value,
            None => return Ok(self.clone()),
        }
        self.with_tree(path, tree).ok_or_else(wrong)
    }

    fn parameter(&self, path: &str) -> Result<Parameter, SettingError> {
        let mut all = self.parameters();
        match all.iter().position(|parameter| parameter.path == path) {
            Some(place) => Ok(all.swap_remove(place)),
            None => {
                let names = all.iter().map(|parameter| parameter.path.as_str());
                Err(SettingError::Unknown { path: path.to_owned(), nearest: nearest(path, names) })
            }
        }
    }

    /// The values as a tree of JSON, and the path below its root.
    fn tree<'p>(&self, path: &'p str) -> (Value, &'p str) {
        match (path.strip_prefix(METHOD), &self.other_method) {
            (Some(below), Some(method)) => (method.parameters(), below),
            _ => (json(self), path),
        }
    }

    /// The same with the values of a tree; `None` if they do not fit the types.
    fn with_tree(&self, path: &str, tree: Value) -> Option<Self> {
        let (preset, other_method) = (self.preset, self.other_method.clone());
        match (path.starts_with(METHOD), &other_method) {
            (true, Some(method)) => {
                let other_method = Some(method.with_parameters(tree)?);
                Some(ParameterSet { other_method, ..self.clone() })
            }
            _ => {
                let values = serde_json::from_value::<ParameterSet>(tree).ok()?;
                Some(ParameterSet { preset, other_method, ..values })
            }
        }
    }

    /// The error of a parameter whose part is off.
    fn off(&self, path: &str) -> SettingError {
        let above = |parameter: &&Parameter| {
            path.strip_prefix(parameter.path.as_str()).is_some_and(|rest| rest.starts_with('.'))
        };
        let group = registry().iter().find(above).map_or("", |group| group.path.as_str());
        let rest = path[group.len()..].trim_start_matches('.');
        let is_choice = registry().iter().any(|parameter| {
            parameter.path == group && matches!(parameter.kind, ParameterKind::Choice { .. })
        });
        let value = if is_choice { rest.split('.').next().unwrap_or(rest) } else { "true" };
        let remedy = format!("{group}={value}");
        SettingError::Off { path: path.to_owned(), group: group.to_owned(), remedy }
    }

    /// Whether the parameters fit each other.
    fn check(&self) -> Result<(), SettingError> {
        let contradiction = |path: &str, problem: String| {
            Err(SettingError::Contradiction { path: path.to_owned(), problem })
        };
        if let Some((up, down)) = self.projection.field_of_view
            && let Err(problem) = limits::field_of_view((up.to_degrees(), down.to_degrees()))
        {
            return contradiction("projection.field_of_view", problem);
        }
        match &self.cluster.birds_eye {
            Some(birds_eye) if birds_eye.region != Region::Box && !birds_eye.transitive => {
                let problem = "one pass over pairs, cluster.birds_eye.transitive=false, takes \
                               region box";
                contradiction("cluster.birds_eye.region", problem.to_owned())
            }
            _ => Ok(()),
        }
    }
}

/// What is put in the place of a value; `None` if it can stay.
fn placed(parameter: &Parameter, value: &Value, place: &Value) -> Option<Value> {
    match &parameter.kind {
        ParameterKind::Switch if value == false => Some(Value::Null),
        ParameterKind::Switch if place.is_object() => None,
        ParameterKind::Switch => {
            find(&json(&ParameterSet::with_all_parts()), &parameter.path).cloned()
        }
        ParameterKind::Choice { .. } if parameter.said(place) == *value => None,
        ParameterKind::Choice { .. } => {
            let usual = ParameterSet::with_all_parts();
            let usual = find(&json(&usual), &parameter.path).cloned().unwrap_or_default();
            // A variant with parameters of its own.
            let has_own = value.as_str().is_some_and(|name| usual.get(name).is_some());
            Some(if has_own { usual } else { value.clone() })
        }
        _ => Some(value.clone()),
    }
}

/// All parameters but those of other methods, in the order of the steps.
pub fn registry() -> &'static [Parameter] {
    static REGISTRY: LazyLock<Vec<Parameter>> = LazyLock::new(|| {
        let (schema, mut all) = (schema_of::<ParameterSet>(), Vec::new());
        add_parameters(&schema, "", &keys(&ParameterSet::with_all_parts()), &mut all);
        all
    });
    &REGISTRY
}

fn json(parameters: &impl Serialize) -> Value {
    serde_json::to_value(parameters).unwrap_or_default()
}

/// The names of fields in their order.
fn keys(parameters: &impl Serialize) -> KeyOrder {
    let text = serde_json::to_string(parameters).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}
