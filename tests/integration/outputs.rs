//! No command writes over its input, through a link, or without need over an older file; and what
//! no cloud can satisfy is refused before a run begins.

use std::path::Path;

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// Runs a command that must be refused as wrong usage, and returns what it says.
fn refused(arguments: &[&str]) -> String {
    let done = divmerge(arguments);
    let said = text(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
    assert_eq!(done.stdout, b"", "{arguments:?}");
    said
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let name = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.expect("an entry").file_name().into_string().expect("a name")
    };
    let mut names: Vec<String> = entries.map(name).collect();
    names.sort();
    names
}

#[test]
fn no_command_writes_over_its_input() {
    let (folder, recording) = drive(1);
    let bytes = std::fs::read(&recording).expect("bytes");
    // Other names of the input: a hard link for each kind of output.
    let [json, csv, png, svg, layout] =
        ["x.json", "x.csv", "x.png", "x.svg", "x.layout.json"].map(|name| {
            let link = folder.path().join(name);
            std::fs::hard_link(&recording, &link).expect("a link");
            path(&link).to_owned()
        });
    let beside = path(&folder.path().join("x.mcap")).to_owned();
    let input = path(&recording);
    for arguments in [
        &["evaluate", input, "--json", &json][..],
        &["evaluate", input, "--json", input, "--force"],
        &["failures", input, "--csv", &csv, "--force"],
        &["failures", input, "--json", input, "--force"],
        &["triage", input, "--csv", &csv, "--force"],
        &["diff", input, input, "--json", &json, "--force"],
        &["plan", input, "--shards", "2", "-o", &json, "--force"],
        &["figure", input, "-o", &png, "--force"],
        &["explain", input, "--at", "0,0,0", "-o", &svg, "--force"],
        &["sweep", input, "-o", &json, "--force"],
        &["compare", input, "-o", &csv, "--force"],
        &["annotate", input, "-o", input, "--force"],
        &["annotate", &layout, "-o", &beside, "--force"],
        &["annotate", input, "--taxonomy", input, "-o", input, "--force"],
    ] {
        let said = refused(arguments);
        assert!(said.contains("is the input"), "{arguments:?}: {said}");
        assert!(std::fs::read(&recording).expect("bytes") == bytes, "{arguments:?}");
    }
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).expect("a folder");
    let scan = scans.join("0.npy");
    std::fs::write(&scan, "a scan").expect("written");
    let said = refused(&["convert", "folder", path(&scans), "-o", path(&scan), "--force"]);
    assert!(said.contains("written as MCAP"), "{said}");
    let linked = scans.join("0.mcap");
    std::fs::hard_link(&scan, &linked).expect("a link");
    let convert = ["convert", "folder", path(&scans), "-o", path(&linked), "--force"];
    let said = refused(&convert);
    assert!(said.contains("is in the input"), "{said}");
    // What an earlier run wrote there is no input.
    std::fs::remove_file(&linked).expect("removed");
    std::fs::write(&linked, "older").expect("written");
    let done = divmerge(&convert);
    assert!(!text(&done.stderr).contains("is in the input"), "{}", text(&done.stderr));
}

#[test]
fn outputs_are_checked_before_anything_is_written() {
    let (folder, recording) = drive(1);
    let at = |name: &str| path(&folder.path().join(name)).to_owned();
    let before = names(folder.path());
    let input = path(&recording);
    let long = at(&format!("{}.mcap", "n".repeat(245)));
    for (output, said) in [
        (at("x.bag"), "recordings are written as MCAP"),
        (at("none/x.mcap"), "there is no folder"),
        (long, "use at most 242"),
        ("https://host/x.mcap".to_owned(), "cannot write to an address"),
    ] {
        let problem = refused(&["annotate", input, "-o", &output]);
        assert!(problem.contains(said), "{output}: {problem}");
    }
    let (one, other) = (at("one.json"), at("two.mcap"));
    std::fs::copy(&recording, &other).expect("copied");
    let problem = refused(&["annotate", input, &other, "-o", &at("new.mcap")]);
    assert!(problem.contains("need a folder"), "{problem}");
    let problem = refused(&["diff", input, input, "--csv", &one, "--json", &one]);
    assert!(problem.contains("two outputs"), "{problem}");
    std::fs::remove_file(&other).expect("removed");
    assert_eq!(names(folder.path()), before);

    std::fs::write(&one, "older").expect("written");
    let problem = refused(&["failures", input, "--json", &one]);
    assert!(problem.contains("--force"), "{problem}");
    assert_eq!(std::fs::read(&one).expect("kept"), b"older");
}

#[cfg(unix)]
#[test]
fn planted_names_are_refused_and_not_followed() {
    use std::os::unix::fs::symlink;
    let (folder, recording) = drive(1);
    let victim = folder.path().join("victim");
    std::fs::write(&victim, "precious").expect("written");
    let out = folder.path().join("out");
    for hidden in [
        ".o.mcap.partial",
        ".o.mcap.journal",
        ".o.mcap.partial.old",
        ".o.mcap.journal.old",
        ".o.layout.json.partial",
    ] {
        for (is_pipe, more) in [(false, None), (true, None), (false, Some("--resume"))] {
            let out = out.join(format!("{hidden}-{is_pipe}-{more:?}"));
            std::fs::create_dir_all(&out).expect("a folder");
            let planted = out.join(hidden);
            match is_pipe {
                false => symlink(&victim, &planted).expect("a link"),
                true => {
                    let made = std::process::Command::new("mkfifo").arg(&planted).status();
                    assert!(made.expect("mkfifo runs").success());
                }
            }
            let output = out.join("o.mcap");
            let mut arguments = vec!["annotate", path(&recording), "-o", path(&output)];
            arguments.extend(more);
            let said = refused(&arguments);
            let kind = if is_pipe { "is a pipe" } else { "is a link" };
            assert!(said.contains(hidden) && said.contains(kind), "{hidden}: {said}");
            assert_eq!(names(&out), [hidden]);
        }
    }
    assert_eq!(std::fs::read(&victim).expect("kept"), b"precious");
}

#[test]
fn what_no_cloud_can_satisfy_ends_a_run_before_it_begins() {
    let (folder, recording) = drive(2);
    let (input, output) = (path(&recording), folder.path().join("out.mcap"));
    let before = names(folder.path());
    let annotate = ["annotate", input, "-o", path(&output)];
    for (more, parts) in [
        (["--semantics", "field:lable"], ["no cloud has the field `lable`", "mean `label`?"]),
        (["--from", "100000"], ["no cloud lies", "the recording is"]),
        (["--to", "0"], ["no cloud lies", "the recording is"]),
        (["--topic", "/lidar/point"], ["no readable cloud topic", "mean `/lidar/points`?"]),
    ] {
        let said = refused(&[&annotate[..], &more].concat());
        assert!(parts.iter().all(|part| said.contains(part)), "{more:?}: {said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert_eq!(names(folder.path()), before);
    }
    let said = refused(&["triage", input, "--semantics", "field:lable"]);
    assert!(said.contains("mean `label`?"), "{said}");
    let said = refused(&["failures", input, "--true-class-field", "labell"]);
    assert!(said.contains("mean `label`?") && said.contains("--true-class-field"), "{said}");
    // What some clouds have is no reason to refuse.
    let done = divmerge(&[&annotate[..], &["--semantics", "field:label"]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
}
