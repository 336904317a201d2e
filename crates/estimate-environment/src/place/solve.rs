//! Light from shading: radiances of directions and base colors of a few groups of surface points.
//!
//! A matte point `i` of group `k` sends `B_i = a_k (K_i + Σ_j A_ij y_j)`: `K` from light that is known, `A_ij` what it receives over π from
//! direction `j` at unit radiance. With `b_k = 1 / a_k` that is linear in light and base colors at once. Minimizes
//!
//! ```text
//! Σ_i w_i (b_k(i) B_i - K_i - Σ_j A_ij y_j)² + Σ_j λ_j y_j² + μ Σ_ab (y_a - y_b - d_ab)² + ρ Σ_k P_k (b_k - b_0)² + γ (Σ_k s_k b_k - b_0)²,   y ≥ low, b ≥ 1 / 0.9
//! ```
//!
//! The weights `(a_k / B_i)²` of the round before make the error one relative to what is sent; they are robust, too: what is glossy, or of
//! another base color than its group, counts less the more it is off. `P_k` makes the prior of base colors a share of the data.

use crate::nonnegative::bounded_least_squares;

/// What base colors usually are, luminance: between the gray card of photographers (0.18) and light interiors.
pub const USUAL_BASE_COLOR: f64 = 0.25;
/// ρ: weight of that against the data.
const PRIOR: f64 = 0.05;
const BASE_COLORS: (f64, f64) = (0.03, 0.9);
/// Weight of the mean of all base colors being usual where all light is unknown, over that of the data.
const GAUGE: f64 = 3.0;
/// λ over the diagonal of the normal equations, and over its mean.
const RIDGE: f64 = 1e-3;
const LEAST_RIDGE: f64 = 1e-5;
/// μ over the mean of the diagonal: the sky out of view is smooth, but for a lamp.
const SMOOTH: f64 = 0.1;
const ROUNDS: usize = 16;
/// Rounds in which all points count alike.
const CALM_ROUNDS: usize = 6;
/// Relative error at which a point counts half.
const ROBUST: f64 = 0.3;
/// Darker points are not weighed more than this.
const DIM: f64 = 0.05;

/// Points under unknown light.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    /// `B`: luminance that points send.
    pub sent: Vec<f64>,
    /// Group of each point.
    pub group: Vec<usize>,
    /// `K`.
    pub known: Vec<f64>,
    /// `A`, row by row: `sent.len() x low.len()`.
    pub transport: Vec<f64>,
    /// Least value of each unknown.
    pub low: Vec<f64>,
    /// Unknowns that are neighbors on the sphere, and the difference `y_a - y_b` that makes them equally bright.
    pub neighbors: Vec<(usize, usize, f64)>,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Solution {
    /// `y`.
    pub light: Vec<f64>,
    /// `a`, by group.
    pub base_colors: Vec<f64>,
    /// Relative error of what points send, root mean square, each at most 1.
    pub error: f64,
}

impl Shading {
    /// The same points with one more unknown; `column` is its transport. Unknowns that are `off` send nothing.
    pub fn with(&self, column: &[f64], low: f64, off: &[bool]) -> Self {
        let m = self.low.len();
        let rows = (0..self.sent.len()).flat_map(|i| {
            let row = self.transport[i * m..(i + 1) * m].iter().zip(off);
            row.map(|(t, off)| if *off { 0.0 } else { *t }).chain([column[i]])
        });
        let transport = rows.collect();
        let low = self.low.iter().copied().chain([low]).collect();
        Self { transport, low, ..self.clone() }
    }

    /// Solves for the light, or with no light beyond what is known.
    pub fn solve(&self, with_light: bool) -> Solution {
        let groups = self.group.iter().max().map_or(0, |k| k + 1);
        let start = Solution {
            light: vec![0.0; self.low.len()],
            base_colors: vec![USUAL_BASE_COLOR; groups],
            error: f64::INFINITY,
        };
        self.solve_from(start, ROUNDS, with_light)
    }

    /// As [`Self::solve`], from an earlier solution on; unknowns that it lacks start at 0.
    pub fn solve_from(&self, mut solution: Solution, rounds: usize, with_light: bool) -> Solution {
        let (n, m) = (self.sent.len(), self.low.len());
        solution.light.resize(m, 0.0);
        let mut robust = vec![1.0; n];
        for round in 0..rounds {
            self.step(&robust, with_light, &mut solution);
            let received = self.received(&solution.light);
            let mut sum = 0.0;
            for i in 0..n {
                let e = self.relative(i, received[i], &solution.base_colors);
                // Before there is a fit, what it has to explain looks like an outlier.
                if round >= CALM_ROUNDS.min(rounds / 2) {
                    robust[i] = 1.0 / (1.0 + (e / ROBUST).powi(2));
                }
                sum += (e * e).min(1.0);
            }
            solution.error = (sum / n.max(1) as f64).sqrt();
        }
        solution
    }

    fn received(&self, light: &[f64]) -> Vec<f64> {
        let m = light.len();
        let row = |i: usize| {
            let dot = |row: &[f64]| row.iter().zip(light).map(|(a, y)| a * y).sum::<f64>();
            (self.known[i] + dot(&self.transport[i * m..(i + 1) * m])).max(0.0)
        };
        (0..self.sent.len()).map(row).collect()
    }

    /// Error over what is sent.
    fn relative(&self, i: usize, received: f64, base_colors: &[f64]) -> f64 {
        (self.sent[i] - base_colors[self.group[i]] * received) / self.sent[i].max(DIM)
    }

    /// Weight of the mean of `b` being usual, and the share of each group in that mean. Where most light is unknown, light and base
    /// colors are known up to a factor, and textures, which `b B` takes for noise, would pull it down.
    fn gauge(&self, solution: &Solution, gram: &[f64], m: usize) -> (f64, Vec<f64>) {
        let (n, groups) = (self.sent.len(), solution.base_colors.len());
        let size = m + groups;
        let received = self.received(&solution.light);
        let found = |i: usize| (1.0 - self.known[i] / received[i].max(1e-9)).clamp(0.0, 1.0);
        let unknown = (0..n).map(found).sum::<f64>() / n.max(1) as f64;
        let data: Vec<f64> = (m..size).map(|j| gram[j * size + j]).collect();
        let total = data.iter().sum::<f64>().max(1e-12);
        let share = data.iter().map(|d| d / total).collect();
        (GAUGE * total * unknown.powi(4), share)
    }

    /// Light and base colors for given weights.
    fn step(&self, robust: &[f64], with_light: bool, solution: &mut Solution) {
        let groups = solution.base_colors.len();
        let columns = self.low.len();
        let m = if with_light { columns } else { 0 };
        let size = m + groups;
        let (mut gram, mut h) = (vec![0.0; size * size], vec![0.0; size]);
        for (i, trust) in robust.iter().enumerate() {
            let k = self.group[i];
            let w = trust * (solution.base_colors[k] / self.sent[i].max(DIM)).powi(2);
            let row = &self.transport[i * columns..i * columns + m];
            for (j, t) in row.iter().enumerate().filter(|(_, t)| **t > 0.0) {
                h[j] -= w * t * self.known[i];
                for (g, t2) in gram[j * size..j * size + j + 1].iter_mut().zip(row) {
                    *g += w * t * t2;
                }
                gram[(m + k) * size + j] -= w * t * self.sent[i];
            }
            gram[(m + k) * size + m + k] += w * self.sent[i] * self.sent[i];
            h[m + k] += w * self.sent[i] * self.known[i];
        }
        let mean = (0..m).map(|j| gram[j * size + j]).sum::<f64>() / m.max(1) as f64;
        let (gauge, share) = self.gauge(solution, &gram, m);
        for (a, b, step) in self.neighbors.iter().filter(|_| m > 0) {
            let w = SMOOTH * mean;
            gram[a * size + a] += w;
            gram[b * size + b] += w;
            gram[a.max(b) * size + a.min(b)] -= w;
            h[*a] += w * step;
            h[*b] -= w * step;
        }
        for j in 0..size {
            if j < m {
                // Of its own scale: a lamp on bright points weighs little beside the sky on dark ones.
                gram[j * size + j] += RIDGE * gram[j * size + j] + LEAST_RIDGE * mean;
            } else {
                let data = gram[j * size + j];
                gram[j * size + j] += PRIOR * data;
                h[j] += PRIOR * data / USUAL_BASE_COLOR;
            }
            if j >= m {
                for k in m..=j {
                    gram[j * size + k] += gauge * share[j - m] * share[k - m];
                }
                h[j] += gauge * share[j - m] / USUAL_BASE_COLOR;
            }
            for k in 0..j {
                gram[k * size + j] = gram[j * size + k];
            }
        }
        let low = self.low[..m].iter().copied().chain(vec![1.0 / BASE_COLORS.1; groups]);
        let mut x: Vec<f64> = solution.light[..m].to_vec();
        x.extend(solution.base_colors.iter().map(|a| 1.0 / a));
        bounded_least_squares(&gram, &h, &low.collect::<Vec<_>>(), &mut x);
        solution.light[..m].copy_from_slice(&x[..m]);
        for (a, b) in solution.base_colors.iter_mut().zip(&x[m..]) {
            *a = (1.0 / b).clamp(BASE_COLORS.0, BASE_COLORS.1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sphere::even_directions;

    /// Points of all normals in two base colors, known even light 0.5 and a lamp of irradiance `lamp` from above, which half of them see.
    fn points(lamp: f64) -> Shading {
        let mut shading = Shading { low: vec![0.0, 0.0], ..Shading::default() };
        for (i, n) in even_directions(600).into_iter().enumerate() {
            let (group, color) = [(0, 0.3), (1, 0.5)][i % 2];
            let sees = f64::from(u8::from(i % 4 < 2));
            let columns = [sees * n.z.max(0.0), n.x.max(0.0)].map(|c| c / std::f64::consts::PI);
            shading.known.push(0.5);
            shading.sent.push(color * (0.5 + columns[0] * lamp));
            shading.group.push(group);
            shading.transport.extend(columns);
        }
        shading
    }

    #[test]
    fn a_lamp_that_shading_tells_of_is_found_with_its_strength() {
        for lamp in [0.0, 2.0, 20.0] {
            let found = points(lamp).solve(true);
            assert!((found.light[0] - lamp).abs() < 0.12 * lamp + 0.13, "{lamp} {found:?}");
            assert!(found.light[1] < 0.08 * lamp + 0.13, "nothing comes from the side: {found:?}");
            let ratio = found.base_colors[1] / found.base_colors[0];
            assert!((ratio / (0.5 / 0.3) - 1.0).abs() < 0.1, "{found:?}");
        }
    }

    #[test]
    fn without_light_the_error_stays() {
        let shading = points(20.0);
        let (with, without) = (shading.solve(true), shading.solve(false));
        assert!(without.light.iter().all(|y| *y == 0.0));
        assert!(without.error > 4.0 * with.error, "{} {}", without.error, with.error);
    }

    #[test]
    fn one_more_unknown_comes_last_and_others_can_be_turned_off() {
        let shading = points(2.0);
        let column: Vec<f64> = (0..600).map(|i| i as f64).collect();
        let more = shading.with(&column, -1.0, &[false, true]);
        assert_eq!((more.low.len(), more.transport.len()), (3, 1800));
        assert_eq!(more.transport[3 * 7..3 * 8], [shading.transport[14], 0.0, 7.0]);
    }
}
