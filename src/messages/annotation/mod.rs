//! The annotated cloud: every byte of the input's points, and behind each its labels and colour.

mod owned;

use std::borrow::Cow;
use std::ops::Range;

use divmerge_core::CloudError;

use super::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use super::ros::ByteOrder;
use crate::error::frame::Result;
use crate::messages::palette::{INSTANCE_COLOURS, instance_colour, reason_colour};

pub use owned::object_field;
pub(crate) use owned::{OwnedAnnotation, annotation_of};

/// Bytes appended to each point of a PointCloud2.
pub const ANNOTATION_LEN: u32 = LABELS_LEN + 8;

/// Bytes appended to each point of one of Foxglove's clouds.
pub const FOXGLOVE_ANNOTATION_LEN: u32 = LABELS_LEN + 4;

/// Bytes of the labels, which are in front of the colours.
const LABELS_LEN: u32 = 12;

/// Bytes behind the colours that say how sure the classes are, where that is known.
const CERTAINTY_LEN: u32 = 4;

/// Bytes behind all others that hold the track, where objects are followed over time.
const TRACK_LEN: u32 = 4;

/// What is put in front of a field name that the input already has.
pub const CLASH_PREFIX: &str = "divmerge_";

/// An appended field: name, bytes behind the original point, type.
type Appended = (&'static str, u32, Datatype);

/// The labels. Byte 11 is padding where there is no `ground`.
const LABELS: [Appended; 5] = [
    ("instance", 0, Datatype::UInt32),
    ("component", 4, Datatype::UInt32),
    ("semantic", 8, Datatype::UInt16),
    ("reason", 10, Datatype::UInt8),
    (GROUND, 11, Datatype::UInt8),
];

/// The colour as PCL and Rerun have it, in a PointCloud2.
const COLOURS: [Appended; 2] = [("rgb", 12, Datatype::Float32), ("colors", 16, Datatype::UInt32)];

/// The colour as Foxglove's viewers have it in their cloud: in four fields of these very names.
const FOXGLOVE_COLOURS: [Appended; 4] = [
    ("red", 12, Datatype::UInt8),
    ("green", 13, Datatype::UInt8),
    ("blue", 14, Datatype::UInt8),
    ("alpha", 15, Datatype::UInt8),
];

/// How sure the classes are, bytes behind the colours; two of padding follow.
const CERTAINTY: [Appended; 2] =
    [("confidence", 0, Datatype::UInt8), ("entropy", 1, Datatype::UInt8)];

/// The field that only clouds without classes have.
const GROUND: &str = "ground";

/// The field that only clouds of a drive have whose objects are followed.
const TRACK: &str = "track";

/// Labels of every point of a cloud, in its order.
#[derive(Debug, Clone, Copy)]
pub struct PointAnnotation<'a> {
    /// Instance, 0 for none.
    pub instance: &'a [u32],
    /// Object over time, 0 for none; where objects are followed. It gives the point its colour.
    pub track: Option<&'a [u32]>,
    /// Connected component before merging, 0 for none.
    pub component: &'a [u32],
    /// Class in the recording's own ids.
    pub semantic: &'a [u16],
    /// Why the point has no instance; see [`reason_colour`].
    pub reason: &'a [u8],
    /// How likely the point is ground, 255 for certain; only where ground removal told objects
    /// apart.
    pub ground: Option<&'a [u8]>,
    /// How sure the classes are, where whoever gave them said so.
    pub certainty: Option<Certainty<'a>>,
}

/// How sure the class of every point of a cloud is.
#[derive(Debug, Clone, Copy)]
pub struct Certainty<'a> {
    /// Probability of the class, 255 for certain.
    pub confidence: &'a [u8],
    /// Entropy over the classes, 255 where all have the same probability.
    pub entropy: &'a [u8],
}

/// Writes `cloud` with its annotation as a message of its format, replacing what is in `out`.
///
/// The rows are packed; everything else of the message, and every byte of every point, is the
/// input's. Each point grows by `instance` UINT32, `component` UINT32, `semantic` UINT16, `reason`
/// UINT8 and `ground` UINT8 (without it a zero); then, in a PointCloud2 ([`ANNOTATION_LEN`] bytes
/// in all), by `rgb` FLOAT32 holding 0xFFRRGGBB as PCL does and `colors` UINT32 0xRRGGBBFF, in one
/// of Foxglove's clouds ([`FOXGLOVE_ANNOTATION_LEN`]) by `red`, `green`, `blue` and `alpha` UINT8;
/// where it is known how sure the classes are, by four more: `confidence` and `entropy` UINT8 and
/// two of padding; and where objects are followed over time, by `track` UINT32. A name that the
/// cloud already has is written with [`CLASH_PREFIX`].
///
/// # Errors
/// [`CloudError::ColumnLength`] if a column does not have one value for each point,
/// [`FrameError::Malformed`](crate::error::FrameError::Malformed) if the result would not fit the
/// message's 32-bit sizes, [`FrameError::Unsupported`](crate::error::FrameError::Unsupported) if
/// the format cannot hold the cloud.
pub fn annotated_cloud(
    cloud: &CloudMessage,
    annotation: &PointAnnotation,
    out: &mut Vec<u8>,
) -> Result<()> {
    check(cloud, annotation)?;
    let more = annotation_len(cloud.format) + annotation.certainty_len() + annotation.track_len();
    let (point_step, row_step, length) = sizes(cloud, more)?;
    let annotated = CloudMessage {
        fields: fields(cloud, annotation),
        point_step,
        row_step,
        frame_id: cloud.frame_id.clone(),
        data: Cow::Borrowed(&[]),
        ..*cloud
    };
    annotated.encode_with(length, out, |out| append_all(cloud, annotation, out))
}

fn append_all(cloud: &CloudMessage, annotation: &PointAnnotation, out: &mut Vec<u8>) {
    const ROS: usize = ANNOTATION_LEN as usize;
    const FOXGLOVE: usize = FOXGLOVE_ANNOTATION_LEN as usize;
    let order = cloud.data_order();
    let behind_colours = annotation.certainty_len() + annotation.track_len();
    if cloud.format.is_foxglove() {
        let colours = Colours::new(|[red, green, blue]| [red, green, blue, 0xff]);
        match behind_colours {
            0 => append_points::<FOXGLOVE, 4>(cloud, annotation, &colours, out),
            4 => append_points::<{ FOXGLOVE + 4 }, 4>(cloud, annotation, &colours, out),
            _ => append_points::<{ FOXGLOVE + 8 }, 4>(cloud, annotation, &colours, out),
        }
    } else {
        let colours = Colours::new(|colour| colour_fields(order, colour));
        match behind_colours {
            0 => append_points::<ROS, 8>(cloud, annotation, &colours, out),
            4 => append_points::<{ ROS + 4 }, 8>(cloud, annotation, &colours, out),
            _ => append_points::<{ ROS + 8 }, 8>(cloud, annotation, &colours, out),
        }
    }
}

/// Bytes appended to each point of a cloud.
fn annotation_len(format: CloudFormat) -> u32 {
    if format.is_foxglove() { FOXGLOVE_ANNOTATION_LEN } else { ANNOTATION_LEN }
}

/// Appends the points and their tails, some hundred at a time: they are put together in a buffer
/// that stays in the nearest cache. N bytes are appended to each, C of them its colour.
fn append_points<const N: usize, const C: usize>(
    cloud: &CloudMessage,
    annotation: &PointAnnotation,
    colours: &Colours<C>,
    out: &mut Vec<u8>,
) {
    const BLOCK: usize = 256;
    let step = (cloud.point_step as usize).max(1);
    let record = step + N;
    // A message without points may claim points of any size.
    let mut buffer = vec![0; BLOCK.min(cloud.point_count()) * record];
    let mut first = 0;
    for row in cloud.rows() {
        for points in row.chunks(BLOCK * step) {
            let count = points.len() / step;
            let labels = annotation.range(first..first + count);
            let records = &mut buffer[..count * record];
            copy_points::<N>(points, step, records.chunks_exact_mut(record));
            let tails =
                records.chunks_exact_mut(record).filter_map(|record| record.last_chunk_mut());
            // The order of the bytes is known inside each loop.
            match cloud.data_order() {
                order @ ByteOrder::Little => write_tails::<N, C>(order, colours, labels, tails),
                order @ ByteOrder::Big => write_tails::<N, C>(order, colours, labels, tails),
            }
            let points = first..first + count;
            if let Some(certainty) = annotation.certainty {
                let at = step + LABELS_LEN as usize + C;
                let certain = certainty.confidence[points.clone()].iter();
                let each = certain.zip(&certainty.entropy[points.clone()]);
                for (record, (&confidence, &entropy)) in records.chunks_exact_mut(record).zip(each)
                {
                    record[at..at + 4].copy_from_slice(&[confidence, entropy, 0, 0]);
                }
            }
            if let Some(track) = annotation.track {
                let order = cloud.data_order();
                for (record, &track) in records.chunks_exact_mut(record).zip(&track[points]) {
                    record[step + N - TRACK_LEN as usize..].copy_from_slice(&order.put_u32(track));
                }
            }
            out.extend_from_slice(records);
            first += count;
        }
    }
}

/// Copies points of `step` bytes to the beginnings of records. Whole pieces of [`PIECE`] bytes are
/// moved, which is faster than any odd number; what is too much lands where the tail is written
/// afterwards.
fn copy_points<'a, const N: usize>(
    points: &[u8],
    step: usize,
    records: impl Iterator<Item = &'a mut [u8]>,
) {
    const PIECE: usize = 16;
    const { assert!(PIECE <= N) };
    let padded = step.next_multiple_of(PIECE);
    for (start, record) in (0..).step_by(step).zip(records) {
        match points[start..].get(..padded) {
            Some(point) => {
                let pieces = record.as_chunks_mut::<PIECE>().0.iter_mut();
                pieces.zip(point.as_chunks::<PIECE>().0).for_each(|(to, from)| *to = *from);
            }
            None => record[..step].copy_from_slice(&points[start..][..step]),
        }
    }
}

/// Instance, component, class, reason and ground of a point, and the object that gives it its
/// colour.
type Labels = (u32, u32, u16, [u8; 2], u32);

impl PointAnnotation<'_> {
    fn certainty_len(&self) -> u32 {
        if self.certainty.is_some() { CERTAINTY_LEN } else { 0 }
    }

    fn track_len(&self) -> u32 {
        if self.track.is_some() { TRACK_LEN } else { 0 }
    }

    fn range(&self, points: Range<usize>) -> impl Iterator<Item = Labels> {
        let ids = self.instance[points.clone()].iter().zip(&self.component[points.clone()]);
        let others = self.semantic[points.clone()].iter().zip(&self.reason[points.clone()]);
        let ground = self.ground.map(|ground| &ground[points.clone()]);
        let ground = ground.into_iter().flatten().copied().chain(std::iter::repeat(0));
        let coloured = self.track.unwrap_or(self.instance)[points].iter();
        ids.zip(others).zip(ground.zip(coloured)).map(
            |(((&instance, &component), (&semantic, &reason)), (ground, &coloured))| {
                (instance, component, semantic, [reason, ground], coloured)
            },
        )
    }
}

#[inline(always)]
fn write_tails<'a, const N: usize, const C: usize>(
    order: ByteOrder,
    colours: &Colours<C>,
    labels: impl Iterator<Item = Labels>,
    tails: impl Iterator<Item = &'a mut [u8; N]>,
) {
    for ((instance, component, semantic, [reason, ground], coloured), tail) in labels.zip(tails) {
        tail[0..4].copy_from_slice(&order.put_u32(instance));
        tail[4..8].copy_from_slice(&order.put_u32(component));
        tail[8..10].copy_from_slice(&order.put_u16(semantic));
        tail[10..12].copy_from_slice(&[reason, ground]);
        tail[12..12 + C].copy_from_slice(colours.fields(coloured, reason));
    }
}

/// The C bytes of the fields of every colour that a point can have.
struct Colours<const C: usize> {
    of_instance: Vec<[u8; C]>,
    of_reason: [[u8; C]; REASONS],
}

/// Codes of reasons that have a colour of their own; all above have that of the last.
const REASONS: usize = 9;

impl<const C: usize> Colours<C> {
    fn new(bytes: impl Fn([u8; 3]) -> [u8; C]) -> Self {
        let ids = 1..=INSTANCE_COLOURS as u32;
        Colours {
            of_instance: ids.map(|id| bytes(instance_colour(id))).collect(),
            of_reason: std::array::from_fn(|reason| bytes(reason_colour(reason as u8))),
        }
    }

    #[inline]
    fn fields(&self, instance: u32, reason: u8) -> &[u8; C] {
        match instance {
            0 => &self.of_reason[usize::from(reason).min(REASONS - 1)],
            id => &self.of_instance[(id - 1) as usize % INSTANCE_COLOURS],
        }
    }
}

/// The fields `rgb` and `colors`.
fn colour_fields(order: ByteOrder, [red, green, blue]: [u8; 3]) -> [u8; 8] {
    let (argb, rgba) = ([0xff, red, green, blue], [red, green, blue, 0xff]);
    let mut fields = [0; 8];
    fields[..4].copy_from_slice(&order.put_u32(u32::from_be_bytes(argb)));
    fields[4..].copy_from_slice(&order.put_u32(u32::from_be_bytes(rgba)));
    fields
}

fn check(cloud: &CloudMessage, annotation: &PointAnnotation) -> Result<()> {
    let expected = cloud.point_count();
    let columns = [
        ("instance", annotation.instance.len()),
        (TRACK, annotation.track.map_or(expected, <[u32]>::len)),
        ("component", annotation.component.len()),
        ("semantic", annotation.semantic.len()),
        ("reason", annotation.reason.len()),
        (GROUND, annotation.ground.map_or(expected, <[u8]>::len)),
        ("confidence", annotation.certainty.map_or(expected, |certain| certain.confidence.len())),
        ("entropy", annotation.certainty.map_or(expected, |certain| certain.entropy.len())),
    ];
    match columns.into_iter().find(|&(_, found)| found != expected) {
        None => Ok(()),
        Some((column, found)) => Err(CloudError::ColumnLength { column, expected, found }.into()),
    }
}

/// Point step, row step and data length of the result, whose points are so many bytes longer.
fn sizes(cloud: &CloudMessage, more: u32) -> Result<(u32, u32, usize)> {
    let fit = || {
        let point_step = cloud.point_step.checked_add(more)?;
        let row_step = cloud.width.checked_mul(point_step)?;
        let length = row_step.checked_mul(cloud.height)?;
        Some((point_step, row_step, length as usize))
    };
    fit().ok_or_else(|| {
        cloud.malformed(format!(
            "{} x {} points of {} + {more} bytes are more than one message can hold",
            cloud.height, cloud.width, cloud.point_step
        ))
    })
}

fn fields(cloud: &CloudMessage, annotation: &PointAnnotation) -> Vec<PointField> {
    let mut fields = cloud.fields.clone();
    let labels =
        LABELS.into_iter().filter(|field| annotation.ground.is_some() || field.0 != GROUND);
    let behind_colours = annotation_len(cloud.format);
    let certainty = CERTAINTY.into_iter().filter(|_| annotation.certainty.is_some());
    let certainty = certainty.map(|(name, behind, kind)| (name, behind_colours + behind, kind));
    let colours = match cloud.format.is_foxglove() {
        true => &FOXGLOVE_COLOURS[..],
        false => &COLOURS[..],
    };
    let track = annotation
        .track
        .map(|_| (TRACK, behind_colours + annotation.certainty_len(), Datatype::UInt32));
    let behind_labels = colours.iter().copied().chain(certainty).chain(track);
    for (name, behind, datatype) in labels.chain(behind_labels) {
        let mut name = name.to_owned();
        while fields.iter().any(|field| field.name == name) {
            name.insert_str(0, CLASH_PREFIX);
        }
        fields.push(PointField { name, offset: cloud.point_step + behind, datatype, count: 1 });
    }
    fields
}

#[cfg(test)]
mod tests;
