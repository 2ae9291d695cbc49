//! How much better than chance triage finds failures: precision among the most suspect instances
//! and frames against truth that triage does not see.
//!
//! ```sh
//! # Simulated drives that no weight was fitted to.
//! cargo run --release --example 08_triage
//! cargo run --release --example 08_triage -- --fitted      # those that they were rounded from
//! # Labelled scans in SemanticKITTI's folders.
//! cargo run --release --example 08_triage -- ROOT
//! ```
//!
//! What is ranked is instances, each once, as `divmerge triage` lists them
//! ([`divmerge::diagnose::triage::Triage::cases`]; what is no case of its own comes last); chance
//! draws from the same instances, so that its precision is their share of failures, which is exact.
//! Two populations: instances of 50 points or more, of which alone evaluation could count a
//! failure, and all.
//!
//! An instance is in a failure if `evaluate::verdict` says so of itself, or of a true object that
//! has more points in it than anywhere else (the second of two cars in one instance, say, where the
//! first is matched).

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;
use divmerge::diagnose::explain::ClusteredCloud;
use divmerge::diagnose::triage::{Suspect, SuspectKind, TriageParams, triage};
use divmerge::evaluate::verdict::{Labelling, MatchRules, verdicts};
use divmerge::frames::{LabelledFrames, LabelledOptions, Truth};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

const FITTED: std::ops::RangeInclusive<u64> = 1..=6;
const OTHERS: std::ops::RangeInclusive<u64> = 11..=18;
/// Frames of a drive, two seconds apart.
const FRAMES: [usize; 2] = [10, 30];

/// An instance, how suspect it is and whether it is in a failure.
struct Case {
    group: String,
    frame: usize,
    points: u64,
    /// As triage has it.
    said: f64,
    /// The same if it is a case of its own, else 0.
    score: f64,
    is_failure: bool,
    /// The strongest suspect of each kind that names it, by what falls on the instance.
    by_kind: BTreeMap<SuspectKind, f64>,
}

/// A frame, how suspect it is and how many failures it has.
struct Scored {
    score: f64,
    failures: usize,
    instances: usize,
}

/// Everything that one preset comes to.
struct Bench {
    config: Config,
    taxonomy: Taxonomy,
    class_of: Vec<u16>,
    cases: Vec<Case>,
    frames: Vec<Scored>,
}

fn main() -> Result<()> {
    let argument = std::env::args().nth(1);
    for config in [Config::best(), Config::paper()] {
        let taxonomy = Taxonomy::semantic_kitti();
        let class_of = taxonomy.lookup();
        let mut bench = Bench { config, taxonomy, class_of, cases: vec![], frames: vec![] };
        match argument.as_deref() {
            None => simulated(&mut bench, OTHERS),
            Some("--fitted") => simulated(&mut bench, FITTED),
            Some(root) => real(&mut bench, root)?,
        }
        bench.print();
    }
    Ok(())
}

fn simulated(bench: &mut Bench, seeds: std::ops::RangeInclusive<u64>) {
    for scene in Scene::USUAL {
        for sensor in Sensor::ALL {
            for drive in seeds.clone().map(|seed| Drive::new(sensor, scene, seed)) {
                for frame in FRAMES.map(|number| drive.frame(number)) {
                    let class = frame.cloud.class.clone().unwrap_or_default();
                    let class: Vec<u32> = class.into_iter().map(u32::from).collect();
                    let id: Vec<u32> = frame.true_instance.into_iter().map(u32::from).collect();
                    bench.add(&scene.to_string(), &frame.cloud, &Truth::of_columns(&class, &id));
                }
            }
        }
    }
}

fn real(bench: &mut Bench, root: &str) -> Result<()> {
    for frame in LabelledFrames::open(root.as_ref(), LabelledOptions::default())? {
        let frame = frame?;
        bench.add(&format!("drive {}", frame.source), &frame.cloud, &frame.truth);
    }
    Ok(())
}

impl Bench {
    fn add(&mut self, group: &str, cloud: &PointCloud, truth: &Truth) {
        let mask = MaskSource::Classes(&self.taxonomy);
        let stages = pipeline::run(cloud, mask, &self.config);
        let frame = ClusteredCloud { cloud, mask, config: &self.config, stages: &stages };
        let found = triage(&frame, &TriageParams::default());
        let failed = self.failed(cloud, truth, &frame);
        let named = strongest(&found.suspects);
        let number = self.frames.len();
        let cases = found.cases();
        let listed = cases.iter().filter_map(|case| Some((case.instance?, case.score)));
        let listed: BTreeMap<u32, f64> = listed.collect();
        let cases = stages.instances.iter().zip(&found.instances).map(|(instance, &said)| Case {
            said,
            group: group.to_owned(),
            frame: number,
            points: u64::from(instance.points),
            score: listed.get(&instance.id).copied().unwrap_or(0.0),
            is_failure: failed.contains(&instance.id),
            by_kind: named.get(&instance.id).cloned().unwrap_or_default(),
        });
        self.cases.extend(cases);
        self.frames.push(Scored {
            score: found.score,
            failures: failed.len(),
            instances: stages.instances.len(),
        });
    }

    /// The instances in a failure.
    fn failed(&self, cloud: &PointCloud, truth: &Truth, frame: &ClusteredCloud) -> BTreeSet<u32> {
        let classes = |raw: &[u16]| -> Vec<u16> {
            raw.iter().map(|&id| self.class_of[usize::from(id)]).collect()
        };
        let labels = &frame.stages.labels;
        let (true_class, class) = (classes(&truth.class), classes(&labels.semantic));
        let verdicts = verdicts(
            cloud,
            Labelling { class: &true_class, id: &truth.id },
            Labelling { class: &class, id: &labels.instance },
            &self.taxonomy,
            MatchRules { min_points: TriageParams::default().min_points, by_class: true },
        );
        let own = verdicts.found.iter().filter(|judged| judged.is_failure());
        let holding = verdicts.truth.iter().filter(|judged| judged.is_failure());
        let holding = holding.filter_map(|judged| judged.parts.first());
        own.map(|judged| judged.object.id).chain(holding.map(|part| part.object.id)).collect()
    }

    fn print(&self) {
        let preset = self.config.preset;
        let failures = self.cases.iter().filter(|case| case.is_failure).count();
        println!(
            "## `{preset}`: {} frames, {} instances, {failures} in failures\n",
            self.frames.len(),
            self.cases.len()
        );
        self.print_ranking("instances of 50 points or more", TriageParams::default().min_points);
        self.print_ranking("all instances", 0);
        self.print_kinds();
        self.print_calibration();
        self.print_frames();
    }

    fn print_ranking(&self, title: &str, min_points: u64) {
        println!(
            "| {title} | instances | in failures | chance, % | precision at 20, % | times chance | \
             at 100, % | recall at 20, % | at 100, % |"
        );
        println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
        let counted = || self.cases.iter().filter(|case| case.points >= min_points);
        let groups: BTreeSet<&str> = counted().map(|case| case.group.as_str()).collect();
        for group in groups {
            print_row(group, counted().filter(|case| case.group == group).collect());
        }
        print_row("all", counted().collect());
        println!();
    }

    /// Each kind alone, and what it has in the most suspect 100.
    fn print_kinds(&self) {
        println!(
            "| kind | instances named | in failures, % | precision at 20 alone, % | first in the \
             top 100 | of these in failures |"
        );
        println!("| --- | ---: | ---: | ---: | ---: | ---: |");
        let top = ranked(self.cases.iter().collect(), |case| case.score);
        let first = |case: &&&Case| {
            let most = case.by_kind.iter().max_by(|a, b| a.1.total_cmp(b.1));
            most.map(|(&kind, _)| kind)
        };
        for kind in SuspectKind::ALL {
            let of = |case: &Case| case.by_kind.get(&kind).copied().unwrap_or(0.0);
            let named: Vec<&Case> = self.cases.iter().filter(|case| of(case) > 0.0).collect();
            let hits = failures(&named);
            let alone = ranked(named.clone(), of);
            let carried: Vec<&Case> =
                top.iter().take(100).filter(|case| first(case) == Some(kind)).copied().collect();
            println!(
                "| {} | {} | {} | {} | {} | {} |",
                kind.name(),
                named.len(),
                percent(hits, named.len()),
                percent(failures(&alone[..alone.len().min(20)]), alone.len().min(20)),
                carried.len(),
                failures(&carried)
            );
        }
        println!();
    }

    /// What is found where a score is said.
    fn print_calibration(&self) {
        println!("| said, % | instances | said on average, % | found, % |");
        println!("| --- | ---: | ---: | ---: |");
        for bin in 0..10 {
            let (low, high) = (f64::from(bin) / 10.0, f64::from(bin + 1) / 10.0);
            let is_in = |case: &&Case| case.said > low && case.said <= high;
            let inside: Vec<&Case> = self.cases.iter().filter(is_in).collect();
            if inside.is_empty() {
                continue;
            }
            let said = inside.iter().map(|case| case.said).sum::<f64>() / inside.len() as f64;
            println!(
                "| {:.0} to {:.0} | {} | {:.1} | {} |",
                100.0 * low,
                100.0 * high,
                inside.len(),
                100.0 * said,
                percent(failures(&inside), inside.len())
            );
        }
        println!();
    }

    /// Frames with a failure among the most suspect frames.
    fn print_frames(&self) {
        let mut frames: Vec<&Scored> = self.frames.iter().collect();
        let with = |frames: &[&Scored]| frames.iter().filter(|frame| frame.failures > 0).count();
        let all = with(&frames);
        frames.sort_by(|a, b| b.score.total_cmp(&a.score));
        let top = &frames[..frames.len().min(20)];
        let by_size = {
            let mut frames = frames.clone();
            frames.sort_by_key(|frame| std::cmp::Reverse(frame.instances));
            with(&frames[..frames.len().min(20)])
        };
        let sum = |frames: &[&Scored]| frames.iter().map(|frame| frame.failures).sum::<usize>();
        println!(
            "Frames with a failure: {} % of {}; {} % of the 20 most suspect, {} % of the 20 with \
             most instances. \
             Failures in a frame: {:.2} on average, {:.2} in the 20 most suspect.\n",
            percent(all, frames.len()),
            frames.len(),
            percent(with(top), top.len()),
            percent(by_size, top.len()),
            sum(&frames) as f64 / frames.len() as f64,
            sum(top) as f64 / top.len() as f64
        );
    }
}

/// For each instance that is named, by kind the most of a score that falls on it.
fn strongest(suspects: &[Suspect]) -> BTreeMap<u32, BTreeMap<SuspectKind, f64>> {
    let mut named: BTreeMap<u32, BTreeMap<SuspectKind, f64>> = BTreeMap::new();
    for suspect in suspects {
        for concern in &suspect.concerns {
            let kinds = named.entry(concern.instance).or_default();
            let most = kinds.entry(suspect.kind).or_default();
            *most = most.max(suspect.score * concern.share);
        }
    }
    named
}

/// The highest first; ties in the order of the frames.
fn ranked(mut cases: Vec<&Case>, score: impl Fn(&Case) -> f64) -> Vec<&Case> {
    cases.sort_by(|a, b| score(b).total_cmp(&score(a)).then(a.frame.cmp(&b.frame)));
    cases
}

fn failures(cases: &[&Case]) -> usize {
    cases.iter().filter(|case| case.is_failure).count()
}

fn print_row(name: &str, cases: Vec<&Case>) {
    let (all, count) = (failures(&cases), cases.len());
    let ranked = ranked(cases, |case| case.score);
    let hits = |n: usize| failures(&ranked[..n.min(count)]);
    let chance = all as f64 / count as f64;
    let times = match all {
        0 => "-".to_owned(),
        _ => format!("{:.1}", hits(20) as f64 / count.min(20) as f64 / chance),
    };
    println!(
        "| {name} | {count} | {all} | {} | {} | {times} | {} | {} | {} |",
        percent(all, count),
        percent(hits(20), count.min(20)),
        percent(hits(100), count.min(100)),
        percent(hits(20), all),
        percent(hits(100), all)
    );
}

fn percent(part: usize, of: usize) -> String {
    if of == 0 { "-".to_owned() } else { format!("{:.1}", 100.0 * part as f64 / of as f64) }
}
