//! Gaussians on the surface of a mesh.
//!
//! Candidates are spread by area: the i-th of `n` lies where the cumulated area is `(i + 1/2) / n` of all, at
//! barycentric coordinates from the R2 sequence (Roberts 2018). Of them, those that crowd are left out. Each point that is left
//! carries a flat Gaussian as wide as the spacing of the points, of the mean material of the candidates around it.

use glam::{DQuat, DVec3, Vec3};
use motes_codecs::mesh::{Mesh, PointMaterial, barycentrics};
use motes_math::sh::SH_C0;
use motes_math::sigmoid::logit;
use motes_math::srgb;
use motes_scene::{Gaussians, Materials, Surface};

use super::spread_points::{evenly, nearest_of};

/// Standard deviation over the spacing of the points. Of evenly spread ones no place is farther than 0.62 spacings: there three
/// neighbors make up nine tenths. Wider ones blur the texture.
const WIDTH: f64 = 0.6;
/// Candidates per point.
const CANDIDATES: usize = 4;
/// Thickness over width.
const THINNESS: f64 = 0.05;
/// Opacity 0.982.
const OPACITY_LOGIT: f32 = 4.0;
/// Spacing over the diagonal, when no number is given.
const SPACING: f64 = 1.0 / 120.0;
/// Gaussians per square pixel of the area.
const PER_PIXEL: f64 = 1.6;
/// Numbers when none is given.
const DEFAULT_COUNT: std::ops::RangeInclusive<f64> = 2_000.0..=200_000.0;
/// What is fainter than a step of 8 bits is not drawn.
const LEAST_OPACITY: f32 = 1.0 / 255.0;

/// A point of a mesh.
struct Candidate {
    triangle: usize,
    weights: [f64; 3],
    place: DVec3,
    face: DVec3,
}

/// Gaussians of degree 0 with material columns on a mesh; shown colors are the encoded base colors. A mesh without
/// area gives none; where it has holes (cut-outs of a texture) are none.
pub fn gaussians_on(mesh: &Mesh, count: Option<usize>) -> Gaussians {
    let mut gaussians = Gaussians::empty(0);
    let mut materials = Materials::default();
    let (cumulated, total) = areas(&mesh.surface);
    if !(total > 0.0) {
        materials.attach(&mut gaussians);
        return gaussians;
    }
    let n = count.unwrap_or_else(|| default_count(&mesh.surface, total));
    let candidates = candidates(mesh, &cumulated, CANDIDATES * n);
    let places: Vec<DVec3> = candidates.iter().map(|c| c.place).collect();
    let faces: Vec<DVec3> = candidates.iter().map(|c| c.face).collect();
    let kept = evenly(&places, &faces, n, total);
    let spacing = (total / n as f64).sqrt();
    let looks = covered(mesh, &candidates, &kept, spacing);
    let width = WIDTH * spacing;
    let (long, thin) = (width.ln() as f32, (width * THINNESS).ln() as f32);
    for (&i, look) in kept.iter().zip(&looks) {
        if look.opacity < LEAST_OPACITY {
            continue;
        }
        let Candidate { triangle, weights, place, face } = &candidates[i];
        let q = DQuat::from_rotation_arc(DVec3::Z, *face);
        let base = look.base_color_linear;
        gaussians.means.push(place.as_vec3().to_array());
        gaussians.rotations.push([q.w, q.x, q.y, q.z].map(|v| v as f32));
        gaussians.log_scales.push([long, long, thin]);
        gaussians.opacity_logits.push(logit(look.opacity).min(OPACITY_LOGIT));
        gaussians.sh.extend(base.map(|v| (srgb::encode(v) - 0.5) / SH_C0 as f32));
        let corners = mesh.surface.triangles[*triangle];
        let normal = mixed(&mesh.surface.normals, corners, weights).normalize_or(*face);
        materials.normals.push(normal.as_vec3().to_array());
        materials.base_color_linear.push(base);
        materials.roughness.push(look.roughness);
        materials.metallic.push(look.metallic);
        materials.visibility.push(1.0);
        materials.observations.push(0);
    }
    materials.attach(&mut gaussians);
    gaussians
}

fn mixed(values: &[[f32; 3]], corners: [u32; 3], weights: &[f64; 3]) -> DVec3 {
    (0..3).map(|k| Vec3::from(values[corners[k] as usize]).as_dvec3() * weights[k]).sum()
}

fn corners_of(surface: &Surface, triangle: usize) -> [DVec3; 3] {
    surface.triangles[triangle].map(|v| Vec3::from(surface.vertices[v as usize]).as_dvec3())
}

/// Areas of the triangles, cumulated, and their sum.
fn areas(surface: &Surface) -> (Vec<f64>, f64) {
    let mut total = 0.0;
    let cumulated = (0..surface.triangles.len())
        .map(|t| {
            let [a, b, c] = corners_of(surface, t);
            let area = 0.5 * (b - a).cross(c - a).length();
            total += if area.is_finite() { area } else { 0.0 };
            total
        })
        .collect();
    (cumulated, total)
}

/// Points spread by area.
fn candidates(mesh: &Mesh, cumulated: &[f64], n: usize) -> Vec<Candidate> {
    let total = cumulated.last().copied().unwrap_or(0.0);
    let candidate = |i: usize| {
        let area = (i as f64 + 0.5) / n as f64 * total;
        let triangle = cumulated.partition_point(|sum| *sum < area).min(cumulated.len() - 1);
        let [u, v] = barycentrics(i);
        let weights = [1.0 - u - v, u, v];
        let [a, b, c] = corners_of(&mesh.surface, triangle);
        let face = (b - a).cross(c - a).normalize_or(DVec3::Z);
        let place = mixed(&mesh.surface.vertices, mesh.surface.triangles[triangle], &weights);
        Candidate { triangle, weights, place, face }
    };
    (0..n).map(candidate).collect()
}

/// The mean material of the area that each point covers: of the candidates that it is nearest to.
fn covered(
    mesh: &Mesh,
    candidates: &[Candidate],
    kept: &[usize],
    spacing: f64,
) -> Vec<PointMaterial> {
    let side = spacing / (CANDIDATES as f64).sqrt();
    let places: Vec<DVec3> = kept.iter().map(|&i| candidates[i].place).collect();
    let faces: Vec<DVec3> = kept.iter().map(|&i| candidates[i].face).collect();
    let points = candidates.iter().map(|c| (c.place, c.face));
    let owners = nearest_of(&places, &faces, points, 2.0 * spacing);
    let mut sums = vec![(0.0f32, PointMaterial::default()); kept.len()];
    for (candidate, owner) in candidates.iter().zip(owners) {
        let Some(owner) = owner else { continue };
        let look = mesh.material_at(candidate.triangle, candidate.weights, side);
        let (count, sum) = &mut sums[owner];
        *count += 1.0;
        // What is not there has no color.
        for (sum, v) in sum.base_color_linear.iter_mut().zip(look.base_color_linear) {
            *sum += v * look.opacity;
        }
        sum.roughness += look.roughness * look.opacity;
        sum.metallic += look.metallic * look.opacity;
        sum.opacity += look.opacity;
    }
    let mean = |(count, sum): (f32, PointMaterial)| PointMaterial {
        base_color_linear: sum.base_color_linear.map(|v| v / sum.opacity.max(1e-6)),
        roughness: sum.roughness / sum.opacity.max(1e-6),
        metallic: sum.metallic / sum.opacity.max(1e-6),
        opacity: sum.opacity / count.max(1.0),
    };
    sums.into_iter().map(mean).collect()
}

/// Gaussians for a mesh whose area is this, in squares of the pixels that show it. More would be smaller than a pixel: the
/// rasterizer widens each to one, and textures and outlines blur.
pub fn count_for_pixels(area_px2: f64) -> u64 {
    let count = PER_PIXEL * area_px2;
    count.clamp(*DEFAULT_COUNT.start(), *DEFAULT_COUNT.end()) as u64
}

/// Area of a surface, squares of its unit.
pub fn area(surface: &Surface) -> f64 {
    areas(surface).1
}

fn default_count(mesh: &Surface, area: f64) -> usize {
    let points = mesh.vertices.iter().map(|v| Vec3::from(*v).as_dvec3());
    let (low, high) =
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let spacing = SPACING * (high - low).length();
    (area / (spacing * spacing)).clamp(*DEFAULT_COUNT.start(), *DEFAULT_COUNT.end()) as usize
}

/// A surface for rays to meet where an asset brings none: a square per opaque Gaussian, in the plane of its two longer
/// axes. It casts shadows; it is not smooth enough to be looked at.
pub fn surface_of(gaussians: &Gaussians, materials: &Materials) -> Surface {
    /// Half the side over the standard deviation: the square has the area of the disc that is more opaque than
    /// half its peak.
    const HALF_SIDE: f64 = 1.04;
    let mut surface = Surface::default();
    for row in 0..gaussians.len() {
        // Fainter ones do not block half of the light.
        if !(gaussians.opacity_logits[row] > 0.0) {
            continue;
        }
        let mut axes = [0, 1, 2];
        let scales = gaussians.log_scales[row].map(|s| f64::from(s).exp());
        axes.sort_by(|a, b| scales[*b].total_cmp(&scales[*a]));
        let [w, x, y, z] = gaussians.rotations[row].map(f64::from);
        let q = DQuat::from_xyzw(x, y, z, w).normalize();
        let center = DVec3::from_array(gaussians.means[row].map(f64::from));
        let normal = Vec3::from(materials.normals[row]).as_dvec3();
        let u = q * DVec3::AXES[axes[0]] * (HALF_SIDE * scales[axes[0]]);
        let mut v = q * DVec3::AXES[axes[1]] * (HALF_SIDE * scales[axes[1]]);
        if u.cross(v).dot(normal) < 0.0 {
            v = -v;
        }
        if !(center + u + v).is_finite() {
            continue;
        }
        let first = surface.vertices.len() as u32;
        for corner in [-u - v, u - v, u + v, -u + v] {
            surface.vertices.push((center + corner).as_vec3().to_array());
            surface.normals.push(materials.normals[row]);
            surface.base_color_linear.push(materials.base_color_linear[row]);
            surface.roughness.push(materials.roughness[row]);
            surface.metallic.push(materials.metallic[row]);
        }
        surface.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    surface
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Surface {
        Surface {
            vertices: vec![[0.0; 3], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            base_color_linear: vec![[0.2, 0.4, 0.6]; 4],
            roughness: vec![0.3; 4],
            metallic: vec![1.0; 4],
            ..Surface::default()
        }
    }

    #[test]
    fn points_cover_the_square_evenly() {
        let gaussians = gaussians_on(&Mesh::plain(square(), DVec3::Z), Some(400));
        assert!(gaussians.is_consistent() && gaussians.len() == 400);
        let mut cells = [0; 16];
        for [x, y, z] in &gaussians.means {
            assert!((0.0..=2.0).contains(x) && (0.0..=2.0).contains(y) && *z == 0.0);
            cells[(x * 2.0) as usize % 4 + 4 * ((y * 2.0) as usize % 4)] += 1;
        }
        assert!(cells.iter().all(|n| (15..=35).contains(n)), "{cells:?}");
        let materials = Materials::of(&gaussians).unwrap();
        assert_eq!((materials.metallic[7], materials.normals[7]), (1.0, [0.0, 0.0, 1.0]));
        assert!(gaussians_on(&Mesh::plain(Surface::default(), DVec3::Z), None).is_empty());
    }

    #[test]
    fn squares_have_about_the_area_that_blocks_light() {
        let gaussians = gaussians_on(&Mesh::plain(square(), DVec3::Z), Some(400));
        let surface = surface_of(&gaussians, &Materials::of(&gaussians).unwrap());
        assert!(surface.is_consistent() && surface.triangles.len() == 800);
        let side = Vec3::from(surface.vertices[0]).distance(Vec3::from(surface.vertices[1]));
        // 1.25 spacings: neighboring squares overlap, so no light leaks.
        assert!((side - 2.0 * 1.04 * WIDTH as f32 * 0.1).abs() < 1e-3, "{side}");
    }
}
