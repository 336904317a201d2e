//! Which Gaussians make up which pixels: sums of contributions per label.
//!
//! `A[label][i] = Σ alpha_i T_i` over the pixels of a label (Shen et al. 2024, "FlashSplat", eq. 4): what a
//! 2D mask says about a Gaussian is linear in these sums, and so is a re-rendered mask. One pass over a
//! finished frame gives all labels, and a mask that is constant per label needs no further pass.

use motes_scene::{Gaussians, Pinhole, Pose};
use rayon::prelude::*;

use crate::frame::Frame;
use crate::options::{Modifiers, RenderOptions};
use crate::parameters::RasterParameters;
use crate::view::ViewTransform;

/// A pixel without a label.
pub const NO_LABEL: u32 = u32::MAX;

/// Labels per task: fixed, so that work splits the same way at any thread count.
const LABELS_PER_TASK: usize = 16;

/// Sparse sums of contributions: label `l` has the entries `offsets[l]..offsets[l + 1]`, ascending
/// in the Gaussian.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelVotes {
    /// `[labels + 1]`
    pub offsets: Vec<u32>,
    /// Gaussian of each entry.
    pub gaussians: Vec<u32>,
    /// `Σ alpha T` of each entry, pixels.
    pub weights: Vec<f32>,
}

impl LabelVotes {
    /// Gaussians of a label and their sums.
    pub fn of(&self, label: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        let range = self.offsets[label] as usize..self.offsets[label + 1] as usize;
        self.gaussians[range.clone()].iter().copied().zip(self.weights[range].iter().copied())
    }
}

/// Sums of contributions per label and Gaussian. `labels` is `[h, w]`: below `label_count`, or
/// [`NO_LABEL`]. Sums below `least` pixels are left out.
///
/// # Panics
/// When the number of labels is not that of the pixels.
pub fn label_votes(
    gaussians: &Gaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    options: &RenderOptions,
    labels: &[u32],
    label_count: usize,
    least: f32,
) -> LabelVotes {
    assert_eq!(labels.len(), camera.width * camera.height, "one label per pixel");
    let view = ViewTransform::new(camera, camera_from_world);
    let mut frame = Frame::new();
    frame.forward(gaussians, &view, &Modifiers::default(), options);

    let mut offsets = vec![0u32; label_count + 2];
    for &label in labels.iter().filter(|&&l| (l as usize) < label_count) {
        offsets[label as usize + 2] += 1;
    }
    for l in 2..offsets.len() {
        offsets[l] += offsets[l - 1];
    }
    let mut pixels = vec![0u32; offsets[label_count + 1] as usize];
    for (pixel, &label) in labels.iter().enumerate().filter(|(_, l)| (**l as usize) < label_count) {
        let slot = &mut offsets[label as usize + 1];
        pixels[*slot as usize] = pixel as u32;
        *slot += 1;
    }
    let of_label = |l: usize| &pixels[offsets[l] as usize..offsets[l + 1] as usize];

    let tasks: Vec<Vec<Vec<(u32, f32)>>> = (0..label_count.div_ceil(LABELS_PER_TASK))
        .into_par_iter()
        .map_init(
            || (vec![0.0f32; gaussians.len()], Vec::new()),
            |(sums, touched), task| {
                let first = task * LABELS_PER_TASK;
                (first..(first + LABELS_PER_TASK).min(label_count))
                    .map(|l| {
                        let size = (camera.width, of_label(l));
                        sum_of_label(&frame, size, &options.parameters, sums, touched, least)
                    })
                    .collect()
            },
        )
        .collect();
    let mut votes = LabelVotes { offsets: vec![0], ..LabelVotes::default() };
    for entries in tasks.iter().flatten() {
        votes.gaussians.extend(entries.iter().map(|e| e.0));
        votes.weights.extend(entries.iter().map(|e| e.1));
        votes.offsets.push(votes.gaussians.len() as u32);
    }
    votes
}

/// Entries of one label. `sums` is zero before and after.
fn sum_of_label(
    frame: &Frame,
    (width, pixels): (usize, &[u32]),
    parameters: &RasterParameters,
    sums: &mut [f32],
    touched: &mut Vec<u32>,
    least: f32,
) -> Vec<(u32, f32)> {
    touched.clear();
    for &pixel in pixels {
        let (x, y) = (pixel as usize % width, pixel as usize / width);
        let Some((row, entries)) = frame.bins().list_at(x, y) else {
            continue;
        };
        let mut transmittance = 1.0f32;
        for &entry in entries {
            let splat = &row.splats[entry as usize];
            let at = (x as f32 + 0.5, y as f32 + 0.5);
            let Some(alpha) = splat.alpha_at(at.0, at.1, parameters.exp_degree.into()) else {
                continue;
            };
            let id = row.ids[entry as usize];
            let sum = &mut sums[id as usize];
            if *sum == 0.0 {
                touched.push(id);
            }
            *sum += alpha * transmittance;
            transmittance -= alpha * transmittance;
            if transmittance < parameters.transmittance_min {
                break;
            }
        }
    }
    touched.sort_unstable();
    touched.dedup();
    let take = |&id: &u32| (id, std::mem::take(&mut sums[id as usize]));
    let entries: Vec<(u32, f32)> = touched.iter().map(take).collect();
    entries.into_iter().filter(|e| e.1 >= least).collect()
}
