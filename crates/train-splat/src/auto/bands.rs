//! Lowering the SH degree so that the mean color stays.

use glam::Vec3;
use motes_math::sh::{SH_C0, sh_basis};
use motes_scene::Gaussians;

/// Adds what the bands above `degree` show on average over the directions from `centers` to band 0.
///
/// Without this, dropping bands would change the color that the photos see, and a comparison with
/// and without them would favor keeping them.
pub(crate) fn fold_bands(gaussians: &mut Gaussians, degree: u8, centers: &[Vec3]) {
    if degree >= gaussians.sh_degree || centers.is_empty() {
        return;
    }
    let row = 3 * gaussians.sh_coefficients();
    let first = (usize::from(degree) + 1).pow(2);
    let top = gaussians.sh_degree;
    let scale = 1.0 / (SH_C0 as f32 * centers.len() as f32);
    for (sh, mean) in gaussians.sh.chunks_exact_mut(row).zip(&gaussians.means) {
        let mut sum = [0.0f32; 3];
        for center in centers {
            let mut basis = [0.0; 25];
            sh_basis(top, (Vec3::from(*mean) - *center).normalize_or_zero().to_array(), &mut basis);
            for (c, y) in sh.chunks_exact(3).zip(&basis).skip(first) {
                for (sum, c) in sum.iter_mut().zip(c) {
                    *sum += y * c;
                }
            }
        }
        for (c, sum) in sh.iter_mut().zip(sum) {
            *c += scale * sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use motes_testkit::random_gaussians;

    use super::*;

    #[test]
    fn the_mean_color_over_the_cameras_stays() {
        let mut g = random_gaussians(1, 4, 3);
        let centers =
            [Vec3::new(3.0, 0.0, 1.0), Vec3::new(0.0, 4.0, 1.0), Vec3::new(-2.0, -2.0, 3.0)];
        let mean = |g: &Gaussians| -> f32 {
            let color = |center: &Vec3| {
                let mut basis = [0.0; 25];
                let d = (Vec3::from(g.means[2]) - *center).normalize();
                sh_basis(g.sh_degree, d.to_array(), &mut basis);
                g.sh_of(2).chunks_exact(3).zip(&basis).map(|(c, y)| c[1] * y).sum::<f32>()
            };
            centers.iter().map(color).sum::<f32>() / 3.0
        };
        for degree in [2, 1, 0] {
            let before = mean(&g);
            fold_bands(&mut g, degree, &centers);
            g = g.with_sh_degree(degree);
            assert!((mean(&g) - before).abs() < 1e-5, "degree {degree}");
        }
    }
}
