//! Scenes drawn as little grids in which each cause is provoked, and has to be found.
//!
//! Three drawings a scene. Ranges: `a` 10 m, `b` 10.3 m, `c` 12 m, `d` 20 m, `.` no return. Truth:
//! an upper-case letter is a car, a lower-case one a person, `.` the road. Classes as given:
//! likewise. Columns are 0.2 degrees apart around straight ahead, rows 0.4 degrees; a voxel is as
//! large as the world, a seed on each side of straight ahead.

use super::*;
use crate::diagnose::explain::{ClusteredCloud, PostMergeStage};
use crate::evaluate::verdict::Verdict;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{PointCloud, PointColumns};
use divmerge_core::cluster::Evidence;
use divmerge_core::cluster::params::{BirdsEye, ClusterParams, Leftovers, Region};
use divmerge_core::pipeline;
use divmerge_core::pipeline::Config;
use divmerge_core::range_image::Wrap;
use divmerge_core::semantics::MaskSource;

struct Scene {
    cloud: PointCloud,
    true_class: Vec<u16>,
    true_id: Vec<u32>,
    config: Config,
}

fn class_of(letter: char) -> u16 {
    match letter {
        '.' => 40,
        person if person.is_lowercase() => 30,
        _ => 10,
    }
}

impl Scene {
    fn new(
        ranges: &[&str],
        truth: &[&str],
        given: &[&str],
        change: fn(&mut ClusterParams),
    ) -> Self {
        // A row without returns below: an image has more than one row.
        let (rows, columns) = (ranges.len() + 1, ranges[0].len());
        let cells = |lines: &[&str]| -> Vec<char> {
            lines.concat().chars().chain(std::iter::repeat_n('.', columns)).collect()
        };
        let mut cloud = PointColumns { height: rows, width: columns, ..PointColumns::default() };
        for (cell, letter) in cells(ranges).into_iter().enumerate() {
            let column = cell % columns;
            let range = match letter {
                'a' => 10.0,
                'b' => 10.3,
                'c' => 12.0,
                'd' => 20.0,
                _ => 0.0,
            };
            let azimuth = (((columns as f64 - 1.0) / 2.0 - column as f64) * 0.2).to_radians();
            let elevation = (1.0 + (rows - 1 - cell / columns) as f64 * 0.4).to_radians();
            push(&mut cloud, range, azimuth, elevation);
        }
        cloud.class = Some(cells(given).into_iter().map(class_of).collect());
        let cloud = cloud.checked().unwrap();
        let mut config = Config::paper();
        config.projection.wrap = Wrap::Never;
        config.cluster.voxel = 100.0;
        config.cluster.birds_eye = None;
        change(&mut config.cluster);
        let truth = cells(truth);
        let true_class = truth.iter().map(|&letter| class_of(letter)).collect();
        let true_id = truth.iter().map(|&letter| u32::from(letter)).collect();
        Scene { cloud, true_class, true_id, config }
    }

    fn failures(&self) -> Vec<Failure> {
        let taxonomy = Taxonomy::semantic_kitti();
        let mask = MaskSource::Classes(&taxonomy);
        let stages = pipeline::run(&self.cloud, mask, &self.config);
        let frame =
            ClusteredCloud { cloud: &self.cloud, mask, config: &self.config, stages: &stages };
        let found = failures(&LabelledRun {
            detections: &[],
            frame,
            true_class: &self.true_class,
            true_id: &self.true_id,
            taxonomy: &taxonomy,
            min_points: 1,
        });
        found.failures
    }

    /// The failure of the true object of that letter.
    fn of(&self, letter: char) -> Failure {
        let is_wanted = |failure: &Failure| {
            failure.side == ObjectOrigin::True && failure.judged.object.id == u32::from(letter)
        };
        let mut all = self.failures().into_iter();
        all.find(is_wanted).unwrap_or_else(|| panic!("{letter} is right"))
    }
}

fn push(cloud: &mut PointColumns, range: f64, azimuth: f64, elevation: f64) {
    let flat = range * elevation.cos();
    cloud.x.push((flat * azimuth.cos()) as f32);
    cloud.y.push((flat * azimuth.sin()) as f32);
    cloud.z.push((range * elevation.sin()) as f32);
}

fn as_it_is(_: &mut ClusterParams) {}

#[test]
fn nothing_fails_where_all_is_right() {
    let truth = &["AAAA..BBBB"];
    let scene = Scene::new(&["aaaaaaaaaa"], truth, truth, as_it_is);
    assert_eq!(scene.failures(), []);
}

#[test]
fn the_mask_loses_misnames_and_invents() {
    let lost = Scene::new(&["aaaaaaaa"], &["AAAAAAAA"], &["AAA....."], as_it_is).of('A');
    assert_eq!(lost.judged.verdict, Verdict::Missed);
    let Cause::Mask { points, not_objects, other_class, given } = &lost.cause else {
        panic!("{:?}", lost.cause);
    };
    assert_eq!((*points, *not_objects, *other_class, given.as_deref()), (8, 5, 0, Some("road")));
    assert_eq!(lost.show.len(), 1);

    let named = Scene::new(&["aaaaaaaa"], &["AAAAAAAA"], &["aaaaaaaa"], as_it_is).of('A');
    assert_eq!((named.judged.verdict, named.cause.step()), (Verdict::WrongClass, "mask"));

    let invented = Scene::new(&["aaaaaaaa"], &["........"], &["AAAA...."], as_it_is).failures();
    assert_eq!(
        (invented[0].side, invented[0].judged.verdict),
        (ObjectOrigin::Found, Verdict::Spurious)
    );
    assert_eq!((invented.len(), invented[0].cause.step()), (1, "mask"));
}

/// A ghost between two cars: with true classes they are apart, but so they would be if what is
/// given were cut well.
#[test]
fn what_the_mask_allows_is_lost_by_the_cut() {
    let ghost = Scene::new(&["aaaaaaaaa"], &["AAAA.BBBB"], &["AAAAABBBB"], as_it_is).failures();
    assert!(!ghost.is_empty());
    for failure in ghost {
        assert_eq!(failure.cause.step(), "merge", "{failure:?}");
        assert!(failure.is_right_with_true_mask);
    }
}

#[test]
fn shadowed_points_spoil_what_is_right_where_it_is_seen() {
    // B, seven points at 8 m, hides four of A's at 12 m; three of A's stand free, out of their
    // reach.
    let mut cloud = PointColumns::default();
    let columns = |from: usize, count: usize| (from..from + count).map(|column| column as f64);
    let at = |column: f64| ((50.0 - column) * 0.2).to_radians();
    columns(0, 7).for_each(|column| push(&mut cloud, 8.0, at(column), 0.02));
    columns(0, 4).chain(columns(20, 3)).for_each(|column| push(&mut cloud, 12.0, at(column), 0.02));
    let cloud = PointCloud::new(cloud.x, cloud.y, cloud.z).unwrap();
    let cloud = cloud.with_ring(vec![0; 14]).unwrap().with_class(vec![10; 14]).unwrap();
    let mut config = Config::paper();
    config.projection.columns = Some(1800);
    config.cluster.birds_eye = None;
    let true_id = [vec![u32::from('B'); 7], vec![u32::from('A'); 7]].concat();
    let scene = Scene { cloud, true_class: vec![10; 14], true_id, config };
    let failure = scene.of('A');
    assert_eq!(failure.judged.verdict, Verdict::UnderSegmented);
    let expected = Cause::Projection { points: 7, shadowed: 4, unlabelled: 0 };
    assert_eq!(failure.cause, expected);
    assert!((7..11).contains(&failure.show[0]));
}

#[test]
fn a_component_straddles_two_objects() {
    // The left component has three pixels: the right one grows leftwards first.
    let truth = &["ABBBBBBB"];
    let failure = Scene::new(&["aaaaaaaa"], truth, truth, as_it_is).of('A');
    assert_eq!(failure.judged.verdict, Verdict::UnderSegmented);
    let expected = DivideCause::Straddles { component: 1, own: 1, pixels: 3 };
    assert_eq!((failure.cause, failure.show), (Cause::Divide(expected), vec![0, 1]));
}

#[test]
fn no_seed_reaches_it() {
    // The voxel's one seed lies in A.
    let truth = &["AAAACCCC........"];
    let failure = Scene::new(&["aaaacccc........"], truth, truth, as_it_is).of('C');
    assert_eq!(failure.judged.verdict, Verdict::Missed);
    let expected = DivideCause::Unreached { unreached: 4, pixels: 4 };
    assert_eq!(failure.cause, Cause::Divide(expected));
}

#[test]
fn votes_join_two_objects() {
    let truth = &["AAAABBBB"];
    let failure = Scene::new(&["aaaaaaaa"], truth, truth, as_it_is).of('A');
    let expected = MergeCause::Joined { target: 1, query: 2, positive: 2, negative: 0 };
    assert_eq!((failure.cause, failure.show), (Cause::Merge(expected), vec![2, 4]));
}

#[test]
fn votes_keep_two_parts_apart() {
    // One pair of the border in favour and one against: no majority.
    let truth = &["AAAA", "AAAA"];
    let failure = Scene::new(&["bbaa", "aaaa"], truth, truth, as_it_is).of('A');
    assert_eq!(failure.judged.verdict, Verdict::OverSegmented);
    let Cause::Merge(MergeCause::Apart(link)) = &failure.cause else {
        panic!("{:?}", failure.cause);
    };
    assert_eq!((link.positive, link.negative, failure.show.len()), (2, 2, 2));
}

#[test]
fn nothing_links_two_parts() {
    let truth = &["AAAAAAAA"];
    let halves = Scene::new(&["aaaacccc"], truth, truth, as_it_is).of('A');
    let Cause::Merge(MergeCause::Unlinked { border, distance }) = halves.cause else {
        panic!("{:?}", halves.cause);
    };
    assert!(border == 1 && (distance - 2.0).abs() < 0.01, "{border} {distance}");
    // Most of it is a match; the rest is a piece too many.
    let reseeded = |params: &mut ClusterParams| params.leftovers = Leftovers::Reseeded;
    let failures = Scene::new(&["aaaaaacc"], truth, truth, reseeded).failures();
    let told: Vec<_> = failures.iter().map(|one| (one.side, one.judged.points)).collect();
    assert_eq!(told, [(ObjectOrigin::Found, 2)]);
    assert_eq!(failures[0].cause.step(), "merge");
}

fn by_size(params: &mut ClusterParams) {
    params.fragments = ClusterParams::best().fragments;
}

#[test]
fn the_merge_by_size_joins_or_leaves_apart() {
    let truth = &["AAAACCCC"];
    let joined = Scene::new(&["aaaacccc"], truth, truth, by_size).of('A');
    let Cause::Post(posted) = &joined.cause else { panic!("{:?}", joined.cause) };
    let PostMergeCause::Joined(join) = &**posted else { panic!("{posted:?}") };
    assert_eq!((join.target, join.query, joined.show.clone()), (1, 2, vec![3, 4]));
    assert!(matches!(join.evidence, Evidence::Fits { .. }));

    let truth = &["AAAAAAAA"];
    let apart = Scene::new(&["aaaadddd"], truth, truth, by_size).of('A');
    let Cause::Post(posted) = &apart.cause else { panic!("{:?}", apart.cause) };
    let PostMergeCause::Apart(PostMergeStage::Fragments { test: Some(test), .. }) = &**posted
    else {
        panic!("{posted:?}");
    };
    assert!(test.gap >= test.too_far);
    assert!(apart.cause.describe().contains("a gap of 10.00 m, bridged up to"), "{apart:?}");
}

#[test]
fn the_birds_eye_merge_joins() {
    let margin = |params: &mut ClusterParams| {
        let paper = ClusterParams::paper().birds_eye;
        params.birds_eye =
            paper.map(|paper| BirdsEye { margin: 3.0, region: Region::Box, ..paper });
    };
    let truth = &["AAAACCCC"];
    let joined = Scene::new(&["aaaacccc"], truth, truth, margin).of('A');
    let Cause::Post(posted) = &joined.cause else { panic!("{:?}", joined.cause) };
    assert!(matches!(
        &**posted,
        PostMergeCause::Overlapped(PostMergeStage::BirdsEye { joined: true, .. })
    ));
    assert_eq!(joined.show, [3, 4]);
}

#[test]
fn the_minimum_size_drops_it() {
    let truth = &["AAAA...."];
    let dropped = Scene::new(&["aaaaaaaa"], truth, truth, |params| params.min_pixels = 5).of('A');
    let expected = PostMergeCause::TooSmall { dropped: 4, pixels: 4, minimum: 5 };
    assert_eq!(dropped.cause, Cause::Post(Box::new(expected)));
}
