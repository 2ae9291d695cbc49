//! `diagnostic_msgs/msg/DiagnosticArray`: something that stands in words and numbers beside a
//! cloud, which every viewer shows in a table or plots.

use super::definitions::{self, MessageSchema};
use super::ros::{Layout, RosWriter};

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// All is well.
    Ok = 0,
    /// Something to look at.
    Warn = 1,
    /// Something that is probably wrong.
    Error = 2,
}

/// One line of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub level: Level,
    /// What it is about.
    pub name: String,
    /// In words.
    pub message: String,
    /// What it was found on: the topic.
    pub hardware_id: String,
    /// Figures by name, numbers as text.
    pub values: Vec<(&'static str, String)>,
}

/// The type in a layout.
pub fn diagnostic_schema(layout: Layout) -> MessageSchema {
    match layout {
        Layout::Cdr(_) => definitions::DIAGNOSTIC_ARRAY,
        Layout::Ros1 => definitions::ros1::DIAGNOSTIC_ARRAY,
    }
}

/// Writes a DiagnosticArray message, replacing what is in `out`.
pub fn diagnostic_array(
    layout: Layout,
    (stamp_sec, stamp_nanosec): (i32, u32),
    frame_id: &str,
    diagnostics: &[Diagnostic],
    out: &mut Vec<u8>,
) {
    let mut writer = RosWriter::new(layout, out);
    writer.header((stamp_sec, stamp_nanosec, frame_id));
    writer.length(diagnostics.len());
    for diagnostic in diagnostics {
        writer.u8(diagnostic.level as u8);
        writer.string(&diagnostic.name);
        writer.string(&diagnostic.message);
        writer.string(&diagnostic.hardware_id);
        writer.length(diagnostic.values.len());
        for (key, value) in &diagnostic.values {
            writer.string(key);
            writer.string(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ros::{ByteOrder, RosReader};
    use super::*;

    #[test]
    fn a_message_taken_apart_again() {
        let one = Diagnostic {
            level: Level::Error,
            name: "two masses".into(),
            message: "12 car".into(),
            hardware_id: "/lidar".into(),
            values: vec![("score", "0.5".into()), ("x", "-1".into())],
        };
        for byte_order in [ByteOrder::Little, ByteOrder::Big] {
            let mut cdr = vec![7; 3];
            diagnostic_array(
                Layout::Cdr(byte_order),
                (-3, 4),
                "lidar",
                &[one.clone(), one.clone()],
                &mut cdr,
            );
            let mut reader = RosReader::cdr("DiagnosticArray", &cdr).unwrap();
            assert_eq!((reader.i32().unwrap(), reader.u32().unwrap()), (-3, 4));
            assert_eq!((reader.string().unwrap().as_str(), reader.u32().unwrap()), ("lidar", 2));
            for _ in 0..2 {
                assert_eq!(reader.u8().unwrap(), 2);
                let words = [(); 3].map(|()| reader.string().unwrap());
                assert_eq!(words, ["two masses", "12 car", "/lidar"]);
                assert_eq!(reader.u32().unwrap(), 2);
                let pairs = [(); 4].map(|()| reader.string().unwrap());
                assert_eq!(pairs, ["score", "0.5", "x", "-1"]);
            }
            assert_eq!(reader.remaining(), 0);
        }
    }
}
