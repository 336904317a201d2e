//! The light that the flags ask for.

use std::path::Path;

use crate::{Exposure, Light, LightOptions, LightSource};
use motes_formats::environment::read_environment;
use motes_shading::environment::CleanUp;
use motes_stage::{Context, OrBadInput as _};
use serde::Serialize;

use super::LoadedScene;

/// Bytes of a map per pixel: the picture, radiance with densities, the table of the sampler.
const MAP_BYTES_PER_PIXEL: u64 = 12 + 24;

/// The light on a scene, which may turn.
pub struct NewLight<'s> {
    source: LightSource,
    options: LightOptions,
    exposure: Exposure,
    loaded: &'s LoadedScene,
    is_own: bool,
}

/// What fell on the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightReport {
    /// A file, a sun, or the scene's own light.
    pub source: String,
    /// Turned about its up axis by, degrees.
    pub rotate_deg: f64,
    /// Factor on the light: photo value of radiance 1.
    pub exposure: f32,
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
        let source = if let Some(sun) = options.sun {
            LightSource::SunSky { sun: sun.0, sky: options.sky }
        } else if let Some(path) = &options.environment {
            context.input("environment", path)?;
            let image = read_map(path, context)?;
            let convention = options.env_convention.unwrap_or_default();
            LightSource::Map { image, convention }
        } else {
            let image = loaded.own_light.clone();
            LightSource::Map { image, convention: loaded.own_convention }
        };
        let default = if options.sun.is_some() { Exposure::Auto } else { Exposure::Factor(1.0) };
        let exposure = options.env_exposure.unwrap_or(default);
        let is_own = options.sun.is_none() && options.environment.is_none();
        Ok(Self { source, options: options.clone(), exposure, loaded, is_own })
    }

    /// The light, turned by `further_deg` beyond what the flags say.
    ///
    /// # Errors
    /// When a map or a sky cannot be light.
    pub fn turned(&self, further_deg: f64) -> anyhow::Result<Light> {
        let own = || self.loaded.own_environment();
        let rotate = self.options.env_rotate + further_deg;
        let up = self.loaded.scene.up_in_world;
        self.source.light(rotate, self.exposure, up, &own).or_bad_input()
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
        LightReport {
            source: self.name(),
            rotate_deg: self.options.env_rotate,
            exposure: light.exposure,
            exposure_from: match (self.options.env_exposure, self.exposure) {
                (Some(Exposure::Factor(_)), _) => "given",
                (_, Exposure::Auto) => {
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
    pub(super) fn unturned_map(
        &self,
    ) -> Option<(&motes_scene::ImageF32, motes_shading::environment::Convention)> {
        match &self.source {
            LightSource::Map { image, convention } if self.options.env_rotate == 0.0 => {
                Some((image, *convention))
            }
            _ => None,
        }
    }

    fn name(&self) -> String {
        match (&self.source, &self.options.environment) {
            (LightSource::SunSky { sun, sky }, _) => {
                let with = if *sky { "sun and sky" } else { "sun" };
                let (azimuth, elevation) = (sun.azimuth_deg, sun.elevation_deg);
                format!(
                    "{with}, azimuth {azimuth}, elevation {elevation}, turbidity {}",
                    sun.turbidity
                )
            }
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
