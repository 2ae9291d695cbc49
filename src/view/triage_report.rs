//! The cases of triage as HTML: a table that can be sorted, and for each case its figure and its
//! explanation. Nothing is loaded from elsewhere; without scripts the table stays as it is.
//!
//! Either one file, in which a case is a section, or an index and a file for each case.

use super::canvas::Canvas;
use super::dark_page::dark_rules;
use super::svg::inline_svg;

/// Title and summary of the report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Head {
    /// Name of the recording.
    pub recording: String,
    /// What was examined, in a sentence or two.
    pub summary: String,
}

/// One case.
#[derive(Debug, Clone, PartialEq)]
pub struct CasePage {
    /// How likely it is a failure, 0 to 1.
    pub score: f64,
    /// Cloud topic.
    pub topic: String,
    /// Number of the cloud on its topic.
    pub frame: u64,
    /// Seconds from the start of the recording.
    pub seconds: f64,
    /// Metres, sensor frame.
    pub position: [f64; 3],
    /// What is suspect, in a word or two.
    pub kind: String,
    /// The instance; empty for points without one.
    pub instance: String,
    /// The strongest suspect in a sentence.
    pub sentence: String,
    /// Score, kind and sentence of the others.
    pub others: Vec<(f64, String, String)>,
    /// The command that explains it.
    pub command: String,
    /// The explanation's text.
    pub explanation: String,
    /// The explanation's figure.
    pub figure: Canvas,
}

/// Whether the cases are sections of one file or files of a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    OneFile,
    Folder,
}

/// The report as one file.
pub fn one_file(head: &Head, cases: &[CasePage]) -> String {
    let sections = cases.iter().enumerate().map(|(number, case)| {
        let around = format!(
            "<a href=\"#top\">back to the table</a> &middot; {}",
            steps(number, cases.len(), Layout::OneFile)
        );
        format!(
            "<section class=\"case\" id=\"case-{}\">\n{}</section>\n",
            number + 1,
            body(case, number, &around)
        )
    });
    let content =
        format!("{}{}", index_body(head, cases, Layout::OneFile), sections.collect::<String>());
    document(&head.recording, &content)
}

/// The report as files of a folder, by name: `index.html` first, then one for each case.
pub fn folder(head: &Head, cases: &[CasePage]) -> Vec<(String, String)> {
    let index = document(&head.recording, &index_body(head, cases, Layout::Folder));
    let pages = cases.iter().enumerate().map(|(number, case)| {
        let around = format!(
            "<a href=\"index.html\" id=\"up\">all cases</a> &middot; {}",
            steps(number, cases.len(), Layout::Folder)
        );
        let content = format!("<main class=\"case\">\n{}</main>\n", body(case, number, &around));
        let title = format!("{} {}", number + 1, head.recording);
        (file_name(number), document(&title, &content))
    });
    std::iter::once(("index.html".to_owned(), index)).chain(pages).collect()
}

fn file_name(number: usize) -> String {
    format!("case-{:03}.html", number + 1)
}

fn link(number: usize, layout: Layout) -> String {
    match layout {
        Layout::OneFile => format!("#case-{}", number + 1),
        Layout::Folder => file_name(number),
    }
}

/// Links to the case before and the case after.
fn steps(number: usize, count: usize, layout: Layout) -> String {
    let step = |to: Option<usize>, rel: &str, words: &str| match to.filter(|&to| to < count) {
        Some(to) => format!("<a rel=\"{rel}\" href=\"{}\">{words}</a>", link(to, layout)),
        None => format!("<span>{words}</span>"),
    };
    let before = step(number.checked_sub(1), "prev", "&larr; previous");
    format!("{before} &middot; {}", step(Some(number + 1), "next", "next &rarr;"))
}

const COLUMNS: [(&str, &str); 7] = [
    ("rank", "number"),
    ("score", "number"),
    ("frame", "number"),
    ("time, s", "number"),
    ("kind", "text"),
    ("x, y, z in m", "text"),
    ("what", "text"),
];

fn index_body(head: &Head, cases: &[CasePage], layout: Layout) -> String {
    let table = match cases.is_empty() {
        true => "<p>Nothing suspect was found.</p>\n".to_owned(),
        false => table(cases, layout),
    };
    format!(
        "<header id=\"top\">\n<h1>Triage of {}</h1>\n<p>{}</p>\n\
         <p class=\"keys\">Keys: <kbd>j</kbd> <kbd>k</kbd> move, <kbd>Enter</kbd> opens, \
         <kbd>?</kbd> lists all keys.</p>\n</header>\n{table}{HELP}",
        escaped(&head.recording),
        escaped(&head.summary)
    )
}

fn table(cases: &[CasePage], layout: Layout) -> String {
    let columns = COLUMNS.iter().enumerate().map(|(place, (name, kind))| {
        let sorted = if place == 0 { " aria-sort=\"ascending\"" } else { "" };
        let button = format!("<button type=\"button\">{name}</button>");
        format!("<th scope=\"col\" class=\"{kind}\"{sorted}>{button}</th>")
    });
    let columns: String = columns.collect();
    let rows = cases.iter().enumerate().map(|(number, case)| row(case, number, layout));
    let rows: String = rows.collect();
    format!(
        "<table id=\"cases\">\n<thead><tr>{columns}</tr></thead>\n\
         <tbody>\n{rows}</tbody>\n</table>\n"
    )
}

fn row(case: &CasePage, number: usize, layout: Layout) -> String {
    let [x, y, z] = case.position;
    let percent = 100.0 * case.score;
    format!(
        "<tr tabindex=\"-1\"><td class=\"number\">{}</td>\
         <td class=\"number\"><span class=\"bar\" style=\"--part:{percent:.0}%\">\
         {percent:.0} %</span></td><td class=\"number\" title=\"{}\">{}</td>\
         <td class=\"number\">{:.1}</td><td>{}</td><td class=\"place\">{x:.1}, {y:.1}, {z:.1}</td>\
         <td><a href=\"{}\">{}</a></td></tr>\n",
        number + 1,
        escaped(&case.topic),
        case.frame,
        case.seconds,
        escaped(&case.kind),
        link(number, layout),
        escaped(&case.sentence)
    )
}

fn body(case: &CasePage, number: usize, around: &str) -> String {
    let [x, y, z] = case.position;
    let instance = match case.instance.as_str() {
        "" => String::new(),
        title => format!(" &middot; instance {}", escaped(title)),
    };
    format!(
        "<nav>{around}</nav>\n<h2>{}. {}</h2>\n<p class=\"lead\">{}.</p>\n\
         <p class=\"facts\">{} &middot; frame {} &middot; {:.3} s &middot; \
         {x:.2}, {y:.2}, {z:.2} m{instance} &middot; score {:.0} %</p>\n\
         <figure>{}</figure>\n{}<h3>Explanation</h3>\n<pre>{}</pre>\n\
         <h3>On the command line</h3>\n<pre class=\"command\">{}</pre>\n",
        number + 1,
        escaped(&capitalised(&case.kind)),
        escaped(&case.sentence),
        escaped(&case.topic),
        case.frame,
        case.seconds,
        100.0 * case.score,
        inline_svg(&case.figure, &case.sentence),
        other_suspects(case),
        escaped(case.explanation.trim_end()),
        escaped(&case.command)
    )
}

fn other_suspects(case: &CasePage) -> String {
    let item = |(score, kind, sentence): &(f64, String, String)| {
        let (kind, sentence, percent) = (escaped(kind), escaped(sentence), 100.0 * score);
        format!("<li><b>{kind}</b> ({percent:.0} %): {sentence}</li>\n")
    };
    match case.others.iter().map(item).collect::<String>().as_str() {
        "" => String::new(),
        list => format!("<h3>Other suspicions</h3>\n<ul>\n{list}</ul>\n"),
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn document(title: &str, content: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Triage: {}</title>\n<link rel=\"icon\" href=\"data:,\">\n\
         <style>\n{STYLE}@media screen and (prefers-color-scheme: dark) {{\n{}}}\n</style>\n\
         </head>\n<body>\n{content}\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        escaped(title),
        dark_rules("figure svg")
    )
}

/// Text as HTML shows it, in content and in attributes; what HTML cannot hold is replaced.
fn escaped(text: &str) -> String {
    let text = text.replace(|c: char| c.is_control() && !"\n\t".contains(c), "\u{fffd}");
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}

const HELP: &str = "<dialog id=\"help\">
<h2>Keys</h2>
<dl>
<dt><kbd>j</kbd> <kbd>&darr;</kbd></dt><dd>next case</dd>
<dt><kbd>k</kbd> <kbd>&uarr;</kbd></dt><dd>previous case</dd>
<dt><kbd>Enter</kbd></dt><dd>open the case</dd>
<dt><kbd>1</kbd> to <kbd>7</kbd></dt><dd>sort by that column; again to reverse</dd>
<dt><kbd>u</kbd></dt><dd>back to the table</dd>
<dt><kbd>?</kbd></dt><dd>this list</dd>
</dl>
<form method=\"dialog\"><button>Close</button></form>
</dialog>
";

const STYLE: &str = include_str!("triage_report.css");
const SCRIPT: &str = include_str!("triage_report.js");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::theme;

    fn case(sentence: &str) -> CasePage {
        CasePage {
            score: 0.5,
            topic: "/a<b>\"'&".into(),
            frame: 3,
            seconds: 0.3,
            position: [1.0, -2.0, 0.0],
            kind: "two masses".into(),
            instance: "7 car".into(),
            sentence: sentence.into(),
            others: vec![(0.1, "leftover".into(), "<i>".into())],
            command: "divmerge explain 'a b.mcap'".into(),
            explanation: "A <-> B\n".into(),
            figure: Canvas::new(10.0, 10.0, theme::PAGE),
        }
    }

    #[test]
    fn text_of_the_recording_is_text() {
        let head = Head { recording: "<script>x</script>".into(), summary: "a & b".into() };
        let page = one_file(&head, &[case("<img src=x onerror=y>")]);
        for raw in ["<script>x", "<img", "<i>", "/a<b>", "A <-> B"] {
            assert!(!page.contains(raw), "{raw}");
        }
        assert!(
            page.contains("&lt;img src=x onerror=y&gt;")
                && page.contains("/a&lt;b&gt;&quot;&#39;&amp;")
        );
        assert_eq!(escaped("a'b"), "a&#39;b");
    }

    #[test]
    fn nothing_is_loaded_and_every_link_has_its_page() {
        let head = Head { recording: "drive.mcap".into(), summary: String::new() };
        let cases = [case("one"), case("two")];
        let files = folder(&head, &cases);
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["index.html", "case-001.html", "case-002.html"]);
        for (_, page) in &files {
            assert!(!page.contains("http://") && !page.contains("https://"), "{page}");
            for link in page.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
                assert!(names.contains(&link) || link == "data:,", "{link}");
            }
        }
        let page = one_file(&head, &cases);
        for link in page.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
            assert!(page.contains(&format!("id=\"{link}\"")), "{link}");
        }
        assert!(one_file(&head, &[]).contains("Nothing suspect"));
    }
}
