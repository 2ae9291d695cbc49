//! The released code's growth: a seed's pixel gets its label when it is popped, and every pop
//! writes its own label again, so that a pixel can change hands (Alg. 1 with [`Seeding::AtPop`]).
//!
//! [`Seeding::AtPop`]: crate::cluster::params::Seeding::AtPop

use crate::cluster::divide_and_merge::votes::Ballot;
use crate::cluster::objects::ObjectPixels;
use crate::range_image::NO_NEIGHBOUR;

/// The state of Alg. 1 where seeds are labelled at the pop. Queues are linked lists in one arena,
/// because a pixel that changes hands is in several.
pub struct Growth<'a> {
    objects: &'a ObjectPixels,
    /// M: label of each object pixel, or 0.
    pub label: Vec<u32>,
    /// Pixels that the growth added, in order, with their labels.
    pub grown: Vec<(u32, u32)>,
    undecided: Vec<(u32, u32)>,
    /// The votes.
    pub ballot: Ballot,
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
    /// Before the first round.
    pub fn new(objects: &'a ObjectPixels, seeds: &[u32]) -> Self {
        let entries = seeds.iter().map(|&object| Entry { object, next: END });
        let queues = (0..seeds.len() as u32).map(|number| Queue {
            label: number + 1,
            head: number,
            tail: number,
        });
        Growth {
            objects,
            label: vec![0; objects.len()],
            grown: Vec::new(),
            undecided: Vec::new(),
            ballot: Ballot::default(),
            arena: entries.collect(),
            queues: queues.collect(),
        }
    }

    /// Grows all seeds and casts all votes.
    pub fn run(mut self) -> Self {
        let mut queues = std::mem::take(&mut self.queues);
        while !queues.is_empty() {
            for queue in &mut queues {
                self.expand(queue);
            }
            queues.retain(|queue| queue.head != END);
        }
        for (own, neighbour) in std::mem::take(&mut self.undecided) {
            let other = self.label[neighbour as usize];
            if other > 0 {
                self.ballot.cast(own, other, false);
            }
        }
        self
    }

    /// ExpandCluster of Alg. 1: pops one pixel and visits its neighbours. Every pop writes its own
    /// label again.
    fn expand(&mut self, queue: &mut Queue) {
        let object = self.pop(queue);
        let own = queue.label;
        self.label[object] = own;
        let connected = self.objects.connected[object];
        for (neighbour, connected) in self.objects.neighbours[object].into_iter().zip(connected) {
            if neighbour == NO_NEIGHBOUR {
                continue;
            }
            match (connected, self.label[neighbour as usize]) {
                (true, 0) => {
                    self.label[neighbour as usize] = own;
                    self.grown.push((neighbour, own));
                    self.push(queue, neighbour);
                }
                (false, 0) => self.undecided.push((own, neighbour)),
                (connected, other) => self.ballot.cast(own, other, connected),
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
