//! Our presets beside other methods, as the Markdown tables of docs/results.md:
//!
//! ```sh
//! cargo run --release --example 07_methods -- [TABLE...] [--data ../shared/data/semantickitti] \
//!     [--drive NAME] [--figures FOLDER] [--seed 0]
//! ```
//!
//! Tables: `real` (needs the data), `simulated`, `corrupted`, `drives` (needs the data),
//! `robustness` (each kind of corruption by itself and all together; minutes), `lost` (the objects
//! that preset `best` loses, one by one); all but the last two where none is named. Classes are
//! given in all of them; `corrupted` and `robustness` spoil them, with the seed. Mean panoptic
//! quality over the thing classes that truth has with 50 points or more.

mod corrupted;
mod drives;
mod frames;
mod lost;
mod methods;
mod real;
mod robustness;
mod scores;
mod simulated;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};

/// What the command line says.
#[derive(Default)]
struct Arguments {
    tables: Vec<String>,
    data: Option<PathBuf>,
    drive: Option<String>,
    figures: Option<PathBuf>,
    seed: u64,
}

const TABLES: [&str; 6] = ["real", "simulated", "corrupted", "drives", "robustness", "lost"];

fn main() -> Result<()> {
    let arguments = arguments()?;
    let mut real = match &arguments.data {
        Some(root) => frames::labelled(root)?,
        None => Vec::new(),
    };
    real.retain(|frame| arguments.drive.as_ref().is_none_or(|drive| *drive == frame.group));
    for table in &arguments.tables {
        match table.as_str() {
            "real" | "drives" if real.is_empty() => eprintln!("skipped: {table} (no --data)"),
            "real" => real::tables(&real),
            "simulated" => simulated::tables(),
            "corrupted" => corrupted::tables(&real, arguments.figures.as_deref(), arguments.seed)?,
            "drives" => drives::tables(&real),
            "robustness" => {
                robustness::tables(&real, arguments.figures.as_deref(), arguments.seed)?
            }
            _ => lost::tables(&real),
        }
    }
    Ok(())
}

fn arguments() -> Result<Arguments> {
    let mut arguments = Arguments::default();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--figures" => arguments.figures = words.next().map(PathBuf::from),
            "--drive" => arguments.drive = words.next(),
            "--seed" => arguments.seed = words.next().context("--seed N")?.parse()?,
            "--data" => arguments.data = words.next().map(PathBuf::from),
            table if TABLES.contains(&table) => arguments.tables.push(table.into()),
            other => bail!("`{other}`: tables are {}", TABLES.join(", ")),
        }
    }
    if arguments.tables.is_empty() {
        let all = TABLES.iter().filter(|table| !["robustness", "lost"].contains(*table));
        arguments.tables = all.map(|table| table.to_string()).collect();
    }
    Ok(arguments)
}
