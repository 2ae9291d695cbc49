//! Failures in words.

use std::path::Path;

use crate::diagnose::failures::{Cause, Failure, FailureSummary, ObjectOrigin, VerdictCount};
use crate::evaluate::{JudgedObject, Verdict};

use super::row::{Row, side_name};
use crate::cli::shell::{path_word, quoted};
use crate::cli::table::Table;
use crate::cli::text::{counted, fitted, grouped, listed, seconds};

/// Prints the counts and the first `limit` failures. Unmatched objects of fewer than `min_points`
/// points are not among them.
pub fn print(summary: &FailureSummary, rows: &[Row], input: &Path, limit: usize, min_points: u64) {
    let frames = counted(summary.frames, "frame");
    println!("{frames}; unmatched objects of fewer than {min_points} points do not count\n");
    print!("{}", verdicts(summary).markdown());
    if summary.elsewhere > 0 {
        let instances = counted(summary.elsewhere, "found instance");
        println!("and {instances} outside true things");
    }
    print!("\n{}", causes(summary).markdown());
    let total = summary.failures();
    if total == 0 {
        println!("\nno failures");
        return;
    }
    let shown = rows.len().min(limit);
    println!("\n{shown} of {}, the largest first:", counted(total, "failure"));
    for (number, row) in (1..).zip(rows.iter().take(shown)) {
        println!();
        print_failure(number, row);
    }
    if input.is_dir() && shown > 0 {
        println!("\nThe commands read recordings. To convert a sequence:");
        println!(
            "  divmerge convert semantickitti {} --sequence NN --labels -o NN.mcap",
            quoted(&path_word(input))
        );
    }
}

/// Objects of either side by verdict.
fn verdicts(summary: &FailureSummary) -> Table {
    let rows = Verdict::ALL.map(|verdict| {
        let count = summary.verdicts.get(verdict.name()).copied().unwrap_or_default();
        let cell = |number: u64, is_none: bool| if is_none { "-".into() } else { grouped(number) };
        vec![
            verdict.name().to_owned(),
            cell(count.r#true, verdict == Verdict::Spurious),
            cell(count.found, verdict == Verdict::Missed),
        ]
    });
    let VerdictCount { r#true, found } = summary.small;
    let small = vec!["small".to_owned(), grouped(r#true), grouped(found)];
    Table::new(&["verdict", "true objects", "found instances"], rows.into_iter().chain([small]))
}

/// Failures by step and verdict.
fn causes(summary: &FailureSummary) -> Table {
    let verdicts = &Verdict::ALL[1..];
    let head: Vec<&str> =
        std::iter::once("failures by cause").chain(verdicts.iter().map(|v| v.name())).collect();
    let row = |step: &&'static str| {
        let of_step = summary.causes.get(step);
        let count = |verdict: &Verdict| of_step.and_then(|of| of.get(verdict.name())).copied();
        let counts = verdicts.iter().map(|verdict| grouped(count(verdict).unwrap_or(0)));
        std::iter::once(step.to_string()).chain(counts).collect()
    };
    Table::new(&head, Cause::STEPS.iter().map(row))
}

fn print_failure(number: usize, row: &Row) {
    let Failure { side, judged, cause, .. } = &row.found.failure;
    let [x, y, z] = judged.centre;
    let name = if judged.class_name.is_empty() { "instance" } else { &judged.class_name };
    let time =
        row.found.log_time_ns.map_or(String::new(), |ns| format!(", log time {}", seconds(ns)));
    let mut text = format!(
        "{number}. {} frame {}{time}: {} {name} of {} at {x:.1},{y:.1},{z:.1}: {}\n",
        row.found.topic,
        row.found.frame,
        side_name(*side),
        counted(judged.points, "point"),
        judged.verdict.name()
    );
    text += &format!("   {}\n", shared_points(*side, judged));
    text += &format!("   cause: {}: {}\n", cause.step(), row.found.cause_in_words);
    if row.found.failure.is_right_with_true_mask && cause.step() != "mask" {
        text += "   (with a true mask it would be right)\n";
    }
    for command in row.explain.iter().chain(&row.figure) {
        text += &format!("   {command}\n");
    }
    print!("{}", fitted(&text));
}

/// The objects that share points with the object.
fn shared_points(side: ObjectOrigin, judged: &JudgedObject) -> String {
    const NAMED: usize = 3;
    let nothing = match side {
        ObjectOrigin::True => "without an instance",
        ObjectOrigin::Found => "outside true things",
    };
    let number = |is_true: bool, id: u32| if is_true { true_number(id) } else { id };
    let parts = judged.parts.iter().map(|part| {
        let class = &part.class_name;
        let name = if class.is_empty() { String::new() } else { format!(" {class}") };
        format!(
            "{} of{name} {} ({} points)",
            grouped(part.shared),
            number(side == ObjectOrigin::Found, part.object.id),
            grouped(part.points)
        )
    });
    let mut text = listed(&parts.collect::<Vec<_>>(), NAMED);
    if judged.in_nothing > 0 {
        let separator = if text.is_empty() { "" } else { ", " };
        text += &format!("{separator}{} {nothing}", grouped(judged.in_nothing));
    }
    let mut beside: Vec<String> = Vec::new();
    for share in &judged.beside {
        let id = number(side == ObjectOrigin::True, share.object.id);
        beside.push(format!("{} of {} {id}", grouped(share.shared), share.class_name));
    }
    let mut others = listed(&beside, NAMED);
    if judged.beside_nothing > 0 {
        let separator = if others.is_empty() { "" } else { ", " };
        others += &format!("{separator}{} of none", grouped(judged.beside_nothing));
    }
    let others = match others.is_empty() {
        true => others,
        false => format!("; the first also has {others}"),
    };
    format!("its points: {text}{others}")
}

/// The instance of a true object: the upper half of an id that holds class and instance.
fn true_number(id: u32) -> u32 {
    if id > u32::from(u16::MAX) { id >> 16 } else { id }
}
