//! Methods side by side: how well and how fast they segment the same clouds ([`measure()`]), and
//! classes that are wrong by a known amount to compare them on ([`corrupt`]). [`methods`] has the
//! methods of others.

mod contender;
pub mod corruption;
mod measure;
pub mod methods;
mod settings;

pub use contender::{Contender, DIVIDE_AND_MERGE, USUAL_CONTENDERS};
pub use corruption::{Corruption, Surroundings, corrupt};
pub use measure::{MethodScores, measure};
pub use settings::{ContenderSetting, check_settings};
