//! Scans with their truth, added up.

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::entropy::{Entropies, MIN_POINTS, TOLERANCE, entropies, kinds, true_objects};
use super::{Lstq, OverTime, Panoptic, Report};
use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::taxonomy::Taxonomy;

/// What is to be scored.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// What the ids of classes mean.
    pub taxonomy: &'a Taxonomy,
    /// Unmatched segments of fewer points are neither spurious nor missed.
    pub min_points: u64,
    /// Whether over- and under-segmentation entropies are wanted, for which clouds have to be given.
    pub entropy: bool,
    /// Whether LSTQ is.
    pub over_time: bool,
}

/// One side of a scan of N points.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Labels {
    /// N: raw class id.
    pub class: Vec<u16>,
    /// N: id of the segment; class and instance together.
    pub segment: Vec<u32>,
    /// N: instance, 0 for none.
    pub instance: Vec<u32>,
}

impl Labels {
    /// Of a class and an instance for each point.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn of_columns(class: &[u32], instance: Vec<u32>) -> Self {
        assert_eq!(class.len(), instance.len(), "columns of different length");
        let (class, segment) = segments(class, &instance);
        Labels { class, segment, instance }
    }

    /// Of label words.
    pub fn of_words(words: Vec<u32>) -> Self {
        Labels {
            class: words.iter().map(|&word| word as u16).collect(),
            instance: words.iter().map(|&word| word >> 16).collect(),
            segment: words,
        }
    }
}

/// Classes of 16 bits, and a number for each pair of class and instance: where instances fit 16 bits SemanticKITTI's
/// word, class | instance << 16.
pub fn segments(class: &[u32], instance: &[u32]) -> (Vec<u16>, Vec<u32>) {
    // Some recordings keep the whole word in the field of the class.
    let class: Vec<u16> = class.iter().map(|&class| class as u16).collect();
    let pairs = class.iter().zip(instance);
    let segment = if instance.iter().all(|&instance| instance <= u32::from(u16::MAX)) {
        pairs.map(|(&class, &instance)| u32::from(class) | instance << 16).collect()
    } else {
        let mut number: FxHashMap<(u16, u32), u32> = FxHashMap::default();
        let mut number_of = |pair| {
            let next = number.len() as u32;
            *number.entry(pair).or_insert(next)
        };
        pairs.map(|(&class, &instance)| number_of((class, instance))).collect()
    };
    (class, segment)
}

/// Sums over scans.
#[derive(Debug)]
pub struct Sums<'a> {
    wanted: Wanted<'a>,
    /// By raw id the class number, `None` where the taxonomy does not know it.
    class_of: Vec<Option<u16>>,
    panoptic: Panoptic,
    over_time: OverTime,
    entropies: Vec<Entropies>,
    scans: u64,
    points: u64,
}

/// What some scans come to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// Scans.
    pub scans: u64,
    /// Points of these.
    pub points: u64,
    /// Panoptic quality.
    #[serde(flatten)]
    pub report: Report,
    /// Entropies of each scan, if they were wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entropy: Option<Vec<Entropies>>,
    /// LSTQ, if it was wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_time: Option<Lstq>,
}

impl<'a> Sums<'a> {
    /// No scan yet.
    pub fn new(wanted: Wanted<'a>) -> Self {
        let mut class_of = vec![None; 1 << 16];
        for (id, class) in wanted.taxonomy.known_ids() {
            class_of[usize::from(id)] = Some(class);
        }
        Sums {
            wanted,
            class_of,
            panoptic: Panoptic::of(wanted.taxonomy, wanted.min_points),
            over_time: OverTime::of(wanted.taxonomy, wanted.min_points),
            entropies: Vec::new(),
            scans: 0,
            points: 0,
        }
    }

    /// Adds a scan, what was found and what is true, each with where that is from; the cloud is asked for where entropies
    /// are.
    ///
    /// # Errors
    /// [`Error::UnknownClass`] if the taxonomy does not know a class.
    ///
    /// # Panics
    /// If the sides differ in length.
    pub fn add(
        &mut self,
        found: (&Labels, &str),
        truth: (&Labels, &str),
        cloud: Option<&PointCloud>,
    ) -> Result<()> {
        let (true_class, found_class) = (self.classes(truth)?, self.classes(found)?);
        let (found, truth) = (found.0, truth.0);
        self.panoptic.add(&found_class, &found.segment, &true_class, &truth.segment);
        if self.wanted.over_time {
            let (own, other) = (&found.instance, &truth.instance);
            self.over_time.add(&found_class, own, &true_class, other);
        }
        if let Some(cloud) = cloud {
            self.entropies.push(self.entropies(cloud, found, truth, &true_class));
        }
        self.scans += 1;
        self.points += truth.class.len() as u64;
        Ok(())
    }

    /// Ends a sequence, over which ids last.
    pub fn end_sequence(&mut self) {
        self.over_time.end_sequence();
    }

    /// What they come to.
    pub fn figures(self) -> Figures {
        let Wanted { taxonomy, entropy, over_time, .. } = self.wanted;
        Figures {
            scans: self.scans,
            points: self.points,
            report: Report::new(&self.panoptic, taxonomy),
            entropy: entropy.then_some(self.entropies),
            over_time: over_time.then(|| self.over_time.lstq(&self.panoptic, taxonomy)),
        }
    }

    /// Class numbers; a class that the taxonomy does not know is an error that names its place.
    fn classes(&self, (labels, place): (&Labels, &str)) -> Result<Vec<u16>> {
        let class = |&raw: &u16| self.class_of[usize::from(raw)].ok_or(raw);
        match labels.class.iter().map(class).collect::<std::result::Result<Vec<u16>, u16>>() {
            Ok(classes) => Ok(classes),
            Err(unknown) => {
                let points = labels.class.iter().filter(|&&raw| raw == unknown).count() as u64;
                let taxonomy = self.wanted.taxonomy.name.clone();
                Err(Error::UnknownClass { at: place.to_owned(), class: unknown, points, taxonomy })
            }
        }
    }

    fn entropies(
        &self,
        cloud: &PointCloud,
        found: &Labels,
        truth: &Labels,
        true_class: &[u16],
    ) -> Entropies {
        let kinds = kinds(cloud, &truth.class, true_class, self.wanted.taxonomy);
        let objects = true_objects(cloud, &kinds, TOLERANCE, MIN_POINTS);
        let instances = found.instance.iter().zip(&found.segment);
        let own = instances.map(|(&id, &segment)| if id == 0 { 0 } else { segment.max(1) });
        entropies(&objects, &own.collect::<Vec<_>>())
    }
}
