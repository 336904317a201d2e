//! A piece of the surroundings that fits a hole.

use super::hole::Hole;
use super::looks::Look;

/// Directions that a piece is looked for in.
const DIRECTIONS: usize = 32;
/// The seam is compared this many cells wide.
const SEAM: usize = 3;

/// The shift from a hole to a piece of the same shape that is covered everywhere and whose seam looks most like that
/// of the hole; coordinates of the plane, world units. `looks` is what each cell looks like without light.
pub(super) fn best_shift(hole: &Hole, looks: &[Look]) -> Option<[f32; 2]> {
    let grid = &hole.grid;
    let open: Vec<usize> = (0..grid.cells()).filter(|c| hole.open[*c]).collect();
    let grown = grid.grown(&hole.open, SEAM);
    let usable = |c: usize| hole.covered[c] && !hole.open[c];
    let seam: Vec<usize> = (0..grid.cells()).filter(|c| grown[*c] && usable(*c)).collect();
    if open.is_empty() || seam.is_empty() {
        return None;
    }
    let shifted = |cell: usize, shift: [f32; 2]| {
        let [u, v] = grid.middle(cell);
        grid.cell([u + shift[0], v + shift[1]])
    };
    let mismatch = |shift: [f32; 2]| -> Option<f32> {
        if !open.iter().all(|c| shifted(*c, shift).is_some_and(usable)) {
            return None;
        }
        let (mut sum, mut count) = (0.0f32, 0.0f32);
        for &c in &seam {
            let Some(there) = shifted(c, shift).filter(|c| usable(*c)) else { continue };
            sum += (0..3).map(|k| (looks[c][k] - looks[there][k]).powi(2)).sum::<f32>();
            count += 1.0;
        }
        (2.0 * count >= seam.len() as f32).then_some(sum / count)
    };
    let longest = grid.size[0].max(grid.size[1]);
    let mut best: Option<(f32, [f32; 2])> = None;
    for steps in (2..longest).step_by(2) {
        for k in 0..DIRECTIONS {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / DIRECTIONS as f32).sin_cos();
            let length = steps as f32 * grid.pitch;
            let shift = [length * cos, length * sin];
            if let Some(error) = mismatch(shift)
                && best.is_none_or(|(least, _)| error < least)
            {
                best = Some((error, shift));
            }
        }
    }
    best.map(|(_, shift)| shift)
}
