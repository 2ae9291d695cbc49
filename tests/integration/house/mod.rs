//! The rules of the house, held over the sources: arrows, rooms and sizes (docs/architecture.md).
//!
//! [`rooms`] has the tables of rooms and dependencies, `known.txt` lists what is not right yet.

mod arrows;
mod documents;
mod known;
mod reader_tests;
mod rooms;
mod sizes;
mod source;

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use arrows::{Arrow, House};
use known::Flaw;
use source::Texts;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// All files with one of the endings below a folder of the repository.
fn texts(folder: &str, endings: &[&str]) -> Texts {
    let mut found = Texts::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten() {
            let path = entry.expect("an entry").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() && name != "target" {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                let text = std::fs::read_to_string(&path).expect("a source");
                let below = path.strip_prefix(root()).expect("below the root");
                found.insert(below.to_string_lossy().into_owned(), text);
            }
        }
    }
    found
}

static HOUSE: LazyLock<House> = LazyLock::new(house);
static ARROWS: LazyLock<Vec<Arrow>> = LazyLock::new(|| HOUSE.arrows());

/// The package, its binary, its Python package and the crates, with all their modules.
fn house() -> House {
    let mut sources = texts("src", &[".rs"]);
    sources.extend(texts("crates", &[".rs"]));
    sources.extend(texts("python/src", &[".rs"]));
    let manifests = texts("crates", &["Cargo.toml"]);
    let mut crates: Vec<(String, String)> = manifests.iter().map(of_manifest).collect();
    crates.push(("divmerge".into(), "src/lib.rs".into()));
    crates.push(("the binary".into(), "src/bin/divmerge.rs".into()));
    crates.push(("the Python package".into(), "python/src/lib.rs".into()));
    House::read(&sources, &crates)
}

/// The name of a crate and its root, from its manifest.
fn of_manifest((path, text): (&String, &String)) -> (String, String) {
    let name = text.lines().find_map(|line| line.strip_prefix("name = ")).expect("a name");
    let folder = path.trim_end_matches("Cargo.toml");
    (name.trim_matches('"').replace('-', "_"), format!("{folder}src/lib.rs"))
}

/// Fails with all complaints, a paragraph each.
fn fail_on(complaints: &[String]) {
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    assert!(ARROWS.len() > 1000, "only {} arrows found: the reader is broken", ARROWS.len());
    let mut flaws = Vec::new();
    for circle in arrows::circles(&ARROWS) {
        let complaint = arrows::told(&circle, &ARROWS);
        flaws.extend(circle.iter().map(|file| Flaw {
            key: format!("circle {file}"),
            size: circle.len(),
            complaint: complaint.clone(),
        }));
    }
    known::fail_beyond(&["circle"], flaws);
}
