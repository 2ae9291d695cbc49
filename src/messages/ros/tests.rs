use super::*;

const LAYOUTS: [Layout; 3] =
    [Layout::Cdr(ByteOrder::Little), Layout::Cdr(ByteOrder::Big), Layout::Ros1];

fn open(layout: Layout, bytes: &[u8]) -> RosReader<'_> {
    match layout {
        Layout::Cdr(_) => RosReader::cdr("test", bytes).unwrap(),
        Layout::Ros1 => RosReader::ros1("test", bytes),
    }
}

fn write(layout: Layout) -> Vec<u8> {
    let mut out = vec![9; 3];
    let mut writer = RosWriter::new(layout, &mut out);
    writer.u8(7);
    writer.u32(0x0102_0304);
    writer.string("ab");
    writer.f64(1.0);
    writer.bool(true);
    writer.u16(0x0506);
    out
}

#[test]
fn known_bytes_little_endian() {
    let expected = [
        0, 1, 0, 0, // header
        7, 0, 0, 0, 4, 3, 2, 1, // u8, padding, u32
        3, 0, 0, 0, b'a', b'b', 0, 0, // string, padding
        0, 0, 0, 0, 0, 0, 0xf0, 0x3f, // f64, already aligned
        1, 0, 6, 5, // bool, padding, u16
    ];
    assert_eq!(write(Layout::Cdr(ByteOrder::Little)), expected);
}

#[test]
fn known_bytes_big_endian() {
    let expected = [
        0, 0, 0, 0, 7, 0, 0, 0, 1, 2, 3, 4, 0, 0, 0, 3, b'a', b'b', 0, 0, 0x3f, 0xf0, 0, 0, 0, 0,
        0, 0, 1, 0, 5, 6,
    ];
    assert_eq!(write(Layout::Cdr(ByteOrder::Big)), expected);
}

#[test]
fn known_bytes_of_ros_1() {
    let expected = [7, 4, 3, 2, 1, 2, 0, 0, 0, b'a', b'b', 0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 1, 6, 5];
    assert_eq!(write(Layout::Ros1), expected);
}

#[test]
fn headers_come_back() {
    for layout in LAYOUTS {
        let mut bytes = Vec::new();
        RosWriter::new(layout, &mut bytes).header((-3, 4, "lidar"));
        let mut reader = open(layout, &bytes);
        let sec = if layout == Layout::Ros1 { i64::from(-3_i32 as u32) } else { -3 };
        assert_eq!(reader.header().unwrap(), (sec, 4, "lidar".to_owned()));
        assert_eq!(reader.remaining(), 0);
    }
}

#[test]
fn reads_what_it_wrote() {
    for layout in LAYOUTS {
        let bytes = write(layout);
        let mut reader = open(layout, &bytes);
        assert_eq!(reader.layout(), layout);
        assert_eq!(reader.u8().unwrap(), 7);
        assert_eq!(reader.u32().unwrap(), 0x0102_0304);
        assert_eq!(reader.string().unwrap(), "ab");
        assert_eq!(reader.f64().unwrap(), 1.0);
        assert!(reader.bool().unwrap());
        assert_eq!(reader.u16().unwrap(), 0x0506);
        assert_eq!(reader.remaining(), 0);
        assert!(matches!(reader.u8(), Err(FrameError::Malformed { .. })));
    }
}

#[test]
fn other_encapsulations_are_named() {
    let error = RosReader::cdr("test", &[0, 3, 0, 0]).unwrap_err();
    assert!(matches!(error, FrameError::Unsupported { .. }));
    assert!(error.to_string().contains("00 03"), "{error}");
    assert!(RosReader::cdr("test", &[0, 1, 0]).is_err());
}

#[test]
fn claimed_lengths_are_checked_before_anything_is_allocated() {
    let bytes = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, b'a', 0];
    assert!(RosReader::cdr("test", &bytes).unwrap().string().is_err());
    assert!(RosReader::cdr("test", &bytes).unwrap().sequence(1).is_err());
    assert!(RosReader::cdr("test", &bytes).unwrap().sequence(usize::MAX).is_err());
}

#[test]
fn strings_are_closed_and_utf8() {
    for body in [[2, 0, 0, 0, b'a', b'b'], [2, 0, 0, 0, 0xff, 0]] {
        let bytes = [[0, 1, 0, 0].as_slice(), &body].concat();
        assert!(RosReader::cdr("test", &bytes).unwrap().string().is_err());
    }
    let empty = [0, 1, 0, 0, 0, 0, 0, 0];
    assert_eq!(RosReader::cdr("test", &empty).unwrap().string().unwrap(), "");
}
