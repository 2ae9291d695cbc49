//! Makes docs/results.md anew: runs the commands in it and puts what they print in the place of
//! what stands below them.
//!
//! ```sh
//! # All commands, or those that contain a word.
//! cargo build --release
//! cargo run --release --example 09_results [-- WORD...]
//! ```
//!
//! A table of the page is replaced by the printed table of the same head (of several the one in the
//! same place), and a line by the printed line that is the same up to its first digit (of several
//! the one in the same place). What is printed beside is left out; a table that no command prints
//! any more is an error, so that the page holds no table made by hand. The text between is left as
//! it is: read it again afterwards.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

const PAGE: &str = "docs/results.md";

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join(PAGE)).context(PAGE)?;
    let mut made: Vec<String> = Vec::new();
    for section in sections(&page) {
        let wanted = words.is_empty() || words.iter().any(|word| section.command.contains(word));
        made.extend(section.before.iter().map(|line| line.to_string()));
        if section.command.is_empty() || !wanted {
            made.extend(section.below.iter().map(|line| line.to_string()));
            continue;
        }
        eprintln!("{}", section.command);
        let printed = run(root, &section.command)?;
        let below = replaced(&section.below, &printed).context(section.command)?;
        made.extend(below);
        // What has been made is kept even if a later command fails.
        let rest = page.lines().skip(section.end).map(str::to_owned);
        let text = made.iter().cloned().chain(rest).collect::<Vec<_>>().join("\n") + "\n";
        std::fs::write(root.join(PAGE), text)?;
    }
    Ok(())
}

/// A part of the page.
struct Section<'a> {
    /// Up to the end of the block with the command.
    before: Vec<&'a str>,
    /// The commands of the block, or nothing.
    command: String,
    /// Up to the next such block.
    below: Vec<&'a str>,
    /// Lines of the page up to here.
    end: usize,
}

/// Cuts the page at its blocks of shell commands.
fn sections(page: &str) -> Vec<Section<'_>> {
    let mut sections: Vec<Section> = Vec::new();
    let mut block: Option<(Vec<&str>, String)> = None;
    let empty = || Section { before: vec![], command: String::new(), below: vec![], end: 0 };
    for line in page.lines() {
        match (&mut block, line) {
            (None, "```sh") => block = Some((vec![line], String::new())),
            (Some((lines, command)), "```") => {
                lines.push(line);
                let (before, command) = (std::mem::take(lines), command.trim().to_owned());
                sections.push(Section { before, command, ..empty() });
                block = None;
            }
            (Some((lines, command)), line) => {
                lines.push(line);
                *command += &format!("{line}\n");
            }
            (None, line) => {
                if sections.is_empty() {
                    sections.push(empty());
                }
                sections.last_mut().expect("one").below.push(line);
            }
        }
    }
    let mut end = 0;
    for section in &mut sections {
        end += section.before.len() + section.below.len();
        section.end = end;
    }
    sections
}

fn run(root: &Path, command: &str) -> Result<String> {
    let beside = std::env::current_exe()?;
    let binary = beside.ancestors().nth(2).context("no folder of the program")?;
    let path = std::env::var("PATH").unwrap_or_default();
    let output = Command::new("sh")
        .args(["-ec", command])
        .env("PATH", format!("{}:{path}", binary.display()))
        .current_dir(root)
        .stderr(std::process::Stdio::inherit())
        .output()?;
    if !output.status.success() {
        bail!("`{command}` failed");
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The lines of a section with what was printed in the place of what stood there.
fn replaced(below: &[&str], printed: &str) -> Result<Vec<String>> {
    let mut printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
    let mut tables: Vec<(&str, Vec<&str>)> = printed
        .chunk_by(|a, b| a.starts_with('|') && b.starts_with('|'))
        .filter(|lines| lines[0].starts_with('|'))
        .map(|lines| (lines[0], lines.to_vec()))
        .collect();
    let mut made = Vec::new();
    let parts = below.chunk_by(|a, b| a.starts_with('|') && b.starts_with('|'));
    for part in parts {
        if part[0].starts_with('|') {
            let found = tables.iter().position(|(head, _)| cells(head) == cells(part[0]));
            let found =
                found.with_context(|| format!("no table is printed with the head {}", part[0]))?;
            made.extend(tables.remove(found).1.iter().map(|line| line.to_string()));
            continue;
        }
        let line = part[0];
        let same = printed.iter().position(|other| is_same_statement(line, other));
        // Of several such lines the one in the same place, as of tables.
        made.push(same.map_or(line, |place| printed.remove(place)).to_owned());
    }
    Ok(made)
}

fn cells(row: &str) -> Vec<&str> {
    row.trim_matches('|').split('|').map(str::trim).collect()
}

/// Whether two lines say the same of other numbers.
fn is_same_statement(line: &str, other: &str) -> bool {
    let words = |line: &str| line.split(|c: char| c.is_ascii_digit()).next().map(str::len);
    match (words(line), words(other)) {
        (Some(a), Some(b)) => a == b && a >= 12 && a < line.len() && line[..a] == other[..b],
        _ => false,
    }
}
