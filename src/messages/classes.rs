//! Messages with a class for each point: clouds with a field for it, and images with a pixel for
//! each point of an organised cloud (`sensor_msgs/Image` of ROS 1 and 2).

use super::clouds::{CloudChannel, CloudFormat};
use super::ros::{ByteOrder, RosReader};
use super::stamp::stamp_ns;
use crate::error::frame::{FrameError, Result, Unsupported};
use divmerge_core::cloud::PointClasses;

/// Name of the type of images.
const IMAGE: &str = "Image";

/// How the messages of a channel are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ClassFormat {
    Cloud(CloudFormat),
    ImageRos1,
    ImageRos2,
}

/// The classes of one message.
#[derive(Debug, Clone, PartialEq)]
pub struct ClassMessage {
    /// Stamp, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Coordinate frame.
    pub frame_id: String,
    /// Rows and columns of an image or an organised cloud; 1 and N of a cloud that is not.
    pub shape: [usize; 2],
    /// Row by row.
    pub classes: PointClasses,
}

impl ClassFormat {
    /// The layout of messages of a type in an encoding; `None` if they hold no classes.
    pub fn named(type_name: &str, message_encoding: &str) -> Option<Self> {
        if let Some(format) = CloudChannel::named(type_name, message_encoding).format() {
            return Some(ClassFormat::Cloud(format));
        }
        match (type_name.rsplit(['/', '.']).next().unwrap_or_default(), message_encoding) {
            (IMAGE, "cdr") => Some(ClassFormat::ImageRos2),
            (IMAGE, "ros1") => Some(ClassFormat::ImageRos1),
            _ => None,
        }
    }

    /// Reads a message.
    ///
    /// # Errors
    /// [`FrameError::Malformed`], [`FrameError::Unsupported`], and [`FrameError::MissingField`] of
    /// a cloud without classes.
    pub fn read(self, message: &[u8]) -> Result<ClassMessage> {
        match self {
            ClassFormat::Cloud(format) => cloud(format, message),
            ClassFormat::ImageRos1 => image_classes(message, true),
            ClassFormat::ImageRos2 => image_classes(message, false),
        }
    }
}

fn cloud(format: CloudFormat, message: &[u8]) -> Result<ClassMessage> {
    let wire = format.decode(message)?;
    let Some(field) = wire.semantic_field() else {
        let present =
            wire.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>().join(", ");
        let name = "label, semantic, class_id or class_ids".to_owned();
        return Err(FrameError::MissingField { name, present });
    };
    Ok(ClassMessage {
        stamp_ns: wire.stamp_ns(),
        frame_id: wire.frame_id.clone(),
        shape: [wire.height as usize, wire.width as usize],
        classes: wire.classes(field)?,
    })
}

/// The classes in a `sensor_msgs/Image` of ROS 1 or of ROS 2, a pixel each.
///
/// # Errors
/// [`FrameError::Malformed`] if its sizes do not agree, [`FrameError::Unsupported`] for other
/// encodings than integers of one channel.
pub fn image_classes(message: &[u8], is_ros1: bool) -> Result<ClassMessage> {
    let mut reader = RosReader::new(IMAGE, is_ros1, message)?;
    let (sec, nanosec, frame_id) = reader.header()?;
    let stamp_ns = stamp_ns(sec, nanosec);
    let (rows, columns) = (reader.u32()? as usize, reader.u32()? as usize);
    let encoding = reader.string()?;
    let order = if reader.bool()? { ByteOrder::Big } else { ByteOrder::Little };
    let step = reader.u32()? as usize;
    let data = reader.data()?;
    let length = data.len();
    let bytes = match encoding.as_str() {
        "mono8" | "8UC1" | "8SC1" => 1,
        "mono16" | "16UC1" | "16SC1" => 2,
        "32SC1" => 4,
        _ => {
            let problem = Unsupported::ImageEncoding { encoding };
            return Err(FrameError::Unsupported { message: IMAGE, problem });
        }
    };
    let fits = columns.checked_mul(bytes).is_some_and(|packed| packed <= step)
        && rows.checked_mul(step) == Some(length);
    if !fits {
        return Err(reader.malformed(format!(
            "{length} bytes for {rows} rows of {step} with {columns} pixels of {bytes}"
        )));
    }
    let class = |pixel: &[u8]| match *pixel {
        [value] => u16::from(value),
        [a, b] => order.get_u16([a, b]),
        [a, b, c, d] => order.get_u32([a, b, c, d]) as u16,
        _ => 0,
    };
    let rows_of = data.chunks_exact(step.max(1));
    let class =
        rows_of.flat_map(|row| row[..columns * bytes].chunks_exact(bytes).map(class)).collect();
    let classes = PointClasses { class, ..PointClasses::default() };
    Ok(ClassMessage { stamp_ns, frame_id, shape: [rows, columns], classes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::ros::{Layout, RosWriter};

    fn write(layout: Layout, encoding: &str, step: u32, data: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut writer = RosWriter::new(layout, &mut out);
        writer.header((5, 7, "lidar"));
        writer.u32(2);
        writer.u32(3);
        writer.string(encoding);
        writer.bool(false);
        writer.u32(step);
        writer.u32(data.len() as u32);
        writer.bytes(data);
        out
    }

    #[test]
    fn images_of_both_ros() {
        let data = [1, 0, 2, 0, 3, 0, 9, 9, 4, 0, 5, 0, 0, 1, 9, 9];
        for (format, layout) in [
            (ClassFormat::ImageRos1, Layout::Ros1),
            (ClassFormat::ImageRos2, Layout::Cdr(ByteOrder::Little)),
        ] {
            let image = format.read(&write(layout, "mono16", 8, &data)).unwrap();
            assert_eq!((image.stamp_ns, image.frame_id.as_str()), (5_000_000_007, "lidar"));
            assert_eq!((image.shape, image.classes.class), ([2, 3], vec![1, 2, 3, 4, 5, 256]));
            let bytes = format.read(&write(layout, "8UC1", 3, &[1, 2, 3, 4, 5, 6])).unwrap();
            assert_eq!(bytes.classes.class, [1, 2, 3, 4, 5, 6]);
            assert!(format.read(&write(layout, "rgb8", 9, &[0; 18])).is_err());
            assert!(format.read(&write(layout, "mono8", 2, &[0; 4])).is_err());
            assert!(format.read(&write(layout, "mono8", 3, &[0; 5])).is_err());
        }
    }
}
