//! Tables of measurements: Markdown that reads well in a terminal, and CSV.

use std::path::{Path, PathBuf};

use anyhow::Result;
use divmerge::comparison::MethodScores;
use serde::Serialize;

/// Rows of cells, the head first.
pub struct Table {
    rows: Vec<Vec<String>>,
    /// Leading columns of words, which stand to the left.
    words: usize,
}

/// Columns of what was measured.
const FIGURES: [&str; 8] =
    ["PQ", "PQ things", "SQ things", "RQ things", "OSE", "USE", "cut, ms", "cloud, ms"];

/// A table of measurements under a head of what stands before them.
pub fn table<'a>(
    head: &[&str],
    rows: impl Iterator<Item = (Vec<String>, &'a MethodScores)>,
) -> Table {
    let head = head.iter().chain(&FIGURES).map(|&name| name.to_owned()).collect();
    let rows = rows.map(|(before, measured)| before.into_iter().chain(figures(measured)).collect());
    Table { rows: std::iter::once(head).chain(rows).collect(), words: 1 }
}

fn figures(measured: &MethodScores) -> [String; 8] {
    let MethodScores { all, things, over, under, cut_ms, frame_ms, .. } = measured;
    let percent =
        |figure: Option<f64>| figure.map_or("-".into(), |figure| format!("{:.2}", figure * 100.0));
    [
        percent(all.map(|all| all.pq)),
        percent(things.map(|things| things.pq)),
        percent(things.map(|things| things.sq)),
        percent(things.map(|things| things.rq)),
        format!("{:.2}", over.0),
        format!("{:.2}", under.0),
        format!("{cut_ms:.2}"),
        format!("{frame_ms:.2}"),
    ]
}

impl Table {
    /// A table of a column of words and some of numbers.
    pub fn new(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Self {
        let head = head.iter().map(|&name| name.to_owned()).collect();
        Table { rows: std::iter::once(head).chain(rows).collect(), words: 1 }
    }

    /// Adds a column at the right.
    pub fn push_column(&mut self, name: &str, cells: impl Iterator<Item = String>) {
        let cells = std::iter::once(name.to_owned()).chain(cells);
        self.rows.iter_mut().zip(cells).for_each(|(row, cell)| row.push(cell));
    }

    /// Markdown whose columns have one width.
    pub fn markdown(&self) -> String {
        let columns = self.rows[0].len();
        let width = |column: usize| self.rows.iter().map(|row| row[column].chars().count()).max();
        let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
        let line = |cell: &dyn Fn(usize, usize) -> String| {
            let cells = widths.iter().enumerate().map(|(column, &width)| cell(column, width));
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let is_words = |column| column < self.words;
        let mut text = String::new();
        for (number, row) in self.rows.iter().enumerate() {
            text += &line(&|column, width| match is_words(column) {
                true => format!("{:<width$}", row[column]),
                false => format!("{:>width$}", row[column]),
            });
            if number == 0 {
                text += &line(&|column, width| match is_words(column) {
                    true => "-".repeat(width),
                    false => format!("{:->width$}", ":"),
                });
            }
        }
        text
    }

    fn csv(&self) -> String {
        let line = |row: &Vec<String>| {
            row.iter().map(|cell| csv_cell(cell)).collect::<Vec<_>>().join(",") + "\n"
        };
        self.rows.iter().map(line).collect()
    }

    /// Writes the table as the ending asks: `.csv` or `.md`.
    pub fn write(&self, output: &Path, force: bool) -> Result<()> {
        let text = if extension(output) == "csv" { self.csv() } else { self.markdown() };
        Ok(divmerge::io::write_file(output, text.as_bytes(), force)?)
    }
}

/// Writes everything that is known of some rows as JSON.
pub fn write_json(output: &Path, rows: &impl Serialize, force: bool) -> Result<()> {
    let text = serde_json::to_string_pretty(rows)? + "\n";
    Ok(divmerge::io::write_file(output, text.as_bytes(), force)?)
}

/// A cell of a CSV file (RFC 4180).
pub fn csv_cell(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

/// The ending of a path in lower case.
pub fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Reads the name of a file for a chart or a table.
pub fn output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match extension(&path).as_str() {
        "svg" | "png" | "csv" | "md" | "json" => Ok(path),
        _ => Err("must end in .svg, .png, .csv, .md or .json".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_and_csv() {
        let rows = vec![vec!["name".into(), "n".into()], vec!["a, b".into(), "12".into()]];
        let mut table = Table { rows, words: 1 };
        table.push_column("m", ["7".to_owned()].into_iter());
        let expected = "| name |  n | m |\n| ---- | -: | : |\n| a, b | 12 | 7 |\n";
        assert_eq!(table.markdown(), expected);
        assert_eq!(table.csv(), "name,n,m\n\"a, b\",12,7\n");
    }
}
