//! Blocks of shell, run as a reader runs them.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use divmerge::network::runtime::{HAS_TRACT, has_onnx_runtime};

use super::page::{Block, Note, Script, is_as_expected};
use crate::shared_data::shared_data;
use crate::skip::skip_or_fail;

/// Real data, which alone may be absent everywhere.
const SHARED: &str = "../shared/data";

/// The folder in which the blocks of a page run one after the other.
pub struct Sandbox<'a> {
    page: &'a str,
    folder: PathBuf,
    _all: tempfile::TempDir,
}

impl<'a> Sandbox<'a> {
    /// An empty folder but for `tests`; beside it is `shared`, as beside a checkout.
    pub fn new(page: &'a str) -> Self {
        let all = tempfile::tempdir().expect("a folder");
        let folder = all.path().join("page");
        std::fs::create_dir(&folder).expect("a folder");
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        symlink(root.join("tests"), folder.join("tests")).expect("a link");
        if let Ok(shared) = root.join("../shared").canonicalize() {
            symlink(shared, all.path().join("shared")).expect("a link");
        }
        Self { page, folder, _all: all }
    }

    /// Runs a block and what has to come first; what is wrong, if anything is.
    pub fn run(&self, block: &Block) -> Option<String> {
        for note in &block.notes {
            let failed = match note {
                Note::First(script) => self.shell(script).1,
                Note::Needs(what) if what == SHARED && shared_data().is_none() => return None,
                Note::Needs(what) if !has(what) => {
                    skip_or_fail(&format!("{}:{}: no {what}", self.page, block.script.line));
                    return None;
                }
                Note::Needs(_) | Note::NotRun(_) | Note::Table => None,
            };
            if failed.is_some() {
                return failed;
            }
        }
        let (printed, failed) = self.shell(&block.script);
        failed.or_else(|| self.compare(block, &printed))
    }

    /// What a script prints, and what is wrong. Line numbers of the shell are those of the page.
    fn shell(&self, script: &Script) -> (String, Option<String>) {
        let program = Path::new(env!("CARGO_BIN_EXE_divmerge"));
        let beside = program.parent().expect("a folder").to_string_lossy();
        let path = std::env::var("PATH").unwrap_or_default();
        let trap = format!("trap 'echo \"{}:$LINENO: $BASH_COMMAND\" >&2' ERR", self.page);
        let lines = format!("{trap}{}{}", "\n".repeat(script.line - 1), script.text);
        let Output { status, stdout, stderr } = Command::new("bash")
            .args(["-euo", "pipefail", "-c", &lines])
            .current_dir(&self.folder)
            .env("PATH", format!("{beside}:{path}"))
            .output()
            .expect("bash");
        let [stdout, stderr] = [stdout, stderr].map(|bytes| String::from_utf8_lossy(&bytes).into());
        let failed = (!status.success()).then(|| format!("{status}\n{stdout}\n{stderr}"));
        (stdout, failed)
    }

    fn compare(&self, block: &Block, printed: &str) -> Option<String> {
        let expected: Vec<&str> = block.prints.as_deref()?.lines().collect();
        let lines: Vec<&str> = printed.lines().collect();
        let place = format!("{}:{}", self.page, block.script.line);
        (!is_as_expected(&expected, &lines)).then(|| format!("{place} prints\n{printed}"))
    }
}

/// Whether a program, or ONNX Runtime, is there.
fn has(what: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    match what {
        "onnxruntime" => HAS_TRACT || has_onnx_runtime(),
        SHARED => true,
        program => std::env::split_paths(&path).any(|folder| folder.join(program).is_file()),
    }
}
