//! Arguments that several commands share, a file a group.

pub mod boxes;
pub mod coordinates;
pub mod geometry;
pub mod method;
pub mod objects;
pub mod parameters;
pub mod pictures;
pub mod selection;
pub mod tracks;
pub mod truth;
pub mod values;
