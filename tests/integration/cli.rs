//! The binary as a user meets it: output, exit codes, messages.

use std::path::Path;
use std::process::{Command, Output};

use crate::recordings::drive;

pub fn divmerge(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_divmerge");
    Command::new(program).args(arguments).output().expect("the binary runs")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

pub fn path(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

#[test]
fn demo_ends_in_a_table_and_says_what_to_open() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = divmerge(&["demo", "--frames", "2", "--out", path(folder.path())]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    assert!(said.contains("class") && said.contains("car") && said.contains("mean"), "{said}");
    assert!(said.contains("Next:") && said.contains("annotated.mcap"), "{said}");
    assert!(folder.path().join("drive.mcap").exists());
    assert!(said.contains("figure.png") && folder.path().join("figure.png").exists(), "{said}");
    let layout = folder.path().join("annotated.layout.json");
    assert!(
        said.contains("look at the annotated recording: ") && said.contains(path(&layout)),
        "{said}"
    );
    assert!(layout.exists());
}

#[test]
fn simulate_is_deterministic() {
    let folder = tempfile::tempdir().expect("a folder");
    let make = |name: &str, seed: &str| {
        let file = folder.path().join(name);
        let sensor = ["--sensor", "vlp-16", "--scene", "crowd", "--frames", "2"];
        let mut arguments = vec!["simulate", "-o", path(&file), "--seed", seed];
        arguments.extend(sensor);
        let output = divmerge(&arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        std::fs::read(&file).expect("bytes")
    };
    let first = make("a.mcap", "7");
    assert!(first == make("b.mcap", "7"));
    assert!(first != make("c.mcap", "8"));
}

#[test]
fn annotate_prints_a_line_per_topic_or_json() {
    let (folder, input) = drive(2);
    let output = folder.path().join("out.mcap");
    let arguments = ["annotate", path(&input), "-o", path(&output)];
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    assert!(said.contains("/lidar/points: 2 frames"), "{said}");
    assert!(said.contains("objects from field:label") && said.contains("not an object"), "{said}");
    let hint = text(&done.stderr);
    assert!(hint.contains("hide /lidar/points, which covers") && hint.contains(".json"), "{hint}");
    let only = folder.path().join("only.mcap");
    let done = divmerge(&["annotate", path(&input), "-o", path(&only), "--only", "--no-layout"]);
    let hint = text(&done.stderr);
    assert_eq!(hint, format!("to look at it: `rerun {}`\n", path(&only)));

    let refused = divmerge(&arguments);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--force"), "{}", text(&refused.stderr));

    let mut arguments = arguments.to_vec();
    arguments.extend(["--force", "--json", "--semantics", "ground", "--preset", "paper"]);
    arguments.extend(["--voxel", "0.2", "--bev", "off", "--min-points", "5", "--gap-rows", "2"]);
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    let topic = &report["topics"]["/lidar/points"];
    assert_eq!(topic["frames"], 2);
    assert_eq!(topic["semantics"]["ground"], 2);
    assert!(topic["reasons"]["too small"].as_u64() > Some(0), "{topic}");
    assert!(topic["divide_ms"].is_number(), "{topic}");
}

#[test]
fn info_shows_geometry_and_what_auto_would_choose() {
    let (_folder, input) = drive(1);
    let output = divmerge(&["info", path(&input)]);
    assert_eq!(output.status.code(), Some(0));
    let said = text(&output.stdout);
    assert!(said.contains("range image 16 x ") && said.contains("(ring field"), "{said}");
    assert!(said.contains("--semantics auto: field:label"), "{said}");
    assert!(said.contains("/tf"), "{said}");
    let output = divmerge(&["info", "--json", path(&input)]);
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let cloud = &info["topics"][0]["cloud"];
    assert_eq!(cloud["rows"], 16);
    assert_eq!(cloud["columns"], 1800);
}

#[test]
fn wrong_usage_exits_with_2() {
    for arguments in [
        &["annotate"][..],
        &["annotate", "x.mcap"],
        &["annotate", "x", "-o", "y", "--voxel", "0"],
        &["annotate", "x", "-o", "y", "--voxel", "nan"],
        &["annotate", "x", "-o", "y", "--angle", "90"],
        &["annotate", "x", "-o", "y", "--gap-rows", "0"],
        &["annotate", "x", "-o", "y", "--semantics", "guess"],
        &["annotate", "x", "-o", "y", "--semantics", "field:"],
        &["annotate", "x", "-o", "y", "--preset", "worst"],
        &["annotate", "x", "-o", "y", "--from", "noon"],
        &["simulate", "--sensor", "kinect"],
        &["paint"],
    ] {
        let output = divmerge(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stderr));
    }
}

#[test]
fn failures_exit_with_1_and_name_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = path(&folder.path().join("out.mcap")).to_owned();
    // A folder that is none of rosbag2 cannot be an input at all.
    for (input, code) in [("/no/such/file.mcap", 1), (path(folder.path()), 2)] {
        let failed = divmerge(&["annotate", input, "-o", &output]);
        assert_eq!(failed.status.code(), Some(code));
        assert!(text(&failed.stderr).contains(input), "{}", text(&failed.stderr));
    }
    let (_drive, input) = drive(1);
    let failed = divmerge(&["annotate", path(&input), "-o", "/no/such/folder/out.mcap"]);
    assert_eq!(failed.status.code(), Some(2));
    assert!(text(&failed.stderr).contains("/no/such/folder"), "{}", text(&failed.stderr));
    assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 0);
}

#[test]
fn a_cut_off_recording_exits_with_3() {
    let (folder, input) = drive(6);
    let bytes = std::fs::read(&input).expect("bytes");
    std::fs::write(&input, &bytes[..bytes.len() / 2]).expect("written");
    let output = folder.path().join("out.mcap");
    let done = divmerge(&["annotate", path(&input), "-o", path(&output)]);
    assert_eq!(done.status.code(), Some(3), "{}", text(&done.stderr));
    let said = text(&done.stderr);
    assert!(said.contains("cut off") && said.contains("drive.mcap"), "{said}");
    assert!(output.exists());
}

#[test]
fn a_closed_pipe_is_no_panic() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_divmerge"))
        .args(["completions", "zsh"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(child.stdout.take());
    let (_folder, input) = drive(1);
    let mut info = Command::new(env!("CARGO_BIN_EXE_divmerge"))
        .args(["info", path(&input)])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(info.stdout.take());
    for child in [child, info] {
        let output = child.wait_with_output().expect("it ends");
        assert!(!text(&output.stderr).contains("panicked"), "{}", text(&output.stderr));
    }
}

#[test]
fn completions_for_every_shell() {
    for shell in ["bash", "zsh", "fish"] {
        let output = divmerge(&["completions", shell]);
        assert!(output.status.success() && text(&output.stdout).contains("annotate"), "{shell}");
    }
}

#[cfg(not(feature = "rerun"))]
#[test]
fn without_the_viewer_it_says_how_to_get_it() {
    let (folder, input) = drive(1);
    let output = folder.path().join("out.mcap");
    for arguments in [
        &["view", "no-such.mcap"][..],
        &["view", path(&input), "--save", "x.rrd"],
        &["annotate", path(&input), "-o", path(&output), "--rerun", "x.rrd"],
    ] {
        let refused = divmerge(arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        let said = text(&refused.stderr);
        assert!(said.contains("cargo install --path . --features rerun"), "{said}");
        assert!(said.contains("stock Rerun"), "{said}");
    }
    assert!(!output.exists());
}

#[test]
fn wrong_usage_of_the_viewer_exits_with_2() {
    for arguments in [
        &["view"][..],
        &["view", "x", "--save", "a.rrd", "--spawn"],
        &["view", "x", "--save", "a.rrd", "--connect", "b"],
        &["view", "x", "--save", "a.mcap"],
        &["annotate", "x", "-o", "y", "--rerun", "spwan"],
        &["view", "x", "--frames", "5..5"],
        &["view", "x", "--frames", "last"],
    ] {
        let output = divmerge(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stderr));
    }
}

#[test]
fn help_lists_what_is_about_networks_by_itself() {
    let help = text(&divmerge(&["annotate", "--help"]).stdout);
    // Options by the heading that they stand under.
    let mut headings = std::collections::BTreeMap::new();
    let mut heading = "";
    for line in help.lines() {
        if line.starts_with(char::is_alphabetic) && line.ends_with(':') {
            heading = line;
        }
        let is_option = line.trim_start().starts_with('-');
        let option = line.trim_start().split([' ', ',']).find(|word| word.starts_with("--"));
        let option = option.filter(|_| is_option);
        option.and_then(|option| headings.insert(option, heading));
    }
    for (option, heading) in [
        ("--model-config", "Networks (--semantics onnx:):"),
        ("--runtime", "Networks (--semantics onnx:):"),
        ("--batch", "Networks (--semantics onnx:):"),
        ("--boxes-margin", "Boxes (--method boxes):"),
        ("--semantics", "Objects:"),
        ("--voxel", "Clustering:"),
        ("--lag", "Time:"),
        ("--topic", "Input:"),
        ("--threads", "Performance:"),
        ("--force", "Output:"),
    ] {
        assert_eq!(headings.get(option), Some(&heading), "{option}");
    }
}

#[test]
fn quiet_and_verbose_runs() {
    let (folder, input) = drive(2);
    let run = |name: &str, option: &str| {
        let output = folder.path().join(name);
        let done = divmerge(&["annotate", path(&input), "-o", path(&output), option]);
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        (text(&done.stdout), text(&done.stderr), std::fs::read(output).expect("annotated"))
    };
    let (said, told, quiet) = run("quiet.mcap", "--quiet");
    assert_eq!((said.as_str(), told.as_str()), ("", ""));
    let (said, told, verbose) = run("verbose.mcap", "-v");
    assert!(said.contains("/lidar/points: 2 frames"), "{said}");
    assert!(told.contains("would read") && told.contains("with preset best"), "{told}");
    assert!(quiet == verbose);
    let both = divmerge(&["info", path(&input), "-q", "-v"]);
    assert_eq!(both.status.code(), Some(2));
}

#[test]
fn colours_are_those_that_are_asked_for() {
    let said = |color: &str| text(&divmerge(&["info", "nowhere.mcap", "--color", color]).stderr);
    assert!(said("always").starts_with("\u{1b}[1;31merror:\u{1b}[0m "), "{}", said("always"));
    // Not on a terminal.
    assert!(said("auto").starts_with("error: ") && said("never").starts_with("error: "));
    let help = |color: &str| text(&divmerge(&["info", "-h", "--color", color]).stdout);
    assert!(help("always").contains('\u{1b}') && !help("never").contains('\u{1b}'));
}

#[test]
fn a_misspelt_file_is_told_with_its_neighbour() {
    let (folder, _input) = drive(1);
    let wrong = folder.path().join("drvie.mcap");
    let done = divmerge(&["info", path(&wrong)]);
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    let said = text(&done.stderr);
    assert!(said.contains("did you mean `drive.mcap`?"), "{said}");
}

#[test]
fn wrong_usage_ends_with_2() {
    let (folder, input) = drive(1);
    let output = folder.path().join("out.mcap");
    let annotate = ["annotate", path(&input), "-o", path(&output)];
    for options in [
        &["--preset", "authors", "--bev", "hull"][..],
        &["--semantics", "grund"],
        &["--method", "dbscna"],
        &["--lag", "100"],
        &["--topik", "/x"],
        &["--topic", "/lidar/pionts"],
    ] {
        let done = divmerge(&[&annotate[..], options].concat());
        assert_eq!(done.status.code(), Some(2), "{options:?}: {}", text(&done.stderr));
    }
    let done = divmerge(&[&annotate[..], &["--method", "dbscna"]].concat());
    assert!(text(&done.stderr).contains("'dbscan'"), "{}", text(&done.stderr));
}
