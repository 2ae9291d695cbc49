//! Scores the three presets on a SemanticKITTI folder with its own classes as semantics:
//! `cargo run --release --example 02_score_semantic_kitti -- ../shared/data/semantickitti [SEQUENCE...]`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};
use divmerge::io::semantic_kitti::{read_labels, read_scan};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;

fn main() -> Result<()> {
    let root = std::env::args().nth(1).context("give the folder that holds `sequences`")?;
    let mut sequences = entries(&Path::new(&root).join("sequences"))?;
    sequences.retain(|sequence| sequence.join("labels").is_dir());
    let chosen: Vec<String> = std::env::args().skip(2).collect();
    sequences.retain(|s| chosen.is_empty() || chosen.iter().any(|name| s.ends_with(name)));
    for config in [Config::paper(), Config::authors(), Config::best()] {
        let mut all = scores();
        let mut ms = Vec::new();
        for sequence in &sequences {
            let mut scores = scores();
            for scan in entries(&sequence.join("velodyne"))? {
                let name = scan.with_extension("label");
                let label = sequence.join("labels").join(name.file_name().context("scan name")?);
                ms.push(score(&scan, &label, &config, &mut [&mut scores, &mut all])?);
            }
            let name = sequence.file_name().unwrap_or_default().to_string_lossy();
            println!("{:8} {name}  {}", config.preset, things(&scores));
        }
        ms.sort_by(f64::total_cmp);
        println!("{:8} all {} {:.1} ms median", config.preset, things(&all), ms[ms.len() / 2]);
    }
    Ok(())
}

fn scores() -> Panoptic {
    let taxonomy = Taxonomy::semantic_kitti();
    let classes = taxonomy.classes();
    Panoptic::new(classes.len(), |class| classes[class].is_ignored, MIN_POINTS)
}

/// Clusters one scan with its true classes and adds it to some scores; returns milliseconds.
fn score(scan: &Path, label: &Path, config: &Config, scores: &mut [&mut Panoptic]) -> Result<f64> {
    let words = read_labels(label)?;
    let cloud = read_scan(scan)?.with_class(words.iter().map(|&word| word as u16).collect())?;
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
    let present = |class: usize| {
        taxonomy.classes()[class].is_thing && scores.true_points(class) >= MIN_POINTS
    };
    let each = (0..taxonomy.classes().len()).filter(|&class| present(class)).map(|class| {
        let quality = scores.class(class);
        format!("{} {:.1}", taxonomy.classes()[class].name, quality.pq * 100.0)
    });
    let each: Vec<String> = each.collect();
    format!("PQ {:.2} ({})", scores.mean(present).pq * 100.0, each.join(", "))
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let list =
        std::fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    let mut paths = list.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}
