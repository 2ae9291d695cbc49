//! The merge step on six components and hand-made votes, move by move, as in the paper's example.
//!
//! ```sh
//! cargo run --example 05_merge_six_components -- docs/images/merge-six-components.svg
//! ```

use divmerge::cluster::{ClusterParams, Vote, Votes, merge};
use divmerge::view::{merge_moves, png, svg};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let output = std::env::args().nth(1).ok_or("usage: 05_merge_six_components OUT.svg|OUT.png")?;
    // Two objects: 1, 2, 4 and 3, 5, 6. On its own 4 would take 6 (4 : 3); with the votes that it
    // took over from 1 and 2 it does not (7 : 8), and 5 takes 6.
    let pairs = [
        (1, 2, 6, 1),
        (1, 3, 1, 5),
        (1, 4, 2, 2),
        (1, 6, 1, 3),
        (2, 3, 0, 4),
        (2, 4, 5, 2),
        (2, 6, 2, 2),
        (3, 4, 1, 3),
        (3, 5, 7, 2),
        (4, 6, 4, 3),
        (5, 6, 6, 1),
    ];
    let vote = |(a, b, positive, negative)| Vote { a, b, positive, negative };
    let votes = Votes { components: 6, pairs: pairs.map(vote).to_vec() };
    let merged = merge(&votes, &ClusterParams::paper());
    for step in &merged.steps {
        println!("{} asks {}: {} : {}", step.target, step.query, step.positive, step.negative);
    }
    println!("instance of each component: {:?}", merged.instance_of_component);
    let page = merge_moves(&votes, &merged);
    if output.ends_with(".png") {
        std::fs::write(output, png(&page, 192.0).ok_or("too large")?)?;
    } else {
        std::fs::write(output, svg(&page))?;
    }
    Ok(())
}
