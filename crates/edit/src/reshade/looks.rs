//! What ground looks like without its light, around a hole and on into it.
//!
//! ```text
//! unlit = Σ c L / Σ L²        over the seen cells of a window; c = unlit L, least squares
//! ```
//!
//! `c` is the ground as it looks from above, the light `L` of white matte matter traced at the same cells. The colors of single
//! Gaussians do not say it: small bright ones lie on large dark ones, and what lies beneath others was never seen alone.
//!
//! In deep shadow `c` holds light that the model knows nothing of: the edge of what stands there, a shadow whose place is a
//! little off. Divided by next to nothing it would be a glaring color, so a shaded cell that looks brighter than nearly all
//! ground in the light has no say.

use glam::Vec3;
use motes_math::median::{median, quantile};
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Materials};
use relight::{Probe, Relighter};

use super::grid::{Grid, boxed, pull_push};
use super::hole::Hole;

/// Gaussians that are fainter have no say.
pub(super) const LEAST_OPACITY: f32 = 0.3;
/// Colors are means over this share of the object's size: texture shall not go on as stripes.
const WINDOW: f32 = 0.06;
/// Windows reach this many cells at most.
const MAX_WINDOW: usize = 24;
/// Cells with this quantile of the light are well lit.
const LIT: f32 = 0.9;
/// Cells with a smaller share of that are shaded.
const SHADED: f32 = 0.5;
/// Shaded ground is no brighter than this quantile of lit ground.
const BRIGHT: f32 = 0.95;
/// Lit cells that tell how bright ground is.
const LEAST_LIT: usize = 32;

/// Unlit color, base color, roughness, metallic.
pub(super) type Look = [f32; 8];

/// The ground around a hole before the edit.
#[derive(Debug)]
pub(super) struct Seen {
    /// Present Gaussians that lie on it.
    pub(super) rows: Vec<u32>,
    /// Those and all others that are no higher, which are seen from above.
    pub(super) low: Vec<u32>,
    /// How each cell looks from above, linear; none where nothing is seen of it.
    radiance: Vec<Option<Vec3>>,
    /// Radiance of white matte matter in its place; zero where nothing is seen.
    pub(super) white_radiance: Vec<Vec3>,
}

impl Seen {
    /// From a picture of the cells, traced with `samples` directions where it shows the surface beyond the rim of the hole.
    pub(super) fn new(
        hole: &Hole,
        [rows, low]: [Vec<u32>; 2],
        mut radiance: Vec<Option<Vec3>>,
        lit: &Relighter<'_>,
        samples: u32,
    ) -> Self {
        let grid = &hole.grid;
        for (c, seen) in radiance.iter_mut().enumerate() {
            if hole.blurred[c] || !hole.covered[c] {
                *seen = None;
            }
        }
        let cells: Vec<usize> = (0..grid.cells()).filter(|c| radiance[*c].is_some()).collect();
        let probes: Vec<Probe> = cells.iter().map(|c| grid.probe(*c, 1 << 41)).collect();
        let mut white_radiance = vec![Vec3::ZERO; grid.cells()];
        for (c, white) in cells.iter().zip(lit.white_radiance(&probes, samples)) {
            white_radiance[*c] = white;
        }
        Self { rows, low, radiance, white_radiance }
    }

    /// All cells but the open ones, evenly lit.
    #[cfg(test)]
    pub(super) fn of_cells(grid: &Grid, low: Vec<u32>, open: &[bool]) -> Self {
        let radiance = open.iter().map(|open| (!open).then_some(Vec3::ONE)).collect();
        Self { rows: low.clone(), low, radiance, white_radiance: vec![Vec3::ONE; grid.cells()] }
    }

    /// Whether a cell is seen and holds nothing of what stood in the hole.
    pub(super) fn is_known(&self, cell: usize) -> bool {
        self.radiance[cell].is_some()
    }
}

/// Cells that a color is a mean over, to each side.
pub(super) fn window(grid: &Grid, object_size: f32) -> usize {
    ((WINDOW * object_size / grid.pitch).round() as usize).min(MAX_WINDOW)
}

/// The look of every cell of a hole: of what is seen within `window` cells, continued where nothing is.
pub(super) fn continued_looks(
    hole: &Hole,
    gaussians: &Gaussians,
    materials: &Materials,
    seen: &Seen,
    window: usize,
) -> Vec<Look> {
    let grid = &hole.grid;
    let believed = believed(&hole.blurred, &seen.radiance, &seen.white_radiance);
    let unlit =
        unlit_where(grid, [&hole.blurred, &believed], &seen.radiance, &seen.white_radiance, window);
    let mut sums = vec![[0.0f32; 6]; grid.cells()];
    for &row in &seen.rows {
        let i = row as usize;
        let opacity = sigmoid(gaussians.opacity_logits[i]);
        let cell = grid.cell(grid.plane.flat(Vec3::from(gaussians.means[i])));
        let has_say = |c: &usize| opacity >= LEAST_OPACITY && believed[*c];
        let Some(cell) = cell.filter(has_say) else { continue };
        let weight = opacity * seen.white_radiance[cell].element_sum().powi(2);
        let [r, g, b] = materials.base_color_linear[i];
        let values = [r, g, b, materials.roughness[i], materials.metallic[i], 1.0];
        sums[cell].iter_mut().zip(values).for_each(|(s, v)| *s += weight * v);
    }
    let materials = continued(grid, &hole.blurred, &boxed(grid.size, &sums, window));
    let look = |(u, m): ([f32; 3], [f32; 5])| [u[0], u[1], u[2], m[0], m[1], m[2], m[3], m[4]];
    unlit.into_iter().zip(materials).map(look).collect()
}

/// Color without light of every cell: of what is seen within `window` cells, continued into the cells of `blurred`
/// and where nothing is seen. `light` is the radiance of white matte matter.
pub(super) fn unlit(
    grid: &Grid,
    blurred: &[bool],
    radiance: &[Option<Vec3>],
    light: &[Vec3],
    window: usize,
) -> Vec<[f32; 3]> {
    let believed = believed(blurred, radiance, light);
    unlit_where(grid, [blurred, &believed], radiance, light, window)
}

/// As [`unlit`], of the cells that are believed.
fn unlit_where(
    grid: &Grid,
    [blurred, believed]: [&[bool]; 2],
    radiance: &[Option<Vec3>],
    light: &[Vec3],
    window: usize,
) -> Vec<[f32; 3]> {
    let products = (0..grid.cells()).map(|c| match radiance[c] {
        Some(color) if believed[c] => {
            let (product, square) = (color * light[c], light[c] * light[c]);
            [product.x, product.y, product.z, square.x, square.y, square.z]
        }
        _ => [0.0; 6],
    });
    let sums = boxed(grid.size, &products.collect::<Vec<_>>(), window);
    // One weight for all channels, as `continued` wants it: ratios first.
    let known = |[r, g, b, x, y, z]: [f32; 6]| {
        let mean = (x + y + z) / 3.0;
        let ratio = |a: f32, b: f32| if b > 0.0 { mean * a / b } else { 0.0 };
        [ratio(r, x), ratio(g, y), ratio(b, z), mean]
    };
    continued(grid, blurred, &sums.into_iter().map(known).collect::<Vec<_>>())
}

/// Cells that are seen, not `blurred`, and not brighter in the shade than ground is in the light.
fn believed(blurred: &[bool], radiance: &[Option<Vec3>], light: &[Vec3]) -> Vec<bool> {
    let seen = |c: &usize| !blurred[*c] && radiance[*c].is_some();
    let ratio = |c: usize| {
        radiance[c].map_or(0.0, |color| color.element_sum() / light[c].element_sum().max(1e-9))
    };
    let mut lights: Vec<f32> =
        (0..light.len()).filter(seen).map(|c| light[c].element_sum()).collect();
    let shaded = SHADED * quantile(&mut lights, LIT).unwrap_or(0.0);
    let is_lit = |c: &usize| light[*c].element_sum() >= shaded;
    let mut of_lit: Vec<f32> = (0..light.len()).filter(seen).filter(is_lit).map(ratio).collect();
    let enough = of_lit.len() >= LEAST_LIT;
    let brightest = quantile(&mut of_lit, BRIGHT).filter(|_| enough).unwrap_or(f32::INFINITY);
    (0..light.len()).map(|c| seen(&c) && (is_lit(&c) || ratio(c) <= brightest)).collect()
}

/// Means from sums whose last value is their weight, continued into the cells of `blurred` and those without weight.
fn continued<const C: usize, const M: usize>(
    grid: &Grid,
    blurred: &[bool],
    sums: &[[f32; C]],
) -> Vec<[f32; M]> {
    let known: Vec<bool> = (0..sums.len()).map(|c| !blurred[c] && sums[c][M] > 0.0).collect();
    // Cells in deep shadow, where an object touched the plane, know little about its color.
    let weights = (0..sums.len()).filter(|c| known[*c]).map(|c| f64::from(sums[c][M]));
    let usual = median(weights).unwrap_or(1.0) as f32;
    let trust = |c: usize| if known[c] { (sums[c][M] / usual).min(1.0) } else { 0.0 };
    let weights: Vec<f32> = (0..sums.len()).map(trust).collect();
    let values = (0..sums.len()).map(|c| {
        let scale = if known[c] { weights[c] / sums[c][M] } else { 0.0 };
        std::array::from_fn(|k| sums[c][k] * scale)
    });
    let mut means = pull_push(grid.size, values.collect(), weights);
    grid.smooth(&mut means, &known);
    means
}

/// A hole in level ground that is seen all around.
#[cfg(test)]
pub(super) fn hole_in(grid: Grid, open: Vec<bool>) -> Hole {
    Hole {
        covered: vec![true; grid.cells()],
        occupied: vec![false; grid.cells()],
        floating: 0,
        blurred: open.clone(),
        open,
        tolerance: 0.02,
        reach: 0.02,
        object_size: 0.8,
        grid,
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use motes_raster::Antialias;

    use super::super::colors::Projection;
    use super::super::plane_picture::plane_picture;
    use super::super::support::Plane;
    use super::*;

    /// Dark ground as wide Gaussians, chips as small bright ones that cover a twentieth of it; light falls off to the right.
    #[test]
    fn ground_of_few_wide_and_many_small_gaussians_goes_on_as_bright_as_it_looks() {
        const DARK: f32 = 0.05;
        const CHIP: f32 = 0.6;
        let plane = Plane::new(DVec3::Z, DVec3::ZERO);
        let corners = [[-1.0, -1.0], [1.0, 1.0]].map(|f| plane.point(f));
        let grid = Grid::over(plane, &corners, 0.04, 0.0).expect("a grid");
        let projection = Projection::new(0);
        let light = |p: [f32; 2]| 0.5 - 0.2 * p[0];
        let mut gaussians = Gaussians::empty(0);
        let mut add = |p: [f32; 2], height: f32, scale: f32, color: f32| {
            gaussians.means.push((plane.point(p) + height * Vec3::Z).to_array());
            gaussians.rotations.push([1.0, 0.0, 0.0, 0.0]);
            gaussians.log_scales.push([scale.ln(); 3]);
            gaussians.opacity_logits.push(6.0);
            let mut sh = [0.0; 3];
            projection.set_even(&mut sh, Vec3::splat(color * light(p)));
            gaussians.sh.extend(sh);
        };
        let places = |n: i32| {
            let at = move |i: i32| (i as f32 + 0.5) / n as f32 * 2.2 - 1.1;
            (0..n * n).map(move |i| [at(i % n), at(i / n)])
        };
        places(25).for_each(|p| add(p, -0.08, 0.08, DARK));
        places(40).for_each(|p| add(p, 0.01, 0.004, CHIP));
        let materials = Materials {
            normals: vec![[0.0, 0.0, 1.0]; gaussians.len()],
            base_color_linear: vec![[0.3; 3]; gaussians.len()],
            roughness: vec![0.4; gaussians.len()],
            metallic: vec![0.0; gaussians.len()],
            visibility: vec![1.0; gaussians.len()],
            observations: vec![9; gaussians.len()],
        };
        let rows: Vec<u32> = (0..gaussians.len() as u32).collect();
        let mut radiance = plane_picture(&grid, &gaussians, &rows, &projection, Antialias::Mip);
        let shown: Vec<f32> = (0..grid.cells())
            .filter_map(|c| Some(radiance[c]?.x / light(grid.middle(c))))
            .collect();
        let looks = shown.iter().sum::<f32>() / shown.len() as f32;
        let open: Vec<bool> =
            (0..grid.cells()).map(|c| grid.middle(c).iter().all(|v| v.abs() < 0.3)).collect();
        for (seen, open) in radiance.iter_mut().zip(&open) {
            if *open {
                *seen = None;
            }
        }
        let white = |c: usize| Vec3::splat(if open[c] { 0.0 } else { light(grid.middle(c)) });
        let low = rows.clone();
        let seen =
            Seen { rows, low, radiance, white_radiance: (0..grid.cells()).map(white).collect() };
        let hole = hole_in(grid, open);
        let of_hole = continued_looks(
            &hole,
            &gaussians,
            &materials,
            &seen,
            window(&hole.grid, hole.object_size),
        );
        for c in (0..hole.grid.cells()).filter(|c| hole.open[*c]) {
            let off = of_hole[c][0] / looks - 1.0;
            assert!(off.abs() < 0.1, "{c}: {} beside ground of {looks}", of_hole[c][0]);
            assert!((of_hole[c][3] - 0.3).abs() < 1e-4 && (of_hole[c][6] - 0.4).abs() < 1e-4);
        }
    }

    /// Ground of one color with light from the left, and a hole on the right, whose rim is in the shade.
    #[test]
    fn light_that_the_model_does_not_know_in_the_shade_is_not_the_color_of_ground() {
        const COLOR: f32 = 0.2;
        let plane = Plane::new(DVec3::Z, DVec3::ZERO);
        let corners = [[-1.0, -1.0], [1.0, 1.0]].map(|f| plane.point(f));
        let grid = Grid::over(plane, &corners, 0.05, 0.0).expect("a grid");
        let is_open = |c: usize| grid.middle(c)[0] > 0.5;
        let blurred: Vec<bool> = (0..grid.cells()).map(is_open).collect();
        let light = |c: usize| Vec3::splat(if grid.middle(c)[0] < -0.6 { 0.6 } else { 0.02 });
        let light: Vec<Vec3> = (0..grid.cells()).map(light).collect();
        let in_hole = |glow: f32| {
            let seen = |c: usize| {
                let shaded = light[c].x < 0.1;
                (!blurred[c]).then_some(light[c] * COLOR + if shaded { glow } else { 0.0 })
            };
            let radiance: Vec<Option<Vec3>> = (0..grid.cells()).map(seen).collect();
            let all = unlit(&grid, &blurred, &radiance, &light, 2);
            let open = (0..grid.cells()).filter(|c| blurred[*c]).map(|c| all[c][0]);
            open.clone().sum::<f32>() / open.count() as f32
        };
        assert!((in_hole(0.0) - COLOR).abs() < 1e-3);
        // As much as a base color of 1.2 would show.
        let glowing = in_hole(0.02);
        assert!((glowing - COLOR).abs() < 0.02, "{glowing}");
    }
}
