//! Rooms: which stands above which, which dependency belongs to which, and who may read and write.

use super::arrows::Arrow;
use super::{ARROWS, HOUSE, fail_on};

/// Rooms from the bottom up, by folder or file. A room may use those in the rows above it, and none
/// beside it. A file is in the room with the longest path that fits.
const ROOMS: &[&[&str]] = &[
    &["crates/core/src/error.rs"],
    &["crates/core/src/geometry"],
    &["crates/core/src/cloud"],
    &["crates/core/src/range_image"],
    &["crates/core/src/semantics"],
    &["crates/core/src/cluster"],
    &["crates/core/src/pipeline"],
    &["crates/core/src/over_time"],
    &["crates/core/src/parameters"],
    &["crates/core/src/lib.rs"],
    &["crates/simulate/src"],
    &["crates/recording/src"],
    &["src/palette.rs", "src/text.rs"],
    &["src/error"],
    &["src/evaluate", "src/comparison/methods", "src/diagnose/explain", "src/taxonomy_file.rs"],
    &["src/parameter_file"],
    &["src/network"],
    &["src/messages"],
    &["src/datasets"],
    &["src/io"],
    &["src/frames"],
    &["src/annotate"],
    &["src/comparison"],
    &["src/diagnose"],
    &["src/view"],
    &["src/inspect"],
    &["src/lib.rs"],
    &["src/cli"],
    &["python/src", "src/bin"],
];

/// Dependencies, and the rooms or files that may name them. Others may be named anywhere.
const DEPENDENCIES: &[(&str, &[&str])] = &[
    ("anyhow", &["src/cli"]),
    (
        "base64",
        &[
            "crates/recording/src/remote",
            "src/annotate/tracking",
            "src/inspect",
            "src/messages",
            "src/view/svg.rs",
        ],
    ),
    ("binrw", &["crates/recording"]),
    ("clap", &["src/cli"]),
    ("clap_complete", &["src/cli"]),
    ("crc32fast", &["crates/recording"]),
    ("ctrlc", &["src/cli"]),
    ("flate2", &["src/inspect", "src/view/pdf"]),
    ("foxglove", &["src/messages"]),
    ("getrandom", &["src/inspect"]),
    ("httparse", &["src/inspect"]),
    ("indicatif", &["src/cli"]),
    ("jiff", &["src/messages"]),
    ("kiddo", &["crates/core/src/geometry"]),
    ("lz4", &["crates/recording"]),
    ("mcap", &["crates/recording"]),
    ("numpy", &["python/src"]),
    ("object_store", &["crates/recording/src/remote"]),
    ("open", &["src/cli"]),
    ("ort", &["src/network"]),
    ("pathfinding", &["crates/core/src/geometry"]),
    ("pdf_writer", &["src/view/pdf"]),
    ("png", &["src/view"]),
    ("pyo3", &["python/src"]),
    ("rand_pcg", &["crates/simulate", "src/comparison"]),
    ("rerun", &["src/view/rerun_stream"]),
    ("rustls", &["crates/recording/src/remote"]),
    ("schemars", &["crates/core", "src/comparison/methods"]),
    ("serde_saphyr", &["src/datasets", "src/network", "src/taxonomy_file.rs"]),
    ("sha2", &["crates/recording", "src/inspect", "src/network"]),
    ("tempfile", &["crates/recording"]),
    ("tiny_skia", &["src/view"]),
    ("tokio", &["crates/recording/src/remote"]),
    ("toml", &["src/parameter_file"]),
    ("tract_onnx", &["src/network"]),
    ("ttf_parser", &["src/view"]),
    ("zstd", &["crates/recording"]),
];

/// Rooms that may read records one after the other.
const RECORD_READERS: &[&str] = &["crates/recording", "src/annotate", "src/frames"];

/// Whether a file is a room or in it.
fn is_in(file: &str, room: &str) -> bool {
    let rest = file.strip_prefix(room);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/') || rest == ".rs")
}

/// A file's room and the row it stands in.
fn room_of(file: &str) -> Option<(usize, &'static str)> {
    let rows = ROOMS.iter().enumerate();
    let rooms = rows.flat_map(|(row, rooms)| rooms.iter().map(move |&room| (row, room)));
    rooms.filter(|(_, room)| is_in(file, room)).max_by_key(|(_, room)| room.len())
}

/// What is wrong with an arrow, if it does not point down.
fn complaint(arrow: &Arrow) -> Option<String> {
    let Arrow { from, to, line, name } = arrow;
    let (Some((own, own_room)), Some((other, other_room))) = (room_of(from), room_of(to)) else {
        return Some(format!("{from} or {to} is in no room of the table ROOMS"));
    };
    let is_wrong = own_room != other_room && other >= own;
    let why = if other == own { "beside" } else { "above" };
    is_wrong.then(|| {
        format!("{from}:{line} takes `{name}` from {to}: {other_room} is {why} {own_room}")
    })
}

#[test]
fn arrows_point_down_only() {
    let complaints: Vec<String> = ARROWS.iter().filter_map(complaint).collect();
    fail_on(&complaints);
}

/// The root of the package re-exports for others. Whoever stands below it names the crate or the
/// room that has the item.
#[test]
fn rooms_take_nothing_through_the_root() {
    let is_room =
        |name: &str| HOUSE.modules.iter().any(|module| is_in(&module.file, &format!("src/{name}")));
    let mut complaints = Vec::new();
    for module in HOUSE.modules.iter().filter(|module| is_in(&module.file, "src")) {
        if ["src/bin", "src/cli", "src/lib.rs"].iter().any(|above| is_in(&module.file, above)) {
            continue;
        }
        let imports = module.imports.iter().map(|import| (&import.path, import.line));
        let mentions = module.mentions.iter().map(|mention| (&mention.path, mention.line));
        for (path, line) in imports.chain(mentions) {
            if let [root, name, ..] = &path[..]
                && root == "crate"
                && !is_room(name)
            {
                let file = &module.file;
                complaints.push(format!("{file}:{line} takes `{name}` through the root"));
            }
        }
    }
    fail_on(&complaints);
}

/// Files and lines where code names a dependency.
fn namers(dependency: &str) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    for module in &HOUSE.modules {
        let imports = module.imports.iter().map(|import| (&import.path, import.line));
        let mentions = module.mentions.iter().map(|mention| (&mention.path, mention.line));
        let named = imports.chain(mentions).filter(|(path, _)| path.len() > 1);
        let named = named.filter(|(path, _)| path[0] == dependency);
        found.extend(named.map(|(_, line)| (module.file.clone(), line)));
    }
    found
}

#[test]
fn dependencies_stay_in_their_rooms() {
    let mut complaints = Vec::new();
    for (dependency, rooms) in DEPENDENCIES {
        let namers = namers(dependency);
        for room in rooms.iter().filter(|room| !namers.iter().any(|(file, _)| is_in(file, room))) {
            complaints.push(format!("{room} no longer names {dependency}: shorten the table"));
        }
        let outside = namers.iter().filter(|(file, _)| !rooms.iter().any(|room| is_in(file, room)));
        let told = |(file, line): &(String, usize)| {
            format!("{file}:{line} names {dependency}, which belongs in {}", rooms.join(", "))
        };
        complaints.extend(outside.map(told));
    }
    fail_on(&complaints);
}

/// Complaints about places outside a list of exceptions, and about exceptions that are none.
fn beyond(known: &[(&str, &str)], found: &[(String, usize)], what: &str) -> Vec<String> {
    let is_known = |file: &str| known.iter().any(|(known, _)| *known == file);
    let new = found.iter().filter(|(file, _)| !is_known(file));
    let new = new.map(|(file, line)| format!("{file}:{line} {what}"));
    let gone = known.iter().filter(|(known, _)| !found.iter().any(|(file, _)| file == known));
    let gone = gone.map(|(file, _)| format!("{file} is no exception any more: delete its entry"));
    new.chain(gone).collect()
}

#[test]
fn records_are_read_in_their_rooms_only() {
    let mut found = Vec::new();
    for module in &HOUSE.modules {
        let is_allowed = RECORD_READERS.iter().any(|room| is_in(&module.file, room));
        let calls = module.calls.iter().filter(|_| !is_allowed);
        let reads = calls.filter(|(name, _)| name == "next_record" || name == "next_part");
        found.extend(reads.map(|(_, line)| (module.file.clone(), *line)));
    }
    fail_on(&beyond(&[], &found, "reads records: use the walker of frames"));
}

/// Whether a file belongs to the command line.
fn is_of_command_line(file: &str) -> bool {
    ["src/bin", "src/cli"].iter().any(|room| is_in(file, room))
}

/// The command line writes what `Outputs` has checked, so that no command writes over its input,
/// through a link, or half a file.
#[test]
fn the_command_line_writes_checked_outputs_only() {
    const OUTPUT: &str = "src/cli/output.rs";
    const WRITES: &[&[&str]] = &[
        &["fs", "write"],
        &["fs", "copy"],
        &["fs", "rename"],
        &["fs", "create_dir"],
        &["fs", "create_dir_all"],
        &["File", "create"],
        &["File", "create_new"],
        &["File", "options"],
        &["OpenOptions", "new"],
        &["PartialFile", "create"],
        &["write_file"],
        &["write_labels"],
    ];
    let mut found = Vec::new();
    for module in &HOUSE.modules {
        let is_checked = module.file == OUTPUT || !is_of_command_line(&module.file);
        let mentions = module.mentions.iter().filter(|_| !is_checked);
        let ends = |path: &[String]| WRITES.iter().any(|end| path.ends_with(&owned(end)));
        let writes = mentions.filter(|mention| ends(&mention.path));
        found.extend(writes.map(|mention| (module.file.clone(), mention.line)));
    }
    fail_on(&beyond(&[], &found, "writes a file: use Outputs and OutputFile"));
}

/// The library's functions that write to a path get it from a checked output.
#[test]
fn commands_check_what_the_library_writes() {
    const WRITERS: &[&[&str]] = &[
        &["annotate", "annotate"],
        &["annotate", "join"],
        &["drive", "write_drive"],
        &["drive", "write_drive_in"],
        &["recording", "triage_recording"],
        &["scans", "ScanFolder"],
        &["sequence", "Sequence"],
        &["viewer", "open"],
    ];
    let mut found = Vec::new();
    for module in HOUSE.modules.iter().filter(|module| is_of_command_line(&module.file)) {
        let ends = |path: &[String]| WRITERS.iter().any(|end| path.ends_with(&owned(end)));
        let checks = |path: &[String]| path.ends_with(&owned(&["output", "Outputs"]));
        let imports = module.imports.iter().map(|import| (&import.path, import.line));
        let mentions = module.mentions.iter().map(|mention| (&mention.path, mention.line));
        let paths: Vec<(&Vec<String>, usize)> = imports.chain(mentions).collect();
        if !paths.iter().any(|(path, _)| checks(path)) {
            let writes = paths.iter().filter(|(path, _)| ends(path));
            found.extend(writes.map(|(_, line)| (module.file.clone(), *line)));
        }
    }
    fail_on(&beyond(&[], &found, "writes without Outputs, which checks the name"));
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}
