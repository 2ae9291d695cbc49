//! What people type wrong: told with what to type instead, and exit code 2.

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// What a command that is used wrongly says.
fn refused(arguments: &[&str]) -> String {
    let done = divmerge(arguments);
    let said = text(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
    assert_eq!(text(&done.stdout), "", "{arguments:?}");
    said
}

#[test]
fn of_a_misspelt_name_the_nearest_is_said() {
    let (folder, input) = drive(1);
    let input = path(&input);
    let output = folder.path().join("o.mcap");
    let annotate =
        |more: &[&str]| refused(&[&["annotate", input, "-o", path(&output)], more].concat());
    for (said, near) in [
        (annotate(&["--semantics", "grond"]), "did you mean `ground`?"),
        (annotate(&["--semantics", "feild:label"]), "did you mean `field`?"),
        (annotate(&["--semantics", "field:lable"]), "did you mean `label`?"),
        (annotate(&["--taxonomy", "nuscene"]), "did you mean `nuscenes`?"),
        (annotate(&["--topic", "/lidar/point"]), "did you mean `/lidar/points`?"),
        (annotate(&["--set", "cluster.voxle=1"]), "did you mean `cluster.voxel`?"),
        (annotate(&["--set", "cluster.seeding=at_onec"]), "did you mean `at_once`?"),
        (annotate(&["--preset", "bset"]), "'best'"),
        (annotate(&["--method", "euclidian"]), "'euclidean'"),
        (refused(&["figure", input, "-o", "f.png", "--panels", "maks"]), "did you mean `mask`?"),
        (refused(&["simulate", "--sensor", "vlp16"]), "did you mean `vlp-16`?"),
        (refused(&["simulate", "--scene", "strete"]), "did you mean `street`?"),
        (refused(&["compare", input, "--methods", "dbscam"]), "did you mean `dbscan`?"),
        (refused(&["sweep", input, "--over", "voxle"]), "did you mean `cluster.voxel`?"),
        (refused(&["params", "clutser"]), "did you mean `cluster`?"),
        (refused(&["annotat", input]), "'annotate'"),
    ] {
        assert!(said.contains(near), "{near}: {said}");
    }
    let config = folder.path().join("mine.toml");
    std::fs::write(&config, "").expect("written");
    let typed = folder.path().join("mien.toml");
    assert!(annotate(&["--config", path(&typed)]).contains("did you mean `mine.toml`?"));
    let missing = folder.path().join("drvie.mcap");
    let told = divmerge(&["info", path(&missing)]);
    assert_eq!(told.status.code(), Some(1));
    assert!(text(&told.stderr).contains("did you mean `drive.mcap`?"), "{}", text(&told.stderr));
}

#[test]
fn what_does_not_fit_is_wrong_usage() {
    let (folder, input) = drive(1);
    let (input, output) = (path(&input), folder.path().join("o.mcap"));
    let window = refused(&["figure", input, "-o", "f.png", "--window", "5000..6000"]);
    assert!(window.contains("lie outside of the 16 x"), "{window}");
    let times = ["annotate", input, "-o", path(&output), "--from", "2", "--to", "1"];
    assert!(refused(&times).contains("--from must lie before --to"));
    let listen = refused(&["inspect", input, "--no-open", "--listen", "99"]);
    assert!(listen.contains("as in 127.0.0.1:8080"), "{listen}");
    // A name with a dot is a file.
    let taxonomy = ["annotate", input, "-o", path(&output), "--taxonomy", "nowhere.yaml"];
    assert_eq!(divmerge(&taxonomy).status.code(), Some(1));
}
