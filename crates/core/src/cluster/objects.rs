//! Object pixels as a dense list: what the divide step walks on.

use super::condition::{Along, NeighbourTest};
use super::params::ClusterParams;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::cloud::taxonomy::ClassSize;
use crate::range_image::{NEIGHBOURS, NO_NEIGHBOUR, PixelSet, RangeImage, Reach, neighbours};
use crate::semantics::ObjectMask;

/// The M object pixels of an image in row-major order, with their neighbours and the condition
/// towards each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ObjectPixels {
    /// Points of objects, ascending; shadowed ones, which have no pixel of their own, included.
    pub points: Vec<u32>,
    /// M: pixel number in the range image, ascending.
    pub pixel: Vec<u32>,
    /// The same pixels as a set, which gives the number of each.
    pub set: PixelSet,
    /// M: position in metres, sensor frame.
    pub position: Vec<[f32; 3]>,
    /// M: class number, 0 where there are no classes.
    pub class: Vec<u16>,
    /// M: number of the class's family; only objects of one may be neighbours where classes matter.
    pub family: Vec<u16>,
    /// M x 4: neighbours left, right, up, down as object pixel numbers, or
    /// [`NO_NEIGHBOUR`].
    pub neighbours: Vec<[u32; NEIGHBOURS]>,
    /// M x 4: whether the condition holds towards each neighbour; false where there is none. Empty
    /// if it was not judged ([`ObjectPixels::without_condition`]).
    pub connected: Vec<[bool; NEIGHBOURS]>,
}

impl ObjectPixels {
    /// Collects the object pixels and judges the condition of every pair of neighbours once.
    pub fn new(
        cloud: &PointCloud,
        image: &RangeImage,
        mask: &ObjectMask,
        params: &ClusterParams,
    ) -> Self {
        let mut objects = Self::without_condition(cloud, image, mask, params);
        objects.connected = connected(&objects, image, &mask.sizes, params);
        objects
    }

    /// The same for methods that do not ask for the condition.
    pub fn without_condition(
        cloud: &PointCloud,
        image: &RangeImage,
        mask: &ObjectMask,
        params: &ClusterParams,
    ) -> Self {
        let points = mask.object_points();
        let seen = points.iter().map(|&point| point as usize);
        let seen = seen.filter(|&point| !image.is_shadowed(point));
        let pixels = seen.map(|point| image.pixel_of_point[point]);
        let set = PixelSet::new(image.rows(), image.columns(), pixels);
        let pixel = set.pixels();
        let point_of_pixel = image.point_of_pixel.values();
        let point = pixel.iter().map(|&pixel| point_of_pixel[pixel as usize] as usize);
        let position = point.clone().map(|point| cloud.position(point)).collect();
        let class: Vec<u16> = point.map(|point| mask.class[point]).collect();
        let mut objects = ObjectPixels {
            family: class.iter().map(|&class| mask.families[usize::from(class)]).collect(),
            position,
            class,
            points,
            set,
            pixel,
            ..ObjectPixels::default()
        };
        let reach =
            Reach { columns: params.gap_columns, rows: params.gap_rows, wraps: image.wraps };
        let group = groups(&objects, image, mask, params.same_class_neighbours);
        objects.neighbours = neighbours(&objects.set, &objects.pixel, &group, reach);
        objects
    }

    /// The object pixel at a pixel of the image.
    #[inline]
    pub fn at(&self, pixel: usize) -> Option<usize> {
        self.set.number(pixel).map(|number| number as usize)
    }

    /// Number of object pixels M.
    pub fn len(&self) -> usize {
        self.pixel.len()
    }

    /// Whether there is no object pixel.
    pub fn is_empty(&self) -> bool {
        self.pixel.is_empty()
    }
}

/// Of which group each object pixel is: only pixels of one sensor and, where classes matter, of one
/// family are neighbours.
fn groups(
    objects: &ObjectPixels,
    image: &RangeImage,
    mask: &ObjectMask,
    by_class: bool,
) -> Vec<u16> {
    let families = if by_class { mask.families.len() } else { 1 };
    let family = |object: usize| if by_class { objects.family[object] } else { 0 };
    let band = |object: usize| {
        image.band_of_row(objects.pixel[object] as usize / image.columns()) * families
    };
    match image.bands.len() {
        1 => (0..objects.len()).map(family).collect(),
        _ => (0..objects.len()).map(|object| band(object) as u16 + family(object)).collect(),
    }
}

/// The condition is symmetric, and so are neighbours: judged towards the right and downwards,
/// copied to the left and upwards.
fn connected(
    objects: &ObjectPixels,
    image: &RangeImage,
    sizes: &[Option<ClassSize>],
    params: &ClusterParams,
) -> Vec<[bool; NEIGHBOURS]> {
    let condition = NeighbourCondition::new(objects, image, sizes, params);
    let mut connected = vec![[false; NEIGHBOURS]; objects.len()];
    for from in 0..objects.len() {
        for (forward, backward) in [(1, 0), (3, 2)] {
            let to = objects.neighbours[from][forward];
            if to != NO_NEIGHBOUR {
                let holds = condition.holds(from, forward);
                connected[from][forward] = holds;
                connected[to as usize][backward] = holds;
            }
        }
    }
    connected
}

/// The condition between neighbouring object pixels.
#[derive(Debug)]
pub struct NeighbourCondition<'a> {
    objects: &'a ObjectPixels,
    image: &'a RangeImage,
    sizes: &'a [Option<ClassSize>],
    test: NeighbourTest<'a>,
}

impl<'a> NeighbourCondition<'a> {
    /// The condition that the parameters ask for, among objects of classes of usual sizes.
    pub fn new(
        objects: &'a ObjectPixels,
        image: &'a RangeImage,
        sizes: &'a [Option<ClassSize>],
        params: &'a ClusterParams,
    ) -> Self {
        let test = NeighbourTest::new(&params.condition, image.bands[0].column_step);
        NeighbourCondition { objects, image, sizes, test }
    }

    /// Whether it holds towards the neighbour in a direction, which must be there.
    #[inline]
    pub fn holds(&self, from: usize, direction: usize) -> bool {
        let Self { objects, image, sizes, .. } = self;
        let to = objects.neighbours[from][direction] as usize;
        let (from, to) = if direction % 2 == 1 { (from, to) } else { (to, from) };
        let along = if direction < 2 { Along::Row } else { Along::Column };
        let band = image.band_of(objects.pixel[from] as usize);
        let test = self.test.with_columns(band.column_step);
        let apart = pixels_apart(objects.pixel[from], objects.pixel[to], image.columns(), along);
        let [p, q] = [from, to].map(|object| band.from_sensor(wide(objects.position[object])));
        let class = |object: usize| sizes[usize::from(objects.class[object])];
        let size = narrower(class(from), class(to));
        test.is_connected(p, q, apart, along, size)
    }
}

/// Of two sizes the one that reaches less far: what is near for a bus is far for a car.
fn narrower(a: Option<ClassSize>, b: Option<ClassSize>) -> Option<ClassSize> {
    match (a, b) {
        (Some(one), Some(two)) if two.width < one.width => b,
        _ => a,
    }
}

/// Pixels from one pixel rightwards or downwards to another.
fn pixels_apart(from: u32, to: u32, columns: usize, along: Along) -> usize {
    let (from, to) = (from as usize, to as usize);
    match along {
        // Nearly all are next to each other, and a division is dear.
        Along::Column if to - from == columns => 1,
        Along::Column => (to - from) / columns,
        Along::Row if to > from => to - from,
        Along::Row => to + columns - from,
    }
}
