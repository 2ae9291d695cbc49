//! Files, functions and lines stay small.

use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use super::known::{Flaw, fail_beyond};
use super::source::{Texts, described, is_for_tests};
use super::texts;

/// Lines of a file, without what is for tests alone.
const FILE: usize = 400;
/// Lines of a function, from its signature to its end.
const FUNCTION: usize = 60;
/// Parameters of a function, without `self`.
const PARAMETERS: usize = 5;
/// Columns of a line.
pub const COLUMNS: usize = 100;

/// All Rust files of the project.
fn rust_files() -> Texts {
    let folders = ["src", "crates", "tests", "benches", "examples", "fuzz", "python"];
    folders.iter().flat_map(|folder| texts(folder, &[".rs"])).collect()
}

/// Lines that are for tests, and functions.
#[derive(Default)]
struct Measures {
    test_lines: usize,
    functions: Vec<Function>,
    /// Whether the functions are those of a trait, which says what they take.
    is_of_trait: bool,
}

struct Function {
    name: String,
    line: usize,
    length: usize,
    parameters: usize,
}

type Attributes = Vec<syn::Attribute>;

/// Whether Python calls a function, by the names of its parameters.
fn is_of_python(attributes: &Attributes) -> bool {
    let names = ["pyfunction", "pyo3"];
    attributes.iter().any(|says| names.iter().any(|name| says.path().is_ident(name)))
}

impl Measures {
    fn function(&mut self, signature: &syn::Signature, block: &syn::Block, says: &Attributes) {
        let line = signature.span().start().line;
        let is_typed = |input: &&syn::FnArg| matches!(input, syn::FnArg::Typed(_));
        self.functions.push(Function {
            name: signature.ident.to_string(),
            line,
            length: block.span().end().line - line + 1,
            parameters: match self.is_of_trait || is_of_python(says) {
                true => 0,
                false => signature.inputs.iter().filter(is_typed).count(),
            },
        });
    }
}

impl<'a> Visit<'a> for Measures {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if is_for_tests(described(item).0) {
            self.test_lines += item.span().end().line - item.span().start().line + 1;
        }
        visit::visit_item(self, item);
    }

    fn visit_item_impl(&mut self, item: &'a syn::ItemImpl) {
        let outside = std::mem::replace(&mut self.is_of_trait, item.trait_.is_some());
        visit::visit_item_impl(self, item);
        self.is_of_trait = outside;
    }

    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        self.function(&item.sig, &item.block, &item.attrs);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        self.function(&item.sig, &item.block, &item.attrs);
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_trait_item_fn(&mut self, item: &'a syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.function(&item.sig, block, &item.attrs);
        }
        visit::visit_trait_item_fn(self, item);
    }
}

fn flaw(key: String, size: usize, complaint: String) -> Flaw {
    Flaw { key, size, complaint }
}

/// What is too large in a file.
fn too_large(file: &str, text: &str) -> Vec<Flaw> {
    let syntax = syn::parse_file(text).unwrap_or_else(|error| panic!("{file}: {error}"));
    let mut measures = Measures::default();
    measures.visit_file(&syntax);
    let mut flaws = Vec::new();
    let lines = text.lines().count() - measures.test_lines;
    if lines > FILE {
        let told = format!("{file} has {lines} lines without tests; {FILE} are allowed");
        flaws.push(flaw(format!("file {file}"), lines, told));
    }
    for Function { name, line, length, parameters } in measures.functions {
        let at = format!("{file}:{line} fn {name}");
        if length > FUNCTION {
            let told = format!("{at} has {length} lines; {FUNCTION} are allowed");
            flaws.push(flaw(format!("function {file}:{name}"), length, told));
        }
        if parameters > PARAMETERS {
            let told = format!("{at} has {parameters} parameters; {PARAMETERS} are allowed");
            flaws.push(flaw(format!("parameters {file}:{name}"), parameters, told));
        }
    }
    let lines = text.lines().zip(1..).filter(|(line, _)| line.chars().count() > COLUMNS);
    let wide: Vec<String> = lines.map(|(_, number): (&str, usize)| number.to_string()).collect();
    if !wide.is_empty() {
        let told = format!("{file} has lines over {COLUMNS} columns: {}", wide.join(", "));
        flaws.push(flaw(format!("wide {file}"), wide.len(), told));
    }
    flaws
}

#[test]
fn files_functions_and_lines_stay_small() {
    let files = rust_files();
    assert!(files.len() > 300, "only {} files found: the reader is broken", files.len());
    let flaws = files.iter().flat_map(|(file, text)| too_large(file, text)).collect();
    fail_beyond(&["file", "function", "parameters", "wide"], flaws);
}

#[test]
fn a_module_with_files_of_its_own_is_a_folder() {
    let files = rust_files();
    let mut flaws = Vec::new();
    for file in files.keys() {
        let folder = format!("{}/", file.trim_end_matches(".rs"));
        if files.range(folder.clone()..).next().is_some_and(|(file, _)| file.starts_with(&folder)) {
            let complaint = format!("{file} stands beside its folder: make it {folder}mod.rs");
            flaws.push(flaw(format!("beside {file}"), 1, complaint));
        }
    }
    fail_beyond(&["beside"], flaws);
}
