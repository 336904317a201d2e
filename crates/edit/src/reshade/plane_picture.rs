//! A plane as it looks from above, one pixel per cell.

use glam::{DMat3, DQuat, Vec3};
use motes_math::srgb;
use motes_raster::{Antialias, Painter, RenderOptions, Rendering};
use motes_scene::{Gaussians, Pinhole, Pose};

use super::colors::Projection;
use super::grid::Grid;
use super::support::Plane;

/// The camera is this many widths of the grid away: nearly parallel rays.
const DISTANCE: f64 = 64.0;
/// Cells that are covered less are not known.
const LEAST_ALPHA: f32 = 0.5;
/// Cameras look at a plane from about this high.
const SINE_OF_VIEW: f32 = 0.7;
/// Around the normal.
const VIEWS: usize = 8;

/// Directions toward the cameras that look at a plane.
pub(super) fn views_of(plane: &Plane) -> [Vec3; VIEWS] {
    std::array::from_fn(|k| {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / VIEWS as f32).sin_cos();
        let flat = (1.0 - SINE_OF_VIEW * SINE_OF_VIEW).sqrt();
        plane.normal * SINE_OF_VIEW + (plane.axes[0] * cos + plane.axes[1] * sin) * flat
    })
}

/// Linear color per cell, mean over views around; none where the Gaussians of `rows` leave it open.
pub(super) fn plane_picture(
    grid: &Grid,
    gaussians: &Gaussians,
    rows: &[u32],
    projection: &Projection,
    antialias: Antialias,
) -> Vec<Option<Vec3>> {
    let views = views_of(&grid.plane);
    let mut pictures = plane_pictures(grid, gaussians, rows, projection, antialias, &[&views]);
    pictures.pop().unwrap_or_default()
}

/// The same for several sets of views.
pub(super) fn plane_pictures(
    grid: &Grid,
    gaussians: &Gaussians,
    rows: &[u32],
    projection: &Projection,
    antialias: Antialias,
    sets: &[&[Vec3]],
) -> Vec<Vec<Option<Vec3>>> {
    let mut flat = gaussians.clone();
    flat.extra.clear();
    flat.gather(rows);
    let Some((first, others)) = sets.split_first() else { return Vec::new() };
    let Some((camera, camera_from_world)) = above(grid) else {
        return vec![vec![None; grid.cells()]; sets.len()];
    };
    let seen_from = |i: usize, views: &[Vec3]| {
        let seen = views.iter().map(|v| projection.radiance(flat.sh_of(i), *v)).sum::<Vec3>();
        (seen / views.len().max(1) as f32).to_array().map(|v| srgb::encode(v.clamp(0.0, 1.0)))
    };
    let options = RenderOptions { antialias, ..RenderOptions::default() };
    let even = flat.colored(|i| seen_from(i, first));
    let (mut painter, picture) = Painter::new(&even, &camera, &camera_from_world, &options);
    let mut pictures = vec![per_cell(grid, &picture)];
    let of = |views: &&[Vec3]| per_cell(grid, &painter.paint(|i| seen_from(i, views)));
    pictures.extend(others.iter().map(of));
    pictures
}

/// A camera straight over a plane whose pixels are its cells.
fn above(grid: &Grid) -> Option<(Pinhole, Pose)> {
    let plane = &grid.plane;
    let [width, height] = grid.size;
    let distance = DISTANCE * f64::from(grid.pitch) * width.max(height) as f64;
    let [u, v] = plane.axes.map(|a| a.as_dvec3());
    let n = plane.normal.as_dvec3();
    let middle = grid.corner_at([0.5 * width as f32, 0.5 * height as f32]);
    let eye = plane.point(middle).as_dvec3() + n * distance;
    // Rows of camera_from_world: right, down, forward.
    let rotation = DMat3::from_cols(u, -v, -n).transpose();
    let camera_from_world = Pose::new(DQuat::from_mat3(&rotation), rotation * -eye)?;
    let focal = distance / f64::from(grid.pitch);
    let (cx, cy) = (0.5 * width as f64, 0.5 * height as f64);
    Some((Pinhole { fx: focal, fy: focal, cx, cy, width, height }, camera_from_world))
}

fn per_cell(grid: &Grid, picture: &Rendering) -> Vec<Option<Vec3>> {
    let [width, height] = grid.size;
    let cell = |c: usize| {
        let pixel = (height - 1 - c / width) * width + c % width;
        let alpha = picture.alpha.data[pixel];
        (alpha >= LEAST_ALPHA).then(|| {
            Vec3::from_array(std::array::from_fn(|k| {
                srgb::decode((picture.color.data[3 * pixel + k] / alpha).clamp(0.0, 1.0))
            }))
        })
    };
    (0..grid.cells()).map(cell).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::support::Plane;
    use super::*;

    #[test]
    fn cells_have_the_colors_of_the_gaussians_over_them() {
        let plane = Plane::new(DVec3::new(0.3, -0.2, 1.0), DVec3::new(0.0, 0.0, 2.0));
        let corners = [[-1.0, -1.0], [1.0, 0.5]].map(|f| plane.point(f));
        let grid = Grid::over(plane, &corners, 0.05, 0.0).expect("a grid");
        let projection = Projection::new(1);
        let mut gaussians = Gaussians::empty(1);
        let red = |p: [f32; 2]| Vec3::new(0.2 + 0.1 * p[0], 0.3, 0.25 - 0.1 * p[1]);
        for c in 0..grid.cells() {
            let p = grid.middle(c);
            gaussians.means.push(plane.point(p).to_array());
            gaussians.rotations.push([1.0, 0.0, 0.0, 0.0]);
            gaussians.log_scales.push([0.04f32.ln(); 3]);
            gaussians.opacity_logits.push(6.0);
            let mut sh = [0.0; 12];
            projection.set_even(&mut sh, red(p));
            gaussians.sh.extend(sh);
        }
        let rows: Vec<u32> = (0..gaussians.len() as u32).collect();
        let picture = plane_picture(&grid, &gaussians, &rows, &projection, Antialias::Classic);
        for (c, color) in picture.into_iter().enumerate() {
            let color = color.expect("covered");
            assert!((color - red(grid.middle(c))).abs().max_element() < 0.02, "{c}: {color}");
        }
    }
}
