//! Boxes in ROS 2 messages: `visualization_msgs/msg/MarkerArray` and
//! `vision_msgs/msg/Detection3DArray`, in CDR.

use std::collections::BTreeMap;

use super::ros::RosReader;
use super::stamp::stamp_ns;
use crate::error::frame::Result;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{Detection, UprightBox};

/// Name of the type of marker arrays.
pub const MARKER_ARRAY: &str = "MarkerArray";
/// Name of the type of detection arrays.
pub const DETECTION_ARRAY: &str = "Detection3DArray";

const CUBE: i32 = 1;
const ADD: i32 = 0;
const DELETE: i32 = 2;
const DELETE_ALL: i32 = 3;

/// Score of a detection that has none.
const CERTAIN: f64 = 1.0;

/// The boxes of one message.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxMessage {
    /// Stamp, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Coordinate frame.
    pub frame_id: String,
    /// The boxes.
    pub detections: Vec<Detection>,
}

/// Stamp in nanoseconds and coordinate frame.
type Header = (i64, String);

/// Reads a MarkerArray: a box for each cube that is added and not deleted again in the same array,
/// in the order of namespaces and ids. Its class is what its own text, that of a marker of the same
/// id or else its namespace names; a number in front, as in `12 car`, is no part of the name. Stamp
/// and frame are those of the cubes, or of the first marker where there is none.
///
/// Arrays from before Humble have no textures (`has_textures`). `None` of an array without markers,
/// which has no stamp.
///
/// # Errors
/// [`crate::error::FrameError::Malformed`] if it ends early or late, its cubes have several frames,
/// or a size or a place is no number; [`crate::error::FrameError::Unsupported`] if it is not plain
/// CDR.
pub fn marker_boxes(
    cdr: &[u8],
    has_textures: bool,
    taxonomy: &Taxonomy,
) -> Result<Option<BoxMessage>> {
    let mut reader = RosReader::cdr(MARKER_ARRAY, cdr)?;
    let mut first: Option<Header> = None;
    let mut cubes: BTreeMap<(String, i32), (Header, Pose, String)> = BTreeMap::new();
    let mut texts: BTreeMap<i32, Vec<String>> = BTreeMap::new();
    for _ in 0..reader.sequence(LEAST_MARKER)? {
        let marker = read_marker(&mut reader, has_textures)?;
        first.get_or_insert_with(|| marker.header.clone());
        let name = (marker.namespace, marker.id);
        match (marker.action, marker.kind) {
            (ADD, CUBE) => {
                cubes.insert(name, (marker.header, marker.pose, marker.text));
            }
            (ADD, _) => texts.entry(marker.id).or_default().push(marker.text),
            (DELETE, _) => drop(cubes.remove(&name)),
            (DELETE_ALL, _) => cubes.clear(),
            _ => {}
        }
    }
    check_end(&reader)?;
    let header = cubes.values().next().map(|(header, ..)| header.clone()).or(first);
    let Some((stamp_ns, frame_id)) = header else { return Ok(None) };
    let mut detections = Vec::with_capacity(cubes.len());
    for ((namespace, id), ((_, frame), pose, text)) in &cubes {
        same_frame(&reader, &frame_id, frame)?;
        let others = texts.get(id).into_iter().flatten();
        let class = [text].into_iter().chain(others).find_map(|text| class_in(text, taxonomy));
        let class = class.or_else(|| class_in(namespace, taxonomy));
        detections.push(Detection { bounds: pose.upright(&reader)?, class, score: CERTAIN });
    }
    Ok(Some(BoxMessage { stamp_ns, frame_id, detections }))
}

/// Reads a Detection3DArray as vision_msgs has it since version 4 (Humble). Of several hypotheses
/// the surest counts, of equals the first; its `class_id` is the name of a class or an id of the
/// taxonomy, and a detection whose class the taxonomy does not have, or without a hypothesis, is
/// one of any class.
///
/// # Errors
/// As [`marker_boxes`].
pub fn detection_boxes(cdr: &[u8], taxonomy: &Taxonomy) -> Result<BoxMessage> {
    let mut reader = RosReader::cdr(DETECTION_ARRAY, cdr)?;
    let (stamp_ns, mut frame_id) = header(&mut reader)?;
    let mut detections = Vec::new();
    for _ in 0..reader.sequence(LEAST_DETECTION)? {
        let (_, _, frame) = reader.header()?;
        if frame_id.is_empty() {
            frame_id = frame;
        } else if !frame.is_empty() {
            same_frame(&reader, &frame_id, &frame)?;
        }
        let surest = read_hypotheses(&mut reader)?;
        let bounds = read_pose(&mut reader)?.upright(&reader)?;
        reader.string()?; // id
        let (class, score) = surest.unwrap_or((String::new(), CERTAIN));
        let class = match class.trim().parse::<u16>() {
            Ok(id) => taxonomy.class_of(id).filter(|&class| class != 0),
            Err(_) => taxonomy.class_called(class.trim()),
        };
        detections.push(Detection { bounds, class, score });
    }
    check_end(&reader)?;
    Ok(BoxMessage { stamp_ns, frame_id, detections })
}

/// Fewest bytes of a marker and of a detection, so that a length that lies is found before anything
/// is read.
const LEAST_MARKER: usize = 100;
const LEAST_DETECTION: usize = 100;

/// The class that a text names, without a number in front of it.
fn class_in(text: &str, taxonomy: &Taxonomy) -> Option<u16> {
    let name = text.trim().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
    taxonomy.class_called(name)
}

/// The fields of a marker that are used here.
struct Marker {
    header: Header,
    namespace: String,
    id: i32,
    kind: i32,
    action: i32,
    pose: Pose,
    text: String,
}

fn read_marker(reader: &mut RosReader, has_textures: bool) -> Result<Marker> {
    let header = header(reader)?;
    let namespace = reader.string()?;
    let [id, kind, action] = [reader.i32()?, reader.i32()?, reader.i32()?];
    let pose = read_pose(reader)?;
    skip_f32(reader, 4)?; // colour
    reader.i32()?; // lifetime
    reader.u32()?;
    reader.bool()?; // frame_locked
    for _ in 0..reader.sequence(24)? {
        reader.f64s::<3>()?; // points
    }
    let colours = reader.sequence(16)?;
    skip_f32(reader, 4 * colours)?;
    if has_textures {
        reader.string()?;
        reader.header()?; // texture
        reader.string()?;
        reader.data()?;
        let coordinates = reader.sequence(8)?;
        skip_f32(reader, 2 * coordinates)?;
    }
    let text = reader.string()?;
    reader.string()?; // mesh_resource
    if has_textures {
        reader.string()?; // mesh_file
        reader.data()?;
    }
    reader.bool()?; // mesh_use_embedded_materials
    Ok(Marker { header, namespace, id, kind, action, pose, text })
}

/// Name and score of the hypothesis with the highest score.
fn read_hypotheses(reader: &mut RosReader) -> Result<Option<(String, f64)>> {
    let mut surest: Option<(String, f64)> = None;
    for _ in 0..reader.sequence(8 * (1 + 7 + 36))? {
        let (class, score) = (reader.string()?, reader.f64()?);
        reader.f64s::<7>()?; // pose
        reader.f64s::<36>()?; // covariance
        if surest.as_ref().is_none_or(|(_, most)| score > *most) {
            surest = Some((class, score));
        }
    }
    Ok(surest)
}

fn header(reader: &mut RosReader) -> Result<Header> {
    let (sec, nanosec, frame_id) = reader.header()?;
    Ok((stamp_ns(sec, nanosec), frame_id))
}

/// A pose and the sides along its axes, metres.
struct Pose {
    position: [f64; 3],
    /// Quaternion x, y, z, w.
    orientation: [f64; 4],
    size: [f64; 3],
}

fn read_pose(reader: &mut RosReader) -> Result<Pose> {
    Ok(Pose { position: reader.f64s()?, orientation: reader.f64s()?, size: reader.f64s()? })
}

impl Pose {
    /// The box, turned about the vertical alone: as its first axis lies on the plane.
    fn upright(&self, reader: &RosReader) -> Result<UprightBox> {
        let Pose { position, orientation: [x, y, z, w], size } = *self;
        // The first axis turned by the quaternion, of any length; of length 0 it is no turn.
        let yaw = (2.0 * (x * y + w * z)).atan2(w * w + x * x - y * y - z * z);
        let is_number = position.into_iter().chain([yaw]).all(f64::is_finite);
        if !is_number || !size.into_iter().all(|side| side.is_finite() && side >= 0.0) {
            let orientation = self.orientation;
            return Err(reader.malformed(format!(
                "a box at {position:?} m, turned by {orientation:?}, with sides of {size:?} m"
            )));
        }
        Ok(UprightBox::new(position, size, yaw))
    }
}

fn skip_f32(reader: &mut RosReader, count: usize) -> Result<()> {
    (0..count).try_for_each(|_| reader.f32().map(drop))
}

fn same_frame(reader: &RosReader, one: &str, other: &str) -> Result<()> {
    match one == other {
        true => Ok(()),
        false => {
            Err(reader.malformed(format!("boxes in the frames `{one}` and `{other}` at once")))
        }
    }
}

/// Messages may be padded to a whole number of words; more means another layout of the type.
fn check_end(reader: &RosReader) -> Result<()> {
    match reader.remaining() {
        0..8 => Ok(()),
        rest => {
            let problem =
                format!("{rest} bytes are left behind its end: another layout of the type");
            Err(reader.malformed(problem))
        }
    }
}

#[cfg(test)]
mod tests;
