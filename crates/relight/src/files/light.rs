//! The light that the flags ask for.

use std::path::Path;

use crate::meter;
use crate::{Exposure, Light, LightOptions, LightSource, Place, QualityOptions};
use glam::DVec3;
use motes_formats::environment::read_environment;
use motes_math::luminance::luminance_f64;
use motes_scene::{Pinhole, Pose};
use motes_shading::environment::{CleanUp, MapAxes, irradiance};
use motes_stage::{Context, OrBadInput as _};
use serde::Serialize;

use super::LoadedScene;

/// Bytes of a map per pixel: the picture, radiance with densities, the table of the sampler.
const MAP_BYTES_PER_PIXEL: u64 = 12 + 24;
/// A map is taken to be upside down when the ground's underside gets this many times the light of the ground.
const DARKER_ABOVE: f64 = 1.1;
/// Luminous efficacy that the unit of the sky models is defined with.
const LUMENS_PER_WATT: f64 = 683.0;

/// The light on a scene, which may turn.
pub struct NewLight<'s> {
    source: LightSource,
    options: LightOptions,
    exposure: Exposure,
    loaded: &'s LoadedScene,
    is_own: bool,
    metered_from: Option<&'static str>,
}

/// What fell on the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightReport {
    /// A file, a sun, or the scene's own light.
    pub source: String,
    /// Turned about its up axis by, degrees.
    pub rotate_deg: f64,
    /// Unit vector to its zenith.
    pub zenith_in_world: [f64; 3],
    /// Unit vector to the center of the map, or to azimuth 0 of the sun, after the turn.
    pub center_in_world: [f64; 3],
    /// Factor on the light: photo value of radiance 1.
    pub exposure: f32,
    /// Stops of it that were asked for on top.
    pub exposure_compensation: f64,
    /// EV at ISO 100 of a camera that shows this light so; null for maps, whose unit is not known.
    pub ev100: Option<f64>,
    /// Where the factor comes from.
    pub exposure_from: &'static str,
    /// Values of the map that were below 0 and became 0.
    pub negative_values: usize,
    /// Values that were not numbers and became 0.
    pub nan_values: usize,
    /// Infinite values that became the largest finite one.
    pub infinite_values: usize,
    /// Whether no light is left.
    pub is_black: bool,
}

impl<'s> NewLight<'s> {
    /// Reads what the flags name.
    ///
    /// # Errors
    /// When a map cannot be read.
    pub fn load(
        options: &LightOptions,
        loaded: &'s LoadedScene,
        context: &Context,
    ) -> anyhow::Result<Self> {
        let source = if let Some(sun) = &options.sun {
            LightSource::of_sun(sun, options.sky)
        } else if let Some(path) = &options.environment {
            context.input("environment", path)?;
            let image = read_map(path, context)?;
            let convention = options.env_convention.unwrap_or_default();
            let axes = options.env_up.axes(convention, loaded.scene.up_in_world.as_dvec3());
            LightSource::Map { image, axes }
        } else {
            LightSource::Map { image: loaded.own_light.clone(), axes: loaded.own_axes }
        };
        let default = if options.sun.is_some() { Exposure::Auto } else { Exposure::Factor(1.0) };
        let exposure = options.env_exposure.unwrap_or(default);
        let is_own = options.sun.is_none() && options.environment.is_none();
        let (options, metered_from) = (options.clone(), None);
        Ok(Self { source, options, exposure, loaded, is_own, metered_from })
    }

    /// Sets an automatic exposure by what the pictures of `frames` show with `quality`; without any it stays that of the ground.
    ///
    /// # Errors
    /// When a map or a sky cannot be light.
    pub fn meter(
        &mut self,
        frames: &[(Pinhole, Pose)],
        quality: &QualityOptions,
        seed: u64,
    ) -> anyhow::Result<()> {
        if self.exposure != Exposure::Auto || frames.is_empty() {
            return Ok(());
        }
        let (scene, none) = (&self.loaded.scene, || None);
        let Some(own) = &scene.own_environment else { return Ok(()) };
        let rotate = self.options.env_rotate;
        let light = self.source.light(rotate, Exposure::Factor(1.0), &self.place(), &none);
        let light = light.or_bad_input()?.environment;
        let read = |light| meter::reading(scene, light, frames, quality, seed);
        let readings = [own, &light].map(read);
        if let [Some(own), Some(new)] = readings {
            let up = scene.up_in_world.as_dvec3();
            let lux = LUMENS_PER_WATT * luminance_f64(irradiance(&light.harmonics(), up));
            let ev = self.has_lux().then(|| meter::ev_of_illuminance(lux));
            let factor = meter::exposure(&own, &new, ev) as f32;
            if factor.is_finite() && factor > 0.0 {
                self.exposure = Exposure::Factor(factor);
                self.metered_from = Some(if self.has_lux() {
                    "metered: the pictures as bright as under the scene's own light, darker for light below EV 15, highlights kept"
                } else {
                    "metered: the pictures as bright as under the scene's own light, highlights kept"
                });
            }
        }
        Ok(())
    }

    /// Whether the light is in W / (m² sr), not in the unit of some map.
    fn has_lux(&self) -> bool {
        !matches!(self.source, LightSource::Map { .. })
    }

    /// The light, turned by `further_deg` beyond what the flags say.
    ///
    /// # Errors
    /// When a map or a sky cannot be light.
    pub fn turned(&self, further_deg: f64) -> anyhow::Result<Light> {
        let own = || self.loaded.own_environment();
        let rotate = self.options.env_rotate + further_deg;
        let place = self.place();
        let light = self.source.light(rotate, self.exposure, &place, &own).or_bad_input()?;
        let stops = self.options.exposure_compensation;
        if stops == 0.0 {
            return Ok(light);
        }
        let factor = (f64::from(light.exposure) * stops.exp2()) as f32;
        self.source.light(rotate, Exposure::Factor(factor), &place, &own).or_bad_input()
    }

    fn place(&self) -> Place {
        let up_in_world = self.loaded.scene.up_in_world;
        let zenith = self.options.env_up.zenith(up_in_world.as_dvec3());
        Place { up_in_world, sky_zenith_in_world: zenith.as_vec3() }
    }

    /// Warns of a map that is upside down: what people photograph is brighter above.
    fn check_hemispheres(&self, light: &Light, context: &Context) {
        if self.options.environment.is_none() {
            return;
        }
        let harmonics = light.environment.harmonics();
        let up = self.loaded.scene.up_in_world.as_dvec3();
        let [above, below] = [up, -up].map(|n| luminance_f64(irradiance(&harmonics, n)));
        if below > DARKER_ABOVE * above {
            context.warn(format!(
                "more light comes from below the ground than from above: irradiance {below:.3} and {above:.3}. \
                 If the map is not meant so, its up is another: see --env-convention and --env-up"
            ));
        }
    }

    /// Warns of values that were repaired and of darkness.
    pub fn report(&self, light: &Light, context: &Context) -> LightReport {
        let CleanUp { negative, nan, infinite } = light.clean_up;
        if light.clean_up.any() {
            context.warn(format!(
                "the environment has values that no light has: {negative} negative and {nan} NaN became 0, {infinite} infinite the largest finite value"
            ));
        }
        let is_black = light.environment.is_black();
        if is_black {
            context.warn("the environment is black: everything will be");
        }
        self.check_hemispheres(light, context);
        let orientation = self.source.orientation(&self.place()).rotated(self.options.env_rotate);
        let [zenith_in_world, center_in_world] =
            [DVec3::Y, DVec3::Z].map(|axis| orientation.world_from_map(axis).to_array());
        LightReport {
            source: self.name(),
            rotate_deg: self.options.env_rotate,
            zenith_in_world,
            center_in_world,
            exposure: light.exposure,
            exposure_compensation: self.options.exposure_compensation,
            ev100: self
                .has_lux()
                .then(|| meter::ev_of_white(LUMENS_PER_WATT / f64::from(light.exposure))),
            exposure_from: match (self.metered_from, self.options.env_exposure, self.exposure) {
                (Some(metered), ..) => metered,
                (_, Some(Exposure::Factor(_)), _) => "given",
                (_, _, Exposure::Auto | Exposure::Ground) => {
                    "automatic: a white sheet on the ground is as bright as under the scene's own light"
                }
                _ => "1: the map is taken to be in photo units",
            },
            negative_values: negative,
            nan_values: nan,
            infinite_values: infinite,
            is_black,
        }
    }

    /// The map as it was read and its axes, when it is neither turned nor the sky.
    pub(super) fn unturned_map(&self) -> Option<(&motes_scene::ImageF32, MapAxes)> {
        match &self.source {
            LightSource::Map { image, axes } if self.options.env_rotate == 0.0 => {
                Some((image, *axes))
            }
            _ => None,
        }
    }

    fn name(&self) -> String {
        match (&self.source, &self.options.environment) {
            (LightSource::SunSky { sun, sky }, _) => {
                let with = if *sky { "sun and sky" } else { "sun" };
                let (azimuth, elevation) = (sun.azimuth_deg.round(), sun.elevation_deg);
                let hour = match &self.options.sun {
                    Some(option) if option.with_dome => format!("{}: ", option.text()),
                    _ => String::new(),
                };
                format!(
                    "{hour}{with}, azimuth {azimuth}, elevation {elevation:.1}, turbidity {:.1}",
                    sun.turbidity
                )
            }
            (LightSource::Overcast(sky), _) => {
                format!("overcast sky, {:.0} lx", sky.illuminance_lx)
            }
            (LightSource::Studio(_), _) => "studio: key, fill and back light".into(),
            (_, Some(path)) => path.display().to_string(),
            _ if self.is_own => "the scene's own light".into(),
            _ => String::new(),
        }
    }
}

fn read_map(path: &Path, context: &Context) -> anyhow::Result<motes_scene::ImageF32> {
    let image = read_environment(path)?;
    let bytes = image.pixel_count() as u64 * MAP_BYTES_PER_PIXEL;
    context.need_memory(bytes, "take a smaller environment map")?;
    Ok(image)
}
