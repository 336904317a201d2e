//! Least squares with lower bounds, by coordinate descent on the normal equations.

/// Passes over all unknowns: neighbors of one solution to the next need few.
const PASSES: usize = 400;
/// A pass that changes no unknown by more than this share of the largest one is the last.
const CONVERGED: f64 = 1e-7;

/// Minimizes `xᵀ G x / 2 - hᵀ x` with `x ≥ low`, starting from `x`; `gram` is `n x n`, symmetric, positive semidefinite.
///
/// # Panics
/// When the sizes differ.
pub fn bounded_least_squares(gram: &[f64], h: &[f64], low: &[f64], x: &mut [f64]) {
    let n = x.len();
    assert_eq!((gram.len(), h.len(), low.len()), (n * n, n, n), "sizes of the system");
    for (value, low) in x.iter_mut().zip(low) {
        *value = value.max(*low);
    }
    for _ in 0..PASSES {
        let mut change = 0.0f64;
        for i in 0..n {
            let row = &gram[i * n..(i + 1) * n];
            if !(row[i] > 0.0) {
                continue;
            }
            let dot: f64 = row.iter().zip(x.iter()).map(|(g, x)| g * x).sum();
            let next = (x[i] + (h[i] - dot) / row[i]).max(low[i]);
            change = change.max((next - x[i]).abs());
            x[i] = next;
        }
        let largest = x.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        if change <= CONVERGED * largest {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_and_the_optimum_is_met() {
        // A = [[1, 1], [0, 1], [1, 0]], b = [1, 2, -1]: unbounded x = (-1, 2); with x >= 0 it is (0, 1.5).
        let gram = [2.0, 1.0, 1.0, 2.0];
        let h = [0.0, 3.0];
        let mut x = [5.0, 5.0];
        bounded_least_squares(&gram, &h, &[0.0, 0.0], &mut x);
        assert!(x[0].abs() < 1e-6 && (x[1] - 1.5).abs() < 1e-6, "{x:?}");
        bounded_least_squares(&gram, &h, &[-9.0, -9.0], &mut x);
        assert!((x[0] + 1.0).abs() < 1e-5 && (x[1] - 2.0).abs() < 1e-5, "{x:?}");
        bounded_least_squares(&gram, &h, &[0.0, 1.8], &mut x);
        assert!(x[0].abs() < 1e-6 && (x[1] - 1.8).abs() < 1e-6, "{x:?}");
    }
}
