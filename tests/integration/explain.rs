//! Explanations agree with the run they explain, and what they say would change the answer does.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use divmerge::cloud::Reason;
use divmerge::cluster::tree::cut::cut as best_cut;
use divmerge::diagnose::explain::{
    Answer, ClusteredCloud, Flip, Link, Rule, Subject, VoteEvidence, WhatIf, answer, explain,
    what_if,
};
use divmerge::parameters::ParameterSet;
use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

use crate::recordings::drive;

fn presets() -> [Config; 3] {
    [Config::paper(), Config::best(), Config::authors()]
}

fn cloud() -> PointCloud {
    Drive::new(Sensor::Vlp16, Scene::Parking, 3).frame(2).cloud
}

/// Some object points, spread over the cloud, the same in every run.
fn some_points(stages: &Stages, count: usize) -> Vec<usize> {
    let objects: Vec<usize> =
        (0..stages.mask.is_object.len()).filter(|&point| stages.mask.is_object[point]).collect();
    (0..count).map(|k| objects[(k * 7919 + 13) % objects.len()]).collect()
}

/// V+ and V- as the pairs of a link count: two for each.
fn counted(link: &Link) -> (u64, u64) {
    let in_favour = link.pairs.iter().filter(|pair| pair.holds).count() as u64;
    (2 * in_favour, 2 * (link.pairs.len() as u64 - in_favour))
}

fn check_link(link: &Link, frame: &ClusteredCloud, changes_hands: bool) {
    let inherited = link.inherited.iter();
    let (positive, negative) = inherited
        .fold((link.own_positive, link.own_negative), |sum, donor| {
            (sum.0 + donor.positive, sum.1 + donor.negative)
        });
    assert_eq!((positive, negative), (link.positive, link.negative));
    if !changes_hands {
        assert_eq!(counted(link), (positive, negative), "{} asks {}", link.target, link.query);
    }
    for pair in &link.pairs {
        let holds = match pair.rule {
            Rule::Angle => pair.beta_degrees.to_radians() > frame.config.cluster.condition.angle,
            Rule::Nearness { distance, reach } => distance < reach,
            Rule::Gate => pair.holds,
        };
        assert_eq!(pair.holds, holds, "{pair:?}");
    }
}

#[test]
fn answers_are_those_of_the_labels_and_chains_those_of_the_merge() {
    let (cloud, taxonomy) = (cloud(), Taxonomy::semantic_kitti());
    let mask = MaskSource::Classes(&taxonomy);
    for config in presets() {
        let stages = pipeline::run(&cloud, mask, &config);
        let frame = ClusteredCloud { cloud: &cloud, mask, config: &config, stages: &stages };
        let points = some_points(&stages, 400);
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for pair in points.windows(2).filter(|pair| pair[0] != pair[1]) {
            let found = explain(&frame, Subject::Pair(pair[0], pair[1]));
            let [a, b] = [pair[0], pair[1]].map(|point| stages.labels.instance[point]);
            assert_eq!(found.answer == Answer::OneInstance, a == b && a != 0);
            let components = found.points.iter().map(|point| point.component);
            let ends: Vec<u32> = components.flatten().map(|component| component.label).collect();
            for (point, facts) in pair.iter().zip(&found.points) {
                let label = facts.component.map_or(0, |component| component.label);
                if stages.labels.instance[*point] != 0 {
                    assert_eq!(label, stages.labels.component[*point]);
                }
            }
            match found.votes {
                Some(VoteEvidence::Chain { links }) => {
                    *seen.entry("chain").or_default() += 1;
                    let mut at = ends[0];
                    for link in &links {
                        let step = stages.merge.steps.iter().find(|step| step.query == link.query);
                        let step = step.expect("a merge that happened");
                        assert_eq!(step.target, link.target);
                        let votes = (step.positive, step.negative);
                        assert_eq!(votes, (link.positive, link.negative));
                        check_link(link, &frame, found.pixels_change_hands);
                        assert!(at == link.target || at == link.query);
                        at = link.target + link.query - at;
                    }
                    assert_eq!(at, ends[1]);
                }
                Some(VoteEvidence::Failed { links, groups, weakest, short_by }) => {
                    *seen.entry("failed").or_default() += 1;
                    assert_eq!(links.len() + 1, groups.len());
                    assert!(short_by != Some(0) && weakest < links.len());
                    for link in &links {
                        assert!(link.short_by(config.cluster.merge_ratio) != Some(0));
                        assert!(link.positive > 0);
                        check_link(link, &frame, found.pixels_change_hands);
                    }
                }
                Some(VoteEvidence::OneComponent { .. }) => assert_eq!(ends[0], ends[1]),
                _ => {}
            }
        }
        assert!(seen.get("chain") > Some(&3), "{}: {seen:?}", config.preset);
    }
}

#[test]
fn every_merge_is_explained_by_its_own_votes() {
    let (cloud, taxonomy) = (cloud(), Taxonomy::semantic_kitti());
    let mask = MaskSource::Classes(&taxonomy);
    for config in presets() {
        let stages = pipeline::run(&cloud, mask, &config);
        let frame = ClusteredCloud { cloud: &cloud, mask, config: &config, stages: &stages };
        let mut point_of: BTreeMap<u32, usize> = BTreeMap::new();
        for (object, &label) in stages.components.label.iter().enumerate() {
            let pixel = stages.objects.pixel[object] as usize;
            point_of.insert(label, stages.image.point_at(pixel).expect("an object"));
        }
        for step in stages.merge.steps.iter().step_by(5) {
            let (Some(&a), Some(&b)) = (point_of.get(&step.target), point_of.get(&step.query))
            else {
                continue; // a component whose pixels all changed hands
            };
            let found = explain(&frame, Subject::Pair(a, b));
            let Some(VoteEvidence::Chain { links }) = found.votes else {
                panic!("{}: {step:?}: {:?}", config.preset, found.votes);
            };
            assert_eq!(links.len(), 1);
            assert_eq!(
                (links[0].positive, links[0].negative),
                (step.positive, step.negative),
                "{}: {step:?}",
                config.preset
            );
        }
    }
}

#[test]
fn reported_changes_flip_the_answer_and_smaller_ones_do_not() {
    let (cloud, taxonomy) = (cloud(), Taxonomy::semantic_kitti());
    let mask = MaskSource::Classes(&taxonomy);
    let mut flips = 0;
    for config in [Config::paper(), Config::best()] {
        let stages = pipeline::run(&cloud, mask, &config);
        let frame = ClusteredCloud { cloud: &cloud, mask, config: &config, stages: &stages };
        let largest = stages.instances.iter().max_by_key(|instance| instance.points);
        let largest = largest.expect("an instance").id;
        let of_largest: Vec<usize> =
            (0..cloud.len()).filter(|&point| stages.labels.instance[point] == largest).collect();
        let subject = Subject::Pair(of_largest[0], of_largest[of_largest.len() - 1]);
        let now = answer(&stages, subject);
        assert_eq!(now, Answer::OneInstance);
        for found in what_if(&frame, subject) {
            let WhatIf::Number(number) = found else {
                continue;
            };
            for Flip { value, unchanged_at } in [number.lower, number.higher].into_iter().flatten()
            {
                flips += 1;
                assert!((unchanged_at - number.now).abs() < (value - number.now).abs());
                for (value, changes) in [(value, true), (unchanged_at, false)] {
                    let mut set = ParameterSet::of(&config, &GroundParams::default());
                    let value = match number.unit {
                        "degrees" => value.to_radians(),
                        _ => value,
                    };
                    set.set(number.path, &value.into()).expect("may be set");
                    let config = set.config();
                    let again = answer(&pipeline::run(&cloud, mask, &config), subject);
                    assert_eq!(again != now, changes, "{} at {value}", number.parameter);
                }
            }
        }
    }
    assert!(flips >= 3, "only {flips}");
}

#[test]
fn without_classes_the_ground_is_searched_too() {
    let (cloud, config, ground) = (cloud(), Config::best(), GroundParams::default());
    let mask = MaskSource::NotGround(&ground);
    let stages = pipeline::run(&cloud, mask, &config);
    let frame = ClusteredCloud { cloud: &cloud, mask, config: &config, stages: &stages };
    // Of a point on the ground only what makes the ground is searched, of others all that matters.
    let point = |wanted: bool| {
        let has = |&point: &usize| cloud.is_return(point) && stages.mask.is_object[point] == wanted;
        (0..cloud.len()).find(has).expect("ground and objects")
    };
    let paths = |point: usize| -> Vec<&str> {
        let path = |found: &WhatIf| match found {
            WhatIf::Number(number) => Some(number.path),
            WhatIf::Choice(choice) => choice.path,
        };
        what_if(&frame, Subject::Point(point)).iter().filter_map(path).collect()
    };
    let of_ground = paths(point(false));
    assert!(of_ground.contains(&"ground.step"), "{of_ground:?}");
    assert!(of_ground.iter().all(|path| path.starts_with("ground.")), "{of_ground:?}");
    let all = paths(point(true));
    for path in ["ground.step", "cluster.tree.gap", "cluster.tree.nearest", "projection.wrap"] {
        assert!(all.contains(&path), "{path}: {all:?}");
    }
    assert!(!all.iter().any(|path| path.starts_with("smoothing.")), "{all:?}");
}

/// Two points of each instance, and points beside each other of two instances.
fn ends_and_neighbours(stages: &Stages) -> Vec<[usize; 2]> {
    let labels = &stages.labels.instance;
    let ends = (1..=stages.instances.len() as u32).filter_map(|id| {
        let first = labels.iter().position(|&of| of == id)?;
        let last = labels.iter().rposition(|&of| of == id)?;
        (first != last).then_some([first, last])
    });
    let objects = &stages.objects;
    let point = |object: usize| {
        stages.image.point_of_pixel.values()[objects.pixel[object] as usize] as usize
    };
    let right = |object: usize| objects.neighbours[object][1] as usize;
    let beside = (0..objects.len()).filter(|&object| right(object) < objects.len());
    let pairs = beside.map(|object| [object, right(object)].map(point));
    let apart = pairs.filter(|&[a, b]| labels[a] != labels[b] && labels[a] * labels[b] != 0);
    ends.chain(apart.step_by(10)).collect()
}

/// Without classes: the nodes say what the labels say, and the change that is named changes the
/// cut.
#[test]
fn a_cut_is_explained_by_its_nodes_and_by_what_would_change_it() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Crowd, 4).frame(2);
    let (ground, config) = (GroundParams::default(), Config::best());
    let mask = MaskSource::NotGround(&ground);
    let stages = pipeline::run(&frame.cloud, mask, &config);
    let tree = stages.post_merge.tree.as_ref().expect("no classes");
    let params = config.cluster.tree.expect("best cuts a tree");
    let clustered = ClusteredCloud { cloud: &frame.cloud, mask, config: &config, stages: &stages };
    let mut flips = [0, 0];
    for [a, b] in ends_and_neighbours(&stages) {
        let found = explain(&clustered, Subject::Pair(a, b));
        let Some(cut) = found.cut() else {
            assert!(found.points.iter().any(|point| point.reason != Reason::None));
            continue;
        };
        assert!(found.votes.is_none());
        assert_eq!(cut.joined, found.answer == Answer::OneInstance);
        let above = cut.common.windows(2).all(|two| two[0].place.parent == Some(two[1].node));
        assert!(above, "{cut:?}");
        let Some(flip) = cut.flip else { continue };
        let is_chosen = |score: f64| {
            let mut gain = tree.gain.clone();
            gain[flip.node as usize] =
                if score < params.least_score { 0.0 } else { score.powf(params.power) };
            best_cut(&tree.tree.nodes, &gain).chosen.contains(&flip.node)
        };
        assert_eq!([1e-6, -1e-6].map(|by| is_chosen(flip.needed + by)), [true, false], "{flip:?}");
        assert_eq!(is_chosen(flip.score), cut.joined);
        flips[usize::from(cut.joined)] += 1;
    }
    assert!(flips.iter().all(|&count| count > 5), "{flips:?}");
}

fn divmerge(input: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_divmerge"));
    command.arg("explain").arg(input).args(arguments).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Two points of different components of the largest instance of the first frame, as --at takes
/// them.
fn two_points() -> [String; 2] {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0).cloud;
    let taxonomy = Taxonomy::semantic_kitti();
    let config = Config::paper();
    let stages = pipeline::run(&cloud, MaskSource::Classes(&taxonomy), &config);
    let step = stages.merge.steps.first().expect("a merge");
    [step.target, step.query].map(|label| {
        let of_label = |&point: &usize| stages.labels.component[point] == label;
        let point = (0..cloud.len()).find(of_label).expect("a point");
        let [x, y, z] = cloud.position(point);
        format!("{x},{y},{z}")
    })
}

#[test]
fn text_shows_the_votes_and_json_parses() {
    let (_folder, input) = drive(1);
    let [a, b] = two_points();
    let paper = ["--preset", "paper", "--no-what-if"];
    let at = ["--at", a.as_str(), "--at", b.as_str()];
    let done = divmerge(&input, &[&at[..], &paper].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    assert!(said.starts_with("Yes, A and B are one: instance"), "{said}");
    assert!(said.contains("V+") && said.contains("counts twice"), "{said}");

    let done = divmerge(&input, &[&at[..], &["--preset", "paper", "--json"]].concat());
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert_eq!(report["answer"], "one_instance");
    assert_eq!(report["votes"]["kind"], "chain");
    assert!(report["votes"]["links"][0]["pairs"][0]["beta_degrees"].is_number(), "{report}");
    assert!(report["what_if"].as_array().is_some_and(|found| found.len() > 5), "{report}");

    let done = divmerge(&input, &[&at[..2], &paper].concat());
    assert!(text(&done.stdout).starts_with("The point has instance"), "{}", text(&done.stdout));
    let done = divmerge(&input, &["--instance", "1", "--instance", "2", "--no-what-if"]);
    assert!(text(&done.stdout).starts_with("No, A has instance 1"), "{}", text(&done.stdout));
}

#[test]
fn pictures_are_the_same_twice_and_existing_ones_stay() {
    let (folder, input) = drive(1);
    let [a, b] = two_points();
    let draw = |name: &str, more: &[&str]| {
        let output = folder.path().join(name);
        let output = output.to_str().expect("a path in UTF-8");
        let question = ["--at", &a, "--at", &b, "--preset", "paper", "--no-what-if", "-o", output];
        (divmerge(&input, &[&question, more].concat()), output.to_owned())
    };
    let (once, path) = draw("once.png", &[]);
    assert_eq!(once.status.code(), Some(0), "{}", text(&once.stderr));
    assert!(text(&once.stdout).contains("wrote "), "{}", text(&once.stdout));
    let bytes = std::fs::read(path).expect("a picture");
    let reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a PNG");
    let info = reader.info();
    assert!(info.width == 2000 && info.height > 1000, "{} x {}", info.width, info.height);

    assert_eq!(draw("once.png", &[]).0.status.code(), Some(2));
    let (again, path) = draw("once.png", &["--force", "--json"]);
    assert!(serde_json::from_slice::<serde_json::Value>(&again.stdout).is_ok());
    assert!(bytes == std::fs::read(path).expect("a picture"), "the same bytes twice");
    let (svg, path) = draw("once.svg", &[]);
    assert_eq!(svg.status.code(), Some(0), "{}", text(&svg.stderr));
    let svg = std::fs::read_to_string(path).expect("a picture");
    assert!(svg.contains("Yes, A and B are one") && svg.contains("pairs in favour"));
    assert_eq!(draw("once.gif", &[]).0.status.code(), Some(2));
}

#[test]
fn pictures_without_classes_show_the_tree() {
    let (folder, input) = drive(1);
    let output = folder.path().join("tree.svg");
    let output = output.to_str().expect("a path in UTF-8");
    let question = ["--instance", "1", "--instance", "2", "--no-what-if", "-o", output];
    let draw = |semantics: &str| {
        let done =
            divmerge(&input, &[&question[..], &["--force", "--semantics", semantics]].concat());
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        std::fs::read_to_string(output).expect("a picture")
    };
    let svg = draw("ground");
    for words in ["tree of merges", "\"0.08 m\"", "\"2 m\"", " pixels\"", "\"A\"", "\"B\""] {
        assert!(svg.contains(words), "{words}");
    }
    // Each letter is on the image, in the tree and on the plane.
    assert_eq!(["\"A\"", "\"B\""].map(|letter| svg.matches(letter).count()), [3, 3]);
    assert!(!draw("auto").contains("tree of merges"));
}

#[test]
fn bad_questions_are_answered_with_what_there_is() {
    let (_folder, input) = drive(2);
    for (arguments, code, says) in [
        (&["--at", "1,2,900"][..], 1, "the nearest is"),
        (&["--frame", "2", "--at", "1,2,3"], 2, "2 clouds, numbered 0 to 1"),
        (&["--instance", "1", "--instance", "999"], 1, "instances are 1 to"),
        (&["--instance", "3", "--instance", "3"], 2, "different instances"),
        (&["--topic", "/nothing", "--at", "1,2,3"], 2, "/nothing"),
        (&[], 2, "say what to explain"),
        (&["--instance", "3"], 2, "takes two"),
        (&["--at", "1,2,3", "--at", "1,2,3", "--at", "1,2,3"], 2, "given 3 times"),
        #[cfg(not(feature = "rerun"))]
        (&["--at", "1,2,3", "--rerun", "f.rrd"], 2, "built without Rerun"),
        (&["--at", "1,2,3", "--rerun", "f.mcap"], 2, "must end in .rrd"),
        (&["--at", "1,2"], 2, "use x,y,z"),
        (&["--at", "1,2,3", "--instance", "1"], 2, "cannot be used with"),
    ] {
        let output = divmerge(&input, arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(says), "{arguments:?}: {said}");
    }
}
