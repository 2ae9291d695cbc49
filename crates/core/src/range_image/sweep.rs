//! What the search for rows and columns reads of an unorganised cloud: azimuths, and a sample of
//! its returns.

use super::azimuth::azimuths;
use crate::cloud::point_cloud::PointCloud;

/// An unorganised cloud of N points with what its projection needs to know of each, found in one
/// go.
pub(super) struct Sweep<'a> {
    pub cloud: &'a PointCloud,
    /// N: azimuth in radians; NaN for points that are no return.
    pub azimuth: Vec<f32>,
    /// About one return in eight, ascending; the same ones whatever the order of the points.
    pub sample: Vec<u32>,
}

impl<'a> Sweep<'a> {
    pub fn new(cloud: &'a PointCloud) -> Self {
        let azimuth = azimuths(cloud);
        let sample = sample(cloud, &azimuth);
        Sweep { cloud, azimuth, sample }
    }
}

/// The returns whose hashed coordinates end in three zeros. Which points those are cannot be
/// foreseen, so each is written down and most are written over, without a branch.
fn sample(cloud: &PointCloud, azimuth: &[f32]) -> Vec<u32> {
    let mut sample = Vec::with_capacity(cloud.len() / 6);
    let (mut is_found, mut found) = ([false; BLOCK], [0; BLOCK]);
    let columns = (cloud.x.chunks(BLOCK).zip(cloud.y.chunks(BLOCK))).zip(azimuth.chunks(BLOCK));
    for (block, ((x, y), azimuth)) in (0_u32..).step_by(BLOCK).zip(columns) {
        let points = x.iter().zip(y).zip(azimuth);
        for (is_found, ((&x, &y), azimuth)) in is_found.iter_mut().zip(points) {
            *is_found = is_sampled(x, y) & !azimuth.is_nan();
        }
        let mut count = 0;
        for (point, &is_found) in (block..).zip(&is_found[..azimuth.len()]) {
            found[count % BLOCK] = point;
            count += usize::from(is_found);
        }
        sample.extend_from_slice(&found[..count]);
    }
    sample
}

/// Points that lie one behind the other and, in most blocks of most clouds, in one row.
pub(super) const BLOCK: usize = 128;

/// The row that all of a block lie in, if it is one.
pub(super) fn common_row(rows: &[u16]) -> Option<u16> {
    let first = *rows.first()?;
    rows.iter().fold(true, |is_common, &row| is_common & (row == first)).then_some(first)
}

fn is_sampled(x: f32, y: f32) -> bool {
    const MIX: u32 = 0x9E37_79B9;
    let bits = x.to_bits() ^ y.to_bits().rotate_left(16);
    bits.wrapping_mul(MIX) >> 29 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sample_is_of_returns_and_does_not_depend_on_the_order() {
        let coordinate = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 * 1e-6 + 1.0;
        let mut x: Vec<f32> = (0..4000).map(coordinate).collect();
        x[17] = f32::NAN;
        let y: Vec<f32> = (4000..8000).map(coordinate).collect();
        let cloud = PointCloud::new(x, y, vec![0.0; 4000]).unwrap();
        let found = Sweep::new(&cloud).sample;
        let expected: Vec<u32> = (0..4000_u32)
            .filter(|&i| cloud.is_return(i as usize))
            .filter(|&i| is_sampled(cloud.x[i as usize], cloud.y[i as usize]))
            .collect();
        assert_eq!(found, expected);
        assert!((300..700).contains(&found.len()), "{}", found.len());
        let reversed = cloud.clone().with(|columns| {
            for column in [&mut columns.x, &mut columns.y, &mut columns.z] {
                column.reverse();
            }
        });
        let mut of_reversed = Sweep::new(&reversed.unwrap()).sample;
        of_reversed.iter_mut().for_each(|point| *point = 3999 - *point);
        of_reversed.reverse();
        assert_eq!(of_reversed, found);
    }
}
