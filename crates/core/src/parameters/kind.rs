//! What the value of a parameter may be.

use serde::Serialize;
use serde_json::Value;

/// What the value of a parameter may be.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ParameterKind {
    /// Whether a part of the method is there: true or false. Its own parameters follow, and can be
    /// set while it is true.
    Switch,
    /// true or false.
    Flag,
    /// A finite number.
    Number {
        /// Limits.
        #[serde(flatten)]
        limits: Limits,
    },
    /// A whole number from 0 on.
    Whole {
        /// Limits.
        #[serde(flatten)]
        limits: Limits,
    },
    /// One of some names.
    Choice {
        /// The names.
        choices: Vec<Choice>,
    },
    /// Numbers in a row, or rows of them.
    List {
        /// Numbers in a row, where their count is fixed.
        length: Option<usize>,
        /// Limits of each number.
        #[serde(flatten)]
        limits: Limits,
    },
}

/// A name that a parameter may have as its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Choice {
    /// The name.
    pub name: String,
    /// What it means.
    pub doc: String,
}

/// Between which numbers a value must lie, and between which it usually does.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Limits {
    /// The least number.
    pub min: Option<f64>,
    /// The greatest number.
    pub max: Option<f64>,
    /// A number below which it must not go, and which it must not be.
    pub above: Option<f64>,
    /// A number above which it must not go, and which it must not be.
    pub below: Option<f64>,
    /// What is usual: the ends of a slider.
    pub slider: Option<[f64; 2]>,
}

impl Limits {
    /// Whether a number is finite and within them.
    pub fn contain(&self, number: f64) -> bool {
        number.is_finite()
            && self.min.is_none_or(|min| number >= min)
            && self.max.is_none_or(|max| number <= max)
            && self.above.is_none_or(|above| number > above)
            && self.below.is_none_or(|below| number < below)
    }

    /// In words, as in `above 0 and at most 10`; empty without limits.
    fn describe(&self) -> String {
        let word = |text: &str, limit: Option<f64>| {
            limit.map(|limit| format!("{text} {}", rounded(limit)))
        };
        let low = word("from", self.min).or(word("above", self.above));
        let high = word("to", self.max).or(word("below", self.below));
        match (low, high) {
            (Some(low), Some(high)) => format!(" {low} {high}"),
            (Some(low), None) if self.min.is_some() => format!(" {low} on"),
            (Some(only), None) => format!(" {only}"),
            (None, Some(high)) if self.max.is_some() => format!(" up {high}"),
            (None, Some(high)) => format!(" {high}"),
            (None, None) => String::new(),
        }
    }
}

/// A limit with as many digits as people want to read.
fn rounded(number: f64) -> String {
    ((number * 1e6).round() / 1e6).to_string()
}

impl ParameterKind {
    /// What is wanted, in words.
    pub fn describe(&self) -> String {
        match self {
            ParameterKind::Switch | ParameterKind::Flag => "true or false".to_owned(),
            ParameterKind::Number { limits } => format!("a number{}", limits.describe()),
            ParameterKind::Whole { limits } => format!("a whole number{}", limits.describe()),
            ParameterKind::Choice { choices } => {
                let names: Vec<&str> = choices.iter().map(|choice| choice.name.as_str()).collect();
                match names.split_last() {
                    Some((last, others)) if !others.is_empty() => {
                        format!("{} or {last}", others.join(", "))
                    }
                    _ => names.concat(),
                }
            }
            ParameterKind::List { length: Some(length), limits } => {
                format!("{length} numbers, each{}", limits.describe())
            }
            ParameterKind::List { length: None, .. } => {
                "a list in square brackets, as in [1.5, 3]".to_owned()
            }
        }
    }

    /// Whether a value is of this kind and within its limits.
    pub(super) fn allows(&self, value: &Value) -> bool {
        match self {
            ParameterKind::Switch | ParameterKind::Flag => value.is_boolean(),
            ParameterKind::Number { limits } => {
                value.as_f64().is_some_and(|number| limits.contain(number))
            }
            ParameterKind::Whole { limits } => {
                value.as_u64().is_some_and(|whole| limits.contain(whole as f64))
            }
            ParameterKind::Choice { choices } => {
                choices.iter().any(|choice| value.as_str() == Some(&choice.name))
            }
            ParameterKind::List { length, limits } => {
                let allows = |item: &Value| match item {
                    Value::Array(inner) => inner.iter().all(Value::is_number),
                    item => item.as_f64().is_some_and(|number| limits.contain(number)),
                };
                value.as_array().is_some_and(|items| {
                    length.is_none_or(|length| items.len() == length) && items.iter().all(allows)
                })
            }
        }
    }
}
