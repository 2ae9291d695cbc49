//! Pictures of a clustered cloud: figures as PNG, SVG or PDF, pages of triage cases, and the stream
//! to the Rerun viewer (`rerun_stream`, with the feature `rerun`). Viewing changes no result.
//!
//! A [`FrameScene`] is what is shown. [`figure`](figure()), [`StepPages`] and
//! [`explanation`](explanation()) lay it out on a [`Canvas`]; [`png`](png()), [`svg`](svg()) and
//! [`pdf`](pdf()) draw that. No display and no font of the system is needed: the
//! same input gives the same bytes.

mod axes;
mod canvas;
pub mod case_pages;
mod chart;
mod colour_tables;
mod colour_tracker;
mod dark_page;
mod explanation;
mod figure;
mod font;
mod frame_scene;
mod icicle;
mod image_axes;
mod layout;
mod legend;
mod look;
mod matrix;
mod numbers;
mod options;
mod pdf;
mod plane;
mod plane_panel;
mod png;
mod ramp;
mod range_panel;
#[cfg(feature = "rerun")]
pub mod rerun_stream;
mod scene;
mod step_figure;
mod step_pages;
mod steps;
mod style;
mod svg;
mod target;
mod theme;
mod thumbnail;
mod track_figure;
mod tree_figure;
pub mod triage_report;
mod viewer_layout;
mod visible;
mod vote_graph;

pub use canvas::Canvas;
pub use chart::{Line, LineChart, line_chart, line_charts};
pub use colour_tables::{ColourTables, class_colours};
pub use colour_tracker::ColourTracker;
pub use dark_page::dark_page;
pub use explanation::explanation;
pub use figure::{brightest, far, figure};
pub use frame_scene::{
    ClusteredMessage, describe_run, explained_scene, explanation_report, intensity,
};
pub use look::Theme;
pub use matrix::merge_moves;
pub use options::{FigureOptions, Panel};
pub use pdf::pdf;
pub use plane::PlaneRegion;
pub use png::{png, size_in_pixels};
pub use scene::{FrameScene, PixelCrop, Window};
pub use step_pages::StepPages;
pub use svg::{inline_svg, svg};
pub use target::Target;
pub use thumbnail::thumbnail;
pub use track_figure::track_figure;
pub use viewer_layout::{ShownTopic, viewer_layout};
pub use vote_graph::{Decision, VoteEdge, vote_edges};
