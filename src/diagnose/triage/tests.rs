//! Scenes drawn from blocks of points, where what is suspect is known by hand.

use super::*;
use crate::diagnose::explain::ClusteredCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{PointCloud, PointColumns};
use divmerge_core::pipeline;
use divmerge_core::pipeline::{Config, Stages};
use divmerge_core::range_image::Wrap;
use divmerge_core::semantics::MaskSource;

const CAR: u16 = 10;
const TRUCK: u16 = 18;
const PERSON: u16 = 30;

const ROWS: usize = 24;
const COLUMNS: usize = 600;
/// Radians between columns, and between rows.
const STEP: f64 = 0.004;

/// An upright wall that faces the sensor: from y to y at a distance, a metre and more high.
struct Wall {
    x: f64,
    y: [f64; 2],
    class: u16,
}

fn wall(x: f64, y: [f64; 2], class: u16) -> Wall {
    Wall { x, y, class }
}

struct Scene {
    cloud: PointCloud,
    taxonomy: Taxonomy,
    config: Config,
    stages: Stages,
}

impl Scene {
    /// What an organised sensor sees of the walls, the nearest of them in each pixel; road 40 m
    /// away behind. `lost`: columns in which no beam comes back.
    fn new(walls: &[Wall], lost: std::ops::Range<usize>, config: Config) -> Self {
        let mut cloud = PointColumns { height: ROWS, width: COLUMNS, ..PointColumns::default() };
        let mut class = Vec::new();
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let azimuth = (COLUMNS as f64 / 2.0 - column as f64) * STEP;
                let slope = (ROWS as f64 / 2.0 - row as f64) * STEP;
                let hits = walls.iter().filter(|wall| {
                    let y = wall.x * azimuth.tan();
                    azimuth.abs() < 1.2 && (wall.y[0]..wall.y[1]).contains(&y)
                });
                let hit = hits.min_by(|a, b| a.x.total_cmp(&b.x));
                let (x, of) = hit.map_or((40.0 * azimuth.cos(), 40), |wall| (wall.x, wall.class));
                let x = if lost.contains(&column) { 0.0 } else { x };
                let y = x * azimuth.tan();
                cloud.x.push(x as f32);
                cloud.y.push(y as f32);
                cloud.z.push((x.hypot(y) * slope) as f32);
                class.push(of);
            }
        }
        cloud.class = Some(class);
        Self::of_cloud(cloud.checked().unwrap(), config)
    }

    fn of_cloud(cloud: PointCloud, mut config: Config) -> Self {
        config.projection.wrap = Wrap::Never;
        let taxonomy = Taxonomy::semantic_kitti();
        let stages = pipeline::run(&cloud, MaskSource::Classes(&taxonomy), &config);
        Scene { cloud, taxonomy, config, stages }
    }

    fn best(walls: &[Wall]) -> Self {
        Self::new(walls, 0..0, Config::best())
    }

    fn triage(&self) -> Triage {
        let Scene { cloud, taxonomy, config, stages } = self;
        let mask = MaskSource::Classes(taxonomy);
        triage(&ClusteredCloud { cloud, mask, config, stages }, &TriageParams::default())
    }

    /// The suspects of one kind.
    fn of(&self, kind: SuspectKind) -> Vec<Suspect> {
        self.triage().suspects.into_iter().filter(|suspect| suspect.kind == kind).collect()
    }
}

#[test]
fn a_car_alone_is_not_suspect() {
    let scene = Scene::best(&[wall(10.0, [-2.0, 2.0], CAR)]);
    assert_eq!(scene.stages.instances.len(), 1);
    let found = scene.triage();
    assert_eq!(found.suspects, [], "{found:?}");
    assert_eq!((found.score, found.instances), (0.0, vec![0.0]));
}

#[test]
fn a_car_of_nine_metres_is_too_large_and_one_of_five_is_not() {
    let scene = Scene::best(&[wall(10.0, [-4.5, 4.5], CAR)]);
    let found = scene.of(SuspectKind::TooLarge);
    assert_eq!(found.len(), 1);
    assert!((found[0].measured - 9.0).abs() < 0.1 && (found[0].bound - 5.556).abs() < 1e-3);
    assert!(found[0].evidence == 1.0 && found[0].points.len() == 2, "{found:?}");
    assert_eq!(Scene::best(&[wall(10.0, [-2.5, 2.5], CAR)]).of(SuspectKind::TooLarge), []);
    // A truck may be that long, nearly.
    assert!(
        Scene::best(&[wall(10.0, [-4.5, 4.5], TRUCK)]).of(SuspectKind::TooLarge)[0].evidence < 0.3
    );
}

#[test]
fn two_masses_are_told_and_joined_thinly_and_a_splinter_says_little() {
    let halves = [wall(10.0, [-1.9, -0.4], CAR), wall(10.0, [0.4, 1.9], CAR)];
    let scene = Scene::best(&halves);
    assert_eq!(scene.stages.instances.len(), 1);
    for kind in [SuspectKind::TwoMasses, SuspectKind::ThinJoin] {
        let found = scene.of(kind);
        assert_eq!(found.len(), 1, "{kind:?}");
        assert!((found[0].measured - 0.8).abs() < 0.1, "{found:?}");
        let [a, b] = found[0].points[..] else { panic!("{found:?}") };
        let y = [a, b].map(|point| f64::from(scene.cloud.y[point]));
        assert!(y[0] * y[1] < 0.0 && (y[0].abs() - 0.4).abs() < 0.1, "{y:?}");
    }
    let splinter = [wall(10.0, [-1.9, 1.1], CAR), wall(10.0, [1.8, 1.9], CAR)];
    let splinter = Scene::best(&splinter);
    assert_eq!(splinter.stages.instances.len(), 1);
    let weight =
        |scene: &Scene| scene.of(SuspectKind::TwoMasses).first().map_or(0.0, |s| s.evidence);
    assert!(weight(&splinter) < weight(&scene) / 4.0);
    // Touching halves are no masses.
    let whole = [wall(10.0, [-1.9, 0.0], CAR), wall(10.0, [0.1, 1.9], CAR)];
    assert_eq!(Scene::best(&whole).of(SuspectKind::TwoMasses), []);
}

#[test]
fn what_hides_the_gap_explains_it() {
    let halves = || vec![wall(10.0, [-1.9, -0.4], CAR), wall(10.0, [0.4, 1.9], CAR)];
    let mut hidden = halves();
    // A person stands before the gap.
    hidden.push(wall(5.0, [-0.25, 0.25], PERSON));
    let [open, hidden] = [halves(), hidden].map(|walls| Scene::best(&walls));
    assert!(open.of(SuspectKind::TwoMasses)[0].evidence > 0.05);
    let evidence =
        hidden.of(SuspectKind::TwoMasses).first().map_or(0.0, |suspect| suspect.evidence);
    assert!(evidence < 0.7 * open.of(SuspectKind::TwoMasses)[0].evidence, "{evidence}");
}

#[test]
fn parts_that_would_fit_one_car_could_be_one() {
    let walls = [wall(10.0, [-1.9, -0.4], CAR), wall(10.0, [0.0, 1.9], CAR)];
    let mut apart = Config::best();
    (apart.cluster.fragments, apart.cluster.birds_eye) = (None, None);
    let scene = Scene::new(&walls, 0..0, apart.clone());
    assert_eq!(scene.stages.instances.len(), 2);
    let found = scene.of(SuspectKind::CouldBeOne);
    assert_eq!(found.len(), 1);
    // The smaller is in doubt, the larger as far as it lacks it.
    let [smaller, larger] = found[0].concerns[..] else { panic!("{found:?}") };
    let points = |id: u32| scene.stages.instances[id as usize - 1].points;
    assert!(points(smaller.instance) < points(larger.instance));
    assert!(smaller.share == 1.0 && larger.share < 1.0 && larger.share > 0.5);
    assert!(found[0].score > 0.5 * SuspectKind::CouldBeOne.weight());
    // Of the pair one case is made.
    assert_eq!(scene.triage().cases().len(), 1);
    // Two whole cars end to end would not fit, nor would a car and a person.
    let cars = [wall(10.0, [-5.0, -0.6], CAR), wall(10.0, [0.0, 4.4], CAR)];
    assert_eq!(Scene::new(&cars, 0..0, apart.clone()).of(SuspectKind::CouldBeOne), []);
    let other = [wall(10.0, [-1.9, -0.4], CAR), wall(10.0, [0.0, 0.5], PERSON)];
    assert_eq!(Scene::new(&other, 0..0, apart).of(SuspectKind::CouldBeOne), []);
}

#[test]
fn neighbours_that_all_but_touch() {
    let mut apart = Config::best();
    apart.cluster.fragments = None;
    let beside = |gap: f64| {
        let walls = [wall(10.0, [-4.0, 0.0], CAR), wall(10.0, [gap, 4.0], CAR)];
        Scene::new(&walls, 0..0, apart.clone()).of(SuspectKind::AlmostTouching)
    };
    let found = beside(0.5);
    assert!(found.len() == 1 && found[0].evidence < 0.5, "{found:?}");
    assert!((found[0].measured - 0.5).abs() < 0.09, "{found:?}");
    assert_eq!(beside(0.8), []);
}

#[test]
fn a_leftover_weighs_by_its_points() {
    let scene = Scene::best(&[wall(10.0, [-2.0, 2.0], CAR), wall(35.0, [20.0, 20.05], CAR)]);
    let found = scene.of(SuspectKind::Leftover);
    assert!(found.len() <= 1);
    // One pixel of a car far from everything.
    let pixel = 40;
    let call_it_car =
        |columns: &mut PointColumns| columns.class.as_mut().expect("classes")[pixel] = CAR;
    let cloud = scene.cloud.clone().with(call_it_car).unwrap();
    let scene = Scene::of_cloud(cloud, Config::best());
    let found = scene.of(SuspectKind::Leftover);
    let one = found.iter().find(|suspect| suspect.points == [pixel]).expect("the pixel");
    assert!((one.evidence - 0.9).abs() < 1e-12 && one.measured == 1.0);
    assert!(one.score < one.evidence * SuspectKind::Leftover.weight() / 49.0);
}

#[test]
fn thin_majorities_and_chains_of_bare_ones() {
    let mut scene = Scene::new(&[wall(10.0, [-2.0, 2.0], CAR)], 0..0, Config::paper());
    assert_eq!(scene.stages.instances.len(), 1);
    assert_eq!(scene.of(SuspectKind::ThinMajority), [], "no vote was cast against");
    // The merge on which most pixels hang becomes a bare one.
    let steps = scene.stages.merge.steps.clone();
    let evidence = |scene: &mut Scene, number: usize| {
        scene.stages.merge.steps.clone_from(&steps);
        scene.stages.merge.steps[number].negative = steps[number].positive - 1;
        scene
            .of(SuspectKind::ThinMajority)
            .first()
            .map(|suspect| (suspect.evidence, suspect.clone()))
    };
    let found: Vec<_> = (0..steps.len()).filter_map(|n| evidence(&mut scene, n)).collect();
    assert_eq!(found.len(), steps.len(), "something hangs on every merge");
    let most = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("a merge");
    assert!(most.0 > 0.2 && most.1.measured > 0.5 && most.1.measured < 0.6, "{most:?}");
    assert!(scene.of(SuspectKind::BareChain).is_empty(), "one bare majority is no chain");
    for step in &mut scene.stages.merge.steps {
        step.negative = step.positive - 1;
    }
    let chain = scene.of(SuspectKind::BareChain);
    assert!(chain.len() == 1 && chain[0].measured >= 2.0, "{chain:?}");
    assert!((chain[0].evidence - (1.0 - 0.5_f64.powf(chain[0].measured - 1.0))).abs() < 1e-12);
}

#[test]
fn borders_that_all_but_voted_to_join() {
    let walls = [wall(10.0, [-3.0, -0.6], CAR), wall(10.0, [0.0, 4.0], CAR)];
    let mut scene = Scene::new(&walls, 0..0, Config::paper());
    let labels = &scene.stages.components.label;
    let instances: Vec<u32> = (0..labels.len()).map(|o| scene.stages.merged_instance(o)).collect();
    let other = instances.iter().position(|&id| id != instances[0]).expect("two instances");
    let (a, b) = (labels[0].min(labels[other]), labels[0].max(labels[other]));
    assert_eq!(scene.of(SuspectKind::RefusedVotes), []);
    let mut vote = |positive, negative| {
        let vote = divmerge_core::cluster::Vote { a, b, positive, negative };
        scene.stages.votes.pairs.push(vote);
        let found = scene.of(SuspectKind::RefusedVotes);
        scene.stages.votes.pairs.pop();
        found
    };
    assert_eq!(vote(0, 8), [], "none in favour");
    let near = vote(4, 4);
    assert!(near.len() == 1 && near[0].evidence == 1.0 && near[0].concerns.len() == 2, "{near:?}");
    assert!((vote(1, 7)[0].evidence - 0.25).abs() < 1e-12);
}

#[test]
fn points_without_an_instance_lie_beside_one() {
    let mut config = Config::paper();
    config.cluster.min_pixels = 200;
    let walls = [wall(10.0, [-2.0, 0.0], CAR), wall(10.0, [0.4, 0.6], CAR)];
    let scene = Scene::new(&walls, 0..0, config);
    assert_eq!(scene.stages.instances.len(), 1);
    let found = scene.of(SuspectKind::Unlabelled);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].concerns.len(), 1);
    assert!(found[0].sentence.contains("too small"), "{}", found[0].sentence);
    assert!(found[0].position[1] > 0.3, "{:?}", found[0].position);
}

#[test]
fn mixed_classes_are_a_share() {
    let scene = Scene::best(&[wall(10.0, [-2.0, 1.0], CAR), wall(10.0, [1.0, 2.0], TRUCK)]);
    assert_eq!(scene.stages.instances.len(), 1);
    let found = scene.of(SuspectKind::MixedClasses);
    assert!(found.len() == 1 && (found[0].measured - 0.25).abs() < 0.02, "{found:?}");
    assert_eq!(Scene::best(&[wall(10.0, [-2.0, 1.0], CAR)]).of(SuspectKind::MixedClasses), []);
}

#[test]
fn beams_that_are_missing_in_a_car() {
    let walls = || [wall(10.0, [-2.0, 2.0], CAR)];
    let middle = COLUMNS / 2;
    let scene = Scene::new(&walls(), middle - 10..middle + 10, Config::best());
    let found = scene.of(SuspectKind::MissingReturns);
    assert!(found.len() == 1 && (found[0].measured - 0.2).abs() < 0.03, "{found:?}");
    assert_eq!(Scene::best(&walls()).of(SuspectKind::MissingReturns), []);
}

#[test]
fn scores_are_joined_as_if_independent() {
    let halves = [wall(10.0, [-1.9, -0.4], CAR), wall(10.0, [0.4, 1.9], CAR)];
    let found = Scene::best(&halves).triage();
    let clear: f64 = found.suspects.iter().map(|suspect| 1.0 - suspect.score).product();
    assert!((found.score - (1.0 - clear)).abs() < 1e-12 && found.score > 0.0);
    let cases = found.cases();
    assert_eq!(cases.len(), 1);
    assert_eq!(cases[0].score, found.instances[0]);
    assert_eq!(cases[0].suspects.len(), found.suspects.len());
}

#[test]
fn without_classes_there_are_no_sizes_but_neighbours() {
    let walls = [wall(10.0, [-2.0, 0.0], CAR), wall(10.0, [0.5, 2.0], CAR)];
    let Scene { cloud, config, .. } = Scene::best(&walls);
    let objects =
        (0..cloud.len()).map(|point| cloud.class.as_ref().expect("classes")[point] == CAR);
    let mut alone = cloud.clone();
    for (point, is_object) in objects.enumerate() {
        if !is_object {
            alone.set_position(point, [0.0; 3]);
        }
    }
    let stages = pipeline::run(&alone, MaskSource::All, &config);
    assert_eq!(stages.instances.len(), 2);
    let frame =
        ClusteredCloud { cloud: &alone, mask: MaskSource::All, config: &config, stages: &stages };
    let found = triage(&frame, &TriageParams::default());
    let kinds: Vec<SuspectKind> = found.suspects.iter().map(|suspect| suspect.kind).collect();
    assert_eq!(kinds, [SuspectKind::AlmostTouching], "{found:?}");
}

#[test]
fn an_empty_cloud_is_not_suspect() {
    let empty = PointCloud::new(Vec::new(), Vec::new(), Vec::new()).expect("a cloud");
    let scene = Scene::of_cloud(empty, Config::best());
    assert_eq!(scene.triage(), Triage::default());
    assert_eq!(scene.triage().cases(), []);
}
