//! What is known of a drive beyond its single clouds.

pub mod ego_motion;
