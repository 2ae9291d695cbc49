//! Figures of a clustered cloud, as PNG or SVG.
//!
//! A [`Scene`] is what is shown, [`figure`](figure()) lays panels out on a [`Canvas`], and [`png`](png())
//! and [`svg`](svg()) draw it. No display, no font of the system: the same input gives the same bytes.

pub mod canvas;
pub mod colours;
pub mod figure;
pub mod font;
pub mod matrix;
pub mod plane;
pub mod png;
pub mod ramp;
pub mod range_panel;
pub mod scene;
pub mod steps;
pub mod svg;
pub mod theme;
pub mod vote_graph;

pub use canvas::Canvas;
pub use colours::ColourTracker;
pub use figure::{FigureOptions, Panel, figure};
pub use plane::Region;
pub use png::png;
pub use scene::{Crop, Scene, SceneClass};
pub use steps::{Step, step_figure, steps};
pub use svg::svg;
