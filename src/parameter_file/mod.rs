//! The parameters of a run as TOML: written with what they mean, and read back.
//!
//! ```toml
//! preset = "best"
//!
//! [options]
//! semantics = "ground"
//!
//! [cluster]
//! voxel = 0.5
//! tree = false
//!
//! [cluster.condition]
//! angle = "10 deg"
//! ```
//!
//! Tables and keys are the paths of parameters. A part of the method that is off is `false` in the
//! place of its table; a table switches its part on. `[method]` holds the `name` of another method
//! and its parameters, `[options]` the other options of the command line.

mod write;

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Map, Value};

use crate::error::{Error, Result};
use divmerge_core::parameters::{ParameterKind, ParameterSet, SettingError, registry};
use divmerge_core::pipeline::Preset;

pub use write::{explained_toml, plain_toml};

/// A table of a file that is not one of parameters.
const OPTIONS: &str = "options";
/// The same.
const NEEDS: &str = "needs";

/// The options of a run beside its parameters.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RunOptions {
    /// Options of the command line with their values, without dashes; an option without a value has
    /// none.
    pub given: BTreeMap<String, Vec<String>>,
    /// Options that have to be given again, since they name files; and what they were.
    pub needs: BTreeMap<String, String>,
}

/// The parameters of a run, as a file has them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParameterFile {
    /// The preset they start from.
    pub preset: Option<Preset>,
    /// Another method in place of ours, or ours by its name.
    pub method: Option<String>,
    /// The other options.
    pub options: RunOptions,
    /// Paths and values, in an order in which they can be set.
    pub values: Vec<(String, Value)>,
}

impl ParameterFile {
    /// Reads a TOML file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::ParameterFile`] if it is no such file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| Error::Io { path: path.to_owned(), source })?;
        Self::parse(&text)
            .map_err(|problem| Error::ParameterFile { path: path.to_owned(), problem })
    }

    /// Reads TOML. Paths and values of parameters are checked when they are set.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let root: Map<String, Value> =
            toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
        let mut file = ParameterFile::default();
        for (name, value) in root {
            match (name.as_str(), value) {
                ("preset", Value::String(preset)) => file.preset = Some(preset.parse()?),
                (OPTIONS, Value::Object(options)) => file.options.given = texts(options)?,
                (NEEDS, Value::Object(needs)) => {
                    let each = texts(needs)?.into_iter();
                    file.options.needs = each.map(|(name, was)| (name, was.concat())).collect();
                }
                ("preset" | OPTIONS | NEEDS, value) => {
                    let wanted = if name == "preset" { "a name" } else { "a table" };
                    return Err(format!("`{name}` = {value}: must be {wanted}"));
                }
                (_, value) => add_values(&name, value, &mut file.values),
            }
        }
        if let Some(place) = file.values.iter().position(|(path, _)| path == "method.name") {
            let (_, name) = file.values.remove(place);
            file.method = Some(name.as_str().ok_or("`method.name` must be a name")?.to_owned());
        }
        Ok(file)
    }

    /// Sets the parameters.
    ///
    /// # Errors
    /// Those of [`ParameterSet::set_all`]; nothing has changed then.
    pub fn apply(&self, parameters: &mut ParameterSet) -> std::result::Result<(), SettingError> {
        parameters.set_all(self.values.iter().map(|(path, value)| (path.as_str(), value)))
    }
}

/// The values of options as texts.
fn texts(
    options: Map<String, Value>,
) -> std::result::Result<BTreeMap<String, Vec<String>>, String> {
    let text = |value: Value| match value {
        Value::String(text) => Some(text),
        number @ Value::Number(_) => Some(number.to_string()),
        _ => None,
    };
    let mut found = BTreeMap::new();
    for (name, value) in options {
        let wrong = || format!("`options.{name}`: must be a text, a list of texts, or true");
        let values = match value {
            Value::Bool(true) => Vec::new(),
            Value::Bool(false) => continue,
            Value::Array(values) => {
                values.into_iter().map(text).collect::<Option<_>>().ok_or_else(wrong)?
            }
            value => vec![text(value).ok_or_else(wrong)?],
        };
        found.insert(name, values);
    }
    Ok(found)
}

/// Adds the values of a table, after what switches it on.
fn add_values(path: &str, value: Value, found: &mut Vec<(String, Value)>) {
    let Value::Object(fields) = value else {
        found.push((path.to_owned(), value));
        return;
    };
    let kind = registry().iter().find(|parameter| parameter.path == path);
    match kind.map(|parameter| &parameter.kind) {
        Some(ParameterKind::Switch) => found.push((path.to_owned(), true.into())),
        Some(ParameterKind::Choice { .. }) => {
            let name = fields.keys().next().cloned().unwrap_or_default();
            found.push((path.to_owned(), name.into()));
        }
        _ => {}
    }
    for (name, value) in fields {
        add_values(&format!("{path}.{name}"), value, found);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::comparison::methods::Dbscan;
    use divmerge_core::parameters::ParameterSet;

    /// Parameters that are those of no preset.
    fn odd() -> ParameterSet {
        let mut odd = ParameterSet::of_preset(Preset::Paper);
        for (path, value) in [
            ("cluster.tree", "on"),
            ("cluster.tree.gap", "0.1234567890123456"),
            ("cluster.birds_eye", "off"),
            ("cluster.condition.rays", "nominal"),
            ("cluster.condition.rays.nominal.row_step", "0.3 deg"),
            ("cluster.gap_columns", "unlimited"),
            ("projection.field_of_view", "2 deg, -24.8 deg"),
            ("projection.rows", "40"),
            ("tracks.lag_s", "1e-7"),
            ("ego_motion.voxels", "1,2,4"),
        ] {
            odd.set(path, &value.into()).unwrap();
        }
        odd.other_method = Some(Arc::new(Dbscan { reach: 0.7, min_points: 4 }));
        odd
    }

    #[test]
    fn what_is_written_is_read_back_to_the_last_digit() {
        let presets = Preset::ALL.map(ParameterSet::of_preset);
        for parameters in presets.into_iter().chain([odd()]) {
            let options = RunOptions {
                given: BTreeMap::from([
                    ("topic".to_owned(), vec!["/a \"b\"\u{7f}\u{1}".to_owned(), "/c".to_owned()]),
                    ("only".to_owned(), Vec::new()),
                ]),
                needs: BTreeMap::from([("taxonomy".to_owned(), "FILE".to_owned())]),
            };
            let both = [plain_toml(&parameters, &options), explained_toml(&parameters, |_| true)];
            for (place, text) in both.iter().enumerate() {
                let file = ParameterFile::parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
                assert_eq!(
                    file.options,
                    if place == 0 { options.clone() } else { RunOptions::default() }
                );
                let mut read = ParameterSet::of_preset(file.preset.unwrap());
                assert_eq!(file.method.is_some(), parameters.other_method.is_some());
                read.other_method = parameters.other_method.as_ref().map(|_| {
                    let usual: Arc<dyn divmerge_core::cluster::Method> =
                        Arc::new(Dbscan::default());
                    usual
                });
                file.apply(&mut read).unwrap();
                assert_eq!(read, parameters, "{text}");
            }
        }
    }

    #[test]
    fn a_few_lines_of_a_person_are_enough() {
        let file = ParameterFile::parse(
            "[cluster]\nvoxel = 1\ntree = \"off\"\n[cluster.birds_eye]\nmargin = 0.2\n\
             [cluster.condition]\nangle = \"8 deg\"\n[options]\nthreads = 4\nonly = true\n",
        )
        .unwrap();
        let mut parameters = ParameterSet::of_preset(Preset::Best);
        file.apply(&mut parameters).unwrap();
        assert_eq!(file.preset, None);
        assert_eq!(parameters.cluster.voxel, 1.0);
        assert_eq!(parameters.cluster.condition.angle, 8_f64.to_radians());
        assert_eq!(parameters.cluster.birds_eye.map(|birds_eye| birds_eye.margin), Some(0.2));
        assert!(parameters.cluster.tree.is_none());
        assert_eq!(file.options.given["threads"], ["4"]);
        assert!(file.options.given["only"].is_empty());
    }

    #[test]
    fn what_is_wrong_with_a_file_is_named() {
        for (text, problem) in [
            ("preset = \"bets\"", "`bets` is no preset"),
            ("preset = 1", "`preset` = 1: must be a name"),
            ("options = 1", "`options` = 1: must be a table"),
            ("voxel = ", "line 1"),
            ("[options]\ntopic = [true]", "`options.topic`"),
            ("[method]\nname = 1", "`method.name`"),
        ] {
            let found = ParameterFile::parse(text).unwrap_err();
            assert!(found.contains(problem), "{found}");
        }
        let mut parameters = ParameterSet::of_preset(Preset::Best);
        for (text, problem) in [
            ("[clutser]\nvoxel = 1", "did you mean `cluster.voxel`"),
            ("[cluster]\ncondition = 1", "no parameter `cluster.condition`"),
            ("[method]\nreach = 1.0", "no parameter `method.reach`"),
        ] {
            let file = ParameterFile::parse(text).unwrap();
            let found = file.apply(&mut parameters).unwrap_err().to_string();
            assert!(found.contains(problem), "{found}");
        }
    }

    #[test]
    fn each_parameter_stands_with_its_meaning_in_lines_that_fit() {
        for preset in Preset::ALL {
            let text = explained_toml(&ParameterSet::of_preset(preset), |_| true);
            for parameter in registry() {
                let key = parameter.path.rsplit('.').next().unwrap();
                let first: String = parameter.doc.split(' ').take(4).collect::<Vec<_>>().join(" ");
                assert!(text.contains(key) && text.contains(&first), "{}: {text}", parameter.path);
            }
            let long = text.lines().find(|line| line.chars().count() > 100);
            assert_eq!(long, None);
        }
        let mut changed = ParameterSet::of_preset(Preset::Best);
        changed.set("cluster.voxel", &0.3.into()).unwrap();
        assert!(explained_toml(&changed, |_| true).contains("\nvoxel = 0.3 # preset best: 0.5\n"));
        assert!(
            explained_toml(&changed, |_| true)
                .contains("\nangle = 0.17453292519943295 # 10 degrees\n")
        );
    }
}
