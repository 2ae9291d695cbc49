//! Recordings cut into slices, annotated slice by slice, and joined.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::Result;
use divmerge::annotate::slices::{Plan, Slice, plan, recordings};
use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, AnnotationReport, Form, JoinOptions, RunEvent, Semantics,
    SliceFile, annotate, by_recording, join,
};
use divmerge::datasets::drive::CLOUD_TOPIC;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use divmerge::recording::{Compression, Overview, Record, RecordingWriter, WriteOptions};

use crate::cli::{divmerge, path, text};
use crate::recordings::{drive, records};
use crate::shapes::{each_shape, run};

fn go_on(_: RunEvent) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The slices of a recording.
fn planned(input: &Path, shards: usize) -> Vec<Slice> {
    plan(&recordings(&[input.to_owned()]).expect("recordings"), shards, &[]).expect("a plan")
}

/// Annotates slices into a folder, the last first.
fn annotated(slices: &[Slice], folder: &Path, options: &AnnotateOptions) -> Vec<PathBuf> {
    let one = |slice: &Slice| {
        let output = folder.join(slice.file_name());
        let options =
            AnnotateOptions { slice: Some(slice.clone()), force: true, ..options.clone() };
        annotate(&slice.input, &output, &options, &mut go_on).expect("a slice");
        output
    };
    slices.iter().rev().map(one).collect()
}

fn opened(files: &[PathBuf]) -> Vec<SliceFile> {
    files.iter().map(|file| SliceFile::open(file).expect("a slice")).collect()
}

fn joined(files: &[PathBuf], output: &Path) -> Result<AnnotationReport> {
    let recordings = by_recording(opened(files), None)?;
    assert_eq!(recordings.len(), 1);
    let options = JoinOptions { force: true, threads: 2, ..JoinOptions::default() };
    join(&recordings[0], output, &options, &mut go_on)
}

/// Slices between any bytes, as no plan would have them.
fn by_hand(input: &Path) -> Vec<Slice> {
    let [whole] = planned(input, 1).try_into().expect("one slice");
    let cuts = [0, whole.end / 3, whole.end / 2, whole.end];
    let slice = |number: usize| Slice {
        number,
        count: 3,
        start: cuts[number],
        end: cuts[number + 1],
        ..whole.clone()
    };
    (0..3).map(slice).collect()
}

/// The bytes of a recording that was annotated in slices.
fn sliced(input: &Path, slices: &[Slice], options: &AnnotateOptions) -> Vec<u8> {
    let files = annotated(slices, input.parent().expect("a folder"), options);
    let output = input.with_extension("joined.mcap");
    joined(&files, &output).expect("joined");
    std::fs::read(output).expect("the output")
}

#[test]
fn every_shape_comes_out_as_if_it_had_not_been_cut() {
    let cut = std::cell::Cell::new(0);
    each_shape(|shape, input, _| {
        let (planned, by_hand) = (planned(input, 4), by_hand(input));
        let count = planned.len();
        for (form, compression) in [
            (Form::Beside, None),
            (Form::Beside, Some(Compression::Lz4)),
            (Form::InPlace, None),
            (Form::Only, None),
        ] {
            let options = AnnotateOptions {
                form,
                compression,
                threads: 2,
                force: true,
                ..AnnotateOptions::default()
            };
            let whole = run(input, &options);
            let what = format!("{shape:?} {form:?} {compression:?} in {count} slices");
            assert!(sliced(input, &planned, &options) == whole, "{what}");
            assert!(sliced(input, &by_hand, &options) == whole, "{what}, by hand");
        }
        cut.set(cut.get() + usize::from(count > 1));
    });
    assert!(cut.get() > 3, "only {} recordings were cut at all", cut.get());
}

/// A drive in chunks of one cloud, of which some lie.
fn with_lies(frames: usize) -> (tempfile::TempDir, PathBuf) {
    let (folder, input) = drive(frames);
    let lying = folder.path().join("lying.mcap");
    let profile = Overview::read(&input).expect("a recording").profile;
    let options = WriteOptions { profile, ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&lying, &options).expect("a writer");
    let mut clouds = 0;
    for record in records(&input) {
        match record {
            Record::Message { header, data, .. } if data.len() > 10_000 => {
                clouds += 1;
                let cut = if clouds == 1 || clouds == 4 { 1 } else { 0 };
                writer.write_message(&header, &data[..data.len() - cut]).expect("written");
                writer.end_chunk().expect("ended");
            }
            record => writer.copy(&record).expect("copied"),
        }
    }
    writer.attach("notes.txt", "text/plain", 5, b"kept").expect("attached");
    writer.finish().expect("finished");
    (folder, lying)
}

#[test]
fn clouds_that_lie_windows_and_ground_come_out_alike() {
    let (_folder, input) = with_lies(7);
    let overview = Overview::read(&input).expect("a recording");
    let start = overview.start_ns.expect("messages");
    let ground = AnnotateConfig { semantics: Semantics::Ground, ..AnnotateConfig::default() };
    let usual = AnnotateOptions { threads: 2, force: true, ..AnnotateOptions::default() };
    for options in [
        usual.clone(),
        AnnotateOptions { config: ground, form: Form::InPlace, ..usual.clone() },
        AnnotateOptions { from_ns: Some(start + 150_000_000), ..usual.clone() },
        AnnotateOptions { to_ns: Some(start + 450_000_000), form: Form::Only, ..usual.clone() },
        AnnotateOptions { topics: vec![CLOUD_TOPIC.into()], unchecked: true, ..usual },
    ] {
        let whole = run(&input, &options);
        assert!(sliced(&input, &planned(&input, 3), &options) == whole, "{options:?}");
    }
    let files = annotated(
        &planned(&input, 7),
        input.parent().expect("a folder"),
        &AnnotateOptions::default(),
    );
    assert_eq!(files.len(), 7);
    let output = input.with_extension("joined.mcap");
    let report = joined(&files, &output).expect("joined");
    let topic = &report.topics[CLOUD_TOPIC];
    assert_eq!((topic.frames, topic.unreadable, topic.resumed), (5, 2, 5));
    assert!(report.input_sha256.is_some());
}

#[test]
fn what_is_lost_repeated_or_other_is_named() {
    let (folder, input) = with_lies(6);
    let slices = planned(&input, 3);
    let files = annotated(&slices, folder.path(), &AnnotateOptions::default());
    let output = folder.path().join("out.mcap");
    let problem = |files: &[PathBuf]| joined(files, &output).expect_err("refused").to_string();

    let lost = problem(&[files[0].clone(), files[2].clone()]);
    assert!(lost.contains("1 slice is missing: lying.slice-0001-of-0003.mcap"), "{lost}");
    let twice = problem(&[files.clone(), vec![files[0].clone()]].concat());
    assert!(twice.contains("slice lying.slice-0002-of-0003.mcap is there twice"), "{twice}");

    let of_others = folder.path().join("others");
    std::fs::create_dir(&of_others).expect("a folder");
    let config = AnnotateConfig { semantics: Semantics::Ground, ..AnnotateConfig::default() };
    let others =
        annotated(&slices, &of_others, &AnnotateOptions { config, ..AnnotateOptions::default() });
    let mixed = problem(&[files[0].clone(), files[1].clone(), others[2].clone()]);
    assert!(mixed.contains("they differ in semantics"), "{mixed}");

    let wrong = SliceFile::open(&input).expect_err("no slice").to_string();
    assert!(wrong.contains("no slice"), "{wrong}");

    // A slice that is cut off behind its first clouds.
    let whole = std::fs::read(&files[1]).expect("a slice");
    std::fs::write(&files[1], &whole[..whole.len() * 2 / 3]).expect("written");
    let cut = problem(&files);
    assert!(cut.contains("lying.slice-0001-of-0003.mcap: cut off"), "{cut}");
    std::fs::write(&files[1], &whole).expect("written");

    // A recording that has changed behind the plan's back, its length the same.
    let mut bytes = std::fs::read(&input).expect("the input");
    let other = folder.path().join("other.mcap");
    std::fs::write(&other, &bytes).expect("written");
    bytes.push(0);
    std::fs::write(&input, &bytes).expect("written");
    let changed = problem(&files);
    assert!(changed.contains("bytes, and had"), "{changed}");
    let run = AnnotateOptions {
        slice: Some(slices[0].clone()),
        force: true,
        ..AnnotateOptions::default()
    };
    let changed = annotate(&input, &output, &run, &mut go_on).expect_err("refused").to_string();
    assert!(changed.contains("plan them anew"), "{changed}");
    let options = JoinOptions { input: Some(other), ..JoinOptions::default() };
    let by_recording = by_recording(opened(&files), None).expect("all of them");
    join(&by_recording[0], &output, &options, &mut go_on).expect("joined");
}

#[test]
fn no_flipped_byte_of_a_slice_changes_the_output() {
    let (folder, input) = with_lies(4);
    let files = annotated(&planned(&input, 2), folder.path(), &AnnotateOptions::default());
    let output = folder.path().join("out.mcap");
    joined(&files, &output).expect("joined");
    let expected = std::fs::read(&output).expect("the output");
    let whole = std::fs::read(&files[0]).expect("a slice");
    let mut random = Pcg64Mcg::seed_from_u64(9);
    let mut refused = 0;
    for _ in 0..300 {
        let mut bytes = whole.clone();
        let at = random.random_range(0..bytes.len());
        bytes[at] ^= 1 << random.random_range(0..8);
        // Near the start there is little that is not looked at: the slice's own description.
        let at = random.random_range(0..bytes.len().min(3000));
        bytes[at] ^= u8::from(random.random::<bool>());
        std::fs::write(&files[0], &bytes).expect("written");
        let done = SliceFile::open(&files[0]).and_then(|first| {
            let other = SliceFile::open(&files[1])?;
            let slices = by_recording(vec![first, other], None)?;
            let options = JoinOptions { force: true, threads: 1, ..JoinOptions::default() };
            join(&slices[0], &output, &options, &mut go_on)
        });
        match done {
            Err(_) => refused += 1,
            Ok(_) => assert!(std::fs::read(&output).expect("the output") == expected),
        }
    }
    assert!(refused > 200, "only {refused} were refused");
}

#[test]
fn a_slice_reads_its_own_bytes() {
    let (folder, input) = with_lies(8);
    let size = std::fs::metadata(&input).expect("the input").len();
    for slice in planned(&input, 4) {
        assert!(slice.clouds == 2 && slice.end - slice.start < size / 3);
        let options = AnnotateOptions {
            slice: Some(slice.clone()),
            force: true,
            ..AnnotateOptions::default()
        };
        let output = folder.path().join(slice.file_name());
        let report = annotate(&input, &output, &options, &mut go_on).expect("a slice");
        let read = report.input_bytes_read;
        assert!(read < size / 3, "{read} of {size} bytes for slice {}", slice.number);
        assert_eq!(report.topics[CLOUD_TOPIC].frames + report.topics[CLOUD_TOPIC].unreadable, 2);
    }
}

#[test]
fn over_the_command_line() {
    let (folder, input) = with_lies(4);
    let drives = folder.path().join("drives");
    std::fs::create_dir_all(drives.join("day")).expect("folders");
    std::fs::copy(&input, drives.join("a.mcap")).expect("copied");
    std::fs::copy(&input, drives.join("day/a.mcap")).expect("copied");
    let [plan, slices, joined, whole] =
        ["plan.json", "slices", "joined", "whole"].map(|name| folder.path().join(name));
    let done = divmerge(&["plan", path(&drives), "--shards", "4", "-o", path(&plan)]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let numbers = Plan::read(&plan).expect("a plan").slices.len();
    assert_eq!(numbers, 4);
    for number in (0..numbers).rev() {
        let slice = format!("{}:{number}", path(&plan));
        let done = divmerge(&["annotate", "--slice", &slice, "-o", path(&slices)]);
        // Exit code 3: the first and the last cloud of each recording cannot be read.
        assert_eq!(done.status.code(), Some(3), "{}", text(&done.stderr));
    }
    let again = format!("{}:0", path(&plan));
    let done = divmerge(&["annotate", "--slice", &again, "-o", path(&slices), "--resume"]);
    assert!(text(&done.stdout).contains("already exists"), "{}", text(&done.stderr));
    let beyond = format!("{}:4", path(&plan));
    let done = divmerge(&["annotate", "--slice", &beyond, "-o", path(&slices)]);
    assert!(text(&done.stderr).contains("no slice 4"), "{}", text(&done.stderr));

    let done = divmerge(&["join", path(&slices), "--plan", path(&plan), "-o", path(&joined)]);
    assert_eq!(done.status.code(), Some(3), "{}", text(&done.stderr));
    for name in ["a.mcap", "day/a.mcap"] {
        let alone = whole.with_extension("mcap");
        divmerge(&["annotate", path(&drives.join(name)), "-o", path(&alone), "--force"]);
        let read = |file: &Path| std::fs::read(file).expect("an output");
        assert!(read(&joined.join(name)) == read(&alone), "{name}");
        assert_eq!(
            read(&joined.join(name).with_extension("layout.json")),
            read(&alone.with_extension("layout.json"))
        );
    }

    // With all slices of a recording gone, only the plan knows.
    std::fs::remove_dir_all(slices.join("day")).expect("removed");
    let done = divmerge(&["join", path(&slices), "--plan", path(&plan), "-o", path(&joined)]);
    let said = text(&done.stderr);
    assert!(said.contains("day/a.mcap") && said.contains("2 slices are missing"), "{said}");
}
