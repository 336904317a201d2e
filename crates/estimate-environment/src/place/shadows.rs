//! Whether light from a direction reaches a point: a shadow map (Williams 1978) of the splat per direction.
//!
//! A far camera looks along the light. What lies farther behind the median depth than a bias is in shadow. Gaussians beyond the light
//! (the wall behind a lamp, a shell of sky) are cut off by the near plane.

use glam::DVec3;
use motes_raster::{RenderOptions, render};
use motes_scene::{Pinhole, Pose};

use super::Splat;

/// Pixels across a map.
const SIDE: usize = 192;
/// Distance of the camera in radii of the region: nearly parallel rays.
const DISTANCE: f64 = 12.0;
/// Depth that a splat's surface is fuzzy by, in radii of the region.
const BIAS: f64 = 0.02;

/// A region of the world that shadows are looked up in.
#[derive(Clone, Copy, Debug)]
pub struct Region {
    /// World.
    pub center: DVec3,
    /// World units.
    pub radius: f64,
}

impl Region {
    /// A ball around nearly all of the points.
    pub fn around(points: impl Iterator<Item = DVec3> + Clone, center: DVec3) -> Self {
        let mut far: Vec<f64> = points.map(|p| p.distance(center)).collect();
        far.sort_by(f64::total_cmp);
        let radius = far.get(far.len().saturating_sub(1) * 99 / 100).copied();
        Self { center, radius: radius.filter(|r| *r > 0.0).unwrap_or(1.0) * 1.05 }
    }
}

/// Which points the light from a direction reaches.
pub struct ShadowMap {
    camera: Pinhole,
    camera_from_world: Pose,
    /// z of the first surface; infinite where there is none.
    depth: Vec<f32>,
    bias: f64,
}

impl ShadowMap {
    /// Of light from `to_light` (unit, world). What is farther than `reach` from the center toward the light casts no shadow.
    pub fn new(splat: &Splat<'_>, region: &Region, to_light: DVec3, reach: f64) -> Self {
        let distance = DISTANCE * region.radius;
        let eye = region.center + to_light * distance;
        let up = if to_light.z.abs() > 0.9 { DVec3::X } else { DVec3::Z };
        let camera_from_world = Pose::look_at(eye, region.center, up).unwrap_or(Pose::IDENTITY);
        let half = SIDE as f64 / 2.0;
        // The region fills the picture.
        let focal = half * (DISTANCE * DISTANCE - 1.0).sqrt();
        let camera =
            Pinhole { fx: focal, fy: focal, cx: half, cy: half, width: SIDE, height: SIDE };
        let near = (distance - reach).max(0.01 * distance) as f32;
        let options = RenderOptions {
            antialias: splat.antialias,
            aovs: true,
            near,
            ..RenderOptions::default()
        };
        let drawn = render(splat.gaussians, &camera, &camera_from_world, &options);
        let depth = match drawn.aovs {
            Some(aovs) => aovs.depth_median.data,
            None => Vec::new(),
        };
        let depth = depth.into_iter().map(|z| if z > 0.0 { z } else { f32::INFINITY }).collect();
        Self { camera, camera_from_world, depth, bias: BIAS * region.radius }
    }

    /// Share of the light that reaches a point with a normal, 0 to 1: four neighbors of the map.
    pub fn visibility(&self, point: DVec3, normal: DVec3) -> f64 {
        let p = self.camera_from_world.transform_point(point + normal * self.bias);
        let u = self.camera.fx * p.x / p.z + self.camera.cx - 0.5;
        let v = self.camera.fy * p.y / p.z + self.camera.cy - 0.5;
        let side = (SIDE - 1) as f64;
        if !((0.0..side).contains(&u) && (0.0..side).contains(&v)) {
            return 1.0;
        }
        let (x, y) = (u as usize, v as usize);
        let (s, t) = (u - x as f64, v - y as f64);
        let open = |x: usize, y: usize| {
            f64::from(u8::from(p.z <= f64::from(self.depth[y * SIDE + x]) + self.bias))
        };
        (open(x, y) * (1.0 - s) + open(x + 1, y) * s) * (1.0 - t)
            + (open(x, y + 1) * (1.0 - s) + open(x + 1, y + 1) * s) * t
    }
}

#[cfg(test)]
mod tests {
    use motes_raster::Antialias;
    use motes_scene::Gaussians;

    use super::*;

    /// A square of 1 at z = 1 over a floor that nobody draws.
    fn roof() -> Gaussians {
        let mut gaussians = motes_testkit::random_gaussians(1, 900, 0);
        for i in 0..900 {
            let (x, y) = ((i % 30) as f32 / 30.0 - 0.5, (i / 30) as f32 / 30.0 - 0.5);
            gaussians.means[i] = [x, y, 1.0];
            gaussians.rotations[i] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[i] = [-3.5, -3.5, -7.0];
            gaussians.opacity_logits[i] = 5.0;
        }
        gaussians
    }

    #[test]
    fn a_roof_shades_what_is_below_it_and_not_what_is_above_or_beside() {
        let gaussians = roof();
        let splat = Splat {
            gaussians: &gaussians,
            antialias: Antialias::Classic,
            views: &[],
            up_in_world: DVec3::Z,
        };
        let region = Region { center: DVec3::ZERO, radius: 3.0 };
        let map = ShadowMap::new(&splat, &region, DVec3::Z, 30.0);
        assert!(map.visibility(DVec3::ZERO, DVec3::Z) < 0.01);
        assert!(map.visibility(DVec3::new(1.5, 0.0, 0.0), DVec3::Z) > 0.99);
        assert!(map.visibility(DVec3::new(0.0, 0.0, 1.5), DVec3::Z) > 0.99);
        // Slanted light moves the shadow aside.
        let slanted = ShadowMap::new(&splat, &region, DVec3::new(1.0, 0.0, 1.0).normalize(), 30.0);
        assert!(slanted.visibility(DVec3::new(-1.0, 0.0, 0.0), DVec3::Z) < 0.01);
        assert!(slanted.visibility(DVec3::new(0.2, 0.0, 0.0), DVec3::Z) > 0.99);
        // A roof beyond the light casts none.
        let lamp = ShadowMap::new(&splat, &region, DVec3::Z, 0.6);
        assert!(lamp.visibility(DVec3::ZERO, DVec3::Z) > 0.99);
    }
}
