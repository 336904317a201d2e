//! Steps to a selection.

use glam::{DVec3, Vec3};
use motes_formats::selection::{PlaneDocument, SelectionNotes};
use motes_formats::selectors::{
    Candidate, ObjectPrompt, PlaneSide, PostDocument, SelectStep, Selector,
};
use motes_raster::{NO_LABEL, label_votes};
use motes_scene::Selection;

use crate::color::{difference, lab_from_srgb};
use crate::error::SelectError;
use crate::extent::object_box;
use crate::islands::without_islands;
use crate::lift::lift_masks;
use crate::neighbors::{connected, grown, settled, shrunk};
use crate::prompt::{Place, seeds};
use crate::property::{base_lab, property};
use crate::provider::{Asked, GraphCut, MaskProvider};
use crate::shapes::{centers, half_space, mean, polygon, turned_box};
use crate::source::SelectSource;
use crate::{masks, plane::SupportPlane};

/// One of the nested answers to a prompt.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Confidence per Gaussian.
    pub selection: Selection,
    /// 1 minus the conductance of the region: how little holds it to the rest, 0 to 1.
    pub score: f32,
    /// Intersection over union of the lifted selection, rendered, and the masks it came from.
    pub agreement: f32,
    /// The share inside the masks from which a Gaussian belongs: the bias of the vote.
    pub threshold: f32,
}

/// Runs steps in order on nothing selected.
///
/// # Errors
/// When a step names what does not exist, or needs what `source` does not have.
pub fn select(source: &SelectSource<'_>, steps: &[SelectStep]) -> Result<Selection, SelectError> {
    select_from(source, Selection::none(source.gaussians.len()), steps)
}

/// Runs steps in order on a selection.
///
/// # Errors
/// As [`select`].
pub fn select_from(
    source: &SelectSource<'_>,
    start: Selection,
    steps: &[SelectStep],
) -> Result<Selection, SelectError> {
    let mut selection = start;
    for step in steps {
        selection = match step {
            SelectStep::Select(step) => {
                let found = find(source, &step.selector)?;
                selection.combined(step.combine, &found)
            }
            SelectStep::Post(post) => changed(source, &selection, *post)?,
        };
    }
    Ok(selection)
}

/// The nested answers to a prompt, the whole object first; at most `count`.
///
/// # Errors
/// When a view or pixel does not exist, nothing is there, or nothing positive was said.
pub fn propose(
    source: &SelectSource<'_>,
    prompt: &ObjectPrompt,
    count: usize,
) -> Result<Vec<Proposal>, SelectError> {
    match source.segmenter() {
        Some(segmenter) => propose_with(source, segmenter, prompt, count),
        None => propose_with(source, &GraphCut::default(), prompt, count),
    }
}

/// [`propose`] with another maker of masks.
///
/// # Errors
/// As [`propose`].
pub fn propose_with(
    source: &SelectSource<'_>,
    provider: &dyn MaskProvider,
    prompt: &ObjectPrompt,
    count: usize,
) -> Result<Vec<Proposal>, SelectError> {
    let index = source.index()?;
    let seeds = seeds(source, index, prompt)?;
    let proposals = provider.propose(&Asked { source, index, prompt, seeds: &seeds }, count)?;
    let point = |hit: &Vec<u32>| Some(Vec3::from(index.segment(*hit.first()?).point));
    let clicked: Vec<Vec3> = seeds.positive.iter().filter_map(point).collect();
    let lifted = proposals.into_iter().map(|(mask, score)| {
        let lifted = lift_masks(index, &mask);
        let settled = settled(source.gaussians, &lifted.selection, &index.totals);
        Proposal {
            selection: without_islands(source.gaussians, &settled, &clicked),
            score,
            agreement: lifted.agreement,
            threshold: lifted.threshold,
        }
    });
    let mut lifted: Vec<Proposal> = lifted.collect();
    // A part that no Gaussian makes up is none; the object itself is answered as it is.
    let mut first = true;
    lifted.retain(|p| std::mem::take(&mut first) || p.selection.count() > 0);
    Ok(lifted)
}

/// What else is known of a selection: its box, and the plane that it stands on where one was looked for.
pub fn notes(
    source: &SelectSource<'_>,
    selection: &Selection,
    steps: &[SelectStep],
) -> SelectionNotes {
    let plane = source.found_plane().map(|p| PlaneDocument {
        normal: p.normal.as_dvec3().to_array(),
        offset: f64::from(p.offset),
    });
    SelectionNotes {
        object_box: object_box(source.gaussians, selection),
        support_plane: plane,
        steps: steps.to_vec(),
    }
}

fn find(source: &SelectSource<'_>, selector: &Selector) -> Result<Selection, SelectError> {
    let g = source.gaussians;
    let n = g.len();
    Ok(match selector {
        Selector::Object(prompt) => {
            let wanted = match prompt.candidate {
                Candidate::Whole => 0,
                Candidate::Part => 1,
                Candidate::Subpart => 2,
            };
            let mut found = propose(source, prompt, wanted + 1)?;
            found.truncate(wanted + 1);
            found.pop().map_or_else(|| Selection::none(n), |p| p.selection)
        }
        Selector::Masks { masks } => masks::lift(source, masks)?,
        Selector::Rectangle { view, pixels: [x0, y0, x1, y1] } => {
            in_view(source, view, &[[*x0, *y0], [*x1, *y0], [*x1, *y1], [*x0, *y1]])?
        }
        Selector::Polygon { view, points } => in_view(source, view, points)?,
        Selector::Brush { view, points, radius } => brush(source, view, points, *radius)?,
        Selector::Sphere { center, radius } => {
            let center = DVec3::from_array(*center);
            centers(g, |p| p.distance(center) <= *radius)
        }
        Selector::Box { center, half_size, rotation } => {
            turned_box(g, *center, *half_size, *rotation)?
        }
        Selector::HalfSpace { normal, point } => half_space(g, *normal, *point)?,
        Selector::GroundPlane { side, thickness } => ground(source, *side, *thickness)?,
        Selector::Color { rgb, tolerance } => colored(source, rgb.map(|v| v as f32), *tolerance),
        Selector::Eyedropper { view, pixel, tolerance } => {
            let index = source.index()?;
            let place = Place::of(source, index, view)?;
            place.nodes_at(*pixel)?;
            let data = place.data();
            let at = data.segment_at(pixel[0] * place.scale, pixel[1] * place.scale);
            let lab = at.map_or([0.0; 3], |s| data.segments[s as usize].lab);
            Selection::where_true(n, |i| f64::from(difference(base_lab(g, i), lab)) <= *tolerance)
        }
        Selector::Connected { seed, distance, tolerance } => {
            connected(g, *seed, *distance, *tolerance)?
        }
        Selector::Property { name, compare, value } => {
            let values = match name.as_str() {
                "visibility_count" => {
                    source.capture("the property visibility_count")?;
                    source.index()?.visibility_counts()
                }
                name => property(g, name)?,
            };
            Selection::where_true(n, |i| compare.holds(values[i], *value))
        }
        Selector::Ids { ids } => {
            if let Some(id) = ids.iter().find(|&&id| id as usize >= n) {
                let text =
                    format!("there is no Gaussian {id}: the last of {n} is {}", n.max(1) - 1);
                return Err(SelectError::BadValue(text));
            }
            let mut out = Selection::none(n);
            ids.iter().for_each(|&id| out.confidence[id as usize] = 1.0);
            out
        }
        Selector::File { path } => source.selection_file(path)?,
        Selector::Label { column, value } => {
            let values = property(g, column)?;
            Selection::where_true(n, |i| values[i] == *value as f64)
        }
        Selector::All => Selection::all(n),
    })
}

fn changed(
    source: &SelectSource<'_>,
    selection: &Selection,
    post: PostDocument,
) -> Result<Selection, SelectError> {
    let valid = |d: f64| match d >= 0.0 && d.is_finite() {
        true => Ok(d),
        false => Err(SelectError::BadValue(format!("{d} is not a distance"))),
    };
    Ok(match post {
        PostDocument::Invert => selection.inverted(),
        PostDocument::Grow { distance } => grown(source.gaussians, selection, valid(distance)?),
        PostDocument::Shrink { distance } => shrunk(source.gaussians, selection, valid(distance)?),
    })
}

fn in_view(
    source: &SelectSource<'_>,
    view: &str,
    corners: &[[f64; 2]],
) -> Result<Selection, SelectError> {
    let view = source.view_named(view)?;
    let pose = source.capture("a shape in a view")?.views[view].camera_from_world;
    Ok(polygon(source.gaussians, &source.camera(view)?, &pose, corners))
}

/// What is seen under a stroke: more than half of a Gaussian's contribution to the view lies under it.
fn brush(
    source: &SelectSource<'_>,
    view: &str,
    points: &[[f64; 2]],
    radius: f64,
) -> Result<Selection, SelectError> {
    let view = source.view_named(view)?;
    let (camera, capture) = (source.camera(view)?, source.capture("a brush")?);
    let distance2 = |x: f64, y: f64| {
        let to = |a: [f64; 2], b: [f64; 2]| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let t = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy).max(1e-12);
            let t = t.clamp(0.0, 1.0);
            (x - a[0] - t * dx).powi(2) + (y - a[1] - t * dy).powi(2)
        };
        let ends = points.windows(2).map(|p| to(p[0], p[1]));
        ends.chain(points.first().map(|&p| to(p, p))).fold(f64::INFINITY, f64::min)
    };
    let label = |p: usize| {
        let (x, y) = ((p % camera.width) as f64 + 0.5, (p / camera.width) as f64 + 0.5);
        u32::from(distance2(x, y) > radius * radius)
    };
    let labels: Vec<u32> = (0..camera.width * camera.height).map(label).collect();
    debug_assert!(!labels.contains(&NO_LABEL));
    let pose = &capture.views[view].camera_from_world;
    let votes = label_votes(source.gaussians, &camera, pose, &source.options, &labels, 2, 0.0);
    let mut under = vec![[0.0f32; 2]; source.gaussians.len()];
    for (label, sum) in [(0, 0), (1, 1)] {
        votes.of(label).for_each(|(i, w)| under[i as usize][sum] += w);
    }
    // What hardly shows is behind, not under.
    const SHOWN_PX: f32 = 0.25;
    let share = |[a, b]: &[f32; 2]| if a + b >= SHOWN_PX { a / (a + b) } else { 0.0 };
    let confidence = under.iter().map(share);
    Ok(Selection { confidence: confidence.collect() })
}

fn ground(
    source: &SelectSource<'_>,
    side: PlaneSide,
    thickness: Option<f64>,
) -> Result<Selection, SelectError> {
    source.capture("the ground plane")?;
    let plane: SupportPlane = *source.index()?.plane().ok_or(SelectError::NoPlane)?;
    let half = match thickness {
        Some(t) if t > 0.0 && t.is_finite() => 0.5 * t,
        Some(t) => return Err(SelectError::BadValue(format!("{t} is not a thickness"))),
        // What a plane scatters to: 3 standard deviations.
        None => 3.0 * f64::from(plane.noise),
    };
    let g = source.gaussians;
    Ok(Selection::where_true(g.len(), |i| {
        let height = f64::from(plane.height(Vec3::from(g.means[i])));
        mean(g, i).is_finite()
            && match side {
                PlaneSide::On => height.abs() <= half,
                PlaneSide::Above => height > half,
                PlaneSide::Below => height < -half,
            }
    }))
}

fn colored(source: &SelectSource<'_>, rgb: [f32; 3], tolerance: f64) -> Selection {
    let (g, lab) = (source.gaussians, lab_from_srgb(rgb));
    Selection::where_true(g.len(), |i| f64::from(difference(base_lab(g, i), lab)) <= tolerance)
}
