//! Coarse classes of instances against truth, as the Markdown tables of docs/results.md:
//! `cargo run --release --example 12_coarse_classes -- ../shared/data/semantickitti`
//!
//! 1. Instances of 10 points or more by what most of their points are, a row per true kind.
//! 2. The curves of `cluster/tree/calibration.rs` fitted to the labelled drives, and how far
//!    probabilities are off (expected calibration error) on drives that they were not fitted to.
//! 3. What probabilities say and how often they are right, in tenths.
//! 4. Boxes a frame from a probability on, and how many of the right ones are among them.
//!
//! A node is right if more than half of the points of its instance are of the class; points
//! without a label are of none. The folder holds SemanticKITTI sequences; without it only the
//! simulated drives are measured, and nothing is fitted.

use std::path::Path;

use anyhow::Result;
use divmerge::cloud::{Body, CoarseClass};
use divmerge::cluster::tree::calibration::{evidence, probability};
use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, read_scan};
use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{Instance, PointCloud};
use nalgebra::{Matrix2, Vector2};

/// Names of true kinds and SemanticKITTI's ids; the first three are of objects.
const KINDS: [(&str, &[u16]); 9] = [
    ("car, truck, bus", &[10, 13, 16, 18, 20, 252, 256, 257, 258, 259]),
    ("person", &[30, 254]),
    ("bicycle, rider", &[11, 15, 31, 32, 253, 255]),
    ("pole, sign", &[80, 81]),
    ("trunk", &[71]),
    ("building", &[50]),
    ("fence", &[51]),
    ("vegetation", &[70]),
    ("ground", &[40, 44, 48, 49, 60, 72]),
];

/// The true kind of a body. Cars and large vehicles are of one.
fn kind_of(body: Body) -> usize {
    match body {
        Body::Car | Body::LargeVehicle => 0,
        Body::Person => 1,
        Body::TwoWheeler => 2,
    }
}

/// An instance, and what is true of it.
struct Sample {
    class: CoarseClass,
    points: u32,
    /// What more than half of its points are.
    kind: Option<usize>,
    /// Of a node of the cut: what the probability is a function of.
    evidence: f64,
    probability: f64,
}

impl Sample {
    fn is_right(&self) -> bool {
        matches!(self.class, CoarseClass::Body(body) if self.kind == Some(kind_of(body)))
    }
}

/// The instances of a drive or of a simulated sensor.
struct Group {
    frames: usize,
    samples: Vec<Sample>,
}

fn main() -> Result<()> {
    let real = std::env::args().nth(1).map(|root| real(Path::new(&root))).transpose()?;
    let real = real.unwrap_or_default();
    let simulated = simulated();
    println!("Instances of 10 points or more, real drives:\n");
    print_kinds(&real);
    println!("Simulated drives:\n");
    print_kinds(&simulated);
    println!("Curves, and the expected calibration error in percent:\n");
    print_curves(&real, &simulated);
    println!("Probability: share of nodes that are right, % (nodes):\n");
    print_reliability(&real, &simulated);
    println!("Boxes from a probability on:\n");
    print_boxes(&real, &simulated);
    Ok(())
}

/// The labelled drives, a group each.
fn real(root: &Path) -> Result<Vec<Group>> {
    let mut groups = Vec::new();
    for drive in labelled_scans(root)?.chunk_by(|a, b| a.sequence == b.sequence) {
        let mut samples = Vec::new();
        for scan in drive {
            let words = read_labels(&scan.labels)?;
            let classes: Vec<u16> = words.into_iter().map(|word| word as u16).collect();
            samples.extend(of_cloud(&read_scan(&scan.scan)?, &classes));
        }
        groups.push(Group { frames: drive.len(), samples });
    }
    Ok(groups)
}

/// Every scene and two seeds for each sensor, a group each.
fn simulated() -> Vec<Group> {
    let of_sensor = |sensor: Sensor| {
        let scenes =
            Scene::USUAL.into_iter().flat_map(|scene| [101, 102].map(|seed| (scene, seed)));
        let frames: Vec<_> =
            scenes.map(|(scene, seed)| Drive::new(sensor, scene, seed).frame(20).cloud).collect();
        let classes = |cloud: &PointCloud| cloud.class.clone().unwrap_or_default();
        let samples = frames.iter().flat_map(|cloud| of_cloud(cloud, &classes(cloud))).collect();
        Group { frames: frames.len(), samples }
    };
    Sensor::USUAL.into_iter().map(of_sensor).collect()
}

fn of_cloud(cloud: &PointCloud, classes: &[u16]) -> Vec<Sample> {
    let ground = GroundParams::default();
    let stages = pipeline::run(cloud, MaskSource::NotGround(&ground), &Config::best());
    let mut points = vec![[0_u32; KINDS.len()]; stages.instances.len() + 1];
    for (&instance, class) in stages.labels.instance.iter().zip(classes) {
        if let Some(kind) = KINDS.iter().position(|(_, ids)| ids.contains(class)) {
            points[instance as usize][kind] += 1;
        }
    }
    let node = node_of_instance(&stages);
    let sample = |instance: &Instance| {
        let found = instance.coarse_class.as_ref()?;
        let tree = stages.post_merge.tree.as_ref()?;
        let score = node[instance.id as usize].and_then(|node| tree.scores[node as usize]);
        let smoothness = found.measures.smoothness();
        let is_most = |&count: &u32| 2 * count > instance.points;
        Some(Sample {
            class: found.class,
            points: instance.points,
            kind: points[instance.id as usize].iter().position(is_most),
            evidence: score.map_or(0.0, |score| evidence(&score, smoothness)),
            probability: score.map_or(0.0, |score| probability(&score, smoothness)),
        })
    };
    stages.instances.iter().filter_map(sample).collect()
}

/// The node of the cut that each instance is, instance k at k.
fn node_of_instance(stages: &Stages) -> Vec<Option<u32>> {
    let mut nodes = vec![None; stages.instances.len() + 1];
    let Some(tree) = &stages.post_merge.tree else { return nodes };
    for &node in &tree.cut.chosen {
        let object = tree.tree.pixels_of(&tree.tree.nodes[node as usize])[0] as usize;
        if let Some(point) = stages.image.point_at(stages.objects.pixel[object] as usize) {
            nodes[stages.labels.instance[point] as usize] = Some(node);
        }
    }
    nodes[0] = None;
    nodes
}

fn samples(groups: &[Group]) -> impl Iterator<Item = &Sample> + Clone {
    groups.iter().flat_map(|group| &group.samples)
}

fn nodes(groups: &[Group], body: Body) -> impl Iterator<Item = &Sample> + Clone {
    samples(groups).filter(move |sample| sample.class == CoarseClass::Body(body))
}

fn print_kinds(groups: &[Group]) {
    let mut counts = [[0_usize; CoarseClass::ALL.len()]; KINDS.len()];
    for sample in samples(groups).filter(|sample| sample.points >= 10) {
        let class = CoarseClass::ALL.iter().position(|&class| class == sample.class);
        if let (Some(kind), Some(class)) = (sample.kind, class) {
            counts[kind][class] += 1;
        }
    }
    let names = CoarseClass::ALL.map(CoarseClass::name);
    println!("| true | {} |\n| --- |{}", names.join(" | "), " ---: |".repeat(names.len()));
    for ((name, _), counts) in KINDS.iter().zip(counts) {
        println!("| {name} | {} |", counts.map(|count| count.to_string()).join(" | "));
    }
    println!();
}

fn print_curves(real: &[Group], simulated: &[Group]) {
    println!(
        "| body | nodes | right | no evidence | full evidence | as written | drives left out | \
         simulated drives | fitted to simulated, real drives |"
    );
    println!("| --- |{}", " ---: |".repeat(8));
    for body in Body::ALL {
        let all: Vec<&Sample> = nodes(real, body).collect();
        if all.is_empty() {
            continue;
        }
        let [offset, slope] = fit(nodes(real, body));
        let of_simulated = fit(nodes(simulated, body));
        let written = |sample: &Sample| sample.probability;
        let errors = [
            error(nodes(real, body).map(|sample| (written(sample), sample.is_right()))),
            error(left_out(real, body).into_iter()),
            error(nodes(simulated, body).map(|sample| (written(sample), sample.is_right()))),
            error(all.iter().map(|sample| (of(of_simulated, sample.evidence), sample.is_right()))),
        ];
        println!(
            "| {} | {} | {} | {offset:.3} | {:.3} | {} |",
            body.name(),
            all.len(),
            all.iter().filter(|sample| sample.is_right()).count(),
            offset + slope,
            errors.map(|error| format!("{:.1}", 100.0 * error)).join(" | ")
        );
    }
    println!();
}

/// What curves fitted to all other groups say of each node of a body, and whether it is right.
fn left_out(groups: &[Group], body: Body) -> Vec<(f64, bool)> {
    let mut found = Vec::new();
    for left in 0..groups.len() {
        let (before, after) = (&groups[..left], &groups[left + 1..]);
        let curve = fit(nodes(before, body).chain(nodes(after, body)));
        let own = nodes(&groups[left..=left], body);
        found.extend(own.map(|sample| (of(curve, sample.evidence), sample.is_right())));
    }
    found
}

/// The logistic curve through some nodes, offset and slope: the likeliest, by Newton's method, with
/// a slope that is near 0 where little speaks for one, and never below.
fn fit<'a>(nodes: impl Iterator<Item = &'a Sample> + Clone) -> [f64; 2] {
    const RIDGE: f64 = 0.1;
    const STEPS: usize = 40;
    let mut curve = Vector2::zeros();
    for _ in 0..STEPS {
        let (mut gradient, mut curvature) = (Vector2::zeros(), Matrix2::zeros());
        for sample in nodes.clone() {
            let x = Vector2::new(1.0, sample.evidence);
            let p = of(curve.into(), sample.evidence);
            gradient += (f64::from(u8::from(sample.is_right())) - p) * x;
            curvature += p * (1.0 - p) * x * x.transpose();
        }
        gradient[1] -= RIDGE * curve[1];
        curvature[(1, 1)] += RIDGE;
        curve += curvature.try_inverse().unwrap_or_default() * gradient;
    }
    if curve[1] < 0.0 {
        let right = nodes.clone().filter(|sample| sample.is_right()).count() as f64;
        let wrong = nodes.count() as f64 - right;
        return [(right / wrong).ln(), 0.0];
    }
    curve.into()
}

fn of([offset, slope]: [f64; 2], evidence: f64) -> f64 {
    1.0 / (1.0 + (-(offset + slope * evidence)).exp())
}

/// Nodes by probability, in tenths: how many, the sum of their probabilities, how many are right.
fn tenths(found: impl Iterator<Item = (f64, bool)>) -> [(usize, f64, usize); 10] {
    let mut tenths = [(0, 0.0, 0); 10];
    for (probability, is_right) in found {
        let (nodes, sum, right) = &mut tenths[((probability * 10.0) as usize).min(9)];
        (*nodes, *sum) = (*nodes + 1, *sum + probability);
        *right += usize::from(is_right);
    }
    tenths
}

/// Expected calibration error: mean distance of probability and share of right ones over the nodes.
fn error(found: impl Iterator<Item = (f64, bool)>) -> f64 {
    let tenths = tenths(found);
    let nodes: usize = tenths.iter().map(|(nodes, ..)| nodes).sum();
    tenths.iter().map(|&(_, sum, right)| (sum - right as f64).abs()).sum::<f64>() / nodes as f64
}

fn objects(groups: &[Group]) -> impl Iterator<Item = &Sample> {
    samples(groups).filter(|sample| sample.class.is_object())
}

fn print_reliability(real: &[Group], simulated: &[Group]) {
    println!("| probability | real drives | simulated drives |\n| --- | ---: | ---: |");
    let of = |groups| tenths(objects(groups).map(|node| (node.probability, node.is_right())));
    for (tenth, (real, simulated)) in of(real).into_iter().zip(of(simulated)).enumerate() {
        let cell = |(nodes, _, right): (usize, f64, usize)| match nodes {
            0 => "none".to_owned(),
            nodes => format!("{:.1} ({nodes})", 100.0 * right as f64 / nodes as f64),
        };
        let [from, to] = [tenth, tenth + 1].map(|tenth| 10 * tenth);
        println!("| {from} to {to} % | {} | {} |", cell(real), cell(simulated));
    }
    println!();
}

fn print_boxes(real: &[Group], simulated: &[Group]) {
    println!("| from | real: boxes a frame | right ones | simulated: boxes a frame | right ones |");
    println!("| --- |{}", " ---: |".repeat(4));
    for least in [0.0, 0.02, 0.05, 0.1, 0.2, 0.5] {
        let cells = [real, simulated].map(|groups| {
            let frames: usize = groups.iter().map(|group| group.frames).sum();
            let seen: Vec<_> = objects(groups).filter(|node| node.probability >= least).collect();
            let right = seen.iter().filter(|node| node.is_right()).count();
            let all = objects(groups).filter(|node| node.is_right()).count();
            format!("{:.1} | {right} of {all}", seen.len() as f64 / frames as f64)
        });
        println!("| {:.0} % | {} |", 100.0 * least, cells.join(" | "));
    }
}
