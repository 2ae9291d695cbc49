//! What can be suspect in a frame, and how a suspect is reported.

use serde::Serialize;

/// What is suspect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SuspectKind {
    /// Two substantial parts put together across a gap.
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
    /// A substantial part that joined on a thin majority of votes.
    ThinMajority,
    /// Bare majorities one after the other.
    BareChain,
    /// A border that voted against joining, but not by much.
    RefusedVotes,
    /// Object points without an instance.
    Unlabelled,
    /// Pixels of several classes, or of corrected ones.
    MixedClasses,
    /// Beams that came back with nothing.
    MissingReturns,
    /// A cut of the tree of merges that was worth little more than another.
    CloseCut,
}

impl SuspectKind {
    /// All kinds in the order of their numbers.
    pub const ALL: [SuspectKind; 13] = [
        SuspectKind::ThinJoin,
        SuspectKind::CouldBeOne,
        SuspectKind::AlmostTouching,
        SuspectKind::TooLarge,
        SuspectKind::TwoMasses,
        SuspectKind::Leftover,
        SuspectKind::ThinMajority,
        SuspectKind::BareChain,
        SuspectKind::RefusedVotes,
        SuspectKind::Unlabelled,
        SuspectKind::MixedClasses,
        SuspectKind::MissingReturns,
        SuspectKind::CloseCut,
    ];

    /// Name in a table of figures, name for people (without commas), and weight.
    fn row(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::ThinJoin => ("thin_join", "thin join", 0.5),
            Self::CouldBeOne => ("could_be_one", "could be one", 0.9),
            Self::AlmostTouching => ("almost_touching", "almost touching", 0.05),
            Self::TooLarge => ("too_large", "too large", 0.5),
            Self::TwoMasses => ("two_masses", "two masses", 0.5),
            Self::Leftover => ("leftover", "leftover", 0.05),
            Self::ThinMajority => ("thin_majority", "thin majority", 0.1),
            Self::BareChain => ("bare_chain", "bare chain", 0.1),
            Self::RefusedVotes => ("refused_votes", "refused votes", 0.2),
            Self::Unlabelled => ("unlabelled", "without instance", 0.1),
            Self::MixedClasses => ("mixed_classes", "mixed classes", 0.1),
            Self::MissingReturns => ("missing_returns", "missing returns", 0.1),
            Self::CloseCut => ("close_cut", "close cut", 0.5),
        }
    }

    /// Its name for people, without commas.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// Its name in a table of figures.
    pub fn key(self) -> &'static str {
        self.row().0
    }

    /// How often the kind is right where its evidence is full, 0 to 1.
    ///
    /// Chosen in coarse steps on simulated drives of all scenes and sensors, seeds 1 to 6, presets
    /// `best` and `paper`. A kind that tends to come with a stronger one (neighbours that touch,
    /// with those that could be one) has little weight of its own.
    pub fn weight(self) -> f64 {
        self.row().2
    }
}

/// Parameters of triage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TriageParams {
    /// Instances of fewer points weigh less, in proportion. Default 50, from which on
    /// semantic-kitti-api counts a segment without a match.
    pub min_points: u64,
}

impl Default for TriageParams {
    fn default() -> Self {
        TriageParams { min_points: crate::evaluate::panoptic::MIN_POINTS }
    }
}

/// An instance that a suspect names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Concern {
    /// Its id.
    pub instance: u32,
    /// The part of the suspect's score that falls on it, 0 to 1.
    pub share: f64,
}

impl Concern {
    /// An instance on which the whole score falls.
    pub(super) fn whole(instance: u32) -> Self {
        Concern { instance, share: 1.0 }
    }
}

/// A sign that something is wrong with a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suspect {
    /// What is suspect.
    pub kind: SuspectKind,
    /// Probability that something is wrong, 0 to 1.
    pub score: f64,
    /// Strength of the figure in relation to the strongest of its kind, 0 to 1.
    pub evidence: f64,
    /// The instances concerned, the one most in doubt first; none of points that no instance is
    /// near.
    pub concerns: Vec<Concern>,
    /// One or two points of the cloud for [`explain`](crate::diagnose::explain::explain()).
    pub points: Vec<usize>,
    /// Where, metres, sensor frame.
    pub position: [f64; 3],
    /// The figure that was measured.
    pub measured: f64,
    /// The bound it is compared with.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// A sentence that says all this.
    pub sentence: String,
}

/// 0 at one value, 1 at the other, linear between them.
pub(super) fn ramp(value: f64, zero: f64, one: f64) -> f64 {
    ((value - zero) / (one - zero)).clamp(0.0, 1.0)
}
