//! What a figure is made of: its panels and how they are laid out.

use super::plane::PlaneRegion;
use super::scene::PixelCrop;
use divmerge_core::pipeline::{Config, Stages};

/// A panel of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Panel {
    /// The range image by range.
    Range,
    /// The range image by intensity.
    Intensity,
    /// The object mask.
    Mask,
    /// The local components of the divide step.
    Components,
    /// The instances.
    Instances,
    /// The votes on the bird's-eye plane.
    Votes,
    /// The instances on the bird's-eye plane.
    BirdsEye,
}

impl Panel {
    /// All panels with their names on the command line.
    pub const NAMES: [(&'static str, Panel); 7] = [
        ("range", Panel::Range),
        ("intensity", Panel::Intensity),
        ("mask", Panel::Mask),
        ("components", Panel::Components),
        ("instances", Panel::Instances),
        ("votes", Panel::Votes),
        ("bev", Panel::BirdsEye),
    ];

    /// The usual panels of a clustered cloud: components and votes only of a method that has them.
    pub fn usual(config: &Config, stages: &Stages) -> Vec<Panel> {
        let FigureOptions { mut panels, .. } = FigureOptions::default();
        let has_components = config.other_method.is_none();
        let has_votes = has_components && stages.post_merge.tree.is_none();
        panels.retain(|panel| match panel {
            Panel::Components => has_components,
            Panel::Votes => has_votes,
            _ => true,
        });
        panels
    }

    /// Whether it shows the bird's-eye plane rather than the range image.
    pub fn is_plane(self) -> bool {
        matches!(self, Panel::Votes | Panel::BirdsEye)
    }
}

/// How a figure is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureOptions {
    /// Panels from the top. Default: mask, components, instances (as in the paper's first figure),
    /// votes, bev.
    pub panels: Vec<Panel>,
    /// Height of the whole range image over its width. Default 1/8 (the paper's).
    pub aspect: f64,
    /// Part of the range image that is shown. Default: all.
    pub crop: PixelCrop,
    /// Part of the plane that is shown. Default: around the objects that are shown.
    pub region: Option<PlaneRegion>,
    /// Pixels to the inch; a figure is 10.4 inches wide. Default 192.
    pub dpi: f64,
}

impl Default for FigureOptions {
    fn default() -> Self {
        FigureOptions {
            panels: vec![
                Panel::Mask,
                Panel::Components,
                Panel::Instances,
                Panel::Votes,
                Panel::BirdsEye,
            ],
            aspect: 1.0 / 8.0,
            crop: PixelCrop::default(),
            region: None,
            dpi: 192.0,
        }
    }
}
