//! Parts, their materials, and the scale of the light that highlights tell.

use glam::Vec3;
use motes_scene::Surface;
use motes_shading::environment::{Environment, EnvironmentMap, MapOptions};
use motes_shading::integrate::IntegrationOptions;

use super::basis::{Basis, BasisScene};
use super::contrast::contrast_roughness;
use super::profile::{Kind, Label, Profile};
use super::regions::{RegionOptions, Regions, find_regions};
use super::scale::{ScaleEvidence, weigh_scale};
use crate::buffers::TracedSurface;
use crate::light::cells::CellLight;
use crate::options::{DecomposeOptions, TermChoice};
use crate::samples::Sample;

/// Values of roughness that are compared; between them a parabola decides.
pub const ROUGHNESS: [f32; 10] = [0.05, 0.1, 0.15, 0.2, 0.28, 0.36, 0.45, 0.6, 0.75, 0.9];

/// Material of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartMaterial {
    /// Its kind.
    pub kind: Kind,
    /// Perceptual.
    pub roughness: f32,
    /// Base colour of the whole part, for a metal: what it reflects errs with its normals far more than metals are
    /// textured.
    pub metal_color_linear: Option<Vec3>,
    /// Number of samples.
    pub samples: usize,
    /// Cost per sample of the label that was taken, of the best without a specular lobe, of the best dielectric
    /// and of the best metal.
    pub costs: [f32; 4],
}

/// Materials of all parts.
#[derive(Debug)]
pub struct FoundMaterials {
    /// Part of every sample.
    pub of_sample: Vec<u32>,
    /// The parts.
    pub parts: Vec<PartMaterial>,
    /// Base colour of every sample under the material of its part.
    pub base_color_linear: Vec<Vec3>,
    /// Share of the cost without highlights that highlights save.
    pub specular_gain: f32,
    /// What highlights say about the brightness of the light.
    pub scale: ScaleEvidence,
}

impl FoundMaterials {
    /// Cost of all parts under their materials.
    pub(crate) fn cost(&self) -> f64 {
        self.parts.iter().map(|p| f64::from(p.costs[0]) * p.samples as f64).sum()
    }

    /// Metals take over the roughness that was found together with their normals: the median over the points of a part.
    pub(crate) fn take_roughness(
        &mut self,
        samples: &[Sample],
        surface: &Surface,
        of_vertex: &[Option<f32>],
    ) {
        let mut all: Vec<Vec<f32>> = vec![Vec::new(); self.parts.len()];
        for (sample, &part) in samples.iter().zip(&self.of_sample) {
            let corners = surface.triangles[sample.triangle as usize];
            all[part as usize].extend(corners.iter().filter_map(|&v| of_vertex[v as usize]));
        }
        for (part, values) in self.parts.iter_mut().zip(&mut all) {
            if part.kind == Kind::Metal && !values.is_empty() {
                let middle = values.len() / 2;
                part.roughness = *values.select_nth_unstable_by(middle, f32::total_cmp).1;
            }
        }
    }
}

/// `light` as something that can be sampled.
pub fn environment(light: &CellLight) -> Environment {
    let width = light.finest_columns().clamp(64, 1024);
    let options = MapOptions { exposure: 1.0, orientation: light.orientation };
    // The shape and the exposure are right by construction.
    Environment::new(EnvironmentMap::new(&light.image(width), &options).ok(), None)
}

/// Finds parts and their materials under given lights.
pub fn find_materials(
    scene: &TracedSurface,
    samples: &[Sample],
    lights: &[Environment],
    vertex_radiance: &[Vec<Vec3>],
    ray_bias: f32,
    options: &DecomposeOptions,
    seed: u64,
) -> FoundMaterials {
    let brdf_samples = (options.material_rays / 3).max(1);
    let basis_scene = BasisScene {
        scene,
        lights,
        vertex_radiance,
        lobes: options.lobes.into(),
        options: IntegrationOptions {
            light_samples: (options.material_rays - brdf_samples.min(options.material_rays)).max(1),
            brdf_samples,
            ray_bias,
            seed,
            ..IntegrationOptions::default()
        },
    };
    let basis = basis_scene.integrate(samples, &ROUGHNESS);
    let mut profile = Profile::new(samples, &basis, &|label| price(label, options));
    let region_options =
        RegionOptions { pieces: 200, price: options.weight_smooth_roughness, evidence: 0.2 };
    let mut regions = find_regions(samples, &profile, &region_options);
    let specular_gain = gain(&profile, &regions);
    if options.specular == TermChoice::Auto && specular_gain < LEAST_GAIN {
        let only_matte = |l: &Label| if l.kind == Kind::Matte { 0.0 } else { f32::INFINITY };
        profile.prices = profile.labels.iter().map(only_matte).collect();
        regions = find_regions(samples, &profile, &region_options);
    }
    let scale = weigh_scale(samples, &basis, &profile, &regions, options);
    FoundMaterials {
        specular_gain,
        ..collect(&basis, &profile, regions, samples, scale, options.uniform_metal)
    }
}

/// What a specular lobe costs a part, in units of the profile's cost: a free roughness always explains a little.
const COAT_PRICE: f32 = 6.0;
/// A scene whose views are explained better by highlights by less than this share has none.
const LEAST_GAIN: f32 = 0.08;

/// From here on a metal is not told from a dielectric under a coat by a handful of views, and rare.
const ROUGHEST_METAL: f32 = 0.75;

/// Cost of a kind per part; infinite where it is not allowed.
fn price(label: &Label, options: &DecomposeOptions) -> f32 {
    let coat = match options.specular {
        TermChoice::Off => f32::INFINITY,
        TermChoice::On => 0.0,
        TermChoice::Auto => COAT_PRICE,
    };
    let is_rough = ROUGHNESS[label.roughness] >= ROUGHEST_METAL;
    match (label.kind, options.specular, options.metallic) {
        (Kind::Matte, TermChoice::On, _) => f32::INFINITY,
        (Kind::Matte, ..) => 0.0,
        (Kind::Dielectric, ..) => coat,
        (Kind::Metal, _, TermChoice::Off) => f32::INFINITY,
        (Kind::Metal, _, TermChoice::Auto) if is_rough => f32::INFINITY,
        (Kind::Metal, ..) => coat + options.weight_sparse_metal,
    }
}

/// Share of the cost without highlights that the labels of the parts save.
fn gain(profile: &Profile, regions: &Regions) -> f32 {
    let matte = profile.labels.iter().position(|l| l.kind == Kind::Matte).unwrap_or(0);
    let (with, without) = regions
        .label
        .iter()
        .zip(&regions.costs)
        .fold((0.0, 0.0), |(a, b), (&label, costs)| (a + costs[label], b + costs[matte]));
    if without > 0.0 { 1.0 - with / without } else { 0.0 }
}

fn collect(
    basis: &Basis,
    profile: &Profile,
    regions: Regions,
    samples: &[Sample],
    scale: ScaleEvidence,
    uniform_metal: bool,
) -> FoundMaterials {
    let mut counts = vec![0usize; regions.label.len()];
    regions.of_sample.iter().for_each(|&part| counts[part as usize] += 1);
    let parts: Vec<PartMaterial> = regions
        .label
        .iter()
        .zip(&regions.costs)
        .zip(counts)
        .enumerate()
        .map(|(part, ((&label, costs), count))| {
            let of = |kind: Kind| {
                let costs = profile.labels.iter().zip(costs).filter(|(l, _)| l.kind == kind);
                costs.map(|(_, c)| *c).fold(f32::INFINITY, f32::min) / count.max(1) as f32
            };
            let Label { kind, roughness } = profile.labels[label];
            let metal = (kind == Kind::Metal)
                .then(|| metal_color(basis, samples, &regions.of_sample, part, roughness));
            PartMaterial {
                kind,
                metal_color_linear: metal.filter(|_| uniform_metal),
                roughness: match metal {
                    Some(color) => {
                        let fitted = refined(profile, costs, kind, roughness, &basis.roughness);
                        let of_contrast =
                            contrast_roughness(basis, samples, &regions.of_sample, part, color);
                        // One errs upwards with the normals, the other downwards where the light found is too soft.
                        (fitted * of_contrast.min(fitted)).sqrt()
                    }
                    None => refined(profile, costs, kind, roughness, &basis.roughness),
                },
                samples: count,
                costs: [
                    costs[label] / count.max(1) as f32,
                    of(Kind::Matte),
                    of(Kind::Dielectric),
                    of(Kind::Metal),
                ],
            }
        })
        .collect();
    let base = |p: usize| {
        if let Some(color) = parts[regions.of_sample[p] as usize].metal_color_linear {
            return color;
        }
        let label = regions.label[regions.of_sample[p] as usize];
        profile.base_color_linear[p * profile.labels.len() + label]
    };
    FoundMaterials {
        base_color_linear: (0..samples.len()).map(base).collect(),
        of_sample: regions.of_sample,
        parts,
        specular_gain: 0.0,
        scale,
    }
}

/// Index of the roughness that metal colours are read off with at most: a wide lobe would spread the sun over all views,
/// where the cut cannot remove it.
const NARROW: usize = 3;

/// `Σ (L - B) / Σ A` over all that is seen of a part, per channel, both cut at their 90th percentile: wrong normals
/// move reflections about but keep their sum, and a sun that one of the two misses must not rule it.
fn metal_color(
    basis: &Basis,
    samples: &[Sample],
    of_sample: &[u32],
    part: usize,
    roughness: usize,
) -> Vec3 {
    let mut seen: [[Vec<f32>; 2]; 3] = Default::default();
    for (p, sample) in samples.iter().enumerate().filter(|(p, _)| of_sample[*p] as usize == part) {
        for (k, o) in sample.observations.iter().enumerate() {
            let terms = basis.at(p, k, roughness.min(NARROW));
            for (c, [light, slope]) in seen.iter_mut().enumerate() {
                light.push((o.radiance[c] - terms.metal_offset[c]).max(0.0));
                slope.push(terms.metal_slope[c]);
            }
        }
    }
    let cut_sum = |mut values: Vec<f32>| {
        values.sort_by(f32::total_cmp);
        let high = values.get(values.len() * 9 / 10).copied().unwrap_or(0.0);
        values.iter().map(|v| v.min(high)).sum::<f32>()
    };
    let ratio =
        |[light, slope]: [Vec<f32>; 2]| (cut_sum(light) / cut_sum(slope).max(1e-6)).min(1.0);
    Vec3::from(seen.map(ratio))
}

/// Minimum of the parabola through the costs of a roughness and its neighbours of the same kind.
fn refined(profile: &Profile, costs: &[f32], kind: Kind, at: usize, grid: &[f32]) -> f32 {
    if kind == Kind::Matte {
        return 1.0;
    }
    let cost = |roughness: usize| {
        let label = profile.labels.iter().position(|l| *l == Label { kind, roughness });
        label.map_or(f64::INFINITY, |l| f64::from(costs[l]))
    };
    let curve: Vec<f64> = (0..grid.len()).map(cost).collect();
    least_of_parabola(grid, &curve, at)
}

/// Where the parabola through a least value and its neighbours is least.
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
