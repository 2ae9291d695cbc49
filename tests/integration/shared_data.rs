//! Tests over real data, found by path beside the checkout; without it they say so and pass.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::annotate::{AnnotateOptions, TrackSummary, annotate};
use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, read_scan};
use divmerge::frames::EncodedClouds;
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

/// Classes that say that something moves.
const LEAST_MOVING: u32 = 252;

#[test]
fn what_moves_in_a_real_drive_is_what_its_truth_says() {
    let Some(data) = shared_data() else { return };
    let input = data.join("recordings/semantickitti_04_ros2.mcap");
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("out.mcap");
    let options = AnnotateOptions::default();
    let report = annotate(&input, &output, &options, &mut |_| ControlFlow::Continue(()));
    let (topic, report) = report.expect("annotated").topics.pop_first().expect("a topic");
    // The most frequent class of the points of each track.
    let mut classes: BTreeMap<u32, BTreeMap<u32, usize>> = BTreeMap::new();
    let clouds = EncodedClouds::open(&output, Some(&format!("{topic}/instances")), ..);
    for cloud in clouds.expect("annotated clouds") {
        let cloud = cloud.expect("a cloud");
        let message = cloud.decode().expect("decoded");
        let column = |name: &str| message.column_u32(name).expect("a field");
        for (track, class) in column("track").into_iter().zip(column("label")) {
            *classes.entry(track).or_default().entry(class).or_default() += 1;
        }
    }
    let long: Vec<&TrackSummary> = report.tracks.iter().filter(|track| track.clouds >= 3).collect();
    assert!(long.len() >= 10, "{}", long.len());
    for track in long {
        let votes = classes[&track.track].iter().max_by_key(|(_, count)| **count);
        let (&class, _) = votes.expect("points");
        assert_eq!(track.moving, class >= LEAST_MOVING, "class {class}: {track:?}");
    }
}
