//! How suspect the decisions of a frame are, without any truth.

mod between;
mod facts;
mod joins;
mod pairs;
mod parts;
mod points;
mod sizes;
mod votes;

use serde::Serialize;

use crate::explain::Frame;
use facts::Facts;

/// What is suspect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Pieces put together by size across a wide gap, or to the full accepted size.
    ThinJoin,
    /// Two instances of one class that would fit one object, or nearly so.
    CouldBeOne,
    /// Two instances of one class that all but touch.
    AlmostTouching,
    /// Longer or wider than objects of its class come.
    TooLarge,
    /// Two masses with a gap between them.
    TwoMasses,
    /// Hardly a pixel.
    Leftover,
    /// A substantial part joined on a thin majority of votes.
    ThinMajority,
    /// Bare majorities one after the other.
    BareChain,
    /// A border that voted against joining, but not by much.
    RefusedVotes,
    /// Object points without an instance.
    Unlabelled,
    /// Pixels of several classes.
    MixedClasses,
    /// Beams that came back with nothing.
    MissingReturns,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 12] = [
        Kind::ThinJoin,
        Kind::CouldBeOne,
        Kind::AlmostTouching,
        Kind::TooLarge,
        Kind::TwoMasses,
        Kind::Leftover,
        Kind::ThinMajority,
        Kind::BareChain,
        Kind::RefusedVotes,
        Kind::Unlabelled,
        Kind::MixedClasses,
        Kind::MissingReturns,
    ];
}

/// Something that may be wrong with a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suspect {
    /// What is suspect.
    pub kind: Kind,
    /// How far the figure is beyond where the kind fires: 0 to 1.
    pub evidence: f64,
    /// How likely it is that something is wrong: 0 to 1.
    pub score: f64,
    /// Instances concerned, the one most in doubt first.
    pub instances: Vec<u32>,
    /// One or two points of the cloud.
    pub points: Vec<usize>,
    /// Metres, sensor frame.
    pub position: [f64; 3],
    /// The figure.
    pub measured: f64,
    /// What it is held against.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// x
    pub extra: Vec<f64>,
    /// The same in words.
    pub sentence: String,
}

/// All suspects of a frame.
pub fn suspects(frame: &Frame) -> Vec<Suspect> {
    let facts = Facts::of(frame);
    let mut all = Vec::new();
    all.extend(joins::thin_joins(&facts));
    all.extend(pairs::pairs(&facts));
    all.extend(sizes::too_large(&facts));
    all.extend(sizes::two_masses(&facts));
    all.extend(sizes::leftover(&facts));
    all.extend(votes::merges(&facts));
    all.extend(votes::refused(&facts));
    all.extend(points::unlabelled(&facts));
    all.extend(points::mixed_classes(&facts));
    all.extend(points::missing_returns(&facts));
    all
}

/// 0 at one value, 1 at the other, straight between them.
fn ramp(value: f64, zero: f64, one: f64) -> f64 {
    ((value - zero) / (one - zero)).clamp(0.0, 1.0)
}
