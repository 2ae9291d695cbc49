//! The divide step: every seed grows its component, and borders vote (Alg. 1; ALGORITHM section 4).

use super::votes::{Ballot, Votes};
use crate::cluster::authors::growth::Growth;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::{ClusterParams, Leftovers, Seeding};
use crate::range_image::NEIGHBOURS;

/// The local components of the divide step and the votes on their borders.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Components {
    /// M: label of each object pixel from 1; 0 where no seed reached it.
    pub label: Vec<u32>,
    /// Number of labels: one per seed, then one per reseeded leftover.
    pub count: u32,
    /// Object pixels that the growth added, in order, with the label they were added to; a pixel
    /// that changed hands is there twice. Seeds are not in it.
    pub grown: Vec<(u32, u32)>,
}

/// Grows all seeds round by round.
///
/// In every round each non-empty queue, in seed order, pops one pixel and visits its neighbours
/// left, right, up and down. Time O(M); memory O(M) and one entry per pair of border pixels.
///
/// Where seeds are labelled at once a pixel keeps the label it gets, and every pixel with a label
/// visits all its neighbours, so that the votes of Alg. 1 are known from the labels alone: two for
/// each pair of neighbours with different labels, in favour where the condition holds (one that
/// holds is visited from both sides when both have their labels; one that does not is on the
/// undecided list if it comes too early). They are counted afterwards.
pub fn divide(
    objects: &ObjectPixels,
    seeds: &[u32],
    params: &ClusterParams,
) -> (Components, Votes) {
    let (label, grown, ballot, weight) = match params.seeding {
        Seeding::AtOnce => {
            let (label, grown) = grow(objects, seeds);
            let ballot = border_votes(objects, &label);
            (label, grown, ballot, 2)
        }
        Seeding::AtPop => {
            let Growth { label, grown, ballot, .. } = Growth::new(objects, seeds).run();
            (label, grown, ballot, 1)
        }
    };
    let mut components = Components { label, count: seeds.len() as u32, grown };
    if params.leftovers == Leftovers::Reseeded {
        reseed(objects, &mut components);
    }
    let votes = ballot.count(components.count, weight);
    (components, votes)
}

/// Alg. 1 without its votes, for seeds that are labelled at once: the label of each object pixel,
/// and the pixels that were added with their labels, in order.
///
/// A pixel is in one queue only, so queues are linked lists through the pixels. Queues take turns,
/// and each turn is elsewhere in the image: what a turn reads of a pixel lies together.
fn grow(objects: &ObjectPixels, seeds: &[u32]) -> (Vec<u32>, Vec<(u32, u32)>) {
    let connected = connected_neighbours(objects);
    // The last one stands for what is not connected.
    let mut pixels = vec![Pixel { label: 0, next: END }; objects.len() + 1];
    pixels[objects.len()].label = u32::MAX;
    for (label, &seed) in (1..).zip(seeds) {
        pixels[seed as usize].label = label;
    }
    // A pixel more than can be added: see below.
    let mut grown = vec![(0, 0); objects.len() - seeds.len() + 1];
    let mut count = 0;
    // First and last pixel of every queue that is not empty.
    let mut queues: Vec<[u32; 2]> = seeds.iter().map(|&seed| [seed; 2]).collect();
    while !queues.is_empty() {
        let mut kept = 0;
        for place in 0..queues.len() {
            let [first, mut last] = queues[place];
            let label = pixels[first as usize].label;
            // Which neighbours are free cannot be foreseen, so each is written down as if it were,
            // without a branch.
            for neighbour in connected[first as usize] {
                let found = pixels[neighbour as usize].label;
                let is_free = found == 0;
                pixels[neighbour as usize].label = if is_free { label } else { found };
                pixels[last as usize].next = if is_free { neighbour } else { END };
                last = if is_free { neighbour } else { last };
                grown[count] = (neighbour, label);
                count += usize::from(is_free);
            }
            let next = pixels[first as usize].next;
            queues[kept] = [next, last];
            kept += usize::from(next != END);
        }
        queues.truncate(kept);
    }
    grown.truncate(count);
    pixels.truncate(objects.len());
    (pixels.into_iter().map(|pixel| pixel.label).collect(), grown)
}

/// An object pixel while components grow: its label or 0, and the one behind it in its queue.
#[derive(Clone, Copy)]
struct Pixel {
    label: u32,
    next: u32,
}

/// M x 4: the neighbours towards which the condition holds, left, right, up and down; M where there
/// is none.
fn connected_neighbours(objects: &ObjectPixels) -> Vec<[u32; NEIGHBOURS]> {
    let none = objects.len() as u32;
    let pixels = objects.neighbours.iter().zip(&objects.connected);
    let of_pixel = |(neighbours, connected): (&[u32; NEIGHBOURS], &[bool; NEIGHBOURS])| {
        std::array::from_fn(|i| if connected[i] { neighbours[i] } else { none })
    };
    pixels.map(of_pixel).collect()
}

/// One vote for each pair of neighbours with different labels.
fn border_votes(objects: &ObjectPixels, label: &[u32]) -> Ballot {
    let mut ballot = Ballot::with_places(FORWARD.len() * label.len());
    let pixels = objects.neighbours.iter().zip(&objects.connected).zip(label);
    for ((neighbours, connected), &own) in pixels {
        for direction in FORWARD {
            let other = label.get(neighbours[direction] as usize).copied().unwrap_or(0);
            let counts = (own != 0) & (other != 0);
            ballot.cast_if(counts, own, other, connected[direction]);
        }
    }
    ballot
}

/// Right and down: each pair of neighbours from one side.
const FORWARD: [usize; 2] = [1, 3];

const END: u32 = u32::MAX;

/// Gives each connected leftover a label of its own, in row-major order of its first pixel. A
/// leftover has no true condition towards any component, so it brings no vote in favour.
fn reseed(objects: &ObjectPixels, components: &mut Components) {
    let mut stack = Vec::new();
    for first in 0..objects.len() {
        if components.label[first] != 0 {
            continue;
        }
        components.count += 1;
        components.label[first] = components.count;
        stack.push(first);
        while let Some(object) = stack.pop() {
            for direction in 0..objects.neighbours[object].len() {
                let neighbour = objects.neighbours[object][direction];
                if objects.connected[object][direction] && components.label[neighbour as usize] == 0
                {
                    components.label[neighbour as usize] = components.count;
                    stack.push(neighbour as usize);
                }
            }
        }
    }
}
