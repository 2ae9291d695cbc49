//! A parameter, and how its value is read.

use serde::Serialize;
use serde_json::Value;

use super::kind::ParameterKind;

/// A parameter: where it is, what it means, and what it may be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Where it is, as in `cluster.condition.angle`.
    pub path: String,
    /// What it means.
    pub doc: String,
    /// Its unit; `None` for shares, factors and counts.
    pub unit: Option<String>,
    /// Where it comes from: a section of the paper or of ALGORITHM, or somebody else's work; `None`
    /// for our own.
    pub source: Option<String>,
    /// The word for "none", where its value can be left to the data.
    pub word_for_none: Option<&'static str>,
    /// Whether `unlimited` is allowed, too.
    pub is_unlimited: bool,
    /// What its value may be.
    #[serde(flatten)]
    pub kind: ParameterKind,
}

/// The word for a whole number without a limit.
pub const UNLIMITED: &str = "unlimited";

impl Parameter {
    /// Kind, limits and unit in words, as in `a number above 0 (m)`.
    pub fn wanted(&self) -> String {
        let mut text = self.kind.describe();
        match self.unit.as_deref() {
            Some("rad") => text += " (rad, or degrees as in `10 deg`)",
            Some(unit) => text += &format!(" ({unit})"),
            None => {}
        }
        if self.is_unlimited {
            text += &format!(", or {UNLIMITED}");
        }
        text + &self.word_for_none.map_or(String::new(), |word| format!(", or {word}"))
    }

    /// Of a choice, the name nearest to a text, if one is near.
    pub(super) fn nearest_choices(&self, value: &Value) -> Vec<String> {
        match (&self.kind, value) {
            (ParameterKind::Choice { choices }, Value::String(text)) => {
                nearest(text, choices.iter().map(|choice| choice.name.as_str()))
            }
            _ => Vec::new(),
        }
    }

    /// A value as it is in JSON; `None` if it is of another kind or out of limits. A text is read
    /// as at a command line: `0.3`, `8 deg`, `true`, `1,2`.
    pub(super) fn read(&self, value: &Value) -> Option<Value> {
        let value = match value {
            Value::String(text) => self.parse(text.trim())?,
            other => other.clone(),
        };
        let value = match (&self.kind, value.as_f64()) {
            (ParameterKind::Whole { .. }, Some(whole)) if value.is_f64() => {
                let is_whole = whole.fract() == 0.0 && (0.0..9e15).contains(&whole);
                is_whole.then(|| (whole as u64).into())?
            }
            _ => value,
        };
        let is_none = value.is_null() && self.word_for_none.is_some();
        let is_unlimited = self.is_unlimited && value == u64::MAX;
        (is_none || is_unlimited || self.kind.allows(&value)).then_some(value)
    }

    fn parse(&self, text: &str) -> Option<Value> {
        if self.word_for_none == Some(text) {
            return Some(Value::Null);
        }
        if self.is_unlimited && text == UNLIMITED {
            return Some(u64::MAX.into());
        }
        match self.kind {
            ParameterKind::Switch | ParameterKind::Flag => match text {
                "true" | "on" => Some(true.into()),
                "false" | "off" => Some(false.into()),
                _ => None,
            },
            ParameterKind::Number { .. } => Some(self.number(text)?.into()),
            ParameterKind::Whole { .. } => Some(text.parse::<u64>().ok()?.into()),
            ParameterKind::Choice { .. } => Some(text.into()),
            ParameterKind::List { .. } if text.starts_with('[') => serde_json::from_str(text).ok(),
            ParameterKind::List { .. } => {
                let numbers: Option<Vec<f64>> =
                    text.split(',').map(|number| self.number(number.trim())).collect();
                numbers.map(Value::from)
            }
        }
    }

    /// A finite number, of an angle also in degrees.
    fn number(&self, text: &str) -> Option<f64> {
        let is_angle = self.unit.as_deref() == Some("rad");
        let number = match text.strip_suffix("deg").filter(|_| is_angle) {
            Some(degrees) => degrees.trim_end().parse::<f64>().ok()?.to_radians(),
            None => text.parse().ok()?,
        };
        number.is_finite().then_some(number)
    }

    /// A value of the tree in the words of the outside.
    pub(super) fn said(&self, value: &Value) -> Value {
        match (&self.kind, value) {
            (ParameterKind::Switch, value) => value.is_object().into(),
            (ParameterKind::Choice { .. }, Value::Object(variant)) => {
                variant.keys().next().map_or(Value::Null, |name| name.as_str().into())
            }
            (_, Value::Null) => self.word_for_none.into(),
            (_, value) if self.is_unlimited && *value == u64::MAX => UNLIMITED.into(),
            (_, value) => value.clone(),
        }
    }
}

/// The names nearest to one that is not there: those that end in the same word, else the one that
/// differs in the fewest letters, if these are at most a third.
pub(super) fn nearest<'a>(path: &str, all: impl Iterator<Item = &'a str> + Clone) -> Vec<String> {
    fn last(path: &str) -> &str {
        path.rsplit('.').next().unwrap_or(path)
    }
    let ends: Vec<String> =
        all.clone().filter(|other| last(other) == last(path)).map(str::to_owned).collect();
    if !ends.is_empty() {
        return ends;
    }
    let (name, has_group) = (path.to_lowercase(), path.contains('.'));
    let distance = |other: &str| {
        strsim::damerau_levenshtein(&name, if has_group { other } else { last(other) })
    };
    let near = all.map(|other| (distance(other), other)).min();
    let bound = (path.chars().count() / 3).max(1);
    near.filter(|(distance, _)| *distance <= bound)
        .map(|(_, near)| near.to_owned())
        .into_iter()
        .collect()
}
