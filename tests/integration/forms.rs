//! Other forms of the output, and runs that are cut off and continued.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use divmerge::Result;
use divmerge::annotate::{AnnotateOptions, AnnotationReport, Form, RunEvent, annotate};
use divmerge::datasets::drive::CLOUD_TOPIC;
use divmerge::frames::TruthSource;
use divmerge::messages::clouds::CloudFormat;
use divmerge::recording::{
    Compression, MessageHeader, Overview, Record, RecordingWriter, WriteOptions,
};

use crate::cli::{divmerge, path, text};
use crate::recordings::{drive, records};

fn run(input: &Path, output: &Path, options: &AnnotateOptions) -> Result<AnnotationReport> {
    annotate(input, output, options, &mut |_: RunEvent| ControlFlow::Continue(()))
}

fn options(form: Form) -> AnnotateOptions {
    AnnotateOptions { form, force: true, threads: 2, ..AnnotateOptions::default() }
}

/// Messages of a topic.
fn messages(file: &Path, topic: &str) -> Vec<(MessageHeader, Vec<u8>)> {
    let overview = Overview::read(file).expect("a recording");
    let ids: Vec<u16> = overview.channels_of(topic).map(|channel| channel.id).collect();
    let of = |record| match record {
        Record::Message { header, data, .. } if ids.contains(&header.channel_id) => {
            Some((MessageHeader { channel_id: 0, ..header }, data.into_owned()))
        }
        _ => None,
    };
    records(file).into_iter().filter_map(of).collect()
}

fn topics(file: &Path) -> Vec<String> {
    let overview = Overview::read(file).expect("a recording");
    let mut topics: Vec<String> =
        overview.channels.values().map(|channel| channel.topic.clone()).collect();
    topics.sort();
    topics
}

#[test]
fn annotations_only_or_in_place_are_those_beside_the_clouds() {
    let (folder, input) = drive(16);
    let [beside, only, in_place] =
        ["beside", "only", "in_place"].map(|name| folder.path().join(name).with_extension("mcap"));
    run(&input, &beside, &options(Form::Beside)).expect("annotated");
    run(&input, &only, &options(Form::Only)).expect("annotated");
    let report = run(&input, &in_place, &options(Form::InPlace)).expect("annotated");
    let [instances, objects] = ["instances", "objects"].map(|end| format!("{CLOUD_TOPIC}/{end}"));

    assert_eq!(topics(&only), [instances.clone(), objects.clone()]);
    assert_eq!(topics(&in_place), [CLOUD_TOPIC, objects.as_str(), "/tf"]);
    assert_eq!(messages(&only, &instances), messages(&beside, &instances));
    for file in [&only, &in_place] {
        assert_eq!(messages(file, &objects), messages(&beside, &objects));
    }
    assert_eq!(messages(&in_place, CLOUD_TOPIC), messages(&beside, &instances));
    assert_eq!(messages(&in_place, "/tf"), messages(&input, "/tf"));
    assert_eq!(report.messages, 32);
    let whole = Overview::read(&only).expect("a recording");
    assert!(whole.from_summary && whole.message_count == 32 && whole.profile == "ros2");

    let made = |file: &Path| {
        let of = |record| match record {
            Record::Metadata(metadata) if metadata.name == "divmerge" => Some(metadata.metadata),
            _ => None,
        };
        records(file).into_iter().find_map(of).expect("a metadata record")
    };
    assert_eq!(made(&only)["input"], "drive.mcap");
    assert_eq!(made(&only)["form"], "annotations only");
    assert_eq!(made(&in_place)["form"], "in place of the clouds");
}

#[test]
fn a_cloud_that_cannot_be_read_stays_in_place() {
    let (folder, input) = drive(2);
    let lying = folder.path().join("lying.mcap");
    let overview = Overview::read(&input).expect("a recording");
    let write_options =
        divmerge::recording::WriteOptions { profile: overview.profile, ..Default::default() };
    let mut writer =
        divmerge::recording::RecordingWriter::create(&lying, &write_options).expect("a writer");
    for record in records(&input) {
        match record {
            Record::Message { header, data, .. } if header.sequence == 1 => {
                writer.write_message(&header, &data[..data.len() - 1]).expect("written");
            }
            record => writer.copy(&record).expect("copied"),
        }
    }
    writer.finish().expect("finished");
    let output = folder.path().join("out.mcap");
    let report = run(&lying, &output, &options(Form::InPlace)).expect("annotated");
    assert_eq!((report.topics[CLOUD_TOPIC].frames, report.topics[CLOUD_TOPIC].unreadable), (1, 1));
    let (before, after) = (messages(&lying, CLOUD_TOPIC), messages(&output, CLOUD_TOPIC));
    assert_eq!(before[1], after[1]);
    let annotated = CloudFormat::Ros2.decode(&after[0].1).expect("a cloud");
    assert!(annotated.field("instance").is_some());
}

/// What is in a folder besides the input.
fn left(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("an entry").file_name();
    let mut names: Vec<String> = entries.map(|e| name(e).into_string().expect("UTF-8")).collect();
    names.retain(|name| name != "drive.mcap");
    names.sort();
    names
}

/// Runs until so many clouds are clustered, or to the end; how many were.
fn run_until(
    frames: usize,
    input: &Path,
    output: &Path,
    options: &AnnotateOptions,
) -> (usize, Result<AnnotationReport>) {
    let mut seen = 0;
    let done = annotate(input, output, options, &mut |event: RunEvent| {
        seen += usize::from(matches!(event, RunEvent::Frame(_)));
        match event {
            RunEvent::Progress { .. } if seen >= frames => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    });
    (seen, done)
}

#[test]
fn a_run_that_is_continued_gives_the_same_bytes() {
    let (folder, input) = drive(40);
    let output = folder.path().join("out.mcap");
    for form in [Form::Beside, Form::InPlace, Form::Only] {
        let whole = AnnotateOptions { compression: Some(Compression::Lz4), ..options(form) };
        let report = run(&input, &output, &whole).expect("annotated");
        let expected = std::fs::read(&output).expect("the output");
        std::fs::remove_file(&output).expect("removed");
        assert_eq!(report.topics[CLOUD_TOPIC].resumed, 0);

        // Cut off twice, then done.
        let resume = AnnotateOptions { resume: true, force: false, ..whole };
        for frames in [32, 18] {
            let (_, broken) = run_until(frames, &input, &output, &resume);
            let said = broken.expect_err("interrupted").to_string();
            assert!(said.contains("--resume") && said.contains(".out.mcap.partial"), "{said}");
            assert!(!output.exists());
        }
        let (clustered, done) = run_until(usize::MAX, &input, &output, &resume);
        let resumed = done.expect("annotated").topics[CLOUD_TOPIC].resumed;
        assert_eq!(clustered + resumed as usize, 40);
        // Whatever was in chunks that were not full yet is clustered again.
        assert!(resumed >= 10, "{form:?}: {resumed} clouds taken over");
        assert!(std::fs::read(&output).expect("the output") == expected, "{form:?}");
        assert_eq!(left(folder.path()), ["out.mcap"]);
        std::fs::remove_file(&output).expect("removed");
    }
}

#[test]
fn what_was_left_may_be_cut_anywhere() {
    let (folder, input) = drive(30);
    let output = folder.path().join("out.mcap");
    let resume = AnnotateOptions { resume: true, force: false, ..options(Form::Beside) };
    run(&input, &output, &resume).expect("annotated");
    let expected = std::fs::read(&output).expect("the output");
    for (keep_partial, keep_journal) in [(1.0, 0.5), (0.5, 1.0), (0.0, 1.0), (0.7, 0.0)] {
        std::fs::remove_file(&output).expect("removed");
        run_until(25, &input, &output, &resume).1.expect_err("interrupted");
        for (name, keep) in
            [(".out.mcap.partial", keep_partial), (".out.mcap.journal", keep_journal)]
        {
            let file = folder.path().join(name);
            let bytes = std::fs::read(&file).expect("what is left");
            std::fs::write(&file, &bytes[..(bytes.len() as f64 * keep) as usize]).expect("cut");
        }
        run(&input, &output, &resume).expect("annotated");
        assert!(std::fs::read(&output).expect("the output") == expected);
        assert_eq!(left(folder.path()), ["out.mcap"]);
    }
}

/// The same recording uncompressed, so that its length stays when a byte of the last point of each
/// cloud is another.
fn uncompressed(input: &Path, output: &Path, change: u8) {
    let overview = Overview::read(input).expect("a recording");
    let (profile, compression) = (overview.profile, Compression::None);
    let options = WriteOptions { profile, compression, force: true, ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(output, &options).expect("a writer");
    for record in records(input) {
        match record {
            Record::Message { header, data, .. } => {
                let mut data = data.into_owned();
                let last = data.len() - 2;
                data[last] ^= change;
                writer.write_message(&header, &data).expect("written");
            }
            record => writer.copy(&record).expect("copied"),
        }
    }
    writer.finish().expect("finished");
}

#[test]
fn another_run_is_not_continued() {
    let (folder, drive) = drive(20);
    let [input, output] = ["input.mcap", "out.mcap"].map(|name| folder.path().join(name));
    uncompressed(&drive, &input, 0);
    let resume = AnnotateOptions { resume: true, force: false, ..options(Form::Beside) };
    run_until(15, &input, &output, &resume).1.expect_err("interrupted");
    let other = AnnotateOptions { from_ns: Some(5), ..resume.clone() };
    let refused = run(&input, &output, &other).expect_err("another window").to_string();
    assert!(refused.contains("another from") && refused.contains("without --resume"), "{refused}");

    // The same name and length, and other clouds.
    uncompressed(&drive, &input, 1);
    let refused = run(&input, &output, &resume).expect_err("other clouds").to_string();
    assert!(refused.contains("is not the one"), "{refused}");
    assert!(!output.exists());
    // Without, it begins anew, and nothing of the old run is left.
    let anew = AnnotateOptions { resumable: true, ..options(Form::Beside) };
    run(&input, &output, &anew).expect("annotated");
    assert_eq!(left(folder.path()), ["input.mcap", "out.mcap"]);
}

/// The real program, killed in the middle of its work.
#[cfg(unix)]
#[test]
fn a_killed_run_is_continued() {
    let (folder, input) = drive(40);
    let [output, expected]: [PathBuf; 2] =
        ["out.mcap", "expected.mcap"].map(|name| folder.path().join(name));
    let whole = divmerge(&["annotate", path(&input), "-o", path(&expected)]);
    assert!(whole.status.success(), "{}", text(&whole.stderr));
    let arguments = ["annotate", path(&input), "-o", path(&output), "--threads", "1"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_divmerge"))
        .args(arguments)
        .stdout(Stdio::null())
        .spawn()
        .expect("the binary runs");
    // As soon as the journal has some clouds.
    let journal = folder.path().join(".out.mcap.journal");
    let lines = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    while lines() < 15 && child.try_wait().expect("a child").is_none() {
        std::thread::yield_now();
    }
    child.kill().expect("killed");
    child.wait().expect("it ends");
    assert!(!output.exists(), "it was done before it was killed");
    let mut arguments = arguments.to_vec();
    arguments.extend(["--resume", "--json"]);
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert!(report["topics"][CLOUD_TOPIC]["resumed"].as_u64() > Some(0), "{report}");
    let [made, expected] = [output, expected].map(|file| std::fs::read(file).expect("bytes"));
    assert!(made == expected);
}

#[test]
fn whoever_looks_on_is_told_the_truth_if_they_want_it() {
    let (folder, input) = drive(2);
    let output = folder.path().join("out.mcap");
    let fields =
        |class: &str| TruthSource::Fields { class: class.into(), instance: "true_instance".into() };
    let truths = |shown_truth: Option<(TruthSource, bool)>| {
        let mut points = Vec::new();
        let options = AnnotateOptions { shown_truth, ..options(Form::Beside) };
        let done = annotate(&input, &output, &options, &mut |event: RunEvent| {
            if let RunEvent::Frame(frame) = event {
                points.push(frame.truth.map(|truth| truth.id.len() == frame.cloud.len()));
            }
            ControlFlow::Continue(())
        });
        done.map(|_| points)
    };
    let bytes = || std::fs::read(&output).expect("bytes");
    assert_eq!(truths(None).expect("annotated"), [None, None]);
    let without = bytes();
    assert_eq!(truths(Some((fields("label"), false))).expect("annotated"), [Some(true); 2]);
    assert!(bytes() == without, "the output depends on who looks on");
    // A field that is not there is no truth, unless somebody named it.
    assert_eq!(truths(Some((fields("other"), false))).expect("annotated"), [None, None]);
    let problem = truths(Some((fields("other"), true))).unwrap_err().to_string();
    assert!(problem.contains("other"), "{problem}");
}
