//! What the photos show of the light in surfaces that reflect it, as a linear function of the light's cells.
//!
//! A view of a point with a specular lobe shows `L = b S + Σ_j W_j E_j + R`, per channel: `b` its base color, `S` the irradiance
//! over π, `W_j` what the lobe gathers of cell `j`, `R` what it mirrors of the surface itself. A metal has `b = 0` here; its
//! color is in `W`. So views of a point differ by the light alone, which shading says little about where it is soft.

use glam::Vec3;
use motes_shading::brdf::{Brdf, Lobes, Material};
use motes_shading::environment::{Orientation, uv_from_direction};
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, Tracer, offset_origin};
use rayon::prelude::*;

use super::cost::{SolveOptions, rho};
use crate::appearance::material::PART_SAMPLES;
use crate::appearance::{FoundMaterials, Kind};
use crate::illumination::CellLight;
use crate::observation::samples::luminance;
use crate::observation::{Observation, Sample, TracedSurface};

const PURPOSE: u32 = 43;
/// Points per part of a sum.
const CHUNK: usize = 128;
/// Radiance, photo units, below which errors no longer count relative to it.
const DARK: f32 = 0.02;
/// Rays per view of a point.
const RAYS: u32 = 32;

/// One view of a point.
#[derive(Clone, Debug)]
pub(crate) struct GlossyView {
    /// `W`: cells and weights.
    pub lobe: Vec<(u32, Vec3)>,
    /// `R`, photo units.
    pub bounce: Vec3,
    /// What the photo shows.
    pub radiance: Vec3,
    /// How much it counts.
    pub weight: f32,
}

/// A point that reflects.
#[derive(Clone, Debug)]
pub(crate) struct GlossyPoint {
    /// Its row among the lit points.
    pub row: u32,
    /// Whether it has a diffuse lobe too.
    pub is_dielectric: bool,
    /// Errors count relative to this radiance.
    pub unit: f32,
    /// Its views under one light.
    pub views: Vec<GlossyView>,
}

impl GlossyPoint {
    /// `b` that explains the views best, given irradiance over π and cells; reweighted once from `before`.
    pub(crate) fn base(&self, shading: Vec3, light: &[Vec3], before: Vec3, sigma: f32) -> Vec3 {
        if !self.is_dielectric {
            return Vec3::ZERO;
        }
        let (mut a, mut b) = (Vec3::splat(1e-9), Vec3::ZERO);
        for view in &self.views {
            let rest = view.radiance - view.mirrored(light);
            let off = (before * shading - rest) / self.unit;
            let trust = (off * off + sigma * sigma).map(|v| v.sqrt().recip()) * view.weight;
            a += trust * shading * shading;
            b += trust * shading * rest;
        }
        (b / a).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Cost of its views; adds the slopes by irradiance over π (returned) and by cells, which `add` takes.
    pub(crate) fn cost(
        &self,
        base: Vec3,
        shading: Vec3,
        light: &[Vec3],
        sigma: f32,
        mut add: impl FnMut(u32, Vec3),
    ) -> (f64, Vec3) {
        let (mut cost, mut by_shading) = (0.0, Vec3::ZERO);
        for view in &self.views {
            let off = (base * shading + view.mirrored(light) - view.radiance) / self.unit;
            let mut slope = Vec3::ZERO;
            for c in 0..3 {
                let (value, by) = rho(off[c], sigma);
                cost += f64::from(view.weight * value);
                slope[c] = view.weight * by / self.unit;
            }
            by_shading += slope * base;
            for &(cell, weight) in &view.lobe {
                add(cell, slope * weight);
            }
        }
        (cost, by_shading)
    }
}

impl GlossyView {
    fn mirrored(&self, light: &[Vec3]) -> Vec3 {
        self.lobe.iter().map(|(cell, w)| *w * light[*cell as usize]).sum::<Vec3>() + self.bounce
    }
}

/// The points of one light, with what was last taken for their base colors.
#[derive(Clone, Debug)]
pub(crate) struct Glossy {
    pub(crate) points: Vec<GlossyPoint>,
    pub(crate) base: Vec<Vec3>,
}

impl Glossy {
    pub(crate) fn new(points: Vec<GlossyPoint>, base: &[Vec3]) -> Self {
        Self { base: points.iter().map(|p| base[p.row as usize]).collect(), points }
    }

    /// Base colors that explain the views best under this light.
    pub(crate) fn refresh(&mut self, shading: &[Vec3], light: &[Vec3], sigma: f32) {
        let points = &self.points;
        self.base.par_iter_mut().zip(points).for_each(|(base, point)| {
            *base = point.base(shading[point.row as usize], light, *base, sigma);
        });
    }

    /// Cost; adds its slopes by irradiance over π and by cells.
    pub(crate) fn add(
        &self,
        shading: &[Vec3],
        light: &[Vec3],
        options: &SolveOptions,
        by_shading: &mut [Vec3],
        by_cell: &mut [Vec3],
    ) -> f64 {
        let parts: Vec<(f64, Vec<Vec3>, Vec<Vec3>)> = self
            .points
            .par_chunks(CHUNK)
            .zip(self.base.par_chunks(CHUNK))
            .map(|(points, base)| {
                let mut cost = 0.0;
                let mut cells = vec![Vec3::ZERO; by_cell.len()];
                let slopes = points.iter().zip(base).map(|(point, base)| {
                    let s = shading[point.row as usize];
                    let (value, slope) =
                        point.cost(*base, s, light, options.sigma, |j, g| cells[j as usize] += g);
                    cost += value;
                    slope
                });
                let slopes = slopes.collect();
                (cost, slopes, cells)
            })
            .collect();
        let weight = options.glossy;
        let mut cost = 0.0;
        for (points, (value, slopes, cells)) in self.points.chunks(CHUNK).zip(&parts) {
            cost += value;
            for (point, slope) in points.iter().zip(slopes) {
                by_shading[point.row as usize] += *slope * weight;
            }
            by_cell.iter_mut().zip(cells).for_each(|(sum, g)| *sum += *g * weight);
        }
        cost * f64::from(weight)
    }
}

/// What lobes gather.
pub(crate) struct GlossyScene<'a> {
    pub scene: &'a TracedSurface,
    pub samples: &'a [Sample],
    pub found: &'a FoundMaterials,
    /// What the surface sends out under this light, per vertex; empty for nothing.
    pub vertex_radiance: &'a [Vec3],
    pub lobes: Lobes,
    pub ray_bias: f32,
    pub seed: u64,
}

impl GlossyScene<'_> {
    /// The points of `rows` that have a specular lobe, with their views under light number `light`. Weights sum to 1.
    pub(crate) fn points(&self, rows: &[u32], light: u32, cells: &CellLight) -> Vec<GlossyPoint> {
        let finder = CellFinder::new(cells);
        let of = |(row, &p): (usize, &u32)| self.point(p as usize, row as u32, light, &finder);
        let mut points: Vec<GlossyPoint> = rows.par_iter().enumerate().filter_map(of).collect();
        let total: f32 = points.iter().flat_map(|p| &p.views).map(|v| v.weight).sum();
        for view in points.iter_mut().flat_map(|p| &mut p.views) {
            view.weight /= total.max(1e-6);
        }
        points
    }

    /// Sample `p`, if it has a lobe and two views under this light at least: one says nothing that its base color does not.
    fn point(&self, p: usize, row: u32, light: u32, finder: &CellFinder) -> Option<GlossyPoint> {
        let sample = &self.samples[p];
        let part = &self.found.parts[self.found.of_sample[p] as usize];
        let (base, metallic) = match part.kind {
            Kind::Matte => return None,
            Kind::Dielectric => (Vec3::ONE, 0.0),
            Kind::Metal => (self.found.base_color_linear[p], 1.0),
        };
        let material =
            Material { lobes: self.lobes, ..Material::principled(base, part.roughness, metallic) };
        let seen: Vec<&Observation> =
            sample.observations.iter().filter(|o| o.light == light).collect();
        if seen.len() < 2 {
            return None;
        }
        let count = seen.len() as f32;
        let weight = (PART_SAMPLES / part.samples as f32).min(1.0);
        let mean = seen.iter().map(|o| luminance(o.radiance)).sum::<f32>() / count;
        let view = |o: &&Observation| {
            let (lobe, bounce) = self.lobe(sample, o.to_viewer, &material, p as u64, finder);
            GlossyView { lobe, bounce, radiance: o.radiance, weight: weight * o.weight / count }
        };
        let is_dielectric = part.kind == Kind::Dielectric;
        let views = seen.iter().map(view).collect();
        Some(GlossyPoint { row, is_dielectric, unit: mean + DARK, views })
    }

    fn lobe(
        &self,
        sample: &Sample,
        to_viewer: Vec3,
        material: &Material,
        item: u64,
        finder: &CellFinder,
    ) -> (Vec<(u32, Vec3)>, Vec3) {
        let brdf = Brdf::new(material, sample.normal, to_viewer);
        // A metal's lobe is the only one that is drawn from.
        let mirror = Material { metallic: 1.0, base_color_linear: Vec3::ONE, ..*material };
        let drawn = Brdf::new(&mirror, sample.normal, to_viewer);
        let points = PointSet::new(self.seed, item, PURPOSE, RAYS);
        let mut lobe: Vec<(u32, Vec3)> = Vec::new();
        let mut bounce = Vec3::ZERO;
        for k in 0..RAYS {
            let Some(w) = drawn.sample(points.point(k).map(unit_f32)) else { continue };
            let density = drawn.eval_pdf(w).1;
            if !(density > 0.0 && sample.geometric_normal.dot(w) > 0.0) {
                continue;
            }
            let weight = brdf.eval_pdf(w).0.specular / (density * RAYS as f32);
            let origin = offset_origin(sample.position, sample.geometric_normal, w, self.ray_bias);
            match self.scene.tracer.closest_hit(&Ray::new(origin, w)) {
                None => {
                    let cell = finder.cell(w);
                    match lobe.iter_mut().find(|(c, _)| *c == cell) {
                        Some((_, sum)) => *sum += weight,
                        None => lobe.push((cell, weight)),
                    }
                }
                Some(_) if self.vertex_radiance.is_empty() => {}
                Some(hit) => {
                    let radiance = self.scene.interpolate(
                        hit.primitive,
                        hit.barycentrics,
                        self.vertex_radiance,
                    );
                    bounce += weight * radiance;
                }
            }
        }
        (lobe, bounce)
    }
}

/// Which cell a direction lies in.
struct CellFinder {
    columns: usize,
    cells: Vec<u32>,
    orientation: Orientation,
}

impl CellFinder {
    fn new(light: &CellLight) -> Self {
        let columns = light.finest_columns();
        let mut cells = vec![0; columns * (columns / 2)];
        for (j, cell) in light.cells.iter().enumerate() {
            for (x, y) in cell.texels(columns, columns / 2) {
                cells[y * columns + x] = j as u32;
            }
        }
        Self { columns, cells, orientation: light.orientation }
    }

    fn cell(&self, w: Vec3) -> u32 {
        let (u, v) = uv_from_direction(self.orientation.map_from_world(w.as_dvec3()));
        let rows = self.columns / 2;
        let x = ((u * self.columns as f64) as usize).min(self.columns - 1);
        let y = ((v * rows as f64) as usize).min(rows - 1);
        self.cells[y * self.columns + x]
    }
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;

    #[test]
    fn every_direction_of_a_cell_finds_it() {
        let mut light = CellLight::uniform(8, 4, Vec3::ONE, Orientation::new(Convention::Blender));
        let which: Vec<bool> = (0..32).map(|j| j % 3 == 0).collect();
        light.divide(&which);
        let finder = CellFinder::new(&light);
        for (j, cell) in light.cells.iter().enumerate() {
            for (s, t) in [(0.1, 0.1), (0.9, 0.2), (0.5, 0.5), (0.2, 0.9)] {
                let w = cell.direction(s, t, &light.orientation);
                assert_eq!(finder.cell(w) as usize, j, "{cell:?} at {s}, {t}");
            }
        }
        assert!((finder.cell(Vec3::Z) as usize) < light.cells.len());
        assert!((finder.cell(-Vec3::Z) as usize) < light.cells.len());
    }

    #[test]
    fn a_base_color_is_found_under_what_is_mirrored() {
        let (base, shading, light) =
            (Vec3::new(0.2, 0.5, 0.8), Vec3::splat(0.7), [Vec3::ONE, Vec3::splat(9.0)]);
        let views: Vec<GlossyView> = (0..9)
            .map(|k| {
                let lobe = vec![(0, Vec3::splat(0.04)), (k % 2, Vec3::splat(0.02))];
                let mut view = GlossyView {
                    lobe,
                    bounce: Vec3::splat(0.01),
                    radiance: Vec3::ZERO,
                    weight: 1.0,
                };
                view.radiance = base * shading + view.mirrored(&light);
                // One view shows something else.
                view.radiance += if k == 4 { Vec3::splat(3.0) } else { Vec3::ZERO };
                view
            })
            .collect();
        let mut point = GlossyPoint { row: 0, is_dielectric: true, unit: 0.5, views };
        let mut found = Vec3::splat(0.5);
        for _ in 0..20 {
            found = point.base(shading, &light, found, 0.05);
        }
        assert!((found - base).abs().max_element() < 0.02, "{found}");
        point.is_dielectric = false;
        assert_eq!(point.base(shading, &light, found, 0.05), Vec3::ZERO);
    }
}
