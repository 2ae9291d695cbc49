//! The arrows between modules point down only (docs/architecture.md), and dependencies stay in their
//! rooms.

use std::path::{Path, PathBuf};

/// Modules from the bottom up: each may use those in the rows above it and, unless it is alone in its
/// row, none beside it.
const LAYERS: &[&[&str]] = &[
    &["error", "stopwatch", "workers"],
    &[
        "grid",
        "cloud",
        "disjoint_sets",
        "footprint",
        "kd_tree",
        "palette",
        "sensor_frame",
        "taxonomy",
    ],
    &["instances"],
    &["simulate", "evaluate"],
    &["range_image"],
    &["semantics", "network"],
    &["cluster"],
    &["baselines"],
    &["pipeline"],
    &["explain"],
    &["failures"],
    &["io"],
    &["annotate"],
    &["replay", "comparison"],
    &["triage"],
    &["view"],
];

/// Which dependencies may be named where.
const ROOMS: &[(&str, &[&str])] = &[
    ("mcap", &["io", "error"]),
    ("binrw", &["io"]),
    ("lz4", &["io"]),
    ("zstd", &["io"]),
    ("foxglove", &["io"]),
    ("base64", &["io"]),
    ("kiddo", &["kd_tree"]),
    ("clap", &["bin"]),
    ("anyhow", &["bin"]),
    ("indicatif", &["bin"]),
    ("object_store", &["io"]),
    ("rustls", &["io"]),
    ("tokio", &["io"]),
    ("serde_saphyr", &["taxonomy", "io", "network"]),
    ("ort", &["network"]),
    ("tract_onnx", &["network"]),
    ("rand_pcg", &["simulate", "evaluate"]),
    ("sha2", &["io", "network"]),
    ("tempfile", &["io", "network"]),
    ("rerun", &["view"]),
    ("tiny_skia", &["view"]),
    ("ttf_parser", &["view"]),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("src") {
        let path = entry.expect("entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
}

/// Every source file with its top-level module and its text without comments.
fn modules() -> Vec<(PathBuf, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let module = |file: &Path| {
        let inside = file.strip_prefix(&root).expect("below src");
        let first = inside.components().next().expect("a name");
        first.as_os_str().to_string_lossy().trim_end_matches(".rs").to_owned()
    };
    let code = |file: &Path| {
        let text = std::fs::read_to_string(file).expect("source");
        let lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        lines.collect::<Vec<_>>().join("\n")
    };
    files.iter().map(|file| (file.clone(), module(file), code(file))).collect()
}

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

#[test]
fn arrows_point_down_only() {
    let mut checked = 0;
    for (file, module, code) in modules() {
        if module == "bin" || module == "lib" {
            continue;
        }
        let own = layer(&module).unwrap_or_else(|| panic!("{module} has no layer"));
        for used in code.split("crate::").skip(1) {
            let used = used.trim_start_matches('{');
            let name: String =
                used.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
            let Some(other) = layer(&name).filter(|_| name != module) else {
                continue;
            };
            checked += 1;
            assert!(other < own, "{}: {module} may not use {name}", file.display());
        }
    }
    assert!(checked > 30, "only {checked} uses found: the scan is broken");
}

/// Whether code names a dependency; `rerun::` is in `rerun::Points3D` but not in `my_rerun::X`.
fn names(code: &str, dependency: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let path = format!("{dependency}::");
    code.match_indices(&path).any(|(at, _)| !code[..at].ends_with(is_word))
}

#[test]
fn the_viewer_library_stays_in_one_file() {
    let namers = modules().into_iter().filter(|(_, _, code)| names(code, "rerun"));
    let files: Vec<_> = namers.map(|(file, ..)| file).collect();
    assert!(files.len() == 1 && files[0].ends_with("view/rerun_stream.rs"), "{files:?}");
}

#[test]
fn dependencies_stay_in_their_rooms() {
    for (file, module, code) in modules() {
        for (dependency, rooms) in ROOMS {
            let named = names(&code, dependency);
            let allowed = rooms.contains(&module.as_str());
            assert!(!named || allowed, "{}: {dependency} is named in {module}", file.display());
        }
    }
}
