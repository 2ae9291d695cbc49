//! Where the shared library of ONNX Runtime is.

use std::path::{Path, PathBuf};

/// Beginning of its name.
const NAME: &str = if cfg!(target_os = "windows") {
    "onnxruntime.dll"
} else if cfg!(target_os = "macos") {
    "libonnxruntime."
} else {
    "libonnxruntime.so"
};

/// The library that is named, or that is found: by `ORT_DYLIB_PATH`, in the active Python
/// environment, in the user's and the system's Python packages, among the system's libraries.
pub(super) fn find(named: Option<&Path>) -> Option<PathBuf> {
    let from_variable = || std::env::var_os("ORT_DYLIB_PATH").filter(|path| !path.is_empty());
    match named.map(Path::to_owned).or_else(|| from_variable().map(PathBuf::from)) {
        Some(named) if named.is_dir() => in_folder(&named),
        Some(named) => Some(named),
        None => python_roots()
            .iter()
            .flat_map(|root| packages(root))
            .map(|packages| packages.join("onnxruntime/capi"))
            .chain(
                [
                    "/usr/local/lib",
                    "/usr/lib",
                    "/usr/lib/x86_64-linux-gnu",
                    "/usr/lib/aarch64-linux-gnu",
                ]
                .map(PathBuf::from),
            )
            .find_map(|folder| in_folder(&folder)),
    }
}

/// Folders that hold a `lib/python3.N`.
fn python_roots() -> Vec<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let home = variable("HOME").map(|home| home.join(".local"));
    let found = [variable("VIRTUAL_ENV"), variable("CONDA_PREFIX"), home];
    let system = ["/usr/local", "/usr"].map(PathBuf::from);
    found.into_iter().flatten().chain(system).collect()
}

/// The folders with Python's packages below a root.
fn packages(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for lib in ["lib", "lib64"].map(|lib| root.join(lib)) {
        for python in entries(&lib).filter(|name| starts_with(name, "python3")) {
            found.extend(["site-packages", "dist-packages"].map(|packages| python.join(packages)));
        }
    }
    found.sort_unstable();
    found
}

/// The library in a folder; of several versions the last by name.
fn in_folder(folder: &Path) -> Option<PathBuf> {
    entries(folder).filter(|path| starts_with(path, NAME)).max()
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

fn starts_with(path: &Path, start: &str) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_named_library_and_the_last_in_a_folder() {
        let named = Path::new("/opt/libonnxruntime.so.1.20");
        assert_eq!(find(Some(named)), Some(named.to_owned()));
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(find(Some(folder.path())), None);
        for name in ["a", "b"] {
            std::fs::write(folder.path().join(format!("{NAME}{name}")), "").unwrap();
        }
        assert_eq!(find(Some(folder.path())), Some(folder.path().join(format!("{NAME}b"))));
    }

    #[test]
    fn the_packages_of_a_python() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(root.path().join("lib/python3.12")).unwrap();
        let expected = root.path().join("lib/python3.12/site-packages");
        assert!(packages(root.path()).contains(&expected));
    }
}
