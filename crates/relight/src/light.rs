//! The new light: a picture or the sky, turned and exposed.

use glam::{DMat3, DVec3, Vec3};
use motes_math::luminance::luminance_f64;
use motes_scene::ImageF32;
use motes_shading::environment::{
    CleanUp, Environment, EnvironmentError, EnvironmentMap, MapAxes, MapOptions, Orientation,
    OvercastSky, SkyError, StudioLight, SunDisc, SunSky, direction_from_uv, irradiance,
};
use thiserror::Error;

use crate::options::Exposure;
use crate::sun::{Sky, SunOption};

/// Rows of the analytic sky: its slow changes are within a percent.
const SKY_ROWS: usize = 128;
/// `axis` is up when its cosine to up is above: then it cannot say where azimuth 0 is.
const NEARLY_UP: f64 = 0.99;

/// Why there is no such light.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LightError {
    /// The picture cannot be used.
    #[error(transparent)]
    Map(#[from] EnvironmentError),
    /// The sky cannot be made.
    #[error(transparent)]
    Sky(#[from] SkyError),
}

/// Where light comes from, before it is turned and exposed.
#[derive(Clone, Debug)]
pub enum LightSource {
    /// A lat-long picture.
    Map {
        /// Linear RGB.
        image: ImageF32,
        /// Its axes.
        axes: MapAxes,
    },
    /// The sun, and the sky round it unless `sky` is false.
    SunSky {
        /// Where the sun is.
        sun: SunSky,
        /// Whether there is a sky.
        sky: bool,
    },
    /// Clouds.
    Overcast(OvercastSky),
    /// Lamps of a studio.
    Studio(StudioLight),
}

/// A light on a scene.
#[derive(Clone, Debug)]
pub struct Light {
    /// In photo units.
    pub environment: Environment,
    /// Factor that was applied: photo value of radiance 1.
    pub exposure: f32,
    /// What the map's values were.
    pub clean_up: CleanUp,
}

/// What a light stands over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Unit normal of the ground.
    pub up_in_world: Vec3,
    /// Unit vector to the zenith of a sky; maps say where theirs is.
    pub sky_zenith_in_world: Vec3,
}

impl Place {
    /// A sky straight over its ground.
    pub fn with_up(up_in_world: Vec3) -> Self {
        Self { up_in_world, sky_zenith_in_world: up_in_world }
    }
}

impl LightSource {
    /// The light of `--sun`; `sky` is whether there is a sky around a sun that was asked for by angles.
    pub fn of_sun(option: &SunOption, sky: bool) -> Self {
        match option.sky {
            Sky::Clear(sun) => Self::SunSky { sun, sky: sky || option.with_dome },
            Sky::Overcast(overcast) => Self::Overcast(overcast),
            Sky::Studio(studio) => Self::Studio(studio),
        }
    }

    /// The axes before any turn.
    pub fn orientation(&self, place: &Place) -> Orientation {
        match self {
            Self::Map { axes, .. } => axes.orientation(),
            Self::SunSky { .. } | Self::Overcast(_) | Self::Studio(_) => {
                sky_orientation(place.sky_zenith_in_world.as_dvec3())
            }
        }
    }

    /// The light turned by `rotate_deg` over a ground at `place`. `Exposure::Ground` makes the
    /// irradiance of a horizontal plane that of `own`, the scene's light; when that is black, a white sheet
    /// gets the value 1.
    ///
    /// # Errors
    /// When a picture or a sky is out of range.
    pub fn light(
        &self,
        rotate_deg: f64,
        exposure: Exposure,
        place: &Place,
        own: &dyn Fn() -> Option<Environment>,
    ) -> Result<Light, LightError> {
        match exposure {
            Exposure::Factor(factor) => self.exposed(rotate_deg, factor, place),
            Exposure::Auto | Exposure::Ground => {
                let plain = self.exposed(rotate_deg, 1.0, place)?;
                let of = |e: &Environment| {
                    let e = irradiance(&e.harmonics(), place.up_in_world.as_dvec3().normalize());
                    luminance_f64(e)
                };
                let wanted = own().map(|e| of(&e)).filter(|e| *e > 0.0);
                let factor = wanted.unwrap_or(std::f64::consts::PI) / of(&plain.environment);
                // Darkness stays dark under any exposure.
                let factor = if factor.is_finite() && factor > 0.0 { factor as f32 } else { 1.0 };
                self.exposed(rotate_deg, factor, place)
            }
        }
    }

    fn exposed(&self, rotate_deg: f64, exposure: f32, place: &Place) -> Result<Light, LightError> {
        let orientation = self.orientation(place).rotated(rotate_deg);
        match self {
            Self::Map { image, .. } => {
                let map = EnvironmentMap::new(image, &MapOptions { exposure, orientation })?;
                let clean_up = map.clean_up();
                Ok(Light { environment: Environment::new(Some(map), None), exposure, clean_up })
            }
            Self::Overcast(overcast) => {
                let map = overcast.build(SKY_ROWS, &MapOptions { exposure, orientation })?;
                let environment = Environment::new(Some(map), None);
                Ok(Light { environment, exposure, clean_up: CleanUp::default() })
            }
            Self::Studio(studio) => {
                let map = studio.build(SKY_ROWS, &MapOptions { exposure, orientation })?;
                let environment = Environment::new(Some(map), None);
                Ok(Light { environment, exposure, clean_up: CleanUp::default() })
            }
            Self::SunSky { sun, sky } => {
                let (map, disc) = sun.build(SKY_ROWS, &MapOptions { exposure, orientation })?;
                let environment = Environment::new(sky.then_some(map), Some(disc));
                Ok(Light { environment, exposure, clean_up: CleanUp::default() })
            }
        }
    }
}

/// Axes of a sky over a ground whose normal is `up`: azimuth 0 is the world's x axis laid on the
/// ground (z where x is up), and it grows counter-clockwise seen from above.
fn sky_orientation(up: DVec3) -> Orientation {
    let up = up.normalize_or(DVec3::Z);
    let axis = if up.x.abs() > NEARLY_UP { DVec3::Z } else { DVec3::X };
    let ahead = (axis - up * axis.dot(up)).normalize();
    let left = up.cross(ahead);
    Orientation { map_from_world: DMat3::from_cols(left, up, ahead).transpose() }
}

/// An environment as a lat-long picture with these axes, `height` rows and twice as many columns. The
/// sun's disc is spread over the pixel it is in, with all its power.
pub fn environment_image(light: &Environment, axes: MapAxes, height: usize) -> ImageF32 {
    let (width, height) = (2 * height.max(1), height.max(1));
    let orientation = axes.orientation();
    let mut image = ImageF32::filled(width, height, 3, 0.0);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
            let world = orientation.world_from_map(direction_from_uv(u, v)).as_vec3();
            let radiance = light.map().map_or(Vec3::ZERO, |map| map.radiance_pdf(world).0);
            image.pixel_mut(x, y).copy_from_slice(&radiance.to_array());
        }
    }
    if let Some(sun) = light.sun() {
        add_sun(&mut image, &orientation, sun);
    }
    image
}

fn add_sun(image: &mut ImageF32, orientation: &Orientation, sun: &SunDisc) {
    use motes_shading::environment::uv_from_direction;
    let (u, v) = uv_from_direction(orientation.map_from_world(sun.to_sun().as_dvec3()).normalize());
    let x = ((u * image.width as f64) as usize).min(image.width - 1);
    let y = ((v * image.height as f64) as usize).min(image.height - 1);
    let edge = |y: usize| (std::f64::consts::PI * y as f64 / image.height as f64).cos();
    let solid_angle = std::f64::consts::TAU * (edge(y) - edge(y + 1)) / image.width as f64;
    let radiance = sun.radiance.as_dvec3() * (sun.solid_angle() / solid_angle);
    for (value, add) in image.pixel_mut(x, y).iter_mut().zip(radiance.to_array()) {
        *value += add as f32;
    }
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;

    fn own() -> Option<Environment> {
        let image = ImageF32::filled(8, 4, 3, 0.3);
        let map = EnvironmentMap::new(&image, &MapOptions::default()).ok()?;
        Some(Environment::new(Some(map), None))
    }

    fn sun(azimuth_deg: f64, elevation_deg: f64) -> LightSource {
        LightSource::SunSky {
            sun: SunSky { azimuth_deg, elevation_deg, ..SunSky::default() },
            sky: true,
        }
    }

    #[test]
    fn an_automatic_exposure_keeps_the_brightness_of_the_ground() {
        for up in [Vec3::Z, Vec3::Y, Vec3::X, -Vec3::Z, Vec3::new(0.6, 0.0, 0.8)] {
            let light =
                sun(40.0, 30.0).light(0.0, Exposure::Auto, &Place::with_up(up), &own).unwrap();
            let got = irradiance(&light.environment.harmonics(), up.as_dvec3());
            let luminance = luminance_f64(got);
            let expected = std::f64::consts::PI * 0.3;
            assert!((luminance / expected - 1.0).abs() < 0.01, "{up}: {luminance} {expected}");
        }
        let light =
            sun(0.0, 30.0).light(0.0, Exposure::Auto, &Place::with_up(Vec3::Z), &|| None).unwrap();
        let got = irradiance(&light.environment.harmonics(), DVec3::Z);
        assert!((luminance_f64(got) / std::f64::consts::PI - 1.0).abs() < 0.01);
    }

    #[test]
    fn azimuth_runs_from_x_counter_clockwise_and_turns_add_to_it() {
        let toward = |azimuth, rotate, up| {
            let light = sun(azimuth, 0.0).light(
                rotate,
                Exposure::Factor(1.0),
                &Place::with_up(up),
                &|| None,
            );
            light.unwrap().environment.sun().unwrap().to_sun()
        };
        assert!(toward(0.0, 0.0, Vec3::Z).distance(Vec3::X) < 1e-5);
        assert!(toward(90.0, 0.0, Vec3::Z).distance(Vec3::Y) < 1e-5);
        assert!(toward(60.0, 30.0, Vec3::Z).distance(Vec3::Y) < 1e-5);
        // Over y, x toward -z is counter-clockwise seen from above.
        assert!(toward(90.0, 0.0, Vec3::Y).distance(-Vec3::Z) < 1e-5);
        assert!(toward(0.0, 0.0, Vec3::X).distance(Vec3::Z) < 1e-5);
    }

    #[test]
    fn a_picture_of_an_environment_has_its_light() {
        let light = sun(200.0, 40.0)
            .light(25.0, Exposure::Factor(0.1), &Place::with_up(Vec3::Z), &own)
            .unwrap();
        let axes = MapAxes::upright(Convention::Blender, DVec3::new(0.3, -0.8, 0.5));
        let image = environment_image(&light.environment, axes, 256);
        let options = MapOptions { exposure: 1.0, orientation: axes.orientation() };
        let again = Environment::new(Some(EnvironmentMap::new(&image, &options).unwrap()), None);
        for normal in [DVec3::Z, DVec3::X, DVec3::NEG_Y] {
            let a = irradiance(&light.environment.harmonics(), normal);
            let b = irradiance(&again.harmonics(), normal);
            assert!((a - b).length() < 0.02 * a.length(), "{a} {b}");
        }
    }
}
