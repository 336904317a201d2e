//! The local light of pixels.

use glam::Vec3;
use rayon::prelude::*;

use super::samples::SeenView;
use super::traced_surface::{PixelHit, TracedSurface};
use crate::illumination::LocalLight;

/// A triangle is narrow where its sides are shorter than this share of what the factor reaches, and its normals agree by this cosine.
const NARROW: f32 = 0.25;
const ALIKE: f32 = 0.9;

/// A local light where pixels meet a surface. It is smooth, so that narrow triangles have it at their corners and it is interpolated
/// between them: there are many more pixels than vertices.
pub(crate) struct LocalFactors<'a> {
    scene: &'a TracedSurface,
    light: &'a LocalLight,
    /// Natural logarithm of the factor, per vertex.
    at_vertices: Vec<Vec3>,
}

impl<'a> LocalFactors<'a> {
    pub(crate) fn new(scene: &'a TracedSurface, light: &'a LocalLight) -> Self {
        let places = scene.surface.vertices.par_iter().zip(&scene.surface.normals);
        let at = |(p, n): (&[f32; 3], &[f32; 3])| light.log_factor((*p).into(), (*n).into());
        Self { scene, light, at_vertices: places.with_min_len(256).map(at).collect() }
    }

    /// The factor where pixel `i` meets the surface; 1 where it misses it.
    pub(crate) fn at(&self, view: &SeenView<'_>, i: usize) -> Vec3 {
        let hit = &view.hits[i];
        if !hit.is_hit() {
            return Vec3::ONE;
        }
        let width = view.photo.camera.width;
        let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        self.on_surface(hit, -view.rays.direction(x, y))
    }

    fn on_surface(&self, hit: &PixelHit, to_viewer: Vec3) -> Vec3 {
        let surface = &self.scene.surface;
        let corners = surface.triangles[hit.triangle as usize].map(|v| v as usize);
        let [p, q, r] = corners.map(|v| Vec3::from(surface.vertices[v]));
        let [n, m, o] = corners.map(|v| Vec3::from(surface.normals[v]));
        let longest =
            [p - q, q - r, r - p].map(Vec3::length_squared).into_iter().fold(0.0, f32::max);
        let is_narrow = longest <= (NARROW * self.light.reach()).powi(2);
        let is_flat = [n.dot(m), m.dot(o), o.dot(n)].into_iter().all(|cosine| cosine > ALIKE);
        // From behind, the other side is seen.
        let geometric = (q - p).cross(r - p);
        let is_front = geometric.dot(to_viewer) > 0.0 && geometric.dot(n) > 0.0;
        if !(is_narrow && is_flat && is_front) {
            let (position, normal, _) = self.scene.frame(hit, to_viewer);
            return self.light.factor(position, normal);
        }
        self.scene.interpolate(hit.triangle, hit.barycentrics(), &self.at_vertices).map(f32::exp)
    }
}

#[cfg(test)]
mod tests {
    use motes_scene::Surface;

    use super::*;
    use crate::illumination::LightAnchor;

    /// A sheet of `n` x `n` squares, a unit wide.
    fn sheet(n: usize) -> Surface {
        let mut surface = Surface::default();
        let side = n + 1;
        for k in 0..side * side {
            let [x, y] = [k % side, k / side].map(|v| v as f32 / n as f32);
            surface.vertices.push([x, y, 0.1 * x * x]);
            surface.normals.push(Vec3::new(-0.2 * x, 0.0, 1.0).normalize().to_array());
        }
        for k in (0..side * side - side).filter(|k| k % side < n) {
            let [a, b, c, d] = [k, k + 1, k + side, k + side + 1].map(|v| v as u32);
            surface.triangles.extend([[a, b, d], [a, d, c]]);
        }
        surface
    }

    #[test]
    fn the_factor_between_corners_is_that_of_the_place_also_from_behind_and_on_wide_triangles() {
        let anchor = |x: f32, y: f32, log: f32| LightAnchor {
            position: Vec3::new(x, y, 0.0),
            normal: Vec3::Z,
            log_factor: Vec3::new(log, -log, 0.5 * log),
        };
        let anchors = vec![anchor(0.0, 0.0, 1.0), anchor(1.0, 0.3, -1.0), anchor(0.4, 1.0, 0.2)];
        let light = LocalLight::new(anchors, 0.4).unwrap();
        for n in [2, 24] {
            let scene = TracedSurface::new(sheet(n)).unwrap();
            let factors = LocalFactors::new(&scene, &light);
            let mut varies = [f32::INFINITY, 0.0];
            for t in 0..scene.surface.triangles.len() as u32 {
                let hit = PixelHit::new(t, [0.3, 0.45], 1.0);
                for to_viewer in [Vec3::Z, -Vec3::Z] {
                    let (position, normal, _) = scene.frame(&hit, to_viewer);
                    let exact = light.factor(position, normal);
                    let found = factors.on_surface(&hit, to_viewer);
                    assert!((found - exact).abs().max_element() < 0.02, "{n}: {found} {exact}");
                    varies = [varies[0].min(exact.x), varies[1].max(exact.x)];
                }
            }
            assert!(
                varies[1] > 2.0 * varies[0],
                "a factor that is the same everywhere: {varies:?}"
            );
        }
    }
}
