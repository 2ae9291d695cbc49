//! Table `real`: all methods on the real drives, by drive and by class.

use crate::frames::Frame;
use crate::methods;
use crate::scores::{CLASSES, add, cell, head, scores, things};

/// Prints the table.
pub fn tables(frames: &[Frame]) {
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    let names = groups.iter().copied().chain(["all"]).chain(CLASSES.iter().map(|(name, _)| *name));
    head("Drive", &names.map(str::to_owned).collect::<Vec<_>>());
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
            cells.push(cell(things(&own, &[])));
        }
        cells.push(cell(things(&all, &[])));
        cells.extend(CLASSES.iter().map(|(_, names)| cell(things(&all, names))));
        println!("| {} | {} |", method.name, cells.join(" | "));
    }
    println!();
}
