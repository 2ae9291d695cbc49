//! A frame in so many bytes: with everything if that fits, else coarser and with fewer points.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::GzEncoder;

use super::pack::Sums;
use super::picture::picture;
use super::requests::{Outcome, Problem};
use super::run::Run;
use super::session::Session;
use super::thinning::{Detail, Thinning};
use crate::text::grouped;

/// One of so many points of the background and of objects is kept, the fewer the later.
const STRIDES: [[usize; 2]; 14] = [
    [2, 1],
    [4, 1],
    [8, 1],
    [16, 1],
    [16, 2],
    [16, 4],
    [32, 8],
    [64, 16],
    [128, 32],
    [256, 64],
    [512, 128],
    [1024, 256],
    [4096, 1024],
    [16384, 4096],
];
/// No point takes less, in bytes.
const LEAST_BYTES_OF_POINT: usize = 3;

/// A frame that fits.
pub(super) struct FittedFrame {
    /// How much of the cloud is told.
    pub detail: Detail,
    /// The frame, packed.
    pub picture: String,
    /// The sums of its arrays.
    pub sums: Sums,
    /// What is left out, in words.
    pub left_out: Vec<String>,
}

impl FittedFrame {
    /// The frame of a run with as much as there is room for, in bytes, and some points in any case.
    ///
    /// # Errors
    /// If nothing fits; those of the session.
    pub fn new(session: &Session, run: &Run, always: &[usize], room: usize) -> Outcome<Self> {
        let coarse = Detail { is_coarse: true, ..Detail::WHOLE };
        let bare = Detail { has_intensity: false, ..coarse.clone() };
        let thinned = STRIDES.map(|strides| (Some(strides), bare.clone()));
        let all = [Detail::WHOLE, coarse, bare].map(|detail| (None, detail));
        for (strides, detail) in all.into_iter().chain(thinned) {
            let thinning = strides.map(|strides| Thinning::new(run, strides, always));
            let count = thinning.as_ref().map_or(run.cloud.cloud.len(), Thinning::len);
            if count * LEAST_BYTES_OF_POINT > room {
                continue;
            }
            let left_out = left_out(run, strides, &detail, count);
            let detail = Detail { thinning, ..detail };
            let whole = picture(session, run, (true, Sums::new()), &detail)?;
            let (sums, picture) = (whole.sums(), packed(&whole.finish()));
            if picture.len() <= room {
                return Ok(FittedFrame { detail, picture, sums, left_out });
            }
        }
        Err(Problem::wrong(format!("the frame does not fit into {room} bytes")))
    }

    /// The places of points that are kept.
    pub fn places(&self, points: &[usize]) -> Vec<usize> {
        match &self.detail.thinning {
            None => points.to_vec(),
            Some(thinning) => points.iter().filter_map(|&point| thinning.place(point)).collect(),
        }
    }
}

/// What a form of a cloud leaves out, in words.
fn left_out(run: &Run, strides: Option<[usize; 2]>, detail: &Detail, count: usize) -> Vec<String> {
    let mut words = Vec::new();
    if let Some([background, objects]) = strides {
        let of_objects = match objects {
            1 => "all points of objects".to_owned(),
            stride => format!("one of {stride} of objects"),
        };
        words.push(format!(
            "points: {} of {} are in it, one of {background} of the background, {of_objects}",
            grouped(count as u64),
            grouped(run.cloud.cloud.len() as u64)
        ));
    }
    if detail.is_coarse {
        words.push("digits of positions below 8 mm".into());
    }
    if !detail.has_intensity && run.cloud.intensity.is_some() {
        words.push("the layer of intensities".into());
    }
    words
}

/// Bytes as text, compressed.
pub(super) fn packed(bytes: &[u8]) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    let compressed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    BASE64.encode(compressed.expect("memory takes all bytes"))
}
