//! The annotated cloud: every byte of the input's points, and behind each its labels and colour.

use super::point_cloud2::{Datatype, PointCloud2, PointField, malformed};
use crate::error::{Error, Result};
use crate::palette::{instance_colour, reason_colour};

/// Bytes appended to each point.
pub const ANNOTATION_LEN: u32 = 20;

/// What is put in front of a field name that the input already has.
pub const CLASH_PREFIX: &str = "divmerge_";

/// The appended fields: name, bytes behind the original point, type. Byte 11 is padding.
const FIELDS: [(&str, u32, Datatype); 6] = [
    ("instance", 0, Datatype::UInt32),
    ("component", 4, Datatype::UInt32),
    ("semantic", 8, Datatype::UInt16),
    ("reason", 10, Datatype::UInt8),
    ("rgb", 12, Datatype::Float32),
    ("colors", 16, Datatype::UInt32),
];

/// Labels of every point of a cloud, in its order.
#[derive(Debug, Clone, Copy)]
pub struct PointAnnotation<'a> {
    /// Instance, 0 for none.
    pub instance: &'a [u32],
    /// Connected component before merging, 0 for none.
    pub component: &'a [u32],
    /// Class in the recording's own ids.
    pub semantic: &'a [u16],
    /// Why the point has no instance; see [`reason_colour`].
    pub reason: &'a [u8],
}

/// Writes `cloud` with its annotation as a PointCloud2 message, replacing what is in `out`.
///
/// The rows are packed; everything else of the message, and every byte of every point, is the
/// input's. Each point grows by [`ANNOTATION_LEN`] bytes: `instance` UINT32, `component` UINT32,
/// `semantic` UINT16, `reason` UINT8, a zero, `rgb` FLOAT32 holding 0xFFRRGGBB as PCL does, and
/// `colors` UINT32 0xRRGGBBFF. A name that the cloud already has is written with
/// [`CLASH_PREFIX`].
///
/// # Errors
/// [`Error::ColumnLength`] if a column does not have one value for each point,
/// [`Error::Malformed`] if the result would not fit the message's 32-bit sizes.
pub fn annotated_cloud(
    cloud: &PointCloud2,
    annotation: &PointAnnotation,
    out: &mut Vec<u8>,
) -> Result<()> {
    check(cloud, annotation)?;
    let (point_step, row_step, length) = sizes(cloud)?;
    let fields = fields(cloud);
    out.clear();
    out.reserve_exact(head_bound(cloud, &fields) + length);
    cloud.encode_head(&fields, point_step, row_step, out);
    cloud.encode_data(length, out, |out| append_points(cloud, annotation, out));
    Ok(())
}

fn append_points(cloud: &PointCloud2, annotation: &PointAnnotation, out: &mut Vec<u8>) {
    let order = cloud.data_order();
    let labels = (annotation.instance.iter().zip(annotation.component))
        .zip(annotation.semantic.iter().zip(annotation.reason));
    for (point, ((&instance, &component), (&semantic, &reason))) in cloud.points().zip(labels) {
        let [red, green, blue] = match instance {
            0 => reason_colour(reason),
            id => instance_colour(id),
        };
        let mut tail = [0; ANNOTATION_LEN as usize];
        tail[0..4].copy_from_slice(&order.put_u32(instance));
        tail[4..8].copy_from_slice(&order.put_u32(component));
        tail[8..10].copy_from_slice(&order.put_u16(semantic));
        tail[10] = reason;
        let (argb, rgba) = ([0xff, red, green, blue], [red, green, blue, 0xff]);
        tail[12..16].copy_from_slice(&order.put_u32(u32::from_be_bytes(argb)));
        tail[16..20].copy_from_slice(&order.put_u32(u32::from_be_bytes(rgba)));
        out.extend_from_slice(point);
        out.extend_from_slice(&tail);
    }
}

fn check(cloud: &PointCloud2, annotation: &PointAnnotation) -> Result<()> {
    let expected = cloud.point_count();
    let columns = [
        ("instance", annotation.instance.len()),
        ("component", annotation.component.len()),
        ("semantic", annotation.semantic.len()),
        ("reason", annotation.reason.len()),
    ];
    match columns.into_iter().find(|&(_, found)| found != expected) {
        None => Ok(()),
        Some((column, found)) => Err(Error::ColumnLength {
            column,
            expected,
            found,
        }),
    }
}

/// Point step, row step and data length of the result.
fn sizes(cloud: &PointCloud2) -> Result<(u32, u32, usize)> {
    let fit = || {
        let point_step = cloud.point_step.checked_add(ANNOTATION_LEN)?;
        let row_step = cloud.width.checked_mul(point_step)?;
        let length = row_step.checked_mul(cloud.height)?;
        Some((point_step, row_step, length as usize))
    };
    fit().ok_or_else(|| {
        malformed(format!(
            "{} x {} points of {} + {ANNOTATION_LEN} bytes are more than one message can hold",
            cloud.height, cloud.width, cloud.point_step
        ))
    })
}

fn fields(cloud: &PointCloud2) -> Vec<PointField> {
    let mut fields = cloud.fields.clone();
    for (name, behind, datatype) in FIELDS {
        let mut name = name.to_owned();
        while fields.iter().any(|field| field.name == name) {
            name.insert_str(0, CLASH_PREFIX);
        }
        fields.push(PointField {
            name,
            offset: cloud.point_step + behind,
            datatype,
            count: 1,
        });
    }
    fields
}

/// Bytes of the message besides its data, at most.
fn head_bound(cloud: &PointCloud2, fields: &[PointField]) -> usize {
    let names: usize = fields.iter().map(|field| field.name.len()).sum();
    64 + cloud.frame_id.len() + names + 24 * fields.len()
}
