//! The icicles around all objects of a simulated cloud.

use super::*;
use divmerge_core::cloud::PointCloud;
use divmerge_core::pipeline::{self, Config, Stages};
use divmerge_core::semantics::{GroundParams, MaskSource};
use divmerge_simulate::{Drive, Scene, Sensor};

const AREA: Area = Area { x: 20.0, y: 10.0, width: 480.0, height: 300.0 };

fn clustered() -> (PointCloud, Stages) {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 3).frame(2).cloud;
    let ground = GroundParams::default();
    let stages = pipeline::run(&cloud, MaskSource::NotGround(&ground), &Config::best());
    (cloud, stages)
}

fn scene<'a>((cloud, stages): &'a (PointCloud, Stages)) -> FrameScene<'a> {
    FrameScene {
        cloud,
        stages,
        classes: &[],
        intensity: None,
        merge_ratio: 0.5,
        colour_numbers: Vec::new(),
        heading: String::new(),
        remark: String::new(),
        theme: crate::view::Theme::default(),
    }
}

/// Calls with the icicle around each object.
fn for_each_icicle(mut call: impl FnMut(&Icicle, u32)) {
    let clustered = clustered();
    let scene = scene(&clustered);
    let tree = clustered.1.post_merge.tree.as_ref().expect("a tree");
    assert!(tree.cut.chosen.len() > 5, "{:?}", tree.cut.chosen);
    for &object in &tree.cut.chosen {
        let tops = tops(tree, &[object]);
        call(&Icicle::new(&scene, tree, &tops, AREA), object);
    }
}

#[test]
fn children_lie_below_their_parent_and_beside_each_other() {
    let mut families = 0;
    for_each_icicle(|icicle, _| {
        let area = |node: u32| {
            icicle.boxes.iter().find(|found| found.facts.node == node).expect("a box").area
        };
        for parent in &icicle.boxes {
            let plot = Area { width: icicle.plot.width + 1e-9, ..icicle.plot };
            assert!(plot.holds(&parent.area), "{parent:?}");
            let Some([one, other]) = parent.facts.place.children.map(|pair| pair.map(area)) else {
                continue;
            };
            families += 1;
            for child in [one, other] {
                assert_eq!(child.y, parent.area.bottom());
                assert!(child.x >= parent.area.x - 1e-9);
                assert!(child.right() <= parent.area.right() + 1e-9);
            }
            assert!(one.right() <= other.x + 1e-9);
        }
    });
    assert!(families > 50, "{families}");
}

#[test]
fn all_objects_below_the_tops_are_there_in_their_colours() {
    for_each_icicle(|icicle, object| {
        let is_below =
            |&node: &u32| icicle.tree.tree.path(node).any(|above| icicle.tops.contains(&above));
        let chosen = icicle.tree.cut.chosen.iter().copied();
        let expected: Vec<u32> = chosen.filter(is_below).collect();
        let mut drawn: Vec<u32> = icicle.objects().map(|node| node.facts.node).collect();
        drawn.sort_unstable();
        assert!(drawn == expected && drawn.contains(&object));
        let (stages, tree) = (icicle.scene.stages, &icicle.tree.tree);
        let colours = icicle.colour_of_pixel();
        for &object in icicle.tops.iter().flat_map(|&top| tree.pixels_of(&tree.nodes[top as usize]))
        {
            let pixel = stages.objects.pixel[object as usize] as usize;
            let point = stages.image.point_at(pixel).expect("an object pixel");
            let instance = stages.labels.instance[point];
            let smallest = icicle.tree.node_of_pixel[object as usize].expect("a node");
            let is_object = tree.path(smallest).any(|node| expected.contains(&node));
            let colour = if is_object { icicle.scene.colour(instance) } else { BACKGROUND };
            assert_eq!(colours[pixel], Some(colour));
        }
    });
}

#[test]
fn every_pixel_has_a_place_in_the_plot() {
    for_each_icicle(|icicle, object| {
        let tree = &icicle.tree.tree;
        let mut last = icicle.plot.x - 1.0;
        for &pixel in tree.pixels_of(&tree.nodes[object as usize]) {
            let [x, y] = icicle.place(pixel).expect("a place");
            assert!(x > last && icicle.plot.holds(&Area { x, y, width: 0.0, height: 0.0 }));
            last = x;
        }
    });
}

#[test]
fn gaps_are_on_a_logarithmic_axis() {
    for_each_icicle(|icicle, _| {
        let [low, high] = icicle.gaps;
        let middle = (low * high).sqrt();
        let y = [low, middle, high].map(|gap| icicle.y(gap as f32));
        let Area { y: top, height, .. } = icicle.plot;
        let expected = [top + height, top + height / 2.0, top];
        assert!(y.iter().zip(expected).all(|(y, expected)| (y - expected).abs() < 1e-3));
    });
}

#[test]
fn points_of_two_trees_have_two_tops_and_points_of_one_object_its_surroundings() {
    let (_, stages) = clustered();
    let tree = stages.post_merge.tree.as_ref().expect("a tree");
    let root = |node: u32| tree.tree.path(node).last();
    let chosen = &tree.cut.chosen;
    let apart = chosen.iter().find(|&&other| root(other) != root(chosen[0]));
    let apart = *apart.expect("an object of another tree");
    assert_eq!(tops(tree, &[chosen[0], apart]).len(), 2);
    for &object in chosen {
        let top = tops(tree, &[object, object]);
        let above: Vec<u32> = tree.tree.path(object).skip(1).collect();
        let scored = above.iter().find(|&&node| tree.scores[node as usize].is_some());
        assert_eq!(top, [*scored.unwrap_or(&object)]);
    }
}
