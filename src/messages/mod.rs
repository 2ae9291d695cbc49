//! Messages: their bytes and what they mean. Clouds in every format that is read, boxes and classes
//! beside them, and all that is written: annotated clouds, objects, transforms, diagnostics.
//!
//! Nothing here opens a file or knows of recordings.

pub mod annotation;
pub mod boxes;
pub mod camera_info;
pub mod classes;
pub mod clouds;
pub mod definitions;
pub mod diagnostics;
pub(crate) mod fixes;
pub mod objects;
pub mod palette;
pub(crate) mod poses;
pub mod qos;
pub mod ros;
pub(crate) mod stamp;
pub mod transforms;
