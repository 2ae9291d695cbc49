//! Whether the class ids of a field are believed.

use std::ops::ControlFlow;

use divmerge::datasets::cloud_recording::CloudRecording;
use divmerge::datasets::drive::cloud_message;
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::CloudFormat;
use divmerge::recording::WriteOptions;
use divmerge::semantics::evidence::{Belief, Doubt, DoubtReason, judge, judge_ids};
use divmerge::simulate::{Clutter, Drive, Mount, Scene, Sensor};
use divmerge::view::{ClusteredMessage, ColourTracker};
use divmerge::{
    AnnotateConfig, AnnotateOptions, GroundParams, PointCloud, ProjectionParams, Semantics,
    Taxonomy, annotate,
};

fn judged(cloud: &PointCloud) -> Belief<'static> {
    let assumed = &Taxonomy::known()[0];
    judge(cloud, assumed, &ProjectionParams::default(), &GroundParams::default())
}

fn doubted(cloud: &PointCloud) -> Doubt {
    match judged(cloud) {
        Belief::Doubt(doubt) => doubt,
        Belief::Classes(taxonomy) => panic!("believed as {}", taxonomy.name),
    }
}

/// A sweep whose classes have other numbers, by the names of SemanticKITTI's classes.
fn renamed(sensor: Sensor, scene: Scene, id: impl Fn(&str) -> u16) -> PointCloud {
    let cloud = Drive::new(sensor, scene, 5).frame(1).cloud;
    let taxonomy = Taxonomy::semantic_kitti();
    let number = |&raw: &u16| {
        let class = taxonomy.class_of(raw).unwrap_or(0);
        id(&taxonomy.classes()[usize::from(class)].name)
    };
    let class = cloud.class.as_ref().unwrap().iter().map(number).collect();
    cloud.with_class(class).unwrap()
}

/// The id of a class of SemanticKITTI in another taxonomy, which may call it otherwise.
fn id_in(taxonomy: &Taxonomy, name: &str) -> u16 {
    let others: &[&str] = match name {
        "person" => &["pedestrian"],
        "bicyclist" | "motorcyclist" => &["rider", "bicycle", "vehicle"],
        "road" | "parking" => &["driveable-surface", "road"],
        "terrain" | "other-ground" => &["other-ground", "ground"],
        "building" | "fence" => &["building", "manmade"],
        "trunk" => &["tree-trunk", "vegetation"],
        "pole" | "traffic-sign" => &["sign", "traffic-sign", "manmade"],
        _ => &["vehicle", "car"],
    };
    let mut names = std::iter::once(&name).chain(others);
    let class = names.find_map(|name| taxonomy.class_called(name));
    let id = |class| taxonomy.known_ids().find(|&(_, of)| of == class).map_or(0, |(id, _)| id);
    if name == "unlabeled" { 0 } else { class.map_or(0, id) }
}

const SENSORS: [Sensor; 3] = [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Os1_128];

#[test]
fn true_classes_are_believed() {
    for sensor in Sensor::ALL {
        for scene in Scene::ALL {
            let mut drive = Drive::new(sensor, scene, 7);
            let tilted = Mount { roll: 0.2, pitch: 0.25, ..Mount::level(sensor.height()) };
            for (mount, clutter) in [
                (Mount::level(sensor.height()), Clutter::default()),
                (tilted, Clutter { drops: 0.02, mirrored: 0.1 }),
            ] {
                (drive.mount, drive.clutter) = (mount, clutter);
                let cloud = drive.frame(3).cloud;
                let belief = judged(&cloud);
                assert!(matches!(belief, Belief::Classes(_)), "{sensor} {scene}: {belief:?}");
            }
        }
    }
}

#[test]
fn ids_that_mean_nothing_are_doubted() {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Street, 5).frame(1).cloud;
    let with = |id: &dyn Fn(usize) -> u16| {
        cloud.clone().with_class((0..cloud.len()).map(id).collect()).unwrap()
    };
    let doubt = doubted(&with(&|_| 0));
    assert_eq!(doubt.reason, DoubtReason::Nothing);
    assert_eq!(doubt.ids, [(0, cloud.len())]);
    for id in [1, 99, 7, u16::MAX] {
        let doubt = doubted(&with(&|_| id));
        assert!(matches!(doubt.reason, DoubtReason::Unknown { .. }), "{id}: {doubt:?}");
    }
    // Numbers of clusters, and noise.
    doubted(&with(&|point| (point / 50) as u16));
    doubted(&with(&|point| (point * 7919 % 100) as u16));
    // One class everywhere, whichever it is.
    for id in [10, 18, 50] {
        doubted(&with(&|_| id));
    }
    let named = Taxonomy::semantic_kitti();
    assert!(matches!(judge_ids(&with(&|_| 0), &named), Belief::Doubt(_)));
    assert!(matches!(judge_ids(&with(&|_| 18), &named), Belief::Classes(_)));
}

#[test]
fn numbers_of_another_data_set_are_doubted() {
    for sensor in SENSORS {
        for scene in [Scene::Street, Scene::Parking] {
            // Ground and the rest, each pair known to SemanticKITTI.
            for (ground, rest) in
                [(18, 1), (10, 50), (20, 30), (50, 40), (70, 10), (11, 40), (40, 1)]
            {
                let is_ground = |name: &str| {
                    ["road", "sidewalk", "parking", "terrain", "other-ground"].contains(&name)
                };
                let id = |name: &str| if is_ground(name) { ground } else { rest };
                let belief = judged(&renamed(sensor, scene, id));
                assert!(
                    matches!(belief, Belief::Doubt(_)),
                    "{sensor} {scene} {ground} {rest}: {belief:?}"
                );
            }
        }
    }
}

#[test]
fn known_taxonomies_are_recognised() {
    for taxonomy in &Taxonomy::known()[1..] {
        for sensor in SENSORS {
            for scene in Scene::ALL {
                let cloud = renamed(sensor, scene, |name| id_in(taxonomy, name));
                let belief = judged(&cloud);
                let is_recognised = belief == Belief::Classes(taxonomy);
                assert!(is_recognised, "{} of {sensor} in {scene}: {belief:?}", taxonomy.name);
            }
        }
    }
}

#[test]
fn figures_name_the_classes_of_the_taxonomy_that_was_recognised() {
    let config = AnnotateConfig::default();
    for taxonomy in &Taxonomy::known()[1..] {
        let mut frame = Drive::new(Sensor::Hdl32e, Scene::Street, 5).frame(1);
        frame.cloud = renamed(Sensor::Hdl32e, Scene::Street, |name| id_in(taxonomy, name));
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).unwrap();
        let message = EncodedCloud::of_message(CloudFormat::Ros2, message);
        let clustered = ClusteredMessage::new(&message, &config).unwrap();
        let scene = clustered.scene(&config, 0, &mut ColourTracker::default());
        assert_eq!(scene.classes, taxonomy.classes(), "{}", taxonomy.name);
    }
}

fn force() -> WriteOptions {
    WriteOptions { force: true, ..WriteOptions::default() }
}

#[test]
fn auto_falls_to_ground_and_says_so_once() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.mcap"), folder.path().join("out.mcap"));
    let annotated = |semantics: Semantics, id: u16| {
        let mut recording =
            CloudRecording::create(CloudFormat::Ros2, &input, "/points", &force()).unwrap();
        for number in 0..3 {
            let mut frame = Drive::new(Sensor::Vlp16, Scene::Street, 5).frame(number);
            let class = vec![id; frame.cloud.len()];
            frame.cloud = frame.cloud.with_class(class).unwrap();
            let mut message = Vec::new();
            cloud_message(&frame, &mut message).unwrap();
            recording.write_cloud(frame.stamp_ns, &message).unwrap();
        }
        recording.finish().unwrap();
        let config = AnnotateConfig { semantics, ..AnnotateConfig::default() };
        let options = AnnotateOptions { config, force: true, ..AnnotateOptions::default() };
        annotate(&input, &output, &options, &mut |_| ControlFlow::Continue(())).unwrap()
    };
    let report = annotated(Semantics::Auto, 0);
    assert_eq!(report.topics["/points"].semantics, [("ground".to_owned(), 3)].into());
    let [warning] = &report.warnings[..] else { panic!("{:?}", report.warnings) };
    for part in ["3 clouds", "`label`", "0 (", "--taxonomy", "--semantics ground"] {
        assert!(warning.contains(part), "{part}: {warning}");
    }
    let report = annotated(Semantics::Field("label".into()), 0);
    assert_eq!(report.topics["/points"].semantics, [("field:label".to_owned(), 3)].into());
    assert_eq!(report.warnings, Vec::<String>::new());
}
