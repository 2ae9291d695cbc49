//! What the inspector says where there are no classes, and of parameters that do nothing.

use std::collections::BTreeSet;

use divmerge::annotate::{AnnotateConfig, Semantics};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::{Desk, options, points_of_largest, unpacked};
use crate::recordings::drive;
use divmerge::inspect::SessionOptions;

fn desk(semantics: Semantics) -> (TempDir, Desk) {
    let (folder, input) = drive(2);
    let config = AnnotateConfig { semantics, ..AnnotateConfig::default() };
    let desk = Desk::with(SessionOptions { config, ..options(&input) });
    (folder, desk)
}

/// Pixels of a node with those of its parts.
fn pixels(nodes: &[Value], node: &Value) -> BTreeSet<u64> {
    let numbers = |value: &Value| -> Vec<u64> {
        value.as_array().unwrap().iter().filter_map(Value::as_u64).collect()
    };
    let runs = numbers(&node["runs"]);
    let own = runs.chunks(2).flat_map(|run| run[0]..run[0] + run[1]);
    let of_parts = numbers(&node["parts"]).into_iter();
    let of_parts = of_parts.flat_map(|part| pixels(nodes, &nodes[part as usize]));
    let all: Vec<u64> = own.chain(of_parts).collect();
    let set: BTreeSet<u64> = all.iter().copied().collect();
    assert_eq!(set.len(), all.len(), "a pixel is in a node and in its part");
    set
}

#[test]
fn the_chain_of_merges_leads_from_both_points_to_where_they_join() {
    let (_folder, desk) = desk(Semantics::Ground);
    let picture = desk.asked("api/frame", Some(&desk.frame(json!({}))));
    let (_, instance) = unpacked(&picture.body, "instance");
    let (_, pixel_of_point) = unpacked(&picture.body, "pixel_of_point");
    let points = points_of_largest(&instance);
    let found = desk.answer("api/explain", &desk.frame(json!({ "points": points })));
    let nodes = found["nodes"].as_array().unwrap();
    assert!(nodes.len() > 1, "{}", found["text"]);
    for node in nodes {
        let own = pixels(nodes, node);
        assert_eq!(node["pixels"], own.len(), "node {}", node["node"]);
        for (number, &point) in points.iter().enumerate() {
            let holds = node["holds"].as_array().unwrap().contains(&json!(number));
            assert_eq!(own.contains(&u64::from(pixel_of_point[point])), holds, "{node}");
        }
    }
    // They join in the first that holds both, and the one that was chosen is their instance.
    let both = |node: &&Value| node["holds"] == json!([0, 1]);
    assert!(nodes.iter().any(|node| both(&node)));
    let chosen = nodes.iter().find(|node| node["is_chosen"] == true);
    if found["report"]["answer"] == "one_instance"
        && let Some(chosen) = chosen
    {
        assert!(both(&chosen) && chosen["is_on_the_way"] == true);
        let own = pixels(nodes, chosen);
        let (_, point_of_pixel) = unpacked(&picture.body, "point_of_pixel");
        let ids: BTreeSet<u32> =
            own.iter().map(|&pixel| instance[point_of_pixel[pixel as usize] as usize]).collect();
        assert_eq!(ids, BTreeSet::from([instance[points[0]]]));
    }
    // Their order is that of the gaps across which they became one.
    let mut by_order: Vec<&Value> = nodes.iter().collect();
    by_order.sort_by_key(|node| node["order"].as_u64());
    let gaps: Vec<f64> = by_order.iter().filter_map(|node| node["gaps"][0].as_f64()).collect();
    assert!(gaps.is_sorted() && gaps.len() == nodes.len(), "{gaps:?}");
}

#[test]
fn with_classes_there_is_no_tree() {
    let (_folder, desk) = desk(Semantics::Auto);
    let picture = desk.asked("api/frame", Some(&desk.frame(json!({}))));
    let points = points_of_largest(&unpacked(&picture.body, "instance").1);
    let found = desk.answer("api/explain", &desk.frame(json!({ "points": points })));
    assert_eq!(found["nodes"], json!([]));
}

/// Values of a parameter that are far from each other.
fn values(parameter: &Value) -> Vec<Value> {
    match parameter["kind"].as_str().unwrap() {
        "flag" | "switch" => vec![json!(true), json!(false)],
        "choice" => {
            let choices = parameter["choices"].as_array().unwrap().iter();
            choices.map(|choice| choice["name"].clone()).collect()
        }
        "whole" => {
            let ends = parameter["slider"].as_array().cloned().unwrap_or_default();
            ends.iter().filter_map(Value::as_f64).map(|end| json!(end as u64)).collect()
        }
        _ => parameter["slider"].as_array().cloned().unwrap_or_default(),
    }
}

#[test]
fn parameters_that_are_said_to_do_nothing_do_nothing() {
    for semantics in [Semantics::Ground, Semantics::Auto] {
        let (_folder, desk) = desk(semantics);
        let parameters = desk.answer("api/session", &json!({}))["parameters"].clone();
        let plain = desk.asked("api/frame", Some(&desk.frame(json!({}))));
        let (header, expected) = unpacked(&plain.body, "instance");
        let idle = header["run"]["idle"].as_object().unwrap();
        assert!(!idle.is_empty());
        let mut tried = 0;
        for parameter in parameters.as_array().unwrap() {
            let path = parameter["path"].as_str().unwrap();
            for value in values(parameter).into_iter().filter(|_| idle.contains_key(path)) {
                let setting = json!({ "setting": { "set": { path: value } } });
                let reply = desk.asked("api/frame", Some(&desk.frame(setting)));
                // A part that is off takes no values.
                if reply.status == 200 {
                    let (_, found) = unpacked(&reply.body, "instance");
                    assert!(found == expected, "{path} = {value} changes something");
                    tried += 1;
                }
            }
        }
        assert!(tried > 10, "{tried}");
    }
}
