//! What the geometry of each kind of sensor is taken for, and how good instances are on it.
//!
//! ```sh
//! cargo run --release --example 10_sensors                # seeds 1 to 3 of the simulated street
//! # Seed 1, the cases whose name has `vlp-16` in it; seeds 1 to 3, those of an unknown place.
//! cargo run --release --example 10_sensors -- 1 vlp-16
//! cargo run --release --example 10_sensors -- unknown
//! ```

mod cases;
mod scores;

use divmerge::Taxonomy;
use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::{GroundParams, MaskSource};

use cases::Case;
use scores::Scores;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().and_then(|seed| seed.parse::<u64>().ok());
    let seeds = seed.map_or(vec![1, 2, 3], |seed| vec![seed]);
    let wanted = arguments.get(usize::from(seed.is_some())).map_or("", String::as_str);
    let cases: Vec<Case> =
        cases::all().into_iter().filter(|case| case.name.contains(wanted)).collect();
    assert!(!cases.is_empty(), "no case has `{wanted}` in its name");
    println!(
        "| cloud | geometry found | rows x columns | wraps | shadowed | PQ | ground F1 | found \
         whole |"
    );
    println!("| --- | --- | ---: | --- | ---: | ---: | ---: | ---: |");
    for case in &cases {
        row(case, &seeds);
    }
}

/// One row of the table: geometry of the first seed, means over all.
fn row(case: &Case, seeds: &[u64]) {
    let (taxonomy, ground) = (Taxonomy::semantic_kitti(), GroundParams::default());
    let config = Config::best();
    let mut scores = Scores::default();
    let mut geometry = String::new();
    for &seed in seeds {
        let frame = (case.frame)(seed);
        let by_class = pipeline::run(&frame.cloud, MaskSource::Classes(&taxonomy), &config);
        let by_ground = pipeline::run(&frame.cloud, MaskSource::NotGround(&ground), &config);
        scores.add(&frame, &by_class, &by_ground);
        if geometry.is_empty() {
            geometry = describe(&by_class);
        }
    }
    println!("| {} | {geometry} | {} |", case.name, scores.cells());
}

fn describe(stages: &Stages) -> String {
    let image = &stages.image;
    let shadowed = 100.0 * image.shadowed_count() as f64 / image.return_count().max(1) as f64;
    format!(
        "{} | {} x {} | {} | {shadowed:.1} %",
        image.projection.describe(),
        image.rows(),
        image.columns(),
        if image.wraps { "yes" } else { "no" },
    )
}
