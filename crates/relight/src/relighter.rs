//! A scene under one light.

use glam::Vec3;
use motes_raster::Rendering;
use motes_scene::{Pinhole, Pose};
use motes_shading::brdf::Material;
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use rayon::prelude::*;

use crate::compose::{Background, Composition, Picture, compose};
use crate::deferred::{Lit, Parts, Samples, Shading};
use crate::denoise::{Grid, denoise, luminances};
use crate::g_buffer::{GBuffer, Layers, Sight};
use crate::lamps::{Lights, share_of_lamps, shining, switched_off};
use crate::log_layer;
use crate::options::{QualityOptions, ViewTransform};
use crate::radiance_cache::RadianceCache;
use crate::ratio::{Ratio, RatioOptions, likeness_share};
use crate::residual_share::{apply_residual, likeness, share_under};
use crate::scene::RelightScene;
use crate::sky::Land;
use crate::upsample::{fine_pixel, upsample};

/// Passes of the filter: the last one looks 4 pixels apart, 14 pixels in all.
const FILTER_PASSES: u32 = 3;

/// A scene under one light, ready for pictures.
pub struct Relighter<'a> {
    pub(crate) scene: &'a RelightScene,
    pub(crate) light: &'a Environment,
    /// Lamps that shine.
    pub(crate) lamps: Option<&'a Emitters>,
    /// Of each Gaussian that shows a lamp which shines in the photos and not now, one on that lamp; empty without any.
    pub(crate) off: Vec<Option<u32>>,
    pub(crate) cache: RadianceCache,
    pub(crate) options: QualityOptions,
    pub(crate) seed: u64,
    pub(crate) residual_share: f32,
    /// How much of the scene's local light is part of this light, 0 to 1.
    pub(crate) local_share: f32,
    /// What is shown where the decomposition is not sure; none where the model is shown alone.
    pub(crate) ratio: Option<Ratio>,
    /// What is not sky, where this light has another one than the scene's.
    pub(crate) land: Option<Land>,
    view: ViewTransform,
}

impl<'a> Relighter<'a> {
    /// Computes what the surface sends on under `light`, once for all pictures.
    pub fn new(
        scene: &'a RelightScene,
        light: &'a Environment,
        options: &QualityOptions,
        seed: u64,
    ) -> Self {
        let bounces = options.bounces(scene.indirect);
        let (samples, spacing) = (options.cache_samples(), options.light_spacing());
        let of_environment = likeness(scene, light);
        let lamps = shining(scene, options.lamps, of_environment);
        // What lamps gave is missing without them.
        let alike = match (lamps, &scene.lamps) {
            (None, Some(_)) => of_environment.map(|r| r * (1.0 - share_of_lamps(scene, seed))),
            _ => of_environment,
        };
        let lit = Lights { environment: light, lamps };
        let cache = RadianceCache::new(scene, &lit, bounces, samples, spacing, seed);
        let residual_share = share_under(scene, alike, options.residual);
        let local_share = alike.map_or(0.0, likeness_share);
        let ratio = alike.filter(|_| !options.shows_model_alone());
        let off = switched_off(scene, &lit);
        let ratio_options = RatioOptions {
            caution: options.caution,
            samples: options.samples().0.min(samples),
            samples_of_captured: samples,
            seed,
        };
        let ratio = ratio.and_then(|alike| Ratio::new(scene, &lit, &off, alike, &ratio_options));
        let land = Land::of(scene, 1.0 - of_environment.map_or(0.0, likeness_share));
        let (view, options) = (ViewTransform::default(), options.clone());
        Self {
            scene,
            light,
            lamps,
            off,
            cache,
            options,
            seed,
            residual_share,
            local_share,
            ratio,
            land,
            view,
        }
    }

    /// With another way from linear light to 8-bit pictures.
    pub fn with_view(self, view: ViewTransform) -> Self {
        Self { view, ..self }
    }

    /// How much of the residual counts under this light, 0 to 1; 0 where the scene has none.
    pub fn residual_share(&self) -> f32 {
        self.residual_share
    }

    /// How much of the scene's local light is part of this light, 0 to 1.
    pub fn local_share(&self) -> f32 {
        self.local_share
    }

    /// Whether the sky that the photos show gives way to a background.
    pub fn replaces_sky(&self, background: Background) -> bool {
        self.land_before(background).is_some()
    }

    /// What is drawn before a background that takes the place of the sky.
    fn land_before(&self, background: Background) -> Option<&Land> {
        self.land.as_ref().filter(|_| background != Background::Captured)
    }

    pub(crate) fn shading(&self) -> Shading<'_> {
        Shading {
            scene: self.scene,
            light: self.light,
            lamps: self.lamps,
            cache: &self.cache,
            seed: self.seed,
        }
    }

    /// The picture of a camera, with its components when asked for. The same at any number of threads.
    pub fn picture(
        &self,
        camera: &Pinhole,
        camera_from_world: &Pose,
        background: Background,
        with_components: bool,
    ) -> Picture {
        let every = self.options.shade_every();
        let with_residual = self.residual_share > 0.0;
        let layers = Layers {
            land: self.land_before(background),
            residual: self.scene.residual.as_ref().filter(|_| with_residual),
            ratio: self.ratio.as_ref(),
            local_light: self.scene.local_splats.as_ref().filter(|_| self.local_share > 0.0),
        };
        let buffer = GBuffer::new(self.scene, camera, camera_from_world, every == 1, &layers);
        let mut lit =
            if every == 1 { self.every_pixel(&buffer) } else { self.sparse(&buffer, every) };
        if self.lamps.is_some() {
            add_emission(&buffer, &mut lit);
        }
        self.apply_local_light(&buffer, &mut lit);
        let off = |sight: &Sight| self.is_off(sight);
        apply_residual(&buffer, self.residual_share, off, &mut lit);
        self.apply_ratio(&buffer, &mut lit);
        let (scene, light) = (self.scene, self.light);
        let view = self.view.view(self.scene.tone_curve);
        let with = Composition {
            scene,
            light,
            camera,
            camera_from_world,
            background,
            with_components,
            view,
        };
        compose(&with, &buffer, &lit)
    }

    /// Puts the scene's local light on the light at infinity, as far as this light is the scene's own.
    fn apply_local_light(&self, buffer: &GBuffer, lit: &mut [Lit]) {
        let Some(drawn) = &buffer.local_light else { return };
        lit.par_iter_mut().enumerate().with_min_len(1024).for_each(|(i, lit)| {
            let color = Vec3::from_slice(&drawn.color.data[3 * i..3 * i + 3]);
            let log_factor = log_layer::read(color, drawn.alpha.data[i]) * self.local_share;
            lit.parts = lit.parts.scaled(log_factor.map(f32::exp));
        });
    }

    /// Shows the captured colors times the ratio, as far as the model is not to be trusted.
    fn apply_ratio(&self, buffer: &GBuffer, lit: &mut [Lit]) {
        let (Some(ratio), Some(drawn)) = (&self.ratio, &buffer.ratio) else { return };
        lit.par_iter_mut().enumerate().with_min_len(1024).for_each(|(i, lit)| {
            if buffer.sight[i].is_none() {
                return;
            }
            let alpha = drawn.captured.alpha.data[i];
            let at = |of: &Rendering| Vec3::from_slice(&of.color.data[3 * i..3 * i + 3]);
            let (captured, log_ratio) = (at(&drawn.captured), at(&drawn.log_ratio));
            let shown = ratio.pixel(captured, log_ratio, alpha, buffer.coverage[i]);
            let share = ratio.believed(buffer.model_share(i), lit.parts.total(), shown);
            lit.parts = lit.parts.toward(shown, 1.0 - share);
            lit.variance *= share * share;
        });
    }

    /// Whether a lamp is seen that shines in the photos and not now.
    fn is_off(&self, sight: &Sight) -> bool {
        self.lamps.is_none() && sight.emitted != Vec3::ZERO
    }

    fn samples(&self) -> Samples {
        let (light, brdf) = self.options.samples();
        Samples { light, brdf }
    }

    fn every_pixel(&self, buffer: &GBuffer) -> Vec<Lit> {
        let pixels: Vec<u32> = (0..buffer.sight.len() as u32).collect();
        let lit = self.shading().shade(buffer, self.samples(), &pixels);
        if !(self.options.denoise_strength() > 0.0) {
            return lit;
        }
        let factors: Vec<Parts> = buffer.material.iter().map(Parts::factors).collect();
        let mut grid = Grid {
            width: buffer.width,
            height: buffer.height,
            sight: buffer.sight.clone(),
            roughness: buffer.material.iter().map(|m| m.roughness).collect(),
            lit: lit.iter().zip(&factors).map(demodulate).collect(),
            factors: factors.iter().map(luminances).collect(),
        };
        denoise(&mut grid, self.options.denoise_strength(), FILTER_PASSES);
        grid.lit.iter().zip(&factors).map(modulate).collect()
    }

    /// Shades one of `every` x `every` pixels, filters, and interpolates; pixels whose
    /// surface no shaded neighbor shares are shaded on their own.
    fn sparse(&self, buffer: &GBuffer, every: usize) -> Vec<Lit> {
        let (width, height) = (buffer.width.div_ceil(every), buffer.height.div_ceil(every));
        let fine: Vec<u32> =
            (0..width * height).map(|i| fine_pixel(i, width, every, buffer) as u32).collect();
        let first = self.shading().shade(buffer, self.samples(), &fine);
        let of_fine = |i: &u32| *i as usize;
        let factors: Vec<Parts> =
            fine.iter().map(|i| Parts::factors(&buffer.material[of_fine(i)])).collect();
        let mut grid = Grid {
            width,
            height,
            sight: fine.iter().map(|i| buffer.sight[of_fine(i)]).collect(),
            roughness: fine.iter().map(|i| buffer.material[of_fine(i)].roughness).collect(),
            lit: first.iter().zip(&factors).map(demodulate).collect(),
            factors: factors.iter().map(luminances).collect(),
        };
        denoise(&mut grid, self.options.denoise_strength(), FILTER_PASSES - 1);
        let filled = upsample(&grid, every, buffer);
        let unexplained: Vec<u32> =
            (0..filled.len() as u32).filter(|i| filled[of_fine(i)].is_none()).collect();
        let second = self.shading().shade(buffer, self.samples(), &unexplained);
        let with_texture = |(lit, material): (Option<Lit>, &Material)| {
            lit.map_or_else(Lit::default, |lit| modulate((&lit, &Parts::factors(material))))
        };
        let mut lit: Vec<Lit> = filled
            .into_par_iter()
            .zip(&buffer.material)
            .with_min_len(1024)
            .map(with_texture)
            .collect();
        for (i, own) in unexplained.iter().zip(second) {
            lit[of_fine(i)] = own;
        }
        lit
    }
}

/// Adds what lamps that shine send to the camera; it is no light on matter, and no filter touches it.
fn add_emission(buffer: &GBuffer, lit: &mut [Lit]) {
    for (lit, sight) in lit.iter_mut().zip(&buffer.sight) {
        lit.parts.diffuse += sight.map_or(Vec3::ZERO, |sight| sight.emitted);
    }
}

fn demodulate((lit, factors): (&Lit, &Parts)) -> Lit {
    Lit { parts: lit.parts.over(factors), ..*lit }
}

fn modulate((lit, factors): (&Lit, &Parts)) -> Lit {
    Lit { parts: lit.parts.times(factors), ..*lit }
}
