//! Scenes drawn as little grids, where components, votes and chains are known by hand.
//!
//! A letter is a point: `a` at 10 m, `b` at 10.3 m, `c` at 12 m, `r` road at 10 m; `.` is no
//! return. Columns are 0.2 degrees apart around straight ahead, rows 0.4 degrees, so that beta
//! between `a` and `b` is 6.6 degrees along a row (against) and 13 degrees along a column (in
//! favour). A voxel is as large as the world: a seed for each side of the axes.

use super::in_force::CORRECTIONS_OF_CLASSES;
use super::*;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{PointCloud, PointColumns};
use divmerge_core::cluster::params::ClusterParams;
use divmerge_core::pipeline::{Config, Stages};
use divmerge_core::semantics::MaskSource;

struct Scene {
    cloud: PointCloud,
    columns: usize,
    taxonomy: Taxonomy,
    config: Config,
    stages: Stages,
}

impl Scene {
    /// `lowest`: elevation of the lowest row in degrees.
    fn new(lines: &[&str], lowest: f64, change: impl FnOnce(&mut ClusterParams)) -> Scene {
        let columns = lines[0].len();
        let mut cloud =
            PointColumns { height: lines.len(), width: columns, ..PointColumns::default() };
        let mut class = Vec::new();
        for (row, line) in lines.iter().enumerate() {
            for (column, cell) in line.chars().enumerate() {
                let range = match cell {
                    'a' | 'r' => 10.0,
                    'b' => 10.3,
                    'c' => 12.0,
                    _ => 0.0,
                };
                let middle = (columns as f64 - 1.0) / 2.0;
                let azimuth = ((middle - column as f64) * 0.2).to_radians();
                let elevation = (lowest + (lines.len() - 1 - row) as f64 * 0.4).to_radians();
                let flat = range * elevation.cos();
                cloud.x.push((flat * azimuth.cos()) as f32);
                cloud.y.push((flat * azimuth.sin()) as f32);
                cloud.z.push((range * elevation.sin()) as f32);
                class.push(if cell == 'r' { 40 } else { 10 });
            }
        }
        cloud.class = Some(class);
        let cloud = cloud.checked().unwrap();
        let taxonomy = Taxonomy::semantic_kitti();
        let mut config = Config::paper();
        config.projection.wrap = divmerge_core::range_image::Wrap::Never;
        config.cluster.voxel = 100.0;
        change(&mut config.cluster);
        let stages = pipeline(&cloud, &taxonomy, &config);
        Scene { cloud, columns, taxonomy, config, stages }
    }

    fn frame(&self) -> ClusteredCloud<'_> {
        let mask = MaskSource::Classes(&self.taxonomy);
        ClusteredCloud { cloud: &self.cloud, mask, config: &self.config, stages: &self.stages }
    }

    fn at(&self, (row, column): (usize, usize)) -> usize {
        row * self.columns + column
    }

    fn pair(&self, a: (usize, usize), b: (usize, usize)) -> Explanation {
        explain(&self.frame(), Subject::Pair(self.at(a), self.at(b)))
    }

    fn point(&self, at: (usize, usize)) -> Explanation {
        explain(&self.frame(), Subject::Point(self.at(at)))
    }
}

fn pipeline(cloud: &PointCloud, taxonomy: &Taxonomy, config: &Config) -> Stages {
    divmerge_core::pipeline::run(cloud, MaskSource::Classes(taxonomy), config)
}

fn no_plane(params: &mut ClusterParams) {
    params.birds_eye = None;
}

#[test]
fn one_merge() {
    let scene = Scene::new(&["aaaa", "aaaa"], 1.0, no_plane);
    let found = scene.pair((0, 0), (1, 3));
    assert_eq!((found.answer, found.decided_by), (Answer::OneInstance, DecidedBy::VotesInFavour));
    let Some(VoteEvidence::Chain { links }) = &found.votes else {
        panic!("{:?}", found.votes);
    };
    assert_eq!(links.len(), 1);
    let link = &links[0];
    assert_eq!((link.target, link.query, link.positive, link.negative), (1, 2, 4, 0));
    assert_eq!(link.pairs.len(), 2);
    assert!(link.pairs.iter().all(|pair| pair.holds && pair.beta_degrees > 80.0));
    let seed = found.points[1].component.unwrap().seed.unwrap();
    assert_eq!((seed.row, seed.column), (0, 2));
    let same = scene.pair((0, 0), (1, 1));
    assert_eq!(same.decided_by, DecidedBy::OneComponent);
    assert_eq!(same.votes, Some(VoteEvidence::OneComponent { component: 1 }));
}

#[test]
fn a_chain_goes_up_and_down_the_tree_of_merges() {
    // 1 | 2   1 takes in 2 and then 3, 2 takes in 4: from 3 to 4 the way is 3 - 1 - 2 - 4.
    // 3 | 4
    let scene = Scene::new(&["aaaa", "aaaa"], -0.2, no_plane);
    let found = scene.pair((1, 0), (1, 3));
    let Some(VoteEvidence::Chain { links }) = found.votes else {
        panic!("{:?}", found.votes);
    };
    let told: Vec<_> =
        links.iter().map(|link| (link.target, link.query, link.positive, link.negative)).collect();
    assert_eq!(told, [(1, 3, 4, 0), (1, 2, 2, 0), (2, 4, 4, 0)]);
}

#[test]
fn a_tie_fails_by_one_vote() {
    let scene = Scene::new(&["bbaa", "aaaa"], 1.0, no_plane);
    let found = scene.pair((0, 0), (0, 3));
    assert_eq!((found.answer, found.decided_by), (Answer::Apart, DecidedBy::VotesAgainst));
    let Some(VoteEvidence::Failed { groups, links, weakest, short_by }) = &found.votes else {
        panic!("{:?}", found.votes);
    };
    assert_eq!(groups.iter().map(|group| group.number).collect::<Vec<_>>(), [1, 2]);
    assert_eq!((*weakest, *short_by), (0, Some(1)));
    assert_eq!((links[0].positive, links[0].negative), (2, 2));
    let against: Vec<_> = links[0].pairs.iter().filter(|pair| !pair.holds).collect();
    assert_eq!(against.len(), 1);
    assert_eq!([against[0].a.column, against[0].b.column], [1, 2]);
    assert!((against[0].beta_degrees - 6.6).abs() < 0.1, "{}", against[0].beta_degrees);
    assert_eq!(
        found.post_merge,
        [PostMergeStage::BirdsEye {
            joined: false,
            region: None,
            margin: 0.0,
            groups: vec![],
            gaps: vec![],
            classes_differ: false
        }]
    );
}

#[test]
fn what_breaks_a_tie() {
    let scene = Scene::new(&["bbaa", "aaaa"], 1.0, no_plane);
    let subject = Subject::Pair(scene.at((0, 0)), scene.at((0, 3)));
    let found = what_if(&scene.frame(), subject);
    let number = |name: &str| {
        let of_name = |each: &WhatIf| match each {
            WhatIf::Number(number) if number.parameter == name => Some(number.clone()),
            _ => None,
        };
        found.iter().find_map(of_name).expect("searched")
    };
    assert_eq!(number("merge ratio").lower, Some(Flip { value: 0.49, unchanged_at: 0.5 }));
    assert_eq!(number("merge ratio").higher, None);
    // The pair against has beta 6.6 degrees: below that it is in favour.
    let angle = number("angle").lower.expect("a lower angle");
    assert!((angle.value - 6.6).abs() < 0.1, "{angle:?}");
    assert!((angle.unchanged_at - angle.value - 0.05).abs() < 1e-9, "{angle:?}");
    assert_eq!(number("minimum size").smallest(), None);
}

#[test]
fn no_true_condition_shows_the_border() {
    let scene = Scene::new(&["bbaa", "bbaa"], 1.0, no_plane);
    let found = scene.pair((0, 0), (0, 3));
    assert_eq!(found.decided_by, DecidedBy::NoTrueCondition);
    let Some(VoteEvidence::NoTrueCondition { border, distance, .. }) = found.votes else {
        panic!("{:?}", found.votes);
    };
    assert_eq!(border.len(), 2);
    assert!(border.iter().all(|pair| !pair.holds));
    assert!((distance - 0.3).abs() < 0.01, "{distance}");
}

#[test]
fn without_a_border_the_way_over_others_is_shown() {
    // 1 | 2   1 and 3 meet only over 2, and no condition holds on the way.
    // . | 3
    let scene = Scene::new(&["ca", ".c"], -0.2, no_plane);
    let found = scene.pair((0, 0), (1, 1));
    let Some(VoteEvidence::NoTrueCondition { border, groups, links, .. }) = found.votes else {
        panic!("{:?}", found.votes);
    };
    assert!(border.is_empty());
    assert_eq!(groups.iter().map(|group| group.number).collect::<Vec<_>>(), [1, 2, 3]);
    let votes: Vec<_> = links.iter().map(|link| (link.positive, link.negative)).collect();
    assert_eq!(votes, [(0, 2), (0, 2)]);
}

#[test]
fn points_without_an_instance_say_why() {
    let scene = Scene::new(&["aac.", "aar."], 1.0, |params| {
        no_plane(params);
        params.min_pixels = 5;
    });
    let road = scene.point((1, 2));
    assert_eq!(road.answer, Answer::NoInstance);
    assert_eq!((road.points[0].reason, road.points[0].semantic), (Reason::NotAnObject, 40));
    // What decides on objects alone is searched, and nothing of it gives another answer.
    for found in what_if(&scene.frame(), Subject::Point(scene.at((1, 2)))) {
        let WhatIf::Choice(Choice { path, flips, .. }) = found else {
            panic!("a number of a part that is off: {found:?}");
        };
        assert!(CORRECTIONS_OF_CLASSES.contains(&path.expect("a parameter")));
        assert!(flips.is_empty(), "{flips:?}");
    }
    let small = scene.point((0, 0));
    assert_eq!(small.points[0].reason, Reason::TooSmall);
    let size = PostMergeStage::MinimumSize { point: 0, pixels: 4, minimum: 5 };
    assert_eq!(small.post_merge, [size]);
    let pair = scene.pair((0, 0), (0, 1));
    assert_eq!((pair.answer, pair.decided_by), (Answer::Apart, DecidedBy::NoInstance));
}

#[test]
fn an_unreached_point_shows_the_conditions_around_it() {
    let scene = Scene::new(&["ac...", "aa..."], 1.0, no_plane);
    let found = scene.point((0, 1));
    assert_eq!(found.points[0].reason, Reason::Unreached);
    let neighbours = &found.points[0].neighbours;
    assert_eq!(neighbours.len(), 2);
    assert!(neighbours.iter().all(|pair| !pair.holds && pair.beta_degrees < 10.0));
}

#[test]
fn boxes_that_overlap_join_what_the_votes_left_apart() {
    // The votes tie, and without a margin the boxes are 3.5 cm apart.
    let with_margin = |margin: f64| {
        Scene::new(&["bbaa", "aaaa"], 1.0, |params| {
            params.birds_eye.as_mut().expect("paper has one").margin = margin;
        })
    };
    let apart = with_margin(0.0).pair((0, 0), (0, 3));
    assert_eq!(apart.answer, Answer::Apart);
    let joined = with_margin(0.1).pair((0, 0), (0, 3));
    assert_eq!(
        (joined.answer, joined.decided_by),
        (Answer::OneInstance, DecidedBy::PostMergeStage)
    );
    for (found, joins) in [(apart, false), (joined, true)] {
        let [PostMergeStage::BirdsEye { joined, groups, gaps, .. }] = &found.post_merge[..] else {
            panic!("{:?}", found.post_merge);
        };
        assert_eq!(*joined, joins);
        assert_eq!(groups.iter().map(|group| group.number).collect::<Vec<_>>(), [1, 2]);
        assert!((gaps[0] - 0.035).abs() < 0.001, "{gaps:?}");
    }
}

#[test]
fn positions_and_instances_that_hit_nothing() {
    let scene = Scene::new(&["aaaa", "...."], 1.0, no_plane);
    let at = scene.cloud.position(1).map(f64::from);
    assert_eq!(return_at(&scene.cloud, at, 0.3).unwrap(), 1);
    let missed = return_at(&scene.cloud, [at[0], at[1], at[2] + 1.0], 0.3).unwrap_err();
    assert!(missed.to_string().contains("the nearest is 1.00 m away"), "{missed}");
    let missing = nearest_points(&scene.frame(), 1, 9).unwrap_err();
    assert!(missing.to_string().contains("1 to 1"), "{missing}");
    let empty = return_at(&PointCloud::default(), [0.0; 3], 1.0).unwrap_err();
    assert!(empty.to_string().contains("no return at all"), "{empty}");
}
