//! Scores the three presets on a SemanticKITTI folder with its own classes as semantics: `cargo run
//! --release --example 02_score_semantic_kitti -- ../shared/data/semantickitti [SEQUENCE...]`

use std::path::Path;

use anyhow::{Context, Result};
use divmerge::Taxonomy;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;

fn main() -> Result<()> {
    let root = std::env::args().nth(1).context("give the folder that holds `sequences`")?;
    let mut scans = labelled_scans(Path::new(&root))?;
    let chosen: Vec<String> = std::env::args().skip(2).collect();
    scans.retain(|scan| chosen.is_empty() || chosen.contains(&scan.sequence));
    for config in [Config::paper(), Config::authors(), Config::best()] {
        let mut all = scores();
        let mut ms = Vec::new();
        for sequence in scans.chunk_by(|a, b| a.sequence == b.sequence) {
            let mut own = scores();
            for scan in sequence {
                ms.push(score(scan, &config, &mut [&mut own, &mut all])?);
            }
            println!("{:8} {}  {}", config.preset, sequence[0].sequence, things(&own));
        }
        ms.sort_by(f64::total_cmp);
        let median = ms.get(ms.len() / 2).copied().unwrap_or(0.0);
        println!("{:8} all {} {median:.1} ms median", config.preset, things(&all));
    }
    Ok(())
}

fn scores() -> Panoptic {
    Panoptic::of(&Taxonomy::semantic_kitti(), MIN_POINTS)
}

/// Clusters one scan with its true classes and adds it to some scores; returns milliseconds.
fn score(scan: &LabelledScan, config: &Config, scores: &mut [&mut Panoptic]) -> Result<f64> {
    let words = read_labels(&scan.labels)?;
    let cloud =
        read_scan(&scan.scan)?.with_class(words.iter().map(|&word| word as u16).collect())?;
    let taxonomy = Taxonomy::semantic_kitti();
    let stages = pipeline::run(&cloud, MaskSource::Classes(&taxonomy), config);
    let class_of = taxonomy.lookup();
    let classes = |raw: &[u16]| raw.iter().map(|&id| class_of[id as usize]).collect::<Vec<_>>();
    let true_class = classes(&words.iter().map(|&word| word as u16).collect::<Vec<_>>());
    for scores in scores {
        let predicted_class = classes(&stages.labels.semantic);
        // Stuff is one segment per class and label word.
        let stuff = |class: u16| !taxonomy.classes()[class as usize].is_thing;
        let id = |(point, &instance): (usize, &u32)| {
            if stuff(predicted_class[point]) { words[point] } else { instance }
        };
        let predicted_id: Vec<u32> = stages.labels.instance.iter().enumerate().map(id).collect();
        scores.add(&predicted_class, &predicted_id, &true_class, &words);
    }
    Ok(stages.times.total_ms())
}

/// Mean PQ over the thing classes that truth has with 50 points or more, and each of them.
fn things(scores: &Panoptic) -> String {
    let taxonomy = Taxonomy::semantic_kitti();
    let present = |class: usize| scores.is_thing_present(&taxonomy, class);
    let each = (0..taxonomy.classes().len()).filter(|&class| present(class)).map(|class| {
        let quality = scores.class(class);
        format!("{} {:.1}", taxonomy.classes()[class].name, quality.pq * 100.0)
    });
    let each: Vec<String> = each.collect();
    format!("PQ {:.2} ({})", scores.mean(present).pq * 100.0, each.join(", "))
}
