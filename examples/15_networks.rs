//! What is found with the classes of a network by each method, and where the rest is lost, as the
//! tables of docs/results.md (Table I of the paper, with other networks):
//!
//! ```sh
//! cargo run --release --example 15_networks -- \
//!     ../shared/data/semantickitti/predictions/3d-mininet-tiny
//! ```
//!
//! The folder holds `sequences/NN/predictions`, beside the scans and labels of SemanticKITTI two
//! folders above. Without it, simulated drives with the classes that the project's small network
//! finds in them; that takes ONNX Runtime.
//!
//! Panoptic quality of things, mean over the classes of which the truth has 50 points and more.
//! *Lost to false points* is what the method would gain if no point outside true things were called
//! a thing; *lost to the cut* what a cut of these points along true things would gain on top, with
//! the class that most points of each have. What such a cut misses is lost to the network.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use divmerge::comparison::methods;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};
use divmerge::geometry::statistics::most_frequent;
use divmerge::network::{Network, NetworkOptions};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{GroundParams, PointCloud, Taxonomy};

/// A cloud with the classes of a network, and the truth.
struct Frame {
    group: String,
    cloud: PointCloud,
    /// N: raw class.
    true_class: Vec<u16>,
    /// N: segment.
    true_id: Vec<u32>,
}

fn main() -> Result<()> {
    let frames = match std::env::args().nth(1) {
        Some(folder) => labelled(Path::new(&folder))?,
        None => simulated()?,
    };
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    println!(
        "| method | {} | mean | all together | lost to false points | lost to the cut |",
        groups.join(" | ")
    );
    println!("| --- |{}", " ---: |".repeat(groups.len() + 4));
    let without_false: Vec<Frame> = frames.iter().map(without_false_points).collect();
    let perfect = together(&without_false, oracle_cut);
    for (name, config) in contenders() {
        let run = |frame: &Frame| cut_by(frame, &config);
        let found = together(&frames, run);
        let without_false = together(&without_false, run);
        let lost = [without_false - found, perfect - without_false];
        println!("{}", row(name, &groups, &frames, &run, &lost.map(|lost| format!("{lost:.2}"))));
    }
    let none = ["-", "-"].map(str::to_owned);
    let name = "no false points, cut along true things";
    println!("{}", row(name, &groups, &without_false, &oracle_cut, &none));
    println!("\nLost to the network: {:.2}", 100.0 - perfect);
    Ok(())
}

fn contenders() -> Vec<(&'static str, Config)> {
    let taxonomy = Taxonomy::semantic_kitti();
    let by = |name: &str| methods::named(name, &taxonomy);
    let as_given = Config { smoothing: None, bleed: None, segment_vote: None, ..Config::best() };
    let other = |name: &str| Config { other_method: by(name), ..Config::best() };
    let other_as_given = |name: &str| Config { other_method: by(name), ..as_given.clone() };
    vec![
        ("`best`", Config::best()),
        ("`best` without votes of segments", Config { segment_vote: None, ..Config::best() }),
        ("`best`, classes as they are", as_given.clone()),
        ("ALPINE on the objects of `best`", other("alpine")),
        ("ALPINE, classes as they are", other_as_given("alpine")),
        ("scan line run on the objects of `best`", other("scan-line-run")),
        ("scan line run, classes as they are", other_as_given("scan-line-run")),
        ("Euclidean clusters on the objects of `best`", other("euclidean")),
        ("Euclidean clusters, classes as they are", other_as_given("euclidean")),
        ("`paper`", Config::paper()),
        ("`authors`", Config::authors()),
    ]
}

/// A raw class and an instance for each point.
type Labels = (Vec<u16>, Vec<u32>);

fn cut_by(frame: &Frame, config: &Config) -> Labels {
    let (taxonomy, ground) = (Taxonomy::semantic_kitti(), GroundParams::default());
    let mask = MaskSource::NetworkClasses(&taxonomy, &ground);
    let labels = pipeline::run(&frame.cloud, mask, config).labels;
    (labels.semantic, labels.instance)
}

/// The points that are called things, cut along true things.
fn oracle_cut(frame: &Frame) -> Labels {
    let taxonomy = Taxonomy::semantic_kitti();
    let class_of = taxonomy.lookup();
    let is_thing = |raw: u16| taxonomy.classes()[usize::from(class_of[usize::from(raw)])].is_thing;
    let mut class = given(frame);
    let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (point, (&given, &truth)) in class.iter().zip(&frame.true_class).enumerate() {
        if is_thing(given) && is_thing(truth) {
            members.entry(frame.true_id[point]).or_default().push(point);
        }
    }
    let mut instance = vec![0; class.len()];
    for (id, points) in (1..).zip(members.values()) {
        let most = most_frequent(points.iter().map(|&point| class[point])).unwrap_or(0);
        for &point in points {
            (class[point], instance[point]) = (most, id);
        }
    }
    (class, instance)
}

fn given(frame: &Frame) -> Vec<u16> {
    frame.cloud.class.clone().unwrap_or_default()
}

/// The same with the true class of every point that is falsely called a thing.
fn without_false_points(frame: &Frame) -> Frame {
    let taxonomy = Taxonomy::semantic_kitti();
    let class_of = taxonomy.lookup();
    let is_thing = |raw: u16| taxonomy.classes()[usize::from(class_of[usize::from(raw)])].is_thing;
    let class = given(frame).into_iter().zip(&frame.true_class);
    let class = class.map(|(given, &truth)| if is_thing(truth) { given } else { truth }).collect();
    Frame {
        group: frame.group.clone(),
        cloud: frame.cloud.clone().with_class(class).expect("a class for each point"),
        true_class: frame.true_class.clone(),
        true_id: frame.true_id.clone(),
    }
}

fn row(
    name: &str,
    groups: &[&str],
    frames: &[Frame],
    run: &dyn Fn(&Frame) -> Labels,
    lost: &[String],
) -> String {
    let of_group = |group: &&str| things(frames.iter().filter(|frame| frame.group == *group), run);
    let by_group: Vec<f64> = groups.iter().map(of_group).collect();
    let mean = by_group.iter().sum::<f64>() / by_group.len() as f64;
    let numbers = by_group.iter().copied().chain([mean, things(frames.iter(), run)]);
    let cells = numbers.map(|number| format!("{number:.2}")).chain(lost.iter().cloned());
    format!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "))
}

fn together(frames: &[Frame], run: impl Fn(&Frame) -> Labels) -> f64 {
    things(frames.iter(), &run)
}

/// Mean PQ of the things that occur, percent.
fn things<'a>(frames: impl Iterator<Item = &'a Frame>, run: &dyn Fn(&Frame) -> Labels) -> f64 {
    let taxonomy = Taxonomy::semantic_kitti();
    let mut scores = Panoptic::of(&taxonomy, MIN_POINTS);
    for frame in frames {
        let (class, instance) = run(frame);
        let [found, truth] = [&class, &frame.true_class].map(|raw| taxonomy.class_numbers(raw));
        scores.add(&found, &instance, &truth, &frame.true_id);
    }
    scores.mean(|class| scores.is_thing_present(&taxonomy, class)).pq * 100.0
}

fn labelled(folder: &Path) -> Result<Vec<Frame>> {
    let root = folder.ancestors().nth(2).context("the folder stands in none with scans")?;
    let frame = |labelled: LabelledScan| {
        let true_id = read_labels(&labelled.labels)?;
        let name = labelled.labels.file_name().context("a label file has a name")?;
        let predictions = folder.join("sequences").join(&labelled.sequence).join("predictions");
        let given = read_labels(&predictions.join(name))?;
        let classes = given.iter().map(|&word| word as u16).collect();
        Ok(Frame {
            group: labelled.sequence,
            cloud: read_scan(&labelled.scan)?.with_class(classes)?,
            true_class: true_id.iter().map(|&word| word as u16).collect(),
            true_id,
        })
    };
    labelled_scans(root)?.into_iter().map(frame).collect()
}

/// Three sensors, six scenes, four clouds each.
fn simulated() -> Result<Vec<Frame>> {
    let model = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/network/network.onnx");
    let network = Network::open(NetworkOptions { model, ..NetworkOptions::default() })?;
    let mut frames = Vec::new();
    for sensor in [Sensor::Hdl64e, Sensor::Vlp16, Sensor::Os1_128] {
        for scene in [Scene::Street, Scene::Crowd, Scene::Parking, Scene::Hills, Scene::Yard] {
            let drive = Drive::new(sensor, scene, 7);
            for number in 0..4 {
                let frame = drive.frame(10 * number);
                let true_class = frame.cloud.class.clone().unwrap_or_default();
                let remission = Some(frame.intensity);
                let cloud = frame.cloud.with(|columns| columns.remission = remission)?;
                let classes = network.classes(&cloud, &Config::best().projection)?;
                frames.push(Frame {
                    group: sensor.to_string(),
                    cloud: cloud.with_classes(classes)?,
                    true_class,
                    true_id: frame.true_instance.iter().map(|&id| u32::from(id)).collect(),
                });
            }
        }
    }
    Ok(frames)
}
