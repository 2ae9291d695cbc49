//! `T/objects`: which messages say the objects beside clouds of a format. The one place that knows; formats for
//! which it has none get no such topic.

use crate::instances::Instance;
use crate::io::{
    self, CloudFormat, MARKER_ARRAY_NAME, MARKER_ARRAY_SCHEMA, MarkerBox, MessageSchema,
    PackedCloud,
};

/// Definition and encoding of the messages beside clouds of a format, if there are any.
pub(super) fn schema(format: CloudFormat) -> Option<(MessageSchema, &'static str)> {
    let data = MARKER_ARRAY_SCHEMA.as_bytes().into();
    let markers = MessageSchema { name: MARKER_ARRAY_NAME, encoding: "ros2msg", data };
    (format == CloudFormat::Ros2).then_some((markers, "cdr"))
}

/// Writes the message beside an annotated cloud, replacing what is in `out`; nothing where its format has none.
pub(super) fn encode(cloud: &PackedCloud, instances: &[Instance], out: &mut Vec<u8>) {
    out.clear();
    let Some(layout) = cloud.layout().filter(|_| schema(cloud.format).is_some()) else {
        return;
    };
    let boxes: Vec<MarkerBox> = instances.iter().map(marker).collect();
    let (seconds, nanoseconds) = (cloud.stamp_sec as i32, cloud.stamp_nanosec);
    io::marker_array(layout, seconds, nanoseconds, &cloud.frame_id, &boxes, out);
}

fn marker(instance: &Instance) -> MarkerBox {
    MarkerBox {
        id: instance.id,
        centre: instance.bounds.centre,
        yaw: instance.bounds.yaw,
        size: instance.bounds.size,
        text: instance.title(),
    }
}
