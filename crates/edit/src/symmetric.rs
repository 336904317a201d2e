//! Eigenvectors of symmetric 3 x 3 matrices.

use glam::{DMat3, DQuat, DVec3};

/// Rotation whose columns are eigenvectors of the symmetric `m`, and the eigenvalues in their order:
/// cyclic Jacobi (Golub and Van Loan, section 8.5).
pub(crate) fn eigen(m: DMat3) -> (DQuat, DVec3) {
    let mut a = m;
    let mut vectors = DMat3::IDENTITY;
    // Six sweeps reach rounding for any 3 x 3 matrix; more cost nothing.
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a.col(q)[p];
            if off == 0.0 || !off.is_finite() {
                continue;
            }
            let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = c;
            turn.col_mut(q)[q] = c;
            turn.col_mut(q)[p] = s;
            turn.col_mut(p)[q] = -s;
            a = turn.transpose() * a * turn;
            vectors *= turn;
        }
    }
    (DQuat::from_mat3(&vectors).normalize(), DVec3::new(a.x_axis.x, a.y_axis.y, a.z_axis.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_diagonal_comes_back() {
        for (axis, angle) in [(DVec3::X, 0.3), (DVec3::new(0.6, 0.0, 0.8), 2.0), (DVec3::Z, 0.0)] {
            let r = DMat3::from_quat(DQuat::from_axis_angle(axis, angle));
            let values = DVec3::new(4.0, 1e-4, 0.25);
            let m = r * DMat3::from_diagonal(values) * r.transpose();
            let (q, found) = eigen(m);
            let v = DMat3::from_quat(q);
            let again = v * DMat3::from_diagonal(found) * v.transpose();
            assert!((again - m).to_cols_array().iter().all(|e| e.abs() < 1e-12), "{again} {m}");
            let mut sorted = found.to_array();
            sorted.sort_by(f64::total_cmp);
            assert!((sorted[0] - 1e-4).abs() < 1e-12 && (sorted[2] - 4.0).abs() < 1e-12);
        }
    }
}
