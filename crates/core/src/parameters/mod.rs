//! Every parameter of a run: listed with its meaning, unit, limits and source, and read and set by
//! its path, as in `cluster.condition.angle`.
//!
//! The structs of the rooms are the one source. Fields give the paths, their doc comments the
//! meaning, their types the kind, attributes of `schemars` beside them the rest:
//!
//! | attribute | meaning |
//! | --- | --- |
//! | `range(min = ..., max = ...)` | limits, both allowed |
//! | `"exclusiveMinimum"`, `"exclusiveMaximum"` | limits that are not allowed themselves |
//! | `"unit"` | the unit; without it a share, a factor or a count |
//! | `"slider"` | what is usual, as two numbers |
//! | `"source"` | section or equation of the paper, or whose it is; without it: ours |
//!
//! ```
//! use divmerge_core::parameters::ParameterSet;
//! use divmerge_core::pipeline::Preset;
//!
//! let mut parameters = ParameterSet::of_preset(Preset::Paper);
//! parameters.set("cluster.voxel", &0.3.into())?;
//! parameters.set("cluster.condition.angle", &"8 deg".into())?;
//! assert_eq!(parameters.get("cluster.voxel")?, Some(0.3.into()));
//! assert_eq!(parameters.config().cluster.condition.angle, 8_f64.to_radians());
//!
//! let wrong = parameters.set("voxel", &0.3.into()).unwrap_err();
//! assert!(wrong.to_string().contains("did you mean `cluster.voxel`"));
//! # Ok::<(), divmerge_core::parameters::SettingError>(())
//! ```

mod error;
mod kind;
mod parameter;
mod schema;
mod set;
mod tree;

pub use error::SettingError;
pub use kind::{Choice, Limits, ParameterKind};
pub use parameter::{Parameter, UNLIMITED};
pub use schema::schema_of;
pub use set::{ParameterSet, registry};

#[cfg(test)]
mod tests;
