//! Which export a pair of files is, by the names of the decoder's inputs.

/// How a decoder names its inputs, and what that implies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// SAM 1 and MobileSAM as `segment_anything/utils/onnx.py` and samexporter write them: `point_coords`, `mask_input`.
    Meta,
    /// SAM 1 as transformers.js has it: `input_points`, `image_positional_embeddings`.
    Transformers,
    /// SAM 2 and 2.1 with the names of the original code: `image_embed`, `high_res_feats_0`.
    Sam2,
    /// SAM 2 and 2.1 as transformers.js has them: `image_embeddings.0`, `input_boxes`.
    Sam2Transformers,
}

/// Inputs that only a decoder of the convention has, embeddings first.
const NAMES: [(Convention, &[&str], &[&str]); 4] = [
    (
        Convention::Sam2,
        &["image_embed", "high_res_feats_0", "high_res_feats_1"],
        &["point_coords", "point_labels"],
    ),
    (
        Convention::Sam2Transformers,
        &["image_embeddings.0", "image_embeddings.1", "image_embeddings.2"],
        &["input_points", "input_labels"],
    ),
    (
        Convention::Transformers,
        &["image_embeddings", "image_positional_embeddings"],
        &["input_points", "input_labels"],
    ),
    (Convention::Meta, &["image_embeddings"], &["point_coords", "point_labels"]),
];

impl Convention {
    /// The convention of a decoder with these inputs.
    pub fn of(inputs: &[String]) -> Option<Self> {
        let has = |name: &&str| inputs.iter().any(|input| input == name);
        let found = NAMES.iter().find(|(_, e, p)| e.iter().all(has) && p.iter().all(has));
        found.map(|(convention, ..)| *convention)
    }

    /// Outputs of the encoder that the decoder takes, by their names.
    pub fn embeddings(self) -> &'static [&'static str] {
        NAMES.iter().find(|(c, ..)| *c == self).map_or(&[], |(_, embeddings, _)| embeddings)
    }

    /// Names of points, labels, scores and, in the order of preference, masks.
    pub(crate) fn names(self) -> [&'static str; 5] {
        match self {
            Self::Meta | Self::Sam2 => {
                ["point_coords", "point_labels", "iou_predictions", "low_res_masks", "masks"]
            }
            Self::Transformers | Self::Sam2Transformers => {
                ["input_points", "input_labels", "iou_scores", "pred_masks", "pred_masks"]
            }
        }
    }

    /// Whether the picture is squeezed into the square of the model. Otherwise it keeps its shape and is padded.
    pub fn stretches(self) -> bool {
        matches!(self, Self::Sam2 | Self::Sam2Transformers)
    }

    /// Whether points come as `[1, 1, n, 2]`, and the decoder adds the point that stands for none.
    pub(crate) fn is_of_transformers(self) -> bool {
        matches!(self, Self::Transformers | Self::Sam2Transformers)
    }

    /// Mean and standard deviation of each color, for values 0 to 255.
    pub(crate) fn normalization(self) -> ([f32; 3], [f32; 3]) {
        // Those of ImageNet; SAM 1 writes them with two digits of 255ths.
        match self.stretches() {
            false => ([123.675, 116.28, 103.53], [58.395, 57.12, 57.375]),
            true => (
                [0.485 * 255.0, 0.456 * 255.0, 0.406 * 255.0],
                [0.229 * 255.0, 0.224 * 255.0, 0.225 * 255.0],
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &str) -> Option<Convention> {
        Convention::of(&names.split(' ').map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn exports_are_told_apart_by_the_names_of_inputs() {
        let meta =
            "image_embeddings point_coords point_labels mask_input has_mask_input orig_im_size";
        assert_eq!(of(meta), Some(Convention::Meta));
        let js = "input_points input_labels image_embeddings image_positional_embeddings";
        assert_eq!(of(js), Some(Convention::Transformers));
        let sam2 = "image_embed high_res_feats_0 high_res_feats_1 point_coords point_labels mask_input has_mask_input";
        assert_eq!(of(sam2), Some(Convention::Sam2));
        let js2 = "input_points input_labels input_boxes image_embeddings.0 image_embeddings.1 image_embeddings.2";
        assert_eq!(of(js2), Some(Convention::Sam2Transformers));
        assert_eq!(of("pixel_values"), None);
    }
}
