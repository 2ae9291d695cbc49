//! Scores as a table, and the problems that prevent them.

use anyhow::{Result, bail};

use crate::cli::text::{counted, grouped};
use crate::evaluate::over_time::ClassAssociation;
use crate::evaluate::panoptic::MIN_POINTS;
use crate::evaluate::{
    Entropies, Hota, IdChanges, ObjectScores, OcclusionCases, PanopticQuality, PanopticReport,
    Scores, TrackingScores,
};
use crate::geometry::statistics::mean_and_deviation;

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
    figures.report.iter().for_each(print_panoptic);
    figures.objects.iter().for_each(print_objects);
    match &figures.entropy {
        Some(entropies) => print_entropies(entropies),
        None if figures.objects.is_some() => {
            println!("OSE, USE       need the scans: --entropy, with sequences/NN/velodyne/*.bin");
        }
        None => {}
    }
    if let Some(lstq) = &figures.over_time {
        let [all, assoc, cls] = [lstq.lstq, lstq.s_assoc, lstq.s_cls].map(|figure| figure * 100.0);
        println!("LSTQ           {all:>5.1}   S_assoc {assoc:.1}   S_cls {cls:.1}");
        print_associations(&lstq.classes);
    }
    if let Some(association) = &figures.association {
        println!("S_assoc        {:>5.1}   over time", association.s_assoc * 100.0);
        print_associations(&association.classes);
    }
    if let Some(tracking) = &figures.tracking {
        print_tracking(tracking);
    }
}

fn print_panoptic(report: &PanopticReport) {
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
    let (things, all) = (report.things_count(), report.classes.len());
    println!("mean over the {} of the benchmark, absent ones 0", classes(all));
    line("things", &report.things);
    line("stuff", &report.stuff);
    line("all", &report.all);
    println!("PQ-dagger      {:>5.1}", report.pq_dagger * 100.0);
    let present = &report.present;
    let (own_things, own_stuff) = (present.thing_count, present.stuff_count);
    if (own_things, own_stuff) == (things, all - things) {
        return;
    }
    let own = own_things + own_stuff;
    println!("mean over the {} present ({MIN_POINTS} points of truth or more)", classes(own));
    for (name, count, mean) in [
        ("things", own_things, &present.things),
        ("stuff", own_stuff, &present.stuff),
        ("all", own, &present.all),
    ] {
        if count > 0 {
            line(name, mean);
        }
    }
}

fn classes(count: usize) -> String {
    if count == 1 { "1 class".to_owned() } else { format!("{count} classes") }
}

/// Prints how well objects were found without classes.
fn print_objects(scores: &ObjectScores) {
    println!("no classes were found: objects are scored without them   (%)");
    let line = |name: &str, share: Option<f64>, about: &str| {
        let share = share.map_or("-".to_owned(), |share| format!("{:.1}", share * 100.0));
        println!("{name:<14} {share:>5}   {about}");
    };
    let things =
        format!("of {}: an instance with an IoU above 0.5", counted(scores.things, "thing"));
    line("found whole", scores.found_whole, &things);
    line("mean IoU", scores.mean_iou, "of each thing with its best instance");
    line("S_assoc", scores.s_assoc, "of each thing with all of its instances");
    line("precision", scores.precision, "of instances on things, at IoU 0.5");
    line("recall", scores.recall, "of things, at IoU 0.5");
}

fn print_entropies(entropies: &[Entropies]) {
    let line = |name: &str, figures: Vec<f64>| {
        let (mean, deviation) = mean_and_deviation(&figures);
        println!("{name:<14} {mean:>5.1} +- {deviation:.1} nats per scan");
    };
    line("OSE", entropies.iter().map(|of| of.over).collect());
    line("USE", entropies.iter().map(|of| of.under).collect());
}

fn print_associations(classes: &[ClassAssociation]) {
    for class in classes {
        let (assoc, tubes) = (class.s_assoc * 100.0, class.tubes);
        let objects = counted(tubes, "object");
        println!("  {:<12} {assoc:>5.1}   {objects} over time", class.name);
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
