//! Oracles: the run once more with one step perfect and the rest as it was.

use rustc_hash::FxHashMap;

use super::case::{LabelledRun, ObjectOrigin, Target};
use crate::evaluate::verdict::{Labelling, Segment, Verdict, Verdicts};
use divmerge_core::geometry::statistics::most_frequent;
use divmerge_core::pipeline;
use divmerge_core::pipeline::Stages;
use divmerge_core::semantics::MaskSource;

/// What an oracle found, and the verdicts on it.
pub(super) struct OracleVerdicts {
    /// N: found object of each point.
    found: Vec<Segment>,
    /// The verdicts.
    pub verdicts: Verdicts,
}

/// Everything that the failures of a frame are compared with. Those of *seen* points leave out
/// points that do not own their pixel. Those of stages before the last compare no classes, because
/// instances get their class last.
pub(super) struct Oracles {
    /// N: true class number.
    pub true_class: Vec<u16>,
    /// N: whether a return owns its pixel.
    pub is_seen: Vec<bool>,
    /// The run again with a true mask; none if the mask was true.
    pub true_mask: Option<OracleVerdicts>,
    /// The objects of the mask cut along true objects, each with the class that most of its points
    /// were given: what a perfect cut makes of the mask.
    pub perfect_cut: OracleVerdicts,
    /// The run as it was, seen points alone.
    pub seen: OracleVerdicts,
    /// Every component given to the true object that most of its pixels belong to; seen points
    /// alone.
    pub true_merge: OracleVerdicts,
    /// The instances of the merge step; seen points alone.
    pub merged: OracleVerdicts,
}

impl Oracles {
    pub fn new(run: &LabelledRun, true_class: Vec<u16>) -> Self {
        let stages = run.frame.stages;
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
        let found_class = run.taxonomy.class_numbers(&stages.labels.semantic);
        let by_class = stages.mask.has_classes();
        let rule = |class: &[u16], id: &[u32], by_class: bool| {
            OracleVerdicts::new(run, &seen_class, Labelling { class, id }, by_class)
        };
        let no_class = vec![0; true_class.len()];
        Oracles {
            true_mask: true_mask(run, &true_class),
            perfect_cut: perfect_cut(run, &true_class),
            seen: rule(&found_class, &stages.labels.instance, by_class),
            true_merge: rule(&no_class, &truly_merged(run, &true_class), false),
            merged: rule(&no_class, &merged(stages, true_class.len()), false),
            true_class,
            is_seen,
        }
    }
}

impl Oracles {
    /// Whether the run is right with a true mask; false where the mask is true.
    pub fn is_right_with_true_mask(&self, target: &Target) -> bool {
        self.true_mask.as_ref().is_some_and(|oracle| oracle.is_right(target))
    }
}

impl OracleVerdicts {
    fn new(run: &LabelledRun, true_class: &[u16], found: Labelling, by_class: bool) -> Self {
        let object =
            |(&class, &id): (&u16, &u32)| Segment { class: if by_class { class } else { 0 }, id };
        OracleVerdicts {
            found: found.class.iter().zip(found.id).map(object).collect(),
            verdicts: run.verdicts(true_class, found, by_class),
        }
    }

    /// Whether a failure is none for this oracle: a true object has a match; most points of a found
    /// one are in an instance that is no failure, or in none.
    pub fn is_right(&self, target: &Target) -> bool {
        if target.side == ObjectOrigin::True {
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

/// The run again with the true mask: true classes if classes are given, else everything but the
/// true ground.
fn true_mask(run: &LabelledRun, true_class: &[u16]) -> Option<OracleVerdicts> {
    let (frame, classes) = (&run.frame, run.taxonomy.classes());
    let is_same = |mask: &[u16]| {
        let points = mask.iter().zip(true_class).enumerate();
        points.filter(|&(point, _)| frame.cloud.is_return(point)).all(|(_, (a, b))| a == b)
    };
    let stages = if frame.stages.mask.has_classes() {
        let given = run.taxonomy.class_numbers(frame.cloud.class.as_deref().unwrap_or(&[]));
        if is_same(&given) {
            return None;
        }
        let cloud = frame.cloud.clone().with_class(run.true_class.to_vec());
        let cloud = cloud.expect("a true class for each point");
        pipeline::run_with(&cloud, MaskSource::Classes(run.taxonomy), run.detections, frame.config)
    } else {
        let of_class: Vec<Option<bool>> =
            classes.iter().map(|class| (!class.is_ignored).then(|| !class.is_ground())).collect();
        let marked: Vec<bool> = true_class
            .iter()
            .zip(&frame.stages.mask.is_object)
            .map(|(&class, &given)| of_class[usize::from(class)].unwrap_or(given))
            .collect();
        pipeline::run_with(frame.cloud, MaskSource::Marked(&marked), run.detections, frame.config)
    };
    let class = run.taxonomy.class_numbers(&stages.labels.semantic);
    let found = Labelling { class: &class, id: &stages.labels.instance };
    Some(OracleVerdicts::new(run, true_class, found, stages.mask.has_classes()))
}

/// The objects of the mask cut along true objects. What is no true thing has no instance.
fn perfect_cut(run: &LabelledRun, true_class: &[u16]) -> OracleVerdicts {
    let (mask, classes) = (&run.frame.stages.mask, run.taxonomy.classes());
    let mut members: FxHashMap<Segment, Vec<usize>> = FxHashMap::default();
    for (point, (&class, &id)) in true_class.iter().zip(run.true_id).enumerate() {
        if mask.is_object[point] && classes[usize::from(class)].is_thing {
            members.entry(Segment { class, id }).or_default().push(point);
        }
    }
    let (mut class, mut id) = (mask.class.clone(), vec![0; true_class.len()]);
    for (number, points) in (1..).zip(members.into_values()) {
        let given = most_frequent(points.iter().map(|&point| mask.class[point])).unwrap_or(0);
        for point in points {
            (class[point], id[point]) = (given, number);
        }
    }
    OracleVerdicts::new(run, true_class, Labelling { class: &class, id: &id }, mask.has_classes())
}

/// N: the merge step's instance of each seen point, or 0.
fn merged(stages: &Stages, points: usize) -> Vec<u32> {
    of_objects(stages, points, |object| stages.merged_instance(object))
}

/// N: a value for each point seen in an object pixel, 0 for all others.
fn of_objects(stages: &Stages, points: usize, value: impl Fn(usize) -> u32) -> Vec<u32> {
    let mut values = vec![0; points];
    for (object, &pixel) in stages.objects.pixel.iter().enumerate() {
        if let Some(point) = stages.image.point_at(pixel as usize) {
            values[point] = value(object);
        }
    }
    values
}

/// N: for each seen point the number, from 1, of the true object that most pixels of its component
/// belong to; a component of mostly no object has a number of its own.
fn truly_merged(run: &LabelledRun, true_class: &[u16]) -> Vec<u32> {
    let stages = run.frame.stages;
    let owners = owners(run, true_class);
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

/// For each component the true object that most of its pixels belong to; none if they belong to
/// none.
fn owners(run: &LabelledRun, true_class: &[u16]) -> Vec<Option<Segment>> {
    let stages = run.frame.stages;
    let mut pixels: Vec<(u32, Option<Segment>)> = Vec::new();
    for (object, &pixel) in stages.objects.pixel.iter().enumerate() {
        let (label, point) =
            (stages.components.label[object], stages.image.point_at(pixel as usize));
        if let Some(point) = point.filter(|_| label != 0) {
            let class = true_class[point];
            let is_thing = run.taxonomy.classes()[usize::from(class)].is_thing;
            let truth = is_thing.then_some(Segment { class, id: run.true_id[point] });
            pixels.push((label, truth));
        }
    }
    pixels.sort_unstable_by_key(|pixel| pixel.0);
    let mut owners = vec![None; stages.components.count as usize];
    for component in pixels.chunk_by(|a, b| a.0 == b.0) {
        let most = most_frequent(component.iter().map(|pixel| pixel.1));
        owners[component[0].0 as usize - 1] = most.flatten();
    }
    owners
}
