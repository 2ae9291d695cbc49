//! Plane and space geometry without a word of this domain: grids, circles, nearest points, plane
//! figures, fitted planes, disjoint sets, assignments.

pub mod assignment;
pub mod circle;
pub mod disjoint_sets;
pub mod footprint;
pub mod grid;
pub mod kd_tree;
pub mod plane_fit;
pub mod statistics;
