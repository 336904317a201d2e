//! A segmenter of pictures that knows the truth, and one that does not in some views.

use std::path::Path;
use std::sync::Mutex;

use motes_formats::selectors::{Click, ObjectPrompt};
use motes_raster::Antialias;
use motes_scene::Selection;
use segment_select::{
    PictureMask, PicturePrompt, PictureSegmenter, ProjectedPrompts, SelectError, SelectSource,
    propose_with, selection_mask,
};

use crate::scene::{BLUE, BLUE_TOP, RED, RED_TOP, click_on, held_out_iou, scene};

/// Answers with the object under the first positive point: everything, with little hope; the object; a half of it.
struct Truth<'a> {
    part: &'a [u32],
    /// Views where it answers with the other box.
    wrong: &'a [usize],
    prompts: Mutex<Vec<(usize, PicturePrompt)>>,
}

impl<'a> Truth<'a> {
    fn new(part: &'a [u32], wrong: &'a [usize]) -> Self {
        Self { part, wrong, prompts: Mutex::default() }
    }
}

impl PictureSegmenter for Truth<'_> {
    fn segment(
        &self,
        source: &SelectSource<'_>,
        view: usize,
        prompt: &PicturePrompt,
    ) -> Result<Vec<PictureMask>, SelectError> {
        self.prompts.lock().unwrap().push((view, prompt.clone()));
        let capture = source.capture("a test")?;
        let (camera, pose) = (source.camera(view)?, &capture.views[view].camera_from_world);
        let mask = |label: u32| {
            let those = Selection::where_true(self.part.len(), |i| self.part[i] == label);
            selection_mask(source.gaussians, &those, &camera, pose, &source.options).data
        };
        let masks = [RED, BLUE].map(mask);
        let positive = prompt.points.iter().find(|(_, positive)| *positive);
        let at = positive.map_or(0, |([x, y], _)| *y as usize * camera.width + *x as usize);
        let mut found = usize::from(masks[1][at] > masks[0][at]);
        if self.wrong.contains(&view) {
            found = 1 - found;
        }
        let object = masks[found].clone();
        let half = object.iter().enumerate().map(|(p, m)| m * (p % camera.width % 2) as f32);
        let all = object.iter().map(|_| 1.0).collect();
        Ok(vec![
            PictureMask { mask: all, predicted_iou: 0.2 },
            PictureMask { mask: object.clone(), predicted_iou: 0.95 },
            PictureMask { mask: half.collect(), predicted_iou: 0.9 },
        ])
    }
}

fn found(
    segmenter: Truth<'_>,
    clicks: Vec<Click>,
    label: u32,
) -> (f64, segment_select::Resolved, Vec<(usize, PicturePrompt)>) {
    let (g, part, capture) = scene();
    let source =
        SelectSource::new(&g, Antialias::Classic).with_capture(&capture, Path::new("c.json"));
    let provider = ProjectedPrompts::new(segmenter);
    let prompt = ObjectPrompt { clicks, ..ObjectPrompt::default() };
    let found = propose_with(&source, &provider, &prompt, 1).unwrap();
    let truth = Selection::where_true(g.len(), |i| part[i] == label);
    let iou = held_out_iou(&source, &capture, &found[0].selection, &truth);
    let prompts = provider.segmenter().prompts.lock().unwrap().clone();
    (iou, provider.resolved(), prompts)
}

#[test]
fn a_click_in_one_view_is_the_object_in_all() {
    let (_, part, capture) = scene();
    for (top, label) in [(RED_TOP, RED), (BLUE_TOP, BLUE)] {
        // View 8 is not among the prepared ones.
        for view in [0, 5, 8] {
            let clicks = vec![click_on(&capture, view, top, true)];
            let (iou, resolved, _) = found(Truth::new(&part, &[]), clicks, label);
            assert!(iou > 0.93, "part {label} from view {view}: {iou}");
            assert_eq!((resolved.asked[0], resolved.left_out.len()), (view, 0), "{resolved:?}");
        }
    }
}

#[test]
fn views_that_contradict_are_left_out_and_named() {
    let (_, part, capture) = scene();
    let clicks = || vec![click_on(&capture, 0, RED_TOP, true)];
    // Two of those that are asked: where the votes leave nothing open, a view is not.
    let (iou, resolved, _) = found(Truth::new(&part, &[1, 7]), clicks(), RED);
    assert!(iou > 0.9, "{iou}");
    let mut left_out = resolved.left_out.clone();
    left_out.sort_unstable();
    assert_eq!(left_out, [1, 7], "{resolved:?}");
    // The bad case: a segmenter that is wrong in the view of the click cannot be helped.
    let (iou, ..) = found(Truth::new(&part, &[0]), clicks(), RED);
    assert!(iou < 0.3, "{iou}");
}

#[test]
fn prompts_of_other_views_are_the_projected_object() {
    let (_, part, capture) = scene();
    let clicks = vec![click_on(&capture, 1, RED_TOP, true), click_on(&capture, 1, BLUE_TOP, false)];
    let pixel = clicks[0].pixel;
    let (_, _, prompts) = found(Truth::new(&part, &[]), clicks, RED);
    let (view, first) = &prompts[0];
    assert_eq!((*view, &first.around, &first.logits), (1, &None, &None));
    assert_eq!((first.points[0], first.points.len()), ((pixel, true), 2));
    assert!(prompts.len() > 2 && prompts.len() <= 9);
    for (view, prompt) in &prompts[1..] {
        let at = click_on(&capture, *view, RED_TOP, true).pixel;
        let [x0, y0, x1, y1] = prompt.around.unwrap();
        assert!(x0 < at[0] && at[0] < x1 && y0 < at[1] && at[1] < y1, "{view}: {prompt:?}");
        assert!(x1 - x0 < 90.0 && y1 - y0 < 90.0, "{view}: {:?}", prompt.around);
        let (columns, rows, logits) = prompt.logits.as_ref().unwrap();
        assert_eq!((*columns, *rows), (160, 120));
        let logit = |[x, y]: [f64; 2]| logits[y as usize * columns + x as usize];
        assert!(logit(at) > 5.0, "{view}: {}", logit(at));
        let blue = click_on(&capture, *view, BLUE_TOP, true).pixel;
        assert!(logit(blue) < 0.0, "{view}: {}", logit(blue));
        assert!(prompt.points.iter().any(|(_, positive)| !positive), "{view}");
    }
}
