//! The released code's merge: votes are added to the opener's row
//! ([`Accumulation::IntoOpener`]).
//!
//! [`Accumulation::IntoOpener`]: crate::cluster::params::Accumulation::IntoOpener

use std::collections::VecDeque;

use crate::cluster::divide_and_merge::assigner::{Assigner, Entry};

impl Assigner<'_> {
    /// The rows of those who join are added to the row of the opener while it asks; all others ask
    /// with their own.
    pub fn merge_into_openers(&mut self) {
        let mut queue = VecDeque::new();
        for opener in 1..=self.merge.instance_of_component.len() as u32 {
            if self.instance_of(opener) != 0 {
                continue;
            }
            self.open(opener);
            self.ask_growing(opener, &mut queue);
            while let Some(target) = queue.pop_front() {
                let rows = self.rows;
                for query in rows.of(target) {
                    if self.instance_of(query.label) == 0 && query.exceeds(self.ratio) {
                        self.join(target, query);
                        queue.push_back(query.label);
                    }
                }
            }
        }
    }

    /// The row of those who join is added to the row being scanned; labels that were passed are not
    /// asked again.
    fn ask_growing(&mut self, opener: u32, queue: &mut VecDeque<u32>) {
        let mut row = self.rows.of(opener).to_vec();
        let mut next = 0;
        while let Some(&query) = row.get(row.partition_point(|entry| entry.label <= next)) {
            next = query.label;
            if self.instance_of(query.label) == 0 && query.exceeds(self.ratio) {
                self.join(opener, &query);
                queue.push_back(query.label);
                row = self.sum(&row, self.rows.of(query.label));
            }
        }
    }

    /// Two rows added entry by entry, less the entries towards labels already assigned.
    fn sum(&self, a: &[Entry], b: &[Entry]) -> Vec<Entry> {
        let mut total = Vec::with_capacity(a.len() + b.len());
        let (mut i, mut j) = (0, 0);
        while i < a.len() || j < b.len() {
            let entry = if j == b.len() || (i < a.len() && a[i].label < b[j].label) {
                i += 1;
                a[i - 1]
            } else if i == a.len() || b[j].label < a[i].label {
                j += 1;
                b[j - 1]
            } else {
                (i, j) = (i + 1, j + 1);
                a[i - 1].plus(&b[j - 1])
            };
            if self.instance_of(entry.label) == 0 {
                total.push(entry);
            }
        }
        total
    }
}
