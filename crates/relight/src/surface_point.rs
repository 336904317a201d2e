//! The point of the surface that a Gaussian stands for.

use glam::Vec3;
use motes_scene::Surface;
use motes_shading::brdf::Material;
use motes_shading::integrate::SurfacePoint;
use motes_shading::tracing::Ray;

use crate::scene::RelightScene;

/// The surface point of a Gaussian is looked for this many ray biases before and behind it, the nearer ones first: before a wall that
/// few photos see Gaussians hang far off.
const REACHES: [f32; 2] = [12.0, 40.0];

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
    let on_surface = |reach: f32| {
        let ray = Ray { t_max: 2.0 * reach, ..Ray::new(mean + normal * reach, -normal) };
        scene.first_hit(&ray).filter(|hit| hit.hit.geometric_normal.dot(normal) > 0.0)
    };
    let hit = REACHES.into_iter().find_map(|biases| on_surface(biases * scene.ray_bias));
    hit.map_or((mean, normal), |hit| (hit.position, hit.normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand_in::tests::scene;

    #[test]
    fn a_gaussian_stands_for_the_nearest_surface_within_reach() {
        let bias = scene(&[0.0], &[0.0]).ray_bias;
        let placed = |biases: f32, layers: &[f32]| {
            let layers: Vec<f32> = layers.iter().map(|height| height * bias).collect();
            let scene = scene(&[biases * bias], &layers);
            (surface_point(&scene, scene.gaussians.len() / 2 + 20).0.z / bias).round()
        };
        assert_eq!([10.0, -10.0, 38.0, -38.0].map(|z| placed(z, &[0.0])), [0.0; 4]);
        assert_eq!([50.0, -50.0].map(|z| placed(z, &[0.0])), [50.0, -50.0]);
        // What is above is not what is near.
        assert_eq!(placed(5.0, &[0.0, 30.0]), 0.0);
    }
}
