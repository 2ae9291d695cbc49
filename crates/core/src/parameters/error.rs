//! Why a parameter cannot be read or set.

/// Why a parameter cannot be read or set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingError {
    /// There is none of that path.
    #[error("no parameter `{path}`{}", did_you_mean(nearest))]
    Unknown {
        /// The path asked for.
        path: String,
        /// The paths nearest to it, the nearest first.
        nearest: Vec<String>,
    },

    /// It belongs to a part of the method that is switched off.
    #[error("`{path}` has no effect while `{group}` is off: set {remedy} first")]
    Off {
        /// The path asked for.
        path: String,
        /// The part that is off.
        group: String,
        /// The setting that switches it on, as in `cluster.tree=true`.
        remedy: String,
    },

    /// The value is of another kind, or out of the limits.
    #[error("`{path}` = {value}: must be {wanted}{}", question(nearest))]
    Wrong {
        /// The parameter.
        path: String,
        /// The value, as JSON.
        value: String,
        /// Kind and limits.
        wanted: String,
        /// Of a choice, the name nearest to the value.
        nearest: Vec<String>,
    },

    /// The value does not fit those of other parameters.
    #[error("`{path}`: {problem}")]
    Contradiction {
        /// The parameter.
        path: String,
        /// What it contradicts, and what to do.
        problem: String,
    },
}

fn did_you_mean(nearest: &[String]) -> String {
    match nearest {
        [] => "; `divmerge params` lists them all".to_owned(),
        names => question(names),
    }
}

/// A question behind a name or value that is wrong; nothing where none is near.
fn question(nearest: &[String]) -> String {
    match nearest {
        [] => String::new(),
        names => {
            let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
            format!("; did you mean {}?", names.join(" or "))
        }
    }
}
