//! How far each Gaussian's place, normal and material are to be trusted.
//!
//! A pixel of a photo speaks for a decomposition as far as three things agree there:
//!
//! ```text
//! t = f(|z_mesh - z_splat| / z, 2 %)      the mesh lies where the Gaussians absorb half of the light
//!     f(angle(n_mesh, n_splat), 40°)      and faces the same way
//!     f(|log photo / model|, 0.7)         and the model shows what the photo shows, averaged over 7 x 7 pixels
//! f(e, s) = 1 / (1 + (e / s)⁴)
//! ```
//!
//! Planes and walls were held against the photos themselves, and without texture the Gaussians on them lie where they like. There a depth
//! may differ by 10 % and normals do not count.
//!
//! Detail of the mesh that the photos deny (module `detail`) counts against a Gaussian, over all photos together: `f(denied, 0.15 rad)`.
//!
//! Gaussians lie behind a mirror, where its images are, so for a metal the model alone speaks: `t = f(|log photo / model|, 0.35)`.
//!
//! A Gaussian's confidence is the mean of `t` over the `n` photos that see it, times `1 - exp(-n / 1.5)` and that: one photo tells nothing
//! about shape, three tell most (0.86).

use motes_math::falloff::quartic_falloff;
use motes_math::luminance::luminance;
use motes_math::sigmoid::sigmoid;
use motes_raster::{RenderOptions, Rendering, render};
use rayon::prelude::*;

use crate::appearance::PixelShading;
use crate::observation::{PixelHit, SeenView};
use crate::report::{Term, numbers};
use crate::state::State;
use glam::Vec3;
use motes_scene::{Surface, photos_share};

use super::Picture;
use super::detail::{self, Detail};

/// Depths differ by that share of the depth where they count half: the surface is refined to well below it where photos
/// agree (docs/benchmarks/surface.md).
const DEPTH_SHARE: f32 = 0.02;
/// The same on planes.
const FLAT_DEPTH_SHARE: f32 = 0.1;
/// Normals of Gaussians are rough themselves.
const NORMAL_RAD: f32 = 0.7;
/// Natural logarithm of luminance: a factor of 2.
const LOG_RATIO: f32 = 0.7;
/// Of a metal, which nothing but this speaks for.
const METAL_LOG_RATIO: f32 = 0.35;
/// Turn of the normals, over three pixels, that the photos deny.
const DENIED_RAD: f32 = 0.15;
/// Linear photo value below which ratios are noise.
pub(super) const BLACK: f32 = 0.02;
/// Half the side of the window that misfits are averaged over, pixels.
const WINDOW: usize = 3;
/// A Gaussian this share of the depth behind what a pixel shows is hidden.
const HIDDEN: f32 = 0.03;
/// Triangles that coverage is measured on, about.
const SAMPLED_TRIANGLES: usize = 100_000;

/// How far two things agree that are `error` apart: 1/2 where it reaches `scale`; not at all where it is NaN.
fn agreement(error: f32, scale: f32) -> f32 {
    quartic_falloff(1.0, error, scale)
}

/// What the photos so far say about a Gaussian.
#[derive(Clone, Copy, Default)]
struct Said {
    /// Sum of what the pixels tell, and their number.
    trust: f32,
    photos: u32,
    detail: Detail,
}

impl Said {
    fn confidence(&self) -> f32 {
        if self.photos == 0 {
            return 0.0;
        }
        let detail = agreement(self.detail.denied_rad(), DENIED_RAD);
        self.trust / self.photos as f32 * photos_share(self.photos) * detail
    }
}

/// What the photos so far say about every Gaussian.
pub(super) struct Confidence(Vec<Said>);

impl Confidence {
    pub(super) fn new(count: usize) -> Self {
        Self(vec![Said::default(); count])
    }

    /// Adds a photo, in whose place the model shows `model`.
    pub(super) fn see(
        &mut self,
        state: &State<'_>,
        view: &SeenView<'_>,
        model: &Picture,
        shading: &PixelShading,
    ) {
        let gaussians = state.gaussians();
        let options = RenderOptions { aovs: true, ..state.inputs.render.clone() };
        let photo = view.photo;
        let drawn = render(gaussians, &photo.camera, &photo.camera_from_world, &options);
        let trust = pixel_trust(state, view, model, &drawn);
        let detail = detail::around(state, view, shading);
        let Some(aovs) = &drawn.aovs else { return };
        let seen = |mean: &[f32; 3]| {
            let (x, y, z) = view.rays.project(Vec3::from(*mean))?;
            let i = view.rays.pixel(x, y)?;
            let front = aovs.depth_median.data[i];
            (front > 0.0 && z <= front * (1.0 + HIDDEN)).then_some(i)
        };
        self.0.par_iter_mut().zip(&gaussians.means).with_min_len(1024).for_each(|(said, mean)| {
            if let Some(i) = seen(mean) {
                said.trust += trust[i];
                said.photos += 1;
                said.detail.add(&detail[i]);
            }
        });
    }

    /// Of every Gaussian, 0 to 1.
    pub(super) fn of_gaussians(self) -> Vec<f32> {
        self.0.iter().map(Said::confidence).collect()
    }
}

/// How far the pixels of a view speak for the decomposition.
fn pixel_trust(
    state: &State<'_>,
    view: &SeenView<'_>,
    model: &Picture,
    drawn: &Rendering,
) -> Vec<f32> {
    let (w, h) = (view.photo.camera.width, view.photo.camera.height);
    let misfit = averaged(&misfits(view, model), w, h, WINDOW);
    let Some(aovs) = &drawn.aovs else { return vec![0.0; w * h] };
    let at = |i: usize| {
        let hit = &view.hits[i];
        if !hit.is_hit() {
            return 0.0;
        }
        let depth = (hit.depth - aovs.depth_median.data[i]).abs() / hit.depth;
        let (x, y) = ((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
        let to_viewer = -view.rays.direction(x, y);
        let scene = &state.observed.scene;
        let (_, normal, _) = scene.frame(hit, to_viewer);
        let metallic = metallic_at(state.surface(), hit);
        let splat = Vec3::from_slice(&aovs.normal_in_world.data[3 * i..3 * i + 3]);
        let turn = normal.dot(splat).clamp(-1.0, 1.0).acos();
        let place = match scene.sheets[hit.triangle as usize] {
            0 => agreement(depth, DEPTH_SHARE) * agreement(turn, NORMAL_RAD),
            _ => agreement(depth, FLAT_DEPTH_SHARE),
        };
        let matter = place * agreement(misfit[i], LOG_RATIO);
        matter + (agreement(misfit[i], METAL_LOG_RATIO) - matter) * metallic
    };
    (0..w * h).into_par_iter().with_min_len(1024).map(at).collect()
}

/// Metallic where a ray meets the surface, 0 to 1.
pub(super) fn metallic_at(surface: &Surface, hit: &PixelHit) -> f32 {
    if surface.metallic.is_empty() {
        return 0.0;
    }
    let [p, q, r] = surface.triangles[hit.triangle as usize].map(|v| surface.metallic[v as usize]);
    let [b, c] = hit.barycentrics();
    (p * (1.0 - b - c) + q * b + r * c).clamp(0.0, 1.0)
}

/// Absolute log ratio of photo and model per pixel; 0 where the photo says nothing.
fn misfits(view: &SeenView<'_>, model: &Picture) -> Vec<f32> {
    let model = model.radiance_linear.data.chunks_exact(3).map(Vec3::from_slice);
    let pixels = view.photo.radiance_linear.pixels().zip(model);
    let log = |v: Vec3| (luminance(v).max(0.0) + BLACK).ln();
    let of = |((p, m), usable): ((Vec3, Vec3), &bool)| {
        if *usable { (log(p) - log(m)).abs() } else { 0.0 }
    };
    pixels.zip(&view.photo.usable).map(of).collect()
}

/// Means over a window, by sums of rows and of columns.
pub(super) fn averaged(values: &[f32], w: usize, h: usize, half: usize) -> Vec<f32> {
    let pass = |from: &[f32], step: usize, of: &(dyn Fn(usize) -> (usize, usize) + Sync)| {
        let mean = |i: usize| {
            let (at, length) = of(i);
            let (a, b) = (at.saturating_sub(half), (at + half + 1).min(length));
            (a..b).map(|k| from[i + k * step - at * step]).sum::<f32>() / (b - a) as f32
        };
        (0..from.len()).into_par_iter().with_min_len(1024).map(mean).collect::<Vec<f32>>()
    };
    pass(&pass(values, 1, &|i| (i % w, w)), w, &|i| (i / w, h))
}

/// Share of the surface's area that at least three photos see, and that any sees, of what `state` has.
fn coverage(state: &State<'_>) -> Option<[f64; 2]> {
    let surface = state.surface();
    let every = surface.triangles.len().div_ceil(SAMPLED_TRIANGLES).max(1);
    let corner = |v: u32| Vec3::from(surface.vertices[v as usize]);
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        let middle = (a + b + c) / 3.0;
        let sees = |view: &&SeenView<'_>| {
            let Some((x, y, z)) = view.rays.project(middle) else { return false };
            let pixel = view.rays.pixel(x, y);
            pixel.is_some_and(|i| z <= view.hits[i].depth * (1.0 + HIDDEN))
        };
        let photos = state.observed.views.iter().filter(sees).take(3).count();
        (f64::from((b - a).cross(c - a).length()), photos)
    };
    let seen: Vec<(f64, usize)> = surface.triangles.par_iter().step_by(every).map(of).collect();
    let area = |least: usize| seen.iter().filter(|s| s.1 >= least).map(|s| s.0).sum::<f64>();
    let all = area(0);
    (all > 0.0).then(|| [3, 1].map(|least| area(least) / all))
}

/// What is known, in words and numbers; `on_surface` is the share of what the Gaussians show in the photos that has a surface.
pub(super) fn term(state: &State<'_>, on_surface: Option<f64>) -> Term {
    let weights = state.gaussians().opacity_logits.iter().map(|&logit| f64::from(sigmoid(logit)));
    let (mut sum, mut total) = (0.0, 0.0);
    for (c, w) in state.confidence.iter().zip(weights) {
        sum += f64::from(*c) * w;
        total += w;
    }
    let mean = (total > 0.0).then(|| sum / total);
    let [three, any] = coverage(state).map_or([None; 2], |shares| shares.map(Some));
    let percent = |share: Option<f64>| share.map_or("-".into(), |s| format!("{:.0} %", 100.0 * s));
    Term {
        name: "confidence".into(),
        kept: true,
        evidence: format!(
            "{} of the surface was seen by three or more photos; mean confidence {}: where it is low, relighting \
             shows the captured colors times a smooth ratio of light",
            percent(three),
            mean.map_or("-".into(), |c| format!("{c:.2}")),
        ),
        numbers: numbers([
            ("mean", mean),
            ("seen_by_three_share", three),
            ("seen_share", any),
            ("on_surface_share", on_surface),
        ]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_is_half_at_its_scale_and_nothing_agrees_with_nan() {
        assert_eq!(agreement(0.0, 0.02), 1.0);
        assert!((agreement(0.02, 0.02) - 0.5).abs() < 1e-6 && agreement(0.1, 0.02) < 0.01);
        assert_eq!(agreement(f32::NAN, 1.0), 0.0);
        assert_eq!(agreement(f32::INFINITY, 1.0), 0.0);
    }

    #[test]
    fn a_window_keeps_the_mean_and_ends_at_the_border() {
        let (w, h) = (9, 8);
        assert!(averaged(&vec![0.3; w * h], w, h, WINDOW).iter().all(|v| (v - 0.3).abs() < 1e-6));
        let mut dot = vec![0.0; w * h];
        dot[4 * w + 4] = 49.0;
        let mean = averaged(&dot, w, h, WINDOW);
        assert!((mean[4 * w + 4] - 1.0).abs() < 1e-6 && mean[0] == 0.0);
        assert!((mean[w + 1] - 49.0 / 25.0).abs() < 1e-5, "{}", mean[w + 1]);
    }
}
