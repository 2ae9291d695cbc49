//! Losses in the divide step: components that straddle objects, and pixels that no seed reached.

use std::collections::BTreeMap;

use super::context::{Found, Search};
use crate::diagnose::failures::case::ObjectOrigin;
use crate::diagnose::failures::cause::{Cause, DivideCause};
use divmerge_core::cloud::Reason;

impl Search<'_> {
    pub fn divide(&self) -> Found {
        if self.target.side == ObjectOrigin::Found || self.oracles.true_merge.is_right(self.target)
        {
            return None;
        }
        let mut own: BTreeMap<u32, u64> = BTreeMap::new();
        let own_pixels = self.own_pixels(self.target.judged.object);
        for &object in &own_pixels {
            *own.entry(self.stages.components.label[object]).or_default() += 1;
        }
        let unreached = own.remove(&0).unwrap_or(0);
        let mut all: BTreeMap<u32, u64> = BTreeMap::new();
        for &label in self.stages.components.label.iter().filter(|label| own.contains_key(label)) {
            *all.entry(label).or_default() += 1;
        }
        // Pixels that a component takes from the object, or brings into it from elsewhere.
        let harm = |label: u32| own[&label].min(all[&label] - own[&label]);
        let worst = own.keys().copied().max_by_key(|&label| (harm(label), label));
        let divided = match worst.filter(|&label| harm(label) > 0 && harm(label) >= unreached) {
            Some(component) => {
                let (own, pixels) = (own[&component], all[&component]);
                DivideCause::Straddles { component, own, pixels }
            }
            None if unreached > 0 => {
                DivideCause::Unreached { unreached, pixels: own_pixels.len() as u64 }
            }
            None => return Some((Cause::Unexplained, Vec::new())),
        };
        let show = match divided {
            DivideCause::Straddles { component, .. } => self.straddled(component),
            DivideCause::Unreached { .. } => self.one_with(Reason::Unreached),
        };
        Some((Cause::Divide(divided), show))
    }

    /// Two points of a component, one in the object and one beside it.
    fn straddled(&self, component: u32) -> Vec<usize> {
        let own = self.is_own_pixel(self.target.judged.object);
        let points = |is_own: bool| -> Vec<usize> {
            let labels = self.stages.components.label.iter().enumerate();
            let inside =
                labels.filter(|&(pixel, &label)| label == component && own[pixel] == is_own);
            inside.map(|(pixel, _)| self.point_of(pixel)).collect()
        };
        let pair = self.nearest_pair(&points(true), &points(false));
        pair.map(Vec::from).unwrap_or_default()
    }
}
