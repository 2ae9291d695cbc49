//! Leaving out what is too near, too far, outside a region, or the vehicle itself.

use std::str::FromStr;

use serde::Serialize;

use super::block::Block;
use super::ego_body::EgoBody;
use super::point_cloud::{PointCloud, wide};

/// Which returns are looked at; all by default. Positions are those of the cloud's own frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Crop {
    /// Least distance from the frame's origin, metres.
    pub min_range: Option<f64>,
    /// Greatest distance from the frame's origin, metres.
    pub max_range: Option<f64>,
    /// What lies outside is left out.
    pub region: Option<Block>,
    /// What lies inside is left out: the vehicle that carries the sensor.
    pub ego: Option<Block>,
}

/// How the vehicle that carries the sensor is told from what is around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ego {
    /// By what stays put in the clouds' frame while all else moves
    /// ([`EgoSearch`](crate::semantics::ego::EgoSearch)).
    Auto,
    /// By a block that it fills.
    Block(Block),
}

/// `auto`, or a block as [`Block`] reads it.
impl FromStr for Ego {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Ego::Auto),
            block => block.parse().map(Ego::Block).map_err(|problem| format!("{problem}, or auto")),
        }
    }
}

impl Crop {
    /// Whether a position is looked at.
    pub fn keeps(&self, position: [f64; 3]) -> bool {
        let range = position.iter().map(|along| along * along).sum::<f64>().sqrt();
        self.min_range.is_none_or(|least| range >= least)
            && self.max_range.is_none_or(|most| range <= most)
            && self.region.is_none_or(|region| region.contains(position))
            && !self.ego.is_some_and(|ego| ego.contains(position))
    }
}

impl PointCloud {
    /// The same cloud with NaN for the positions of returns that are left out, which are marked
    /// ([`PointColumns::cropped`](super::PointColumns::cropped)).
    pub fn cropped(self, crop: &Crop) -> Self {
        match *crop == Crop::default() {
            true => self,
            false => self.left_out(|at| !crop.keeps(at)).0,
        }
    }

    /// The same cloud without the returns of the vehicle's own body, which are marked like those of
    /// [`cropped`](Self::cropped), and their number.
    pub fn without_body(self, body: &EgoBody) -> (Self, usize) {
        match body.bounds() {
            Some(bounds) => self.left_out(|at| bounds.contains(at) && body.contains(at)),
            None => (self, 0),
        }
    }

    /// Leaves out returns by their place in the recording's frame, metres; with their number.
    fn left_out(mut self, is_left_out: impl Fn([f64; 3]) -> bool) -> (Self, usize) {
        let mut is_cropped = self.cropped.clone().unwrap_or_else(|| vec![false; self.len()]);
        let mut count = 0;
        for (point, is_cropped) in is_cropped.iter_mut().enumerate() {
            let recorded = |at: [f32; 3]| self.recorded_metres(wide(at));
            if self.is_return(point) && is_left_out(recorded(self.position(point))) {
                *is_cropped = true;
                count += 1;
                self.set_position(point, [f32::NAN; 3]);
            }
        }
        let marked = self.with(|columns| columns.cropped = Some(is_cropped));
        (marked.expect("a mark for each point"), count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vehicle_is_a_block_or_found() {
        assert_eq!("auto".parse(), Ok(Ego::Auto));
        assert_eq!("..,..,..1".parse(), Ok(Ego::Block("..,..,..1".parse().unwrap())));
        let problem = "automatic".parse::<Ego>().unwrap_err();
        assert!(problem.contains("X0..X1") && problem.contains("auto"), "{problem}");
    }

    #[test]
    fn a_body_is_marked_beside_what_is_cropped() {
        let x = vec![0.1, 0.3, 9.0, f32::NAN];
        let cloud = PointCloud::new(x, vec![0.1; 4], vec![0.1; 4]).unwrap();
        let crop = Crop { max_range: Some(5.0), ..Crop::default() };
        let body = EgoBody::of_cells([[1, 0, 0], [9, 9, 9]].into());
        let (cropped, count) = cloud.cropped(&crop).without_body(&body);
        assert_eq!((cropped.cropped.as_deref(), count), (Some(&[false, true, true, false][..]), 1));
    }

    #[test]
    fn what_is_left_out_is_no_return_and_marked() {
        let x = vec![0.5, 2.0, 50.0, 3.0, f32::NAN, 4.0];
        let y = vec![0.0, 0.0, 0.0, 9.0, 0.0, 0.5];
        let cloud = PointCloud::new(x, y, vec![0.0; 6]).unwrap();
        let crop = Crop {
            min_range: Some(1.0),
            max_range: Some(20.0),
            region: Some("..,-5..5,..".parse().unwrap()),
            ego: Some("3.5..5,0..1,..".parse().unwrap()),
        };
        let cropped = cloud.clone().cropped(&crop);
        let marks = [true, false, true, true, false, true];
        assert_eq!(cropped.cropped.as_deref(), Some(&marks[..]));
        let returns: Vec<bool> = (0..6).map(|point| cropped.is_return(point)).collect();
        assert_eq!(returns, [false, true, false, false, false, false]);
        assert_eq!(cloud.clone().cropped(&Crop::default()).cropped, None);
    }
}
