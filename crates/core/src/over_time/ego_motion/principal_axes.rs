//! Principal axes of a symmetric matrix, by the same steps on any machine.

use nalgebra::{Matrix3, Vector3};

/// Sweeps over the three pairs of axes; convergence is quadratic, and six reach the last bit.
const SWEEPS: usize = 6;

/// Eigenvalues of a symmetric matrix in ascending order, and its eigenvectors as columns.
///
/// Jacobi's rotations, by the four basic operations and square roots alone, which IEEE 754 rounds
/// the same way everywhere.
pub fn principal_axes(mut matrix: Matrix3<f64>) -> ([f64; 3], Matrix3<f64>) {
    let mut axes = Matrix3::identity();
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut matrix, &mut axes, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| matrix[(a, a)].total_cmp(&matrix[(b, b)]));
    let columns: [Vector3<f64>; 3] = order.map(|axis| axes.column(axis).into_owned());
    (order.map(|axis| matrix[(axis, axis)]), Matrix3::from_columns(&columns))
}

/// Turns axes p and q so that the entry between them vanishes (Golub and Van Loan, 8.5.2).
fn rotate(matrix: &mut Matrix3<f64>, axes: &mut Matrix3<f64>, p: usize, q: usize) {
    let between = matrix[(p, q)];
    if between == 0.0 {
        return;
    }
    let tau = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * between);
    let tangent = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = tangent * cosine;
    let other = 3 - p - q;
    matrix[(p, p)] -= tangent * between;
    matrix[(q, q)] += tangent * between;
    (matrix[(p, q)], matrix[(q, p)]) = (0.0, 0.0);
    let (a, b) = (matrix[(other, p)], matrix[(other, q)]);
    let (a, b) = (cosine * a - sine * b, sine * a + cosine * b);
    (matrix[(other, p)], matrix[(p, other)]) = (a, a);
    (matrix[(other, q)], matrix[(q, other)]) = (b, b);
    for row in 0..3 {
        let (a, b) = (axes[(row, p)], axes[(row, q)]);
        (axes[(row, p)], axes[(row, q)]) = (cosine * a - sine * b, sine * a + cosine * b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_and_axes_are_found() {
        let (values, axes) = principal_axes(Matrix3::new(2.0, 1.0, 0., 1.0, 2.0, 0., 0., 0., 5.0));
        assert!((Vector3::from(values) - Vector3::new(1.0, 3.0, 5.0)).norm() < 1e-12);
        let half = 0.5_f64.sqrt();
        assert!((axes.column(0).dot(&Vector3::new(half, -half, 0.0)).abs() - 1.0).abs() < 1e-12);
        assert!((axes.column(2).z.abs() - 1.0).abs() < 1e-12);
    }

    proptest::proptest! {
        #[test]
        fn axes_and_values_make_the_matrix(entries in proptest::array::uniform6(-9.0..9.0_f64)) {
            let [a, b, c, d, e, f] = entries;
            let matrix = Matrix3::new(a, b, c, b, d, e, c, e, f);
            let (values, axes) = principal_axes(matrix);
            let made = axes * Matrix3::from_diagonal(&Vector3::from(values)) * axes.transpose();
            proptest::prop_assert!((made - matrix).norm() < 1e-10);
            proptest::prop_assert!(values[0] <= values[1] && values[1] <= values[2]);
        }
    }
}
