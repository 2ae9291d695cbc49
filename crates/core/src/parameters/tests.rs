use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::*;
use crate::pipeline::{Config, Preset};

const PRESETS: [Preset; 3] = [Preset::Best, Preset::Paper, Preset::Authors];

fn best() -> ParameterSet {
    ParameterSet::of_preset(Preset::Best)
}

/// Preset `best` with every part on.
fn everything() -> ParameterSet {
    let mut all = best();
    for switch in registry().iter().filter(|parameter| parameter.kind == ParameterKind::Switch) {
        all.set(&switch.path, &true.into()).unwrap();
    }
    all.set("cluster.condition.rays", &"nominal".into()).unwrap();
    all
}

/// Paths of all values in a tree; lists are values.
fn leaves(value: &Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => fields.iter().for_each(|(name, value)| {
            let separator = if path.is_empty() { "" } else { "." };
            leaves(value, &format!("{path}{separator}{name}"), found);
        }),
        _ => drop(found.insert(path.to_owned())),
    }
}

fn problem(parameters: &mut ParameterSet, path: &str, value: Value) -> String {
    let before = parameters.clone();
    let problem = parameters.set(path, &value).unwrap_err().to_string();
    assert_eq!(*parameters, before, "{path}");
    problem
}

#[test]
fn every_value_of_the_structs_is_a_parameter_with_a_meaning() {
    let mut written = BTreeSet::new();
    leaves(&serde_json::to_value(everything()).unwrap(), "", &mut written);
    let is_value = |parameter: &&Parameter| match &parameter.kind {
        ParameterKind::Switch => false,
        // The names of variants with values of their own are keys.
        ParameterKind::Choice { .. } => parameter.path != "cluster.condition.rays",
        _ => true,
    };
    let listed: BTreeSet<String> =
        registry().iter().filter(is_value).map(|parameter| parameter.path.clone()).collect();
    assert_eq!(listed, written);
    for Parameter { path, doc, kind, .. } in registry() {
        assert!(doc.ends_with('.') && doc.len() > 10 && !doc.contains("[`"), "{path}: {doc}");
        match kind {
            ParameterKind::Number { limits } | ParameterKind::Whole { limits } => {
                let slider = limits.slider.unwrap_or_else(|| panic!("{path} has no usual range"));
                assert!(slider[0] < slider[1], "{path}: {slider:?}");
            }
            ParameterKind::Choice { choices } => {
                assert!(choices.len() > 1 && choices.iter().all(|c| !c.doc.is_empty()), "{path}");
            }
            _ => {}
        }
    }
}

#[test]
fn presets_are_within_the_limits_and_stay_as_they_are() {
    for preset in PRESETS {
        let (mut parameters, usual) =
            (ParameterSet::of_preset(preset), ParameterSet::of_preset(preset));
        assert_eq!(usual.config(), preset.config());
        for Parameter { path, .. } in registry() {
            if let Some(value) = usual.get(path).unwrap() {
                parameters.set(path, &value).unwrap();
            }
        }
        assert_eq!(parameters, usual);
    }
}

/// The number that a doc comment calls the default.
fn told_default(doc: &str) -> Option<f64> {
    let (_, rest) = doc.split_once("Default ")?;
    let number: String = rest.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    let number: f64 = number.trim_end_matches('.').parse().ok()?;
    Some(if rest.contains("degrees") { number.to_radians() } else { number })
}

#[test]
fn the_defaults_that_docs_tell_are_those_of_the_default_preset() {
    let mut told = 0;
    for Parameter { path, doc, .. } in registry() {
        let value = best().get(path).unwrap().and_then(|value| value.as_f64());
        if let (Some(default), Some(value)) = (told_default(doc), value) {
            // A unit after the number counts only up to the next sentence.
            let degrees = default.to_degrees();
            assert!([default, degrees].iter().any(|d| (d - value).abs() < 1e-12), "{path}: {doc}");
            told += 1;
        }
    }
    assert!(told > 50, "{told}");
}

#[test]
fn values_are_read_as_at_a_command_line() {
    let mut parameters = best();
    let mut set = |path: &str, text: &str| {
        parameters.set(path, &text.into()).unwrap_or_else(|problem| panic!("{problem}"));
    };
    set("cluster.voxel", "0.25");
    set("cluster.condition.angle", "8deg");
    set("cluster.gap_columns", "unlimited");
    set("cluster.same_class_neighbours", "off");
    set("cluster.seeding", "at_pop");
    set("projection.rows", "32");
    set("projection.field_of_view", "3 deg, -25 deg");
    set("ego_motion.voxels", "[1, 2.5]");
    set("cluster.tree", "off");
    set("smoothing.rounds", "0");
    let Config { cluster, projection, smoothing, .. } = parameters.config();
    assert_eq!(
        (cluster.voxel, cluster.condition.angle, cluster.gap_columns),
        (0.25, 8_f64.to_radians(), usize::MAX)
    );
    assert!(!cluster.same_class_neighbours && cluster.tree.is_none());
    assert_eq!(projection.rows, Some(32));
    assert_eq!(projection.field_of_view, Some((3_f64.to_radians(), -25_f64.to_radians())));
    assert_eq!(smoothing.unwrap().rounds, 0);
    assert_eq!(parameters.ego_motion.voxels, [1.0, 2.5]);
    parameters.set("projection.rows", &"auto".into()).unwrap();
    assert_eq!(parameters.get("projection.rows"), Ok(Some(json!("auto"))));
    assert_eq!(parameters.get("cluster.gap_columns"), Ok(Some(json!("unlimited"))));
    assert_eq!(parameters.get("cluster.seeding"), Ok(Some(json!("at_pop"))));
    // From a slider, and from a file in which a number has no point.
    parameters.set("cluster.gap_columns", &json!(3.0)).unwrap();
    parameters.set("cluster.voxel", &json!(1)).unwrap();
    assert_eq!((parameters.cluster.gap_columns, parameters.cluster.voxel), (3, 1.0));
}

#[test]
fn what_cannot_be_is_refused_with_what_can() {
    let mut parameters = best();
    let mut problem = |path: &str, value: Value| problem(&mut parameters, path, value);
    assert_eq!(
        problem("cluster.voxle", json!(1)),
        "no parameter `cluster.voxle`; did you mean `cluster.voxel`?"
    );
    assert_eq!(
        problem("voxel", json!(1)),
        "no parameter `voxel`; did you mean `cluster.voxel` or `registration.voxel`?"
    );
    assert_eq!(
        problem("colour", json!(1)),
        "no parameter `colour`; `divmerge params` lists them all"
    );
    assert_eq!(
        problem("cluster.voxel", json!(0)),
        "`cluster.voxel` = 0: must be a number above 0 (m)"
    );
    assert_eq!(
        problem("cluster.condition.angle", "90 deg".into()),
        "`cluster.condition.angle` = 90 deg: must be a number from 0 below 1.570796 (rad, or \
         degrees as in `10 deg`)"
    );
    assert_eq!(
        problem("projection.rows", json!(2000)),
        "`projection.rows` = 2000: must be a whole number from 1 to 1024 (pixels), or auto"
    );
    assert_eq!(
        problem("cluster.seeding", "never".into()),
        "`cluster.seeding` = never: must be at_once or at_pop"
    );
    assert_eq!(
        problem("cluster.seeding", "at_onec".into()),
        "`cluster.seeding` = at_onec: must be at_once or at_pop; did you mean `at_once`?"
    );
    assert_eq!(
        problem("cluster.birds_eye.margin", json!(0.2)),
        "`cluster.birds_eye.margin` has no effect while `cluster.birds_eye` is off: set \
         cluster.birds_eye=true first"
    );
    assert_eq!(
        problem("cluster.condition.rays.nominal.row_step", json!(0.01)),
        "`cluster.condition.rays.nominal.row_step` has no effect while `cluster.condition.rays` \
         is off: set cluster.condition.rays=nominal first"
    );
    assert!(problem("projection.field_of_view", json!([-0.4, 0.1])).contains("upper edge"));
    for wrong in [json!("inf"), json!("NaN"), json!(null), json!("0.3 deg"), json!([1])] {
        assert!(problem("cluster.voxel", wrong).contains("must be a number"));
    }
    assert!(problem("projection.rows", json!("inf")).contains("whole number"));
}

#[test]
fn a_part_that_is_switched_on_has_its_usual_values() {
    let mut parameters = ParameterSet::of_preset(Preset::Paper);
    for (path, usual) in [
        ("cluster.tree", Preset::Best),
        ("cluster.fragments", Preset::Best),
        ("smoothing", Preset::Best),
        ("cluster.condition.nearness", Preset::Best),
        ("cluster.condition.gate", Preset::Authors),
    ] {
        assert_eq!(parameters.get(path), Ok(Some(false.into())), "{path}");
        parameters.set(path, &true.into()).unwrap();
        let usual = ParameterSet::of_preset(usual);
        for Parameter { path: below, .. } in registry() {
            if below.starts_with(&format!("{path}.")) {
                assert_eq!(parameters.get(below), usual.get(below));
            }
        }
    }
    parameters.set("cluster.tree.gap", &json!(0.02)).unwrap();
    parameters.set("cluster.tree", &true.into()).unwrap();
    assert_eq!(parameters.get("cluster.tree.gap"), Ok(Some(json!(0.02))));
    let authors = ParameterSet::of_preset(Preset::Authors);
    parameters.set("cluster.condition.rays", &"nominal".into()).unwrap();
    assert_eq!(parameters.cluster.condition.rays, authors.cluster.condition.rays);
    parameters.set("cluster.condition.rays", &"measured".into()).unwrap();
    assert_eq!(parameters.get("cluster.condition.rays"), Ok(Some(json!("measured"))));
}

#[test]
fn parameters_that_contradict_each_other_are_refused() {
    let mut authors = ParameterSet::of_preset(Preset::Authors);
    assert!(
        problem(&mut authors, "cluster.birds_eye.region", "hull".into()).contains("region box")
    );
    authors.set("cluster.birds_eye.transitive", &true.into()).unwrap();
    authors.set("cluster.birds_eye.region", &"hull".into()).unwrap();
}
