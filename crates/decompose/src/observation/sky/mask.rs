//! Pixels of the photos as the sky is looked for in them.

use glam::Vec3;
use motes_math::luminance::luminance;
use motes_math::median::quantile;
use rayon::prelude::*;

use super::model::{Look, SkyModel};
use crate::observation::samples::SeenView;

/// Least sine of the elevation of the sky.
const HORIZON: f32 = 0.0;
/// How far below it is just below it, the sine.
const BELOW: f32 = 0.2;
/// Added to radiances before their logarithm.
const BLACK: f32 = 0.01;
/// Quantile of the luminance of all photos below which nothing starts a sky.
const BRIGHT: f32 = 0.6;
/// Largest difference of the log luminance around a pixel that starts a sky, and how far around is, as a share of the width.
const EVEN: f32 = 0.15;
const AROUND: f32 = 1.0 / 160.0;
/// Largest step of a channel, natural logarithm, from a pixel of the sky to the next.
const STEP: f32 = 0.12;
/// Pixels that are looked at for the model, over all photos, about.
const LOOKED_AT: usize = 400_000;

/// A photo with what is asked of its pixels.
pub(super) struct Pixels<'a> {
    view: &'a SeenView<'a>,
    width: usize,
    height: usize,
    /// East, north and up, in world.
    axes: [Vec3; 3],
}

impl<'a> Pixels<'a> {
    pub(super) fn new(view: &'a SeenView<'a>, up: Vec3) -> Self {
        let (width, height) = (view.photo.camera.width, view.photo.camera.height);
        let (east, north) = up.any_orthonormal_pair();
        Self { view, width, height, axes: [east, north, up] }
    }

    fn log(&self, i: usize) -> Vec3 {
        (self.view.photo.radiance_linear.at(i).max(Vec3::ZERO) + BLACK).map(f32::ln)
    }

    fn look(&self, photo: usize, i: usize) -> Look {
        let (x, y) = ((i % self.width) as f32 + 0.5, (i / self.width) as f32 + 0.5);
        let d = self.view.rays.direction(x, y);
        let direction = Vec3::from(self.axes.map(|axis| axis.dot(d)));
        Look { photo: photo as u32, direction, log: self.log(i) }
    }

    /// Whether a pixel lies above the horizon and has the color of the sky.
    fn is_like(&self, photo: usize, i: usize, model: &SkyModel) -> bool {
        let look = self.look(photo, i);
        look.direction.z > HORIZON && model.agrees(&look)
    }

    fn has_surface(&self, i: usize) -> bool {
        self.view.hits[i].is_hit()
    }

    /// Whether nothing around a pixel is much brighter or darker.
    fn is_even(&self, i: usize) -> bool {
        let reach = ((AROUND * self.width as f32).round() as usize).max(1);
        let (x, y) = (i % self.width, i / self.width);
        let [columns, rows] = [(x, self.width), (y, self.height)]
            .map(|(at, end)| [at.saturating_sub(reach), at, (at + reach).min(end - 1)]);
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for row in rows {
            for column in columns {
                let v = (brightness(self, row * self.width + column) + BLACK).ln();
                (low, high) = (low.min(v), high.max(v));
            }
        }
        high - low < EVEN
    }

    fn len(&self) -> usize {
        self.width * self.height
    }
}

fn brightness(pixels: &Pixels<'_>, i: usize) -> f32 {
    luminance(pixels.view.photo.radiance_linear.at(i)).max(0.0)
}

/// Pixels between those that are looked at, in both directions.
fn every(pixels: &[Pixels<'_>]) -> usize {
    let all: usize = pixels.iter().map(Pixels::len).sum();
    ((all as f64 / LOOKED_AT as f64).sqrt().ceil() as usize).max(1)
}

/// Of every pixel on a grid, by photo, what `of` says of it.
fn on_grid<T: Send>(
    pixels: &[Pixels<'_>],
    of: impl Fn(usize, usize) -> Option<T> + Sync,
) -> Vec<T> {
    let every = every(pixels);
    let rows: Vec<(usize, usize)> = pixels
        .iter()
        .enumerate()
        .flat_map(|(k, p)| (0..p.height).step_by(every).map(move |y| (k, y)))
        .collect();
    let of_row = |(k, y): (usize, usize)| -> Vec<T> {
        let width = pixels[k].width;
        (0..width).step_by(every).filter_map(|x| of(k, y * width + x)).collect()
    };
    let found: Vec<Vec<T>> = rows.into_par_iter().map(of_row).collect();
    found.into_iter().flatten().collect()
}

/// Bright, even pixels above the horizon without a surface.
pub(super) fn looks(pixels: &[Pixels<'_>]) -> Vec<Look> {
    let mut all = on_grid(pixels, |k, i| Some(brightness(&pixels[k], i)));
    let bright = quantile(&mut all, BRIGHT).unwrap_or(f32::INFINITY);
    on_grid(pixels, |k, i| {
        let p = &pixels[k];
        if !p.view.photo.is_seen(i) || p.has_surface(i) || brightness(p, i) < bright {
            return None;
        }
        let look = p.look(k, i);
        (look.direction.z > HORIZON && p.is_even(i)).then_some(look)
    })
}

/// Share of the pixels above the horizon that have the color of the sky which has a surface.
pub(super) fn share_with_surface(pixels: &[Pixels<'_>], model: &SkyModel) -> f64 {
    share(&on_grid(pixels, |k, i| {
        let p = &pixels[k];
        (p.view.photo.is_seen(i) && p.is_like(k, i, model)).then(|| p.has_surface(i))
    }))
}

/// Share of the pixels just below the horizon without a surface that has the color of the sky.
pub(super) fn share_below(pixels: &[Pixels<'_>], model: &SkyModel) -> f64 {
    share(&on_grid(pixels, |k, i| {
        let p = &pixels[k];
        let look = p.look(k, i);
        let is_below = look.direction.z < HORIZON && look.direction.z > HORIZON - BELOW;
        (is_below && p.view.photo.is_seen(i) && !p.has_surface(i)).then(|| model.agrees(&look))
    }))
}

fn share(all: &[bool]) -> f64 {
    all.iter().filter(|v| **v).count() as f64 / all.len().max(1) as f64
}

/// What a pixel of a photo shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Something that is not sky.
    Land,
    /// The sky.
    Sky,
    /// The color of the sky where the surface is: sky between leaves, or something pale. Or nothing that is known: a mask hides it.
    Unknown,
}

/// What a photo shows: sky are pixels above the horizon without a surface that have its color, and what is joined to them by small steps.
pub(super) fn shown(pixels: &Pixels<'_>, photo: usize, model: &SkyModel) -> Vec<Shown> {
    let range = (0..pixels.len()).into_par_iter().with_min_len(1024);
    let like: Vec<bool> = range.map(|i| pixels.is_like(photo, i, model)).collect();
    let sky = grown(pixels, photo, &like);
    let of = |i: usize| match (sky[i], pixels.view.photo.usable[i]) {
        (true, _) => Shown::Sky,
        (false, true) if !like[i] => Shown::Land,
        _ => Shown::Unknown,
    };
    (0..pixels.len()).map(of).collect()
}

/// The sky of a photo, from the pixels that are `like` it.
fn grown(pixels: &Pixels<'_>, photo: usize, like: &[bool]) -> Vec<bool> {
    let may_be = |i: usize| pixels.view.photo.is_seen(i) && !pixels.has_surface(i);
    let mut mask: Vec<bool> = (0..pixels.len()).map(|i| like[i] && may_be(i)).collect();
    let mut open: Vec<usize> = (0..mask.len()).filter(|&i| mask[i]).collect();
    while let Some(i) = open.pop() {
        let own = pixels.log(i);
        for j in beside(i, pixels.width, pixels.height) {
            if mask[j] || !may_be(j) || !(pixels.look(photo, j).direction.z > HORIZON) {
                continue;
            }
            if (pixels.log(j) - own).abs().max_element() < STEP {
                mask[j] = true;
                open.push(j);
            }
        }
    }
    mask
}

fn beside(i: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    [
        (x > 0).then(|| i - 1),
        (x + 1 < width).then_some(i + 1),
        (y > 0).then(|| i - width),
        (y + 1 < height).then_some(i + width),
    ]
    .into_iter()
    .flatten()
}
