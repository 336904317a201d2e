//! One view forward and backward on the tiled path.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

use fearless_simd::dispatch;
use motes_scene::Gaussians;
use rayon::prelude::*;

use crate::backward::MOMENTS;
use crate::binning::{Bins, CHUNK};
use crate::forward::PairCount;
use crate::gradients::GaussianGradients;
use crate::lanes::Padded;
use crate::options::{Modifiers, RenderOptions};
use crate::parameters::{Accumulation, Sorting};
use crate::planes::Planes;
use crate::project::project;
use crate::project_backward::project_backward;
use crate::shade::Shader;
use crate::splat::Splat;
use crate::strip::{Strip, Total, rows_of_strip};
use crate::view::ViewTransform;

/// A clock for the phases: any origin, never backwards.
pub type PhaseClock = fn() -> Duration;

/// Wall time; a profiler may prefer the processor time of the process.
fn wall_clock() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
}

/// Time of the phases (wall time unless [`Frame::clock`] says otherwise) and the work they did.
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
    /// Gaussians on the image.
    pub visible: usize,
    /// Entries of all tile lists.
    pub tile_entries: usize,
    /// (pixel, splat) pairs evaluated; 0 unless counting was asked for.
    pub pairs_visited: u64,
    /// Pairs that changed a pixel; 0 unless counting was asked for.
    pub pairs_composited: u64,
}

/// Buffers and results of rasterizing one view; reused from view to view.
#[derive(Debug)]
pub struct Frame {
    projected: Vec<Splat>,
    bins: Bins,
    image: Option<Planes>,
    /// Per strip of 16 rows: blocks that each entry of its lists reaches.
    masks: Vec<Vec<u16>>,
    /// Per strip; which of the two is used is a parameter.
    moments_f32: Vec<Vec<[f32; MOMENTS]>>,
    moments_f64: Vec<Vec<[f64; MOMENTS]>>,
    view: Option<ViewTransform>,
    /// Times of the last calls.
    pub stats: FrameStats,
    /// Count pairs in the forward pass (costs a few percent).
    pub count_pairs: bool,
    /// What [`Self::stats`] is measured with.
    pub clock: PhaseClock,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            projected: Vec::new(),
            bins: Bins::default(),
            image: None,
            masks: Vec::new(),
            moments_f32: Vec::new(),
            moments_f64: Vec::new(),
            view: None,
            stats: FrameStats::default(),
            count_pairs: false,
            clock: wall_clock,
        }
    }
}

impl Frame {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Renders a view into four planes: color over the background (sRGB-encoded, not clamped
    /// above) and the final transmittance.
    pub fn forward(
        &mut self,
        gaussians: &Gaussians,
        view: &ViewTransform,
        modifiers: &Modifiers<'_>,
        options: &RenderOptions,
    ) -> &Planes {
        let start = (self.clock)();
        let level = options.parameters.level();
        self.projected.resize(gaussians.len(), Splat::INVISIBLE);
        let chunks = self.projected.par_chunks_mut(CHUNK).enumerate();
        chunks.for_each(|(chunk, splats)| {
            let first = chunk * CHUNK;
            dispatch!(level, simd => {
                project(simd, view, gaussians, first, modifiers, options, splats);
            });
        });
        self.stats.project = (self.clock)() - start;

        let start = (self.clock)();
        self.bins.fill(&self.projected, view.size, &options.parameters);
        self.stats.bin = (self.clock)() - start;
        self.stats.visible = self.bins.visible();
        self.stats.tile_entries = self.bins.entries();

        self.view = Some(view.clone());
        self.composite(view.size, options)
    }

    /// Renders the view of the last [`Self::forward`] call again with other colors, without projecting, sorting and
    /// listing the Gaussians again: `color` is asked for those that are on the image and says numbers from 0 on; what is
    /// below 0 or NaN becomes 0. `options` must be those of the forward call; the background may differ.
    ///
    /// # Panics
    /// When there was no forward call.
    pub fn repaint(
        &mut self,
        color: impl Fn(usize) -> [f32; 3] + Sync,
        options: &RenderOptions,
    ) -> &Planes {
        let size = self.view.as_ref().map(|view| view.size);
        assert!(size.is_some(), "repaint needs a forward pass first");
        self.projected.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(i, splat)| {
            if splat.is_visible() {
                splat.color = color(i).map(|v| v.max(0.0));
            }
        });
        self.composite_recolored(size.unwrap_or_default(), options)
    }

    /// As [`Self::repaint`], in the colors of `others`, which differ from the Gaussians of the last
    /// [`Self::forward`] call in nothing else.
    ///
    /// # Panics
    /// When there was no forward call or the number differs.
    pub(crate) fn repaint_as(&mut self, others: &Gaussians, options: &RenderOptions) -> &Planes {
        assert_eq!(others.len(), self.projected.len(), "one color per Gaussian");
        let Some(view) = &self.view else {
            panic!("repaint needs a forward pass first");
        };
        let (size, level) = (view.size, options.parameters.level());
        let shader = Shader::new(view, others, options);
        let chunks = self.projected.par_chunks_mut(CHUNK).enumerate();
        chunks.for_each(|(chunk, splats)| {
            let visible = (0..splats.len()).filter(|&k| splats[k].is_visible());
            let visible = Padded::new(visible.map(|k| k as u32).collect());
            dispatch!(level, simd => {
                let put = |k: usize, color| splats[k].color = color;
                shader.color(simd, chunk * CHUNK, &visible, put);
            });
        });
        self.composite_recolored(size, options)
    }

    /// Takes the colors of the splats over into the lists.
    fn composite_recolored(&mut self, size: [usize; 2], options: &RenderOptions) -> &Planes {
        let projected = &self.projected;
        self.bins.rows.par_iter_mut().for_each(|row| {
            for (splat, &id) in row.splats.iter_mut().zip(&row.ids) {
                splat.color = projected[id as usize].color;
            }
        });
        self.composite(size, options)
    }

    /// The picture of the binned splats.
    fn composite(&mut self, size: [usize; 2], options: &RenderOptions) -> &Planes {
        let start = (self.clock)();
        let [width, height] = size;
        let mut image = self
            .image
            .take()
            .filter(|image| [image.width, image.height] == size)
            .unwrap_or_else(|| Planes::new(width, height, 4));
        let (stride, band_len) = (image.stride, image.band_len());
        let (bins, count_pairs) = (&self.bins, self.count_pairs);
        self.masks.resize_with(image.data.len() / band_len.max(1), Vec::new);
        let strips = image.data.par_chunks_mut(band_len.max(1)).zip(&mut self.masks).enumerate();
        let pairs: Vec<PairCount> = strips
            .with_max_len(1)
            .map(|(y, (rows, masks))| {
                let strip = Strip { bins, options, y, stride };
                match options.parameters.sort {
                    Sorting::Pixel => strip.forward_resorted(rows),
                    Sorting::Global | Sorting::Tile => strip.forward(rows, masks, count_pairs),
                }
            })
            .collect();
        self.stats.pairs_visited = pairs.iter().map(|p| p.visited).sum();
        self.stats.pairs_composited = pairs.iter().map(|p| p.composited).sum();
        self.stats.forward = (self.clock)() - start;
        self.image.insert(image)
    }

    /// Chains a loss gradient through the last [`Self::forward`] call.
    ///
    /// `gradient` has four planes: `dL/d color` and `dL/d transmittance`. The other arguments must be
    /// those of the forward call. Overwrites `out`.
    ///
    /// # Panics
    /// When there was no forward call, the sizes differ, or pixels were sorted one by one.
    pub fn backward(
        &mut self,
        gaussians: &Gaussians,
        modifiers: &Modifiers<'_>,
        options: &RenderOptions,
        gradient: &Planes,
        out: &mut GaussianGradients,
    ) {
        assert!(
            options.parameters.sort != Sorting::Pixel,
            "sorting per pixel is for rendering only"
        );
        assert!(self.view.is_some(), "backward needs a forward pass first");
        match options.parameters.accumulate {
            Accumulation::F32 => {
                let mut moments = std::mem::take(&mut self.moments_f32);
                self.chain(gaussians, modifiers, options, gradient, &mut moments, out);
                self.moments_f32 = moments;
            }
            Accumulation::F64 => {
                let mut moments = std::mem::take(&mut self.moments_f64);
                self.chain(gaussians, modifiers, options, gradient, &mut moments, out);
                self.moments_f64 = moments;
            }
        }
    }

    fn chain<T: Total>(
        &mut self,
        gaussians: &Gaussians,
        modifiers: &Modifiers<'_>,
        options: &RenderOptions,
        gradient: &Planes,
        moments: &mut Vec<Vec<[T; MOMENTS]>>,
        out: &mut GaussianGradients,
    ) {
        let (Some(view), Some(image)) = (&self.view, &self.image) else {
            return;
        };
        assert_eq!(gradient.data.len(), image.data.len(), "gradient size");
        let start = (self.clock)();
        let (stride, band_len) = (image.stride, image.band_len());
        let bins = &self.bins;
        moments.resize_with(image.data.len() / band_len.max(1), Vec::new);
        let strips = moments.par_iter_mut().zip(&self.masks).enumerate().with_max_len(1);
        strips.for_each(|(y, (moments, masks))| {
            let rows = y * band_len..(y + 1) * band_len;
            let strip = Strip { bins, options, y, stride };
            strip.backward(&image.data[rows.clone()], &gradient.data[rows], masks, moments);
        });
        self.stats.backward = (self.clock)() - start;

        let start = (self.clock)();
        let level = options.parameters.level();
        out.resize(gaussians);
        out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, mut rows)| {
            let first = chunk * CHUNK;
            let moments = sum_of_chunk(bins, moments, chunk, rows.len());
            let splats = &self.projected[first..first + moments.len()];
            dispatch!(level, simd => project_backward(
                simd, view, gaussians, first, modifiers, options, splats, &moments, &mut rows,
            ));
        });
        self.stats.project_backward = (self.clock)() - start;
    }

    /// The splats of the last forward call, one per Gaussian.
    pub(crate) fn projected(&self) -> &[Splat] {
        &self.projected
    }

    /// The tile lists of the last forward call.
    pub(crate) fn bins(&self) -> &Bins {
        &self.bins
    }
}

/// Moments of the Gaussians of a chunk over all strips. Strips in order: the sum of every Gaussian
/// has one fixed order.
fn sum_of_chunk<T: Total>(
    bins: &Bins,
    strips: &[Vec<[T; MOMENTS]>],
    chunk: usize,
    count: usize,
) -> Vec<[f32; MOMENTS]> {
    let mut totals = vec![[T::default(); MOMENTS]; count];
    for (y, moments) in strips.iter().enumerate() {
        let mut base = 0;
        for r in rows_of_strip(bins, y) {
            let row = &bins.rows[r];
            let segment = row.segments[chunk] as usize..row.segments[chunk + 1] as usize;
            for (&position, &id) in row.positions[segment].iter().zip(bins.chunks[chunk].row(r)) {
                let total = &mut totals[id as usize - chunk * CHUNK];
                for (total, &moment) in total.iter_mut().zip(&moments[base + position as usize]) {
                    *total += moment;
                }
            }
            base += row.ids.len();
        }
    }
    totals.iter().map(|total| total.map(T::to_f32)).collect()
}
