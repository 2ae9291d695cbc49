//! The runs and rulings against which a failure is held: one step perfect, the rest as it was.

use rustc_hash::FxHashMap;

use super::{Case, Side, Target, class_numbers, judge};
use crate::cloud::PointCloud;
use crate::evaluate::verdict::{Labelling, Rules, Segment, Verdict, Verdicts, verdicts};
use crate::pipeline::{self, Stages};
use crate::semantics::MaskSource;

/// A labelling of the points, and the verdicts on it.
pub(super) struct Ruling {
    /// N: found object of each point.
    found: Vec<Segment>,
    /// The verdicts.
    pub verdicts: Verdicts,
}

/// Everything that is held against the failures of a frame. *Seen* rulings leave points out that do not own
/// their pixel; those on stages before the last compare no classes, which instances get last.
pub(super) struct Oracles {
    /// N: true class number.
    pub true_class: Vec<u16>,
    /// N: whether a return owns its pixel.
    pub is_seen: Vec<bool>,
    /// The run again with a true mask; none if the mask was true.
    pub true_mask: Option<Ruling>,
    /// The run as it was, seen points alone.
    pub seen: Ruling,
    /// Every component given to the true object that most of its pixels have; seen points alone.
    pub true_merge: Ruling,
    /// The instances of the merge step; seen points alone.
    pub merged: Ruling,
}

impl Oracles {
    pub fn new(case: &Case) -> Self {
        let stages = case.frame.stages;
        let true_class = class_numbers(case.taxonomy, case.true_class);
        let image = &stages.image;
        let is_seen: Vec<bool> = (0..true_class.len())
            .map(|point| image.pixel_of(point).is_some() && !image.is_shadowed(point))
            .collect();
        // Points of class 0, which is always ignored, are left out.
        let seen_class: Vec<u16> = true_class
            .iter()
            .zip(&is_seen)
            .map(|(&class, &is_seen)| if is_seen { class } else { 0 })
            .collect();
        let found_class = class_numbers(case.taxonomy, &stages.labels.semantic);
        let by_class = stages.mask.has_classes();
        let rule = |class: &[u16], id: &[u32], by_class: bool| {
            ruling(case, &seen_class, Labelling { class, id }, by_class)
        };
        let no_class = vec![0; true_class.len()];
        Oracles {
            true_mask: true_mask(case, &true_class),
            seen: rule(&found_class, &stages.labels.instance, by_class),
            true_merge: rule(&no_class, &truly_merged(case, &true_class), false),
            merged: rule(&no_class, &merged(stages, true_class.len()), false),
            true_class,
            is_seen,
        }
    }
}

impl Ruling {
    /// Whether a failure is none in this ruling: a true object has a match; of a found one most points are
    /// in an instance that has one, or in none that would count.
    pub fn is_right(&self, target: &Target) -> bool {
        if target.side == Side::True {
            let judged = self.verdicts.of_true(target.judged.object);
            return judged.is_some_and(|judged| judged.verdict == Verdict::Correct);
        }
        let mut counts: FxHashMap<Segment, usize> = FxHashMap::default();
        for &point in &target.points {
            *counts.entry(self.found[point]).or_default() += 1;
        }
        let most = counts.into_iter().max_by_key(|&(object, count)| (count, object));
        let of_found = |object| {
            let found = &self.verdicts.found;
            found.binary_search_by_key(&object, |one| one.object).ok().map(|place| &found[place])
        };
        most.and_then(|(object, _)| of_found(object)).is_none_or(|judged| !judged.is_failure())
    }
}

fn ruling(case: &Case, true_class: &[u16], found: Labelling, by_class: bool) -> Ruling {
    let truth = Labelling { class: true_class, id: case.true_id };
    let rules = Rules { min_points: case.min_points, by_class };
    let object =
        |(&class, &id): (&u16, &u32)| Segment { class: if by_class { class } else { 0 }, id };
    Ruling {
        found: found.class.iter().zip(found.id).map(object).collect(),
        verdicts: verdicts(case.frame.cloud, truth, found, case.taxonomy, rules),
    }
}

/// The run again with the true mask: true classes where classes are given; else all but what is truly ground.
fn true_mask(case: &Case, true_class: &[u16]) -> Option<Ruling> {
    let (frame, classes) = (&case.frame, case.taxonomy.classes());
    let is_same = |mask: &[u16]| {
        let points = mask.iter().zip(true_class).enumerate();
        points.filter(|&(point, _)| frame.cloud.is_return(point)).all(|(_, (a, b))| a == b)
    };
    let stages = if frame.stages.mask.has_classes() {
        let given = class_numbers(case.taxonomy, frame.cloud.class.as_deref().unwrap_or(&[]));
        if is_same(&given) {
            return None;
        }
        let class = Some(case.true_class.to_vec());
        let cloud = PointCloud { class, ..frame.cloud.clone() };
        pipeline::run_with(
            &cloud,
            MaskSource::Classes(case.taxonomy),
            case.detections,
            frame.config,
        )
    } else {
        let of_class: Vec<Option<bool>> =
            classes.iter().map(|class| (!class.is_ignored).then(|| !class.is_ground())).collect();
        let marked: Vec<bool> = true_class
            .iter()
            .zip(&frame.stages.mask.is_object)
            .map(|(&class, &given)| of_class[usize::from(class)].unwrap_or(given))
            .collect();
        pipeline::run_with(frame.cloud, MaskSource::Marked(&marked), case.detections, frame.config)
    };
    let by_class = stages.mask.has_classes();
    let class = class_numbers(case.taxonomy, &stages.labels.semantic);
    let found = Labelling { class: &class, id: &stages.labels.instance };
    let object =
        |(&class, &id): (&u16, &u32)| Segment { class: if by_class { class } else { 0 }, id };
    let found = found.class.iter().zip(found.id).map(object).collect();
    Some(Ruling { found, verdicts: judge(case, &stages) })
}

/// N: the merge step's instance of each seen point, or 0.
fn merged(stages: &Stages, points: usize) -> Vec<u32> {
    of_objects(stages, points, |object| stages.merged_instance(object))
}

/// N: something for each point seen in an object pixel, 0 for all others.
fn of_objects(stages: &Stages, points: usize, value: impl Fn(usize) -> u32) -> Vec<u32> {
    let mut values = vec![0; points];
    for (object, &pixel) in stages.objects.pixel.iter().enumerate() {
        if let Some(point) = stages.image.point_at(pixel as usize) {
            values[point] = value(object);
        }
    }
    values
}

/// N: for each seen point the number, from 1, of the true object that most pixels of its component have; a
/// component of mostly no object has a number of its own.
fn truly_merged(case: &Case, true_class: &[u16]) -> Vec<u32> {
    let stages = case.frame.stages;
    let owners = owners(case, true_class);
    let mut number: FxHashMap<Segment, u32> = FxHashMap::default();
    let numbers: Vec<u32> = owners
        .into_iter()
        .enumerate()
        .map(|(component, owner)| match owner {
            None => u32::MAX - component as u32,
            Some(object) => {
                let next = number.len() as u32 + 1;
                *number.entry(object).or_insert(next)
            }
        })
        .collect();
    of_objects(stages, true_class.len(), |object| match stages.components.label[object] {
        0 => 0,
        label => numbers[label as usize - 1],
    })
}

/// For each component the true object that most of its pixels have; none if that is no object.
fn owners(case: &Case, true_class: &[u16]) -> Vec<Option<Segment>> {
    let stages = case.frame.stages;
    let mut pixels: Vec<(u32, Option<Segment>)> = Vec::new();
    for (object, &pixel) in stages.objects.pixel.iter().enumerate() {
        let (label, point) =
            (stages.components.label[object], stages.image.point_at(pixel as usize));
        if let Some(point) = point.filter(|_| label != 0) {
            let class = true_class[point];
            let is_thing = case.taxonomy.classes()[usize::from(class)].is_thing;
            let truth = is_thing.then_some(Segment { class, id: case.true_id[point] });
            pixels.push((label, truth));
        }
    }
    pixels.sort_unstable();
    let mut owners = vec![None; stages.components.count as usize];
    for component in pixels.chunk_by(|a, b| a.0 == b.0) {
        let lots = component.chunk_by(|a, b| a == b);
        let most = lots.reduce(|best, lot| if lot.len() > best.len() { lot } else { best });
        owners[component[0].0 as usize - 1] = most.and_then(|lot| lot[0].1);
    }
    owners
}
