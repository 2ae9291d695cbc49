//! The nouns of the domain: point clouds, classes, instances, and how a cloud's frame stands.

pub mod block;
pub mod cloud_frames;
pub mod coarse_class;
pub mod crop;
pub mod ego_body;
mod extent;
mod fill_values;
pub mod instances;
mod known_taxonomies;
pub mod length_unit;
pub mod point_cloud;
pub mod sensor_frame;
pub mod shape;
pub mod taxonomy;
pub mod transforms;
pub mod up;
pub mod upright_box;

pub use block::Block;
pub use cloud_frames::{CloudFrames, SensorOrigin};
pub use coarse_class::{Body, CoarseClass};
pub use crop::{Crop, Ego};
pub use ego_body::EgoBody;
pub use instances::{Instance, PointLabels, Reason};
pub use length_unit::LengthUnit;
pub use point_cloud::{PointClasses, PointCloud, PointColumns, wide};
pub use shape::Classification;
pub use transforms::Transforms;
pub use upright_box::{Detection, UprightBox};
