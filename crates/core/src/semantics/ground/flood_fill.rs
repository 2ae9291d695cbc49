//! Flood fill of the ground over the range image, upwards and sideways.

use super::params::GroundParams;
use super::profile::Profile;

/// The ground found so far.
#[derive(Debug)]
pub(super) struct FloodFill<'a> {
    profile: &'a Profile,
    is_flat: Vec<bool>,
    is_ground: Vec<bool>,
    front: Vec<u32>,
    step: f32,
    slope_change: f32,
}

impl<'a> FloodFill<'a> {
    /// No ground yet.
    pub fn new(profile: &'a Profile, slopes: &[f32], params: &GroundParams) -> Self {
        let max_slope = params.max_slope.tan() as f32;
        FloodFill {
            profile,
            is_flat: slopes.iter().map(|slope| slope.abs() <= max_slope).collect(),
            is_ground: vec![false; slopes.len()],
            front: Vec::new(),
            step: params.step as f32,
            slope_change: params.slope_change.tan() as f32,
        }
    }

    /// Makes ground of the flat returns that `is_start` picks by their position, and of all that
    /// follows from them.
    pub fn start(&mut self, is_start: impl Fn([f32; 3]) -> bool) {
        for index in 0..self.is_flat.len() {
            let is_open = self.is_flat[index] && !self.is_ground[index];
            if is_open && is_start(self.profile.returns[index].position()) {
                self.mark(index);
            }
        }
        while let Some(index) = self.front.pop() {
            self.visit(index as usize);
        }
    }

    /// Whether a return of the profile is ground.
    pub fn is_ground(&self, index: usize) -> bool {
        self.is_ground[index]
    }

    /// The profile that ground spreads over.
    pub fn profile(&self) -> &'a Profile {
        self.profile
    }

    /// Whether a return of the profile is flat.
    pub fn is_flat(&self, index: usize) -> bool {
        self.is_flat[index]
    }

    /// The positions of the ground found, column by column.
    pub fn positions(&self) -> impl Iterator<Item = [f32; 3]> {
        let returns = self.profile.returns.iter().zip(&self.is_ground);
        returns.filter(|&(_, &is_ground)| is_ground).map(|(seen, _)| seen.position())
    }

    fn mark(&mut self, index: usize) {
        self.is_ground[index] = true;
        self.front.push(index as u32);
    }

    fn visit(&mut self, from: usize) {
        let (rows, all) = (self.profile.rows, self.is_flat.len());
        if from % rows + 1 < rows {
            self.join_above(from);
        }
        if from >= rows {
            self.join_along_row(from, from - rows);
        } else if self.profile.wraps {
            self.join_along_row(from, from + all - rows);
        }
        if from + rows < all {
            self.join_along_row(from, from + rows);
        } else if self.profile.wraps {
            self.join_along_row(from, from + rows - all);
        }
    }

    /// Rows lie metres apart far off, so the allowed rise grows with the run. Never downwards: from
    /// the ground behind a car, its roof is as good a neighbour as a gentle slope.
    fn join_above(&mut self, from: usize) {
        let [here, above] = [from, from + 1].map(|index| self.profile.returns[index].distance);
        let rise = self.step + self.slope_change * (above - here).abs();
        self.join(from, from + 1, rise);
    }

    /// Neighbours of one row lie close together on ground; a jump of the distance is an edge,
    /// whatever slope it makes.
    fn join_along_row(&mut self, from: usize, to: usize) {
        self.join(from, to, self.step);
    }

    fn join(&mut self, from: usize, to: usize, highest_rise: f32) {
        if self.is_flat[to] && !self.is_ground[to] {
            let [here, next] = [from, to].map(|index| self.profile.returns[index].height);
            if (next - here).abs() <= highest_rise {
                self.mark(to);
            }
        }
    }
}
