//! Lights that photos clip, or do not show, from the shading of surfaces around.
//!
//! The sphere is divided into cells. A cell that the panorama covers sends what it shows; one that it does not cover may send more or
//! less than its completion; a clipped region sends at least white. Each needs a shadow map of its own.

use glam::{DVec3, Vec3};
use motes_math::kmeans::{KmeansOptions, kmeans};
use motes_math::luminance::{luminance, luminance_f64};
use motes_scene::ImageF32;
use motes_shading::environment::{MapAxes, Orientation};

use super::evidence::SurfaceSample;
use super::lamp::{Lamp, find_lamp};
use super::regions::{Region, clipped_regions};
use super::shadows::{Region as ShadowRegion, ShadowMap};
use super::solve::{Shading, Solution};
use super::{Panorama, Splat};
use crate::sphere::{even_directions, texel_direction, texel_of, texel_solid_angle};

/// Encoded value from which a photo is clipped.
pub const CLIPPED: f32 = 0.985;
/// Directions of cells: 15 degrees apart.
const CELLS: usize = 192;
/// Clipped regions that get a factor each; smaller ones than `LEAST_REGION` (steradian) none.
const REGIONS: usize = 12;
const LEAST_REGION: f64 = 2e-4;
/// Fewer points tell nothing.
const LEAST_POINTS: usize = 200;
/// Groups of base colors, by chromaticity.
const GROUPS: usize = 4;
/// A lamp that gives less of the light on a level surface is a chance of textures.
const LEAST_LAMP: f64 = 0.2;
/// Most that a clipped region may be brighter than white: the sun over a lit white wall is some 1e5.
const MOST_FACTOR: f64 = 2e5;

/// What shading told.
pub(super) struct Recovered {
    pub(super) map: ImageF32,
    pub(super) clipped_factor: f64,
    pub(super) errors: [f64; 2],
    pub(super) unseen_share: f64,
    pub(super) lamp: Option<Lamp>,
}

/// Part of the sphere with one unknown or none.
struct Cell {
    /// Unit, world.
    direction: DVec3,
    solid_angle: f64,
    /// Mean luminance of the completed panorama.
    base: f64,
    /// Share that was seen.
    covered: f64,
}

/// Finds lights; `None` where too few points tell of them or nothing is unknown.
pub(super) fn recover(
    splat: &Splat<'_>,
    at: DVec3,
    axes: &MapAxes,
    panorama: &Panorama,
    base: &ImageF32,
    points: &[SurfaceSample],
) -> Option<Recovered> {
    if points.len() < LEAST_POINTS {
        return None;
    }
    let orientation = axes.orientation();
    let regions: Vec<Region> = clipped_regions(&panorama.clipped, base.width)
        .into_iter()
        .filter(|r| r.solid_angle > LEAST_REGION)
        .take(REGIONS)
        .collect();
    let in_region = region_mask(&regions, base.pixel_count());
    let cells = cells(panorama, base, &in_region, &orientation);
    let region = ShadowRegion::around(points.iter().map(|p| p.position), at);
    let look = Look { splat, region: &region, panorama, base, orientation: &orientation };
    let (shading, unknown) = look.shading(&cells, &regions, points)?;
    let without = shading.solve(false);
    let even = shading.solve(true);
    let candidates: Vec<(DVec3, f64)> = unknown
        .iter()
        .zip(&even.light)
        .map(|(c, y)| (cells[*c].direction, (y + cells[*c].base) * cells[*c].solid_angle))
        .collect();
    let (solution, lamp) = find_lamp(splat, &region, points, &shading, &even, &candidates);
    let found = Found { cells: &cells, unknown: &unknown, regions: &regions, solution: &solution };
    let up = splat.up_in_world;
    let share = |lamp: &Lamp| {
        let (_, total) = found.on_level(up, Some(lamp), base, &orientation);
        lamp.power * lamp.direction.dot(up).max(0.0) / total.max(1e-12)
    };
    let (solution, lamp) = match lamp {
        Some(lamp) if share(&lamp) < LEAST_LAMP => (even.clone(), None),
        lamp => (solution.clone(), lamp),
    };
    let found = Found { solution: &solution, ..found };
    let (unseen, total) = found.on_level(up, lamp.as_ref(), base, &orientation);
    let lamp = lamp
        .map(|lamp| Lamp { share: lamp.power * lamp.direction.dot(up).max(0.0) / total, ..lamp });
    let (map, clipped_factor) = found.map(base, panorama, &orientation, lamp.as_ref());
    Some(Recovered {
        map,
        clipped_factor,
        errors: [without.error, solution.error],
        unseen_share: if total > 0.0 { unseen / total } else { 0.0 },
        lamp,
    })
}

/// What the shading of points is made of.
struct Look<'a> {
    splat: &'a Splat<'a>,
    region: &'a ShadowRegion,
    panorama: &'a Panorama,
    base: &'a ImageF32,
    orientation: &'a Orientation,
}

impl Look<'_> {
    /// The shading of points, and the cells that are its first unknowns; clipped regions are the others. `None` where nothing is
    /// unknown.
    fn shading(
        &self,
        cells: &[Cell],
        regions: &[Region],
        points: &[SurfaceSample],
    ) -> Option<(Shading, Vec<usize>)> {
        let mut shading = Shading {
            sent: points.iter().map(|p| f64::from(luminance(p.radiance.to_array()))).collect(),
            group: groups(points),
            known: vec![0.0; points.len()],
            ..Shading::default()
        };
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut unknown = Vec::new();
        let mut add = |direction: DVec3, solid_angle: f64, radiance: f64| {
            let reach = reach_of(direction, self.panorama, self.orientation, self.region);
            let map = ShadowMap::new(self.splat, self.region, direction, reach);
            let column = column(&map, direction, solid_angle, points);
            shading.known.iter_mut().zip(&column).for_each(|(k, c)| *k += c * radiance);
            column
        };
        let mut low = Vec::new();
        for (c, cell) in cells.iter().enumerate() {
            let column = add(cell.direction, cell.solid_angle, cell.base);
            if cell.covered < 0.5 {
                unknown.push(c);
                low.push(-cell.base);
                columns.push(column);
            }
        }
        for r in regions {
            let direction = self.orientation.world_from_map(r.direction);
            columns.push(add(direction, r.solid_angle, white_of(self.base, r)));
            low.push(0.0);
        }
        if columns.is_empty() {
            return None;
        }
        let m = columns.len();
        shading.low = low;
        shading.neighbors = neighbors(cells, &unknown);
        shading.transport = (0..points.len() * m).map(|k| columns[k % m][k / m]).collect();
        Some((shading, unknown))
    }
}

/// Pairs of unknown cells that lie side by side.
fn neighbors(cells: &[Cell], unknown: &[usize]) -> Vec<(usize, usize, f64)> {
    let near = (1.5 * (4.0 * std::f64::consts::PI / CELLS as f64).sqrt()).cos();
    let mut pairs = Vec::new();
    for (i, a) in unknown.iter().enumerate() {
        for (k, b) in unknown.iter().enumerate().take(i) {
            if cells[*a].direction.dot(cells[*b].direction) > near {
                pairs.push((i, k, cells[*b].base - cells[*a].base));
            }
        }
    }
    pairs
}

/// What points receive over π from a direction at unit radiance.
pub(super) fn column(
    map: &ShadowMap,
    to_light: DVec3,
    solid_angle: f64,
    points: &[SurfaceSample],
) -> Vec<f64> {
    let of = |p: &SurfaceSample| {
        let cosine = p.normal.dot(to_light);
        if cosine > 0.0 {
            cosine * solid_angle / std::f64::consts::PI * map.visibility(p.position, p.normal)
        } else {
            0.0
        }
    };
    points.iter().map(of).collect()
}

fn region_mask(regions: &[Region], texels: usize) -> Vec<bool> {
    let mut mask = vec![false; texels];
    regions.iter().flat_map(|r| &r.texels).for_each(|i| mask[*i] = true);
    mask
}

fn cells(
    panorama: &Panorama,
    base: &ImageF32,
    in_region: &[bool],
    orientation: &Orientation,
) -> Vec<Cell> {
    let (w, h) = (base.width, base.height);
    let directions = even_directions(CELLS);
    let mut sums = vec![(0.0, 0.0, 0.0); CELLS];
    for i in (0..w * h).filter(|i| !in_region[*i]) {
        let world = orientation.world_from_map(texel_direction(i % w, i / w, w, h));
        let Some(cell) = nearest(&directions, world) else { continue };
        let omega = texel_solid_angle(i / w, w, h);
        sums[cell].0 += omega;
        sums[cell].1 +=
            omega * luminance_f64(Vec3::from_slice(&base.data[3 * i..3 * i + 3]).as_dvec3());
        sums[cell].2 += omega * f64::from(panorama.covered[i]);
    }
    let cell = |(direction, (omega, light, covered)): (DVec3, (f64, f64, f64))| {
        let mean = |sum: f64| if omega > 0.0 { sum / omega } else { 0.0 };
        Cell { direction, solid_angle: omega, base: mean(light), covered: mean(covered) }
    };
    directions.into_iter().zip(sums).map(cell).collect()
}

fn nearest(directions: &[DVec3], d: DVec3) -> Option<usize> {
    (0..directions.len()).max_by(|a, b| directions[*a].dot(d).total_cmp(&directions[*b].dot(d)))
}

/// How far from the place light from a direction starts: nine tenths of the way to what the panorama shows there.
fn reach_of(
    direction: DVec3,
    panorama: &Panorama,
    orientation: &Orientation,
    region: &ShadowRegion,
) -> f64 {
    let (w, h) = (panorama.radiance.width, panorama.radiance.height);
    let (x, y) = texel_of(orientation.map_from_world(direction), w, h);
    let seen = f64::from(panorama.distance[y * w + x]);
    let all = 10.0 * region.radius;
    if panorama.covered[y * w + x] > 0.5 { (0.9 * seen).min(all) } else { all }
}

fn white_of(base: &ImageF32, region: &Region) -> f64 {
    let sum: f64 = region
        .texels
        .iter()
        .map(|i| luminance_f64(Vec3::from_slice(&base.data[3 * i..3 * i + 3]).as_dvec3()))
        .sum();
    sum / region.texels.len().max(1) as f64
}

/// Groups of points by chromaticity.
fn groups(points: &[SurfaceSample]) -> Vec<usize> {
    let chroma: Vec<f32> = points
        .iter()
        .flat_map(|p| {
            let sum = p.radiance.element_sum().max(1e-4);
            [p.radiance.x / sum, p.radiance.y / sum]
        })
        .collect();
    let options = KmeansOptions { clusters: GROUPS, ..KmeansOptions::default() };
    let clusters = kmeans(&chroma, 2, &options);
    clusters.labels.iter().map(|label| *label as usize).collect()
}

/// A solution and what its unknowns are.
struct Found<'a> {
    cells: &'a [Cell],
    unknown: &'a [usize],
    regions: &'a [Region],
    solution: &'a Solution,
}

impl Found<'_> {
    /// Irradiance of a level surface from where nothing was seen, and from everywhere.
    fn on_level(
        &self,
        up: DVec3,
        lamp: Option<&Lamp>,
        base: &ImageF32,
        orientation: &Orientation,
    ) -> (f64, f64) {
        let cosine = |d: DVec3| d.dot(up).max(0.0);
        let flux = |cell: &Cell| cell.base * cell.solid_angle * cosine(cell.direction);
        let mut total: f64 = self.cells.iter().map(flux).sum();
        let mut unseen: f64 = self.unknown.iter().map(|c| flux(&self.cells[*c])).sum();
        for (c, y) in self.unknown.iter().zip(&self.solution.light) {
            let more = y * self.cells[*c].solid_angle * cosine(self.cells[*c].direction);
            unseen += more;
            total += more;
        }
        for (r, y) in self.regions.iter().zip(&self.solution.light[self.unknown.len()..]) {
            let direction = orientation.world_from_map(r.direction);
            total += (white_of(base, r) + y) * r.solid_angle * cosine(direction);
        }
        if let Some(lamp) = lamp {
            let more = lamp.power * cosine(lamp.direction);
            unseen += more;
            total += more;
        }
        (unseen, total)
    }

    /// The completed map with what was found, and the mean factor of clipped light.
    fn map(
        &self,
        base: &ImageF32,
        panorama: &Panorama,
        orientation: &Orientation,
        lamp: Option<&Lamp>,
    ) -> (ImageF32, f64) {
        let mut map = base.clone();
        let (w, h) = (map.width, map.height);
        let mut of_cell = vec![0.0; self.cells.len()];
        self.unknown.iter().zip(&self.solution.light).for_each(|(c, y)| of_cell[*c] = *y);
        // As wide as cells are apart.
        let sharpness = CELLS as f64 / 2.0;
        let mut is_unknown = vec![false; self.cells.len()];
        self.unknown.iter().for_each(|c| is_unknown[*c] = true);
        let directions: Vec<DVec3> = self.cells.iter().map(|cell| cell.direction).collect();
        for i in (0..w * h).filter(|i| panorama.covered[*i] < 1.0) {
            let d = orientation.world_from_map(texel_direction(i % w, i / w, w, h));
            let (mut sum, mut total) = (0.0, 0.0);
            for (cell, y) in self.cells.iter().zip(&of_cell) {
                let k = (sharpness * (cell.direction.dot(d) - 1.0)).exp();
                sum += k * y;
                total += k;
            }
            let open = 1.0 - panorama.covered[i];
            let more = open * (sum / total) as f32;
            let texel = &mut map.data[3 * i..3 * i + 3];
            // What lies far from all that was seen has not its hue.
            let gray = luminance([texel[0], texel[1], texel[2]]);
            let far = nearest(&directions, d).is_some_and(|c| is_unknown[c]);
            let hue = if far { 1.0 - open } else { 1.0 };
            texel.iter_mut().for_each(|v| *v = (gray + hue * (*v - gray) + more).max(0.0));
        }
        let (mut weighted, mut area) = (0.0, 0.0);
        for (r, y) in self.regions.iter().zip(&self.solution.light[self.unknown.len()..]) {
            let white = white_of(base, r).max(1e-3);
            let factor = ((white + y) / white).clamp(1.0, MOST_FACTOR);
            for i in &r.texels {
                map.data[3 * i..3 * i + 3].iter_mut().for_each(|v| *v *= factor as f32);
            }
            weighted += factor * r.solid_angle;
            area += r.solid_angle;
        }
        if let Some(lamp) = lamp {
            lamp.add_to(&mut map, orientation);
        }
        (map, if area > 0.0 { weighted / area } else { 1.0 })
    }
}
