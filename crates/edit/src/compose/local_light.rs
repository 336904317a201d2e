//! The light at a place of a splat, and an asset under it.
//!
//! The light is a map seen from the place, so what is near is in it as if it were far. Two corrections make up for that: the ground under the
//! asset is a patch of surface that the asset shades, and the brightest direction counts as far as the splat lets it through.

use estimate_environment::place::shadows::{Region, ShadowMap};
use estimate_environment::sphere::{texel_direction, texel_solid_angle};
use glam::{DVec3, Vec3};
use motes_math::luminance::luminance_f64;
use motes_scene::{Gaussians, ImageF32, Lobes, Surface};
use motes_shading::environment::{Environment, EnvironmentMap, MapAxes, MapOptions, irradiance};
use relight::{BakeOptions, QualityOptions, RelightScene, Relighter, SceneError};

/// Texels brighter than this share of the brightest belong to the lamp.
const LAMP_SHARE: f64 = 0.2;
/// And brighter than this many times the mean.
const LAMP_OVER_MEAN: f64 = 12.0;
/// A lamp of less of the light on level ground is not told from the rest.
const LEAST_LAMP: f64 = 0.05;
/// Cells along a side of the patch of ground.
const PATCH_CELLS: usize = 40;

/// The light at a place, in two parts.
#[derive(Clone, Debug)]
pub struct LocalLight {
    /// All but the lamp.
    pub rest: Environment,
    /// The brightest direction, where one stands out.
    pub lamp: Option<Environment>,
    /// Unit, world: toward it.
    pub to_lamp: DVec3,
    /// Irradiance of a level surface that nothing shades, RGB.
    pub level_irradiance: DVec3,
    map: ImageF32,
    lamp_map: ImageF32,
    axes: MapAxes,
}

/// Where light arrives.
#[derive(Clone, Copy, Debug)]
pub struct LightAt {
    /// Base of the asset, world.
    pub base: DVec3,
    /// Unit, away from the ground.
    pub up: DVec3,
}

impl LocalLight {
    /// Parts of a map (linear camera units) with these axes. `None` where the map is black or broken.
    pub fn new(map: &ImageF32, axes: MapAxes, up: DVec3) -> Option<Self> {
        let orientation = axes.orientation();
        let (w, h) = (map.width, map.height);
        let value = |i: usize| Vec3::from_slice(&map.data[3 * i..3 * i + 3]).as_dvec3();
        let world = |i: usize| orientation.world_from_map(texel_direction(i % w, i / w, w, h));
        let omega = |i: usize| texel_solid_angle(i / w, w, h);
        let luminances: Vec<f64> = (0..w * h).map(|i| luminance_f64(value(i))).collect();
        let peak = luminances.iter().copied().fold(0.0, f64::max);
        let mean = (0..w * h).map(|i| luminances[i] * omega(i)).sum::<f64>()
            / (4.0 * std::f64::consts::PI);
        let least = (LAMP_SHARE * peak).max(LAMP_OVER_MEAN * mean);
        let (mut rest, mut lamp) = (map.clone(), ImageF32::filled(w, h, 3, 0.0));
        let (mut toward, mut level, mut of_lamp) = (DVec3::ZERO, 0.0, 0.0);
        for (i, luminance) in luminances.iter().enumerate() {
            let cosine = world(i).dot(up).max(0.0);
            let flux = luminance * omega(i);
            level += flux * cosine;
            if *luminance > least && cosine > 0.0 {
                lamp.data[3 * i..3 * i + 3].copy_from_slice(&map.data[3 * i..3 * i + 3]);
                // What is behind it goes on.
                let ambient = mean as f32;
                rest.data[3 * i..3 * i + 3].fill(ambient.min(least as f32));
                toward += world(i) * flux;
                of_lamp += flux * cosine;
            }
        }
        let has_lamp = of_lamp > LEAST_LAMP * level;
        let of = |image: &ImageF32| environment(image, axes);
        let rest = if has_lamp { of(&rest)? } else { of(map)? };
        let full = of(map)?;
        Some(Self {
            rest,
            lamp: if has_lamp { of(&lamp) } else { None },
            to_lamp: toward.normalize_or(up),
            level_irradiance: irradiance(&full.harmonics(), up),
            map: map.clone(),
            lamp_map: lamp,
            axes,
        })
    }

    /// All of the light, the lamp times `share`.
    pub fn with_lamp(&self, share: f64) -> Option<Environment> {
        let mut map = self.map.clone();
        if self.lamp.is_some() {
            let lost = (1.0 - share) as f32;
            map.data.iter_mut().zip(&self.lamp_map.data).for_each(|(v, l)| *v -= lost * l);
        }
        environment(&map, self.axes)
    }

    /// Where the splat lets the lamp through, in a ball around a point.
    pub fn lamp_shadows(
        &self,
        splat: &estimate_environment::place::Splat<'_>,
        center: DVec3,
        radius: f64,
    ) -> Option<ShadowMap> {
        self.lamp.as_ref()?;
        let region = Region { center, radius };
        Some(ShadowMap::new(splat, &region, self.to_lamp, 10.0 * radius))
    }
}

fn environment(map: &ImageF32, axes: MapAxes) -> Option<Environment> {
    let options = MapOptions { exposure: 1.0, orientation: axes.orientation() };
    let map = EnvironmentMap::new(map, &options).ok()?;
    Some(Environment::new(Some(map), None))
}

/// A level patch of ground around a place, with the base color that shows `radiance` (linear) under the light.
pub fn ground_patch(place: &LightAt, radius: f64, radiance: Vec3, light: &LocalLight) -> Surface {
    let x = place.up.any_orthonormal_vector();
    let y = place.up.cross(x);
    let white = (light.level_irradiance / std::f64::consts::PI).as_vec3();
    let base_color = (radiance / white.max(Vec3::splat(1e-4))).clamp(Vec3::ZERO, Vec3::splat(0.9));
    let mut surface = Surface::default();
    let n = PATCH_CELLS + 1;
    for j in 0..n {
        for i in 0..n {
            let at = |k: usize| (2.0 * k as f64 / PATCH_CELLS as f64 - 1.0) * radius;
            surface.vertices.push((place.base + x * at(i) + y * at(j)).as_vec3().to_array());
            surface.normals.push(place.up.as_vec3().to_array());
            surface.base_color_linear.push(base_color.to_array());
            surface.roughness.push(1.0);
            surface.metallic.push(0.0);
        }
    }
    for j in 0..PATCH_CELLS {
        for i in 0..PATCH_CELLS {
            let a = (j * n + i) as u32;
            let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32);
            surface.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    surface
}

/// Spherical harmonics of an asset with materials (world) under a light, over a patch of ground: `[N, K, 3]` of `degree`, and the
/// degree.
///
/// # Errors
/// When its materials or its surface are broken.
pub fn lit_asset(
    gaussians: &Gaussians,
    surface: &Surface,
    up: DVec3,
    light: &Environment,
    seed: u64,
) -> Result<Gaussians, SceneError> {
    let scene = RelightScene::new(
        gaussians.clone(),
        surface.clone(),
        Lobes::default(),
        true,
        up.as_vec3(),
    )?;
    let options = QualityOptions { caution: 0.0, ..QualityOptions::default() };
    Ok(Relighter::new(&scene, light, &options, seed).bake(&BakeOptions::default()))
}
