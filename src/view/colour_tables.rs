//! The colours of figures as tables, for a page that draws clouds itself.

use serde::Serialize;

use super::scene::thing_places;
use super::{look, ramp};
use crate::messages::palette::{INSTANCE_COLOURS, instance_colour, reason_colour};
use divmerge_core::cloud::Reason;
use divmerge_core::cloud::taxonomy::Class;

/// Steps of a ramp.
const STEPS: u32 = 256;

/// Colours in sRGB.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColourTables {
    /// Those of instances and components: number k at (k - 1) modulo their count.
    pub instances: Vec<[u8; 3]>,
    /// Those of points without an instance, by the code of the reason.
    pub reasons: Vec<[u8; 3]>,
    /// What each reason means, by its code.
    pub reason_words: Vec<&'static str>,
    /// A ramp for ranges, the near end first.
    pub near_to_far: Vec<[u8; 3]>,
    /// A ramp for intensities.
    pub grey: Vec<[u8; 3]>,
    /// An empty panel.
    pub panel: [u8; 3],
    /// Returns that are no objects: the farthest and the nearest.
    pub other_returns: [[u8; 3]; 2],
    /// Objects in a mask without classes.
    pub object: [u8; 3],
    /// Components that the vote joined.
    pub merged: [u8; 3],
    /// Components that the vote kept apart.
    pub apart: [u8; 3],
    /// Components that the vote kept apart and a later step joined.
    pub rejoined: [u8; 3],
    /// Nodes of the tree of merges.
    pub node: [u8; 3],
    /// What is selected.
    pub focus: [u8; 3],
}

impl ColourTables {
    /// Those of figures with dark panels.
    pub fn new() -> Self {
        let ramp = |colour: &dyn Fn(f64) -> [u8; 3]| {
            (0..STEPS).map(|step| colour(f64::from(step) / f64::from(STEPS - 1))).collect()
        };
        let dark = &look::DARK;
        ColourTables {
            instances: (1..=INSTANCE_COLOURS as u32).map(instance_colour).collect(),
            reasons: Reason::ALL.map(|reason| reason_colour(reason as u8)).to_vec(),
            reason_words: Reason::ALL.map(Reason::describe).to_vec(),
            near_to_far: ramp(&ramp::near_to_far),
            grey: ramp(&|part| dark.intensity(part)),
            panel: dark.panel,
            other_returns: dark.other_returns,
            object: dark.object,
            merged: dark.merged,
            apart: dark.apart,
            rejoined: dark.rejoined,
            node: dark.node,
            focus: dark.focus,
        }
    }
}

impl Default for ColourTables {
    fn default() -> Self {
        Self::new()
    }
}

/// The colour of each class on a panel, by its number; none of a class that is no thing.
pub fn class_colours(classes: &[Class]) -> Vec<Option<[u8; 3]>> {
    let colour =
        |(class, place): (&Class, usize)| class.is_thing.then(|| look::DARK.class_colour(place));
    classes.iter().zip(thing_places(classes)).map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_those_of_figures() {
        let tables = ColourTables::new();
        assert_eq!(tables.instances[6], instance_colour(7));
        assert_eq!(tables.reasons[Reason::TooSmall as usize], reason_colour(6));
        assert_eq!(tables.near_to_far[255], ramp::near_to_far(1.0));
    }

    #[test]
    fn things_alone_have_a_colour_of_their_class() {
        let taxonomy = divmerge_core::cloud::taxonomy::Taxonomy::semantic_kitti();
        let colours = class_colours(taxonomy.classes());
        let things: Vec<bool> = taxonomy.classes().iter().map(|class| class.is_thing).collect();
        assert_eq!(colours.iter().map(Option::is_some).collect::<Vec<_>>(), things);
        assert_eq!(colours.iter().flatten().next(), Some(&look::DARK.class_colour(0)));
    }
}
