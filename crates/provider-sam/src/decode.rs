//! One prompt to candidates.

use motes_formats::tensors::TensorData;

use crate::masks::stability;
use crate::model::Model;
use crate::prompt::{Abilities, Prompt};
use crate::{Frame, SamError};

/// A mask that the prompt can mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Logits per pixel of the picture; the mask is where they are above 0.
    pub logits: Vec<f32>,
    /// Logits of the decoder over its square.
    pub grid: Vec<f32>,
    /// What the model expects of its intersection over union with the truth, 0 to 1.
    pub predicted_iou: f64,
    /// As [`stability`].
    pub stability: f64,
}

/// The candidates of a prompt.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// From the largest to the smallest.
    pub candidates: Vec<Candidate>,
    /// The one with the best expectation.
    pub best: usize,
    /// Columns and rows of the decoder's grid.
    pub grid: (usize, usize),
}

impl Model {
    pub(crate) fn abilities(&self) -> Abilities {
        let inputs = self.decoder.input_names();
        let has = |name: &str| inputs.iter().any(|input| input == name);
        Abilities {
            takes_boxes: has("input_boxes"),
            takes_masks: has("mask_input") && has("has_mask_input"),
        }
    }

    /// Runs the decoder on what [`Self::embed`] made and chooses at most `count` candidates. A prompt that is clear has one answer,
    /// the decoder's mask for such; otherwise the three that it keeps for the object, a part and a part of that, the likeliest
    /// where fewer are wanted.
    pub(crate) fn decode(
        &self,
        embeddings: &[(String, TensorData)],
        prompt: &Prompt,
        frame: &Frame,
        count: usize,
    ) -> Result<Chosen, SamError> {
        let [points, labels, scores, masks, other_masks] = self.convention.names();
        let n = prompt.points.len();
        let flat: Vec<f32> = prompt.points.iter().flatten().copied().collect();
        let js = self.convention.is_of_transformers();
        let shape = |more: &[usize]| match js {
            true => [&[1, 1, n], more].concat(),
            false => [&[1, n], more].concat(),
        };
        let mut inputs: Vec<(&str, TensorData)> = vec![
            (points, TensorData::F32(shape(&[2]), flat)),
            (labels, TensorData::F32(shape(&[]), prompt.labels.clone())),
        ];
        inputs.extend(embeddings.iter().map(|(name, tensor)| (name.as_str(), tensor.clone())));
        let names = self.decoder.input_names();
        let has = |name: &str| names.iter().any(|input| input == name);
        if has("input_boxes") {
            let values = prompt.around.map_or(Vec::new(), Vec::from);
            inputs.push(("input_boxes", TensorData::F32(vec![1, values.len() / 4, 4], values)));
        }
        if has("orig_im_size") {
            let size = vec![frame.size.1 as f32, frame.size.0 as f32];
            inputs.push(("orig_im_size", TensorData::F32(vec![2], size)));
        }
        if self.abilities().takes_masks {
            let cells = self.side / 4;
            let (given, values) = match &prompt.logits {
                Some((size, logits)) => (1.0, frame.padded(logits, *size, (cells, cells))),
                None => (0.0, vec![0.0; cells * cells]),
            };
            inputs.push(("mask_input", TensorData::F32(vec![1, 1, cells, cells], values)));
            inputs.push(("has_mask_input", TensorData::F32(vec![1], vec![given])));
        }
        let made = self.decoder.output_names();
        let masks = if made.iter().any(|m| m == masks) { masks } else { other_masks };
        let found = self.decoder.run(&inputs, &[masks, scores])?;
        self.choose(&found[0], &found[1], prompt.is_clear, frame, count)
    }

    fn choose(
        &self,
        masks: &TensorData,
        scores: &TensorData,
        is_clear: bool,
        frame: &Frame,
        count: usize,
    ) -> Result<Chosen, SamError> {
        let failed = |cause: String| SamError::Run { cause, path: self.decoder.path.clone() };
        let (&[.., height, width], all) = (masks.shape(), masks.as_f32().unwrap_or_default())
        else {
            return Err(failed("its masks have no rows and columns".into()));
        };
        let scores = scores.as_f32().unwrap_or_default();
        let grids: Vec<&[f32]> = all.chunks_exact((width * height).max(1)).collect();
        // 1 mask; 3 candidates; or the mask of clear prompts, and 3 candidates.
        let meant: Vec<usize> = match (grids.len(), is_clear) {
            (1, _) | (4, true) => vec![0],
            (3, _) => vec![0, 1, 2],
            (4, false) => vec![1, 2, 3],
            (found, _) => return Err(failed(format!("it makes {found} masks, not 1, 3 or 4"))),
        };
        if scores.len() != grids.len() {
            let cause = format!("it makes {} masks and {} scores", grids.len(), scores.len());
            return Err(failed(cause));
        }
        let mut meant = meant;
        meant.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));
        meant.truncate(count.max(1));
        let likeliest = meant[0];
        let candidate = |&k: &usize| {
            let logits = frame.to_picture(grids[k], (width, height));
            let area = logits.iter().filter(|v| **v > 0.0).count();
            let candidate = Candidate {
                stability: stability(&logits),
                predicted_iou: f64::from(scores[k]).clamp(0.0, 1.0),
                grid: grids[k].to_vec(),
                logits,
            };
            (k, area, candidate)
        };
        let mut found: Vec<(usize, usize, Candidate)> = meant.iter().map(candidate).collect();
        found.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        let best = found.iter().position(|(k, ..)| *k == likeliest).unwrap_or(0);
        let candidates = found.into_iter().map(|(.., candidate)| candidate).collect();
        Ok(Chosen { candidates, best, grid: (width, height) })
    }
}
