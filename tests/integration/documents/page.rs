//! A page of documentation: its blocks of code, and what comments in its source say of them.

/// What a comment says of the block below it. Comments are not shown where the page is.
#[derive(Debug, PartialEq)]
pub enum Note {
    /// `<!-- not run: WHY -->`
    NotRun(String),
    /// `<!-- needs: PROGRAM -->`, or `onnxruntime`, or `../shared/data`.
    Needs(String),
    /// `<!-- first`, commands on lines of their own, `-->`: they are run before the block.
    First(Script),
    /// `<!-- prints the table below -->`: the next table is among what the block prints.
    Table,
}

/// Lines of a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// Line of the page on which it begins, from 1.
    pub line: usize,
    pub text: String,
}

/// A block of code.
#[derive(Debug)]
pub struct Block {
    pub language: String,
    pub script: Script,
    pub notes: Vec<Note>,
    /// What it prints: the block of `text` right below it, or a table.
    pub prints: Option<String>,
}

impl Block {
    pub fn why_not_run(&self) -> Option<&str> {
        self.notes.iter().find_map(|note| match note {
            Note::NotRun(why) => Some(why.as_str()),
            _ => None,
        })
    }
}

enum Part {
    Code(String, Script),
    Comment(Script),
    Table(Script),
    Prose,
}

/// Blocks of code, comments, and what is neither; blank lines are left out.
fn parts(page: &str) -> Vec<Part> {
    let lines: Vec<&str> = page.lines().collect();
    let first_from = |at: usize, is_end: &dyn Fn(&str) -> bool| {
        (at..lines.len()).find(|&at| is_end(lines[at])).unwrap_or(lines.len())
    };
    let script = |from: usize, to: usize| {
        let text = lines[from..to].iter().map(|line| format!("{line}\n")).collect();
        Script { line: from + 1, text }
    };
    let (mut at, mut found) = (0, Vec::new());
    while at < lines.len() {
        let mut end = at;
        if let Some(language) = lines[at].strip_prefix("```") {
            end = first_from(at + 1, &|line| line.starts_with("```"));
            found.push(Part::Code(language.to_owned(), script(at + 1, end)));
        } else if lines[at].starts_with("<!--") {
            end = first_from(at, &|line| line.ends_with("-->"));
            found.push(Part::Comment(script(at, (end + 1).min(lines.len()))));
        } else if lines[at].starts_with('|') {
            end = first_from(at, &|line| !line.starts_with('|')) - 1;
            found.push(Part::Table(script(at, end + 1)));
        } else if !lines[at].trim().is_empty() {
            found.push(Part::Prose);
        }
        at = end + 1;
    }
    found
}

/// What a comment says, or what is wrong with it.
fn note(comment: &Script) -> Result<Note, String> {
    let Script { line, text } = comment;
    let inside = text.trim().trim_start_matches("<!--").trim_end_matches("-->");
    if let Some(commands) = inside.strip_prefix(" first\n") {
        return Ok(Note::First(Script { line: line + 1, text: commands.to_owned() }));
    }
    let words = inside.split_whitespace().collect::<Vec<_>>().join(" ");
    if words == "prints the table below" {
        return Ok(Note::Table);
    }
    match words.split_once(':').map(|(kind, rest)| (kind, rest.trim())) {
        Some(("not run" | "needs", "")) => Err(format!("line {line}: a reason is missing")),
        Some(("not run", why)) => Ok(Note::NotRun(why.to_owned())),
        Some(("needs", program)) => Ok(Note::Needs(program.to_owned())),
        _ => {
            Err(format!("line {line}: `<!-- {words} -->` is none of not run, needs, first, prints"))
        }
    }
}

/// All blocks of a page, or what is wrong with its comments.
pub fn blocks(page: &str) -> Result<Vec<Block>, String> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut notes = Vec::new();
    let mut above = Part::Prose;
    for part in parts(page) {
        match &part {
            Part::Comment(comment) => notes.push(note(comment)?),
            Part::Code(language, output)
                if language == "text" && matches!(above, Part::Code(..)) =>
            {
                blocks.last_mut().expect("the block above").prints = Some(output.text.clone());
            }
            Part::Code(language, script) => {
                let (language, script) = (language.clone(), script.clone());
                let notes = std::mem::take(&mut notes);
                blocks.push(Block { language, script, notes, prints: None });
            }
            Part::Table(_) | Part::Prose if !notes.is_empty() => {
                return Err(format!("no block below the comment {:?}", notes[0]));
            }
            Part::Table(table) => {
                let is_printed = |block: &&mut Block| block.notes.contains(&Note::Table);
                if let Some(block) = blocks.last_mut().filter(is_printed) {
                    block.prints.get_or_insert(format!("...\n{}...\n", table.text));
                }
            }
            Part::Prose => {}
        }
        above = part;
    }
    let without = |block: &&Block| block.notes.contains(&Note::Table) && block.prints.is_none();
    match blocks.iter().find(without) {
        Some(block) => Err(format!("line {}: no table below", block.script.line)),
        None => Ok(blocks),
    }
}

/// Whether lines are those that were expected, in which `...` stands for anything: alone for any
/// number of lines, else for a part of its line.
pub fn is_as_expected(expected: &[&str], lines: &[&str]) -> bool {
    match expected.split_first() {
        None => lines.is_empty(),
        Some((first, rest)) if first.trim() == "..." => {
            (0..=lines.len()).any(|skipped| is_as_expected(rest, &lines[skipped..]))
        }
        Some((first, rest)) => match lines.split_first() {
            Some((line, others)) => is_line(first, line) && is_as_expected(rest, others),
            None => false,
        },
    }
}

fn is_line(expected: &str, line: &str) -> bool {
    let expected = expected.trim_end();
    let Some((first, rest)) = expected.split_once("...") else {
        return line.trim_end() == expected;
    };
    let (between, last) = rest.rsplit_once("...").unwrap_or(("", rest));
    let Some(mut left) = line.trim_end().strip_prefix(first) else { return false };
    for piece in between.split("...") {
        let Some(at) = left.find(piece) else { return false };
        left = &left[at + piece.len()..];
    }
    left.ends_with(last)
}
