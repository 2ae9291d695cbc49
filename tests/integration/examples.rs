//! The examples build with the tests (cargo does that) and do what they say.

use std::process::Command;

use divmerge::cloud::Body;
use divmerge::cluster::tree::calibration::probability;
use divmerge::cluster::tree::score::Score;

use crate::shared_data::shared_data;

fn example(name: &str, arguments: &[&str]) -> std::process::Output {
    let mut folder = std::env::current_exe().expect("test binary");
    folder.pop();
    folder.pop();
    let program = folder.join("examples").join(name);
    Command::new(&program).args(arguments).output().unwrap_or_else(|error| {
        panic!("{}: {error} (run `cargo test`, which builds examples)", program.display())
    })
}

#[test]
fn cluster_one_cloud() {
    let output = example("01_cluster_one_cloud", &[]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("car"), "{text}");
}

#[test]
fn score_semantic_kitti() {
    let Some(data) = shared_data() else { return };
    let root = data.join("semantickitti");
    let output = example("02_score_semantic_kitti", &[&root.to_string_lossy(), "03"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("best"), "{text}");
}

#[test]
fn objects() {
    let Some(data) = shared_data() else { return };
    let root = data.join("semantickitti");
    let output = example("06_objects", &[&root.to_string_lossy(), "01"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("| `best` |") && text.contains("| as it is |"), "{text}");
}

/// Curves that were fitted are those that are written in the source.
#[test]
fn coarse_classes() {
    let Some(data) = shared_data() else { return };
    let root = data.join("semantickitti");
    let output = example("12_coarse_classes", &[&root.to_string_lossy()]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    let score = |body| Score {
        body,
        total: 0.0,
        size: 1.0,
        isolation: 1.0,
        wholeness: 1.0,
        standing: 1.0,
        filled: 1.0,
    };
    let (_, curves) = text.split_once("| body |").expect("the table of curves");
    for body in Body::ALL {
        let start = format!("| {} | ", body.name());
        let row = curves.lines().find_map(|line| line.strip_prefix(&start)).expect("a row");
        let fitted: Vec<f64> = row.split(" | ").flat_map(|cell| cell.parse()).collect();
        let odds = |total| {
            let p = probability(&Score { total, ..score(body) }, 1.0);
            (p / (1.0 - p)).ln()
        };
        let written = [0.0, 1.0].map(odds);
        let is_same = |i: usize| (written[i] - fitted[2 + i]).abs() < 0.0006;
        assert!(is_same(0) && is_same(1), "{written:?}, fitted: {row}");
    }
}

#[test]
fn merge_six_components() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("six.svg");
    let done = example("05_merge_six_components", &[&output.to_string_lossy()]);
    assert!(done.status.success(), "{done:?}");
    let text = String::from_utf8_lossy(&done.stdout);
    assert!(text.contains("[1, 1, 2, 1, 2, 2]"), "{text}");
    let svg = std::fs::read_to_string(output).expect("the figure");
    assert!(svg.contains("5 asks 6: 6 &gt; 1, joins"), "{}", svg.len());
}

#[test]
fn methods() {
    let refused = example("07_methods", &["no-such-table"]);
    assert!(!refused.status.success());
    let Some(data) = shared_data() else { return };
    let root = data.join("semantickitti");
    let output =
        example("07_methods", &["real", "--data", &root.to_string_lossy(), "--drive", "01"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    let row = |name: &str| text.lines().find(|line| line.starts_with(&format!("| {name} |")));
    assert!(
        ["`best`", "ALPINE", "boxes around the true objects", "one per class"]
            .iter()
            .all(|name| row(name).is_some()),
        "{text}"
    );
    // The same drive is the only one, so it is all there is.
    let cells: Vec<&str> = row("`best`").expect("a row").split(" | ").collect();
    assert_eq!(cells[1], cells[2], "{text}");
}

#[test]
fn triage() {
    let Some(data) = shared_data() else { return };
    let root = data.join("semantickitti");
    let output = example("08_triage", &[&root.to_string_lossy()]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("## `best`: 32 frames") && text.contains("## `paper`"), "{text}");
    assert!(text.contains("| could be one |") && text.contains("| drive 04 |"), "{text}");
}

/// A few thousand executions of every fuzz target; docs/reliability.md has ten million.
#[test]
fn fuzz() {
    let output = example("fuzz", &["--executions", "20000", "--processes", "2"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("executions, 0 failed"), "{text}");
}

#[test]
fn a_long_recording_is_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("long.mcap");
    let output = example("11_long_recording", &["20"]);
    assert!(output.status.success(), "{output:?}");
    std::fs::write(&path, output.stdout).expect("written");
    let overview = divmerge::recording::Overview::read(&path).expect("a recording");
    assert!(overview.is_complete && overview.from_summary && overview.message_count > 4);
}

#[test]
fn sensors() {
    assert!(!example("10_sensors", &["a-seed"]).status.success());
    let output = example("10_sensors", &["1", "os1-64"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    let rows: Vec<&str> = text.lines().skip(2).collect();
    assert_eq!(rows.len(), 2, "{text}");
    assert!(rows.iter().all(|row| row.contains("| organised cloud | 64 x 1024 | yes |")), "{text}");
}
