//! The stream to the Rerun viewer, as far as it goes without one; tests/python/check_rerun.py looks
//! at it in a viewer.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// A whole `.rrd` begins and ends with its format's marks.
fn is_whole(rrd: &Path) -> bool {
    let bytes = std::fs::read(rrd).expect("a file");
    let end = &bytes[bytes.len().saturating_sub(64)..];
    bytes.starts_with(b"RRF2") && end.windows(4).any(|mark| mark == b"FOOT")
}

#[test]
fn view_saves_frames() {
    let (folder, input) = drive(3);
    let rrd = folder.path().join("all.rrd");
    let saved = divmerge(&["view", path(&input), "--save", path(&rrd)]);
    assert_eq!(saved.status.code(), Some(0), "{}", text(&saved.stderr));
    let said = text(&saved.stdout);
    assert!(said.contains("3 frames") && said.contains("frames per second"), "{said}");
    assert!(is_whole(&rrd));

    let refused = divmerge(&["view", path(&input), "--save", path(&rrd)]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--force"), "{}", text(&refused.stderr));

    let all = std::fs::metadata(&rrd).expect("a file").len();
    let arguments = ["view", path(&input), "--save", path(&rrd), "--force", "--frames", "1..2"];
    assert_eq!(divmerge(&arguments).status.code(), Some(0));
    assert!(is_whole(&rrd) && std::fs::metadata(&rrd).expect("a file").len() < all);
}

#[test]
fn annotate_streams_on_the_way() {
    let (folder, input) = drive(2);
    let [output, rrd] = ["out.mcap", "out.rrd"].map(|name| folder.path().join(name));
    let arguments = ["annotate", path(&input), "-o", path(&output), "--rerun", path(&rrd)];
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(output.exists() && is_whole(&rrd));
}

#[test]
fn a_stock_viewer_gets_a_blueprint() {
    let (folder, input) = drive(2);
    let output = folder.path().join("out.mcap");
    let arguments = ["annotate", path(&input), "-o", path(&output), "--blueprint", "--no-layout"];
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let blueprint = output.with_extension("rbl");
    assert!(is_whole(&blueprint));
    let said = text(&done.stderr);
    let command = format!("`rerun {} {}`", path(&output), path(&blueprint));
    assert!(said.contains(&command), "{said}");

    let kept = divmerge(&arguments);
    assert_eq!(kept.status.code(), Some(2), "{}", text(&kept.stdout));
    std::fs::remove_file(&output).expect("removed");
    let kept = divmerge(&arguments);
    assert_eq!(kept.status.code(), Some(2));
    assert!(text(&kept.stderr).contains("out.rbl"), "{}", text(&kept.stderr));

    let streamed = divmerge(&["annotate", path(&input), "-o", "-", "--blueprint"]);
    assert_eq!(streamed.status.code(), Some(2));
    assert!(text(&streamed.stderr).contains("beside a file"), "{}", text(&streamed.stderr));
}

#[test]
fn an_explanation_is_saved_with_its_words() {
    let (folder, input) = drive(1);
    let [rrd, all] = ["why.rrd", "all.rrd"].map(|name| folder.path().join(name));
    let pair = ["--instance", "1", "--instance", "2", "--no-what-if"];
    let explain = ["explain", path(&input), "--rerun", path(&rrd)];
    let done = divmerge(&[&explain[..], &pair].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(is_whole(&rrd));
    let saved = divmerge(&["view", path(&input), "--save", path(&all), "--track", "off"]);
    assert_eq!(saved.status.code(), Some(0), "{}", text(&saved.stderr));
    let holds = |rrd: &Path, name: &str| {
        let bytes = std::fs::read(rrd).expect("a file");
        bytes.windows(name.len()).any(|part| part == name.as_bytes())
    };
    assert!(holds(&rrd, "explanation/text") && !holds(&all, "explanation/text"));
}

#[test]
fn tracks_and_truth_are_layers_of_their_own() {
    let (folder, input) = drive(3);
    let rrd = folder.path().join("x.rrd");
    let holds = |more: &[&str], name: &str| {
        let view = ["view", path(&input), "--save", path(&rrd), "--force"];
        let saved = divmerge(&[&view[..], more].concat());
        assert_eq!(saved.status.code(), Some(0), "{}", text(&saved.stderr));
        let bytes = std::fs::read(&rrd).expect("a file");
        bytes.windows(name.len()).any(|part| part == name.as_bytes())
    };
    assert!(holds(&[], "tracks/trails") && !holds(&["--track", "off"], "tracks/trails"));
    assert!(holds(&["--track", "off"], "cloud/truth"));

    let named = ["--true-instance-field", "nothing"];
    let failed =
        divmerge(&[&["view", path(&input), "--save", path(&rrd), "--force"][..], &named].concat());
    assert_eq!(failed.status.code(), Some(1), "{}", text(&failed.stdout));
    let said = text(&failed.stderr);
    assert!(said.contains("/lidar/points") && said.contains("`nothing`"), "{said}");
}

#[test]
fn frames_that_are_not_there_are_named() {
    let (folder, input) = drive(2);
    let rrd = folder.path().join("x.rrd");
    let failed = divmerge(&["view", path(&input), "--save", path(&rrd), "--frames", "1..9"]);
    assert_eq!(failed.status.code(), Some(2));
    let said = text(&failed.stderr);
    assert!(said.contains("no frame 8") && said.contains("0 to 1"), "{said}");
    let failed = divmerge(&["view", path(&input), "--save", path(&rrd), "--from", "100"]);
    assert_eq!(failed.status.code(), Some(2));
    assert!(!rrd.exists());
}

#[test]
fn a_viewer_that_does_not_answer_fails_within_seconds() {
    let (_folder, input) = drive(1);
    let started = Instant::now();
    let url = "rerun+http://127.0.0.1:9/proxy";
    let failed = divmerge(&["view", path(&input), "--connect", url]);
    assert_eq!(failed.status.code(), Some(1));
    let said = text(&failed.stderr);
    assert!(said.contains(url) && said.contains("no viewer answered within 5 s"), "{said}");
    assert!(started.elapsed() < Duration::from_secs(15), "{:?}", started.elapsed());
}

#[test]
fn a_file_that_cannot_be_written_leaves_nothing_behind() {
    let (folder, input) = drive(3);
    let failed = divmerge(&["view", path(&input), "--save", "/no/such/folder/x.rrd"]);
    assert_eq!(failed.status.code(), Some(2));
    assert!(text(&failed.stderr).contains("/no/such/folder"), "{}", text(&failed.stderr));

    // A limit on the size of files stands for a full disk.
    let rrd = folder.path().join("full.rrd");
    let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" view \"$1\" --save \"$2\"";
    let program = env!("CARGO_BIN_EXE_divmerge");
    let arguments = ["-c", script, program, path(&input), path(&rrd)];
    let failed = Command::new("bash").args(arguments).output().expect("bash runs");
    assert_eq!(failed.status.code(), Some(1), "{}", text(&failed.stdout));
    assert!(text(&failed.stderr).contains("full.rrd"), "{}", text(&failed.stderr));
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[test]
fn the_recording_is_never_replaced() {
    let (folder, input) = drive(1);
    let rrd = folder.path().join("really_a_recording.rrd");
    std::fs::copy(&input, &rrd).expect("copied");
    let before = std::fs::read(&rrd).expect("bytes");
    let failed = divmerge(&["view", path(&rrd), "--save", path(&rrd), "--force"]);
    assert_eq!(failed.status.code(), Some(2), "{}", text(&failed.stdout));
    assert!(std::fs::read(&rrd).expect("bytes") == before);
}
