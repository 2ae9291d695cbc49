//! Plane and space geometry without a word of this domain: grids, nearest points, plane figures,
//! disjoint sets.

pub mod disjoint_sets;
pub mod footprint;
pub mod grid;
pub mod kd_tree;
pub mod statistics;
