//! What the Rerun viewer (<https://rerun.io>, 0.36) shows of a run. Only this folder knows Rerun.
//!
//! Entities of a cloud topic T, logged anew for each cloud:
//!
//! | entity | what |
//! | --- | --- |
//! | `T/cloud/class`, `.../component`, `.../instance` | the returns, coloured by what each is |
//! | `T/cloud/reason` | the returns by why each has no instance |
//! | `T/cloud/truth` | the returns by true object, where the truth is known |
//! | `T/boxes/objects`, `.../background` | boxes, with their names under the pointer |
//! | `T/boxes/names` | names of the largest objects |
//! | `T/votes/merged`, `.../rejoined`, `.../apart` | lines between components with votes |
//! | `T/dropped/unreached`, `.../too_small` | points of objects that ended without an instance |
//! | `T/tracks/boxes` | the objects as their tracks know them, where they are followed |
//! | `T/tracks/trails`, `.../sensor` | where over the ground what moves and the sensor were |
//! | `T/image/range`, `.../component`, `.../instance` | the range image, highest beam on top |
//! | `T/image/reason` | the same by reason |
//! | `T/series/milliseconds` | time of each stage |
//! | `T/series/instances` | number of instances |
//! | `T/series/suspicion` | how suspect the decisions are ([`triage`](crate::diagnose::triage)) |
//! | `T/log` | what was dropped and why |
//! | `T/explanation/points` | points A and B of an explanation (`divmerge explain --rerun`) |
//! | `T/explanation/votes/for`, `.../against` | lines between the pixels of each pair that voted |
//! | `T/explanation/instance`, `.../component`, `.../boxes` | the scene around the points |
//! | `T/image/explained/**` | points and pairs on the range image |
//! | `T/explanation/text` | the explanation in words |
//!
//! Timelines: `frame` (number of the cloud on its topic), `stamp` (of the cloud's header) and
//! `message_log_time` (as in Rerun's own MCAP reader). All 3-D entities carry the cloud's
//! coordinate frame.
//!
//! Colours go through class ids and an annotation context, two bytes a point instead of four. Ids
//! from 65520 on stand for reasons ([`Reason`](divmerge_core::cloud::Reason)). Numbers of
//! components and instances beyond start again at 1 in the clouds and images, but not in the
//! labels. A `.rrd` holds random ids and is never the same twice.

mod annotated;
mod blueprint;
mod explanation;
mod eye;
mod frame;
mod images;
mod layout;
mod names;
mod sinks;
mod stream;
mod trails;

pub use annotated::annotated_blueprint;
pub use stream::RerunStream;
