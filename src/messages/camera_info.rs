//! `sensor_msgs/msg/CameraInfo`: how a camera projects.

use super::ros::{ByteOrder, Layout, RosWriter};
use super::stamp::stamp;

/// Writes the calibration of a rectified camera, replacing what is in `out`: no distortion (five
/// zeros of `plumb_bob`), no rotation, K the left three columns of P. The size of the image is not
/// known and written as 0 x 0.
///
/// `projection` is P, 3 x 4 and row by row: it takes metres in the frame `frame_id` to pixels.
pub fn camera_info(stamp_ns: u64, frame_id: &str, projection: &[f64; 12], out: &mut Vec<u8>) {
    let (sec, nanosec) = stamp(stamp_ns);
    let mut cdr = RosWriter::new(Layout::Cdr(ByteOrder::Little), out);
    cdr.header((sec, nanosec, frame_id));
    cdr.u32(0); // height
    cdr.u32(0); // width
    cdr.string("plumb_bob");
    cdr.length(5);
    cdr.f64s([0.0; 5]); // d
    let rows = projection.as_chunks::<4>().0.iter();
    cdr.f64s(rows.flat_map(|row| row[..3].iter().copied())); // k
    cdr.f64s([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]); // r
    cdr.f64s(*projection);
    cdr.u32(0); // binning_x: none
    cdr.u32(0);
    [0; 4].into_iter().for_each(|value| cdr.u32(value)); // roi: the whole image
    cdr.bool(false); // roi.do_rectify
}
