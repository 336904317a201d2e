//! Masks of any 2D segmenter, lifted: an exact vote where they are, the graph cut elsewhere.

use motes_formats::selectors::MaskPrompt;
use motes_raster::label_votes;
use motes_scene::{Pose, Selection};

use crate::error::SelectError;
use crate::index::SceneIndex;
use crate::lift::{lift_masks, remapped};
use crate::prompt::Place;
use crate::provider::GraphCut;
use crate::seeds::Seeds;
use crate::source::SelectSource;

/// Gray values are labels of the vote.
const GRAYS: usize = 256;

/// A mask at its own size.
pub(crate) struct Mask {
    pub(crate) camera: motes_scene::Pinhole,
    pub(crate) pose: Pose,
    pub(crate) labels: Vec<u32>,
}

/// What masks of views select. Gaussians that the masked views show are decided by their vote; the
/// others by the masks that the graph cut makes of the other views, starting from these.
pub(crate) fn lift(
    source: &SelectSource<'_>,
    prompts: &[MaskPrompt],
) -> Result<Selection, SelectError> {
    let masks: Result<Vec<Mask>, _> = prompts.iter().map(|p| source.mask(p)).collect();
    let masks = masks?;
    let index = source.index()?;
    let n = source.gaussians.len();
    let (mut inside, mut all) = (vec![0.0f32; n], vec![0.0f32; n]);
    let mut seeds = Seeds::default();
    for (mask, prompt) in masks.iter().zip(prompts) {
        let votes = label_votes(
            source.gaussians,
            &mask.camera,
            &mask.pose,
            &source.options,
            &mask.labels,
            GRAYS,
            0.0,
        );
        for gray in 0..GRAYS {
            for (i, w) in votes.of(gray) {
                inside[i as usize] += w * gray as f32 / (GRAYS - 1) as f32;
                all[i as usize] += w;
            }
        }
        add_seeds(source, index, mask, prompt, &mut seeds)?;
    }
    if seeds.positive.is_empty() {
        return Err(SelectError::BadValue("the masks are empty: nothing in them is white".into()));
    }
    let spread = GraphCut::default().spread(index, &seeds);
    let lifted = lift_masks(index, &spread);
    let own = |i: usize| inside[i] / all[i];
    let confidence = (0..n)
        .map(|i| {
            // Where both speak, each has the weight of its pixels.
            let (a, b) = (all[i], (index.totals[i] - all[i]).max(0.0));
            let other = lifted.selection.confidence[i];
            match a > 0.0 {
                true => {
                    (remapped(own(i), 0.5) * a * masks.len() as f32 + other * b)
                        / (a * masks.len() as f32 + b)
                }
                false => other,
            }
        })
        .collect();
    Ok(Selection { confidence })
}

/// Superpixels that a mask covers or leaves free.
fn add_seeds(
    source: &SelectSource<'_>,
    index: &SceneIndex,
    mask: &Mask,
    prompt: &MaskPrompt,
    seeds: &mut Seeds,
) -> Result<(), SelectError> {
    let place = Place::of(source, index, &prompt.view)?;
    let data = place.data();
    let mut sums = vec![(0.0f32, 0.0f32); data.segments.len()];
    let [w, h] = [data.camera.width, data.camera.height];
    for (p, &segment) in data.labels.iter().enumerate() {
        let (x, y) = (p % w * mask.camera.width / w, p / w * mask.camera.height / h);
        let sum = &mut sums[segment as usize];
        sum.0 += mask.labels[y * mask.camera.width + x] as f32 / (GRAYS - 1) as f32;
        sum.1 += 1.0;
    }
    for (s, (inside, all)) in sums.into_iter().enumerate() {
        let share = inside / all;
        if share > 0.9 {
            seeds.positive.push(place.nodes_of(s as u32));
        } else if share < 0.1 {
            seeds.negative.push(place.nodes_of(s as u32));
        }
    }
    seeds.positive.retain(|nodes| !nodes.is_empty());
    Ok(())
}
