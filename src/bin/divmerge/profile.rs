//! Where an annotation's time went, as a table.

use divmerge::annotate::{Profile, Report};
use divmerge::io::Fetched;
use divmerge::stopwatch::Steps;

use crate::terminal::grouped;

/// A line a stage, what became of chunks, and the slowest frames.
pub fn text(report: &Report) -> String {
    let mut lines = Vec::new();
    let profile = &report.profile;
    let frames: u64 = report.topics.values().map(|topic| topic.frames).sum();
    lines.push(String::new());
    lines.push(format!(
        "{:.2} s on {} thread{}, {:.1} frames per second",
        profile.wall_ms / 1e3,
        profile.threads,
        if profile.threads == 1 { "" } else { "s" },
        1e3 * frames as f64 / profile.wall_ms
    ));
    lines.push(String::new());
    lines.push(format!(
        "{:<22} {:>12} {:>12} {:>10} {:>17} {:>8}",
        "stage", "ms per frame", "slowest step", "of wall", "bytes", "MB/s"
    ));
    for (name, steps) in stages(profile) {
        lines.push(stage(name, &steps, frames, profile.wall_ms));
    }
    lines.push(String::new());
    let write = &profile.write;
    lines.push(format!(
        "chunks taken over as they are: {} of {} bytes; compressed: {} bytes to {}",
        grouped(write.verbatim_chunks),
        grouped(write.verbatim_bytes),
        grouped(write.compress.bytes),
        grouped(write.compressed_bytes)
    ));
    if let Some(Fetched { requests, bytes }) = report.fetched {
        let (requests, bytes) = (grouped(requests), grouped(bytes));
        lines.push(format!("fetched over the network: {bytes} bytes in {requests} requests"));
    }
    lines.push(format!("clouds in flight: at most {}", profile.most_clouds_in_flight));
    if let Some(bytes) = peak_memory() {
        lines.push(format!("memory at its peak: {:.0} MB", bytes as f64 / 1e6));
    }
    lines.push("slowest frames:".to_owned());
    for frame in &profile.slowest {
        let (topic, number, log_time) = (&frame.topic, frame.number, frame.log_time_ns);
        lines.push(format!(
            "    {topic} {number}, logged at {}.{:09}: {:.1} ms",
            log_time / 1_000_000_000,
            log_time % 1_000_000_000,
            frame.ms
        ));
    }
    lines.into_iter().map(|line| line + "\n").collect()
}

/// Name and steps of each stage, in the order in which a frame goes through them. Waiting is of the thread that
/// reads and writes.
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

/// The most memory that this process had, in bytes, where the system tells (Linux).
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|kib| kib * 1024)
}
