//! Sun and clear sky from four numbers, so that sunrise, midday and evening need no picture.
//!
//! Sky: Hosek & Wilkie, "An Analytic Model for Full Spectral Sky-Dome Radiance" (2012), the RGB
//! fit, valid for a sun above the horizon. Sun: [`super::sun_spectrum`] in the same unit. Below the
//! horizon a Lambertian ground of the given albedo reflects the irradiance of both.

use glam::{DVec3, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use motes_scene::ImageF32;
use thiserror::Error;

use super::map::row_solid_angle;
use super::sun::SOLAR_RADIUS;
use super::sun_spectrum::sun_radiance;
use super::{EnvironmentError, EnvironmentMap, MapOptions, SunDisc, direction_from_uv};

/// Why there is no such sky.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SkyError {
    /// The model has no night.
    #[error("the sun's elevation must be 0 to 90 degrees, got {0}")]
    Elevation(f64),
    /// Outside of the fit.
    #[error("turbidity must be 1 (pure air) to 10 (haze), got {0}")]
    Turbidity(f64),
    /// Not a reflectance.
    #[error("ground albedo must be 0 to 1, got {0}")]
    GroundAlbedo(f64),
    /// Not a share.
    #[error("the share of forward scattering must be 0 to 1, got {0}")]
    ForwardScatter(f64),
    /// Not a direction.
    #[error("the sun's azimuth must be a finite number of degrees, got {0}")]
    Azimuth(f64),
    /// The map could not be made.
    #[error(transparent)]
    Map(#[from] EnvironmentError),
}

/// A clear sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunSky {
    /// Degrees from the map's center, counter-clockwise seen from above: in Blender's axes from
    /// +x toward +y.
    pub azimuth_deg: f64,
    /// Degrees above the horizon, 0 to 90.
    pub elevation_deg: f64,
    /// 1 pure air, 3 a clear day, 10 haze.
    pub turbidity: f64,
    /// Reflectance of the ground, 0 to 1.
    pub ground_albedo: f64,
    /// Share of the light scattered by haze that goes on within the sun's glow and lights as the sun does, 0 to 1: large particles
    /// scatter forward (delta scaling, Joseph, Wiscombe & Weinman 1976). 0: all of it is lost to the disc.
    pub forward_scatter: f64,
}

/// Turbidity of a clear day, and of the haze through which a low sun is seen.
const CLEAR_TURBIDITY: f64 = 3.0;
const LOW_SUN_TURBIDITY: f64 = 7.0;
/// Degrees of elevation between which one goes over into the other.
const LOW_SUN: (f64, f64) = (6.0, 30.0);
/// Asymmetry 0.9 of the droplets of haze, squared.
const HAZE_FORWARD_SCATTER: f64 = 0.81;

impl Default for SunSky {
    fn default() -> Self {
        Self {
            azimuth_deg: 0.0,
            elevation_deg: 45.0,
            turbidity: CLEAR_TURBIDITY,
            ground_albedo: 0.3,
            forward_scatter: 0.0,
        }
    }
}

impl SunSky {
    /// A sun as it usually looks at this elevation: in clear air by day, through haze when it is low, which makes the light of sun and
    /// sky together warm. Clear air has a bluer dome at sunrise than at noon, and the dome outshines the sun on the ground.
    pub fn usual_at(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let (low, high) = LOW_SUN;
        let share = ((high - elevation_deg) / (high - low)).clamp(0.0, 1.0);
        let turbidity = CLEAR_TURBIDITY + (LOW_SUN_TURBIDITY - CLEAR_TURBIDITY) * share * share;
        let forward_scatter = HAZE_FORWARD_SCATTER;
        Self { azimuth_deg, elevation_deg, turbidity, forward_scatter, ..Self::default() }
    }

    /// The map of the sky without the sun, and the sun, both times the exposure of `options`.
    ///
    /// `height` rows, twice as many columns; 128 hold the sky's slow changes within a percent.
    ///
    /// # Errors
    /// When a number is out of the model's range.
    pub fn build(
        &self,
        height: usize,
        options: &MapOptions,
    ) -> Result<(EnvironmentMap, SunDisc), SkyError> {
        let sky = self.radiance()?;
        let (elevation, albedo) = (self.elevation_deg.to_radians(), self.ground_albedo);
        let sun = sun_radiance(elevation, self.turbidity, self.forward_scatter);

        let width = 2 * height;
        let mut image = ImageF32::filled(width, height, 3, 0.0);
        let mut irradiance = DVec3::ZERO;
        for y in 0..height {
            let solid_angle = row_solid_angle(y, height) / width as f64;
            for x in 0..width {
                let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
                let d = direction_from_uv(u, v);
                if d.y > 0.0 {
                    let radiance = sky.at(d).as_dvec3();
                    irradiance += radiance * (d.y * solid_angle);
                    image.pixel_mut(x, y).copy_from_slice(&radiance.as_vec3().to_array());
                }
            }
        }
        let solid_angle = std::f64::consts::TAU * 2.0 * (0.5 * SOLAR_RADIUS).sin().powi(2);
        irradiance += sun * (solid_angle * elevation.sin());
        let ground = (irradiance * (albedo / std::f64::consts::PI)).as_vec3().to_array();
        for y in height.div_ceil(2)..height {
            for x in 0..width {
                image.pixel_mut(x, y).copy_from_slice(&ground);
            }
        }
        let map = EnvironmentMap::new(&image, options)?;
        let world = options.orientation.world_from_map(sky.to_sun).as_vec3();
        let disc = SunDisc::new(world, SOLAR_RADIUS, sun.as_vec3() * options.exposure);
        Ok((map, disc))
    }

    /// Radiance of the sky without its sun.
    ///
    /// # Errors
    /// When a number is out of its range.
    pub fn radiance(&self) -> Result<SkyRadiance, SkyError> {
        Ok(SkyRadiance { state: self.state()?, to_sun: self.to_sun_in_map() })
    }

    fn to_sun_in_map(self) -> DVec3 {
        let u = (0.5 - self.azimuth_deg / 360.0).rem_euclid(1.0);
        direction_from_uv(u, 0.5 - self.elevation_deg / 180.0)
    }

    fn state(&self) -> Result<SkyState, SkyError> {
        if !(0.0..=90.0).contains(&self.elevation_deg) {
            return Err(SkyError::Elevation(self.elevation_deg));
        }
        if !(1.0..=10.0).contains(&self.turbidity) {
            return Err(SkyError::Turbidity(self.turbidity));
        }
        if !(0.0..=1.0).contains(&self.ground_albedo) {
            return Err(SkyError::GroundAlbedo(self.ground_albedo));
        }
        if !(0.0..=1.0).contains(&self.forward_scatter) {
            return Err(SkyError::ForwardScatter(self.forward_scatter));
        }
        if !self.azimuth_deg.is_finite() {
            return Err(SkyError::Azimuth(self.azimuth_deg));
        }
        let params = SkyParams {
            elevation: (self.elevation_deg.to_radians() as f32).min(std::f32::consts::FRAC_PI_2),
            turbidity: self.turbidity as f32,
            albedo: [self.ground_albedo as f32; 3],
        };
        // Its ranges were checked above.
        SkyState::new(&params).map_err(|_| SkyError::Elevation(self.elevation_deg))
    }
}

/// The sky without its sun: Hosek & Wilkie 2012.
#[derive(Debug)]
pub struct SkyRadiance {
    state: SkyState,
    to_sun: DVec3,
}

impl SkyRadiance {
    /// Linear radiance from a direction, a unit vector of the map's frame (y up) above the horizon.
    pub fn at(&self, d: DVec3) -> Vec3 {
        let theta = d.y.clamp(-1.0, 1.0).acos() as f32;
        // The chord is exact for small angles, where the aureole is.
        let gamma = (2.0 * (0.5 * (d - self.to_sun).length()).min(1.0).asin()) as f32;
        let channel = |c| self.state.radiance(theta, gamma, c);
        // The fit dips below 0 far from a low sun in clear air.
        Vec3::new(channel(Channel::R), channel(Channel::G), channel(Channel::B)).max(Vec3::ZERO)
    }
}
