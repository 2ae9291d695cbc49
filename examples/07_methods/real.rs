//! Table `real`: all methods on the real drives, by drive and by class; and where each of ours is
//! behind another.

use crate::frames::Frame;
use crate::methods;
use crate::scores::{CLASSES, add, cell, head, scores, things};

/// Prints the table.
pub fn tables(frames: &[Frame]) {
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    let names = groups.iter().copied().chain(["all"]).chain(CLASSES.iter().map(|(name, _)| *name));
    let names: Vec<String> = names.map(str::to_owned).collect();
    head("Drive", &names);
    let mut rows: Vec<(&str, Vec<Option<f64>>)> = Vec::new();
    for method in methods::all() {
        let mut all = scores();
        let mut cells = Vec::new();
        for group in &groups {
            let mut own = scores();
            for frame in frames.iter().filter(|frame| frame.group == *group) {
                let found = method.run(frame);
                add(frame, &found, &mut own);
                add(frame, &found, &mut all);
            }
            cells.push(things(&own, &[]));
        }
        cells.push(things(&all, &[]));
        cells.extend(CLASSES.iter().map(|(_, names)| things(&all, names)));
        let words: Vec<String> = cells.iter().copied().map(cell).collect();
        println!("| {} | {} |", method.name, words.join(" | "));
        rows.push((method.name, cells));
    }
    println!();
    behind(&names, &rows);
}

/// Where each of our presets is behind another method, and behind which most.
fn behind(names: &[String], rows: &[(&str, Vec<Option<f64>>)]) {
    head("Behind another method in", &["by".to_owned(), "which".to_owned()]);
    let is_ours = |name: &str| name.starts_with('`');
    // Boxes are drawn around the truth.
    let is_rival = |name: &str| !is_ours(name) && !name.starts_with("boxes");
    for (ours, cells) in rows.iter().filter(|(name, _)| is_ours(name)) {
        let mut lines = Vec::new();
        for (column, name) in names.iter().enumerate() {
            let Some(own) = cells[column] else { continue };
            let others = rows.iter().filter(|(other, _)| is_rival(other));
            let best = others.filter_map(|(other, cells)| Some((*other, cells[column]?)));
            let best = best.max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((other, theirs)) = best.filter(|&(_, theirs)| theirs > own + 0.005) {
                lines.push(format!("| {ours}: {name} | {:.2} | {other} |", theirs - own));
            }
        }
        match lines.as_slice() {
            [] => println!("| {ours}: nowhere | | |"),
            lines => lines.iter().for_each(|line| println!("{line}")),
        }
    }
    println!();
}
