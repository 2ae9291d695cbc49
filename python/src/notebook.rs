//! What a notebook shows of a result.

use std::fmt::Write;

use divmerge::cloud::Instance;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Most classes that are listed.
const ROWS: usize = 12;

/// A row of the table.
struct Row<'a> {
    class: &'a str,
    instances: usize,
    points: usize,
}

/// A heading, the classes with the most points, and a picture (PNG).
pub fn html(
    py: Python<'_>,
    heading: &str,
    instances: &[Instance],
    png: &Bound<'_, PyBytes>,
) -> PyResult<String> {
    let escape = py.import(intern!(py, "html"))?.getattr(intern!(py, "escape"))?;
    let rows = rows(instances);
    let mut html = format!("<p>{}</p>", escape.call1((heading,))?.extract::<String>()?);
    if !rows.is_empty() {
        html += "<table><tr><th>class</th><th>instances</th><th>points</th></tr>";
        for Row { class, instances, points } in rows.iter().take(ROWS) {
            let class: String = escape.call1((class,))?.extract()?;
            let cells = [class, instances.to_string(), points.to_string()];
            let cells = cells.map(|cell| format!("<td>{cell}</td>"));
            let _ = write!(html, "<tr>{}</tr>", cells.concat());
        }
        html += "</table>";
    }
    if let Some(more) = rows.len().checked_sub(ROWS).filter(|&more| more > 0) {
        let _ = write!(html, "<p>and {more} more</p>");
    }
    let base64 = py.import(intern!(py, "base64"))?;
    let coded = base64.call_method1(intern!(py, "b64encode"), (png,))?;
    let coded: String = coded.call_method0(intern!(py, "decode"))?.extract()?;
    let _ = write!(html, "<img alt=\"instances\" src=\"data:image/png;base64,{coded}\">");
    Ok(html)
}

/// The classes of instances, those of the most points first.
fn rows(instances: &[Instance]) -> Vec<Row<'_>> {
    let mut rows: Vec<Row> = Vec::new();
    for one in instances {
        let class = match one.coarse_class {
            Some(found) => found.class.name(),
            None if one.class_name.is_empty() => "object",
            None => &one.class_name,
        };
        let points = one.points as usize;
        match rows.iter_mut().find(|row| row.class == class) {
            Some(row) => (row.instances, row.points) = (row.instances + 1, row.points + points),
            None => rows.push(Row { class, instances: 1, points }),
        }
    }
    rows.sort_by_key(|row| std::cmp::Reverse(row.points));
    rows
}
