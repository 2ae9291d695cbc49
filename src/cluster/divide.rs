//! The divide step: every seed grows its component, and borders vote (Alg. 1; ALGORITHM section 4).

use super::objects::ObjectPixels;
use super::params::{ClusterParams, Leftovers, Seeding};
use super::votes::{Ballot, Votes};
use crate::range_image::NO_NEIGHBOUR;

/// The local components of the divide step and the votes on their borders.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Components {
    /// M: label of each object pixel from 1; 0 where no seed reached it.
    pub label: Vec<u32>,
    /// Number of labels: one per seed, then one per reseeded leftover.
    pub count: u32,
    /// Object pixels that the growth added, in order, with the label they were added to; a pixel that
    /// changed hands is there twice. Seeds are not in it.
    pub grown: Vec<(u32, u32)>,
}

/// Grows all seeds round by round.
///
/// In every round each non-empty queue, in seed order, pops one pixel and visits its neighbours left,
/// right, up and down. Time O(M); memory O(M) and one entry per pair of border pixels.
pub fn divide(
    objects: &ObjectPixels,
    seeds: &[u32],
    params: &ClusterParams,
) -> (Components, Votes) {
    let mut growth = Growth::new(objects, seeds, params.seeding);
    growth.run();
    let Growth { label, grown, undecided, mut ballot, .. } = growth;
    for (own, neighbour) in undecided {
        let other = label[neighbour as usize];
        if other > 0 {
            ballot.against(own, other);
        }
    }
    let mut components = Components { label, count: seeds.len() as u32, grown };
    if params.leftovers == Leftovers::Reseeded {
        reseed(objects, &mut components);
    }
    let votes = ballot.count(components.count);
    (components, votes)
}

/// The state of Alg. 1. Queues are linked lists in one arena.
struct Growth<'a> {
    objects: &'a ObjectPixels,
    label: Vec<u32>,
    grown: Vec<(u32, u32)>,
    undecided: Vec<(u32, u32)>,
    ballot: Ballot,
    arena: Vec<Entry>,
    queues: Vec<Queue>,
}

struct Entry {
    object: u32,
    next: u32,
}

struct Queue {
    label: u32,
    head: u32,
    tail: u32,
}

const END: u32 = u32::MAX;

impl<'a> Growth<'a> {
    fn new(objects: &'a ObjectPixels, seeds: &[u32], seeding: Seeding) -> Self {
        let mut label = vec![0; objects.len()];
        let mut arena = Vec::with_capacity(objects.len());
        let mut queues = Vec::with_capacity(seeds.len());
        for (number, &seed) in (0_u32..).zip(seeds) {
            arena.push(Entry { object: seed, next: END });
            queues.push(Queue { label: number + 1, head: number, tail: number });
            if seeding == Seeding::AtOnce {
                label[seed as usize] = number + 1;
            }
        }
        Growth {
            objects,
            label,
            grown: Vec::with_capacity(objects.len()),
            undecided: Vec::new(),
            ballot: Ballot::default(),
            arena,
            queues,
        }
    }

    fn run(&mut self) {
        let mut queues = std::mem::take(&mut self.queues);
        while !queues.is_empty() {
            for queue in &mut queues {
                self.expand(queue);
            }
            queues.retain(|queue| queue.head != END);
        }
    }

    /// ExpandCluster of Alg. 1: pops one pixel and visits its neighbours.
    fn expand(&mut self, queue: &mut Queue) {
        let object = self.pop(queue);
        let own = queue.label;
        // Does nothing unless seeds are labelled at the pop.
        self.label[object] = own;
        let connected = self.objects.connected[object];
        for (neighbour, connected) in self.objects.neighbours[object].into_iter().zip(connected) {
            if neighbour == NO_NEIGHBOUR {
                continue;
            }
            let other = self.label[neighbour as usize];
            match (connected, other) {
                (true, 0) => {
                    self.label[neighbour as usize] = own;
                    self.grown.push((neighbour, own));
                    self.push(queue, neighbour);
                }
                (true, other) => self.ballot.in_favour(own, other),
                (false, 0) => self.undecided.push((own, neighbour)),
                (false, other) => self.ballot.against(own, other),
            }
        }
    }

    fn pop(&self, queue: &mut Queue) -> usize {
        let entry = &self.arena[queue.head as usize];
        queue.head = entry.next;
        entry.object as usize
    }

    fn push(&mut self, queue: &mut Queue, object: u32) {
        let entry = self.arena.len() as u32;
        self.arena.push(Entry { object, next: END });
        if queue.head == END {
            queue.head = entry;
        } else {
            self.arena[queue.tail as usize].next = entry;
        }
        queue.tail = entry;
    }
}

/// Gives each connected leftover a label of its own, in row-major order of its first pixel. A leftover
/// has no true condition towards any component, so it brings no vote in favour.
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
