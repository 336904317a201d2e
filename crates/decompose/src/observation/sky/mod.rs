//! Sky in the photos.
//!
//! What lies behind everything has one color per direction, wherever the camera stands. Bright, even pixels above the horizon where no
//! surface is are taken for a smooth function of the direction, robustly (module `model`). It is the sky where they agree with it, and what
//! hangs together with them without an edge (module `mask`).

mod mask;
mod model;

use glam::Vec3;
use motes_scene::Switch;

use super::samples::SeenView;
use crate::illumination::seen_sky::SkyPixel;
use mask::Pixels;
pub(crate) use mask::Shown;
use model::SkyModel;

/// Least share of a photo that is sky, and number of photos that have it, below which nothing is called sky.
const LEAST_AREA: f64 = 0.005;
const LEAST_PHOTOS: usize = 3;
/// Least share, of the bright pixels above the horizon without a surface, that the model explains.
const LEAST_EXPLAINED: f64 = 0.5;
/// Most of the pixels above the horizon that look like sky, as a share, that may have a surface: a wall has one.
const MOST_SURFACE: f64 = 0.5;
/// Most of the pixels just below the horizon without a surface, as a share, that may have its color: a white sheet has no horizon.
const MOST_BELOW: f64 = 0.5;

/// What was found, or why it is no sky.
#[derive(Clone, Debug, Default)]
pub(crate) struct FoundSky {
    /// Per photo, row by row.
    pub(crate) masks: Vec<Vec<Shown>>,
    /// Share of the photos' pixels.
    pub(crate) area: f64,
    /// Photos of which a notable part is sky.
    pub(crate) photos: usize,
    /// Share of the bright, even pixels above the horizon that one function of the direction explains.
    pub(crate) explained: f64,
    /// Share of what looks like it that has a surface.
    pub(crate) surface: f64,
    /// Share of what has no surface just below the horizon that looks like it.
    pub(crate) below: f64,
}

impl FoundSky {
    /// Whether it is taken for a sky; `On` takes whatever looks like one.
    pub(crate) fn is_kept(&self, wanted: Switch) -> bool {
        match wanted {
            Switch::Off => false,
            Switch::On => self.area > 0.0,
            Switch::Auto => self.is_sky(),
        }
    }

    /// Whether it is a sky.
    pub(crate) fn is_sky(&self) -> bool {
        self.photos >= LEAST_PHOTOS
            && self.explained >= LEAST_EXPLAINED
            && self.surface <= MOST_SURFACE
            && self.below <= MOST_BELOW
    }

    /// The sky's pixels in these photos, every second one along each side.
    pub(crate) fn pixels(&self, views: &[SeenView<'_>]) -> Vec<SkyPixel> {
        let of_view = |(view, mask): (&SeenView<'_>, &Vec<Shown>)| -> Vec<SkyPixel> {
            let (photo, width) = (view.photo, view.photo.camera.width);
            let pixel = |i: usize| {
                let (x, y) = (i % width, i / width);
                if mask[i] != Shown::Sky || x % 2 + y % 2 > 0 {
                    return None;
                }
                Some(SkyPixel {
                    direction: view.rays.direction(x as f32 + 0.5, y as f32 + 0.5),
                    radiance: photo.radiance_linear.at(i),
                    is_clipped: photo.clipped_channels(i),
                })
            };
            (0..mask.len()).filter_map(pixel).collect()
        };
        views.iter().zip(&self.masks).flat_map(of_view).collect()
    }
}

/// Looks for the sky in the photos of a surface; `up` is the unit vector away from the ground.
pub(crate) fn find_sky(views: &[SeenView<'_>], up: Vec3) -> FoundSky {
    let pixels: Vec<Pixels<'_>> = views.iter().map(|view| Pixels::new(view, up)).collect();
    let looks = mask::looks(&pixels);
    let Some(model) = SkyModel::fit(&looks, views.len()) else { return FoundSky::default() };
    let masks: Vec<Vec<Shown>> =
        pixels.iter().enumerate().map(|(k, p)| mask::shown(p, k, &model)).collect();
    let share = |mask: &Vec<Shown>| {
        mask.iter().filter(|m| **m == Shown::Sky).count() as f64 / mask.len().max(1) as f64
    };
    let shares: Vec<f64> = masks.iter().map(share).collect();
    FoundSky {
        area: shares.iter().sum::<f64>() / shares.len().max(1) as f64,
        photos: shares.iter().filter(|s| **s >= LEAST_AREA).count(),
        explained: model.explained,
        surface: mask::share_with_surface(&pixels, &model),
        below: mask::share_below(&pixels, &model),
        masks,
    }
}

#[cfg(test)]
mod tests;
