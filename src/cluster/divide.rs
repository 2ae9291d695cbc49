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
///
/// Where seeds are labelled at once a pixel keeps the label it gets, and every pixel with a label visits all its
/// neighbours, so that the votes of Alg. 1 are known from the labels alone: two for each pair of neighbours with
/// different labels, in favour where the condition holds (one that holds is visited from both sides when both have
/// their labels; one that does not is on the undecided list if it comes too early). They are counted afterwards.
pub fn divide(
    objects: &ObjectPixels,
    seeds: &[u32],
    params: &ClusterParams,
) -> (Components, Votes) {
    let mut growth = Growth::new(objects, seeds, params.seeding);
    growth.run();
    let Growth { label, grown, undecided, ballot, .. } = growth;
    let (ballot, weight) = match ballot {
        None => (border_votes(objects, &label), 2),
        Some(mut ballot) => {
            for (own, neighbour) in undecided {
                let other = label[neighbour as usize];
                if other > 0 {
                    ballot.cast(own, other, false);
                }
            }
            (ballot, 1)
        }
    };
    let mut components = Components { label, count: seeds.len() as u32, grown };
    if params.leftovers == Leftovers::Reseeded {
        reseed(objects, &mut components);
    }
    let votes = ballot.count(components.count, weight);
    (components, votes)
}

/// One vote for each pair of neighbours with different labels.
fn border_votes(objects: &ObjectPixels, label: &[u32]) -> Ballot {
    let mut ballot = Ballot::default();
    let pixels = objects.neighbours.iter().zip(&objects.connected).zip(label);
    for ((neighbours, connected), &own) in pixels.filter(|&(_, &own)| own != 0) {
        for direction in FORWARD {
            let neighbour = neighbours[direction];
            if neighbour != NO_NEIGHBOUR {
                let other = label[neighbour as usize];
                if other != 0 {
                    ballot.cast(own, other, connected[direction]);
                }
            }
        }
    }
    ballot
}

/// Right and down: each pair of neighbours from one side.
const FORWARD: [usize; 2] = [1, 3];

/// The state of Alg. 1. Queues are linked lists in one arena.
struct Growth<'a> {
    objects: &'a ObjectPixels,
    label: Vec<u32>,
    grown: Vec<(u32, u32)>,
    undecided: Vec<(u32, u32)>,
    /// Votes as they are cast, where pixels can change hands.
    ballot: Option<Ballot>,
    arena: Vec<Entry>,
    queues: Vec<Queue>,
}

#[derive(Clone, Copy)]
struct Entry {
    object: u32,
    next: u32,
}

#[derive(Clone, Copy)]
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
            grown: Vec::with_capacity(objects.len() - seeds.len()),
            undecided: Vec::new(),
            ballot: (seeding == Seeding::AtPop).then(Ballot::default),
            arena,
            queues,
        }
    }

    fn run(&mut self) {
        let mut queues = std::mem::take(&mut self.queues);
        while !queues.is_empty() {
            let mut kept = 0;
            for place in 0..queues.len() {
                let mut queue = queues[place];
                match &self.ballot {
                    None => self.expand(&mut queue),
                    Some(_) => self.expand_and_vote(&mut queue),
                }
                if queue.head != END {
                    queues[kept] = queue;
                    kept += 1;
                }
            }
            queues.truncate(kept);
        }
    }

    /// ExpandCluster of Alg. 1 without its votes: pops one pixel, whose connected neighbours without a label join.
    fn expand(&mut self, queue: &mut Queue) {
        let object = self.pop(queue);
        let connected = self.objects.connected[object];
        for (neighbour, connected) in self.objects.neighbours[object].into_iter().zip(connected) {
            if connected && self.label[neighbour as usize] == 0 {
                self.take(queue, neighbour);
            }
        }
    }

    /// ExpandCluster of Alg. 1 where seeds are labelled at the pop, and every pop writes its own label again.
    fn expand_and_vote(&mut self, queue: &mut Queue) {
        let object = self.pop(queue);
        let own = queue.label;
        self.label[object] = own;
        let connected = self.objects.connected[object];
        for (neighbour, connected) in self.objects.neighbours[object].into_iter().zip(connected) {
            if neighbour == NO_NEIGHBOUR {
                continue;
            }
            match (connected, self.label[neighbour as usize]) {
                (true, 0) => self.take(queue, neighbour),
                (false, 0) => self.undecided.push((own, neighbour)),
                (connected, other) => {
                    if let Some(ballot) = &mut self.ballot {
                        ballot.cast(own, other, connected);
                    }
                }
            }
        }
    }

    fn pop(&self, queue: &mut Queue) -> usize {
        let entry = &self.arena[queue.head as usize];
        queue.head = entry.next;
        entry.object as usize
    }

    /// A pixel gets the label of a queue and joins it.
    fn take(&mut self, queue: &mut Queue, object: u32) {
        self.label[object as usize] = queue.label;
        self.grown.push((object, queue.label));
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
