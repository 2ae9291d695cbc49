//! `.bin`: little-endian float32 columns and nothing else. KITTI has four of them, nuScenes five.

use super::columns::Columns;
use super::scan::{Parsed, Scan, shape};
use crate::messages::clouds::Datatype;

pub(super) fn parse(bytes: Vec<u8>, columns: Option<&Columns>) -> Parsed<Scan> {
    let usual = Columns::usual(4);
    let columns = columns.unwrap_or(&usual);
    let step = 4 * columns.count();
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    if !bytes.len().is_multiple_of(step) {
        return Err(format!(
            "{} bytes are no multiple of {step} ({} columns of 4 bytes)",
            bytes.len(),
            columns.count()
        ));
    }
    let [height, width] = shape(1, (bytes.len() / step) as u64, step as u32)?;
    Ok(Scan {
        fields: columns.fields(Datatype::Float32),
        point_step: step as u32,
        height,
        width,
        is_bigendian: false,
        data: bytes,
        left_out: Vec::new(),
    })
}
