//! What the Rerun viewer (<https://rerun.io>, 0.36) shows of a run. Only this folder knows Rerun.
//!
//! Entities of a cloud topic T, logged anew for each cloud:
//!
//! | entity | what |
//! | --- | --- |
//! | `T/cloud/class`, `.../component`, `.../instance` | the returns, coloured by what each is |
//! | `T/boxes` | the instances' boxes, labelled with id and class |
//! | `T/votes/merged`, `.../apart` | lines between centroids of components with votes |
//! | `T/dropped/unreached`, `.../too_small` | points of objects that ended without an instance |
//! | `T/image/range`, `.../component`, `.../instance` | the range image, highest beam on top |
//! | `T/series/milliseconds` | time of each stage |
//! | `T/series/instances` | number of instances |
//! | `T/series/suspicion` | how suspect the decisions are ([`triage`](crate::diagnose::triage)) |
//! | `T/log` | what was dropped and why |
//! | `T/explanation/points` | points A and B of an explanation (`divmerge explain --rerun`) |
//! | `T/explanation/votes/for`, `.../against` | lines between the pixels of each pair that voted |
//! | `T/explanation/text` | the answer in words |
//!
//! Timelines: `frame` (number of the cloud on its topic), `stamp` (of the cloud's header) and
//! `message_log_time` (as in Rerun's own MCAP reader). All 3-D entities carry the cloud's
//! coordinate frame.
//!
//! Colours go through class ids and an annotation context, two bytes a point instead of four. Ids
//! above 65528 stand for reasons ([`Reason`](divmerge_core::cloud::Reason)); component and instance
//! numbers above that start again at 1 in the clouds and images, but not in the labels. A `.rrd`
//! holds random ids and is never the same twice.

mod blueprint;
mod frame;
mod names;
mod sinks;
mod stream;

pub use stream::RerunStream;
