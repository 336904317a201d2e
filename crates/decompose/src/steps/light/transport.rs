//! How much of every cell of the light a point of the surface receives.

use std::collections::HashMap;

use glam::Vec3;
use motes_shading::emitters::Emitters;
use motes_shading::frame::Frame;
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, Tracer, offset_origin};
use rayon::prelude::*;

use crate::illumination::{Cell, CellLight};
use crate::observation::{Sample, TracedSurface};

/// Points per part of a sum.
const CHUNK: usize = 256;
const CELL_PURPOSE: u32 = 41;
const BOUNCE_PURPOSE: u32 = 42;
const LAMP_PURPOSE: u32 = 43;

/// Diffuse transport of `P` points and `J` cells and lamps.
#[derive(Clone, Debug)]
pub(crate) struct Transport {
    /// `[P, J]`: `1/π ∫_cell V (n · w)⁺ dw`, the cells first, then the lamps.
    pub cells: Vec<f32>,
    /// `[P]`: `1/π ∫ (1 - V) L_surface (n · w)⁺ dw`: light that comes from the surface itself, photo units.
    pub bounce: Vec<Vec3>,
    /// Number of cells and lamps.
    pub columns: usize,
}

/// How transport is traced.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TransportOptions {
    /// Rays per side of a cell of level 0; finer cells take half as many per level, one at least.
    pub rays_per_side: u32,
    /// Rays for the light from the surface itself.
    pub bounce_rays: u32,
    /// Rays to every lamp.
    pub lamp_rays: u32,
    /// Distance at which rays start, world units.
    pub bias: f32,
    /// Ignore what is in the way (for measuring what visibility is worth).
    pub visibility: bool,
    /// Key of the random numbers.
    pub seed: u64,
}

impl Transport {
    /// Irradiance over π of point `p` under radiances of the cells.
    #[inline]
    pub(crate) fn direct(&self, p: usize, radiance: &[Vec3]) -> Vec3 {
        let row = &self.cells[p * self.columns..(p + 1) * self.columns];
        row.iter().zip(radiance).map(|(t, e)| *e * *t).sum()
    }

    /// `Σ_p T_pj g_p` for every cell `j`, in a fixed order.
    pub(crate) fn transposed(&self, values: &[Vec3]) -> Vec<Vec3> {
        let add = |into: &mut Vec<Vec3>, (p, g): (usize, &Vec3)| {
            let row = &self.cells[p * self.columns..(p + 1) * self.columns];
            into.iter_mut().zip(row).for_each(|(s, t)| *s += *g * *t);
        };
        let parts: Vec<Vec<Vec3>> = values
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, values)| {
                let mut sum = vec![Vec3::ZERO; self.columns];
                values.iter().enumerate().for_each(|(k, g)| add(&mut sum, (chunk * CHUNK + k, g)));
                sum
            })
            .collect();
        (0..self.columns).map(|j| parts.iter().map(|part| part[j]).sum()).collect()
    }

    /// The rows of `points` only.
    pub(crate) fn gather(&self, points: &[u32]) -> Self {
        let row =
            |&p: &u32| &self.cells[p as usize * self.columns..(p as usize + 1) * self.columns];
        Self {
            cells: points.iter().flat_map(|p| row(p).iter().copied()).collect(),
            bounce: points.iter().map(|&p| self.bounce[p as usize]).collect(),
            columns: self.columns,
        }
    }
}

/// What points receive of the cells of a light that is divided again and again; every cell is traced once. Its samples and the surface
/// must stay the same.
#[derive(Debug, Default)]
pub(crate) struct TracedCells {
    cells: Vec<Cell>,
    /// `[P, J]`, as [`Transport::cells`].
    shares: Vec<f32>,
}

impl TracedCells {
    /// Of the cells of `light`, without light from the surface itself, which [`bounce`] gives.
    pub(crate) fn transport(
        &mut self,
        scene: &TracedSurface,
        samples: &[Sample],
        light: &CellLight,
        options: &TransportOptions,
    ) -> Transport {
        let columns = light.cells.len();
        let known: HashMap<[u32; 3], usize> =
            self.cells.iter().enumerate().map(|(j, cell)| (key(cell), j)).collect();
        let known: Vec<Option<usize>> =
            light.cells.iter().map(|cell| known.get(&key(cell)).copied()).collect();
        let mut shares = vec![0.0; samples.len() * columns];
        shares.par_chunks_mut(columns.max(1)).zip(samples).enumerate().for_each(
            |(p, (row, sample))| {
                let before = &self.shares[p * self.cells.len()..(p + 1) * self.cells.len()];
                for (j, (value, known)) in row.iter_mut().zip(&known).enumerate() {
                    *value = match known {
                        Some(k) => before[*k],
                        None => from_cell(scene, (p, sample), (&light.cells[j], light), options),
                    };
                }
            },
        );
        (self.cells, self.shares) = (light.cells.clone(), shares.clone());
        Transport { cells: shares, bounce: vec![Vec3::ZERO; samples.len()], columns }
    }
}

fn key(cell: &Cell) -> [u32; 3] {
    [cell.u.to_bits(), cell.v.to_bits(), cell.level]
}

/// Number of a cell among those of its size, by rows: its random numbers are the same whenever it is traced.
fn number(cell: &Cell) -> u64 {
    let [column, row, columns] =
        [cell.u / cell.du, cell.v / cell.dv, 1.0 / cell.du].map(|x| x.round() as u64);
    u64::from(cell.level) << 28 | (row * columns + column)
}

/// `1/π ∫_cell V (n · w)⁺ dw` of one point.
fn from_cell(
    scene: &TracedSurface,
    (p, sample): (usize, &Sample),
    (cell, light): (&Cell, &CellLight),
    options: &TransportOptions,
) -> f32 {
    let side = (options.rays_per_side >> cell.level).max(1);
    let item = (p as u64) << 32 | number(cell);
    let points = PointSet::new(options.seed, item, CELL_PURPOSE, side * side);
    let share = cell.solid_angle() / (std::f32::consts::PI * (side * side) as f32);
    let mut sum = 0.0;
    for k in 0..side * side {
        let u = points.point(k);
        let w = cell.direction(unit_f32(u[1]), unit_f32(u[2]), &light.orientation);
        let cosine = sample.normal.dot(w);
        if !(cosine > 0.0 && sample.geometric_normal.dot(w) > 0.0) {
            continue;
        }
        let open = !options.visibility || {
            let origin = offset_origin(sample.position, sample.geometric_normal, w, options.bias);
            !scene.tracer.occluded(&Ray::new(origin, w))
        };
        sum += if open { cosine * share } else { 0.0 };
    }
    sum
}

impl Transport {
    /// With a column per lamp: `1/π ∫_lamp V (n · w)⁺ dw`, by `options.lamp_rays` points on each.
    pub(crate) fn with_lamps(
        self,
        scene: &TracedSurface,
        samples: &[Sample],
        lamps: &[Emitters],
        options: &TransportOptions,
    ) -> Self {
        if lamps.is_empty() {
            return self;
        }
        let columns = self.columns + lamps.len();
        let row = |p: usize| {
            let of_lamps = lamps.iter().enumerate().map(move |(k, lamp)| {
                from_lamp(scene, &samples[p], (p as u64) << 16 | k as u64, lamp, options)
            });
            let of_cells = self.cells[p * self.columns..(p + 1) * self.columns].iter().copied();
            of_cells.chain(of_lamps).collect::<Vec<f32>>()
        };
        let rows: Vec<Vec<f32>> = (0..samples.len()).into_par_iter().map(row).collect();
        Self { cells: rows.concat(), columns, bounce: self.bounce }
    }
}

fn from_lamp(
    scene: &TracedSurface,
    sample: &Sample,
    item: u64,
    lamp: &Emitters,
    options: &TransportOptions,
) -> f32 {
    let points = PointSet::new(options.seed, item, LAMP_PURPOSE, options.lamp_rays);
    let mut sum = 0.0;
    for k in 0..options.lamp_rays {
        let Some(toward) = lamp.sample(sample.position, points.point(k)) else { continue };
        let (w, cosine) = (toward.to_light, sample.normal.dot(toward.to_light));
        if !(cosine > 0.0 && sample.geometric_normal.dot(w) > 0.0) {
            continue;
        }
        let shadow = toward.shadow_ray(sample.position, sample.geometric_normal, options.bias);
        if !options.visibility || !scene.tracer.occluded(&shadow) {
            sum += cosine / toward.pdf;
        }
    }
    sum / (std::f32::consts::PI * options.lamp_rays.max(1) as f32)
}

/// `[P]`: `1/π ∫ (1 - V) L_surface (n · w)⁺ dw` with the radiance of the surface at its vertices, lamps left out.
pub(crate) fn bounce(
    scene: &TracedSurface,
    samples: &[Sample],
    vertex_radiance: &[Vec3],
    lamps: &[Emitters],
    options: &TransportOptions,
) -> Vec<Vec3> {
    let of = |(p, sample)| bounce_at(scene, sample, p as u64, vertex_radiance, lamps, options);
    samples.par_iter().enumerate().map(of).collect()
}

fn bounce_at(
    scene: &TracedSurface,
    sample: &Sample,
    item: u64,
    vertex_radiance: &[Vec3],
    lamps: &[Emitters],
    options: &TransportOptions,
) -> Vec3 {
    let bias = options.bias;
    if options.bounce_rays == 0 || !options.visibility {
        return Vec3::ZERO;
    }
    let frame = Frame::from_normal(sample.normal);
    let points = PointSet::new(options.seed, item, BOUNCE_PURPOSE, options.bounce_rays);
    let mut sum = Vec3::ZERO;
    for k in 0..options.bounce_rays {
        let u = points.point(k).map(unit_f32);
        // Cosine-weighted: the mean over such directions is 1/π of the integral.
        let (r, phi) = (u[1].sqrt(), std::f32::consts::TAU * u[2]);
        let w =
            frame.world_from_local(Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u[1]).sqrt()));
        if sample.geometric_normal.dot(w) > 0.0 {
            let origin = offset_origin(sample.position, sample.geometric_normal, w, bias);
            if let Some(hit) = scene.tracer.closest_hit(&Ray::new(origin, w))
                && !lamps.iter().any(|lamp| lamp.shines(hit.primitive))
            {
                sum += scene.interpolate(hit.primitive, hit.barycentrics, vertex_radiance);
            }
        }
    }
    sum / options.bounce_rays as f32
}
