//! `divmerge failures` as a user meets it.

use std::path::Path;

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;
use crate::shared_data::shared_data;

/// Runs the command with files for its results; returns what it says and the JSON.
fn failures(input: &Path, more: &[&str]) -> (String, serde_json::Value) {
    let folder = tempfile::tempdir().expect("a folder");
    let (json, csv) = (folder.path().join("f.json"), folder.path().join("f.csv"));
    let files = ["--json", path(&json), "--csv", path(&csv)];
    let done = divmerge(&[&["failures", path(input)], &files[..], more].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let written = std::fs::read_to_string(&json).expect("figures");
    let figures: serde_json::Value = serde_json::from_str(&written).expect("JSON");
    let rows = std::fs::read_to_string(&csv).expect("rows").lines().count() - 1;
    assert_eq!(Some(rows), figures["failures"].as_array().map(Vec::len));
    (text(&done.stdout), figures)
}

/// Every command that is printed shows the failure: two points in one instance where something is
/// joined, two in two where something is apart, one without an instance where something is missed.
#[test]
fn the_commands_show_the_failures() {
    let (_folder, input) = drive(2);
    let (said, figures) = failures(&input, &["--preset", "paper", "--small", "20"]);
    assert!(said.contains("2 frames") && said.contains("cause: merge: "), "{said}");
    let all = figures["failures"].as_array().expect("failures");
    let points: Vec<u64> = all.iter().map(|one| one["points"].as_u64().expect("points")).collect();
    assert!(points.len() > 10 && points.is_sorted_by(|a, b| a >= b), "{points:?}");
    let mut checked = std::collections::BTreeMap::new();
    for failure in all {
        let command = failure["explain"].as_str().expect("a command");
        let words = command.strip_prefix("divmerge ").expect("ours").split(' ');
        let words: Vec<&str> = words.chain(["--json", "--no-what-if"]).collect();
        let done = divmerge(&words);
        assert_eq!(done.status.code(), Some(0), "{command}: {}", text(&done.stderr));
        let told: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
        let expected = match (failure["verdict"].as_str(), failure["show"].as_array()) {
            (Some("under_segmented"), Some(show)) if show.len() == 2 => "one_instance",
            (Some("over_segmented"), Some(show)) if show.len() == 2 => "apart",
            (Some("missed"), Some(show)) if show.len() == 1 => "no_instance",
            other => panic!("{other:?}: {failure}"),
        };
        assert_eq!(told["answer"], expected, "{command}");
        *checked.entry(expected).or_insert(0) += 1;
    }
    assert!(checked["apart"] > 2 && checked["one_instance"] > 5, "{checked:?}");
    let figure = all.iter().find_map(|failure| failure["figure"].as_str()).expect("a figure");
    let picture = input.with_file_name("failure.png");
    let words =
        figure.strip_prefix("divmerge ").expect("ours").replace("failure.png", path(&picture));
    let done = divmerge(&words.split(' ').collect::<Vec<_>>());
    assert!(done.status.success() && picture.exists(), "{}", text(&done.stderr));
}

/// Counts agree with what `evaluate` finds on the same drive, annotated.
#[test]
fn counts_are_those_of_evaluate() {
    let (folder, input) = drive(2);
    let (_, figures) = failures(&input, &["--preset", "paper"]);
    let (annotated, json) = (folder.path().join("a.mcap"), folder.path().join("e.json"));
    let done = divmerge(&["annotate", path(&input), "-o", path(&annotated), "--preset", "paper"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let done = divmerge(&["evaluate", path(&annotated), "--json", path(&json)]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let written = std::fs::read_to_string(&json).expect("figures");
    let scores: serde_json::Value = serde_json::from_str(&written).expect("JSON");
    let classes = scores["topics"][0]["classes"].as_array().expect("classes");
    let sum = |figure: &str| -> u64 {
        let things = classes.iter().filter(|class| class["is_thing"] == true);
        things.map(|class| class[figure].as_u64().expect("a count")).sum()
    };
    let verdicts = figures["verdicts"].as_object().expect("verdicts");
    let failing = |side: &str| -> u64 {
        let failing = verdicts.iter().filter(|(verdict, _)| *verdict != "correct");
        failing.map(|(_, count)| count[side].as_u64().expect("a count")).sum()
    };
    assert_eq!(verdicts["correct"]["true"], sum("true_positives"));
    assert_eq!(verdicts["correct"]["found"], sum("true_positives"));
    assert_eq!(failing("true"), sum("false_negatives"));
    // Points of unreached pixels are false segments of no instance there, one a class and frame at
    // most.
    assert!((0..=10).contains(&(sum("false_positives") - failing("found"))), "{figures}");
}

#[test]
fn objects_by_ground_removal_and_bad_input() {
    let (folder, input) = drive(1);
    let (said, figures) = failures(&input, &["--semantics", "ground", "--limit", "1"]);
    assert!(figures["elsewhere"].as_u64() > Some(0), "{said}");
    assert!(said.contains("outside true things"), "{said}");

    let refused = |code: i32, more: &[&str], parts: &[&str]| {
        let done = divmerge(&[&["failures", path(&input)], more].concat());
        let errors = text(&done.stderr);
        assert_eq!((done.status.code(), done.stdout.len()), (Some(code), 0), "{errors}");
        for part in parts {
            assert!(errors.contains(part), "{part} in {errors}");
        }
    };
    refused(2, &["--true-instance-field", "colour"], &["cloud 0", "no field `colour`"]);
    refused(1, &["--labels", path(folder.path())], &["000000.label"]);
    std::fs::write(folder.path().join("000000.label"), [0; 12]).expect("a file");
    refused(1, &["--labels", path(folder.path())], &["000000.label: 3 labels for"]);
    refused(1, &["--true-class-field", "true_instance"], &["cloud 0", "is not in taxonomy"]);
    refused(2, &["--frames", "7"], &["no frame 7"]);
}

/// Real drives, of which preset `best` gets nearly everything right: every failure has a cause.
#[test]
fn failures_of_real_drives_have_causes() {
    let Some(data) = shared_data() else { return };
    let (said, figures) = failures(&data.join("semantickitti"), &["--preset", "paper"]);
    assert!(said.contains("divmerge convert semantickitti"), "{said}");
    let all = figures["failures"].as_array().expect("failures");
    let unexplained = all.iter().filter(|one| one["cause"]["step"] == "unexplained").count();
    assert!(all.len() > 20 && 20 * unexplained <= all.len(), "{unexplained} of {}", all.len());
}
