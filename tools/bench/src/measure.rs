//! Times of the rasterizer's phases per item they work on.

use std::time::Duration;

use motes_raster::{
    Frame, FrameStats, GaussianGradients, Modifiers, Planes, RasterParameters, RenderOptions,
};
use serde::Serialize;

use crate::clock::process_time;
use crate::scenes::Workload;

/// One workload with one setting of the parameters: means over the views of the fastest repetition.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) workload: String,
    pub(crate) simd: String,
    pub(crate) threads: usize,
    pub(crate) gaussians: usize,
    pub(crate) pixels: f64,
    /// Means per view.
    pub(crate) visible: f64,
    pub(crate) tile_entries: f64,
    pub(crate) pairs_visited: f64,
    pub(crate) pairs_composited: f64,
    /// Processor milliseconds per view.
    pub(crate) project_ms: f64,
    pub(crate) bin_ms: f64,
    pub(crate) forward_ms: f64,
    pub(crate) backward_ms: f64,
    pub(crate) chain_ms: f64,
}

impl Row {
    pub(crate) fn forward_ns_per_pair(&self) -> f64 {
        1e6 * self.forward_ms / self.pairs_visited
    }

    pub(crate) fn backward_ns_per_pair(&self) -> f64 {
        1e6 * self.backward_ms / self.pairs_visited
    }

    /// Everything that a rendering needs, processor milliseconds.
    pub(crate) fn render_ms(&self) -> f64 {
        self.project_ms + self.bin_ms + self.forward_ms
    }

    pub(crate) fn total_ms(&self) -> f64 {
        self.render_ms() + self.backward_ms + self.chain_ms
    }
}

/// Runs all views of a workload `repetitions` times on the current thread pool.
pub(crate) fn run(workload: &Workload, parameters: RasterParameters, repetitions: usize) -> Row {
    let options = RenderOptions { parameters, ..RenderOptions::default() };
    let modifiers = Modifiers::default();
    let mut frame = Frame::new();
    frame.clock = process_time;
    let mut gradients = GaussianGradients::default();
    let count = workload.views.len() as f64;
    let mut row = Row {
        workload: workload.name.clone(),
        simd: format!("{:?}", parameters.simd),
        threads: rayon::current_num_threads(),
        gaussians: workload.gaussians.len(),
        pixels: 0.0,
        visible: 0.0,
        tile_entries: 0.0,
        pairs_visited: 0.0,
        pairs_composited: 0.0,
        project_ms: 0.0,
        bin_ms: 0.0,
        forward_ms: 0.0,
        backward_ms: 0.0,
        chain_ms: 0.0,
    };
    for view in &workload.views {
        frame.count_pairs = true;
        let image = frame.forward(&workload.gaussians, view, &modifiers, &options);
        let gradient = test_gradient(image);
        row.pixels += (view.size[0] * view.size[1]) as f64 / count;
        row.visible += frame.stats.visible as f64 / count;
        row.tile_entries += frame.stats.tile_entries as f64 / count;
        row.pairs_visited += frame.stats.pairs_visited as f64 / count;
        row.pairs_composited += frame.stats.pairs_composited as f64 / count;
        frame.count_pairs = false;
        let mut best: Option<FrameStats> = None;
        for _ in 0..repetitions.max(1) {
            frame.forward(&workload.gaussians, view, &modifiers, &options);
            frame.backward(&workload.gaussians, &modifiers, &options, &gradient, &mut gradients);
            best = Some(best.map_or(frame.stats, |best| fastest(best, frame.stats)));
        }
        if let Some(best) = best {
            let ms = |time: Duration| time.as_secs_f64() * 1e3 / count;
            row.project_ms += ms(best.project);
            row.bin_ms += ms(best.bin);
            row.forward_ms += ms(best.forward);
            row.backward_ms += ms(best.backward);
            row.chain_ms += ms(best.project_backward);
        }
    }
    row
}

/// The shorter time of each phase.
fn fastest(a: FrameStats, b: FrameStats) -> FrameStats {
    FrameStats {
        project: a.project.min(b.project),
        bin: a.bin.min(b.bin),
        forward: a.forward.min(b.forward),
        backward: a.backward.min(b.backward),
        project_backward: a.project_backward.min(b.project_backward),
        ..a
    }
}

/// Some gradient that is nowhere zero: what the loss is does not matter to the time.
fn test_gradient(image: &Planes) -> Planes {
    let mut gradient = image.clone();
    for (i, value) in gradient.data.iter_mut().enumerate() {
        *value = 1e-3 * (0.5 + *value) * if i % 3 == 0 { -1.0 } else { 1.0 };
    }
    gradient
}
