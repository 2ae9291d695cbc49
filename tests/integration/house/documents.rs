//! Documents: their lines are not too wide, and what they name is there.

use super::known::{Flaw, fail_beyond};
use super::sizes::COLUMNS;
use super::source::Texts;
use super::{root, texts};

/// Folders whose files documents name in code spans. Records of decisions may name what is gone.
const FOLDERS: &[&str] =
    &["src/", "crates/", "tests/", "benches/", "examples/", "fuzz/", "python/", "docs/", ".ci/"];

fn documents() -> Texts {
    let mut found = texts("docs", &[".md"]);
    for name in ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"] {
        let text = std::fs::read_to_string(root().join(name)).expect("a document");
        found.insert(name.to_owned(), text);
    }
    found.retain(|file, _| !file.starts_with("docs/measurements/"));
    found
}

/// Lines with their numbers, without those of code blocks.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut is_code = false;
    let lines = (1..).zip(text.lines()).filter(|(_, line)| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    });
    lines.collect()
}

#[test]
fn lines_of_documents_are_not_too_wide() {
    let mut flaws = Vec::new();
    for (file, text) in documents() {
        let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.starts_with('|'));
        let wide = lines.filter(|(_, line): &(usize, &str)| line.chars().count() > COLUMNS);
        let wide: Vec<String> = wide.map(|(number, _)| number.to_string()).collect();
        if !wide.is_empty() {
            let complaint = format!("{file} has lines over {COLUMNS} columns: {}", wide.join(", "));
            flaws.push(Flaw { key: format!("document {file}"), size: wide.len(), complaint });
        }
    }
    fail_beyond(&["document"], flaws);
}

/// What is between an opening and a closing mark, each time.
fn between<'a>(line: &'a str, open: &str, close: char) -> Vec<&'a str> {
    let parts = line.split(open).skip(1);
    parts.filter_map(|rest| rest.split_once(close)).map(|(inside, _)| inside).collect()
}

/// What a line of a document names that is not there: targets of links, and paths in code spans.
fn missing<'a>(file: &str, line: &'a str) -> Vec<&'a str> {
    let folder = root().join(file).parent().expect("a folder").to_owned();
    let links = between(line, "](", ')').into_iter().filter(|link| !link.contains("://"));
    let links = links.map(|link| link.split('#').next().unwrap_or_default());
    let mut found: Vec<&str> = links.filter(|link| !folder.join(link).exists()).collect();
    if !file.starts_with("docs/decisions/") {
        let is_path = |span: &&str| {
            FOLDERS.iter().any(|folder| span.starts_with(folder)) && !span.contains([' ', '*', '$'])
        };
        let paths = line.split('`').skip(1).step_by(2).filter(is_path);
        found.extend(paths.filter(|path| !root().join(path).exists()));
    }
    found
}

#[test]
fn links_and_paths_in_documents_lead_somewhere() {
    let mut flaws = Vec::new();
    for (file, text) in documents() {
        let lines = prose(&text).into_iter();
        let lines = lines.flat_map(|(number, line)| {
            missing(&file, line).into_iter().map(move |name| format!("line {number} {name}"))
        });
        let names: Vec<String> = lines.collect();
        if !names.is_empty() {
            let complaint = format!("{file} names what is not there: {}", names.join(", "));
            flaws.push(Flaw { key: format!("missing {file}"), size: names.len(), complaint });
        }
    }
    fail_beyond(&["missing"], flaws);
}
