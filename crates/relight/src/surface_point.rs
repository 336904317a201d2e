//! The point of the surface that a Gaussian stands for.

use glam::Vec3;
use motes_scene::Surface;
use motes_shading::brdf::Material;
use motes_shading::integrate::SurfacePoint;
use motes_shading::tracing::Ray;

use crate::scene::RelightScene;

/// The surface point of a Gaussian is looked for this many ray biases before and behind it.
const REACH: f32 = 12.0;

/// White matte matter at a place, seen from straight above: it sends the irradiance over π.
pub(crate) fn white_matte(position: Vec3, normal: Vec3) -> SurfacePoint {
    SurfacePoint {
        position,
        geometric_normal: normal,
        shading_normal: normal,
        to_viewer: normal,
        material: Material::lambert(Vec3::ONE),
    }
}

/// The same at a vertex.
pub(crate) fn white_vertex(surface: &Surface, v: usize) -> SurfacePoint {
    let normal = Vec3::from(surface.normals[v]).normalize_or(Vec3::Z);
    white_matte(Vec3::from(surface.vertices[v]), normal)
}

/// Where the Gaussian's light falls: the surface at its center along the normal, or the center.
pub(crate) fn surface_point(scene: &RelightScene, i: usize) -> (Vec3, Vec3) {
    let mean = Vec3::from(scene.gaussians.means[i]);
    let normal = Vec3::from(scene.materials.normals[i]).normalize_or(scene.up_in_world);
    if !mean.is_finite() {
        return (Vec3::ZERO, normal);
    }
    let reach = REACH * scene.ray_bias;
    let ray = Ray { t_max: 2.0 * reach, ..Ray::new(mean + normal * reach, -normal) };
    match scene.first_hit(&ray) {
        Some(hit) if hit.hit.geometric_normal.dot(normal) > 0.0 => (hit.position, hit.normal),
        _ => (mean, normal),
    }
}
