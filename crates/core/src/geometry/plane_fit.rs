//! Planes of least squares.

use nalgebra::{Matrix3, Vector3};

/// The plane `z = base + along_x x + along_y y` of least squares through some positions, as `[base,
/// along_x, along_y]`; `pull` draws each of them to 0 and settles what a single point or line
/// leaves open. `None` where even so nothing settles it.
pub fn plane_through(
    positions: impl Iterator<Item = [f64; 3]>,
    pull: [f64; 3],
) -> Option<Vector3<f64>> {
    let mut normal = Matrix3::from_diagonal(&Vector3::from(pull));
    let mut right = Vector3::zeros();
    for [x, y, z] in positions {
        let row = Vector3::new(1.0, x, y);
        normal += row * row.transpose();
        right += row * z;
    }
    Some(normal.cholesky()?.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_found_and_a_line_stays_level() {
        let on_plane = |x: f64, y: f64| [x, y, 2.0 + 0.5 * x - 0.25 * y];
        let corners = [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (4.0, 4.0)].map(|(x, y)| on_plane(x, y));
        let found = plane_through(corners.into_iter(), [1e-9; 3]).unwrap();
        assert!((found - Vector3::new(2.0, 0.5, -0.25)).norm() < 1e-6, "{found}");
        let line = [0.0, 1.0, 2.0].map(|x| [x, 0.0, 3.0]);
        let found = plane_through(line.into_iter(), [1e-6; 3]).unwrap();
        assert!((found - Vector3::new(3.0, 0.0, 0.0)).norm() < 1e-4, "{found}");
        assert_eq!(plane_through(line.into_iter(), [0.0; 3]), None);
    }
}
