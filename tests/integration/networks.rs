//! Classes from networks: good ones, bad ones, and through whole recordings.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, AnnotationReport, RunEvent, Semantics, annotate,
};
use divmerge::network::runtime::{HAS_TRACT, has_onnx_runtime};
use divmerge::network::{Network, NetworkImage, NetworkOptions};
use divmerge::range_image::ProjectionParams;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, PointColumns, Result};

use crate::cli::{divmerge, path, text};
use crate::onnx::Linear;
use crate::recordings::drive;
use crate::skip::skip_or_fail;

/// Three classes: none, road and car. Means are 0 and deviations 1, so the channels are metres.
const CONFIG: &str = "
dataset:
  sensor:
    fov_up: 3
    fov_down: -25
    img_prop: {width: 512, height: 32}
    img_means: [0, 0, 0, 0, 0]
    img_stds: [1, 1, 1, 1, 1]
labels: {0: unlabeled, 10: car, 40: road}
learning_map: {0: 0, 10: 2, 40: 1}
learning_map_inv: {0: 0, 1: 40, 2: 10}
";

/// What lies higher than a metre below the sensor is a car: score = 4 (z + 1).
fn by_height() -> Linear {
    let car = vec![0.0, 0.0, 0.0, 4.0, 0.0];
    Linear {
        input: [0, 5, 0, 0],
        weights: vec![vec![0.0; 5], vec![0.0; 5], car],
        bias: vec![-50.0, 0.0, 4.0],
        is_flat: false,
    }
}

/// A model and its configuration in a folder.
fn files(folder: &Path, model: &Linear, config: &str) -> PathBuf {
    let path = folder.join("model.onnx");
    model.write(&path);
    std::fs::write(path.with_extension("yaml"), config).expect("a file");
    path
}

fn options(model: PathBuf) -> NetworkOptions {
    NetworkOptions { model, ..NetworkOptions::default() }
}

/// Whether there is something to run networks on.
fn can_run() -> bool {
    let can = HAS_TRACT || has_onnx_runtime();
    if !can {
        skip_or_fail("neither ONNX Runtime (pip install onnxruntime) nor the feature tract");
    }
    can
}

fn cloud(sensor: Sensor) -> PointCloud {
    let frame = Drive::new(sensor, Scene::Street, 3).frame(0);
    let change = |columns: &mut PointColumns| {
        (columns.remission, columns.class) = (Some(frame.intensity), None);
    };
    frame.cloud.with(change).expect("one for each point")
}

/// The trained network of tests/data.
fn trained() -> NetworkOptions {
    options(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/network/network.onnx"))
}

fn run(input: &Path, name: &str, options: &AnnotateOptions) -> Result<(PathBuf, AnnotationReport)> {
    let output = input.with_file_name(name);
    let report = annotate(input, &output, options, &mut |_: RunEvent| ControlFlow::Continue(()))?;
    Ok((output, report))
}

fn by_network(options: NetworkOptions) -> AnnotateConfig {
    let network = Network::open(options).expect("a network");
    let taxonomy = network.taxonomy().expect("labels").clone();
    AnnotateConfig {
        semantics: Semantics::Network(Arc::new(network)),
        taxonomy,
        ..AnnotateConfig::default()
    }
}

#[test]
fn points_have_the_class_of_their_pixel_with_confidence_and_entropy() {
    if !can_run() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let config = format!("{CONFIG}post: {{KNN: {{use: False}}}}\n");
    let model = files(folder.path(), &by_height(), &config);
    let cloud = cloud(Sensor::Vlp16);
    for image in [NetworkImage::Auto, NetworkImage::Clustering] {
        let network = Network::open(NetworkOptions { image, ..options(model.clone()) }).unwrap();
        let found = network.classes(&cloud, &ProjectionParams::default()).unwrap();
        let (confidence, entropy) = (found.confidence.unwrap(), found.entropy.unwrap());
        let high: Vec<usize> =
            (0..cloud.len()).filter(|&p| cloud.is_return(p) && cloud.z[p] > 0.5).collect();
        let low: Vec<usize> =
            (0..cloud.len()).filter(|&p| cloud.is_return(p) && cloud.z[p] < -1.6).collect();
        assert!(high.len() > 100 && low.len() > 1000);
        let share = |points: &[usize], class: u16| {
            points.iter().filter(|&&point| found.class[point] == class).count() as f64
                / points.len() as f64
        };
        // Not all: a point may lie behind another one in its pixel.
        assert!(share(&high, 10) > 0.97, "{image:?}: {}", share(&high, 10));
        assert!(share(&low, 40) > 0.97, "{image:?}: {}", share(&low, 40));
        for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
            assert!(
                (0.5..=1.0).contains(&confidence[point]) && (0.0..=0.65).contains(&entropy[point])
            );
        }
        // At z = -1 + x the car's share is 1 / (1 + exp(-4 x)).
        let sure = high.iter().filter(|&&p| found.class[p] == 10).all(|&p| confidence[p] > 0.99);
        assert!(sure || image == NetworkImage::Auto);
    }
}

#[test]
fn several_at_once_and_several_threads_change_nothing() {
    if !can_run() {
        return;
    }
    let (folder, input) = drive(5);
    let mut outputs = Vec::new();
    for (batch, threads) in [(1, 1), (2, 1), (3, 3), (1, 4), (8, 2)] {
        let config = by_network(NetworkOptions { batch, ..trained() });
        let options = AnnotateOptions { config, threads, ..AnnotateOptions::default() };
        let name = format!("{batch}-{threads}.mcap");
        let (output, report) = run(&input, &name, &options).unwrap();
        let topic = report.topics.values().next().unwrap();
        assert_eq!((topic.frames, topic.unreadable), (5, 0));
        assert_eq!(topic.semantics.keys().next().map(String::as_str), Some("onnx"));
        outputs.push(std::fs::read(output).unwrap());
    }
    assert!(outputs.iter().all(|bytes| *bytes == outputs[0]));
    drop(folder);
}

#[test]
fn what_is_wrong_with_a_network_is_said_before_anything_is_written() {
    if !can_run() {
        return;
    }
    let (folder, input) = drive(1);
    let own = folder.path().join("network");
    std::fs::create_dir(&own).unwrap();
    let sized = |input| Linear { input, ..by_height() };
    let flat = Linear { is_flat: true, ..by_height() };
    let odd = Linear { bias: vec![0.0, f32::NAN, 0.0], ..by_height() };
    let classes = Linear { weights: vec![vec![0.0; 5]; 4], bias: vec![0.0; 4], ..by_height() };
    let channels = Linear { input: [0, 3, 0, 0], weights: vec![vec![0.0; 3]; 3], ..by_height() };
    let cases: [(&str, Linear, &str); 7] = [
        ("dimensions", flat, "2 dimensions"),
        ("no numbers", odd, "no numbers (NaN)"),
        ("classes", classes, "scores of 4 classes, and its configuration (learning_map_inv) has 3"),
        ("channels", channels, "takes 3 channels, and its configuration has 5"),
        (
            "size",
            sized([1, 5, 64, 2048]),
            "64 x 2048, and its configuration (img_prop) has 32 x 512",
        ),
        ("any batch", sized([4, 5, 32, 512]), ""),
        ("fine", by_height(), ""),
    ];
    for (name, model, problem) in cases {
        let model = files(&own, &model, CONFIG);
        let output = folder.path().join(format!("{name}.mcap"));
        let semantics = format!("onnx:{}", path(&model));
        let arguments = ["annotate", path(&input), "-o", path(&output), "--semantics", &semantics];
        let done = divmerge(&arguments);
        let said = text(&done.stderr);
        let expected = if problem.is_empty() { 0 } else { 1 };
        assert_eq!(done.status.code(), Some(expected), "{name}: {said}");
        assert!(
            said.contains(problem) && (problem.is_empty() || said.contains("model.onnx")),
            "{name}: {said}"
        );
        assert_eq!(output.exists(), problem.is_empty(), "{name}");
    }
}

#[test]
fn a_network_that_takes_four_images_gets_four() {
    if !can_run() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let model = |images| {
        let input = [images, 5, 32, 512];
        files(folder.path(), &Linear { input, ..by_height() }, CONFIG)
    };
    let clouds: Vec<PointCloud> =
        [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Vlp16, Sensor::Vlp16, Sensor::Hdl32e]
            .map(cloud)
            .to_vec();
    let all: Vec<&PointCloud> = clouds.iter().collect();
    let classes = |options| {
        let network = Network::open(options).unwrap();
        network.classes_of(&all, &ProjectionParams::default()).unwrap()
    };
    let one_by_one = classes(options(model(0)));
    assert_eq!(classes(options(model(4))), one_by_one);
    assert_eq!(classes(NetworkOptions { batch: 3, ..options(model(0)) }), one_by_one);
    let wrong = Network::open(NetworkOptions { batch: 2, ..options(model(4)) }).unwrap_err();
    assert!(wrong.to_string().contains("takes 4 images at once, not 2"), "{wrong}");
}

#[test]
fn files_that_are_no_network() {
    if !can_run() {
        return;
    }
    let (folder, input) = drive(1);
    let model = files(folder.path(), &by_height(), CONFIG);
    let output = folder.path().join("out.mcap");
    let try_with = |semantics: &str, more: &[&str]| {
        let arguments = ["annotate", path(&input), "-o", path(&output), "--semantics", semantics];
        let done = divmerge(&[&arguments[..], more].concat());
        assert!(!output.exists());
        (done.status.code(), text(&done.stderr))
    };
    let semantics = format!("onnx:{}", path(&model));
    let (code, said) = try_with("onnx:nowhere.onnx", &[]);
    assert!(code == Some(1) && said.contains("nowhere.onnx"), "{said}");
    for broken in [&b""[..], b"not a network at all", &[0xff; 100]] {
        std::fs::write(&model, broken).unwrap();
        let (code, said) = try_with(&semantics, &[]);
        assert!(code == Some(1) && said.contains("model.onnx"), "{said}");
        assert!(said.contains("ONNX"), "{said}");
    }
    by_height().write(&model);
    let whole = std::fs::read(&model).unwrap();
    std::fs::write(&model, &whole[..whole.len() / 2]).unwrap();
    let (code, said) = try_with(&semantics, &[]);
    assert!(code == Some(1) && said.contains("model.onnx"), "{said}");
    std::fs::write(&model, whole).unwrap();
    std::fs::remove_file(model.with_extension("yaml")).unwrap();
    let (code, said) = try_with(&semantics, &[]);
    assert!(code == Some(1) && said.contains("arch_cfg.yaml"), "{said}");
    std::fs::write(model.with_extension("yaml"), CONFIG).unwrap();
    let (code, said) =
        try_with(&semantics, &["--onnxruntime", "/nowhere", "--runtime", "onnxruntime"]);
    assert!(code != Some(0) && said.contains("nowhere"), "{said}");
    let (code, said) = try_with("onnx:", &[]);
    assert!(code == Some(2) && said.contains("onnx:MODEL.onnx"), "{said}");
}

#[test]
fn a_network_that_gives_no_numbers_for_a_cloud_ends_the_run() {
    if !can_run() {
        return;
    }
    let (_folder, input) = drive(2);
    let folder = tempfile::tempdir().unwrap();
    // Small numbers pass; metres overflow.
    let mut model = by_height();
    model.weights[1] = vec![1e38, 0.0, 0.0, 0.0, 0.0];
    model.weights[2] = vec![1e38, 1e38, 0.0, 0.0, 0.0];
    let config = by_network(options(files(folder.path(), &model, CONFIG)));
    for batch in [1, 2] {
        let network =
            Network::open(NetworkOptions { batch, ..options(folder.path().join("model.onnx")) });
        let semantics = Semantics::Network(Arc::new(network.unwrap()));
        let options = AnnotateOptions {
            config: AnnotateConfig { semantics, ..config.clone() },
            ..AnnotateOptions::default()
        };
        let error = run(&input, "out.mcap", &options).unwrap_err().to_string();
        assert!(error.contains("no numbers"), "{error}");
        assert!(!input.with_file_name("out.mcap").exists());
    }
}

#[test]
fn a_cloud_without_returns_and_one_of_several_sensors() {
    if !can_run() {
        return;
    }
    let network = Network::open(trained()).unwrap();
    let empty = PointCloud::new(vec![f32::NAN; 3], vec![0.0; 3], vec![0.0; 3]).unwrap();
    let found = network.classes(&empty, &ProjectionParams::default()).unwrap();
    assert_eq!((found.class, found.confidence), (vec![0; 3], Some(vec![0.0; 3])));
    let one = cloud(Sensor::Vlp16);
    let mut two = one.clone().into_columns();
    let double = |column: &mut Vec<f32>| column.extend(column.clone());
    double(&mut two.x);
    double(&mut two.y);
    double(&mut two.z);
    two.remission.iter_mut().for_each(double);
    two.ring.iter_mut().for_each(|ring| ring.extend(ring.clone()));
    (two.width, two.height) = (two.x.len(), 1);
    two.source = Some((0..two.width).map(|point| u16::from(point >= one.len())).collect());
    let two = two.checked().expect("as many of each");
    let projection = ProjectionParams::default();
    let alone = network.classes(&one, &projection).unwrap();
    let both = network.classes(&two, &projection).unwrap();
    assert_eq!(both.class[..one.len()], alone.class);
    assert_eq!(both.class[one.len()..], alone.class);
}
