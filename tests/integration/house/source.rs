//! Reads the Rust sources: modules, what each defines, imports and mentions.

use std::collections::{BTreeMap, BTreeSet};

use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Texts of source files by their path below the repository's root.
pub type Texts = BTreeMap<String, String>;

/// A `use` of one name; a glob has no name.
pub struct Import {
    pub path: Vec<String>,
    pub name: Option<String>,
    pub is_public: bool,
    pub line: usize,
}

/// A path in code, such as `crate::a::b::c` in `crate::a::b::c()`, or a single name.
pub struct Mention {
    pub path: Vec<String>,
    pub line: usize,
}

/// A module without what is compiled for tests alone.
pub struct Module {
    /// Its path from the crate's name on: `["divmerge", "cluster", "merge"]`.
    pub path: Vec<String>,
    pub file: String,
    pub items: BTreeSet<String>,
    pub imports: Vec<Import>,
    pub mentions: Vec<Mention>,
    /// Methods that are called, by name, with their line.
    pub calls: Vec<(String, usize)>,
    /// Child modules that have a file of their own.
    children: Vec<String>,
}

/// Reads a crate: the file of its root and those of all modules declared from there on.
pub fn read_crate(texts: &Texts, name: &str, root: &str) -> Vec<Module> {
    let mut modules = Vec::new();
    let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
    read_file(texts, vec![name.to_owned()], root, folder, &mut modules);
    modules
}

/// `folder` is where the files of the module's children are.
fn read_file(
    texts: &Texts,
    path: Vec<String>,
    file: &str,
    folder: &str,
    modules: &mut Vec<Module>,
) {
    let text = &texts[file];
    let syntax = syn::parse_file(text).unwrap_or_else(|error| panic!("{file}: {error}"));
    let mut reader = Reader::new(path, file);
    reader.visit_file(&syntax);
    for module in reader.done {
        let parent = module.path.clone();
        let children = module.children.clone();
        modules.push(module);
        for child in children {
            let flat = format!("{folder}/{child}.rs");
            let nested = format!("{folder}/{child}/mod.rs");
            let file = if texts.contains_key(&flat) { flat } else { nested };
            let path = [parent.clone(), vec![child.clone()]].concat();
            read_file(texts, path, &file, &format!("{folder}/{child}"), modules);
        }
    }
}

/// Walks over one file; `open` has the module it is in and those around it.
struct Reader {
    open: Vec<Module>,
    done: Vec<Module>,
}

impl Reader {
    fn new(path: Vec<String>, file: &str) -> Self {
        Self { open: vec![Module::new(path, file)], done: Vec::new() }
    }

    fn here(&mut self) -> &mut Module {
        self.open.last_mut().expect("a module")
    }
}

impl Module {
    fn new(path: Vec<String>, file: &str) -> Self {
        Self {
            path,
            file: file.to_owned(),
            items: BTreeSet::new(),
            imports: Vec::new(),
            mentions: Vec::new(),
            calls: Vec::new(),
            children: Vec::new(),
        }
    }
}

/// Whether an item is compiled for tests alone.
pub fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let is_test = |list: &syn::MetaList| list.tokens.to_string() == "test";
        attribute.path().is_ident("cfg") && attribute.meta.require_list().is_ok_and(is_test)
    })
}

/// Attributes of an item, and its name if it can be imported.
pub fn described(item: &syn::Item) -> (&[syn::Attribute], Option<String>) {
    match item {
        syn::Item::Const(item) => (&item.attrs, Some(item.ident.to_string())),
        syn::Item::Enum(item) => (&item.attrs, Some(item.ident.to_string())),
        syn::Item::Fn(item) => (&item.attrs, Some(item.sig.ident.to_string())),
        syn::Item::Impl(item) => (&item.attrs, None),
        syn::Item::Macro(item) => (&item.attrs, item.ident.as_ref().map(ToString::to_string)),
        syn::Item::Mod(item) => (&item.attrs, None),
        syn::Item::Static(item) => (&item.attrs, Some(item.ident.to_string())),
        syn::Item::Struct(item) => (&item.attrs, Some(item.ident.to_string())),
        syn::Item::Trait(item) => (&item.attrs, Some(item.ident.to_string())),
        syn::Item::Type(item) => (&item.attrs, Some(item.ident.to_string())),
        syn::Item::Use(item) => (&item.attrs, None),
        _ => (&[], None),
    }
}

impl<'a> Visit<'a> for Reader {
    fn visit_file(&mut self, file: &'a syn::File) {
        visit::visit_file(self, file);
        self.done.extend(self.open.pop());
    }

    fn visit_item(&mut self, item: &'a syn::Item) {
        let (attributes, name) = described(item);
        if !is_for_tests(attributes) {
            self.here().items.extend(name);
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        let name = item.ident.to_string();
        if item.content.is_none() {
            self.here().children.push(name);
            return;
        }
        let (mut path, file) = (self.here().path.clone(), self.here().file.clone());
        path.push(name);
        self.open.push(Module::new(path, &file));
        visit::visit_item_mod(self, item);
        self.done.extend(self.open.pop());
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let is_public = !matches!(item.vis, syn::Visibility::Inherited);
        let line = item.span().start().line;
        let mut names = Vec::new();
        flatten(&item.tree, &mut Vec::new(), &mut names);
        let imports = names.into_iter();
        let import = |(path, name)| Import { path, name, is_public, line };
        self.here().imports.extend(imports.map(import));
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        if path.leading_colon.is_none() {
            let names = path.segments.iter().map(|segment| segment.ident.to_string());
            let mention = Mention { path: names.collect(), line: path.span().start().line };
            self.here().mentions.push(mention);
        }
        visit::visit_path(self, path);
    }

    fn visit_expr_method_call(&mut self, call: &'a syn::ExprMethodCall) {
        let line = call.method.span().start().line;
        self.here().calls.push((call.method.to_string(), line));
        visit::visit_expr_method_call(self, call);
    }

    fn visit_attribute(&mut self, _: &'a syn::Attribute) {}

    /// `pub(in crate::room)` takes nothing from the room.
    fn visit_vis_restricted(&mut self, _: &'a syn::VisRestricted) {}

    /// The arguments of most macros are expressions; of the others, paths are looked for.
    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.visit_path(&call.path);
        type Arguments = syn::punctuated::Punctuated<syn::Expr, syn::Token![,]>;
        match call.parse_body_with(Arguments::parse_terminated) {
            Ok(arguments) => {
                let mut inner = Reader::new(Vec::new(), "");
                arguments.iter().for_each(|argument| inner.visit_expr(argument));
                let inner = inner.open.remove(0);
                self.here().mentions.extend(inner.mentions);
                self.here().calls.extend(inner.calls);
            }
            Err(_) => paths_in(call.tokens.clone(), &mut self.here().mentions),
        }
    }
}

/// The names that a `use` brings, each with its whole path.
fn flatten(
    tree: &syn::UseTree,
    path: &mut Vec<String>,
    names: &mut Vec<(Vec<String>, Option<String>)>,
) {
    let whole = |path: &[String], last: String| match last.as_str() {
        "self" => path.to_vec(),
        _ => [path, &[last]].concat(),
    };
    match tree {
        syn::UseTree::Path(part) => {
            path.push(part.ident.to_string());
            flatten(&part.tree, path, names);
            path.pop();
        }
        syn::UseTree::Name(name) => {
            let whole = whole(path, name.ident.to_string());
            let name = whole.last().cloned();
            names.push((whole, name));
        }
        syn::UseTree::Rename(name) => {
            names.push((whole(path, name.ident.to_string()), Some(name.rename.to_string())));
        }
        syn::UseTree::Glob(_) => names.push((path.clone(), None)),
        syn::UseTree::Group(group) => {
            group.items.iter().for_each(|tree| flatten(tree, path, names));
        }
    }
}

/// Paths of two names and more among tokens.
fn paths_in(tokens: proc_macro2::TokenStream, mentions: &mut Vec<Mention>) {
    use proc_macro2::TokenTree;
    let mut path: Vec<String> = Vec::new();
    let (mut line, mut colons) = (0, 0);
    for token in tokens.into_iter().map(Some).chain([None]) {
        match token {
            Some(TokenTree::Ident(ident)) if path.is_empty() || colons == 2 => {
                if path.is_empty() {
                    line = ident.span().start().line;
                }
                path.push(ident.to_string());
                colons = 0;
                continue;
            }
            Some(TokenTree::Punct(punct)) if punct.as_char() == ':' && !path.is_empty() => {
                colons += 1;
                continue;
            }
            _ => {}
        }
        if path.len() > 1 {
            mentions.push(Mention { path: path.clone(), line });
        }
        path.clear();
        colons = 0;
        match token {
            Some(TokenTree::Group(group)) => paths_in(group.stream(), mentions),
            Some(TokenTree::Ident(ident)) => {
                line = ident.span().start().line;
                path.push(ident.to_string());
            }
            _ => {}
        }
    }
}
