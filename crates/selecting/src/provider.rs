//! Who makes masks from prompts.

use crate::diffusion::{Mark, probabilities};
use crate::index::SceneIndex;
use crate::segment::{Seeds, SegmentOptions, marks, nested_regions, rounds};

/// Masks of all views for a prompt, as shares of superpixels. Another segmenter (a network, say) is another
/// implementation: it sees the views and seeds of the index, and [`SceneIndex::from_pixels`] brings its
/// pictures to superpixels.
pub trait MaskProvider {
    /// Up to `count` nested masks (`[nodes]`, 0 to 1) with scores, the whole object first.
    fn propose(&self, index: &SceneIndex, seeds: &Seeds, count: usize) -> Vec<(Vec<f32>, f32)>;

    /// The mask of an object that is fully outlined in some views, in all views.
    fn spread(&self, index: &SceneIndex, seeds: &Seeds) -> Vec<f32>;
}

/// Graph cuts on colour and rendered geometry; no learned weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct GraphCut {
    /// How hard it tries.
    pub options: SegmentOptions,
}

impl MaskProvider for GraphCut {
    fn propose(&self, index: &SceneIndex, seeds: &Seeds, count: usize) -> Vec<(Vec<f32>, f32)> {
        nested_regions(index, seeds, count)
            .into_iter()
            .map(|(mask, score)| (rounds(index, mask, seeds, &self.options), score))
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
