//! Arrows between files: file A points to file B where A takes a name that B defines.
//!
//! Declaring a child module and re-exporting what it has is no arrow. A name taken through a
//! re-export points to the file that defines it. Calls of methods are not seen.

use std::collections::{BTreeMap, BTreeSet};

use super::source::{Module, Texts, read_crate};

/// Where a file takes a name from another.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrow {
    pub from: String,
    pub to: String,
    pub line: usize,
    pub name: String,
}

/// All modules of all crates.
pub struct House {
    pub modules: Vec<Module>,
    places: BTreeMap<Vec<String>, usize>,
}

/// What a path leads to.
#[derive(Clone, Copy)]
enum Target {
    Module(usize),
    /// Something that the module defines.
    Item(usize),
}

/// Re-exports of re-exports are followed to this depth.
const DEEPEST: usize = 16;

impl House {
    /// `crates` has the name by which others use a crate, and the file of its root.
    pub fn read(texts: &Texts, crates: &[(String, String)]) -> Self {
        let read = |(name, root): &(String, String)| read_crate(texts, name, root);
        let modules: Vec<Module> = crates.iter().flat_map(read).collect();
        let place = |(place, module): (usize, &Module)| (module.path.clone(), place);
        let places = modules.iter().enumerate().map(place).collect();
        Self { modules, places }
    }

    /// All arrows, sorted; one for each name that a file takes.
    pub fn arrows(&self) -> Vec<Arrow> {
        let mut arrows = BTreeMap::new();
        for (place, module) in self.modules.iter().enumerate() {
            let imports = module.imports.iter().map(|import| (&import.path, import.line, true));
            let mentions = module.mentions.iter().map(|word| (&word.path, word.line, false));
            for (path, line, is_import) in imports.chain(mentions) {
                let Some((Target::Item(to), name)) = self.resolve(place, path, 0) else { continue };
                let (from, file) = (&module.file, &self.modules[to].file);
                if from != file && !(is_import && self.is_handed_on(place, to, path)) {
                    let arrow = (from.clone(), file.clone(), name.to_owned());
                    arrows.entry(arrow).or_insert(line);
                }
            }
        }
        let arrow = |((from, to, name), line)| Arrow { from, to, line, name };
        arrows.into_iter().map(arrow).collect()
    }

    /// Whether a module re-exports what one below it has, which is no import.
    fn is_handed_on(&self, module: usize, below: usize, path: &[String]) -> bool {
        let module = &self.modules[module];
        self.modules[below].path.starts_with(&module.path)
            && module.imports.iter().any(|import| import.is_public && import.path == path)
    }

    /// What a path leads to, seen from a module, and the name in it that is taken. An import of a
    /// module by itself leads to the module: it takes nothing yet.
    fn resolve<'p>(
        &self,
        from: usize,
        path: &'p [String],
        depth: usize,
    ) -> Option<(Target, &'p str)> {
        let (first, rest) = path.split_first()?;
        let own = &self.modules[from].path;
        let mut target = match first.as_str() {
            "crate" => self.module(&own[..1]),
            "self" => Some(Target::Module(from)),
            "super" => self.module(&own[..own.len() - 1]),
            name => {
                let local = self.lookup(from, name, rest.is_empty(), depth);
                local.or_else(|| self.module(&path[..1]))
            }
        }?;
        let mut taken = first.as_str();
        for (place, name) in rest.iter().enumerate() {
            let Target::Module(module) = target else { break };
            let above = &self.modules[module].path;
            target = match name.as_str() {
                "super" => self.module(&above[..above.len() - 1])?,
                name => {
                    let found = self.lookup(module, name, place + 1 == rest.len(), depth);
                    found.unwrap_or(Target::Item(module))
                }
            };
            taken = name;
        }
        Some((target, taken))
    }

    /// What a name means in a module: an item, something imported, or a child.
    fn lookup(&self, at: usize, name: &str, is_last: bool, depth: usize) -> Option<Target> {
        if depth > DEEPEST {
            return None;
        }
        let module = &self.modules[at];
        let child = self.module(&[&module.path[..], &[name.to_owned()]].concat());
        if child.is_some() && !is_last {
            return child;
        }
        if module.items.contains(name) {
            return Some(Target::Item(at));
        }
        let named = module.imports.iter().filter(|import| import.name.as_deref() == Some(name));
        let mut found = named
            .filter_map(|import| self.resolve(at, &import.path, depth + 1))
            .map(|(target, _)| target);
        let globs = module.imports.iter().filter(|import| import.name.is_none());
        let mut behind_globs = globs.filter_map(|glob| {
            let (Target::Module(behind), _) = self.resolve(at, &glob.path, depth + 1)? else {
                return None;
            };
            self.lookup(behind, name, is_last, depth + 1)
        });
        found.next().or_else(|| behind_globs.next()).or(child)
    }

    fn module(&self, path: &[String]) -> Option<Target> {
        self.places.get(path).copied().map(Target::Module)
    }
}

/// Files that import each other, directly or around: every strongly connected component.
pub fn circles(arrows: &[Arrow]) -> Vec<BTreeSet<String>> {
    let mut next: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for arrow in arrows {
        next.entry(&arrow.from).or_default().insert(&arrow.to);
    }
    let reached = |start: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(file) = open.pop() {
            let more = next.get(file).into_iter().flatten();
            open.extend(more.filter(|file| seen.insert((**file).to_owned())));
        }
        seen
    };
    let all: BTreeMap<&str, _> = next.keys().map(|&file| (file, reached(file))).collect();
    let on_circle = all.iter().filter(|(file, seen)| seen.contains(**file));
    let circle = |(file, seen): (&&str, &BTreeSet<String>)| {
        let returns = |other: &&String| all.get(other.as_str()).is_some_and(|s| s.contains(*file));
        seen.iter().filter(returns).cloned().collect()
    };
    on_circle.map(circle).collect::<BTreeSet<_>>().into_iter().collect()
}

/// A circle in words, a line for each file that takes something from another.
pub fn told(circle: &BTreeSet<String>, arrows: &[Arrow]) -> String {
    let mut pairs: BTreeMap<(&str, &str), (usize, Vec<&str>)> = BTreeMap::new();
    for arrow in arrows.iter().filter(|a| circle.contains(&a.from) && circle.contains(&a.to)) {
        let pair = pairs.entry((&arrow.from, &arrow.to)).or_insert((arrow.line, Vec::new()));
        pair.0 = pair.0.min(arrow.line);
        pair.1.push(&arrow.name);
    }
    let line = |((from, to), (line, names)): (&(&str, &str), &(usize, Vec<&str>))| {
        format!("  {from}:{line} takes from {to}: {}\n", names.join(", "))
    };
    format!("a circle of {} files\n{}", circle.len(), pairs.iter().map(line).collect::<String>())
}
