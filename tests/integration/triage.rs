//! `divmerge triage`: the list, the table, the topic, the pages, and what it refuses.

use std::path::Path;

use divmerge::datasets::drive::write_drive;
use divmerge::messages::definitions::DIAGNOSTIC_ARRAY;
use divmerge::recording::{Overview, Record, RecordingReader, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};

use crate::cli::{divmerge, path, text};

/// A car park of a few frames.
fn parking(folder: &Path, frames: usize) -> std::path::PathBuf {
    let file = folder.join("a <b> & c.mcap");
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 2);
    let go_on = |_| std::ops::ControlFlow::Continue(());
    write_drive(&drive, frames, &file, &WriteOptions::default(), go_on).expect("a drive");
    file
}

fn done(arguments: &[&str]) -> String {
    let output = divmerge(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Cells of a line of CSV.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut is_quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match letter {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(String::new()),
            other => cells.last_mut().expect("one").push(other),
        }
    }
    cells
}

/// Topic and data of every message.
fn messages(file: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let overview = Overview::read(file).expect("a recording");
    let mut reader = RecordingReader::open(file).expect("a recording");
    let mut messages = Vec::new();
    while let Some(record) = reader.next_record().expect("a record") {
        if let Record::Message { header, data, .. } = record {
            let topic = overview.channels[&header.channel_id].topic.clone();
            messages.push((topic, header.log_time, data.to_vec()));
        }
    }
    messages
}

#[test]
fn a_list_a_table_a_topic_and_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = parking(folder.path(), 3);
    let [csv, mcap, pages] =
        ["s.csv", "s.mcap", "pages"].map(|name| path(&folder.path().join(name)).to_owned());
    let said = done(&[
        "triage",
        path(&input),
        "--frames",
        "1..3",
        "--limit",
        "4",
        "--csv",
        &csv,
        "-o",
        &mcap,
        "--report",
        &pages,
    ]);
    assert!(
        said.contains("2 frames") && said.contains("  1. ") && said.contains("  4. "),
        "{said}"
    );
    assert!(!said.contains("  5. "), "{said}");
    check_table(&csv);
    check_command(&said);
    check_topic(&input, Path::new(&mcap));
    check_pages(Path::new(&pages));
}

/// The table has every suspect of the frames, and the first of the list is the most likely.
fn check_table(csv: &str) {
    let table = std::fs::read_to_string(csv).expect("the table");
    let lines: Vec<Vec<String>> = table.lines().map(cells).collect();
    assert_eq!(lines[0].len(), 18);
    assert_eq!(lines[0][..6], ["topic", "frame", "log_time_ns", "seconds", "score", "kind"]);
    assert!(lines.len() > 20 && lines.iter().all(|line| line.len() == 18));
    assert!(lines[1..].iter().all(|line| ["1", "2"].contains(&line[1].as_str())));
    let scores = lines[1..].iter().map(|line| line[4].parse::<f64>().expect("a score"));
    assert!(scores.clone().all(|score| (0.0..1.0).contains(&score)));
    assert!(scores.clone().any(|score| score > 0.01));
}

/// The command that is printed explains.
fn check_command(said: &str) {
    let command =
        said.lines().find(|line| line.trim().starts_with("divmerge explain")).expect("one");
    let words = command.trim().strip_prefix("divmerge ").expect("the binary");
    let output = std::process::Command::new("sh")
        .args(["-c", &format!("\"$0\" {words} --no-what-if"), env!("CARGO_BIN_EXE_divmerge")])
        .output()
        .expect("a shell");
    assert_eq!(output.status.code(), Some(0), "{command}: {}", text(&output.stderr));
}

/// Everything of the input is there; the topic has a message for each triaged cloud, after it.
fn check_topic(input: &Path, output: &Path) {
    let (before, after) = (messages(input), messages(output));
    let is_added = |message: &&(String, u64, Vec<u8>)| message.0.ends_with("/suspicion");
    let kept: Vec<_> = after.iter().filter(|message| !is_added(message)).collect();
    assert_eq!(kept, before.iter().collect::<Vec<_>>());
    let added: Vec<_> = after.iter().filter(is_added).collect();
    let clouds: Vec<_> = before.iter().filter(|message| message.0 == "/lidar/points").collect();
    assert_eq!(added.len(), 2);
    for (added, cloud) in added.iter().zip(&clouds[1..]) {
        assert_eq!((added.0.as_str(), added.1), ("/lidar/points/suspicion", cloud.1));
    }
    let overview = Overview::read(output).expect("a recording");
    let channel = overview.channels_of("/lidar/points/suspicion").next().expect("the topic");
    assert_eq!(overview.schema_of(channel.id).expect("a schema").name, DIAGNOSTIC_ARRAY.name);
}

/// A page for each of the four cases, which loads nothing from elsewhere.
fn check_pages(pages: &Path) {
    let index = std::fs::read_to_string(pages.join("index.html")).expect("the index");
    assert!(index.contains("a &lt;b&gt; &amp; c.mcap") && !index.contains("<b> &"), "{index}");
    assert_eq!(index.matches("<tr tabindex").count(), 4);
    let page = std::fs::read_to_string(pages.join("case-004.html")).expect("a page");
    assert!(
        page.contains("<svg") && page.contains("bird&#39;s-eye") || page.contains("bird's-eye")
    );
    assert!(page.contains("range image") || page.contains("pixel row"), "the explanation");
    assert!(!page.contains("http"), "nothing is loaded");
}

#[test]
fn the_same_twice_and_an_annotated_recording_is_triaged_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = parking(folder.path(), 2);
    let file = |name: &str| path(&folder.path().join(name)).to_owned();
    let annotated = file("annotated.mcap");
    done(&["annotate", path(&input), "-o", &annotated]);
    let page = |input: &str, name: &str| {
        let report = file(name);
        done(&["triage", input, "--limit", "2", "--report", &report]);
        std::fs::read_to_string(report).expect("a page")
    };
    assert_eq!(page(path(&input), "one.html"), page(path(&input), "two.html"));
    let list = |input: &str| {
        let csv = file("list.csv");
        done(&["triage", input, "--csv", &csv, "--force"]);
        let table = std::fs::read_to_string(csv).expect("a table");
        // All but the command, which names the file.
        let cut = |line: &str| cells(line)[..17].join("|");
        table.lines().map(cut).collect::<Vec<_>>()
    };
    assert_eq!(list(path(&input)), list(&annotated));
    let again = file("again.mcap");
    done(&["triage", &annotated, "-o", &again]);
    let topics: Vec<String> = messages(Path::new(&again)).into_iter().map(|m| m.0).collect();
    assert!(topics.contains(&"/lidar/points/suspicion".to_owned()));
    assert!(!topics.iter().any(|topic| topic.contains("/instances/suspicion")));
    // A recording that has the topic is not given it twice, but may be looked at.
    let output = divmerge(&["triage", &again, "-o", &file("thrice.mcap")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("already has a topic /lidar/points/suspicion"));
    done(&["triage", &again, "--limit", "1"]);
}

#[test]
fn what_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = parking(folder.path(), 1);
    let input = path(&input);
    let file = |name: &str| path(&folder.path().join(name)).to_owned();
    let there = file("there.csv");
    std::fs::write(&there, "mine").expect("a file");
    for (arguments, code, said) in [
        (&["triage", "/no/such.mcap"][..], 1, "/no/such.mcap"),
        (&["triage", input, "--csv", &there], 2, "exists; use --force"),
        (&["triage", input, "-o", input, "--force"], 2, "is the input"),
        (&["triage", input, "--csv", &file("x"), "--report", &file("x")], 2, "name of two outputs"),
        (&["triage", input, "--frames", "5"], 2, "there is no frame 5"),
        (&["triage", input, "--topic", "/nothing"], 2, "/nothing"),
        (&["triage", input, "--limit", "many"], 2, "--limit"),
        (&["triage", input, "--weigh-points", "0"], 2, "--weigh-points"),
        (&["triage", input, "--compression", "lz4"], 2, "--output"),
    ] {
        let output = divmerge(arguments);
        let problem = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {problem}");
        assert!(problem.contains(said), "{arguments:?}: {problem}");
    }
    assert_eq!(std::fs::read(&there).expect("a file"), b"mine");
    assert!(!Path::new(&file("x")).exists());
}
