//! Surfaces that go on behind what hides them.
//!
//! A surface that ends where something nearer begins does not end there. Two such ends are taken for one surface
//! when each lies where the other leads ("relatable": Kellman and Shipley 1991, "A theory of visual interpolation
//! in object perception") and no view sees through the place between them. Without such links the
//! strands of a knot, whose crossings no view shows, are things of their own.

use glam::Vec3;
use rayon::prelude::*;

use crate::graph::Link;
use crate::plane::SupportPlane;
use crate::strength::color;
use crate::view_data::{SUPERPIXEL_PX, Segment, ViewData};

/// Weight of a certain continuation, in borders of its length: it stands for the border that is hidden.
const WEIGHT: f32 = 2.0;
/// A surface is hidden by what is nearer by this many superpixel sides.
const NEARER: f32 = 1.0;
/// Ends of one surface are at most this far apart, superpixel sides in the image and in space.
const REACH_PX: f32 = 9.0 * SUPERPIXEL_PX as f32;
const REACH: f32 = 12.0;
/// Cosine between where an end points in the image and where the other one lies.
const AHEAD: f32 = 0.5;
/// Radians: how much the two ends may differ from the ends of one arc, and how much such an arc may bend.
const TWIST: f32 = 0.5;
const BEND: f32 = 0.6;
/// Continuations less likely than this are not looked at.
const LEAST: f32 = 0.05;
/// Places between two ends that must be hidden here and empty nowhere.
const BETWEEN: [f32; 5] = [1.0 / 6.0, 2.0 / 6.0, 3.0 / 6.0, 4.0 / 6.0, 5.0 / 6.0];
/// A place is hidden, or empty, when what is seen there is this many superpixel sides nearer, or farther.
const HIDDEN: f32 = 0.3;
const EMPTY: f32 = 1.0;

/// Where a surface is hidden by a nearer one.
struct End<'a> {
    superpixel: u32,
    segment: &'a Segment,
    at_px: [f32; 2],
    /// Unit, image: from the middle of the superpixel to where it ends.
    ahead: [f32; 2],
    length_px: f32,
}

/// Links between superpixels of the same view that show one surface on both sides of what hides it.
pub(crate) fn continuations(
    views: &[ViewData],
    offsets: &[u32],
    planes: &[SupportPlane],
) -> Vec<Link> {
    (0..views.len())
        .into_par_iter()
        .flat_map_iter(|v| {
            let ends = ends(&views[v], planes);
            let mut links = Vec::new();
            for (k, a) in ends.iter().enumerate() {
                for b in &ends[k + 1..] {
                    let likely = related(a, b);
                    if likely > LEAST && is_hidden(&views[v], a, b) && !is_empty(views, a, b) {
                        let border = a.length_px.min(b.length_px) / SUPERPIXEL_PX as f32;
                        links.push(Link {
                            nodes: [a.superpixel, b.superpixel].map(|s| s + offsets[v]),
                            weight: WEIGHT * likely * border.min(1.0),
                            strength: color(a.segment, b.segment),
                            contact: 0.0,
                        });
                    }
                }
            }
            links
        })
        .collect()
}

fn ends<'a>(view: &'a ViewData, planes: &[SupportPlane]) -> Vec<End<'a>> {
    let of = |border: &crate::view_data::Border| {
        let [s, t] = border.segments;
        let depths = (view.plane_depth(s, border.at_px)?, view.plane_depth(t, border.at_px)?);
        let superpixel = if depths.0 > depths.1 { s } else { t };
        let [a, b] = [s, t].map(|s| &view.segments[s as usize]);
        let width = a.width.min(b.width);
        let middle = Vec3::from(a.point).distance(Vec3::from(b.point));
        let jump = (depths.0 - depths.1).abs().min(middle);
        let segment = &view.segments[superpixel as usize];
        // The support is one surface anyway.
        let is_support = planes.iter().any(|p| p.holds(segment));
        let [x, y] = [0, 1].map(|k| border.at_px[k] - segment.center_px[k]);
        let length = x.hypot(y).max(1e-6);
        (width > 0.0 && jump > NEARER * width && !is_support).then_some(End {
            superpixel,
            segment,
            at_px: border.at_px,
            ahead: [x / length, y / length],
            length_px: border.length_px,
        })
    };
    view.borders.iter().filter_map(of).collect()
}

/// How well one end leads to the other, 0 to 1.
fn related(a: &End<'_>, b: &End<'_>) -> f32 {
    let [x, y] = [0, 1].map(|k| b.at_px[k] - a.at_px[k]);
    let apart_px = x.hypot(y);
    let toward = |e: &End<'_>| (e.ahead[0] * x + e.ahead[1] * y) / apart_px;
    let near = apart_px > 3.0 && apart_px < REACH_PX && a.superpixel != b.superpixel;
    if !(near && toward(a) > AHEAD && toward(b) < -AHEAD) {
        return 0.0;
    }
    let (apart, width) = (apart(a, b), mean_width(a, b));
    let reach = apart.length() / (REACH * width);
    let direction = apart.normalize_or_zero();
    let [na, nb] = [a, b].map(|e| Vec3::from(e.segment.normal));
    // The normals at the ends of an arc are mirror images across its middle.
    let leaning = na.dot(direction);
    let twist = (na - 2.0 * leaning * direction).dot(nb).clamp(-1.0, 1.0).acos();
    let bend = leaning.abs().min(1.0).asin();
    if !(reach < 1.0 && twist < 2.0 * TWIST && bend < 2.0 * BEND) {
        return 0.0;
    }
    (-(twist / TWIST).powi(2) - (bend / BEND).powi(2) - (2.0 * reach).powi(2)).exp()
}

fn apart(a: &End<'_>, b: &End<'_>) -> Vec3 {
    Vec3::from(b.segment.point) - Vec3::from(a.segment.point)
}

fn mean_width(a: &End<'_>, b: &End<'_>) -> f32 {
    0.5 * (a.segment.width + b.segment.width)
}

/// Whether something nearer is seen all the way between the ends.
fn is_hidden(view: &ViewData, a: &End<'_>, b: &End<'_>) -> bool {
    let margin = HIDDEN * mean_width(a, b);
    BETWEEN.iter().all(|&t| {
        let [x, y] = [0, 1].map(|k| f64::from(a.at_px[k] + t * (b.at_px[k] - a.at_px[k])));
        let point = Vec3::from(a.segment.point) + t * apart(a, b);
        let depth = view.depth_at(x, y).unwrap_or(0.0);
        view.project(point).is_some_and(|(_, z)| depth > 0.0 && depth < z as f32 - margin)
    })
}

/// Whether some view sees through the place between the ends, just below the arc from one to the other.
fn is_empty(views: &[ViewData], a: &End<'_>, b: &End<'_>) -> bool {
    let (apart, width) = (apart(a, b), mean_width(a, b));
    let [na, nb] = [a, b].map(|e| Vec3::from(e.segment.normal));
    let outwards = (na + nb).normalize_or_zero();
    let leaning = na.dot(apart);
    BETWEEN.iter().any(|&t| {
        let height = -leaning * t * (1.0 - t) - 0.5 * width;
        let point = Vec3::from(a.segment.point) + t * apart + height * outwards;
        views.iter().any(|view| {
            let Some(([x, y], z)) = view.project(point) else { return false };
            let seen = view.depth_at(x, y);
            seen.is_some_and(|depth| depth == 0.0 || depth > z as f32 + EMPTY * width)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_data::Border;
    use motes_raster::LabelVotes;
    use motes_scene::{Pinhole, Pose};

    /// A board at depth 2 behind a bar at depth 1, facing the camera; `depth` is what is seen.
    fn view(depth: impl Fn(u32) -> f32) -> ViewData {
        let segment = |x: f32, z: f32, width: f32| Segment {
            center_px: [x, 5.0],
            area_px: 100.0,
            point: [(x - 15.0) / 10.0 * z, 0.0, z],
            normal: [0.0, 0.0, -1.0],
            width,
            inverse_depth: [0.0, 0.0, 1.0 / z],
            ..Segment::default()
        };
        let labels: Vec<u32> = (0..300).map(|p| p % 30 / 10).collect();
        let border =
            |a: u32, x: f32| Border { segments: [a, a + 1], length_px: 10.0, at_px: [x, 5.0] };
        ViewData {
            camera: Pinhole { fx: 10.0, fy: 10.0, cx: 15.0, cy: 5.0, width: 30, height: 10 },
            camera_from_world: Pose::IDENTITY,
            depth: labels.iter().map(|&l| depth(l)).collect(),
            labels,
            segments: vec![
                segment(5.0, 2.0, 1.0),
                segment(15.0, 1.0, 0.5),
                segment(25.0, 2.0, 1.0),
            ],
            borders: vec![border(0, 10.0), border(1, 20.0)],
            votes: LabelVotes { offsets: vec![0; 4], gaussians: vec![], weights: vec![] },
        }
    }

    #[test]
    fn a_board_goes_on_behind_a_bar_unless_a_view_sees_through() {
        let seen = |label: u32| if label == 1 { 1.0 } else { 2.0 };
        let links = continuations(&[view(seen)], &[0, 3], &[]);
        assert_eq!(links.len(), 1);
        assert_eq!(links[0].nodes, [0, 2]);
        // Straight on, a third of the reach apart.
        let likely = (-(2.0f32 / 3.0).powi(2)).exp();
        assert!((links[0].weight - WEIGHT * likely).abs() < 1e-5, "{}", links[0].weight);
        let through = ViewData { borders: Vec::new(), ..view(|_| 50.0) };
        assert!(continuations(&[view(seen), through], &[0, 3, 6], &[]).is_empty());
    }
}
