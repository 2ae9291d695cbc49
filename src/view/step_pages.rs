//! The pictures of a merge, one after the other.

use super::canvas::Canvas;
use super::options::FigureOptions;
use super::scene::FrameScene;
use super::step_figure::step_figure;
use super::steps::{FigureStep, steps};
use super::tree_figure::{cut_objects, object_figure};
use crate::error::Result;
use divmerge_core::cluster::NodeFacts;

/// The pictures of a merge: of merges by votes its steps, of a tree of merges the objects that were
/// cut from it.
pub struct StepPages<'a> {
    scene: &'a FrameScene<'a>,
    options: &'a FigureOptions,
    shown: Shown,
}

enum Shown {
    Steps(Vec<FigureStep>),
    Objects(Vec<NodeFacts>),
}

impl<'a> StepPages<'a> {
    /// Those of a scene. With `by_decision` a picture of each merge by votes, else of each
    /// instance; a tree of merges has no decisions.
    ///
    /// # Errors
    /// [`Error::Figure`](crate::error::Error::Figure) if the crop lies outside of the range image.
    pub fn new(
        scene: &'a FrameScene<'a>,
        options: &'a FigureOptions,
        by_decision: bool,
    ) -> Result<Self> {
        let shown = match cut_objects(scene, options)? {
            Some(objects) => Shown::Objects(objects),
            None => Shown::Steps(steps(scene, options, by_decision)?),
        };
        Ok(StepPages { scene, options, shown })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        match &self.shown {
            Shown::Steps(steps) => steps.len(),
            Shown::Objects(objects) => objects.len(),
        }
    }

    /// Whether they are of objects that were cut from a tree.
    pub fn are_of_objects(&self) -> bool {
        matches!(self.shown, Shown::Objects(_))
    }

    /// Their file names and pictures, numbered from 1.
    pub fn pages(&self) -> impl ExactSizeIterator<Item = (String, Canvas)> {
        (0..self.count()).map(|place| (Self::name(place + 1), self.page(place)))
    }

    /// The file name of the picture of a number.
    pub fn name(number: usize) -> String {
        format!("step_{number:05}.png")
    }

    fn page(&self, place: usize) -> Canvas {
        let StepPages { scene, options, shown } = self;
        let (number, count) = (place + 1, self.count());
        match shown {
            Shown::Steps(steps) => step_figure(scene, options, &steps[place], number, count),
            Shown::Objects(objects) => {
                object_figure(scene, options, &objects[place], number, count)
            }
        }
    }
}
