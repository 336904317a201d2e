//! The rows that are fitted, out of all and back.

use motes_raster::GaussianGradients;
use motes_scene::Gaussians;

/// Gradients of some rows; what densification looks at is left out.
pub(super) fn rows_of(all: &GaussianGradients, rows: &[u32]) -> GaussianGradients {
    let width = all.sh.len() / all.means.len().max(1);
    GaussianGradients {
        means: picked(&all.means, rows),
        rotations: picked(&all.rotations, rows),
        log_scales: picked(&all.log_scales, rows),
        opacity_logits: picked(&all.opacity_logits, rows),
        sh: rows.iter().flat_map(|r| &all.sh[*r as usize * width..][..width]).copied().collect(),
        ..GaussianGradients::default()
    }
}

fn picked<T: Copy>(values: &[T], rows: &[u32]) -> Vec<T> {
    rows.iter().map(|row| values[*row as usize]).collect()
}

/// Row `i` of `fitted` becomes row `rows[i]` of `all`.
pub(super) fn put(fitted: &Gaussians, all: &mut Gaussians, rows: &[u32]) {
    let width = 3 * all.sh_coefficients();
    for (from, row) in rows.iter().map(|row| *row as usize).enumerate() {
        all.means[row] = fitted.means[from];
        all.rotations[row] = fitted.rotations[from];
        all.log_scales[row] = fitted.log_scales[from];
        all.opacity_logits[row] = fitted.opacity_logits[from];
        all.sh[row * width..][..width].copy_from_slice(fitted.sh_of(from));
    }
}
