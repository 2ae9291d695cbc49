//! The time of each stage of an annotation, as a table.

use crate::annotate::{AnnotationReport, Profile};
use crate::recording::Fetched;
use crate::recording::stopwatch::Steps;

use crate::cli::text::{counted, grouped, peak_memory, seconds};

/// The stages, chunks, and the slowest frames.
pub fn text(report: &AnnotationReport) -> String {
    let profile = &report.profile;
    let frames: u64 = report.topics.values().map(|topic| topic.frames).sum();
    let mut lines = vec![
        String::new(),
        format!(
            "{:.2} s on {}, {:.1} frames per second",
            profile.wall_ms / 1e3,
            counted(profile.threads as u64, "thread"),
            1e3 * frames as f64 / profile.wall_ms
        ),
        String::new(),
        format!(
            "{:<22} {:>12} {:>12} {:>10} {:>17} {:>8}",
            "stage", "ms per frame", "slowest step", "of wall", "bytes", "MB/s"
        ),
    ];
    lines.extend(stages(profile).map(|(name, steps)| stage(name, &steps, frames, profile.wall_ms)));
    lines.push(String::new());
    let write = &profile.write;
    lines.push(format!(
        "{} ({} bytes) copied as they are; {} bytes compressed to {}",
        counted(write.verbatim_chunks, "chunk"),
        grouped(write.verbatim_bytes),
        grouped(write.compress.bytes),
        grouped(write.compressed_bytes)
    ));
    if let Some(Fetched { requests, bytes }) = report.fetched {
        let (requests, bytes) = (counted(requests, "request"), counted(bytes, "byte"));
        lines.push(format!("fetched over the network: {bytes} in {requests}"));
    }
    lines.push(format!("most clouds in flight: {}", profile.most_clouds_in_flight));
    if let Some(bytes) = peak_memory() {
        lines.push(format!("peak memory: {:.0} MB", bytes as f64 / 1e6));
    }
    lines.push("slowest frames:".to_owned());
    for frame in &profile.slowest {
        let (topic, number, time) = (&frame.topic, frame.number, seconds(frame.log_time_ns));
        lines.push(format!("    {topic} {number}, logged at {time}: {:.1} ms", frame.ms));
    }
    lines.into_iter().map(|line| line + "\n").collect()
}

/// Name and steps of each stage, in a frame's order. Only the thread that reads and writes waits.
fn stages(profile: &Profile) -> [(&'static str, Steps); 9] {
    let Profile { read, cluster, encode, wait, write, .. } = profile;
    [
        ("read and hash", read.read),
        ("decompress and check", read.unpack),
        ("cluster", *cluster),
        ("encode", *encode),
        ("compress", write.compress),
        ("write", write.write),
        ("waited for chunks read", read.wait),
        ("waited for clouds", *wait),
        ("waited for compression", write.wait),
    ]
}

fn stage(name: &str, steps: &Steps, frames: u64, wall_ms: f64) -> String {
    let (bytes, rate) = match steps.bytes {
        0 => (String::new(), String::new()),
        bytes => (grouped(bytes), format!("{:.0}", bytes as f64 / 1e3 / steps.ms)),
    };
    format!(
        "{name:<22} {:>12.2} {:>12.2} {:>8.1} % {bytes:>17} {rate:>8}",
        steps.ms / frames.max(1) as f64,
        steps.slowest_ms,
        100.0 * steps.ms / wall_ms
    )
}
