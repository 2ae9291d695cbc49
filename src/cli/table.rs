//! Tables: Markdown that is readable in a terminal, and CSV.

use anyhow::Result;
use serde::Serialize;

use crate::cli::output::{OutputFile, extension};
use crate::comparison::MethodScores;
use crate::text::csv_line;
use crate::view::{LineChart, line_charts};

/// Rows of cells; the first row is the head, the first column has words, which are aligned left.
pub struct Table {
    rows: Vec<Vec<String>>,
}

/// Columns of measurements: `th` are things, `cut` is from object mask to instances.
const FIGURES: [&str; 8] = ["PQ", "PQ th", "SQ th", "RQ th", "OSE", "USE", "cut ms", "all ms"];

/// A table of measurements, after columns of their own that `head` names.
pub fn measurements<'a>(
    head: &[&str],
    rows: impl Iterator<Item = (Vec<String>, &'a MethodScores)>,
) -> Table {
    let head: Vec<&str> = head.iter().chain(&FIGURES).copied().collect();
    let rows = rows.map(|(before, measured)| before.into_iter().chain(figures(measured)).collect());
    Table::new(&head, rows)
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
    pub fn new(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Self {
        let head = head.iter().map(|&name| name.to_owned()).collect();
        Table { rows: std::iter::once(head).chain(rows).collect() }
    }

    /// Adds a column at the right.
    pub fn push_column(&mut self, name: &str, cells: impl Iterator<Item = String>) {
        let cells = std::iter::once(name.to_owned()).chain(cells);
        self.rows.iter_mut().zip(cells).for_each(|(row, cell)| row.push(cell));
    }

    /// Markdown with aligned columns, without those that are empty in all rows.
    pub fn markdown(&self) -> String {
        let is_empty = |column: usize| {
            self.rows.len() > 1 && self.rows[1..].iter().all(|row| row[column] == "-")
        };
        let columns = (0..self.rows[0].len()).filter(|&column| !is_empty(column));
        let width = |column: usize| self.rows.iter().map(|row| row[column].chars().count()).max();
        let widths: Vec<(usize, usize)> =
            columns.map(|column| (column, width(column).unwrap_or(0))).collect();
        let line = |cell: &dyn Fn(usize, usize) -> String| {
            let cells = widths.iter().map(|&(column, width)| cell(column, width));
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let mut text = String::new();
        for (number, row) in self.rows.iter().enumerate() {
            text += &line(&|column, width| match column == 0 {
                true => format!("{:<width$}", row[column]),
                false => format!("{:>width$}", row[column]),
            });
            if number == 0 {
                text += &line(&|column, width| match column == 0 {
                    true => "-".repeat(width),
                    false => format!("{:->width$}", ":"),
                });
            }
        }
        text
    }

    fn csv(&self) -> String {
        self.rows.iter().map(|row| csv_line(row)).collect()
    }
}

/// Writes measurements by the extension of each output: all of `rows` as JSON, the table as CSV or
/// Markdown, or charts.
pub fn write_measurements(
    outputs: &[OutputFile],
    rows: &impl Serialize,
    table: &Table,
    charts: impl Fn() -> (String, Vec<LineChart>),
) -> Result<()> {
    const DPI: f64 = 192.0;
    for output in outputs {
        match extension(output.path()).as_str() {
            "json" => output.write_json(rows)?,
            "csv" => output.write(table.csv().as_bytes())?,
            "md" => output.write(table.markdown().as_bytes())?,
            _ => {
                let (title, charts) = charts();
                output.write_picture(&line_charts(&title, &charts), DPI)?;
            }
        }
        println!("wrote {}", output.path().display());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_fit_a_hundred_columns() {
        let scores = crate::evaluate::PanopticQuality { pq: 1.0, sq: 1.0, rq: 1.0, miou: 1.0 };
        let measured = MethodScores {
            frames: 1,
            all: Some(scores),
            things: Some(scores),
            classes: Vec::new(),
            over: (123.45, 0.0),
            under: (123.45, 0.0),
            cut_ms: 123.45,
            frame_ms: 123.45,
            slowest_ms: 0.0,
        };
        let row = || std::iter::once((vec!["depth-clustering".to_owned()], &measured));
        let mut table = measurements(&["method"], row());
        table.push_column("MiB", ["12345".to_owned()].into_iter());
        assert!(table.markdown().lines().all(|line| line.len() <= 100), "{}", table.markdown());
        let row = || std::iter::once((vec!["authors".into(), "0.0123".into()], &measured));
        let table = measurements(&["preset", "angle, degrees"], row());
        assert!(table.markdown().lines().all(|line| line.len() <= 100), "{}", table.markdown());
    }

    #[test]
    fn markdown_and_csv() {
        let rows = vec![vec!["name".into(), "n".into()], vec!["a, b".into(), "12".into()]];
        let mut table = Table { rows };
        table.push_column("m", ["7".to_owned()].into_iter());
        let expected = "| name |  n | m |\n| ---- | -: | : |\n| a, b | 12 | 7 |\n";
        assert_eq!(table.markdown(), expected);
        assert_eq!(table.csv(), "name,n,m\n\"a, b\",12,7\n");
        table.push_column("none", ["-".to_owned()].into_iter());
        assert_eq!(table.markdown(), expected);
        assert_eq!(table.csv(), "name,n,m,none\n\"a, b\",12,7,-\n");
    }
}
