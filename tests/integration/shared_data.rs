//! Tests over real data, found by path beside the checkout; without it they say so and pass.

use std::path::{Path, PathBuf};

use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, read_scan};
use divmerge::pipeline::Config;

use crate::partition::compare;

/// `../shared/data` beside the checkout, or `None` after a word on stderr.
pub fn shared_data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no folder {}", folder.display());
    None
}

#[test]
fn real_scans_agree_with_the_transcription() {
    let Some(data) = shared_data() else { return };
    let scans = labelled_scans(&data.join("semantickitti")).expect("sequences");
    assert!(!scans.is_empty());
    for (number, labelled) in scans.iter().enumerate() {
        let words = read_labels(&labelled.labels).expect("labels");
        let classes = words.iter().map(|&word| word as u16).collect();
        let cloud = read_scan(&labelled.scan).expect("scan").with_class(classes).expect("one each");
        let mut config = Config::paper();
        compare(&cloud, &config);
        if number % 8 == 0 {
            config.cluster.voxel = 0.2;
            config.cluster.gap_columns = 5;
            config.cluster.gap_rows = 2;
            compare(&cloud, &config);
        }
    }
}
