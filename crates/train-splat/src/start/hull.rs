//! The visual hull: everything that no silhouette rules out (Laurentini 1994).
//!
//! Photos of an object on nothing carry its outline in their alpha channel. A place that projects
//! outside the outline in any photo is empty; what is left encloses the object, touches it along
//! all outlines, and leaves the space around it free.

use glam::{DVec3, IVec3};
use motes_scene::SparsePoints;
use rayon::prelude::*;

use crate::init::axes_focus;
use crate::options::AlphaMode;
use crate::target::TrainingImage;

/// Cells per side of the first, coarse grid.
const COARSE: i32 = 40;
/// Cells along the longest side of the fine grid.
const FINE: i32 = 144;
/// Opacity, of 255, from which a pixel may show the object.
const SEEN: u8 = 16;
/// Share of pixels that must be transparent, and opaque, in a photo with a silhouette.
const NEEDED_SHARE: f64 = 0.01;
/// Share of the photos that must have a silhouette.
const NEEDED_PHOTOS: f64 = 0.9;
/// Share of the photos that must see a place before their silence counts.
const WITNESSES: f64 = 0.2;
/// Share of the photos that may contradict: masks are not perfect.
const DISSENT: f64 = 0.01;
/// Cells by which a cell may lie behind the front of a photo and still count as seen.
const BEHIND_FRONT: f64 = 1.5;

/// Where a photo shows the object: 0, or its opacity after taking the largest of 3×3 pixels.
struct Silhouette<'a> {
    image: &'a TrainingImage,
    seen: Vec<bool>,
}

impl<'a> Silhouette<'a> {
    /// `None` when the photo shows no object on nothing.
    fn new(image: &'a TrainingImage) -> Option<Self> {
        let photo = &image.image;
        if photo.channels != 4 {
            return None;
        }
        let (w, h) = (photo.width, photo.height);
        let alpha: Vec<bool> = photo.data.chunks_exact(4).map(|p| p[3] >= SEEN).collect();
        let opaque = alpha.iter().filter(|a| **a).count() as f64 / alpha.len().max(1) as f64;
        if !(NEEDED_SHARE..=1.0 - NEEDED_SHARE).contains(&opaque) {
            return None;
        }
        let mut seen = vec![false; w * h];
        for y in 0..h {
            for x in 0..w {
                seen[y * w + x] = (y.saturating_sub(1)..(y + 2).min(h)).any(|v| {
                    alpha[v * w + x.saturating_sub(1)..v * w + (x + 2).min(w)].contains(&true)
                });
            }
        }
        Some(Self { image, seen })
    }

    /// Pixel and depth of a place on the photo.
    fn project(&self, point: DVec3) -> Option<(usize, usize, f64)> {
        let c = &self.image.camera;
        let p = self.image.camera_from_world.transform_point(point);
        let (x, y) = (c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
        let inside = p.z > 0.0 && x >= 0.0 && y >= 0.0 && x < c.width as f64 && y < c.height as f64;
        inside.then_some((x as usize, y as usize, p.z))
    }
}

/// A block of cells.
struct Grid {
    low: DVec3,
    cell: f64,
    size: IVec3,
    full: Vec<bool>,
}

impl Grid {
    fn index(&self, at: IVec3) -> Option<usize> {
        let inside = at.cmpge(IVec3::ZERO).all() && at.cmplt(self.size).all();
        inside.then(|| ((at.z * self.size.y + at.y) * self.size.x + at.x) as usize)
    }

    fn at(&self, index: usize) -> IVec3 {
        let (i, x, y) = (index as i32, self.size.x, self.size.y);
        IVec3::new(i % x, i / x % y, i / (x * y))
    }

    fn center(&self, at: IVec3) -> DVec3 {
        self.low + (at.as_dvec3() + 0.5) * self.cell
    }

    fn is_full(&self, at: IVec3) -> bool {
        self.index(at).is_some_and(|i| self.full[i])
    }

    /// Fills the cells that `may` names and the silhouettes do not rule out.
    fn fill(&mut self, silhouettes: &[Silhouette<'_>], may: impl Fn(DVec3) -> bool + Sync) {
        let count = (self.size.x * self.size.y * self.size.z) as usize;
        let grid = &*self;
        let full = (0..count)
            .into_par_iter()
            .with_min_len(4096)
            .map(|i| {
                let center = grid.center(grid.at(i));
                may(center) && is_inside(silhouettes, center)
            })
            .collect();
        self.full = full;
    }

    /// Full cells with an empty neighbor.
    fn surface(&self) -> Vec<IVec3> {
        const SIDES: [IVec3; 6] =
            [IVec3::X, IVec3::Y, IVec3::Z, IVec3::NEG_X, IVec3::NEG_Y, IVec3::NEG_Z];
        let full = self.full.iter().enumerate().filter(|(_, full)| **full);
        full.map(|(i, _)| self.at(i))
            .filter(|at| SIDES.iter().any(|side| !self.is_full(*at + *side)))
            .collect()
    }

    /// Lowest and highest corner of the full cells.
    fn bounds(&self) -> Option<(IVec3, IVec3)> {
        let full = self.full.iter().enumerate().filter(|(_, full)| **full);
        full.map(|(i, _)| (self.at(i), self.at(i) + IVec3::ONE))
            .reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
    }
}

fn is_inside(silhouettes: &[Silhouette<'_>], point: DVec3) -> bool {
    let photos = silhouettes.len() as f64;
    let (mut witnesses, mut against) = (0.0, 0.0);
    for s in silhouettes {
        let Some((x, y, _)) = s.project(point) else { continue };
        witnesses += 1.0;
        if !s.seen[y * s.image.camera.width + x] {
            against += 1.0;
            if against > DISSENT * photos {
                return false;
            }
        }
    }
    witnesses >= (WITNESSES * photos).max(2.0)
}

/// Points on the surface of the visual hull.
#[derive(Default)]
pub(super) struct Hull {
    pub(super) points: SparsePoints,
    /// Their spacing, world units.
    pub(super) cell: f64,
}

/// The visual hull, colored by the photos that see it. Empty when the photos show no object on
/// nothing, or their silhouettes have no place in common.
pub(super) fn hull_points(images: &[TrainingImage], alpha_mode: AlphaMode) -> Hull {
    let mut points = SparsePoints::default();
    let silhouettes: Vec<Silhouette<'_>> = images.par_iter().filter_map(Silhouette::new).collect();
    let enough = silhouettes.len() as f64 >= NEEDED_PHOTOS * images.len() as f64;
    if alpha_mode != AlphaMode::Transparent || !enough || silhouettes.len() < 2 {
        return Hull::default();
    }
    let Some(grid) = carve(images, &silhouettes) else { return Hull::default() };
    let surface = grid.surface();
    let fronts: Vec<Front> =
        silhouettes.par_iter().map(|s| Front::new(s, &grid, &surface)).collect();
    let colors: Vec<Option<[u8; 3]>> = surface
        .par_iter()
        .map(|&at| color(&silhouettes, &fronts, grid.center(at), grid.cell))
        .collect();
    for (at, color) in surface.into_iter().zip(colors) {
        if let Some(color) = color {
            points.positions.push(grid.center(at).as_vec3().to_array());
            points.colors.push(color);
        }
    }
    Hull { points, cell: grid.cell }
}

/// The hull: coarse first, then fine within it.
fn carve(images: &[TrainingImage], silhouettes: &[Silhouette<'_>]) -> Option<Grid> {
    let focus = axes_focus(images);
    let reach = silhouettes.iter().map(|s| {
        let c = &s.image.camera;
        let slope = (c.width as f64 / c.fx).max(c.height as f64 / c.fy);
        0.6 * slope * s.image.camera_from_world.transform_point(focus).z
    });
    let reach = reach.filter(|r| *r > 0.0).fold(0.0, f64::max);
    if !(reach > 0.0 && reach.is_finite()) {
        return None;
    }
    let cube = |low, cell, size| Grid { low, cell, size, full: Vec::new() };
    let mut coarse = cube(focus - reach, 2.0 * reach / f64::from(COARSE), IVec3::splat(COARSE));
    coarse.fill(silhouettes, |_| true);
    // A thin object may slip between the centers of coarse cells: cells next to full ones count.
    let (low, high) = coarse.bounds()?;
    let (low, high) = (low - IVec3::ONE, high + IVec3::ONE);
    let span = (high - low).as_dvec3() * coarse.cell;
    let cell = span.max_element() / f64::from(FINE);
    let size = (span / cell).ceil().as_ivec3().max(IVec3::ONE);
    let mut fine = cube(coarse.low + low.as_dvec3() * coarse.cell, cell, size);
    let near = |point: DVec3| {
        let at = ((point - coarse.low) / coarse.cell).floor().as_ivec3();
        (-1..=1)
            .any(|z| (-1..=1).any(|y| (-1..=1).any(|x| coarse.is_full(at + IVec3::new(x, y, z)))))
    };
    fine.fill(silhouettes, near);
    fine.bounds().map(|_| fine)
}

/// Depth of what a photo sees first.
struct Front {
    width: usize,
    /// Photo pixels per pixel here.
    step: f64,
    depth: Vec<f32>,
}

impl Front {
    fn new(s: &Silhouette<'_>, grid: &Grid, surface: &[IVec3]) -> Self {
        let c = &s.image.camera;
        // A pixel as wide as a cell: what is behind shows through finer ones.
        let middle = surface.len() / 2;
        let typical = surface.get(middle).map_or(1.0, |&at| {
            s.image.camera_from_world.transform_point(grid.center(at)).z.max(1e-9)
        });
        let step = (1.5 * grid.cell * c.fx / typical).clamp(1.0, c.width as f64);
        let (width, height) = (
            (c.width as f64 / step).ceil() as usize + 1,
            (c.height as f64 / step).ceil() as usize + 1,
        );
        let mut depth = vec![f32::INFINITY; width * height];
        for &at in surface {
            if let Some((x, y, z)) = s.project(grid.center(at)) {
                let i = (y as f64 / step) as usize * width + (x as f64 / step) as usize;
                depth[i] = depth[i].min(z as f32);
            }
        }
        Self { width, step, depth }
    }

    fn at(&self, x: usize, y: usize) -> f64 {
        let i = (y as f64 / self.step) as usize * self.width + (x as f64 / self.step) as usize;
        f64::from(self.depth[i])
    }
}

/// Median color over the photos that see the place.
fn color(
    silhouettes: &[Silhouette<'_>],
    fronts: &[Front],
    point: DVec3,
    cell: f64,
) -> Option<[u8; 3]> {
    let mut seen: [Vec<u8>; 3] = Default::default();
    for (s, front) in silhouettes.iter().zip(fronts) {
        let Some((x, y, z)) = s.project(point) else { continue };
        let photo = &s.image.image;
        let pixel = photo.pixel(x, y);
        if z > front.at(x, y) + BEHIND_FRONT * cell || pixel[3] < 128 {
            continue;
        }
        for (seen, &value) in seen.iter_mut().zip(pixel) {
            seen.push(value);
        }
    }
    (!seen[0].is_empty()).then(|| {
        seen.map(|mut values| {
            let middle = values.len() / 2;
            *values.select_nth_unstable(middle).1
        })
    })
}
