//! From light to a picture: background, encoding, the buffers that a compositor wants.

use std::str::FromStr;

use glam::Vec3;
use motes_raster::{RenderOptions, render};
use motes_scene::{ImageF32, ImageU8, Pinhole, Pose};
use motes_shading::environment::Environment;
use rayon::prelude::*;

use crate::deferred::{Lit, Parts};
use crate::g_buffer::{GBuffer, Rays};
use crate::scene::RelightScene;
use crate::view_transform::View;
use motes_math::srgb;

/// What is seen where the scene does not cover a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// Nothing: PNG files have an alpha channel.
    Transparent,
    /// The new light itself.
    #[default]
    Environment,
    /// The Gaussians as they were captured; also where the surface was missed.
    Captured,
    /// A color, sRGB-encoded.
    Color([f32; 3]),
}

impl FromStr for Background {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "transparent" => Self::Transparent,
            "environment" => Self::Environment,
            "captured" => Self::Captured,
            "black" => Self::Color([0.0; 3]),
            "white" => Self::Color([1.0; 3]),
            _ => {
                let parts: Vec<f32> =
                    text.split(',').filter_map(|p| p.trim().parse().ok()).collect();
                match *parts.as_slice() {
                    [r, g, b] if [r, g, b].iter().all(|v| (0.0..=1.0).contains(v)) => {
                        Self::Color([r, g, b])
                    }
                    _ => {
                        return Err("expected transparent, environment, captured, black, white, \
                                    or three numbers r,g,b from 0 to 1"
                            .into());
                    }
                }
            }
        })
    }
}

impl serde::Serialize for Background {
    /// As the flag takes it.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Transparent => serializer.serialize_str("transparent"),
            Self::Environment => serializer.serialize_str("environment"),
            Self::Captured => serializer.serialize_str("captured"),
            Self::Color([r, g, b]) => serializer.collect_str(&format_args!("{r},{g},{b}")),
        }
    }
}

/// A relit view.
#[derive(Clone, Debug)]
pub struct Picture {
    /// `[h, w, 3]`, sRGB-encoded, over the background; `[h, w, 4]` with straight alpha when that is
    /// transparent.
    pub color: ImageU8,
    /// When they were asked for.
    pub components: Option<Components>,
    /// What was counted.
    pub stats: PictureStats,
}

/// What a picture consists of.
#[derive(Clone, Debug)]
pub struct Components {
    /// `[h, w, 3]`, linear photo units, over the background, not clipped.
    pub color_linear: ImageF32,
    /// `[h, w, 1]`: share of the pixel that is scene.
    pub alpha: ImageF32,
    /// Direct light by the diffuse lobe, `[h, w, 3]`, linear, not times alpha; so are the others.
    pub diffuse: ImageF32,
    /// Direct light by the specular lobe.
    pub specular: ImageF32,
    /// Light over other surfaces.
    pub indirect: ImageF32,
    /// `[h, w, 1]`: share of the direct light that is not blocked.
    pub visibility: ImageF32,
    /// Linear.
    pub base_color: ImageF32,
    /// `[h, w, 1]`.
    pub roughness: ImageF32,
    /// `[h, w, 1]`.
    pub metallic: ImageF32,
    /// Unit, world; 0 where nothing is.
    pub normal: ImageF32,
    /// z in the camera, world units; 0 where nothing is.
    pub depth: ImageF32,
}

/// What was counted in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PictureStats {
    /// Root of the mean variance that the samples claim, linear photo units, before filtering.
    pub noise_rms: f64,
    /// Share of the covered area whose material no training view saw.
    pub unobserved_share: f64,
    /// Share of the covered area where the surface was missed and the Gaussians stood in.
    pub missed_share: f64,
    /// Share of the covered area with a channel above 1.
    pub clipped_share: f64,
}

/// How a picture is put together.
pub(crate) struct Composition<'a> {
    pub(crate) scene: &'a RelightScene,
    pub(crate) light: &'a Environment,
    pub(crate) camera: &'a Pinhole,
    pub(crate) camera_from_world: &'a Pose,
    pub(crate) background: Background,
    pub(crate) with_components: bool,
    pub(crate) view: View,
}

pub(crate) fn compose(with: &Composition<'_>, buffer: &GBuffer, lit: &[Lit]) -> Picture {
    let &Composition { scene, light, camera, camera_from_world, background, with_components, view } =
        with;
    let (width, height) = (buffer.width, buffer.height);
    let captured = (background == Background::Captured).then(|| {
        let options = RenderOptions { antialias: scene.antialias, ..RenderOptions::default() };
        render(&scene.gaussians, camera, camera_from_world, &options).color
    });
    let rays = Rays::new(camera, camera_from_world);
    let behind = |i: usize| match background {
        Background::Transparent => Vec3::ZERO,
        Background::Color(c) => Vec3::from(c.map(|v| view.decode(v))),
        Background::Captured => captured.as_ref().map_or(Vec3::ZERO, |image| {
            Vec3::from_slice(&image.data[3 * i..3 * i + 3]).to_array().map(srgb::decode).into()
        }),
        Background::Environment => {
            let (ray, _) = rays.through((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            // What lies behind a thin rim must not outshine it.
            light.radiance_pdf(ray.direction).0.min(Vec3::ONE)
        }
    };
    let pixel = |i: usize| -> (Vec3, f32) {
        let own = lit[i].parts.total();
        let stands_in = buffer.sight[i].is_none_or(|s| !s.on_surface);
        match background {
            Background::Transparent => (own, buffer.coverage[i]),
            // Blended over nothing already.
            Background::Captured if stands_in => (behind(i), buffer.coverage[i]),
            _ if buffer.coverage[i] >= 1.0 => (own, 1.0),
            _ => (behind(i).lerp(own, buffer.coverage[i]), buffer.coverage[i]),
        }
    };
    let pixels: Vec<(Vec3, f32)> = (0..width * height).into_par_iter().map(pixel).collect();
    let transparent = background == Background::Transparent;
    let color: Vec<u8> = pixels
        .par_iter()
        .flat_map_iter(|(c, a)| {
            let alpha = transparent.then(|| (a * 255.0).round() as u8);
            view.encode(*c).map(|v| (v * 255.0).round() as u8).into_iter().chain(alpha)
        })
        .collect();
    let components = with_components.then(|| components(buffer, lit, &pixels));
    Picture {
        color: ImageU8::from_data(width, height, if transparent { 4 } else { 3 }, color),
        components,
        stats: stats(buffer, lit, &pixels),
    }
}

fn components(buffer: &GBuffer, lit: &[Lit], pixels: &[(Vec3, f32)]) -> Components {
    let (width, height) = (buffer.width, buffer.height);
    let rgb = |f: &dyn Fn(usize) -> Vec3| {
        let data = (0..width * height).flat_map(|i| f(i).to_array()).collect();
        ImageF32::from_data(width, height, 3, data)
    };
    let gray = |f: &dyn Fn(usize) -> f32| {
        ImageF32::from_data(width, height, 1, (0..width * height).map(f).collect())
    };
    let parts = |f: &dyn Fn(&Parts) -> Vec3| rgb(&|i| f(&lit[i].parts));
    Components {
        color_linear: rgb(&|i| pixels[i].0),
        alpha: gray(&|i| pixels[i].1),
        diffuse: parts(&|p| p.diffuse),
        specular: parts(&|p| p.specular),
        indirect: parts(&|p| p.indirect),
        visibility: gray(&|i| lit[i].visibility),
        base_color: rgb(&|i| buffer.material[i].base_color_linear),
        roughness: gray(&|i| buffer.material[i].roughness),
        metallic: gray(&|i| buffer.material[i].metallic),
        normal: rgb(&|i| buffer.sight[i].map_or(Vec3::ZERO, |s| s.normal)),
        depth: gray(&|i| buffer.sight[i].map_or(0.0, |s| s.depth)),
    }
}

fn stats(buffer: &GBuffer, lit: &[Lit], pixels: &[(Vec3, f32)]) -> PictureStats {
    let mut area = 0.0;
    let mut sums = [0.0f64; 4];
    for (i, (color, alpha)) in pixels.iter().enumerate() {
        let share = f64::from(*alpha);
        area += share;
        let missed = buffer.sight[i].is_some_and(|s| !s.on_surface);
        sums[0] += share * f64::from(lit[i].variance);
        sums[1] += share * f64::from(buffer.unobserved[i]);
        sums[2] += share * f64::from(u8::from(missed));
        sums[3] += share * f64::from(u8::from(color.max_element() > 1.0));
    }
    let [variance, unobserved_share, missed_share, clipped_share] =
        sums.map(|s| if area > 0.0 { s / area } else { 0.0 });
    PictureStats { noise_rms: variance.sqrt(), unobserved_share, missed_share, clipped_share }
}
