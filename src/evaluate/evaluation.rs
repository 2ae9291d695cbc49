//! The scores of scans with truth.

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::entropy::{Entropies, entropies, true_parts};
use super::objects::{ObjectScores, ObjectSums, ObjectTruth};
use super::over_time::{Lstq, OverTime, TubeAssociation};
use super::panoptic::Panoptic;
use super::report::PanopticReport;
use super::tracking::{Tracking, TrackingScores};
use crate::error::{Error, Result};
use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Nanoseconds from scan to scan where scans have no time.
pub const SCAN_STEP_NS: u64 = 100_000_000;

/// Which metrics are computed, and over which classes.
#[derive(Debug, Clone, Copy)]
pub struct MetricSet<'a> {
    /// What the ids of classes mean.
    pub taxonomy: &'a Taxonomy,
    /// Unmatched segments of fewer points are neither spurious nor missed.
    pub min_points: u64,
    /// Whether to compute over- and under-segmentation entropies, which need the clouds.
    pub entropy: bool,
    /// Whether to score ids over time: LSTQ, changes, occlusions and HOTA.
    pub over_time: bool,
}

/// One side of a scan of N points.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ScanLabels {
    /// N: raw class id.
    pub class: Vec<u16>,
    /// N: id of the segment; class and instance together.
    pub segment: Vec<u32>,
    /// N: instance, 0 for none.
    pub instance: Vec<u32>,
}

impl ScanLabels {
    /// From a class and an instance for each point.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn of_columns(class: &[u32], instance: Vec<u32>) -> Self {
        assert_eq!(class.len(), instance.len(), "columns of different length");
        let (class, segment) = segments(class, &instance);
        ScanLabels { class, segment, instance }
    }

    /// Whether no point has a class.
    pub fn has_no_classes(&self) -> bool {
        self.class.iter().all(|&class| class == 0)
    }

    /// From SemanticKITTI's label words, class | instance << 16.
    pub fn of_words(words: Vec<u32>) -> Self {
        ScanLabels {
            class: words.iter().map(|&word| word as u16).collect(),
            instance: words.iter().map(|&word| word >> 16).collect(),
            segment: words,
        }
    }
}

/// Classes of 16 bits, and a number for each pair of class and instance. Where all instances fit 16
/// bits, the number is SemanticKITTI's word, class | instance << 16.
pub fn segments(class: &[u32], instance: &[u32]) -> (Vec<u16>, Vec<u32>) {
    // Some recordings keep the whole word in the field of the class.
    let class: Vec<u16> = class.iter().map(|&class| class as u16).collect();
    let pairs = class.iter().zip(instance);
    let segment = if instance.iter().all(|&instance| instance <= u32::from(u16::MAX)) {
        pairs.map(|(&class, &instance)| u32::from(class) | instance << 16).collect()
    } else {
        let mut number: FxHashMap<(u16, u32), u32> = FxHashMap::default();
        let mut number_of = |pair| {
            // From 1: 0 is none.
            let next = number.len() as u32 + 1;
            *number.entry(pair).or_insert(next)
        };
        pairs.map(|(&class, &instance)| number_of((class, instance))).collect()
    };
    (class, segment)
}

/// Sums over scans, from which [`Scores`] are computed.
#[derive(Debug)]
pub struct Evaluation<'a> {
    metrics: MetricSet<'a>,
    panoptic: Panoptic,
    over_time: OverTime,
    tracking: Tracking,
    entropies: Vec<Entropies>,
    objects: ObjectSums,
    /// Whether a class was found in any scan.
    has_classes: bool,
    scans: u64,
    points: u64,
}

/// The scores of a number of scans.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scores {
    /// Scans.
    pub scans: u64,
    /// Points of these.
    pub points: u64,
    /// Panoptic quality, if classes were found.
    #[serde(flatten)]
    pub report: Option<PanopticReport>,
    /// How well objects were found, if no classes were.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub objects: Option<ObjectScores>,
    /// Entropies of each scan, if asked for, or no classes were found and the clouds are there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entropy: Option<Vec<Entropies>>,
    /// LSTQ, if asked for and classes were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_time: Option<Lstq>,
    /// Association alone, if LSTQ is asked for and no classes were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub association: Option<TubeAssociation>,
    /// Changes of ids, occlusions and HOTA, if LSTQ is asked for.
    #[serde(flatten)]
    pub tracking: Option<TrackingScores>,
}

impl<'a> Evaluation<'a> {
    /// No scan yet.
    pub fn new(metrics: MetricSet<'a>) -> Self {
        Evaluation {
            metrics,
            panoptic: Panoptic::of(metrics.taxonomy, metrics.min_points),
            over_time: OverTime::of(metrics.taxonomy, metrics.min_points),
            tracking: Tracking::new(metrics.min_points),
            entropies: Vec::new(),
            objects: ObjectSums::default(),
            has_classes: false,
            scans: 0,
            points: 0,
        }
    }

    /// Adds a scan: its time in nanoseconds, the labels found and the true ones, each with the
    /// place it was read from, and the cloud if entropies are computed ([`Self::needs_cloud`]).
    ///
    /// # Errors
    /// [`Error::UnknownClass`] if the taxonomy does not know a class.
    ///
    /// # Panics
    /// If the sides differ in length.
    pub fn add(
        &mut self,
        time_ns: u64,
        found: (&ScanLabels, &str),
        truth: (&ScanLabels, &str),
        cloud: Option<&PointCloud>,
    ) -> Result<()> {
        let (true_class, found_class) = (self.classes(truth)?, self.classes(found)?);
        let (found, truth) = (found.0, truth.0);
        self.panoptic.add(&found_class, &found.segment, &true_class, &truth.segment);
        let MetricSet { taxonomy, min_points, .. } = self.metrics;
        let (raw, instance) = (&truth.class[..], &truth.instance[..]);
        let objects = ObjectTruth { raw, class: &true_class, instance };
        self.objects.add(&found.instance, objects, taxonomy, min_points);
        let has_classes = !found.has_no_classes();
        self.has_classes |= has_classes;
        if self.metrics.over_time {
            let (own, other) = (&found.instance, &truth.instance);
            // Points whose found class is ignored are of no tube; of no class, all are.
            let found_class = if has_classes { &found_class } else { &true_class };
            self.over_time.add(found_class, own, &true_class, other);
            self.add_tracking(time_ns, own, (&true_class, other));
        }
        if let Some(cloud) = cloud {
            self.entropies.push(self.entropies(cloud, found, truth, &true_class));
        }
        self.scans += 1;
        self.points += truth.class.len() as u64;
        Ok(())
    }

    /// Points whose true class is ignored, and those of things without an id, leave on both sides.
    fn add_tracking(&mut self, time_ns: u64, found: &[u32], truth: (&[u16], &[u32])) {
        let classes = self.metrics.taxonomy.classes();
        let side = |((&class, &id), &found): ((&u16, &u32), &u32)| {
            let class_of = &classes[usize::from(class)];
            let is_left_out = class_of.is_ignored || (class_of.is_thing && id == 0);
            let object = (class_of.is_thing && !is_left_out).then_some((class, id));
            (if is_left_out { 0 } else { found }, object)
        };
        let points = truth.0.iter().zip(truth.1).zip(found);
        let (found, objects): (Vec<u32>, Vec<_>) = points.map(side).unzip();
        self.tracking.add(time_ns, &found, &objects);
    }

    /// Ends a sequence: later ids are those of other objects.
    pub fn end_sequence(&mut self) {
        self.over_time.end_sequence();
        self.tracking.end_sequence();
    }

    /// The scores of all scans added so far.
    pub fn scores(self) -> Scores {
        let MetricSet { taxonomy, entropy, over_time, .. } = self.metrics;
        // A scan without a point is without classes, too.
        let has_classes = self.has_classes || self.points == 0;
        let has_entropies = entropy || (!has_classes && self.entropies.len() as u64 == self.scans);
        let lstq = || self.over_time.lstq(&self.panoptic, taxonomy);
        Scores {
            scans: self.scans,
            points: self.points,
            report: has_classes.then(|| PanopticReport::new(&self.panoptic, taxonomy)),
            objects: (!has_classes).then(|| self.objects.scores()),
            entropy: has_entropies.then_some(self.entropies),
            over_time: (over_time && has_classes).then(lstq),
            association: (over_time && !has_classes).then(|| self.over_time.association(taxonomy)),
            tracking: over_time.then(|| self.tracking.scores()),
        }
    }

    /// Whether the cloud of a scan with these labels is looked at: for entropies, which are also
    /// computed where no classes are found.
    pub fn needs_cloud(&self, found: &ScanLabels) -> bool {
        self.metrics.entropy || found.has_no_classes()
    }

    fn classes(&self, (labels, place): (&ScanLabels, &str)) -> Result<Vec<u16>> {
        let taxonomy = self.metrics.taxonomy;
        taxonomy.known_class_numbers(&labels.class).map_err(|class| {
            Error::unknown_class(place, class, labels.class.iter().copied(), &taxonomy.name)
        })
    }

    fn entropies(
        &self,
        cloud: &PointCloud,
        found: &ScanLabels,
        truth: &ScanLabels,
        true_class: &[u16],
    ) -> Entropies {
        let classes = (&truth.class[..], true_class);
        let parts = true_parts(cloud, &truth.segment, classes, self.metrics.taxonomy);
        let instances = found.instance.iter().zip(&found.segment);
        let own = instances.map(|(&id, &segment)| if id == 0 { 0 } else { segment.max(1) });
        entropies(&parts, &own.collect::<Vec<_>>())
    }
}
