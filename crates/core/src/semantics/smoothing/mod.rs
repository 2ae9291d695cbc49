//! Imperfect classes made consistent before anything is cut from them.
//!
//! A network errs point by point at the borders of objects: single points of a car are lost to the
//! road, single points of the wall behind it are called car. Either way a point stands against its
//! neighbours in space, which rarely happens in true classes. How often it happens in a frame tells
//! how far its classes are to be trusted: below a limit they are taken as they are, above it the
//! neighbours of a point outvote it, the more easily the noisier the frame.
//!
//! The classes of a family count as one here: which of them an object is, all of its points decide
//! later, and points that flicker between car and truck say nothing against its borders.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::object_mask::ObjectMask;
use crate::cloud::Reason;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::cloud::taxonomy::Taxonomy;
use crate::range_image::RangeImage;

/// How neighbours correct the class of a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Smoothing {
    /// Rows of the image to look up and down for neighbours. Default 2.
    #[schemars(range(min = 0, max = 64), extend("unit" = "pixels", "slider" = [0, 8]))]
    pub rows: usize,
    /// Columns to look left and right. Default 6.
    #[schemars(range(min = 0, max = 256), extend("unit" = "pixels", "slider" = [0, 32]))]
    pub columns: usize,
    /// Neighbours are within so many metres, and farther away from the sensor by `steps` more.
    /// Default 0.1.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m", "slider" = [0.0, 1.0]))]
    pub radius: f64,
    /// So many times the distance between returns of neighbouring columns is added to `radius`.
    /// Default 6.
    #[schemars(range(min = 0.0, max = 1000.0), extend("slider" = [0.0, 20.0]))]
    pub steps: f64,
    /// Share of the votes that a class needs in order to replace a point's own. Default 0.6.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub agreement: f64,
    /// Share of the points near a border between classes that stand against their neighbours, up to
    /// which classes are taken as they are. Default 0.05.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 0.5]))]
    pub trusted: f64,
    /// Votes that a point's own class counts, times that share: the rarer errors are, the more it
    /// counts. Default 0.05.
    #[schemars(range(min = 0.0, max = 1000.0), extend("slider" = [0.0, 1.0]))]
    pub own_votes: f64,
    /// How often the points are gone through. Default 2.
    #[schemars(range(min = 0, max = 100), extend("slider" = [0, 5]))]
    pub rounds: usize,
}

impl Default for Smoothing {
    fn default() -> Self {
        Smoothing {
            rows: 2,
            columns: 6,
            radius: 0.1,
            steps: 6.0,
            agreement: 0.6,
            trusted: 0.05,
            own_votes: 0.05,
            rounds: 2,
        }
    }
}

/// A point stands against its neighbours if fewer than this share of their votes are for its class.
const ISOLATED: f64 = 0.2;

/// Votes without which neighbours decide nothing.
const LEAST_VOTES: f32 = 2.0;

/// Points at borders that an estimate of the noise starts from ...
const PRIOR: f64 = 100.0;

/// ... and the share of them that stands against its neighbours in true classes.
const USUAL: f64 = 0.01;

/// Object points that are looked at to tell how noisy a frame is.
const SAMPLE: usize = 128;

/// Corrects the classes of a mask; `raw` are the ids they come from. Returns the points whose class
/// changed, ascending, with the ids they have now.
///
/// Time: that of looking at [`SAMPLE`] points where the classes can be trusted, else linear in the
/// points on both sides of the borders of objects.
pub(super) fn smooth(
    cloud: &PointCloud,
    image: &RangeImage,
    raw: &[u16],
    taxonomy: &Taxonomy,
    params: &Smoothing,
    mask: &mut ObjectMask,
) -> Vec<(u32, u16)> {
    let is_thing: Vec<bool> = taxonomy.classes().iter().map(|class| class.is_thing).collect();
    let families = taxonomy.families();
    let mut votes = NeighbourVotes {
        cloud,
        image,
        params,
        families: &families,
        counts: vec![0.0; is_thing.len()],
        named: Vec::new(),
    };
    let noise = votes.noise(mask, &is_thing);
    if noise.iter().all(|&noise| noise <= params.trusted) {
        return Vec::new();
    }
    let is_noisy = |class: u16| noise[usize::from(families[usize::from(class)])] > params.trusted;
    let mut ids = raw.to_vec();
    let mut candidates = votes.near_objects(mask, is_noisy);
    for round in 0..params.rounds {
        let changes = votes.changes(&candidates, mask, &noise, &is_thing);
        // All votes of a round count before any of its changes: voters keep what they had.
        let changes: Vec<(usize, u16, u16)> = changes
            .into_iter()
            .map(|(point, voter)| (point, mask.class[voter], ids[voter]))
            .collect();
        for &(point, class, id) in &changes {
            ids[point] = id;
            mask.class[point] = class;
            mask.is_object[point] = is_thing[usize::from(class)];
            mask.reason[point] =
                if mask.is_object[point] { Reason::None } else { Reason::NotAnObject };
        }
        if changes.is_empty() || round + 1 == params.rounds {
            break;
        }
        // Votes change only in the windows of points that changed.
        let changed = votes.windows(changes.iter().map(|change| change.0));
        candidates = votes.near_objects(mask, is_noisy);
        candidates.retain(|&point| image.pixel_of(point).is_some_and(|pixel| changed[pixel]));
    }
    (0_u32..)
        .zip(raw.iter().zip(&ids))
        .filter(|(_, (was, is))| was != is)
        .map(|(point, (_, &id))| (point, id))
        .collect()
}

/// The neighbours of points and their votes.
struct NeighbourVotes<'a> {
    cloud: &'a PointCloud,
    image: &'a RangeImage,
    params: &'a Smoothing,
    /// By class: its family.
    families: &'a [u16],
    /// By family.
    counts: Vec<f32>,
    /// Families that have votes.
    named: Vec<u16>,
}

/// What the neighbours of a point say.
struct Votes {
    /// Votes for the family of the point's own class.
    own: f32,
    /// All votes.
    total: f32,
    /// The family with most votes ...
    class: u16,
    /// ... how many they are ...
    votes: f32,
    /// ... and a neighbour that voted for it.
    voter: usize,
}

impl NeighbourVotes<'_> {
    /// What the vote of a point counts: as much as its class is sure.
    fn weight(&self, point: usize) -> f32 {
        self.cloud.confidence.as_ref().map_or(1.0, |confidence| confidence[point])
    }

    /// The candidates that their neighbours outvote, each with a neighbour whose class it takes.
    fn changes(
        &mut self,
        candidates: &[usize],
        mask: &ObjectMask,
        noise: &[f64],
        is_thing: &[bool],
    ) -> Vec<(usize, usize)> {
        let params = self.params;
        let mut changes = Vec::new();
        for &point in candidates {
            let own = self.families[usize::from(mask.class[point])];
            let Some(votes) = self.around(point, &mask.class) else { continue };
            let noise = noise[usize::from(own)].max(noise[usize::from(votes.class)]);
            if noise <= params.trusted || votes.class == own {
                continue;
            }
            let own_votes = (params.own_votes / noise) as f32 * self.weight(point);
            let needed = params.agreement as f32 * (votes.total + own_votes);
            let concerns_things = is_thing[usize::from(own)] || is_thing[usize::from(votes.class)];
            if concerns_things && votes.votes >= needed.max(votes.own + own_votes) {
                changes.push((point, votes.voter));
            }
        }
        changes
    }

    /// By family of things: the share of the points on and beside its objects, near a border, that
    /// stand against their neighbours.
    fn noise(&mut self, mask: &ObjectMask, is_thing: &[bool]) -> Vec<f64> {
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); is_thing.len()];
        for (point, _) in (0_u32..).zip(&mask.is_object).filter(|&(_, &is)| is) {
            members[usize::from(mask.class[point as usize])].push(point);
        }
        let mut isolated = vec![0.0; is_thing.len()];
        let mut at_border = vec![0.0; is_thing.len()];
        let pixels = self.image.rows() * self.image.columns();
        for members in members {
            let step = members.len().div_ceil(SAMPLE).max(1);
            for &point in members.iter().step_by(step) {
                let own = mask.class[point as usize];
                let pixel = self.image.pixel_of(point as usize);
                let beside = pixel
                    .and_then(|pixel| self.image.point_at((pixel + 1) % pixels))
                    .filter(|&beside| mask.class[beside] != own);
                for point in [Some(point as usize), beside].into_iter().flatten() {
                    let own = self.families[usize::from(mask.class[point])];
                    let Some(found) = self.around(point, &mask.class) else { continue };
                    if found.own < found.total && found.total >= LEAST_VOTES {
                        let thing = if is_thing[usize::from(own)] { own } else { found.class };
                        at_border[usize::from(thing)] += 1.0;
                        if f64::from(found.own) < ISOLATED * f64::from(found.total) {
                            isolated[usize::from(thing)] += 1.0;
                        }
                    }
                }
            }
        }
        // Few points are no evidence: as if as many as PRIOR had been found before, at the rate of
        // the frame, and for the frame, at the rate of true classes.
        let rate =
            |isolated: f64, all: f64, before: f64| (isolated + PRIOR * before) / (all + PRIOR);
        let frame = rate(isolated.iter().sum(), at_border.iter().sum(), USUAL);
        isolated.iter().zip(at_border).map(|(&isolated, all)| rate(isolated, all, frame)).collect()
    }

    /// The objects' points of some classes, and points in whose window there are any.
    fn near_objects(&self, mask: &ObjectMask, is_wanted: impl Fn(u16) -> bool) -> Vec<usize> {
        let objects = mask.is_object.iter().zip(&mask.class).enumerate();
        let wanted = objects.filter(|&(_, (&is, &class))| is && is_wanted(class));
        let is_near = self.windows(wanted.map(|(point, _)| point));
        let is_near =
            |&point: &usize| self.image.pixel_of(point).is_some_and(|pixel| is_near[pixel]);
        (0..self.cloud.len()).filter(is_near).collect()
    }

    /// The pixels in whose windows some points are, and so those in the windows of these.
    fn windows(&self, points: impl Iterator<Item = usize>) -> Vec<bool> {
        let mut is_near = vec![false; self.image.rows() * self.image.columns()];
        for pixel in points.filter_map(|point| self.image.pixel_of(point)) {
            self.window(pixel, |near| is_near[near] = true);
        }
        is_near
    }

    /// Calls a function with the pixels of the window around a pixel, itself among them.
    fn window(&self, pixel: usize, mut visit: impl FnMut(usize)) {
        let columns = self.image.columns();
        let (row, column) = (pixel / columns, pixel % columns);
        let rows = &self.image.band_of(pixel).rows;
        let highest = row.saturating_sub(self.params.rows).max(rows.start);
        let half = self.params.columns.min((columns - 1) / 2) as isize;
        for row in highest..=(row + self.params.rows).min(rows.end - 1) {
            for offset in -half..=half {
                let column = column as isize + offset;
                let inside = (0..columns as isize).contains(&column);
                if inside || self.image.wraps {
                    visit(row * columns + column.rem_euclid(columns as isize) as usize);
                }
            }
        }
    }

    /// The votes around a point; `None` where it has no pixel or no neighbours. A neighbour's vote
    /// falls from 1 beside the point to 0 at the radius.
    fn around(&mut self, point: usize, class: &[u16]) -> Option<Votes> {
        let pixel = self.image.pixel_of(point)?;
        let position = self.cloud.position(point);
        let band = self.image.band_of(pixel);
        let from_sensor = band.from_sensor(wide(position));
        let range = from_sensor.iter().map(|x| x * x).sum::<f64>().sqrt();
        let radius = self.params.radius + self.params.steps * band.column_step * range;
        let scale = (1.0 / (radius * radius)) as f32;
        let (mut counts, mut named) =
            (std::mem::take(&mut self.counts), std::mem::take(&mut self.named));
        let (mut total, mut best) = (0.0, None);
        self.window(pixel, |near| {
            let Some(other) = self.image.point_at(near).filter(|&other| other != point) else {
                return;
            };
            let q = self.cloud.position(other);
            let squared: f32 = (0..3).map(|axis| (q[axis] - position[axis]).powi(2)).sum();
            let closeness = 1.0 - squared * scale;
            if closeness > 0.0 {
                let vote = closeness * closeness * self.weight(other);
                let family = self.families[usize::from(class[other])];
                let count = &mut counts[usize::from(family)];
                if *count == 0.0 {
                    named.push(family);
                }
                *count += vote;
                total += vote;
                if best.is_none_or(|(_, most)| *count >= most) {
                    best = Some((other, *count));
                }
            }
        });
        let family = |point: usize| self.families[usize::from(class[point])];
        let own = counts[usize::from(family(point))];
        for family in named.drain(..) {
            counts[usize::from(family)] = 0.0;
        }
        (self.counts, self.named) = (counts, named);
        best.map(|(voter, votes)| Votes { own, total, class: family(voter), votes, voter })
    }
}

#[cfg(test)]
mod tests;
