//! `divmerge evaluate` as a user meets it.

use std::path::Path;

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// A truth of two scans in sequence 00: a car of 60 points and a road.
fn truth(root: &Path, folder: &str) {
    let words: Vec<u32> = [vec![10 | 1 << 16; 60], vec![40; 100]].concat();
    for scan in ["000000", "000001"] {
        write(root, folder, scan, &words);
    }
}

fn write(root: &Path, folder: &str, scan: &str, words: &[u32]) {
    let folder = root.join("sequences").join("00").join(folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(folder.join(scan).with_extension("label"), bytes).expect("a file");
}

fn evaluate(truth: &Path, predictions: &Path, more: &[&str]) -> (Option<i32>, String, String) {
    let arguments = ["evaluate", "--truth", path(truth), "--predictions", path(predictions)];
    let done = divmerge(&[&arguments, more].concat());
    (done.status.code(), text(&done.stdout), text(&done.stderr))
}

#[test]
fn a_perfect_prediction_and_one_in_halves() {
    let (t, p) = (tempfile::tempdir().expect("t"), tempfile::tempdir().expect("p"));
    truth(t.path(), "labels");
    truth(p.path(), "predictions");
    let json = p.path().join("figures.json");
    let (code, said, errors) = evaluate(t.path(), p.path(), &["--json", path(&json)]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(said.contains("2 scans, 320 points") && said.contains("not in the truth"), "{said}");
    let read = || -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(&json).expect("figures")).expect("JSON")
    };
    assert_eq!(read()["classes"][0]["name"], "car");
    assert_eq!(read()["classes"][0]["pq"], 1.0);
    let halves: Vec<u32> = [vec![10 | 1 << 16; 30], vec![10 | 2 << 16; 30], vec![40; 100]].concat();
    write(p.path(), "predictions", "000001", &halves);
    let (code, _, errors) = evaluate(t.path(), p.path(), &["--json", path(&json), "--force"]);
    assert_eq!(code, Some(0), "{errors}");
    // One car found, one missed; halves of 30 points are not spurious, and with --min-points 1 they
    // are.
    assert_eq!(read()["classes"][0]["rq"], 1.0 / 1.5);
    evaluate(t.path(), p.path(), &["--json", path(&json), "--min-points", "1", "--force"]);
    assert_eq!(read()["classes"][0]["false_positives"], 2);
}

/// Simulated drive to label files to figures, which agree with what the demo's way of scoring
/// finds.
#[test]
fn an_annotated_drive_is_exported_and_scored() {
    let (folder, input) = drive(2);
    let annotated = folder.path().join("annotated.mcap");
    let done = divmerge(&["annotate", path(&input), "-o", path(&annotated)]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let labels = |kind: &str| folder.path().join(kind).join("sequences/00").join(kind);
    let (predictions, truth) = (labels("predictions"), labels("labels"));
    let export = |input: &Path, to: &Path, more: &[&str]| {
        let done = divmerge(&[&["export", path(input), "--labels", path(to)], more].concat());
        (done.status.code(), text(&done.stdout) + &text(&done.stderr))
    };
    let (code, said) = export(&annotated, &predictions, &[]);
    assert!(code == Some(0) && said.contains("wrote 2 label files"), "{said}");
    let of_truth = ["--topic", "/lidar/points", "--class-field", "label"];
    let of_truth = [&of_truth[..], &["--instance-field", "true_instance"]].concat();
    let (code, said) = export(&input, &truth, &of_truth);
    assert_eq!(code, Some(0), "{said}");
    let (code, said, errors) =
        evaluate(&folder.path().join("labels"), &folder.path().join("predictions"), &[]);
    assert_eq!(code, Some(0), "{errors}");
    let things = said.lines().find(|line| line.starts_with("road")).expect("a line for roads");
    assert!(things.starts_with("road           100.0"), "{said}");

    let (code, said) = export(&annotated, &predictions, &[]);
    assert!(code == Some(2) && said.contains("use --force to replace it"), "{said}");
    assert_eq!(export(&annotated, &predictions, &["--force"]).0, Some(0));
    let (code, said) = export(&input, &predictions, &[]);
    assert!(code == Some(1) && said.contains("no annotated topic"), "{said}");
    let (code, said) = export(&annotated, &predictions, &["--force", "--class-field", "colour"]);
    assert!(code == Some(1) && said.contains("no field `colour`"), "{said}");
}

#[test]
fn what_does_not_fit_is_named_and_nothing_is_scored() {
    let (t, p) = (tempfile::tempdir().expect("t"), tempfile::tempdir().expect("p"));
    truth(t.path(), "labels");
    write(p.path(), "predictions", "000001", &[40; 159]);
    write(p.path(), "predictions", "000007", &[40; 160]);
    let (code, said, errors) = evaluate(t.path(), p.path(), &[]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    for part in
        ["3 problems", "000000.label: no prediction", "636 bytes where", "7.label: no truth"]
    {
        assert!(errors.contains(part), "{part} in {errors}");
    }
    let (code, _, errors) = evaluate(t.path(), p.path(), &["--sequences", "00,05"]);
    assert!(code == Some(1) && errors.contains("no truth for sequence 05"), "{errors}");
    truth(p.path(), "predictions");
    std::fs::remove_file(p.path().join("sequences/00/predictions/000007.label")).expect("gone");
    write(p.path(), "predictions", "000001", &[7; 160]);
    let (code, _, errors) = evaluate(t.path(), p.path(), &[]);
    assert_eq!(code, Some(1));
    assert!(errors.contains("000001.label: class 7 (160 points) is not in taxonomy"), "{errors}");
    let (code, _, errors) = evaluate(&t.path().join("nowhere"), p.path(), &[]);
    assert!(code == Some(1) && errors.contains("nowhere"), "{errors}");
}

/// An annotated drive by itself scores as its label files do, digit for digit.
#[test]
fn a_recording_scores_as_its_label_files_do() {
    let (folder, input) = drive(3);
    let annotated = folder.path().join("annotated.mcap");
    let done = divmerge(&["annotate", path(&input), "-o", path(&annotated), "--preset", "paper"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let export = |from: &Path, kind: &str, more: &[&str]| {
        let to = folder.path().join("f/sequences/00").join(kind);
        let done = divmerge(&[&["export", path(from), "--labels", path(&to)], more].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        to
    };
    export(&annotated, "predictions", &[]);
    let fields = ["--class-field", "label", "--instance-field", "true_instance"];
    let labels = export(&input, "labels", &[&["--topic", "/lidar/points"], &fields[..]].concat());
    let json = folder.path().join("figures.json");
    let figures = |arguments: &[&str]| -> serde_json::Value {
        let done = divmerge(&[&["evaluate", "--force", "--json", path(&json)], arguments].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        serde_json::from_str(&std::fs::read_to_string(&json).expect("figures")).expect("JSON")
    };
    let root = folder.path().join("f");
    let folders = figures(&["--truth", path(&root), "--predictions", path(&root), "--over-time"]);
    let fields = figures(&[path(&annotated), "--over-time", "--entropy"]);
    let files = figures(&[path(&annotated), "--labels", path(&labels), "--over-time"]);
    assert_eq!(folders["scans"], 3);
    for other in [&fields["topics"][0], &files["topics"][0]] {
        for key in ["classes", "all", "things", "stuff", "pq_dagger", "points", "over_time"] {
            assert_eq!(other[key], folders[key], "{key}");
        }
    }
    let over_time = &folders["over_time"];
    let [lstq, s_assoc, s_cls] =
        ["lstq", "s_assoc", "s_cls"].map(|key| over_time[key].as_f64().expect("a number"));
    assert!(s_assoc > 0.1 && s_assoc < 1.0 && s_cls > s_assoc, "{over_time}");
    assert!((lstq - (s_assoc * s_cls).sqrt()).abs() < 1e-12);
    let entropy = fields["topics"][0]["entropy"].as_array().expect("a scan each");
    assert!(entropy.len() == 3 && entropy.iter().all(|scan| scan["over"].as_f64() > Some(0.0)));
}

#[test]
fn what_does_not_fit_a_recording_is_named() {
    let (folder, input) = drive(2);
    let annotated = folder.path().join("annotated.mcap");
    let done = divmerge(&["annotate", path(&input), "-o", path(&annotated)]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let refused = |recording: &Path, more: &[&str], parts: &[&str]| {
        let done = divmerge(&[&["evaluate", path(recording)], more].concat());
        let errors = text(&done.stderr);
        let is_of_arguments = parts[0].starts_with("no ") && !more.is_empty();
        let code = if is_of_arguments { 2 } else { 1 };
        assert_eq!((done.status.code(), done.stdout.len()), (Some(code), 0), "{errors}");
        for part in parts {
            assert!(errors.contains(part), "{part} in {errors}");
        }
    };
    refused(&input, &[], &["no annotated topic"]);
    let topics = ["no annotated topic `/camera`", "/lidar/points/instances"];
    refused(&annotated, &["--topic", "/camera"], &topics);
    let colour = ["--true-class-field", "colour"];
    refused(&annotated, &colour, &["no field `colour`", "cloud 0 of", "--true-class-field"]);
    let unknown = ["--true-class-field", "true_instance"];
    refused(&annotated, &unknown, &["nothing scored", "is not in taxonomy"]);
    let labels = folder.path().join("labels");
    std::fs::create_dir(&labels).expect("a folder");
    std::fs::write(labels.join("000000.label"), [0; 12]).expect("a file");
    std::fs::write(labels.join("000007.label"), [0; 12]).expect("a file");
    let parts = [
        "3 problems",
        "000007.label: no such cloud; there are 2 clouds",
        "000001.label: no such file for this cloud",
        "000000.label: 3 labels for",
    ];
    refused(&annotated, &["--labels", path(&labels)], &parts);
    let usage = divmerge(&["evaluate", "--predictions", "x"]);
    assert_eq!(usage.status.code(), Some(2));
}

#[test]
fn entropies_of_folders_need_scans() {
    let (t, p) = (tempfile::tempdir().expect("t"), tempfile::tempdir().expect("p"));
    truth(t.path(), "labels");
    truth(p.path(), "predictions");
    let (code, said, errors) = evaluate(t.path(), p.path(), &["--entropy"]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    assert!(errors.contains("2 problems") && errors.contains("velodyne/000000.bin"), "{errors}");
    let folder = t.path().join("sequences/00/velodyne");
    std::fs::create_dir(&folder).expect("a folder");
    // The car in two places, ten metres apart; the road elsewhere.
    let point = |n: usize| if n < 60 { [(n / 30) as f32 * 10.0, 5.0] } else { [n as f32, -5.0] };
    let points = (0..160).map(point).flat_map(|[x, y]| [x, y, 1.0, 0.0]);
    let bytes: Vec<u8> = points.flat_map(f32::to_le_bytes).collect();
    std::fs::write(folder.join("000000.bin"), &bytes).expect("a file");
    std::fs::write(folder.join("000001.bin"), &bytes[16..]).expect("a file");
    let (_, _, errors) = evaluate(t.path(), p.path(), &["--entropy"]);
    assert!(errors.contains("000001.bin: 2544 bytes where 160 points have 2560"), "{errors}");
    std::fs::write(folder.join("000001.bin"), &bytes).expect("a file");
    let json = p.path().join("figures.json");
    let (code, said, errors) = evaluate(t.path(), p.path(), &["--entropy", "--json", path(&json)]);
    assert!(code == Some(0) && said.contains("nats per scan"), "{said}{errors}");
    let figures: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).expect("figures")).expect("JSON");
    // One instance that holds two objects of 30 points, in each scan.
    let under = figures["entropy"][1]["under"].as_f64().expect("a number");
    assert!((under - 2.0_f64.ln()).abs() < 1e-12 && figures["entropy"][1]["over"] == 0.0);
}

/// The taxonomy that docs/evaluation.md gives for nuScenes.
#[test]
fn nuscenes_by_the_taxonomy_of_the_docs() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/evaluation.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let yaml = page.split("```yaml\n").nth(1).and_then(|rest| rest.split("```").next());
    let (t, p) = (tempfile::tempdir().expect("t"), tempfile::tempdir().expect("p"));
    let file = t.path().join("nuscenes.yaml");
    std::fs::write(&file, yaml.expect("a taxonomy")).expect("a file");
    // An articulated bus, a police officer, a wheelchair, which is ignored, a cone, and the road.
    let word = |class: u32, instance: u32| vec![class | instance << 16; 60];
    let of_truth = [word(15, 1), word(6, 1), word(8, 1), word(12, 1), word(24, 0)].concat();
    let rigid = [word(16, 9), word(2, 3), word(17, 4), word(12, 7), word(25, 0)].concat();
    write(t.path(), "labels", "000000", &of_truth);
    write(p.path(), "predictions", "000000", &rigid);
    let json = p.path().join("figures.json");
    let more = ["--taxonomy", path(&file), "--json", path(&json), "--min-points", "15"];
    let (code, said, errors) = evaluate(t.path(), p.path(), &more);
    assert_eq!(code, Some(0), "{errors}");
    let figures: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).expect("figures")).expect("JSON");
    let classes = figures["classes"].as_array().expect("classes");
    let things = classes.iter().filter(|class| class["is_thing"] == true).count();
    assert_eq!((classes.len(), things), (16, 10), "{said}");
    let pq = |name: &str| {
        let class = classes.iter().find(|class| class["name"] == name).expect("a class");
        class["pq"].as_f64().expect("a number")
    };
    let found = ["bus", "pedestrian", "car", "traffic_cone", "driveable_surface", "other_flat"];
    assert_eq!(found.map(pq), [1.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
}

/// What `evaluate` prints of an annotated drive, and its JSON.
fn scored(input: &Path, options: &[&str], more: &[&str]) -> (String, serde_json::Value) {
    let annotated = input.with_extension("annotated.mcap");
    let json = input.with_extension("json");
    let annotate = ["annotate", path(input), "-o", path(&annotated), "--force", "--no-layout"];
    let done = divmerge(&[&annotate[..], options].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let evaluate = ["evaluate", path(&annotated), "--json", path(&json), "--force"];
    let done = divmerge(&[&evaluate[..], more].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let json = std::fs::read_to_string(&json).expect("figures");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    (text(&done.stdout), json["topics"][0].clone())
}

#[test]
fn without_classes_objects_are_scored_and_nothing_is_zero_for_want_of_classes() {
    let (_folder, input) = drive(3);
    let (said, figures) = scored(&input, &["--semantics", "ground"], &["--over-time"]);
    for part in ["no classes were found", "found whole", "mean IoU", "S_assoc", "precision"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(said.contains("OSE") && said.contains("USE") && !said.contains("LSTQ"), "{said}");
    assert!(!said.contains(" 0.0 ") && !said.contains("PQ"), "{said}");
    let objects = &figures["objects"];
    for name in ["found_whole", "mean_iou", "s_assoc", "precision", "recall"] {
        let share = objects[name].as_f64().expect(name);
        assert!(share > 0.3 && share <= 1.0, "{name}: {share}");
    }
    assert!(objects["things"].as_u64() > Some(10), "{objects}");
    assert_eq!(figures["entropy"].as_array().map(Vec::len), Some(3));
    assert!(figures["association"]["s_assoc"].as_f64() > Some(0.1), "{figures}");
    assert!(figures.get("all").is_none() && figures.get("over_time").is_none());
    // The instances of the truth are all found whole, and nothing else is found on things.
    let (_, perfect) =
        scored(&input, &["--semantics", "ground"], &["--instance-field", "true_instance"]);
    for name in ["found_whole", "mean_iou", "s_assoc", "precision", "recall"] {
        assert_eq!(perfect["objects"][name], 1.0, "{name}");
    }
}

#[test]
fn means_over_the_classes_present_are_those_of_compare() {
    let (folder, input) = drive(3);
    let (said, figures) = scored(&input, &[], &[]);
    assert!(figures.get("objects").is_none());
    let [present, all] = [&figures["present"]["things"]["pq"], &figures["things"]["pq"]];
    let classes = figures["present"]["thing_count"].as_u64().expect("a number");
    // Eight things in the benchmark, of which the absent ones are 0; here a truck of six points is
    // too few to be present, and found.
    let things = figures["classes"].as_array().expect("classes").iter();
    let things = things.filter(|class| class["is_thing"] == true);
    let pq = |class: &serde_json::Value| class["pq"].as_f64().expect("a number");
    let sum_from = |least: u64| -> f64 {
        let large = things.clone().filter(|class| class["true_points"].as_u64() >= Some(least));
        large.map(pq).sum()
    };
    let near = |found: &serde_json::Value, expected: f64| {
        (found.as_f64().expect("a number") - expected).abs() < 1e-12
    };
    assert!(classes < 8 && near(all, sum_from(0) / 8.0), "{figures}");
    assert!(near(present, sum_from(50) / classes as f64), "{figures}");
    assert!(said.contains("mean over the 19 classes of the benchmark, absent ones 0"), "{said}");
    assert!(said.contains("present (50 points of truth or more)"), "{said}");
    let json = folder.path().join("compared.json");
    let done = divmerge(&["compare", path(&input), "--methods", "best", "-o", path(&json)]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let compared = std::fs::read_to_string(&json).expect("measurements");
    let compared: serde_json::Value = serde_json::from_str(&compared).expect("JSON");
    assert_eq!(compared[0]["things"]["pq"], *present);
    assert_eq!(compared[0]["all"]["pq"], figures["present"]["all"]["pq"]);
}
