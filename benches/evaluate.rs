//! Scoring label files on one core: milliseconds, and the ratio to reading the same files, measured
//! in the same run.
//!
//! Forty scans as long as HDL-64E's, built here: 120,000 points in runs of a few, as the points of
//! a beam are, of which predictions err in one place out of ten. Then those of
//! ../shared/data/semantickitti where they are, their truth against itself with every seventh
//! point's label moved on.
//!
//! `cargo bench --bench evaluate` (`-- --quick` for fewer rounds).

use std::path::{Path, PathBuf};
use std::time::Instant;

use divmerge::Taxonomy;
use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, write_labels};
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};

/// The most that reading and scoring forty scans may take, in milliseconds.
const GOAL_MS: f64 = 2000.0;
const SCANS: usize = 40;
const POINTS: usize = 120_000;

fn main() {
    let rounds = if std::env::args().any(|argument| argument == "--quick") { 2 } else { 10 };
    println!("reading and scoring {SCANS} scans, ms, best of {rounds} rounds; goal {GOAL_MS} ms");
    println!("{:<12} {:>10} {:>8} {:>8} {:>8}", "scans", "points", "read", "score", "/read");
    let folder = tempfile::tempdir().expect("a folder");
    let built: Vec<[Vec<u32>; 2]> = (0..SCANS).map(built).collect();
    measure("built", &written(folder.path(), "built", &built), rounds);
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/semantickitti");
    let scans = labelled_scans(&data).unwrap_or_default();
    if scans.is_empty() {
        println!("(no {}: real scans skipped)", data.display());
        return;
    }
    let labels = scans.iter().cycle().take(SCANS);
    let real: Vec<[Vec<u32>; 2]> =
        labels.map(|scan| spoiled(read_labels(&scan.labels).expect("labels"))).collect();
    measure("real", &written(folder.path(), "real", &real), rounds);
}

/// Truth in runs of 1 to 16 points, and a prediction of which a tenth of the runs is another
/// object's.
fn built(scan: usize) -> [Vec<u32>; 2] {
    const CLASSES: [u32; 8] = [10, 30, 40, 48, 50, 70, 72, 80];
    let mut state = scan as u32 + 1;
    let mut draw = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % below
    };
    let (mut truth, mut found) = (Vec::with_capacity(POINTS), Vec::with_capacity(POINTS));
    while truth.len() < POINTS {
        let class = CLASSES[draw(8) as usize];
        let word = if class < 40 { class | (draw(60) + 1) << 16 } else { class };
        let other = if draw(10) == 0 { 10 | (draw(200) + 1) << 16 } else { word };
        let length = (draw(16) as usize + 1).min(POINTS - truth.len());
        truth.extend(std::iter::repeat_n(word, length));
        found.extend(std::iter::repeat_n(other, length));
    }
    [truth, found]
}

fn spoiled(truth: Vec<u32>) -> [Vec<u32>; 2] {
    let mut found = truth.clone();
    (7..found.len()).step_by(7).for_each(|point| found[point] = truth[point - 7]);
    [truth, found]
}

/// The files of each scan, truth and prediction.
fn written(folder: &Path, name: &str, scans: &[[Vec<u32>; 2]]) -> Vec<[PathBuf; 2]> {
    let write = |(number, sides): (usize, &[Vec<u32>; 2])| {
        let path = |side: usize| folder.join(format!("{name}-{number}-{side}.label"));
        [0, 1].map(|side| {
            write_labels(&path(side), &sides[side]).expect("a file");
            path(side)
        })
    };
    scans.iter().enumerate().map(write).collect()
}

fn measure(name: &str, files: &[[PathBuf; 2]], rounds: usize) {
    let taxonomy = Taxonomy::semantic_kitti();
    let class_of = taxonomy.lookup();
    let (mut read_ms, mut score_ms) = (f64::INFINITY, f64::INFINITY);
    let mut points = 0;
    for _ in 0..rounds {
        let (mut scores, mut read, mut score) = (Panoptic::of(&taxonomy, MIN_POINTS), 0.0, 0.0);
        points = 0;
        for sides in files {
            let started = Instant::now();
            let [truth, found] = sides.each_ref().map(|path| read_labels(path).expect("labels"));
            read += started.elapsed().as_secs_f64() * 1e3;
            let started = Instant::now();
            let [true_class, found_class] = [&truth, &found].map(|words| {
                words.iter().map(|&word| class_of[(word & 0xffff) as usize]).collect::<Vec<u16>>()
            });
            scores.add(&found_class, &found, &true_class, &truth);
            score += started.elapsed().as_secs_f64() * 1e3;
            points += truth.len();
        }
        std::hint::black_box(&scores);
        (read_ms, score_ms) = (read_ms.min(read), score_ms.min(score));
    }
    let over = if read_ms + score_ms > GOAL_MS { "  over the goal" } else { "" };
    println!(
        "{name:<12} {points:>10} {read_ms:>8.1} {score_ms:>8.1} {:>8.1}{over}",
        score_ms / read_ms
    );
}
