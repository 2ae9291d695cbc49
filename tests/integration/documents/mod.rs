//! Every block of shell in README.md and docs/ is run, or says why it is not.
//!
//! Blocks of a page run in order in a folder of its own, where an error of a command, or another
//! output than the page shows, is a failure. Comments in the page's source ([`page::Note`]) say
//! what a block needs, and why it is not run:
//!
//! ```sh
//! cargo test --test integration documents -- --nocapture     # lists what was not run
//! ```

mod page;
mod run;

use std::path::Path;

use page::{Block, Note, blocks, is_as_expected};
use run::Sandbox;

/// The blocks of shell of a page.
fn shell_blocks(page: &str) -> Vec<Block> {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page));
    let blocks = blocks(&text.expect("a page")).unwrap_or_else(|wrong| panic!("{page}: {wrong}"));
    blocks.into_iter().filter(|block| block.language == "sh").collect()
}

fn run_page(page: &str) {
    let sandbox = Sandbox::new(page);
    for block in shell_blocks(page) {
        if block.why_not_run().is_none() {
            sandbox.run(&block).inspect(|failed| panic!("{failed}"));
        }
    }
}

macro_rules! pages {
    ($($name:ident: $page:literal,)*) => {
        const PAGES: &[&str] = &[$($page),*];
        $(#[test] fn $name() { run_page($page); })*
    };
}

pages! {
    readme: "README.md",
    python_readme: "python/README.md",
    cluster: "docs/cluster.md",
    evaluation: "docs/evaluation.md",
    figures: "docs/figures.md",
    guide: "docs/guide.md",
    inspect: "docs/inspect.md",
    networks: "docs/networks.md",
    performance: "docs/performance.md",
    python: "docs/python.md",
    release: "docs/release.md",
    reliability: "docs/reliability.md",
    remote: "docs/remote.md",
    results: "docs/results.md",
    security: "docs/security.md",
    semantickitti: "docs/semantickitti.md",
    sensors: "docs/sensors.md",
    tutorial: "docs/tutorial.md",
}

#[test]
fn every_block_is_run_or_says_why_not() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    for entry in std::fs::read_dir(docs).expect("docs") {
        let name = entry.expect("a file").file_name().to_string_lossy().into_owned();
        let page = format!("docs/{name}");
        let is_run = PAGES.contains(&page.as_str());
        assert!(is_run || !name.ends_with(".md") || shell_blocks(&page).is_empty(), "{page}");
    }
    let mut count = 0;
    let mut left_out = Vec::new();
    for page in PAGES {
        for block in shell_blocks(page) {
            count += 1;
            let place = format!("{page}:{}", block.script.line);
            left_out.extend(block.why_not_run().map(|why| format!("{place}: {why}")));
        }
    }
    println!("{count} blocks of shell, {} not run:\n{}", left_out.len(), left_out.join("\n"));
    assert!(count > 60 && left_out.len() < count, "{count}");
}

#[test]
fn comments_say_what_is_done_with_a_block() {
    let page = "<!-- first\na\n-->\n<!-- needs: zstd -->\n```sh\nb\n```\n\n```text\nc\n```\n";
    let found = blocks(page).expect("a page");
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].script.line, found[0].script.text.as_str()), (6, "b\n"));
    assert_eq!(found[0].prints.as_deref(), Some("c\n"));
    let [Note::First(first), Note::Needs(program)] = &found[0].notes[..] else {
        panic!("{found:?}")
    };
    assert_eq!((first.line, first.text.as_str(), program.as_str()), (2, "a\n", "zstd"));

    let found = blocks("<!-- not run: takes\nan hour -->\n```sh\nb\n```\n").expect("a page");
    assert_eq!(found[0].why_not_run(), Some("takes an hour"));
    let page = "<!-- prints the table below -->\n```sh\nb\n```\nP:\n\n|a|\n|-|\n\n|b|\n|-|\n";
    let found = blocks(page).expect("a page");
    assert_eq!(found[0].prints.as_deref(), Some("...\n|a|\n|-|\n...\n"));
    assert!(blocks("<!-- prints the table below -->\n```sh\nb\n```\n").is_err());
    for wrong in ["<!-- not run: -->", "<!-- not run -->", "<!-- never -->"] {
        assert!(blocks(&format!("{wrong}\n```sh\n```\n")).is_err(), "{wrong}");
    }
    assert!(blocks("<!-- not run: it is old -->\nProse.\n```sh\n```\n").is_err());
}

#[test]
fn a_failing_block_is_told_with_its_line() {
    let sandbox = Sandbox::new("page.md");
    let run = |page: &str| sandbox.run(&blocks(page).expect("a page")[0]);
    let failed = run("\n```sh\ntrue\nfalse | cat\ntrue\n```\n").expect("a failure");
    assert!(failed.contains("page.md:4: "), "{failed}");
    assert_eq!(run("```sh\ndivmerge --version > v\n```\n"), None);
    assert_eq!(run("```sh\ncut -c 1-8 v\n```\n```text\ndivmerge\n```\n"), None);
    assert!(run("```sh\ncut -c 1-8 v\n```\n```text\ndivmerge 2\n```\n").is_some());
    let failed = run("<!-- first\nfalse\n-->\n```sh\ntrue\n```\n").expect("a failure");
    assert!(failed.contains("page.md:2: false"), "{failed}");
}

#[test]
fn dots_stand_for_anything() {
    let is_same = |expected: &str, printed: &str| {
        let [expected, printed] = [expected, printed].map(|text| text.lines().collect::<Vec<_>>());
        is_as_expected(&expected, &printed)
    };
    assert!(is_same("a\n...\nd ... e ... f", "a\nb\nc\nd 1 e 2 e 3 f"));
    assert!(is_same("a\n...", "a") && is_same("a ...", "a b "));
    assert!(!is_same("a", "a\nb") && !is_same("a\nb", "a") && !is_same("a ... c", "a b d"));
    assert!(!is_same("a ...c", "a ") && !is_same("ab...bc", "abc"));
}
