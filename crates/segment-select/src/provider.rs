//! Who makes masks from prompts.

use crate::diffusion::{Mark, probabilities};
use crate::index::SceneIndex;
use crate::seeds::{Seeds, marks};
use crate::segment::{SegmentOptions, nested_regions, rounds};

/// Masks of all views for a prompt, as shares of superpixels. Another segmenter (a network, say) is another
/// implementation: it sees the views and seeds of the index, and [`SceneIndex::from_pixels`] brings its
/// pictures to superpixels.
pub trait MaskProvider {
    /// Up to `count` nested masks (`[nodes]`, 0 to 1) with scores, the whole object first.
    fn propose(&self, index: &SceneIndex, seeds: &Seeds, count: usize) -> Vec<(Vec<f32>, f32)>;

    /// The mask of an object that is fully outlined in some views, in all views.
    fn spread(&self, index: &SceneIndex, seeds: &Seeds) -> Vec<f32>;
}

/// Graph cuts on color and rendered geometry; no learned weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct GraphCut {
    /// How hard it tries.
    pub options: SegmentOptions,
}

/// Rounds that leave less than this share of a region have lost it.
const LEAST_LEFT: f32 = 0.3;

fn masked_area(index: &SceneIndex, mask: &[f32]) -> f32 {
    mask.iter().zip(0u32..).filter(|(m, _)| **m > 0.0).map(|(m, n)| m * index.area(n)).sum()
}

impl MaskProvider for GraphCut {
    fn propose(&self, index: &SceneIndex, seeds: &Seeds, count: usize) -> Vec<(Vec<f32>, f32)> {
        nested_regions(index, seeds, count)
            .into_iter()
            .map(|(region, score)| {
                let cut = rounds(index, region.clone(), seeds, &self.options);
                // Where no Gaussian is mostly inside, as deep in a dark hollow, rounds leave next to nothing.
                let lost = masked_area(index, &cut) < LEAST_LEFT * masked_area(index, &region);
                (if lost { region } else { cut }, score)
            })
            .collect()
    }

    fn spread(&self, index: &SceneIndex, seeds: &Seeds) -> Vec<f32> {
        let mut marks = marks(index, seeds);
        // An outline says more than the plane: only what it leaves open is walked through.
        seeds.positive.iter().flatten().for_each(|&n| marks[n as usize] = Mark::Positive);
        let likely = probabilities(&index.graph, &marks);
        let mask = likely.iter().map(|&p| f32::from(u8::from(p > 0.5))).collect();
        rounds(index, mask, seeds, &self.options)
    }
}
