//! Parameters set by path, listed, and taken from files and from recordings that a run wrote.

use std::path::{Path, PathBuf};

use divmerge::annotate::read_run;
use divmerge::parameters::registry;
use tempfile::TempDir;

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// Runs a command that must succeed, and gives what it prints.
fn done(arguments: &[&str]) -> String {
    let output = divmerge(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Runs a command whose arguments are wrong, and gives what it complains about.
fn refused(arguments: &[&str]) -> String {
    let output = divmerge(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stdout));
    text(&output.stderr)
}

/// An annotated recording in a folder of its own.
fn annotated(folder: &TempDir, name: &str, input: &Path, options: &[&str]) -> PathBuf {
    let output = folder.path().join(name);
    done(&[&["annotate", path(input), "-o", path(&output), "--no-layout"], options].concat());
    output
}

#[test]
fn a_run_is_repeated_from_its_output_alone() {
    let (folder, input) = drive(4);
    for (number, options) in [
        &["--set", "ground.step=0.31", "--set", "cluster.tree.gap=0.0123456789"][..],
        &["--semantics", "ground", "--set", "cluster.tree=off", "--bev", "hull", "--voxel", "0.37"],
        &["--preset", "authors", "--rows", "32", "--fov", "2.2,-24.9", "--only"],
        &["--preset", "paper", "--set", "cluster.condition.rays=nominal", "--track", "on"],
        &["--method", "dbscan", "--set", "method.reach=0.61", "--taxonomy", "semantic-kitti"],
        &["--lag", "0.3", "--set", "tracks.young=0.5", "--ego-motion", "estimate"],
        &["--sensor-frame", "rfu", "--sensor-origin", "0.1,0.2,0.3", "--max-range", "40.5"],
        &["--objects", "detection3d,all", "--compression", "lz4", "--from", "0.15", "--to", "0.35"],
        &["--topic", "/lidar/points", "--in-place-fields", "--crop=-30..30,..,..1.5"],
    ]
    .iter()
    .enumerate()
    {
        let first = annotated(&folder, &format!("{number}.mcap"), &input, options);
        let again = format!("again-{number}.mcap");
        let again = annotated(&folder, &again, &input, &["--config", path(&first)]);
        let [bytes, expected] = [again, first.clone()].map(|file| std::fs::read(file).unwrap());
        assert!(bytes == expected, "{options:?}");
        // And it is another than that of no options.
        let plain = annotated(&folder, &format!("plain-{number}.mcap"), &input, &[]);
        assert!(std::fs::read(plain).unwrap() != expected, "{options:?}");
    }
}

#[test]
fn what_is_given_goes_before_the_file() {
    let (folder, input) = drive(1);
    let options = ["--semantics", "ground", "--voxel", "0.3", "--preset", "paper"];
    let first = annotated(&folder, "first.mcap", &input, &options);
    let given = ["--config", path(&first), "--semantics", "all", "--voxel", "0.4"];
    let second = annotated(&folder, "second.mcap", &input, &given);
    let run = read_run(&second).unwrap();
    assert_eq!(run.options.given["semantics"], ["all"]);
    let value =
        |wanted: &str| run.values.iter().find(|(path, _)| path == wanted).unwrap().1.clone();
    assert_eq!((value("cluster.voxel"), value("cluster.gap_rows")), (0.4.into(), 1.into()));
    let said = refused(&[
        "annotate",
        path(&input),
        "-o",
        "x.mcap",
        "--config",
        path(&first),
        "--preset",
        "best",
    ]);
    assert!(said.contains("start from preset paper, not from best"), "{said}");
    // A command that has fewer options takes those it has.
    let shown = done(&[
        "explain",
        path(&input),
        "--config",
        path(&first),
        "--instance",
        "1",
        "--instance",
        "2",
        "--json",
    ]);
    let shown: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert_eq!((&shown["semantics"], &shown["preset"]), (&"ground".into(), &"paper".into()));
}

#[test]
fn options_that_name_files_are_asked_for_again() {
    let (folder, input) = drive(1);
    let taxonomy = folder.path().join("mine.yaml");
    std::fs::write(
        &taxonomy,
        "labels: {0: void, 10: car, 40: road}\nthing_class: {1: true}\n\
                               learning_map: {0: 0, 10: 1, 40: 2}\n",
    )
    .unwrap();
    let options = ["--taxonomy", path(&taxonomy), "--semantics", "field:label"];
    let first = annotated(&folder, "first.mcap", &input, &options);
    let again = folder.path().join("again.mcap");
    let arguments = ["annotate", path(&input), "-o", path(&again), "--config", path(&first)];
    let said = refused(&arguments);
    assert!(said.contains("--taxonomy FILE; give it again"), "{said}");
    let given = [&arguments[..], &["--taxonomy", path(&taxonomy), "--no-layout"]].concat();
    done(&given);
    assert!(std::fs::read(&again).unwrap() == std::fs::read(&first).unwrap());
}

#[test]
fn params_prints_what_config_reads_back() {
    let (folder, input) = drive(1);
    for preset in ["best", "paper", "authors"] {
        let file = folder.path().join("mine.toml");
        std::fs::write(&file, done(&["params", "--preset", preset])).unwrap();
        let by_file =
            annotated(&folder, &format!("{preset}-file.mcap"), &input, &["--config", path(&file)]);
        let by_name = annotated(&folder, &format!("{preset}.mcap"), &input, &["--preset", preset]);
        assert!(std::fs::read(by_file).unwrap() == std::fs::read(by_name).unwrap(), "{preset}");
    }
    let odd = folder.path().join("odd.toml");
    std::fs::write(&odd, done(&["params", "--set", "cluster.voxel=0.31"])).unwrap();
    let shown = done(&["params", "--config", path(&odd), "voxel"]);
    assert!(shown.contains("voxel = 0.31 # preset best: 0.5"), "{shown}");
    assert!(!shown.contains("merge_ratio"), "{shown}");
    let all: serde_json::Value = serde_json::from_str(&done(&["params", "--json"])).unwrap();
    assert_eq!(all.as_array().unwrap().len(), registry().len());
    assert_eq!(all[0]["path"], "projection.rows_from");
    let others = done(&["params", "--method", "supervoxel", "method"]);
    assert!(others.contains("name = \"supervoxel\"") && others.contains("seeds = 8.0"), "{others}");
}

#[test]
fn what_cannot_be_set_is_refused_with_what_can() {
    let (_folder, input) = drive(1);
    let with =
        |setting: &str| refused(&["annotate", path(&input), "-o", "never.mcap", "--set", setting]);
    for (setting, problem) in [
        ("cluster.voxle=1", "did you mean `cluster.voxel`?"),
        ("voxel=1", "did you mean `cluster.voxel` or `registration.voxel`?"),
        ("cluster.voxel=0", "must be a number above 0 (m)"),
        ("cluster.voxel", "use PATH=VALUE, as in cluster.voxel=0.3"),
        ("cluster.seeding=later", "must be at_once or at_pop"),
        ("cluster.birds_eye.margin=1", "set cluster.birds_eye=true first"),
        ("method.reach=1", "no parameter `method.reach`"),
        ("projection.field_of_view=-25deg,3deg", "the upper edge must lie above the lower one"),
    ] {
        let said = with(setting);
        assert!(said.contains(problem), "{setting}: {said}");
        assert!(!Path::new("never.mcap").exists());
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.toml");
    for (content, problem) in [
        ("[cluster]\nvoxel = \"wide\"\n", "`cluster.voxel` = wide: must be a number above 0 (m)"),
        ("[clutser]\nvoxel = 1\n", "did you mean `cluster.voxel`"),
        ("voxel =\n", "line 1"),
        ("[options]\nsemantcs = \"ground\"\n", "no option `semantcs`"),
    ] {
        std::fs::write(&file, content).unwrap();
        let config = ["annotate", path(&input), "-o", "never.mcap", "--config", path(&file)];
        let said = refused(&config);
        assert!(said.contains(problem), "{content}: {said}");
    }
    let said = refused(&["view", path(&input), "--config", path(&input)]);
    assert!(said.contains("holds no parameters"), "{said}");
}

#[test]
fn shells_complete_paths_and_choices() {
    for shell in ["bash", "zsh", "fish"] {
        let script = done(&["completions", shell]);
        for value in ["cluster.tree.gap=0.012", "cluster.seeding=at_pop", "cluster.tree=false"] {
            assert!(script.contains(value), "{shell}: {value}");
        }
    }
}

#[test]
fn any_number_is_swept_over() {
    let (_folder, input) = drive(1);
    let table = done(&[
        "sweep",
        path(&input),
        "--over",
        "cluster.fragments.bridged",
        "--values",
        "0.5,1.5",
        "--presets",
        "best",
        "--set",
        "cluster.voxel=0.4",
    ]);
    assert!(table.contains("cluster.fragments.bridged") && table.contains(" 1.5 |"), "{table}");
    let said = refused(&["sweep", path(&input), "--over", "cluster.tree.gap"]);
    assert!(said.contains("--over cluster.tree.gap needs --values"), "{said}");
    let said = refused(&["sweep", path(&input), "--over", "cluster.seeding", "--values", "1"]);
    assert!(said.contains("takes no numbers"), "{said}");
}
