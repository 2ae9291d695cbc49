//! A network on what it can run on: tract, and ONNX Runtime where its library is found, in the same
//! run.
//!
//! `cargo bench --bench network` takes the small network of tests/data/network on a simulated
//! HDL-64E; `-- --model M.onnx --config F.yaml` another one, `--rounds N`, `--quick` for two
//! rounds. Figures are the fastest of the rounds, milliseconds for a cloud: from cloud to classes,
//! and for the clustering that follows. Then the ratio of the two, whether batches and threads
//! change anything, and how far the classes of the two agree.

use std::path::{Path, PathBuf};
use std::time::Instant;

use divmerge::cloud::PointClasses;
use divmerge::network::runtime::{Device, RuntimeKind, RuntimeOptions};
use divmerge::network::{Network, NetworkOptions};
use divmerge::pipeline::{self, Config};
use divmerge::range_image::ProjectionParams;
use divmerge::recording::stopwatch::ms_since;
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Scene, Sensor, SimulatedFrame};
use divmerge::{PointCloud, Taxonomy};

struct Arguments {
    model: PathBuf,
    config: Vec<PathBuf>,
    rounds: usize,
}

fn main() {
    let arguments = arguments();
    let drive = Drive::new(Sensor::Hdl64e, Scene::Street, 1);
    let clouds: Vec<PointCloud> = (0..4).map(|number| cloud(drive.frame(number))).collect();
    println!("{}, cloud to classes, ms, best of {} rounds\n", name(&arguments), arguments.rounds);
    println!(
        "| runtime | opening | network and neighbours | the same, 4 at once, each | clustering | \
         network / clustering |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    let kinds = [
        ("tract", RuntimeKind::Tract, 1),
        ("ONNX Runtime, 1 thread", RuntimeKind::OnnxRuntime, 1),
        ("ONNX Runtime", RuntimeKind::OnnxRuntime, 0),
    ];
    let measured: Vec<Option<(f64, PointClasses)>> = kinds
        .into_iter()
        .map(|(name, kind, threads)| measure(&arguments, &clouds, name, kind, threads))
        .collect();
    let [tract, single, all] = &measured[..] else { return };
    println!();
    if let (Some((_, one)), Some((_, other))) = (single, all) {
        let same = if one == other { "the same bits" } else { "other bits" };
        println!("ONNX Runtime on one thread and on all cores: {same}");
    }
    if let (Some((tract, found)), Some((single, _)), Some((all, other))) = (tract, single, all) {
        println!(
            "tract / ONNX Runtime: {:.2} on one thread, {:.2} on all cores",
            tract / single,
            tract / all
        );
        let alike = found.class.iter().zip(&other.class).filter(|(a, b)| a == b).count();
        let share = 100.0 * alike as f64 / found.class.len() as f64;
        println!("classes alike: {share:.4} % of {} points", found.class.len());
    } else {
        println!("(one of the two is not there: nothing to compare)");
    }
}

fn cloud(frame: SimulatedFrame) -> PointCloud {
    let cloud = frame.cloud.with(|columns| columns.remission = Some(frame.intensity));
    cloud.expect("one for each point")
}

/// Prints a row; milliseconds of a cloud and its classes, `None` where there is no such runtime.
fn measure(
    arguments: &Arguments,
    clouds: &[PointCloud],
    name: &str,
    kind: RuntimeKind,
    threads: usize,
) -> Option<(f64, PointClasses)> {
    let open = |batch| {
        Network::open(NetworkOptions {
            model: arguments.model.clone(),
            config: arguments.config.clone(),
            batch,
            runtime: RuntimeOptions {
                kind,
                threads,
                device: Device::Cpu,
                ..RuntimeOptions::default()
            },
            ..NetworkOptions::default()
        })
    };
    let started = Instant::now();
    let network = match open(1) {
        Ok(network) => network,
        Err(error) => {
            println!("| {name} | {error} | | | | |");
            return None;
        }
    };
    let opening = ms_since(started);
    let projection = ProjectionParams::default();
    let (one, found) = fastest(arguments.rounds, || network.classes(&clouds[0], &projection));
    let several = open(clouds.len()).ok().map(|network| {
        let clouds: Vec<&PointCloud> = clouds.iter().collect();
        let (all, together) =
            fastest(arguments.rounds, || network.classes_of(&clouds, &projection));
        assert_eq!(together[0], found, "a batch changes the classes");
        format!("{:.1}", all / clouds.len() as f64)
    });
    let taxonomy = network.taxonomy().cloned().unwrap_or_else(Taxonomy::semantic_kitti);
    let cloud = clouds[0].clone().with_classes(found.clone()).expect("one each");
    let config = Config::best();
    let (cut, _) = fastest(arguments.rounds, || {
        Ok(pipeline::run(&cloud, MaskSource::Classes(&taxonomy), &config))
    });
    let several = several.unwrap_or("-".into());
    println!("| {name} | {opening:.0} | {one:.1} | {several} | {cut:.1} | {:.1} |", one / cut);
    Some((one, found))
}

/// Milliseconds of the fastest round, and what came of the last.
fn fastest<T>(rounds: usize, mut run: impl FnMut() -> divmerge::Result<T>) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut last = None;
    for _ in 0..rounds {
        let started = Instant::now();
        last = Some(run().expect("a network that runs"));
        best = best.min(ms_since(started));
    }
    (best, last.expect("at least one round"))
}

fn name(arguments: &Arguments) -> String {
    arguments.model.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn arguments() -> Arguments {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/network");
    let mut arguments =
        Arguments { model: own.join("network.onnx"), config: Vec::new(), rounds: 10 };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--model" => arguments.model = words.next().expect("--model FILE").into(),
            "--config" => arguments.config.push(words.next().expect("--config FILE").into()),
            "--rounds" => {
                arguments.rounds = words.next().and_then(|n| n.parse().ok()).expect("--rounds N")
            }
            "--quick" => arguments.rounds = 2,
            _ => {}
        }
    }
    arguments
}
