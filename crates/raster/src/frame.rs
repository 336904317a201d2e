//! One view forward and backward on the tiled path.

use std::time::{Duration, Instant};

use fearless_simd::dispatch;
use motes_scene::Gaussians;
use rayon::prelude::*;

use crate::backward::{BackwardTile, MOMENTS, backward_tile};
use crate::binning::{Band, bin};
use crate::forward::{ForwardTile, PairCount, forward_tile};
use crate::gradients::GaussianGradients;
use crate::options::{Modifiers, RenderOptions, TILE};
use crate::planes::Planes;
use crate::project::{Splat, ViewTransform, project};
use crate::project_backward::project_backward;
use crate::simd::{TilePlane, level};

/// Gaussians per task: fixed, so that work splits the same way at any thread count.
const CHUNK: usize = 512;

/// Wall-clock time of the phases and, when counted, the work of the kernels.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameStats {
    /// Projecting and shading Gaussians.
    pub project: Duration,
    /// Sorting and listing per tile.
    pub bin: Duration,
    /// Forward tile kernels.
    pub forward: Duration,
    /// Backward tile kernels.
    pub backward: Duration,
    /// Chaining to stored parameters.
    pub project_backward: Duration,
    /// (pixel, splat) pairs evaluated; 0 unless counting was asked for.
    pub pairs_visited: u64,
    /// Pairs that changed a pixel; 0 unless counting was asked for.
    pub pairs_composited: u64,
}

/// Buffers and results of rasterizing one view; reused from view to view.
#[derive(Debug, Default)]
pub struct Frame {
    projected: Vec<Splat>,
    bands: Vec<Band>,
    image: Option<Planes>,
    moments: Vec<[f32; MOMENTS]>,
    view: Option<ViewTransform>,
    /// Times of the last calls.
    pub stats: FrameStats,
    /// Count pairs in the forward pass (costs a few percent).
    pub count_pairs: bool,
}

impl Frame {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Renders a view into four planes: colour over the background (sRGB-encoded, not clamped
    /// above) and the final transmittance.
    pub fn forward(
        &mut self,
        gaussians: &Gaussians,
        view: &ViewTransform,
        modifiers: &Modifiers<'_>,
        options: &RenderOptions,
    ) -> &Planes {
        let start = Instant::now();
        self.projected.resize(gaussians.len(), Splat::INVISIBLE);
        self.projected.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, splats)| {
            for (k, splat) in splats.iter_mut().enumerate() {
                *splat = project(view, gaussians, chunk * CHUNK + k, modifiers, options);
            }
        });
        self.stats.project = start.elapsed();

        let start = Instant::now();
        bin(&self.projected, view.size, &mut self.bands);
        self.stats.bin = start.elapsed();

        let start = Instant::now();
        let [width, height] = view.size;
        let mut image = self
            .image
            .take()
            .filter(|image| [image.width, image.height] == view.size)
            .unwrap_or_else(|| Planes::new(width, height, 4));
        let (stride, band_len) = (image.stride, image.band_len());
        let count_pairs = self.count_pairs;
        let pairs: Vec<PairCount> = image
            .data
            .par_chunks_mut(band_len)
            .zip(&self.bands)
            .enumerate()
            .with_max_len(1)
            .map(|(y, (rows, band))| {
                forward_band(rows, stride, band, y, options.background, count_pairs)
            })
            .collect();
        self.stats.pairs_visited = pairs.iter().map(|p| p.visited).sum();
        self.stats.pairs_composited = pairs.iter().map(|p| p.composited).sum();
        self.stats.forward = start.elapsed();
        self.view = Some(view.clone());
        self.image.insert(image)
    }

    /// Chains a loss gradient through the last [`Self::forward`] call.
    ///
    /// `gradient` has four planes: `dL/d colour` and `dL/d transmittance`. The other arguments must be
    /// those of the forward call. Overwrites `out`.
    ///
    /// # Panics
    /// When there was no forward call or the sizes differ.
    pub fn backward(
        &mut self,
        gaussians: &Gaussians,
        modifiers: &Modifiers<'_>,
        options: &RenderOptions,
        gradient: &Planes,
        out: &mut GaussianGradients,
    ) {
        let (Some(view), Some(image)) = (&self.view, &self.image) else {
            panic!("backward needs a forward pass first");
        };
        assert_eq!(gradient.data.len(), image.data.len(), "gradient size");
        let start = Instant::now();
        let (stride, band_len) = (image.stride, image.band_len());
        self.bands.par_iter_mut().enumerate().with_max_len(1).for_each(|(y, band)| {
            let rows = y * band_len..(y + 1) * band_len;
            backward_band(&image.data[rows.clone()], &gradient.data[rows], stride, band, y);
        });
        self.stats.backward = start.elapsed();

        let start = Instant::now();
        out.reset(gaussians);
        self.moments.clear();
        self.moments.resize(gaussians.len(), [0.0; MOMENTS]);
        // Bands in order: the sum of every Gaussian has one fixed order.
        for band in &self.bands {
            for (&id, moments) in band.ids.iter().zip(&band.moments) {
                for (total, m) in self.moments[id as usize].iter_mut().zip(moments) {
                    *total += m;
                }
            }
        }
        let sh_stride = 3 * gaussians.sh_coefficients() * CHUNK;
        let (projected, moments) = (&self.projected, &self.moments);
        out.means
            .par_chunks_mut(CHUNK)
            .zip(out.rotations.par_chunks_mut(CHUNK))
            .zip(out.log_scales.par_chunks_mut(CHUNK))
            .zip(out.opacity_logits.par_chunks_mut(CHUNK))
            .zip(out.sh.par_chunks_mut(sh_stride))
            .zip(out.center_norm.par_chunks_mut(CHUNK))
            .zip(out.seen.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(
                |(chunk, ((((((means, rotations), scales), opacities), sh), norms), seen))| {
                    let sh_row = sh.len() / means.len();
                    for k in 0..means.len() {
                        let i = chunk * CHUNK + k;
                        if !projected[i].is_visible() {
                            continue;
                        }
                        let sh = &mut sh[k * sh_row..(k + 1) * sh_row];
                        let row = project_backward(
                            view,
                            gaussians,
                            i,
                            modifiers,
                            options,
                            &moments[i],
                            sh,
                        );
                        means[k] = row.mean;
                        rotations[k] = row.rotation;
                        scales[k] = row.log_scale;
                        opacities[k] = row.opacity_logit;
                        norms[k] = row.center_norm;
                        seen[k] = true;
                    }
                },
            );
        self.stats.project_backward = start.elapsed();
    }

    /// The splats of the last forward call, one per Gaussian.
    pub(crate) fn projected(&self) -> &[Splat] {
        &self.projected
    }

    /// The bands of the last forward call.
    pub(crate) fn bands(&self) -> &[Band] {
        &self.bands
    }
}

fn forward_band(
    rows: &mut [f32],
    stride: usize,
    band: &Band,
    y: usize,
    background: [f32; 3],
    count_pairs: bool,
) -> PairCount {
    let mut pairs = PairCount::default();
    let plane = TILE * stride;
    for t in 0..stride / TILE {
        let mut tile = ForwardTile::new();
        let (x0, y0) = ((t * TILE) as f32, (y * TILE) as f32);
        let entries = band.tile(t);
        if count_pairs {
            dispatch!(level(), simd => forward_tile::<_, true>(
                simd, &band.splats, entries, x0, y0, &mut tile, &mut pairs));
        } else {
            dispatch!(level(), simd => forward_tile::<_, false>(
                simd, &band.splats, entries, x0, y0, &mut tile, &mut pairs));
        }
        for (c, color) in tile.color.iter_mut().enumerate() {
            for (value, transmittance) in color.0.iter_mut().zip(&tile.transmittance.0) {
                *value += transmittance * background[c];
            }
            color.store_rows(&mut rows[c * plane..(c + 1) * plane], stride, t * TILE);
        }
        tile.transmittance.store_rows(&mut rows[3 * plane..], stride, t * TILE);
    }
    pairs
}

fn backward_band(image: &[f32], gradient: &[f32], stride: usize, band: &mut Band, y: usize) {
    let mut moments = std::mem::take(&mut band.moments);
    moments.clear();
    moments.resize(band.ids.len(), [0.0; MOMENTS]);
    let plane = TILE * stride;
    let mut color = TilePlane::filled(0.0);
    for t in 0..stride / TILE {
        let entries = band.tile(t);
        if entries.is_empty() {
            continue;
        }
        let mut tile = BackwardTile::new();
        for c in 0..3 {
            let rows = c * plane..(c + 1) * plane;
            tile.gradient[c].load_rows(&gradient[rows.clone()], stride, t * TILE);
            color.load_rows(&image[rows], stride, t * TILE);
            for ((s, g), v) in tile.behind.0.iter_mut().zip(&tile.gradient[c].0).zip(&color.0) {
                *s += g * v;
            }
        }
        // The final transmittance acts like one more colour channel: 0 on every splat, 1 behind.
        let mut d_transmittance = TilePlane::filled(0.0);
        d_transmittance.load_rows(&gradient[3 * plane..], stride, t * TILE);
        color.load_rows(&image[3 * plane..], stride, t * TILE);
        for ((s, g), v) in tile.behind.0.iter_mut().zip(&d_transmittance.0).zip(&color.0) {
            *s += g * v;
        }
        let (x0, y0) = ((t * TILE) as f32, (y * TILE) as f32);
        dispatch!(level(), simd => backward_tile(
            simd, &band.splats, entries, x0, y0, &mut tile, &mut moments));
    }
    band.moments = moments;
}
