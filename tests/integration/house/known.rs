//! Flaws that are known: `known.txt`, sorted, a line each: `kind place size`.
//!
//! The list may only shrink. A flaw that is not in it or has grown fails a test, and so does an
//! entry whose flaw is gone. After renames, `PRINT_KNOWN=1 cargo test house:: -- --nocapture`
//! prints what it should hold.

use std::collections::BTreeMap;

use super::fail_on;

const KNOWN: &str = include_str!("known.txt");

/// Something that breaks a rule.
pub struct Flaw {
    /// Its kind and place, as in the list.
    pub key: String,
    pub size: usize,
    /// What is said of it where it is not in the list.
    pub complaint: String,
}

/// Fails unless the flaws of these kinds are those of the list, and no larger.
pub fn fail_beyond(kinds: &[&str], flaws: Vec<Flaw>) {
    let mut known = listed(kinds);
    let mut complaints: Vec<String> = Vec::new();
    for Flaw { key, size, complaint } in flaws {
        if std::env::var_os("PRINT_KNOWN").is_some() {
            println!("known: {key} {size}");
        }
        let allowed = known.remove(&key);
        if allowed.is_none_or(|allowed| size > allowed) && !complaints.contains(&complaint) {
            complaints.push(complaint);
        }
    }
    let gone = known.keys().map(|key| format!("delete from known.txt, it is right now: {key}"));
    complaints.extend(gone);
    fail_on(&complaints);
}

/// Entries of some kinds: key and size.
fn listed(kinds: &[&str]) -> BTreeMap<String, usize> {
    let entry = |line: &'static str| {
        let (key, size) = line.rsplit_once(' ').expect("kind, place and size");
        (key.to_owned(), size.parse().expect("a size"))
    };
    let is_of_them = |line: &&str| kinds.iter().any(|kind| line.starts_with(&format!("{kind} ")));
    KNOWN.lines().filter(is_of_them).map(entry).collect()
}

#[test]
fn the_list_is_sorted() {
    let lines: Vec<&str> = KNOWN.lines().collect();
    assert!(lines.is_sorted(), "sort tests/integration/house/known.txt");
}
