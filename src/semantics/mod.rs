//! Where the object mask comes from (ALGORITHM section 2): the classes of a field, ground removal, or
//! every return.

pub mod ground;

use crate::cloud::PointCloud;
use crate::instances::Reason;
use crate::range_image::RangeImage;
use crate::taxonomy::{Class, ClassSize, Taxonomy};

pub use ground::GroundParams;

/// How objects are told from the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MaskSource<'a> {
    /// Points whose class ([`PointCloud::class`]) is a thing of the taxonomy.
    Classes(&'a Taxonomy),
    /// Returns that are not ground, by geometry alone.
    NotGround(&'a GroundParams),
    /// Every return.
    All,
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
}

impl ObjectMask {
    /// Whether objects were told by their classes.
    pub fn has_classes(&self) -> bool {
        self.sizes.len() > 1
    }
}

/// The object mask of a cloud. A cloud without a class column has no objects by class.
pub fn object_mask(cloud: &PointCloud, image: &RangeImage, source: MaskSource) -> ObjectMask {
    match source {
        MaskSource::Classes(taxonomy) => by_class(cloud, taxonomy),
        MaskSource::NotGround(params) => {
            let is_ground = ground::ground(cloud, image, params);
            without_classes(cloud, |point| is_ground[point])
        }
        MaskSource::All => without_classes(cloud, |_| false),
    }
}

fn by_class(cloud: &PointCloud, taxonomy: &Taxonomy) -> ObjectMask {
    let sizes = taxonomy.classes().iter().map(Class::size).collect();
    let mut mask = ObjectMask { sizes, ..ObjectMask::default() };
    let class_of = taxonomy.lookup_known();
    let raw = cloud.class.as_deref().unwrap_or(&[]);
    for point in 0..cloud.len() {
        let id = usize::from(raw.get(point).copied().unwrap_or(0));
        let class = class_of[id].unwrap_or(0);
        let is_return = cloud.is_return(point);
        let is_object = is_return && taxonomy.classes()[usize::from(class)].is_thing;
        mask.unknown_ids += u64::from(is_return && class_of[id].is_none());
        mask.class.push(class);
        mask.is_object.push(is_object);
        mask.reason.push(match (is_return, is_object) {
            (false, _) => Reason::NoReturn,
            (true, true) => Reason::None,
            (true, false) => Reason::NotAnObject,
        });
    }
    mask
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
    }
}
