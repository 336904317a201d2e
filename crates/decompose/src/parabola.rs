//! Minimum of sampled costs.

/// Where the parabola through a least value and its neighbors is least.
pub(crate) fn least_of_parabola(grid: &[f32], costs: &[f64], at: usize) -> f32 {
    if at == 0 || at + 1 >= grid.len() {
        return grid[at];
    }
    let [x0, x1, x2] = [at - 1, at, at + 1].map(|i| f64::from(grid[i]));
    let [left, here, right] = [costs[at - 1], costs[at], costs[at + 1]];
    let (d0, d2) = ((left - here) / (x0 - x1), (right - here) / (x2 - x1));
    let curvature = (d2 - d0) / (x2 - x0);
    if !(curvature > 0.0 && curvature.is_finite()) {
        return grid[at];
    }
    let slope = d0 - curvature * (x0 - x1);
    (x1 - 0.5 * slope / curvature).clamp(0.5 * (x0 + x1), 0.5 * (x1 + x2)) as f32
}
