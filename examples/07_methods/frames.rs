//! Frames with truth, of real and of simulated drives.

use std::path::Path;

use anyhow::Result;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

/// N points with their truth.
#[derive(Clone)]
pub struct Frame {
    /// Drive, or scene and sensor.
    pub group: String,
    /// Name within the group.
    pub name: String,
    /// The points, with the raw class ids that methods get to see.
    pub cloud: PointCloud,
    /// N: true class number.
    pub true_class: Vec<u16>,
    /// N: id of the true segment.
    pub true_id: Vec<u32>,
}

/// Class numbers of raw ids.
pub fn classes(raw: &[u16]) -> Vec<u16> {
    let class_of = Taxonomy::semantic_kitti().lookup();
    raw.iter().map(|&id| class_of[usize::from(id)]).collect()
}

/// The scans of all labelled sequences below a folder.
pub fn labelled(root: &Path) -> Result<Vec<Frame>> {
    let frame = |labelled: LabelledScan| {
        let words = read_labels(&labelled.labels)?;
        let raw: Vec<u16> = words.iter().map(|&word| word as u16).collect();
        let name = labelled.scan.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Frame {
            group: labelled.sequence,
            name,
            true_class: classes(&raw),
            cloud: read_scan(&labelled.scan)?.with_class(raw)?,
            true_id: words,
        })
    };
    labelled_scans(root)?.into_iter().map(frame).collect()
}

/// Frame 20 of the drive of a seed.
pub fn simulated(scene: Scene, sensor: Sensor, seed: u64) -> Frame {
    let frame = Drive::new(sensor, scene, seed).frame(20);
    let raw = frame.cloud.class.clone().unwrap_or_default();
    Frame {
        group: format!("{scene} {sensor}"),
        name: format!("seed {seed}"),
        true_class: classes(&raw),
        cloud: frame.cloud,
        true_id: frame.true_instance.iter().map(|&id| u32::from(id)).collect(),
    }
}
