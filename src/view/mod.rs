//! Pictures of a clustered cloud: figures as PNG or SVG, and the stream to the Rerun viewer
//! (`rerun_stream`, with the feature `rerun`). What looks changes nothing.
//!
//! A [`Scene`] is what is shown, [`figure`](figure()) lays panels out on a [`Canvas`], and [`png`](png())
//! and [`svg`](svg()) draw it. No display, no font of the system: the same input gives the same bytes.

pub mod canvas;
pub mod chart;
pub mod colours;
pub mod explanation;
pub mod figure;
pub mod font;
pub mod frame_scene;
pub mod matrix;
pub mod plane;
pub mod png;
pub mod ramp;
pub mod range_panel;
#[cfg(feature = "rerun")]
pub mod rerun_stream;
pub mod scene;
pub mod steps;
pub mod svg;
pub mod target;
pub mod theme;
pub mod triage_report;
pub mod viewer_layout;
pub mod vote_graph;

pub use canvas::Canvas;
pub use chart::{Line, LineChart, line_chart, line_charts};
pub use colours::ColourTracker;
pub use explanation::explanation;
pub use figure::{FigureOptions, Panel, figure};
pub use frame_scene::{ClusteredMessage, explained_scene, explanation_report};
pub use plane::Region;
pub use png::png;
pub use scene::{Crop, Scene, SceneClass};
pub use steps::{Step, step_figure, steps};
pub use svg::{inline_svg, svg};
pub use target::Target;
pub use viewer_layout::{ShownTopic, viewer_layout};
