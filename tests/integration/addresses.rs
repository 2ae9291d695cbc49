//! Recordings at addresses, without a network: what is refused, and in which words. Reading from
//! servers is tested in `tests/python/test_remote.py`.

use std::process::{Command, Output};

fn divmerge(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_divmerge")).args(arguments).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[cfg(not(feature = "remote"))]
#[test]
fn without_the_feature_an_address_is_refused_with_what_to_do() {
    let address = "https://user:secret@host/a.mcap?token=secret";
    for command in [
        &["info", address] as &[&str],
        &["annotate", address, "-o", "target/never.mcap"],
        &["figure", address, "-o", "target/never.png"],
        &["triage", address],
        &["evaluate", address],
    ] {
        let output = divmerge(command);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("https://host/a.mcap: ") && !said.contains("secret"), "{said}");
        assert!(said.contains("cargo install --path . --features remote"), "{said}");
    }
}

#[test]
fn outputs_are_files() {
    let folder = tempfile::tempdir().unwrap();
    let drive = folder.path().join("drive.mcap");
    let drive = drive.to_str().unwrap();
    let made = divmerge(&["simulate", "--sensor", "vlp-16", "--frames", "1", "-o", drive]);
    assert!(made.status.success(), "{}", said(&made));
    for command in [
        &["annotate", drive, "-o", "s3://bucket/out.mcap"] as &[&str],
        &["simulate", "--frames", "1", "-o", "s3://bucket/out.mcap"],
        &["figure", drive, "-o", "s3://bucket/out.png"],
        &["triage", drive, "--csv", "s3://bucket/out.csv"],
        &["export", drive, "--topic", "/lidar/points", "--labels", "s3://bucket/labels"],
        &["failures", drive, "--json", "https://host/out.json?token=secret"],
        &["evaluate", drive, "--json=https://host/out.json?token=secret"],
    ] {
        let output = divmerge(command);
        let said = said(&output);
        assert!(!output.status.success() && !said.contains("secret"), "{command:?}: {said}");
        assert!(said.contains("cannot write to an address"), "{command:?}: {said}");
    }
    assert!(!std::path::Path::new("s3:").exists());
}
