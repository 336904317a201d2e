//! A request's prompt as the decoder wants it.

use std::path::Path;

use motes_formats::provider::SegmentTask;

use crate::{Convention, Frame, SamError};

/// Labels of points, as in the original code.
const BESIDE: f32 = 0.0;
const ON: f32 = 1.0;
const TOP_LEFT: f32 = 2.0;
const BOTTOM_RIGHT: f32 = 3.0;
const NONE: f32 = -1.0;

/// Points and labels in the square of the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Prompt {
    /// x and y of each.
    pub(crate) points: Vec<[f32; 2]>,
    pub(crate) labels: Vec<f32>,
    /// Left, top, right, bottom, where the decoder has an input for it.
    pub(crate) around: Option<[f32; 4]>,
    /// Logits of the request: size and values, over the picture.
    pub(crate) logits: Option<((usize, usize), Vec<f32>)>,
    /// Whether one mask is meant: [`is_clear`].
    pub(crate) is_clear: bool,
    /// What the decoder cannot be told.
    pub(crate) warnings: Vec<String>,
}

/// What the inputs of a decoder can take besides points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Abilities {
    pub(crate) takes_boxes: bool,
    pub(crate) takes_masks: bool,
}

/// Whether the prompt leaves no doubt between an object and its parts, so that the decoder's single mask is the answer: the rule of
/// `select_masks` in the original code, more than two points, of which a box is two and none is one. A mask is as good as a point.
fn is_clear(points: usize, has_box: bool, has_logits: bool) -> bool {
    let padding = usize::from(!has_box);
    points + 2 * usize::from(has_box) + padding + usize::from(has_logits) > 2
}

impl Prompt {
    /// The prompt of a request whose files lie in `folder`.
    pub(crate) fn new(
        task: &SegmentTask,
        folder: &Path,
        frame: &Frame,
        convention: Convention,
        abilities: Abilities,
    ) -> Result<Self, SamError> {
        if task.points.is_empty() && task.around.is_none() && task.logits.is_none() {
            return Err(SamError::NoPrompt);
        }
        let (w, h) = (frame.size.0 as f64, frame.size.1 as f64);
        let mut prompt = Self {
            is_clear: is_clear(task.points.len(), task.around.is_some(), task.logits.is_some()),
            ..Self::default()
        };
        for p in &task.points {
            if !(p.x >= 0.0 && p.x <= w && p.y >= 0.0 && p.y <= h) {
                let text = format!("the point {},{} lies outside of {w}x{h} pixels", p.x, p.y);
                return Err(SamError::Prompt(text));
            }
            prompt.push([p.x, p.y], if p.positive { ON } else { BESIDE }, frame);
        }
        if let Some([x0, y0, x1, y1]) = task.around {
            if !(x0 < x1 && y0 < y1 && x0 < w && y0 < h && x1 > 0.0 && y1 > 0.0) {
                let text =
                    format!("the box {x0},{y0},{x1},{y1} is empty or outside of {w}x{h} pixels");
                return Err(SamError::Prompt(text));
            }
            let corners = [[x0.max(0.0), y0.max(0.0)], [x1.min(w), y1.min(h)]];
            prompt.add_box(corners, frame, convention, abilities);
        }
        // The decoders of transformers.js add it themselves; they need one point in any case.
        let pads = match convention {
            Convention::Meta => task.around.is_none(),
            Convention::Sam2 => true,
            _ => prompt.points.is_empty(),
        };
        if pads {
            prompt.push([0.0, 0.0], NONE, frame);
        }
        if let Some(name) = &task.logits {
            let (width, height, values) = motes_protocol::read_logits(&folder.join(name))
                .map_err(|cause| SamError::Prompt(format!("the logits: {cause}")))?;
            match abilities.takes_masks {
                true => prompt.logits = Some(((width, height), values)),
                false => {
                    prompt
                        .warnings
                        .push("this export of SAM takes no mask: it was left out".into());
                }
            }
        }
        Ok(prompt)
    }

    fn push(&mut self, at: [f64; 2], label: f32, frame: &Frame) {
        self.points.push(frame.point(at));
        self.labels.push(label);
    }

    fn add_box(
        &mut self,
        [from, to]: [[f64; 2]; 2],
        frame: &Frame,
        convention: Convention,
        abilities: Abilities,
    ) {
        if !convention.is_of_transformers() {
            self.push(from, TOP_LEFT, frame);
            self.push(to, BOTTOM_RIGHT, frame);
            return;
        }
        if abilities.takes_boxes {
            let ([x0, y0], [x1, y1]) = (frame.point(from), frame.point(to));
            self.around = Some([x0, y0, x1, y1]);
            return;
        }
        self.push([0, 1].map(|k| 0.5 * (from[k] + to[k])), ON, frame);
        let text = "this export of SAM takes no box: a point in its middle stands for it";
        self.warnings.push(text.into());
    }
}

#[cfg(test)]
mod tests {
    use motes_formats::provider::PointPrompt;

    use super::*;

    const ALL: Abilities = Abilities { takes_boxes: true, takes_masks: true };

    fn prompt(convention: Convention, points: &[(f64, f64, bool)], around: bool) -> Prompt {
        let frame = Frame::new(convention, (200, 100), 1024);
        let point = |&(x, y, positive): &(f64, f64, bool)| PointPrompt { x, y, positive };
        let task = SegmentTask {
            points: points.iter().map(point).collect(),
            around: around.then_some([10.0, 20.0, 110.0, 70.0]),
            ..SegmentTask::default()
        };
        let folder = Path::new(".");
        Prompt::new(&task, folder, &frame, convention, ALL).unwrap()
    }

    #[test]
    fn points_and_boxes_land_in_the_square_and_one_point_stands_for_no_box() {
        let one = prompt(Convention::Meta, &[(50.0, 25.0, true)], false);
        assert_eq!(one.points, [[256.0, 128.0], [0.0, 0.0]]);
        assert_eq!((one.labels.as_slice(), one.is_clear), (&[1.0, -1.0][..], false));
        let boxed = prompt(Convention::Meta, &[(50.0, 25.0, false)], true);
        assert_eq!(boxed.labels, [0.0, 2.0, 3.0]);
        assert!((boxed.points[1][0] - 51.2).abs() < 1e-4 && boxed.is_clear);
        // SAM 2 squeezes the picture, and adds the point beside a box, too.
        let two = prompt(Convention::Sam2, &[(50.0, 25.0, true)], true);
        assert_eq!((two.points[0], two.labels.len()), ([256.0, 256.0], 4));
        let js = prompt(Convention::Sam2Transformers, &[], true);
        assert_eq!((js.around.unwrap()[0], js.labels.as_slice()), (51.2, &[-1.0][..]));
    }

    #[test]
    fn one_click_or_box_is_ambiguous_and_more_is_not() {
        assert!(!is_clear(1, false, false) && !is_clear(0, true, false));
        assert!(is_clear(2, false, false) && is_clear(1, true, false) && is_clear(1, false, true));
    }

    #[test]
    fn what_lies_outside_is_refused() {
        let frame = Frame::new(Convention::Meta, (20, 10), 64);
        let mut task = SegmentTask::default();
        let of = |task: &SegmentTask| {
            Prompt::new(task, Path::new("."), &frame, Convention::Meta, ALL)
                .unwrap_err()
                .to_string()
        };
        assert!(of(&task).contains("neither points nor a box"));
        task.points = vec![PointPrompt { x: 20.5, y: 1.0, positive: true }];
        assert!(of(&task).contains("outside of 20x10"));
        task.points[0].x = f64::NAN;
        assert!(of(&task).contains("outside of 20x10"));
        task.points.clear();
        task.around = Some([5.0, 5.0, 5.0, 9.0]);
        assert!(of(&task).contains("is empty"));
    }
}
