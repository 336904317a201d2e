//! Lights of the made scenes, as lat-long pictures in Blender's axes.

use glam::{DVec3, Vec3};
use motes_scene::ImageF32;
use motes_shading::environment::{
    Convention, Environment, EnvironmentError, EnvironmentMap, MapOptions, Orientation, SkyError,
    SunSky, direction_from_uv,
};

/// Rows of every map.
pub const HEIGHT: usize = 128;
/// The sun in a map: wide enough for its pixels; the real one has 0.27 degrees.
const SUN_RADIUS_DEG: f64 = 2.0;

/// A light by its parts.
#[derive(Clone, Debug)]
pub enum Light {
    /// Clear sky with its sun, scaled to a mean horizontal irradiance.
    Sky {
        /// The model's numbers.
        sky: SunSky,
        /// Mean of R, G and B on a horizontal plane.
        irradiance: f32,
    },
    /// A cloudy dome: brighter at the zenith (CIE standard overcast), tinted.
    Overcast {
        /// Radiance at the zenith.
        zenith: Vec3,
    },
    /// Soft boxes over dim surroundings.
    Boxes {
        /// Radiance of the room.
        room: Vec3,
        /// Azimuth and elevation of the center, half width and half height, degrees; radiance.
        boxes: Vec<([f32; 4], Vec3)>,
    },
}

fn blender() -> MapOptions {
    MapOptions { orientation: Orientation::new(Convention::Blender), ..MapOptions::default() }
}

/// The light of a picture in Blender's axes.
///
/// # Errors
/// When the picture is not a map.
pub fn environment(image: &ImageF32) -> Result<Environment, EnvironmentError> {
    Ok(Environment::new(Some(EnvironmentMap::new(image, &blender())?), None))
}

impl Light {
    /// The map of [`HEIGHT`] rows, linear.
    ///
    /// # Errors
    /// When a number is out of the sky's range.
    pub fn picture(&self) -> Result<ImageF32, SkyError> {
        match self {
            Self::Sky { sky, irradiance } => {
                let (map, disc) = sky.build(HEIGHT, &blender())?;
                let to_sun = disc.to_sun();
                let wide = SUN_RADIUS_DEG.to_radians();
                let share = disc.solid_angle() / (std::f64::consts::TAU * (1.0 - wide.cos()));
                let sun = disc.radiance * share as f32;
                let picture = paint(|d| {
                    let base = map.radiance_pdf(d).0;
                    let angle = f64::from((d - to_sun).length() * 0.5).min(1.0).asin() * 2.0;
                    if angle < wide { base + sun } else { base }
                });
                let mean = horizontal_irradiance(&picture).element_sum() / 3.0;
                Ok(picture.scaled(irradiance / mean))
            }
            Self::Overcast { zenith } => Ok(paint(|d| {
                let below = Vec3::new(0.12, 0.12, 0.11);
                if d.z > 0.0 { *zenith * ((1.0 + 2.0 * d.z) / 3.0) } else { *zenith * below }
            })),
            Self::Boxes { room, boxes } => Ok(paint(|d| {
                let (azimuth, elevation) = (d.y.atan2(d.x).to_degrees(), d.z.asin().to_degrees());
                let dim = *room * (0.6 + 0.4 * d.z);
                boxes.iter().fold(dim, |sum, ([a, e, width, height], radiance)| {
                    let across = (azimuth - a + 540.0).rem_euclid(360.0) - 180.0;
                    let across = across * elevation.to_radians().cos();
                    let inside = across.abs() < *width && (elevation - e).abs() < *height;
                    if inside { sum + *radiance } else { sum }
                })
            })),
        }
    }
}

/// A picture of what `radiance` says, 3 x 3 directions per pixel.
fn paint(radiance: impl Fn(Vec3) -> Vec3) -> ImageF32 {
    let orientation = blender().orientation;
    let width = 2 * HEIGHT;
    let mut image = ImageF32::filled(width, HEIGHT, 3, 0.0);
    for y in 0..HEIGHT {
        for x in 0..width {
            let sum: Vec3 = (0..9)
                .map(|i| {
                    let (dx, dy) = (f64::from(i % 3) + 0.5, f64::from(i / 3) + 0.5);
                    let u = (x as f64 + dx / 3.0) / width as f64;
                    let v = (y as f64 + dy / 3.0) / HEIGHT as f64;
                    radiance(orientation.world_from_map(direction_from_uv(u, v)).as_vec3())
                })
                .sum();
            image.pixel_mut(x, y).copy_from_slice(&(sum / 9.0).to_array());
        }
    }
    image
}

/// Irradiance on a plane that faces +z.
pub fn horizontal_irradiance(picture: &ImageF32) -> Vec3 {
    let (w, h) = (picture.width, picture.height);
    let mut sum = DVec3::ZERO;
    for y in 0..h / 2 {
        let theta = std::f64::consts::PI * (y as f64 + 0.5) / h as f64;
        let weight =
            theta.sin() * theta.cos() * 2.0 * std::f64::consts::PI.powi(2) / (w * h) as f64;
        for x in 0..w {
            sum += Vec3::from_slice(picture.pixel(x, y)).as_dvec3() * weight;
        }
    }
    sum.as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sky_has_the_irradiance_that_was_asked_for_and_its_sun_where_it_should_be() {
        let sky = SunSky { azimuth_deg: 90.0, elevation_deg: 30.0, ..SunSky::default() };
        let picture = Light::Sky { sky, irradiance: 2.0 }.picture().unwrap();
        assert!((horizontal_irradiance(&picture).element_sum() / 3.0 - 2.0).abs() < 1e-3);
        let brightest =
            (0..256 * 128).max_by(|&a, &b| picture.data[3 * a].total_cmp(&picture.data[3 * b]));
        // +y is a quarter from the left, 30 degrees up is a third from the top; the disc is wide.
        let (x, y) = (brightest.unwrap() % 256, brightest.unwrap() / 256);
        assert!(x.abs_diff(64) < 4 && y.abs_diff(42) < 4, "{x} {y}");
    }
}
