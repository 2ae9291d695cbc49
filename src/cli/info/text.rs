//! A recording in words.

use super::facts::{Cloud, Info};
use super::geometry;
use crate::cli::text::{counted, fitted, grouped};

/// Prints a recording.
pub fn print(info: &Info) {
    println!("{} ({} bytes)", info.file.display(), grouped(info.bytes));
    let named = |name: &str| {
        if name.is_empty() { "none".to_owned() } else { name.to_owned() }
    };
    let compression: Vec<String> = info.compression.iter().map(|name| named(name)).collect();
    let profile = format!(
        "  profile {}, written by {}; {} in {:.1} s; compression {}; {}, {}",
        named(&info.profile),
        named(&info.library),
        counted(info.messages, "message"),
        info.seconds,
        if compression.is_empty() { "none".to_owned() } else { compression.join(", ") },
        counted(info.attachments, "attachment"),
        counted(info.metadata, "metadata record")
    );
    print!("{}", fitted(&profile));
    for problem in &info.problems {
        println!("  warning: {problem}");
    }
    let width = info.topics.iter().map(|topic| topic.topic.len()).max().unwrap_or(0);
    for topic in &info.topics {
        let type_name = named(&topic.type_name);
        println!(
            "  {:<width$}  {type_name} ({}), {}",
            topic.topic,
            topic.encoding,
            counted(topic.messages, "message")
        );
        if let Some(cloud) = &topic.cloud {
            print_cloud(cloud);
        }
    }
}

fn print_cloud(cloud: &Cloud) {
    if let Some(note) = &cloud.note {
        println!("      {note}");
    }
    let Some(facts) = &cloud.facts else {
        return;
    };
    println!(
        "      {} x {} points of {} bytes in frame `{}`, {} returns",
        facts.height,
        facts.width,
        facts.point_step,
        facts.frame_id,
        grouped(facts.geometry.returns as u64)
    );
    print!("{}", fitted(&format!("      fields: {}", facts.fields.join(", "))));
    for line in geometry::lines(facts) {
        print!("{}", fitted(&format!("      {line}")));
    }
    for remark in &facts.remarks {
        println!("      note: {remark}");
    }
    println!("      --semantics auto: {}", facts.auto);
    if let Some(note) = &facts.auto_note {
        println!("      warning: {note}");
    }
}
