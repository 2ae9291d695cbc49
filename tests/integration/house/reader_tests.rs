//! The reader on small sources.

use std::collections::BTreeSet;

use super::arrows::{Arrow, House, circles};
use super::source::Texts;

/// Arrows within a library `home` (files below `src`) and a crate `stones` (below `stones`).
fn arrows(files: &[(&str, &str)]) -> Vec<Arrow> {
    let texts: Texts = files.iter().map(|&(path, text)| (path.into(), text.into())).collect();
    let crates = [("home", "src/lib.rs"), ("stones", "stones/lib.rs")];
    let crates = crates.iter().filter(|(_, root)| texts.contains_key(*root));
    let crates: Vec<_> = crates.map(|&(name, root)| (name.into(), root.into())).collect();
    House::read(&texts, &crates).arrows()
}

/// Arrows as `from line name to`, files without their folder `src`.
fn drawn(files: &[(&str, &str)]) -> Vec<String> {
    let short = |file: &str| file.trim_start_matches("src/").to_owned();
    let line = |a: &Arrow| format!("{}:{} {} {}", short(&a.from), a.line, a.name, short(&a.to));
    arrows(files).iter().map(line).collect()
}

fn circle(files: &[&str]) -> BTreeSet<String> {
    files.iter().map(|file| format!("src/{file}")).collect()
}

#[test]
fn a_circle_of_two_files_is_found() {
    let files = [
        ("src/lib.rs", "mod a;\nmod b;\nmod c;"),
        ("src/a.rs", "use crate::b::B;\npub struct A(B);"),
        ("src/b.rs", "pub struct B;\nfn make() -> crate::a::A { todo!() }"),
        ("src/c.rs", "use crate::{a::A, b::B};"),
    ];
    assert_eq!(drawn(&files), ["a.rs:1 B b.rs", "b.rs:2 A a.rs", "c.rs:1 A a.rs", "c.rs:1 B b.rs"]);
    assert_eq!(circles(&arrows(&files)), [circle(&["a.rs", "b.rs"])]);
}

#[test]
fn circles_around_and_apart_are_each_found_whole() {
    let files = [
        ("src/lib.rs", "mod a; mod b; mod c; mod d; mod e;"),
        ("src/a.rs", "use super::b::f; pub fn f() {}"),
        ("src/b.rs", "use super::c::f as g; pub fn f() {}"),
        ("src/c.rs", "pub fn f() { super::a::f() }"),
        ("src/d.rs", "use super::a; pub fn f() { a::f(); super::e::f() }"),
        ("src/e.rs", "pub fn f() { vec![crate::d::f()]; }"),
    ];
    let found = circles(&arrows(&files));
    assert_eq!(found, [circle(&["a.rs", "b.rs", "c.rs"]), circle(&["d.rs", "e.rs"])]);
}

#[test]
fn a_name_taken_through_a_re_export_comes_from_the_file_that_defines_it() {
    let files = [
        ("src/lib.rs", "pub mod room;\npub use room::*;"),
        ("src/room/mod.rs", "mod low;\nmod high;\npub use low::Low;\npub use self::high::High;"),
        ("src/room/low.rs", "use super::High;\npub struct Low(High);"),
        ("src/room/high.rs", "use crate::{room::{self, Low}};\npub struct High(room::Low);"),
    ];
    let found = ["room/high.rs:1 Low room/low.rs", "room/low.rs:1 High room/high.rs"];
    assert_eq!(drawn(&files), found);
    assert_eq!(circles(&arrows(&files)), [circle(&["room/high.rs", "room/low.rs"])]);
}

#[test]
fn a_parent_and_a_child_form_a_circle_where_each_uses_what_the_other_defines() {
    let parent = "mod child;\npub use child::make;\npub struct Own;\n";
    let child = ("src/room/child.rs", "use super::Own;\npub fn make() -> Own { Own }");
    let lib = ("src/lib.rs", "mod room;");
    let apart = [lib, ("src/room.rs", parent), child];
    assert_eq!(drawn(&apart), ["room/child.rs:1 Own room.rs"]);
    let used = format!("{parent}pub fn twice() {{ make(); child::make(); }}");
    let both = [lib, ("src/room.rs", &used), child];
    assert_eq!(drawn(&both), ["room.rs:4 make room/child.rs", "room/child.rs:1 Own room.rs"]);
    assert_eq!(circles(&arrows(&both)), [circle(&["room.rs", "room/child.rs"])]);
}

#[test]
fn tests_comments_and_texts_draw_no_arrows() {
    let a = "//! [`crate::b::B`]\n// use crate::b::B;\npub const TEXT: &str = \"crate::b::B\";\n\
             #[cfg(test)]\nuse crate::b::B;\n#[cfg(test)]\nmod tests { use crate::b::B; }\n\
             #[cfg(test)]\nmod more;\n";
    let files = [
        ("src/lib.rs", "mod a; mod b;"),
        ("src/a.rs", a),
        ("src/b.rs", "use crate::a::TEXT; pub struct B;"),
    ];
    assert_eq!(drawn(&files), ["b.rs:1 TEXT a.rs"]);
}

#[test]
fn crates_globs_modules_within_files_and_macros_are_seen() {
    let a = "pub fn f() {}\npub mod inner { pub fn g() {} }\n\
             macro_rules! say { () => {} }\npub(crate) use say;";
    let files = [
        ("stones/lib.rs", "mod granite;\npub use granite::Granite;"),
        ("stones/granite.rs", "pub struct Granite;"),
        ("src/lib.rs", "mod a;\nmod b;\nmod c;\npub(crate) use a::say;"),
        ("src/a.rs", a),
        ("src/b.rs", "use crate::a::*;\nfn h() { f(); crate::say!(x => crate::a::inner::g()) }"),
        ("src/c.rs", "fn h() { println!(\"{}\", stones::Granite); crate::a::say!() }"),
    ];
    let found = [
        "b.rs:2 f a.rs",
        "b.rs:2 g a.rs",
        "b.rs:2 say a.rs",
        "c.rs:1 say a.rs",
        "c.rs:1 Granite stones/granite.rs",
    ];
    assert_eq!(drawn(&files), found);
}
