//! All views of a scene prepared together: nodes are the superpixels of all views.

use std::any::Any;
use std::sync::{Arc, Mutex};

use glam::{DVec3, Vec3};
use motes_scene::Pose;
use motes_scene::camera_path::mean_up;
use rayon::prelude::*;

use crate::bounding::bounding_planes;
use crate::continuation::continuations;
use crate::graph::{Graph, Link};
use crate::plane::SupportPlane;
use crate::raised::RaisedSupport;
use crate::strength::{across_border, across_views};
use crate::view_data::{SUPERPIXEL_PX, Segment, ViewData};

/// Each superpixel is linked to what it meets in this many other views, the nearest by direction.
const LINKED_VIEWS: usize = 6;
/// Weight of a link between views, in superpixel sides of border. Each superpixel has several, and an
/// error of depth makes a wrong one: they only have to carry a prompt to the other views.
const VIEW_LINK: f32 = 0.3;
/// Neighbors in an image whose middles are farther apart than this many sides do not touch.
const TOUCHING: f32 = 2.0;
/// A place is the same in another view when its depth agrees within this many superpixel sides.
const SAME_DEPTH: f32 = 0.5;

/// The prepared views of a scene and the regions that they agree on.
#[derive(Clone, Debug)]
pub struct SceneIndex {
    /// Which views of the capture these are.
    pub capture_views: Vec<usize>,
    /// Prepared views.
    pub views: Vec<ViewData>,
    /// First node of each view, and their number.
    pub(crate) offsets: Vec<u32>,
    /// Strength of the borders of each view, in the order of [`ViewData::borders`].
    pub(crate) strengths: Vec<Vec<f32>>,
    /// Planes that bound the scene, what things stand on first.
    pub(crate) planes: Vec<SupportPlane>,
    /// Planes above the first that things stand on, too.
    pub(crate) raised: Vec<RaisedSupport>,
    pub(crate) graph: Graph,
    /// Number of Gaussians.
    pub(crate) gaussians: usize,
    /// Contribution of each Gaussian to all views, pixels.
    pub(crate) totals: Vec<f32>,
    /// What a prompt leaves for the next one on these views.
    pub(crate) kept: Arc<Mutex<Option<Arc<dyn Any + Send + Sync>>>>,
}

impl SceneIndex {
    /// Joins prepared views of `gaussians` Gaussians; `capture_views` says which they are.
    pub fn new(capture_views: Vec<usize>, views: Vec<ViewData>, gaussians: usize) -> Self {
        let mut offsets = vec![0u32];
        for view in &views {
            offsets.push(offsets[offsets.len() - 1] + view.segments.len() as u32);
        }
        let segments: Vec<&Segment> = views.iter().flat_map(|v| &v.segments).collect();
        let cameras: Vec<_> = views.iter().map(|v| v.camera_from_world.center_in_world()).collect();
        let planes = bounding_planes(&segments, &cameras, up(&views));
        let raised = planes.first().map_or_else(Vec::new, |p| RaisedSupport::find(&segments, p));
        let strengths: Vec<Vec<f32>> = views
            .par_iter()
            .map(|view| {
                let of = |b: &crate::view_data::Border| {
                    across_border(view, b.segments, b.at_px, &planes)
                };
                view.borders.iter().map(of).collect()
            })
            .collect();
        let mut links: Vec<Link> = (0..views.len())
            .into_par_iter()
            .flat_map_iter(|v| links_of_view(&views, &offsets, v, &planes))
            .collect();
        links.extend(continuations(&views, &offsets, &planes));
        for (v, view) in views.iter().enumerate() {
            for (border, &strength) in view.borders.iter().zip(&strengths[v]) {
                let nodes = border.segments.map(|s| s + offsets[v]);
                let weight = border.length_px / SUPERPIXEL_PX as f32;
                let [s, t] = border.segments.map(|s| &view.segments[s as usize]);
                let apart = Vec3::from(s.point).distance(Vec3::from(t.point));
                let touch =
                    s.width.min(t.width) > 0.0 && apart < TOUCHING * 0.5 * (s.width + t.width);
                let contact = if touch { weight } else { 0.0 };
                links.push(Link { nodes, weight, strength, contact });
            }
        }
        let graph = Graph::new(segments.len(), &links);
        let mut totals = vec![0.0f32; gaussians];
        for view in &views {
            for (&i, &w) in view.votes.gaussians.iter().zip(&view.votes.weights) {
                totals[i as usize] += w;
            }
        }
        let kept = Arc::default();
        Self {
            capture_views,
            views,
            offsets,
            strengths,
            planes,
            raised,
            graph,
            gaussians,
            totals,
            kept,
        }
    }

    /// What things stand on, where it is a plane.
    pub fn plane(&self) -> Option<&SupportPlane> {
        self.planes.first()
    }

    /// Number of superpixels of all views.
    pub fn nodes(&self) -> usize {
        self.offsets[self.views.len()] as usize
    }

    /// Node range of a view.
    pub(crate) fn range(&self, view: usize) -> std::ops::Range<usize> {
        self.offsets[view] as usize..self.offsets[view + 1] as usize
    }

    pub(crate) fn segment(&self, node: u32) -> &Segment {
        let view = self.offsets.partition_point(|&o| o <= node) - 1;
        &self.views[view].segments[(node - self.offsets[view]) as usize]
    }

    /// Where a world point is seen in the prepared view that looks at it most as `eye` does: that view of the capture, and the
    /// pixel at the working size. `None` where no prepared view sees it.
    pub fn seen_from(&self, point: DVec3, eye: DVec3) -> Option<(usize, [f64; 2])> {
        let toward = |from: DVec3| (point - from).normalize_or_zero();
        let likeness =
            |v: &usize| toward(self.views[*v].camera_from_world.center_in_world()).dot(toward(eye));
        let sees = |v: &usize| seen_at(&self.views[*v], point.as_vec3(), 0.0).is_some();
        let best = (0..self.views.len())
            .filter(sees)
            .max_by(|a, b| likeness(a).total_cmp(&likeness(b)).then(b.cmp(a)))?;
        let (pixel, _) = self.views[best].project(point.as_vec3())?;
        Some((self.capture_views[best], pixel))
    }

    /// In how many prepared views each Gaussian is seen, by a tenth of a pixel or more.
    pub fn visibility_counts(&self) -> Vec<f64> {
        let mut counts = vec![0.0; self.gaussians];
        for view in &self.views {
            let mut sums = vec![0.0f32; self.gaussians];
            for (&i, &w) in view.votes.gaussians.iter().zip(&view.votes.weights) {
                sums[i as usize] += w;
            }
            for (count, sum) in counts.iter_mut().zip(sums) {
                *count += if sum >= 0.1 { 1.0 } else { 0.0 };
            }
        }
        counts
    }

    /// Share of each superpixel of a prepared view that a picture of its working size covers, 0 to 1.
    ///
    /// # Panics
    /// When the picture has another number of pixels.
    pub fn from_pixels(&self, view: usize, mask: &[f32]) -> Vec<f32> {
        let view = &self.views[view];
        assert_eq!(mask.len(), view.labels.len(), "one value per pixel");
        let mut sums = vec![0.0f32; view.segments.len()];
        for (&label, m) in view.labels.iter().zip(mask) {
            sums[label as usize] += m;
        }
        sums.iter().zip(&view.segments).map(|(sum, s)| sum / s.area_px).collect()
    }

    /// Area of a node in superpixels of nominal size.
    pub(crate) fn area(&self, node: u32) -> f32 {
        self.segment(node).area_px / (SUPERPIXEL_PX * SUPERPIXEL_PX) as f32
    }

    /// The superpixels that show a world point, one per view that sees it.
    pub(crate) fn nodes_at(&self, point: Vec3) -> Vec<u32> {
        (0..self.views.len())
            .filter_map(|v| seen_at(&self.views[v], point, 0.0).map(|s| s + self.offsets[v]))
            .collect()
    }

    /// The share of each Gaussian's contribution that lies where `mask` (`[nodes]`, 0 to 1) is, 0 to
    /// 1; NaN where no view shows it.
    pub(crate) fn lift(&self, mask: &[f32]) -> Vec<f32> {
        let mut inside = vec![0.0f32; self.gaussians];
        for (v, view) in self.views.iter().enumerate() {
            for (s, &m) in mask[self.range(v)].iter().enumerate() {
                if m > 0.0 {
                    for (i, w) in view.votes.of(s) {
                        inside[i as usize] += m * w;
                    }
                }
            }
        }
        inside.iter().zip(&self.totals).map(|(a, b)| a / b).collect()
    }

    /// The share of each superpixel that Gaussians make up, weighted by `belongs`; the mask of a
    /// selection, rendered.
    pub(crate) fn rendered(&self, belongs: impl Fn(usize) -> f32 + Sync) -> Vec<f32> {
        self.views
            .par_iter()
            .flat_map_iter(|view| {
                let of = |s: usize| {
                    let (mut inside, mut all) = (0.0f32, 0.0f32);
                    for (i, w) in view.votes.of(s) {
                        inside += belongs(i as usize) * w;
                        all += w;
                    }
                    if all > 0.0 { inside / all } else { 0.0 }
                };
                (0..view.segments.len()).map(of).collect::<Vec<f32>>()
            })
            .collect()
    }
}

/// Up, as the cameras are held; no direction where they are held in all ways.
fn up(views: &[ViewData]) -> DVec3 {
    let cameras: Vec<Pose> = views.iter().map(|v| v.camera_from_world).collect();
    mean_up(&cameras).unwrap_or_default()
}

/// The superpixel of a view that shows a point. `slack` is how far it may be off, world units, beyond
/// half a superpixel.
fn seen_at(view: &ViewData, point: Vec3, slack: f32) -> Option<u32> {
    let ([x, y], z) = view.project(point)?;
    let segment = view.segment_at(x, y)?;
    let depth = view.depth[y as usize * view.camera.width + x as usize];
    let width = view.segments[segment as usize].width;
    ((depth - z as f32).abs() <= SAME_DEPTH * width.max(slack) && width > 0.0).then_some(segment)
}

fn links_of_view(
    views: &[ViewData],
    offsets: &[u32],
    from: usize,
    planes: &[SupportPlane],
) -> Vec<Link> {
    let forward = |v: &ViewData| v.camera_from_world.rotation.inverse() * glam::DVec3::Z;
    let here = forward(&views[from]);
    let center = views[from].camera_from_world.center_in_world();
    let mut others: Vec<(f64, usize)> = (0..views.len())
        .filter(|&v| v != from)
        .map(|v| {
            let apart = views[v].camera_from_world.center_in_world().distance(center);
            (apart * (2.0 - forward(&views[v]).dot(here)), v)
        })
        .collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    others.truncate(LINKED_VIEWS);
    let mut links = Vec::new();
    for (s, segment) in views[from].segments.iter().enumerate().filter(|(_, s)| s.width > 0.0) {
        for &(_, to) in &others {
            let Some(t) = seen_at(&views[to], Vec3::from(segment.point), segment.width) else {
                continue;
            };
            let strength = across_views(segment, &views[to].segments[t as usize], planes);
            let nodes = [offsets[from] + s as u32, offsets[to] + t];
            links.push(Link { nodes, weight: VIEW_LINK, strength, contact: 0.0 });
        }
    }
    links
}
