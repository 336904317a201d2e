//! A segmenter of pictures as one of scenes: it answers in the view of the prompt; what its mask says about Gaussians is projected
//! into the other views, and is the prompt there, as SA3D (Cen et al. 2023) does with points.
//!
//! A view is asked where the votes so far leave something open, the nearest first. An answer that contradicts the votes is left
//! out and counted. Views that are not asked show what the votes say.

use std::sync::{Mutex, PoisonError};

use motes_formats::selectors::ObjectPrompt;

use crate::error::SelectError;
use crate::index::SceneIndex;
use crate::picture_segmenter::{PictureMask, PicturePrompt, PictureSegmenter};
use crate::prompt::Place;
use crate::provider::{Asked, MaskProvider};
use crate::source::SelectSource;
use crate::view_data::{SUPERPIXEL_PX, ViewData};
use crate::view_votes::{Projection, ViewVotes, depths};

/// Views that are asked beside that of the prompt, at most: each costs an encoding of its picture.
const MOST_ASKED: usize = 12;
/// Points of a stroke that are passed on.
const STROKE_POINTS: usize = 5;
/// A larger mask is the whole object as long as the segmenter expects this much of it, less than of its best one.
const PLAUSIBLE: f64 = 0.1;
/// A view is asked when what is open is more than this share of the object.
const OPEN: f32 = 0.1;
/// The box around what the votes know is widened by this share of its size.
const WIDER: f64 = 0.1;
/// Answers that agree less with the votes are left out.
const LEAST_AGREEMENT: f64 = 0.4;
/// The logits that stand for certainty.
const CERTAIN: f32 = 10.0;
/// Longest side of projected logits, cells: that of SAM's own.
const LOGIT_CELLS: usize = 256;

/// What the views said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Resolved {
    /// Views of the capture that were asked, in that order, per candidate.
    pub asked: Vec<usize>,
    /// Those of them whose answers contradict the others and were left out.
    pub left_out: Vec<usize>,
}

/// [`MaskProvider`] by a segmenter of pictures.
pub struct ProjectedPrompts<S> {
    segmenter: S,
    resolved: Mutex<Resolved>,
}

impl<S: PictureSegmenter> ProjectedPrompts<S> {
    /// By this segmenter.
    pub fn new(segmenter: S) -> Self {
        Self { segmenter, resolved: Mutex::default() }
    }

    /// The segmenter.
    pub fn segmenter(&self) -> &S {
        &self.segmenter
    }

    /// What the views said about all prompts so far.
    pub fn resolved(&self) -> Resolved {
        self.resolved.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl<S: PictureSegmenter> MaskProvider for ProjectedPrompts<S> {
    fn propose(
        &self,
        asked: &Asked<'_>,
        count: usize,
    ) -> Result<Vec<(Vec<f32>, f32)>, SelectError> {
        let prompts = prompts_of_views(asked.source, asked.index, asked.prompt)?;
        let Some((first, prompt)) = prompts.first() else {
            return Err(SelectError::NothingPositive);
        };
        let answers = self.segmenter.segment(asked.source, first.view, prompt)?;
        let best = answers.iter().map(|a| a.predicted_iou).fold(0.0, f64::max);
        let is_whole = |a: &PictureMask| a.predicted_iou >= best - PLAUSIBLE;
        let mut found = Vec::new();
        for answer in answers.into_iter().skip_while(|a| !is_whole(a)).take(count) {
            let mask = self.spread(asked, &prompts, &answer)?;
            found.push((mask, answer.predicted_iou as f32));
        }
        Ok(found)
    }
}

/// A view that the user prompted.
struct Prompted<'a> {
    view: usize,
    place: Place<'a>,
}

/// What the user said, per view, those with a positive prompt first, in pixels of the working size.
fn prompts_of_views<'a>(
    source: &SelectSource<'_>,
    index: &'a SceneIndex,
    prompt: &ObjectPrompt,
) -> Result<Vec<(Prompted<'a>, PicturePrompt)>, SelectError> {
    let mut found: Vec<(Prompted<'a>, PicturePrompt)> = Vec::new();
    let mut of = |name: &str, add: &dyn Fn(&mut PicturePrompt, f64)| -> Result<(), SelectError> {
        let view = source.view_named(name)?;
        let at = match found.iter().position(|(p, _)| p.view == view) {
            Some(at) => at,
            None => {
                let place = Place::of(source, index, name)?;
                found.push((Prompted { view, place }, PicturePrompt::default()));
                found.len() - 1
            }
        };
        let (prompted, prompt) = &mut found[at];
        add(prompt, prompted.place.scale);
        Ok(())
    };
    for click in &prompt.clicks {
        of(&click.view, &|p, scale| {
            p.points.push((click.pixel.map(|v| v * scale), click.positive));
        })?;
    }
    for scribble in &prompt.scribbles {
        let step = scribble.points.len().div_ceil(STROKE_POINTS).max(1);
        of(&scribble.view, &|p, scale| {
            let points = scribble.points.iter().step_by(step);
            p.points.extend(points.map(|at| (at.map(|v| v * scale), scribble.positive)));
        })?;
    }
    for rectangle in &prompt.boxes {
        let [x0, y0, x1, y1] = rectangle.pixels;
        let sorted = [x0.min(x1), y0.min(y1), x0.max(x1), y0.max(y1)];
        of(&rectangle.view, &|p, scale| p.around = Some(sorted.map(|v| v * scale)))?;
    }
    let is_negative =
        |p: &PicturePrompt| p.around.is_none() && p.points.iter().all(|(_, positive)| !positive);
    found.sort_by_key(|(_, prompt)| is_negative(prompt));
    found.retain({
        let mut first = true;
        move |(_, prompt)| !std::mem::take(&mut first) || !is_negative(prompt)
    });
    Ok(found)
}

/// A view that answered: which of the prepared ones, and its mask.
struct Answered {
    prepared: usize,
    mask: Vec<f32>,
}

impl<S: PictureSegmenter> ProjectedPrompts<S> {
    /// The mask of the object in all prepared views, of which `answer` is that in the view of the first prompt.
    fn spread(
        &self,
        asked: &Asked<'_>,
        prompts: &[(Prompted<'_>, PicturePrompt)],
        answer: &PictureMask,
    ) -> Result<Vec<f32>, SelectError> {
        let index = asked.index;
        let (first, _) = &prompts[0];
        let data = first.place.data();
        let first_mask = shares(data, &answer.mask);
        let mut votes = ViewVotes::new(index.gaussians);
        votes.add(data, &first_mask, 1.0);
        let mut open: Vec<usize> =
            (0..index.views.len()).filter(|&v| index.capture_views[v] != first.view).collect();
        let mut centers = vec![data.camera_from_world.center_in_world()];
        let (mut answered, mut resolved) = (Vec::<Answered>::new(), Resolved::default());
        resolved.asked.push(first.view);
        while resolved.asked.len() <= MOST_ASKED {
            let nearest = |v: &usize| {
                let at = index.views[*v].camera_from_world.center_in_world();
                centers.iter().map(|c| c.distance(at)).fold(f64::INFINITY, f64::min)
            };
            let own = |v: usize| {
                prompts.iter().find(|(p, _)| p.view == index.capture_views[v]).map(|(_, p)| p)
            };
            // What the user said first, then the nearest; the last one is taken.
            open.sort_by(|&a, &b| {
                let near = nearest(&b).total_cmp(&nearest(&a)).then(b.cmp(&a));
                own(a).is_some().cmp(&own(b).is_some()).then(near)
            });
            let Some(v) = open.pop() else { break };
            let view = &index.views[v];
            let projection = votes.projected(view);
            let capture_view = index.capture_views[v];
            let Some(prompt) = prompt_of(asked, v, &projection, own(v)) else { continue };
            let masks = self.segmenter.segment(asked.source, capture_view, &prompt)?;
            resolved.asked.push(capture_view);
            let judged = masks.iter().map(|m| {
                let mask = shares(view, &m.mask);
                let agreement = projection.agreement(&view.segments, &mask);
                (agreement * m.predicted_iou, agreement, mask)
            });
            let best = judged.max_by(|a, b| a.0.total_cmp(&b.0));
            match best.filter(|(_, agreement, _)| *agreement >= LEAST_AGREEMENT) {
                Some((.., mask)) => {
                    votes.add(view, &mask, 1.0);
                    centers.push(view.camera_from_world.center_in_world());
                    answered.push(Answered { prepared: v, mask });
                }
                None => resolved.left_out.push(capture_view),
            }
        }
        leave_out(index, &mut votes, &mut answered, &mut resolved);
        self.note(resolved);
        let mut masks: Vec<Vec<f32>> = index.views.iter().map(|v| shown(v, &votes)).collect();
        for Answered { prepared, mask } in answered {
            masks[prepared] = mask;
        }
        if let Some(v) = index.capture_views.iter().position(|&v| v == first.view) {
            masks[v] = first_mask;
        }
        Ok(masks.concat())
    }

    fn note(&self, of_one: Resolved) {
        let mut resolved = self.resolved.lock().unwrap_or_else(PoisonError::into_inner);
        resolved.asked.extend(of_one.asked);
        resolved.left_out.extend(of_one.left_out);
    }
}

/// Takes back the answers that contradict all votes together.
fn leave_out(
    index: &SceneIndex,
    votes: &mut ViewVotes,
    answered: &mut Vec<Answered>,
    resolved: &mut Resolved,
) {
    let together = votes.clone();
    answered.retain(|a| {
        let view = &index.views[a.prepared];
        let agrees = together.projected(view).agreement(&view.segments, &a.mask) >= LEAST_AGREEMENT;
        if !agrees {
            votes.add(view, &a.mask, -1.0);
            resolved.left_out.push(index.capture_views[a.prepared]);
        }
        agrees
    });
}

/// Share of each superpixel that a picture of the working size covers.
fn shares(view: &ViewData, mask: &[f32]) -> Vec<f32> {
    let mut sums = vec![0.0f32; view.segments.len()];
    view.labels.iter().zip(mask).for_each(|(&label, m)| sums[label as usize] += m);
    sums.iter().zip(&view.segments).map(|(sum, s)| sum / s.area_px).collect()
}

/// The mask that the votes make of a view which was not asked.
fn shown(view: &ViewData, votes: &ViewVotes) -> Vec<f32> {
    let projection = votes.projected(view);
    projection.object().into_iter().map(|shows| f32::from(u8::from(shows))).collect()
}

/// What a view is asked: points deep in what shows the object, a box around it, logits of the votes, and what the user said. None
/// when the view does not show the object, or the votes leave nothing open and the user said nothing here.
fn prompt_of(
    asked: &Asked<'_>,
    prepared: usize,
    projection: &Projection,
    own: Option<&PicturePrompt>,
) -> Option<PicturePrompt> {
    let view = &asked.index.views[prepared];
    let object = projection.object();
    let [area, open] = projection.areas(view, &object);
    let cell = (SUPERPIXEL_PX * SUPERPIXEL_PX) as f32;
    if area < 2.0 * cell {
        return own.filter(|p| p.points.iter().any(|(_, positive)| *positive)).cloned();
    }
    if open < OPEN * area && own.is_none() {
        return None;
    }
    let mut prompt = own.cloned().unwrap_or_default();
    let depth = depths(view, &object);
    let deepest = (0..object.len()).max_by(|&a, &b| {
        let of = |s: usize| (depth[s], (projection.inside[s] * 1e4) as u32);
        of(a).cmp(&of(b)).then(b.cmp(&a))
    })?;
    let middle = |s: usize| view.segments[s].center_px.map(f64::from);
    prompt.points.push((middle(deepest), true));
    // What the user pointed at in other views, where this one shows it.
    let range = asked.index.range(prepared);
    for (clicks, is_positive) in [(&asked.seeds.positive, true), (&asked.seeds.negative, false)] {
        for click in clicks {
            let here = click.iter().find(|n| range.contains(&(**n as usize)));
            let here = here.map(|n| *n as usize - range.start);
            let here = here.filter(|&s| object[s] == is_positive && s != deepest);
            prompt.points.extend(here.map(|s| (middle(s), is_positive)));
        }
    }
    if prompt.around.is_none() {
        prompt.around = Some(around(view, &object));
    }
    prompt.logits = Some(logits(view, projection));
    Some(prompt)
}

/// The widened box around superpixels, inside of the picture.
fn around(view: &ViewData, object: &[bool]) -> [f64; 4] {
    let (w, h) = (view.camera.width as f64, view.camera.height as f64);
    let mut found = [w, h, 0.0, 0.0];
    let half = 0.5 * SUPERPIXEL_PX as f64;
    for (segment, _) in view.segments.iter().zip(object).filter(|(_, o)| **o) {
        let [x, y] = segment.center_px.map(f64::from);
        found[0] = found[0].min(x - half);
        found[1] = found[1].min(y - half);
        found[2] = found[2].max(x + half);
        found[3] = found[3].max(y + half);
    }
    let (dx, dy) = (WIDER * (found[2] - found[0]), WIDER * (found[3] - found[1]));
    [
        (found[0] - dx).max(0.0),
        (found[1] - dy).max(0.0),
        (found[2] + dx).min(w),
        (found[3] + dy).min(h),
    ]
}

/// The votes as logits over the picture: 0 where nothing is known.
fn logits(view: &ViewData, projection: &Projection) -> (usize, usize, Vec<f32>) {
    let (w, h) = (view.camera.width, view.camera.height);
    let step = w.max(h).div_ceil(LOGIT_CELLS).max(1);
    let (columns, rows) = (w.div_ceil(step), h.div_ceil(step));
    let at = |cell: usize, most: usize| (cell * step + step / 2).min(most - 1);
    let of = |p: usize| {
        let s = view.labels[at(p / columns, h) * w + at(p % columns, w)] as usize;
        CERTAIN * (2.0 * projection.inside[s] - projection.known[s])
    };
    (columns, rows, (0..columns * rows).map(of).collect())
}
