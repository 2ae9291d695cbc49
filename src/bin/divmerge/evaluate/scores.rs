//! Scores as a table, and the problems that prevent them.

use anyhow::{Result, bail};
use divmerge::evaluate::{
    Hota, IdChanges, OcclusionCases, PanopticQuality, Scores, TrackingScores,
};
use divmerge::geometry::statistics::mean_and_deviation;

use crate::text::{counted, grouped};

/// Maximum number of problems to name.
const NAMED: usize = 10;

/// Refuses to score anything if there are problems, and names them.
pub fn refuse(mut problems: Vec<String>) -> Result<()> {
    let count = problems.len();
    if count == 0 {
        return Ok(());
    }
    let more = count.saturating_sub(NAMED);
    problems.truncate(NAMED);
    if more > 0 {
        problems.push(format!("and {more} more"));
    }
    let count = counted(count as u64, "problem");
    bail!("nothing scored, {count}:\n  {}", problems.join("\n  "))
}

/// Prints scores by class, their means, and what else was scored.
pub fn print(figures: &Scores) {
    println!("{}, {}", counted(figures.scans, "scan"), counted(figures.points, "point"));
    let report = &figures.report;
    println!("class            PQ     SQ     RQ    IoU     found  spurious  missed   (%)");
    for class in &report.classes {
        let quality = &class.quality;
        let [pq, sq, rq, iou] =
            [quality.pq, quality.sq, quality.rq, quality.iou].map(|figure| figure * 100.0);
        println!(
            "{:<14} {pq:>5.1}  {sq:>5.1}  {rq:>5.1}  {iou:>5.1}  {:>8}  {:>8}  {:>6}{}",
            class.name,
            quality.true_positives,
            quality.false_positives,
            quality.false_negatives,
            if class.true_points == 0 { "   not in the truth" } else { "" }
        );
    }
    let line = |name: &str, mean: &PanopticQuality| {
        let [pq, sq, rq, iou] = [mean.pq, mean.sq, mean.rq, mean.miou].map(|figure| figure * 100.0);
        println!("{name:<14} {pq:>5.1}  {sq:>5.1}  {rq:>5.1}  {iou:>5.1}");
    };
    line("things", &report.things);
    line("stuff", &report.stuff);
    line("all", &report.all);
    println!("PQ-dagger      {:>5.1}", report.pq_dagger * 100.0);
    if let Some(entropies) = &figures.entropy {
        let line = |name: &str, figures: Vec<f64>| {
            let (mean, deviation) = mean_and_deviation(&figures);
            println!("{name:<14} {mean:>5.1} +- {deviation:.1} nats per scan");
        };
        line("OSE", entropies.iter().map(|of| of.over).collect());
        line("USE", entropies.iter().map(|of| of.under).collect());
    }
    if let Some(lstq) = &figures.over_time {
        let [all, assoc, cls] = [lstq.lstq, lstq.s_assoc, lstq.s_cls].map(|figure| figure * 100.0);
        println!("LSTQ           {all:>5.1}   S_assoc {assoc:.1}   S_cls {cls:.1}");
        for class in &lstq.classes {
            let (assoc, tubes) = (class.s_assoc * 100.0, class.tubes);
            let objects = counted(tubes, "object");
            println!("  {:<12} {assoc:>5.1}   {objects} over time", class.name);
        }
    }
    if let Some(tracking) = &figures.tracking {
        print_tracking(tracking);
    }
}

fn print_tracking(tracking: &TrackingScores) {
    let Hota { hota, det_a, ass_a } = tracking.hota;
    let [hota, det_a, ass_a] = [hota, det_a, ass_a].map(|figure| figure * 100.0);
    println!("HOTA (points)  {hota:>5.1}   DetA {det_a:.1}   AssA {ass_a:.1}");
    let IdChanges { objects, found, switches, fragmentations } = tracking.id_changes;
    println!(
        "{} found of {}: {}, {}",
        grouped(found),
        counted(objects, "object"),
        match switches {
            1 => "1 id switch".to_owned(),
            _ => format!("{} id switches", grouped(switches)),
        },
        counted(fragmentations, "fragmentation"),
    );
    let OcclusionCases { cases, found, kept } = tracking.occlusions;
    println!(
        "{} of two seconds: {} found before and after, {} with the same id",
        counted(cases, "occlusion"),
        grouped(found),
        grouped(kept),
    );
}
