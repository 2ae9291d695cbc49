//! Scans with their truth, added up.

use anyhow::{Result, bail};
use divmerge::evaluate::entropy::{
    Entropies, MIN_POINTS, TOLERANCE, entropies, kinds, true_objects,
};
use divmerge::evaluate::{Lstq, OverTime, Panoptic, Report};
use divmerge::{PointCloud, Taxonomy};
use serde::Serialize;

use crate::terminal::grouped;

/// What is to be scored.
pub struct Wanted<'a> {
    pub taxonomy: &'a Taxonomy,
    pub min_points: u64,
    pub entropy: bool,
    pub over_time: bool,
}

/// One side of a scan of N points.
pub struct Labels {
    /// N: raw class id.
    pub class: Vec<u16>,
    /// N: id of the segment; class and instance together.
    pub segment: Vec<u32>,
    /// N: instance, 0 for none.
    pub instance: Vec<u32>,
}

impl Labels {
    /// Of label words.
    pub fn of_words(words: Vec<u32>) -> Self {
        Labels {
            class: words.iter().map(|&word| word as u16).collect(),
            instance: words.iter().map(|&word| word >> 16).collect(),
            segment: words,
        }
    }
}

/// Sums over scans.
pub struct Sums<'a> {
    wanted: &'a Wanted<'a>,
    /// By raw id the class number, `None` where the taxonomy does not know it.
    class_of: Vec<Option<u16>>,
    panoptic: Panoptic,
    over_time: OverTime,
    entropies: Vec<Entropies>,
    scans: u64,
    points: u64,
}

/// What some scans come to.
#[derive(Serialize)]
pub struct Figures {
    pub scans: u64,
    pub points: u64,
    #[serde(flatten)]
    pub report: Report,
    /// Of each scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entropy: Option<Vec<Entropies>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_time: Option<Lstq>,
}

impl<'a> Sums<'a> {
    pub fn new(wanted: &'a Wanted) -> Self {
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

    /// Adds a scan; the cloud is asked for where entropies are.
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

    pub fn figures(self) -> Figures {
        let Wanted { taxonomy, entropy, over_time, .. } = *self.wanted;
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
        match labels.class.iter().map(class).collect::<Result<Vec<u16>, u16>>() {
            Ok(classes) => Ok(classes),
            Err(unknown) => {
                let count = labels.class.iter().filter(|&&raw| raw == unknown).count() as u64;
                let name = &self.wanted.taxonomy.name;
                bail!(
                    "{place}: class {unknown} ({} points) is not in taxonomy {name}",
                    grouped(count)
                )
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
