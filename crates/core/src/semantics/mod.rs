//! Where the object mask comes from (ALGORITHM section 2): the classes of a field, ground removal, or
//! every return.

pub mod ground;
mod smoothing;

use crate::cloud::Reason;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::taxonomy::{Class, ClassSize, Taxonomy};
use crate::range_image::{NOWHERE, RangeImage};

pub use ground::GroundParams;
pub use smoothing::Smoothing;

/// How objects are told from the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MaskSource<'a> {
    /// Points whose class ([`PointCloud::class`]) is a thing of the taxonomy.
    Classes(&'a Taxonomy),
    /// Returns that are not ground, by geometry alone.
    NotGround(&'a GroundParams),
    /// Every return.
    All,
    /// Returns that are marked, one mark for each of N points: for what-ifs with objects known otherwise.
    Marked(&'a [bool]),
}

/// Which of N points belong to objects, and to which class.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ObjectMask {
    /// N: whether the point is a return of an object.
    pub is_object: Vec<bool>,
    /// N: class number in the taxonomy; 0 where there are no classes or the id is unknown.
    pub class: Vec<u16>,
    /// N: why a point is not an object; [`Reason::None`] for objects.
    pub reason: Vec<Reason>,
    /// Returns whose id the taxonomy does not know.
    pub unknown_ids: u64,
    /// By class number: usual size of its objects; only that of "no class", none, without classes.
    pub sizes: Vec<Option<ClassSize>>,
    /// By class number: the class that stands for it and those it is easily taken for
    /// ([`Taxonomy::families`]).
    pub families: Vec<u16>,
    /// By class number: the groups of classes that look alike ([`Taxonomy::lookalikes`]).
    pub lookalikes: Vec<u8>,
    /// Points whose class was corrected, ascending, with the raw ids they have now.
    pub corrected: Vec<(u32, u16)>,
    /// N: how likely the point is ground, 0 to 1 ([`ground::Ground::confidence`]); `None` where the mask does not come
    /// from ground removal.
    pub ground: Option<Vec<f32>>,
    /// Whether ground removal found the ground above the sensor.
    pub ground_is_overhead: bool,
}

impl ObjectMask {
    /// The points of objects, ascending.
    pub fn object_points(&self) -> Vec<u32> {
        const BLOCK: usize = 64;
        let mut points = Vec::new();
        for (first, block) in (0_u32..).step_by(BLOCK).zip(self.is_object.chunks(BLOCK)) {
            if block.iter().fold(false, |any, &is_object| any | is_object) {
                let found = (first..).zip(block).filter(|&(_, &is_object)| is_object);
                points.extend(found.map(|(point, _)| point));
            }
        }
        points
    }

    /// Whether objects were told by their classes.
    pub fn has_classes(&self) -> bool {
        self.sizes.len() > 1
    }
}

/// The object mask of a cloud. A cloud without a class column has no objects by class.
pub fn object_mask(
    cloud: &PointCloud,
    image: &RangeImage,
    source: MaskSource,
    smoothing: Option<&Smoothing>,
) -> ObjectMask {
    match source {
        MaskSource::Classes(taxonomy) => {
            let mut mask = by_class(cloud, image, taxonomy);
            if let (Some(params), Some(raw)) = (smoothing, &cloud.class) {
                mask.corrected = smoothing::smooth(cloud, image, raw, taxonomy, params, &mut mask);
            }
            mask
        }
        MaskSource::NotGround(params) => {
            let found = match image.is_plain() {
                true => ground::ground(cloud, image, params),
                false => ground_by_sensor(cloud, image, params),
            };
            let mask = without_classes(cloud, |point| found.is_ground[point]);
            let is_overhead = found.is_overhead;
            ObjectMask { ground: Some(found.confidence), ground_is_overhead: is_overhead, ..mask }
        }
        MaskSource::All => without_classes(cloud, |_| false),
        MaskSource::Marked(is_object) => without_classes(cloud, |point| !is_object[point]),
    }
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
    };
    for view in image.views(cloud) {
        let found = ground::ground(&view.cloud, &view.image, params);
        all.is_overhead |= found.is_overhead;
        for (own, &point) in view.points.iter().enumerate() {
            all.is_ground[point as usize] = found.is_ground[own];
            all.confidence[point as usize] = found.confidence[own];
        }
    }
    all
}

fn by_class(cloud: &PointCloud, image: &RangeImage, taxonomy: &Taxonomy) -> ObjectMask {
    let verdicts = verdicts(taxonomy);
    let last = verdicts.len() - 1;
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
        let verdict = &verdicts[usize::from(id).min(last)];
        let is_return = pixel != NOWHERE;
        *class = verdict.class;
        *reason = if is_return { verdict.reason } else { Reason::NoReturn };
        *is_object = *reason == Reason::None;
        unknown += u32::from(is_return & verdict.is_unknown);
    }
    mask.unknown_ids = u64::from(unknown);
    mask
}

/// What a raw id says of the returns that have it.
#[derive(Debug, Clone, Copy)]
struct Verdict {
    class: u16,
    reason: Reason,
    is_unknown: bool,
}

/// By raw id, up to the highest that the taxonomy knows; the last stands for all ids above.
fn verdicts(taxonomy: &Taxonomy) -> Vec<Verdict> {
    let highest = taxonomy.known_ids().next_back().map_or(0, |(id, _)| usize::from(id));
    let verdict = |class: u16, is_unknown| {
        let is_thing = taxonomy.classes()[usize::from(class)].is_thing;
        let reason = if is_thing { Reason::None } else { Reason::NotAnObject };
        Verdict { class, reason, is_unknown }
    };
    let mut verdicts = vec![verdict(0, true); highest + 2];
    for (id, class) in taxonomy.known_ids() {
        verdicts[usize::from(id)] = verdict(class, false);
    }
    verdicts
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
        ground: None,
        ground_is_overhead: false,
    }
}
