//! Definitions of the messages that are read or written, put together from the `.msg` and `.json`
//! files beside this one; those of protocol buffers come with the `foxglove` crate.

pub mod ros1;
mod ros2;
mod schema;

pub use ros2::{
    CAMERA_INFO, DETECTED_OBJECTS, DETECTION_ARRAY, DIAGNOSTIC_ARRAY, FOXGLOVE_POINT_CLOUD,
    MARKER_ARRAY, POINT_CLOUD2, TF_MESSAGE,
};
pub use schema::MessageSchema;
