//! Parameters of what is compared.

use serde_json::Value;

use super::contender::Contender;
use crate::annotate::AnnotateConfig;
use divmerge_core::parameters::{ParameterSet, SettingError};

/// A parameter that is set, for one contender or for each that has it.
#[derive(Debug, Clone, PartialEq)]
pub struct ContenderSetting {
    /// The one contender.
    pub contender: Option<Contender>,
    /// Where the parameter is, as in `cluster.voxel` or, of a method that is not ours,
    /// `method.reach`.
    pub path: String,
    /// Its value, as [`ParameterSet::set`] takes it.
    pub value: Value,
}

impl ContenderSetting {
    /// Of a path, or of the path of one contender, as in `dbscan:method.reach`.
    ///
    /// # Errors
    /// The contenders that there are.
    pub fn new(path: &str, value: Value) -> Result<Self, String> {
        let (contender, path) = match path.split_once(':') {
            Some((name, path)) => (Some(name.trim().parse()?), path.trim()),
            None => (None, path),
        };
        Ok(ContenderSetting { contender, path: path.to_owned(), value })
    }

    fn is_of(&self, contender: Contender) -> bool {
        let is_voxel = matches!(contender, Contender::Voxel(_)) && self.path == "cluster.voxel";
        !is_voxel && self.contender.is_none_or(|own| own == contender)
    }
}

impl Contender {
    /// A method with the parameters of this contender, and with those settings that are for it and
    /// that it has.
    ///
    /// # Errors
    /// [`SettingError`] of a value that is wrong, or that contradicts another.
    pub fn with_settings(
        self,
        method: &AnnotateConfig,
        settings: &[ContenderSetting],
    ) -> Result<AnnotateConfig, SettingError> {
        let pipeline = self.config(&method.taxonomy);
        let method = AnnotateConfig { pipeline, ..method.clone() };
        let mut parameters = method.parameters();
        let mut tried = parameters.clone();
        let has = |setting: &&ContenderSetting| {
            setting.is_of(self)
                && !matches!(
                    tried.set(&setting.path, &setting.value),
                    Err(SettingError::Unknown { .. } | SettingError::Off { .. })
                )
        };
        let own: Vec<&ContenderSetting> = settings.iter().filter(has).collect();
        parameters.set_all(own.iter().map(|own| (own.path.as_str(), &own.value)))?;
        Ok(method.with_parameters(&parameters))
    }
}

/// Whether each setting is one of a contender's.
///
/// # Errors
/// [`SettingError`] of a value that is wrong, and of a parameter that no contender has or that is
/// of one that is not among them.
pub fn check_settings(
    contenders: &[Contender],
    settings: &[ContenderSetting],
    method: &AnnotateConfig,
) -> Result<(), SettingError> {
    let mut all: Vec<(Contender, ParameterSet)> = Vec::new();
    for &contender in contenders {
        // Its parameters with all that are set, so that a part may be switched on and then set.
        let parameters = contender.with_settings(method, settings)?.parameters();
        all.push((contender, parameters));
    }
    for setting in settings {
        let of_it = all.iter_mut().filter(|(contender, _)| setting.is_of(*contender));
        let tried: Vec<_> =
            of_it.map(|(_, parameters)| parameters.set(&setting.path, &setting.value)).collect();
        if !tried.iter().any(Result::is_ok) {
            return Err(problem(setting, tried.into_iter().filter_map(Result::err).collect()));
        }
    }
    Ok(())
}

/// What is wrong with a setting that no contender takes: what says most.
fn problem(setting: &ContenderSetting, mut problems: Vec<SettingError>) -> SettingError {
    problems.sort_by_key(|problem| match problem {
        SettingError::Off { .. } => 0,
        SettingError::Unknown { nearest, .. } if !nearest.is_empty() => 1,
        _ => 2,
    });
    problems.into_iter().next().unwrap_or_else(|| {
        let name = setting.contender.map_or("paper".to_owned(), Contender::name);
        SettingError::Contradiction {
            path: setting.path.clone(),
            problem: format!("`{name}` is not among the methods that are compared"),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_core::pipeline::Preset;

    const OURS: [Contender; 2] =
        [Contender::Preset(Preset::Best), Contender::Preset(Preset::Paper)];

    fn set(path: &str, value: &str) -> ContenderSetting {
        ContenderSetting::new(path, value.into()).unwrap()
    }

    fn problem(path: &str, value: &str) -> String {
        let others = ["dbscan", "euclidean"].map(|name| name.parse().unwrap());
        let contenders = [&OURS[..], &others, &[Contender::Voxel(0.3)]].concat();
        let method = AnnotateConfig::default();
        check_settings(&contenders, &[set(path, value)], &method)
            .map_or_else(|error| error.to_string(), |()| String::new())
    }

    fn value(contender: &str, settings: &[ContenderSetting], path: &str) -> Value {
        let contender: Contender = contender.parse().unwrap();
        let method = contender.with_settings(&AnnotateConfig::default(), settings).unwrap();
        method.parameters().get(path).unwrap().unwrap()
    }

    #[test]
    fn settings_go_to_the_contenders_that_have_them() {
        let settings = [
            set("cluster.voxel", "0.3"),
            set("paper:cluster.merge_ratio", "0.7"),
            set("dbscan:method.reach", "0.9"),
        ];
        assert_eq!(value("best", &settings, "cluster.voxel"), 0.3);
        assert_eq!(value("paper", &settings, "cluster.voxel"), 0.3);
        assert_eq!(value("paper", &settings, "cluster.merge_ratio"), 0.7);
        assert_ne!(value("best", &settings, "cluster.merge_ratio"), 0.7);
        assert_eq!(value("dbscan", &settings, "method.reach"), 0.9);
        assert_ne!(value("euclidean", &settings, "method.reach"), 0.9);
        let both = [set("method.reach", "0.9")];
        assert_eq!(value("euclidean", &both, "method.reach"), 0.9);
        let voxel = Contender::Voxel(1.0).with_settings(&AnnotateConfig::default(), &settings);
        assert_eq!(voxel.unwrap().pipeline.cluster.voxel, 1.0);
    }

    #[test]
    fn a_setting_that_none_takes_is_a_mistake() {
        assert_eq!(problem("cluster.voxel", "0.3"), "");
        assert_eq!(problem("method.reach", "0.3"), "");
        // Off in `best`, but not in `paper`.
        assert_eq!(problem("cluster.birds_eye.region", "box"), "");
        assert!(problem("best:cluster.birds_eye.region", "box").contains("has no effect while"));
        assert!(problem("method.reachs", "1").ends_with("did you mean `method.reach`?"));
        assert!(problem("cluster.voxle", "1").ends_with("did you mean `cluster.voxel`?"));
        assert!(problem("method.reach", "-1").contains("must be a number"));
        assert!(problem("alpine:method.reach", "1").contains("`alpine` is not among"));
        let unknown = ContenderSetting::new("dbscam:method.reach", 1.into()).unwrap_err();
        assert!(unknown.ends_with("did you mean `dbscan`?"), "{unknown}");
    }
}
