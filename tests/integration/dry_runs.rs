//! `--dry-run` of every command that has it.

use std::path::Path;

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// What a dry run prints, which leaves a folder as it is.
fn said(folder: &Path, arguments: &[&str]) -> String {
    let names = || {
        let entries = std::fs::read_dir(folder).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        names.collect::<std::collections::BTreeSet<_>>()
    };
    let before = names();
    let done = divmerge(&[arguments, &["--dry-run"]].concat());
    assert_eq!(done.status.code(), Some(0), "{arguments:?}: {}", text(&done.stderr));
    assert_eq!(names(), before, "{arguments:?}");
    text(&done.stdout)
}

fn assert_parts(said: &str, parts: &[&str]) {
    for part in parts {
        assert!(said.contains(part), "{part}: {said}");
    }
}

const BELIEVED: &str =
    "/lidar/points: 2 clouds, objects from field:label; rows from ring field, 16 x";

#[test]
fn a_dry_run_says_what_would_be_done_and_does_nothing() {
    let (folder, input) = drive(2);
    let output = folder.path().join("out.mcap");
    let arguments = ["annotate", path(&input), "-o", path(&output), "--dry-run"];
    let done = divmerge(&[&arguments[..], &["--set", "cluster.voxel=0.3"]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    for part in [
        "would read",
        "/lidar/points: 2 clouds, objects from field:label; rows from ring field, 16 x",
        "with preset best\n  cluster.voxel = 0.3 (preset best: 0.5)\n",
        "/lidar/points/instances: sensor_msgs/msg/PointCloud2",
        "/lidar/points/objects: visualization_msgs/msg/MarkerArray",
        "out.layout.json",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let left = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(left, 1, "the input alone");
    let of_stream = divmerge(&["annotate", "-", "-o", path(&output), "--dry-run"]);
    assert_eq!(of_stream.status.code(), Some(2), "{of_stream:?}");
}

#[test]
fn commands_that_cluster_say_what_they_believe() {
    let (folder, input) = drive(2);
    let here = folder.path();
    let [copy, table, pages, picture, steps] =
        ["t.mcap", "t.csv", "pages", "f.png", "steps"].map(|name| here.join(name));

    let outputs = ["-o", path(&copy), "--csv", path(&table), "--report", path(&pages)];
    let triage = said(here, &[&["triage", path(&input)], &outputs[..]].concat());
    let index = pages.join("index.html");
    let written = [&copy, &table, &index].map(|file| format!("and write {}", file.display()));
    assert_parts(&triage, &[BELIEVED, "with preset best", "T/suspicion"]);
    assert_parts(&triage, &written.each_ref().map(String::as_str));
    let limited = said(here, &["triage", path(&input), "--frames", "1", "--to", "0.05"]);
    assert_parts(&limited, &["2 clouds (those of --frames and --to alone), objects from"]);

    let options = ["--steps", path(&steps), "--preset", "paper", "--frame", "1"];
    let figure = ["figure", path(&input), "-o", path(&picture)];
    let figure = said(here, &[&figure[..], &options[..]].concat());
    let pictures = format!("and write numbered pictures to {}", steps.display());
    assert_parts(&figure, &["(those of --frame alone)", "with preset paper", &pictures]);

    let existing = divmerge(&["figure", path(&input), "-o", path(&input), "--dry-run"]);
    assert_eq!(existing.status.code(), Some(2), "an input is no picture");
    std::fs::write(&picture, "older").expect("written");
    let existing = divmerge(&["figure", path(&input), "-o", path(&picture), "--dry-run"]);
    assert_eq!(existing.status.code(), Some(2));
    assert!(text(&existing.stderr).contains("--force"), "{}", text(&existing.stderr));
}

#[cfg(feature = "rerun")]
#[test]
fn view_says_what_it_believes() {
    let (folder, input) = drive(2);
    let file = folder.path().join("drive.rrd");
    let view = said(folder.path(), &["view", path(&input), "--save", path(&file)]);
    assert_parts(&view, &[BELIEVED, &format!("and write {}", file.display())]);
    let view = said(folder.path(), &["view", path(&input), "--connect", "rerun+http://x/proxy"]);
    assert_parts(&view, &["and send to rerun+http://x/proxy"]);
}

#[test]
fn export_says_which_fields_it_reads() {
    let (folder, input) = drive(2);
    let labels = folder.path().join("labels");
    let fields = ["--class-field", "label", "--instance-field", "true_instance"];
    let export = ["export", path(&input), "--labels", path(&labels), "--topic", "/lidar/points"];
    let export = said(folder.path(), &[&export[..], &fields[..]].concat());
    let files = format!("and write 2 label files to {}", labels.display());
    assert_parts(
        &export,
        &["/lidar/points: 2 clouds, classes from `label`, instances from `true_instance`", &files],
    );
}

#[test]
fn convert_says_which_files_it_reads() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let scans = here.join("sequences/04/velodyne");
    std::fs::create_dir_all(&scans).expect("a folder");
    for number in 0..3 {
        let points = [1.0_f32, 2.0, 0.5, 0.1].map(f32::to_le_bytes).concat();
        std::fs::write(scans.join(format!("{number:06}.bin")), points).expect("written");
    }
    let output = here.join("out.mcap");
    let convert = said(here, &["convert", "folder", path(&scans), "-o", path(&output)]);
    let written = format!("and write {}\n  /points\n", output.display());
    assert_parts(&convert, &["would read 3 .bin files in", "10 per second", &written]);
    let convert = said(here, &["convert", "semantickitti", path(here), "-o", path(&output)]);
    let written = format!("and write {}\n  /velodyne_points\n", output.display());
    assert_parts(&convert, &["would read sequence 04 (3 scans)", "\n  note: ", &written]);
}

#[test]
fn join_says_which_slices_it_reads() {
    let (folder, input) = drive(2);
    let here = folder.path();
    let [plan, slices, output] = ["plan.json", "slices", "out.mcap"].map(|name| here.join(name));
    let done = divmerge(&["plan", path(&input), "--shards", "1", "-o", path(&plan)]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let slice = format!("{}:0", plan.display());
    let done = divmerge(&["annotate", "--slice", &slice, "-o", path(&slices)]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let join = said(here, &["join", path(&slices), "-o", path(&output)]);
    let written = format!("and write {}\n", output.display());
    assert_parts(&join, &["would read", "  with ", &written, "out.layout.json"]);
    std::fs::write(&output, "older").expect("written");
    let join = said(here, &["join", path(&slices), "-o", path(&output), "--resume"]);
    assert_parts(&join, &[&format!("and keep {}, which exists", output.display())]);
}
