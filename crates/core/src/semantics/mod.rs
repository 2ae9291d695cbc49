//! Where the object mask comes from (ALGORITHM section 2): the classes of a field, ground removal,
//! or every return.

mod bleed;
pub mod ego;
pub mod evidence;
pub mod ground;
mod object_mask;
mod smoothing;

use crate::cloud::Reason;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::taxonomy::{Class, Taxonomy};
use crate::range_image::{NOWHERE, RangeImage};

pub use bleed::GroundBleed;
pub use ground::GroundParams;
pub use object_mask::{MaskSource, ObjectMask};
pub use smoothing::Smoothing;

/// How classes are corrected that are not to be taken as they are; the default corrects nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Corrections<'a> {
    /// By those around them.
    pub smoothing: Option<&'a Smoothing>,
    /// By the ground, where a network found them.
    pub bleed: Option<&'a GroundBleed>,
}

/// The object mask of a cloud. A cloud without a class column has no objects by class.
pub fn object_mask(
    cloud: &PointCloud,
    image: &RangeImage,
    source: MaskSource,
    corrections: Corrections,
) -> ObjectMask {
    let mut mask = mask_of_returns(cloud, image, source, corrections);
    mark_cropped(cloud, &mut mask);
    mask
}

/// The mask of all that is not the ground that was found for another mask; `None` if none was
/// looked for.
pub fn mask_of_known_ground(cloud: &PointCloud, known: &ObjectMask) -> Option<ObjectMask> {
    let ground = known.ground.as_ref()?;
    let mut mask = without_classes(cloud, |point| ground[point] >= 0.5);
    mark_cropped(cloud, &mut mask);
    mask.ground_is_overhead = known.ground_is_overhead;
    mask.ground_is_missing = known.ground_is_missing;
    Some(mask)
}

fn mark_cropped(cloud: &PointCloud, mask: &mut ObjectMask) {
    if let Some(cropped) = &cloud.cropped {
        let marked = mask.reason.iter_mut().zip(cropped).filter(|(_, is_cropped)| **is_cropped);
        marked.for_each(|(reason, _)| *reason = Reason::Cropped);
    }
}

fn mask_of_returns(
    cloud: &PointCloud,
    image: &RangeImage,
    source: MaskSource,
    corrections: Corrections,
) -> ObjectMask {
    match source {
        MaskSource::Classes(taxonomy) => smoothed(cloud, image, taxonomy, corrections),
        MaskSource::NetworkClasses(taxonomy, ground) => {
            let mut mask = smoothed(cloud, image, taxonomy, corrections);
            if let (Some(params), Some(raw)) = (corrections.bleed, &cloud.class) {
                let found = ground_of(cloud, image, ground);
                let taken = bleed::take_out((cloud, image), raw, &found, params, &mut mask);
                mask.bleeds = !taken.is_empty();
                mask.correct(taken);
                mask = mask.with_ground(found);
            }
            mask
        }
        MaskSource::NotGround(params) => {
            let found = ground_of(cloud, image, params);
            without_classes(cloud, |point| found.is_ground[point]).with_ground(found)
        }
        MaskSource::All => without_classes(cloud, |_| false),
        MaskSource::Marked(is_object) => without_classes(cloud, |point| !is_object[point]),
    }
}

/// The mask of classes that are made consistent.
fn smoothed(
    cloud: &PointCloud,
    image: &RangeImage,
    taxonomy: &Taxonomy,
    corrections: Corrections,
) -> ObjectMask {
    let mut mask = by_class(cloud, image, taxonomy);
    if let (Some(params), Some(raw)) = (corrections.smoothing, &cloud.class) {
        mask.corrected = smoothing::smooth(cloud, image, (raw, taxonomy), params, &mut mask);
    }
    mask
}

/// The ground of a cloud of one sensor or of several. Where nobody knows where a sensor stands, it
/// is that from heights alone, unless the ground lies above the assumed place: then z points down.
fn ground_of(cloud: &PointCloud, image: &RangeImage, params: &GroundParams) -> ground::Ground {
    let seen = match image.is_plain() {
        true => ground::ground(cloud, image, params),
        false => ground_by_sensor(cloud, image, params),
    };
    let is_known = !image.is_from_assumed_place() || seen.is_overhead;
    let in_space = (!is_known).then(|| ground::in_space(cloud, params)).flatten();
    in_space.unwrap_or(seen)
}

/// The ground as each sensor of a cloud sees it, from where it stands.
fn ground_by_sensor(
    cloud: &PointCloud,
    image: &RangeImage,
    params: &GroundParams,
) -> ground::Ground {
    let mut all = ground::Ground {
        is_ground: vec![false; cloud.len()],
        confidence: vec![0.0; cloud.len()],
        is_overhead: false,
        is_missing: true,
    };
    for view in image.views(cloud) {
        let found = ground::ground(&view.cloud, &view.image, params);
        all.is_overhead |= found.is_overhead;
        all.is_missing &= found.is_missing;
        for (own, &point) in view.points.iter().enumerate() {
            all.is_ground[point as usize] = found.is_ground[own];
            all.confidence[point as usize] = found.confidence[own];
        }
    }
    all
}

fn by_class(cloud: &PointCloud, image: &RangeImage, taxonomy: &Taxonomy) -> ObjectMask {
    let meanings = meanings(taxonomy);
    let last = meanings.len() - 1;
    let no_ids = if cloud.class.is_none() { vec![0; cloud.len()] } else { Vec::new() };
    let ids = cloud.class.as_ref().unwrap_or(&no_ids);
    let mut mask = ObjectMask {
        is_object: vec![false; cloud.len()],
        class: vec![0; cloud.len()],
        reason: vec![Reason::NoReturn; cloud.len()],
        unknown_ids: 0,
        sizes: taxonomy.classes().iter().map(Class::size).collect(),
        families: taxonomy.families(),
        lookalikes: taxonomy.lookalikes(),
        ..ObjectMask::default()
    };
    let mut unknown = 0;
    let points = ids.iter().zip(&image.pixel_of_point);
    let columns = mask.is_object.iter_mut().zip(&mut mask.class).zip(&mut mask.reason);
    for ((&id, &pixel), ((is_object, class), reason)) in points.zip(columns) {
        let meaning = &meanings[usize::from(id).min(last)];
        let is_return = pixel != NOWHERE;
        *class = meaning.class;
        *reason = if is_return { meaning.reason } else { Reason::NoReturn };
        *is_object = *reason == Reason::None;
        unknown += u32::from(is_return & meaning.is_unknown);
    }
    mask.unknown_ids = u64::from(unknown);
    mask
}

/// What a raw id says of the returns that have it.
#[derive(Debug, Clone, Copy)]
struct Meaning {
    class: u16,
    reason: Reason,
    is_unknown: bool,
}

/// By raw id, up to the highest that the taxonomy knows; the last stands for all ids above.
fn meanings(taxonomy: &Taxonomy) -> Vec<Meaning> {
    let highest = taxonomy.known_ids().next_back().map_or(0, |(id, _)| usize::from(id));
    let meaning = |class: u16, is_unknown| {
        let is_thing = taxonomy.classes()[usize::from(class)].is_thing;
        let reason = if is_thing { Reason::None } else { Reason::NotAnObject };
        Meaning { class, reason, is_unknown }
    };
    let mut meanings = vec![meaning(0, true); highest + 2];
    for (id, class) in taxonomy.known_ids() {
        meanings[usize::from(id)] = meaning(class, false);
    }
    meanings
}

fn without_classes(cloud: &PointCloud, is_ground: impl Fn(usize) -> bool) -> ObjectMask {
    let reasons = (0..cloud.len()).map(|point| {
        if !cloud.is_return(point) {
            Reason::NoReturn
        } else if is_ground(point) {
            Reason::Ground
        } else {
            Reason::None
        }
    });
    let reason: Vec<Reason> = reasons.collect();
    ObjectMask {
        is_object: reason.iter().map(|&reason| reason == Reason::None).collect(),
        class: vec![0; cloud.len()],
        reason,
        unknown_ids: 0,
        sizes: vec![None],
        families: vec![0],
        lookalikes: vec![0],
        corrected: Vec::new(),
        bleeds: false,
        ground: None,
        ground_is_overhead: false,
        ground_is_missing: false,
    }
}
