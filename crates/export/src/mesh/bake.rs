//! Textures of an atlas: material from the Gaussians, normals from the full surface.

use glam::{Mat3, Vec3};
use motes_math::srgb;
use motes_scene::{ImageU8, Surface};
use motes_shading::tracing::{BuildQuality, Hit, MeshTracer, Ray, Tracer as _, TriangleMesh};
use rayon::prelude::*;

use super::decimate::Reduced;
use super::fill::fill_unknown;
use super::gaussians_at::{GaussiansAt, Matter};
use super::texels::{EMPTY, barycentrics, triangle_of_texel};
use super::unwrap::Atlas;
use super::{Look, MeshPart, MeshSource, MeshSummary, PbrMesh, Textures};

/// The full surface is looked for this many times the decimation's error off the mesh; its estimate is
/// a mean, not a bound.
const REACH_ERRORS: f32 = 6.0;
/// And at least this many median edges.
const REACH_EDGES: f32 = 3.0;
/// Gaussians of a surface point are this many median edges off it at most.
const GAUSSIAN_REACH_EDGES: f32 = 3.0;

/// A texel: base color (encoded), occlusion, roughness, metallic, normal (tangent space), and whether
/// Gaussians gave the material.
type Texel = ([u8; 9], bool);

struct Baker<'a> {
    surface: &'a Surface,
    tracer: MeshTracer,
    gaussians: Option<GaussiansAt>,
    atlas: &'a Atlas,
    reach: f32,
}

pub(super) fn bake(source: &MeshSource<'_>, reduced: &Reduced, atlas: &Atlas) -> PbrMesh {
    let surface = source.surface;
    let full = TriangleMesh::from(surface);
    let edge = full.median_edge();
    // `is_consistent` has seen the corners already.
    let tracer = MeshTracer::new(&full, BuildQuality::Fast);
    let tracer = tracer.or_else(|_| MeshTracer::new(&TriangleMesh::default(), BuildQuality::Fast));
    let Ok(tracer) = tracer else { return PbrMesh::default() };
    let gaussians = source.gaussians.map(|(gaussians, materials)| {
        GaussiansAt::new(gaussians, materials, atlas.texel, GAUSSIAN_REACH_EDGES * edge)
    });
    let reach = (REACH_ERRORS * reduced.error).max(REACH_EDGES * edge);
    let baker = Baker { surface, tracer, gaussians, atlas, reach };
    let owner = triangle_of_texel(atlas);
    let width = atlas.width;
    let rows: Vec<Vec<Option<Texel>>> = owner
        .par_chunks(width)
        .enumerate()
        .map(|(y, owners)| {
            let mut layers = Vec::new();
            let texel =
                |(x, t): (usize, &u32)| (*t != EMPTY).then(|| baker.texel(*t, x, y, &mut layers));
            owners.iter().enumerate().map(texel).collect()
        })
        .collect();
    let texels: Vec<Option<Texel>> = rows.into_iter().flatten().collect();
    mesh(atlas, &texels)
}

fn mesh(atlas: &Atlas, texels: &[Option<Texel>]) -> PbrMesh {
    let known: Vec<bool> = texels.iter().map(Option::is_some).collect();
    let covered = known.iter().filter(|k| **k).count();
    let from_gaussians = texels.iter().flatten().filter(|(_, from)| *from).count();
    let picture = |first: usize| {
        let data = texels
            .iter()
            .flat_map(|t| t.map_or([0; 3], |(v, _)| [v[first], v[first + 1], v[first + 2]]))
            .collect();
        let mut image = ImageU8::from_data(atlas.width, atlas.height, 3, data);
        fill_unknown(&mut image, &known);
        image
    };
    let textures = Textures {
        uvs: atlas.uvs.clone(),
        tangents: atlas.tangents.clone(),
        base_color: picture(0),
        orm: picture(3),
        normal: picture(6),
    };
    PbrMesh {
        positions: atlas.positions.clone(),
        normals: atlas.normals.clone(),
        parts: vec![MeshPart { triangles: atlas.triangles.clone(), roughness: 1.0, metallic: 1.0 }],
        look: Look::Textures(Box::new(textures)),
        is_lambert: false,
        summary: MeshSummary {
            charts: atlas.charts,
            utilization: atlas.utilization,
            texel: atlas.texel,
            from_gaussians: from_gaussians as f32 / covered.max(1) as f32,
            ..MeshSummary::default()
        },
    }
}

impl Baker<'_> {
    fn texel(&self, triangle: u32, x: usize, y: usize, layers: &mut Vec<(f32, f32, u32)>) -> Texel {
        let atlas = self.atlas;
        let weights = barycentrics(atlas, triangle, x, y);
        let corners = atlas.triangles[triangle as usize];
        let mix = |values: &[[f32; 3]]| -> Vec3 {
            corners.iter().zip(weights).map(|(v, w)| Vec3::from(values[*v as usize]) * w).sum()
        };
        let (position, raw_normal) = (mix(&atlas.positions), mix(&atlas.normals));
        let normal = raw_normal.normalize_or(Vec3::Z);
        let hit = self.nearest(position, normal);
        let (point, full_normal) = hit
            .as_ref()
            .map_or((position, normal), |(ray, hit)| (ray.at(hit.distance), self.full_normal(hit)));
        let seen = self.gaussians.as_ref().and_then(|g| g.matter(point, full_normal, layers));
        let own = || match &hit {
            Some((_, hit)) => self.own_matter(hit),
            None => self.corner_matter(corners, weights),
        };
        let matter = seen.unwrap_or_else(own);
        // `max` first: it turns NaN into 0.
        let byte = |v: f32| (v.max(0.0).clamp(0.0, 1.0) * 255.0).round() as u8;
        let [r, g, b] = matter
            .base_color_linear
            .to_array()
            .map(|v| byte(srgb::encode(v.max(0.0).clamp(0.0, 1.0))));
        // As readers put it together: the interpolated normal and tangent, not made unit.
        let tangents: Vec<[f32; 3]> = corners
            .iter()
            .map(|v| {
                let [x, y, z, _] = atlas.tangents[*v as usize];
                [x, y, z]
            })
            .collect();
        let tangent: Vec3 = tangents.iter().zip(weights).map(|(t, w)| Vec3::from(*t) * w).sum();
        let sign = atlas.tangents[corners[0] as usize][3];
        let local = tangent_space(tangent, raw_normal, sign, full_normal);
        let [nx, ny, nz] = local.to_array().map(|v| byte(0.5 + 0.5 * v));
        let texel = [
            r,
            g,
            b,
            byte(matter.visibility),
            byte(matter.roughness),
            byte(matter.metallic),
            nx,
            ny,
            nz,
        ];
        (texel, seen.is_some())
    }

    /// The full surface nearest to a point of the mesh along its normal, facing the same way.
    fn nearest(&self, position: Vec3, normal: Vec3) -> Option<(Ray, Hit)> {
        let along = |direction: Vec3| {
            // A point on the surface itself is found from a hair's breadth behind it.
            let origin = position - direction * (1e-3 * self.reach);
            let ray = Ray { t_max: self.reach, ..Ray::new(origin, direction) };
            self.tracer.closest_hit(&ray).map(|hit| (ray, hit))
        };
        let faces = |(_, hit): &(Ray, Hit)| hit.geometric_normal.dot(normal) > 0.0;
        let [inward, outward] = [-normal, normal].map(|d| along(d).filter(faces));
        match (inward, outward) {
            (Some(a), Some(b)) => Some(if a.1.distance <= b.1.distance { a } else { b }),
            (a, b) => a.or(b),
        }
    }

    fn full_normal(&self, hit: &Hit) -> Vec3 {
        let normal = self.interpolated(hit, |v| Vec3::from(self.surface.normals[v]));
        let normal = normal.normalize_or(hit.geometric_normal);
        // Normals that point to the other side of their triangle are noise.
        if normal.dot(hit.geometric_normal) > 0.0 { normal } else { hit.geometric_normal }
    }

    fn own_matter(&self, hit: &Hit) -> Matter {
        let s = self.surface;
        let pair = self.interpolated(hit, |v| Vec3::new(s.roughness[v], s.metallic[v], 0.0));
        Matter {
            base_color_linear: self.interpolated(hit, |v| Vec3::from(s.base_color_linear[v])),
            roughness: pair.x,
            metallic: pair.y,
            visibility: 1.0,
        }
    }

    fn corner_matter(&self, corners: [u32; 3], weights: [f32; 3]) -> Matter {
        let mut matter = Matter { visibility: 1.0, ..Matter::default() };
        for (corner, w) in corners.iter().zip(weights) {
            let v = self.atlas.rows[*corner as usize] as usize;
            matter.base_color_linear += Vec3::from(self.surface.base_color_linear[v]) * w;
            matter.roughness += self.surface.roughness[v] * w;
            matter.metallic += self.surface.metallic[v] * w;
        }
        matter
    }

    fn interpolated(&self, hit: &Hit, of: impl Fn(usize) -> Vec3) -> Vec3 {
        let [a, b, c] = self.surface.triangles[hit.primitive as usize].map(|v| of(v as usize));
        let [u, v] = hit.barycentrics;
        a * (1.0 - u - v) + b * u + c * v
    }
}

/// `(x, y, z)` with `normalize(x T + y s (N × T) + z N) = target`; z upwards where that is singular.
pub(super) fn tangent_space(t: Vec3, n: Vec3, sign: f32, target: Vec3) -> Vec3 {
    let frame = Mat3::from_cols(t, n.cross(t) * sign, n);
    let local = if frame.determinant().abs() > 1e-8 { frame.inverse() * target } else { Vec3::Z };
    let local = local.normalize_or(Vec3::Z);
    // A texture cannot point below the mesh.
    if local.z > 0.0 { local } else { Vec3::Z }
}
