//! LiDAR instance clustering, from a cloud or a recording to an instance for every point.
//!
//! A sweep of a LiDAR becomes a range image, and an object mask says which of its pixels belong to
//! objects. A [`Method`] segments them into instances: divide and merge (Zhao, Zhang, Huang, arXiv
//! 2109.08224) grows local components and lets pairs of pixels on their borders vote; the default,
//! [`Config::best`], takes connected components and assembles them by the size of their class or,
//! without classes, cuts a tree of merges. Every point ends with an instance or with the [`Reason`]
//! why it has none.
//!
//! # One cloud
//!
//! ```
//! use divmerge::{Config, Drive, MaskSource, Scene, Sensor, Taxonomy, cluster};
//!
//! // A simulated sweep with a class per point; `PointCloud::new` takes columns of your own.
//! let frame = Drive::new(Sensor::Vlp16, Scene::Street, 1).frame(0);
//! let taxonomy = Taxonomy::semantic_kitti();
//!
//! let stages = cluster(&frame.cloud, MaskSource::Classes(&taxonomy), &Config::default());
//! for instance in stages.instances.iter().take(3) {
//!     let (name, centre) = (&instance.class_name, instance.bounds.centre);
//!     println!("{}: {name} at {centre:?} m, {} points", instance.id, instance.points);
//! }
//! let (instance, reason) = (stages.labels.instance[0], stages.labels.reason[0]);
//! println!("point 0 has instance {instance} ({})", reason.describe());
//! ```
//!
//! [`Stages`] owns every intermediate result, from the [`RangeImage`] to each decision of a merge.
//! Without classes, `MaskSource::NotGround(&GroundParams::default())` removes the ground instead.
//!
//! # One recording
//!
//! ```no_run
//! use std::{ops::ControlFlow, path::Path};
//!
//! use divmerge::{AnnotateOptions, annotate};
//!
//! let (input, output) = (Path::new("drive.mcap"), Path::new("annotated.mcap"));
//! let options = AnnotateOptions::default();
//! let report = annotate(input, output, &options, &mut |_| ControlFlow::Continue(()))?;
//! println!("{} messages added", report.annotations);
//! # divmerge::Result::Ok(())
//! ```
//!
//! [`for_each_frame`] clusters the clouds of a recording without writing anything.
//!
//! The default feature `cli` is the command line; a program of your own leaves it and its
//! dependencies out with `default-features = false`.
//!
//! Lengths are metres, angles radians, times nanoseconds, unless a name says otherwise. Modules
//! that are not listed here belong to the command and the Python package, and may change.
//! `docs/architecture.md` shows the way through the code.

#[doc(hidden)]
pub mod annotate;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod comparison;
#[doc(hidden)]
pub mod datasets;
#[doc(hidden)]
pub mod diagnose;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod evaluate;
#[doc(hidden)]
pub mod frames;
#[doc(hidden)]
pub mod inspect;
#[doc(hidden)]
pub mod messages;
#[doc(hidden)]
pub mod network;
#[doc(hidden)]
pub mod parameter_file;
#[doc(hidden)]
pub mod taxonomy_file;
#[doc(hidden)]
pub mod text;
#[doc(hidden)]
pub mod view;

#[doc(hidden)]
pub use divmerge_core::{
    cloud, cluster, geometry, over_time, parameters, pipeline, range_image, semantics,
};
#[doc(hidden)]
pub use divmerge_recording as recording;
#[doc(hidden)]
pub use divmerge_simulate as simulate;

pub use annotate::{
    AnnotateConfig, AnnotateOptions, AnnotationReport, ClusteredFrame, Form, FrameVisitor,
    RunEvent, Semantics, TopicReport, annotate, for_each_frame,
};
pub use cloud::sensor_frame::SensorFrame;
pub use cloud::taxonomy::{Class, Taxonomy};
pub use cloud::{
    Body, Classification, CoarseClass, Detection, Instance, PointClasses, PointCloud, PointColumns,
    PointLabels, Reason, UprightBox,
};
pub use cloud::{CloudFrames, SensorOrigin};
pub use cluster::{ClusterParams, Method, MethodInput, Segmentation};
pub use divmerge_core::{CloudError, ParameterError};
pub use divmerge_simulate::{Drive, Scene, Sensor, SimulatedFrame};
pub use error::{Error, FrameError, Result};
pub use evaluate::{Panoptic, PanopticQuality};
pub use frames::{CloudKey, LabelledFrames, Selection};
pub use network::{Network, NetworkOptions};
pub use parameters::{ParameterKind, ParameterSet};
pub use pipeline::{Config, Preset, StageTimes, Stages, run as cluster};
pub use range_image::{Projection, ProjectionParams, RangeImage};
pub use semantics::{GroundParams, MaskSource, ObjectMask, Smoothing};
pub use taxonomy_file::read_taxonomy;

/// Linear algebra: poses and rotations in public signatures are types of this crate.
pub use nalgebra;
