//! `divmerge compare`, `sweep` and `diff`, and `--method` wherever clustering runs.

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

fn json(file: &std::path::Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(file).expect("figures")).expect("JSON")
}

#[test]
fn methods_side_by_side() {
    let (folder, input) = drive(2);
    let files =
        ["c.json", "c.csv", "c.md", "c.svg", "c.png", "c.pdf"].map(|name| folder.path().join(name));
    let methods = ["--methods", "best,euclidean,one-per-class", "--voxels", "1,0.5"];
    let outputs = files.each_ref().map(|file| ["-o", path(file)]).concat();
    let done = divmerge(&[&["compare", path(&input)], &methods[..], &outputs].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let rows = json(&files[0]);
    let named: Vec<&str> =
        rows.as_array().expect("rows").iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(named, ["best", "euclidean", "one-per-class", "paper, 1 m", "paper, 0.5 m"]);
    for row in rows.as_array().unwrap() {
        assert_eq!(row["frames"], 2);
        let is_cut = row["method"] != "one-per-class";
        assert!(!is_cut || row["things"]["pq"].as_f64().unwrap() > 0.5, "{row}");
        let peak = row["peak_memory"].as_u64();
        assert!(!cfg!(target_os = "linux") || peak.unwrap() > 1 << 20);
    }
    // One object a class is never in pieces.
    assert_eq!(rows[2]["over"][0], 0.0);
    assert!(rows[0]["things"]["pq"].as_f64() > rows[2]["things"]["pq"].as_f64());
    let csv = std::fs::read_to_string(&files[1]).expect("a table");
    assert_eq!(csv.lines().count(), 6);
    assert!(csv.contains("\"paper, 1 m\","), "{csv}");
    let chart = std::fs::read_to_string(&files[3]).expect("a chart");
    assert!(chart.contains("paper, by voxel") && chart.contains("one-per-class"));
    assert!(std::fs::read(&files[4]).expect("a picture").starts_with(b"\x89PNG"));
    assert!(std::fs::read(&files[5]).expect("a document").starts_with(b"%PDF-"));

    let again = divmerge(&["compare", path(&input), "-o", path(&files[0])]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("--force"), "{}", text(&again.stderr));
}

#[test]
fn parameters_are_set_for_the_methods_that_have_them() {
    let (folder, input) = drive(1);
    let compared = |name: &str, more: &[&str]| {
        let file = folder.path().join(name);
        let methods = ["--methods", "paper,dbscan,euclidean", "-o", path(&file)];
        let done = divmerge(&[&["compare", path(&input)], &methods[..], more].concat());
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        let quality = |row: &serde_json::Value| row["things"]["pq"].as_f64().expect("a score");
        let rows = json(&file);
        (rows.as_array().expect("rows").iter().map(quality).collect::<Vec<_>>(), done)
    };
    let (usual, _) = compared("usual.json", &[]);
    let (one, done) = compared("one.json", &["--set", "dbscan:method.reach=3", "-v"]);
    assert!(one[0] == usual[0] && one[1] < usual[1] && one[2] == usual[2], "{one:?} {usual:?}");
    assert!(text(&done.stderr).contains("dbscan: method.reach = 3"), "{}", text(&done.stderr));
    let (all, _) = compared("all.json", &["--set", "method.reach=3"]);
    assert!(all[0] == usual[0] && all[1] == one[1] && all[2] < usual[2], "{all:?} {usual:?}");
    let (ours, _) = compared("ours.json", &["--set", "cluster.merge_ratio=0.99"]);
    assert!(ours[0] != usual[0] && ours[1..] == usual[1..], "{ours:?} {usual:?}");

    let problem = |setting: &str, methods: &str| {
        let wrong = ["compare", path(&input), "--methods", methods, "--set", setting];
        let done = divmerge(&wrong);
        assert_eq!(done.status.code(), Some(2), "{setting}");
        text(&done.stderr)
    };
    let near = problem("cluster.voxle=1", "paper,dbscan");
    assert!(near.contains("did you mean `cluster.voxel`?"), "{near}");
    let absent = problem("alpine:method.margin=1", "paper");
    assert!(absent.contains("`alpine` is not among the methods"), "{absent}");
    let near = problem("dbscn:method.reach=1", "dbscan");
    assert!(near.contains("did you mean `dbscan`?"), "{near}");
    let near = problem("method.reach=1", "dbscam");
    assert!(near.contains("did you mean `dbscan`?"), "{near}");
}

#[test]
fn truth_that_is_not_there_is_named() {
    let (folder, input) = drive(1);
    let missing = divmerge(&["compare", path(&input), "--true-instance-field", "nobody"]);
    assert_eq!(missing.status.code(), Some(2));
    let said = text(&missing.stderr);
    assert!(said.contains("cloud 0") && said.contains("`nobody`"), "{said}");
    assert!(said.contains("with --labels"), "{said}");
    let labels = divmerge(&["compare", path(&input), "--labels", path(folder.path())]);
    assert_eq!(labels.status.code(), Some(1));
    assert!(text(&labels.stderr).contains("000000.label"), "{}", text(&labels.stderr));
    let unknown = divmerge(&["compare", path(&input), "--methods", "best,magic"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(text(&unknown.stderr).contains("depth-clustering"), "{}", text(&unknown.stderr));
}

#[test]
fn a_sweep_over_voxels_and_over_angles() {
    let (folder, input) = drive(1);
    let chart = folder.path().join("tradeoff.svg");
    let values = ["--values", "2,0.5", "--presets", "paper,authors"];
    let arguments = [&["sweep", path(&input), "-o", path(&chart)], &values[..]].concat();
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    let rows =
        said.lines().filter(|line| line.starts_with("| paper") || line.starts_with("| auth"));
    assert_eq!(rows.count(), 4, "{said}");
    assert!(std::fs::read_to_string(&chart).expect("a chart").contains("mean PQ of things"));

    let arguments =
        ["sweep", path(&input), "--over", "angle", "--values", "5", "--presets", "paper"];
    let without_classes = divmerge(&[&arguments[..], &["--semantics", "ground"]].concat());
    assert!(text(&without_classes.stdout).contains("| paper  |"), "{without_classes:?}");
    let wrong = divmerge(&["sweep", path(&input), "--over", "gap-rows", "--values", "1.5"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("whole number from 1 on"), "{}", text(&wrong.stderr));
}

#[test]
fn two_annotations_of_one_recording() {
    let (folder, input) = drive(2);
    let annotated = |name: &str, more: &[&str]| {
        let output = folder.path().join(name);
        let done = divmerge(&[&["annotate", path(&input), "-o", path(&output)], more].concat());
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        output
    };
    let best = annotated("best.mcap", &[]);
    let all = annotated("all.mcap", &["--method", "one-per-class"]);
    let same = text(&divmerge(&["diff", path(&best), path(&best)]).stdout);
    assert!(same.contains("2 clouds, 0 with differences"), "{same}");

    let (csv, json_file) = (folder.path().join("d.csv"), folder.path().join("d.json"));
    let files = ["--csv", path(&csv), "--json", path(&json_file), "--limit", "1"];
    let done = divmerge(&[&["diff", path(&best), path(&all)], &files[..]].concat());
    let said = text(&done.stdout);
    assert!(said.contains("2 with differences") && said.contains("joined"), "{said}");
    let found = json(&json_file);
    let found = found.as_array().expect("differences");
    assert_eq!(std::fs::read_to_string(&csv).expect("a table").lines().count(), found.len() + 1);
    assert!(said.contains(&format!("and {} more", found.len() - 1)), "{said}");
    let points: Vec<u64> = found.iter().map(|f| f["points"].as_u64().unwrap()).collect();
    assert!(points.is_sorted_by(|a, b| a >= b));
    // A class is one instance in the second: nothing of it is split.
    assert!(found.iter().all(|f| f["change"] == "joined" || f["change"] == "only_second"));

    let raw = divmerge(&["diff", path(&best), path(&input)]);
    assert_eq!(raw.status.code(), Some(1));
    assert!(text(&raw.stderr).contains("no annotated topic"), "{}", text(&raw.stderr));
    let (_other_folder, other) = drive(1);
    let other_annotated = folder.path().join("other.mcap");
    divmerge(&["annotate", path(&other), "-o", path(&other_annotated)]);
    let unequal = divmerge(&["diff", path(&best), path(&other_annotated)]);
    assert!(text(&unequal.stderr).contains("2 clouds in the first, 1 in the second"));
    let unknown = divmerge(&["diff", path(&best), path(&all), "--topic", "/camera"]);
    assert!(text(&unknown.stderr).contains("not annotated in both"), "{unknown:?}");
}

#[test]
fn other_methods_annotate_and_draw_but_have_nothing_to_explain() {
    let (folder, input) = drive(1);
    for method in ["euclidean", "scan-line-run", "depth-clustering", "supervoxel", "alpine"] {
        let output = folder.path().join(method).with_extension("mcap");
        let arguments = ["annotate", path(&input), "-o", path(&output), "--method", method];
        let done = divmerge(&arguments);
        assert_eq!(done.status.code(), Some(0), "{method}: {}", text(&done.stderr));
    }
    let figure = folder.path().join("f.svg");
    let drawn = ["figure", path(&input), "-o", path(&figure), "--method", "euclidean"];
    assert_eq!(divmerge(&drawn).status.code(), Some(0));
    let svg = std::fs::read_to_string(figure).expect("a figure");
    assert!(svg.contains("euclidean in place of divide and merge") && !svg.contains("components"));
    let asked = ["explain", path(&input), "--method", "euclidean", "--at", "5,0,0"];
    let refused = divmerge(&asked);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("no votes or merges"), "{}", text(&refused.stderr));
}
