//! Wild clouds from bytes: whatever the bytes are, they are a cloud that a message could hold.

use divmerge::{PointCloud, PointColumns};

/// Values that a byte stands for; the others are metres.
const SPECIAL: [f32; 14] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    1e38,
    -1e38,
    1e19,
    1e9,
    -1e9,
    1e-38,
    1e-45,
    0.0,
    -0.0,
];

/// A cloud of a head (whether there are rings and classes, how many rows) and seven bytes for each
/// point: three coordinates, ring and class. With rows it is organised, its last points left out
/// where they fill no row.
pub fn wild(bytes: &[u8]) -> PointCloud {
    let (head, points) = bytes.split_at(bytes.len().min(4));
    let head: Vec<u8> = head.iter().copied().chain([0; 4]).take(4).collect();
    let rows = if head[0] & 4 == 0 { 1 } else { usize::from(head[1]).max(1) };
    let points: Vec<&[u8]> = points.chunks_exact(7).collect();
    let points = &points[..points.len() / rows * rows];
    let scale = 10_f32.powi(i32::from(head[2] % 8) - 4);
    let column = |at: usize| points.iter().map(|point| metres(point[at], scale)).collect();
    let word = |at: usize| points.iter().map(move |p| u16::from_le_bytes([p[at], p[at + 1]]));
    let columns = PointColumns {
        height: rows,
        width: points.len() / rows,
        x: column(0),
        y: column(1),
        z: column(2),
        ring: (head[0] & 1 != 0).then(|| word(3).collect()),
        class: (head[0] & 2 != 0).then(|| word(5).map(|class| class % 300).collect()),
        source: (head[0] & 8 != 0).then(|| word(5).map(|source| source % 3).collect()),
        ..PointColumns::default()
    };
    columns.checked().expect("as many of each")
}

fn metres(byte: u8, scale: f32) -> f32 {
    match SPECIAL.get(usize::from(byte)) {
        Some(&special) => special,
        None => (f32::from(byte) - 135.0) * scale,
    }
}

/// What [`wild`] takes for a cloud with rings and classes, for one organised, for one with neither,
/// for one without a point, and for one point many times.
pub fn seeds() -> Vec<Vec<u8>> {
    let point = |number: usize| {
        let ring = (number % 16) as u8;
        [40 + (number / 2) as u8, 100 + (number * 7 % 90) as u8, 128 + ring, ring, 0, 10, 0]
    };
    let points: Vec<u8> = (0..200).flat_map(point).collect();
    let head = |head: [u8; 4]| [&head, points.as_slice()].concat();
    vec![
        head([3, 1, 3, 0]),
        head([6, 10, 4, 0]),
        head([0, 1, 5, 0]),
        vec![1, 1, 4, 0],
        [&[3, 1, 4, 0], point(5).repeat(300).as_slice()].concat(),
    ]
}
