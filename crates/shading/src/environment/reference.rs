//! Look-up and sampling of an environment in f64: the definition that the f32 path is tested
//! against. Same texels, same choice of texel, everything after that in f64.

use std::f64::consts::PI;

use glam::{DVec3, DVec4};

use super::{Environment, EnvironmentMap, SunDisc, direction_from_uv, uv_from_direction};
use crate::sampling::unit_f64;

/// A direction toward the light, as [`super::LightSample`].
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector toward the light, world.
    pub to_light: DVec3,
    /// Radiance of everything in that direction.
    pub radiance: DVec3,
    /// Density per steradian over all lights.
    pub pdf: f64,
}

/// Radiance and density over the unit square at `(u, v)`: bilinear, wrapped in u, clamped in v.
pub fn bilinear(map: &EnvironmentMap, u: f64, v: f64) -> DVec4 {
    let (w, h) = (map.width as i64, map.height as i64);
    let (x, y) = (u * w as f64 - 0.5, v * h as f64 - 0.5);
    let (s, t) = (x - x.floor(), y - y.floor());
    let texel = |dx: i64, dy: i64| {
        let column = (x.floor() as i64 + dx).rem_euclid(w);
        let row = (y.floor() as i64 + dy).clamp(0, h - 1);
        map.texels[(row * w + column) as usize].as_dvec4()
    };
    (texel(0, 0) * (1.0 - s) + texel(1, 0) * s) * (1.0 - t)
        + (texel(0, 1) * (1.0 - s) + texel(1, 1) * s) * t
}

/// Radiance from a map, and the density of its sampler per steradian.
pub fn map_radiance_pdf(map: &EnvironmentMap, to_light: DVec3) -> (DVec3, f64) {
    let d = map.orientation.map_from_world(to_light);
    let (u, v) = uv_from_direction(d);
    let texel = bilinear(map, u, v);
    (texel.truncate(), texel.w / (2.0 * PI * PI * d.x.hypot(d.z).max(1e-12)))
}

/// Radiance from all lights, and the density of [`sample`] per steradian.
pub fn radiance_pdf(environment: &Environment, to_light: DVec3) -> (DVec3, f64) {
    let p_sun = f64::from(environment.sun_probability());
    let (mut radiance, mut pdf) =
        environment.map().map_or((DVec3::ZERO, 0.0), |m| map_radiance_pdf(m, to_light));
    pdf *= 1.0 - p_sun;
    if let Some(sun) = environment.sun().filter(|sun| sun_contains(sun, to_light)) {
        radiance += sun.radiance.as_dvec3();
        pdf += p_sun / sun.solid_angle();
    }
    (radiance, pdf)
}

fn sun_contains(sun: &SunDisc, to_light: DVec3) -> bool {
    (to_light - sun.to_sun().as_dvec3()).length_squared() <= 2.0 * sun.one_minus_cos()
}

/// A direction toward the light; `u` are fractions of 2³². None when all is black.
pub fn sample(environment: &Environment, u: [u32; 3]) -> Option<LightSample> {
    let p_sun = f64::from(environment.sun_probability());
    let pick = unit_f64(u[0]);
    let (su, sv) = (unit_f64(u[1]), unit_f64(u[2]));
    let to_light = if pick < p_sun {
        environment.sun()?.sample_f64(su, sv)
    } else {
        let map = environment.map()?;
        let rest = (pick - p_sun) / (1.0 - p_sun) * 4_294_967_296.0;
        let texel = map.alias.as_ref()?.pick(rest as u32);
        let (x, y) = (texel % map.width, texel / map.width);
        let tent =
            |u: f64| if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() };
        // Clamped rows: the outer half of the tent's mass is flat over half a row.
        let flat = (sv < 0.5 && y == 0) || (sv >= 0.5 && y == map.height - 1);
        let dv = if flat { sv } else { 0.5 + tent(sv) };
        let uv =
            ((x as f64 + 0.5 + tent(su)) / map.width as f64, (y as f64 + dv) / map.height as f64);
        map.orientation.world_from_map(direction_from_uv(uv.0, uv.1))
    };
    let (radiance, pdf) = radiance_pdf(environment, to_light);
    (pdf > 0.0).then_some(LightSample { to_light, radiance, pdf })
}
