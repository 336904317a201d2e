//! Who makes masks from prompts.

use motes_formats::selectors::ObjectPrompt;

use crate::error::SelectError;
use crate::index::SceneIndex;
use crate::seeds::{Seeds, feet, marks};
use crate::segment::{SegmentOptions, nested_regions, rounds};
use crate::source::SelectSource;
use crate::walks::{Mark, probabilities};

/// A prompt, and what it is about.
pub struct Asked<'a> {
    /// Gaussians and views.
    pub source: &'a SelectSource<'a>,
    /// The prepared views.
    pub index: &'a SceneIndex,
    /// The prompt in pixels of the views.
    pub prompt: &'a ObjectPrompt,
    /// The prompt in superpixels of all views.
    pub seeds: &'a Seeds,
}

/// Masks of all views for a prompt, as shares of superpixels. Another segmenter is another implementation:
/// [`SceneIndex::from_pixels`] brings its pictures to superpixels.
pub trait MaskProvider: Sync {
    /// Up to `count` nested masks (`[nodes]`, 0 to 1) with scores, the whole object first.
    ///
    /// # Errors
    /// What ends the segmenter.
    fn propose(&self, asked: &Asked<'_>, count: usize)
    -> Result<Vec<(Vec<f32>, f32)>, SelectError>;
}

/// Graph cuts on color and rendered geometry; no learned weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct GraphCut {
    /// How hard it tries.
    pub options: SegmentOptions,
}

/// Rounds that leave less than this share of a region have lost it.
const LEAST_LEFT: f32 = 0.3;

/// Superpixels that the feet of a thing are high, and how much an edge between two parts them: the exponent of a walk.
const FOOT_LAYERS: usize = 2;
const FOOT_HOLD: f32 = 8.0;

/// Adds the feet that are held to a region more than to anything else that stands, those that touch it first.
fn add_feet(index: &SceneIndex, feet: &[u32], marks: &[Mark], region: &mut [f32]) {
    let mut open = vec![false; region.len()];
    feet.iter().for_each(|&n| open[n as usize] = region[n as usize] == 0.0);
    for _ in 0..FOOT_LAYERS {
        let mut held = vec![[0.0f32; 2]; region.len()];
        for (v, view) in index.views.iter().enumerate() {
            let first = index.range(v).start;
            for (border, strength) in view.borders.iter().zip(&index.strengths[v]) {
                let [a, b] = border.segments.map(|s| first + s as usize);
                let hold = border.length_px * (-FOOT_HOLD * strength * strength).exp();
                for (foot, other) in [(a, b), (b, a)] {
                    let stands = region[other] > 0.0 || marks[other] != Mark::Negative;
                    if open[foot] && stands {
                        held[foot][usize::from(region[other] > 0.0)] += hold;
                    }
                }
            }
        }
        for (n, [apart, inside]) in held.into_iter().enumerate() {
            if inside > apart {
                (region[n], open[n]) = (1.0, false);
            }
        }
    }
}

fn masked_area(index: &SceneIndex, mask: &[f32]) -> f32 {
    mask.iter().zip(0u32..).filter(|(m, _)| **m > 0.0).map(|(m, n)| m * index.area(n)).sum()
}

impl MaskProvider for GraphCut {
    fn propose(
        &self,
        asked: &Asked<'_>,
        count: usize,
    ) -> Result<Vec<(Vec<f32>, f32)>, SelectError> {
        let (index, seeds) = (asked.index, asked.seeds);
        let (feet, marks) = (feet(index, seeds), marks(index, seeds));
        let nested = nested_regions(index, seeds, count)
            .into_iter()
            .map(|(mut region, score)| {
                add_feet(index, &feet, &marks, &mut region);
                let cut = rounds(index, &region, seeds, &self.options);
                // Where no Gaussian is mostly inside, as deep in a dark hollow, rounds leave next to nothing.
                let lost = masked_area(index, &cut) < LEAST_LEFT * masked_area(index, &region);
                (if lost { region } else { cut }, score)
            })
            .collect();
        Ok(nested)
    }
}

impl GraphCut {
    /// The mask of an object that is fully outlined in some views, in all views.
    pub(crate) fn spread(&self, index: &SceneIndex, seeds: &Seeds) -> Vec<f32> {
        let mut marks = marks(index, seeds);
        // An outline says more than the plane: only what it leaves open is walked through.
        seeds.positive.iter().flatten().for_each(|&n| marks[n as usize] = Mark::Positive);
        let likely = probabilities(&index.graph, &marks);
        let mask: Vec<f32> = likely.iter().map(|&p| f32::from(u8::from(p > 0.5))).collect();
        rounds(index, &mask, seeds, &self.options)
    }
}
