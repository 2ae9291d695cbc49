//! Table `drives`: leave one drive out. The constants of preset `best` that are a choice are chosen
//! on the other drives, from a small grid, and scored on the drive left out.

use divmerge::evaluate::panoptic::Panoptic;
use divmerge::pipeline::Config;

use crate::frames::Frame;
use crate::methods::Method;
use crate::scores::{add, head, scores, things};

/// Values that are tried, the preset's own among them.
const SLACK: [f64; 3] = [1.1, 1.2, 1.3];
const TOUCHING: [f64; 3] = [0.1, 0.17, 0.25];
const NEARNESS: [f64; 3] = [0.1, 0.2, 0.3];

struct Choice {
    name: String,
    is_preset: bool,
    method: Method,
}

/// Prints, for each drive, the choice made without it and what that gives on it.
pub fn tables(frames: &[Frame]) {
    let choices = choices();
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    // [choice][drive]
    let found: Vec<Vec<f64>> = choices
        .iter()
        .map(|choice| groups.iter().map(|group| score(&choice.method, frames, group)).collect())
        .collect();
    let preset = choices.iter().position(|choice| choice.is_preset).unwrap_or(0);
    let columns = [
        "chosen on the others",
        "on the others",
        "on this drive",
        "`best` on this drive",
        "highest of the grid on this drive",
    ];
    head("Drive left out", &columns.map(str::to_owned));
    let mut sums = [0.0; 2];
    for (drive, group) in groups.iter().enumerate() {
        let others = |choice: usize| {
            let rest = found[choice].iter().enumerate().filter(|(other, _)| *other != drive);
            rest.map(|(_, quality)| quality).sum::<f64>() / (groups.len() - 1) as f64
        };
        // Of equals the preset, then the first.
        let chosen = (0..choices.len()).fold(preset, |chosen, choice| {
            if others(choice) > others(chosen) + 1e-9 { choice } else { chosen }
        });
        let highest = found.iter().map(|of| of[drive]).fold(0.0, f64::max);
        println!(
            "| {group} | {} | {:.2} | {:.2} | {:.2} | {highest:.2} |",
            choices[chosen].name,
            others(chosen),
            found[chosen][drive],
            found[preset][drive]
        );
        sums[0] += found[chosen][drive] / groups.len() as f64;
        sums[1] += found[preset][drive] / groups.len() as f64;
    }
    println!("| mean | | | {:.2} | {:.2} | |", sums[0], sums[1]);
    let means = found.iter().map(|of| of.iter().sum::<f64>() / groups.len() as f64);
    let (low, high) = means.fold((f64::INFINITY, 0.0_f64), |(l, h), m| (l.min(m), h.max(m)));
    println!("\nMean over the drives of the {} choices: {low:.2} to {high:.2}.\n", choices.len());
}

fn score(method: &Method, frames: &[Frame], group: &str) -> f64 {
    let mut sums: Panoptic = scores();
    for frame in frames.iter().filter(|frame| frame.group == group) {
        add(frame, &method.run(frame), &mut sums);
    }
    things(&sums, &[]).unwrap_or(0.0)
}

fn choices() -> Vec<Choice> {
    let mut choices = Vec::new();
    for slack in SLACK {
        for touching in TOUCHING {
            for nearness in NEARNESS {
                let mut config = Config::best();
                if let Some(fragments) = &mut config.cluster.fragments {
                    (fragments.slack, fragments.touching_share) = (slack, touching);
                }
                if let Some(near) = &mut config.cluster.condition.nearness {
                    near.share_of_width = nearness;
                }
                choices.push(Choice {
                    name: format!("slack {slack}, touching {touching} W, near {nearness} W"),
                    is_preset: config == Config::best(),
                    method: Method::ours("", config),
                });
            }
        }
    }
    choices
}
