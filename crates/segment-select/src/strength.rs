//! How strongly two neighboring superpixels are parted, 0 to 1.
//!
//! Four cues, each a probability that an object ends here, combined as independent: a jump of depth where
//! the planes of the two meet, a concave fold (objects are mostly convex and stand concavely on what
//! carries them: Stein et al. 2014, "Object partitioning using local convexity"), a change of color
//! (weak: objects have patterns), and leaving a plane that bounds the scene.

use glam::Vec3;

use crate::color::difference;
use crate::plane::SupportPlane;
use crate::view_data::{Segment, ViewData};

/// A jump of this share of a superpixel's side is as likely an edge as not.
const JUMP: f32 = 0.6;
/// A concave fold of this angle, radians, likewise.
const CONCAVE: f32 = 0.7;
/// Likewise for colors, CIE L*a*b*.
const COLOR: f32 = 35.0;
/// What each cue can say at most. A jump is certain, color is mere pattern more often than not.
const CONCAVE_MOST: f32 = 0.75;
const CONVEX_MOST: f32 = 0.1;
const COLOR_MOST: f32 = 0.35;
const SUPPORT_MOST: f32 = 0.7;
/// Superpixels of two views that face different ways do not show the same place.
const TURNED: f32 = 0.9;
const TURNED_MOST: f32 = 0.6;

/// Gaussian step from 0 at 0 to `1 - 1/e` at `unit`.
fn step(value: f32, unit: f32) -> f32 {
    1.0 - (-(value / unit).powi(2)).exp()
}

fn either(cues: &[f32]) -> f32 {
    1.0 - cues.iter().map(|c| 1.0 - c).product::<f32>()
}

/// Between two superpixels that touch in a view, at a pixel of their border.
pub(crate) fn across_border(
    view: &ViewData,
    [a, b]: [u32; 2],
    at_px: [f32; 2],
    planes: &[SupportPlane],
) -> f32 {
    let (s, t) = (&view.segments[a as usize], &view.segments[b as usize]);
    match (s.width > 0.0, t.width > 0.0) {
        (true, true) => {}
        (false, false) => return COLOR_MOST * step(difference(s.lab, t.lab), COLOR),
        _ => return 1.0,
    }
    let depths = (view.plane_depth(a, at_px), view.plane_depth(b, at_px));
    let jump = match depths {
        (Some(za), Some(zb)) => {
            // Planes of small superpixels extrapolate badly: never more than their middles say.
            let middle = Vec3::from(s.point).distance(Vec3::from(t.point));
            step((za - zb).abs().min(middle) / s.width.min(t.width), JUMP)
        }
        _ => 1.0,
    };
    either(&[jump, fold(s, t), color(s, t), support(s, t, planes)])
}

/// Between a superpixel and the one of another view that shows the same place.
pub(crate) fn across_views(s: &Segment, t: &Segment, planes: &[SupportPlane]) -> f32 {
    let angle = Vec3::from(s.normal).dot(Vec3::from(t.normal)).clamp(-1.0, 1.0).acos();
    either(&[color(s, t), support(s, t, planes), TURNED_MOST * step(angle, TURNED)])
}

/// By color alone, 0 to [`COLOR_MOST`].
pub(crate) fn color(s: &Segment, t: &Segment) -> f32 {
    COLOR_MOST * step(difference(s.lab, t.lab), COLOR)
}

fn fold(s: &Segment, t: &Segment) -> f32 {
    let (ns, nt) = (Vec3::from(s.normal), Vec3::from(t.normal));
    let apart = (Vec3::from(s.point) - Vec3::from(t.point)).normalize_or_zero();
    let angle = ns.dot(nt).clamp(-1.0, 1.0).acos();
    // Positive where the normals part: convex.
    let convexity = (ns - nt).dot(apart);
    let most = if convexity < 0.0 { CONCAVE_MOST } else { CONVEX_MOST };
    most * step(angle, CONCAVE)
}

fn support(s: &Segment, t: &Segment, planes: &[SupportPlane]) -> f32 {
    let leaves = |plane: &SupportPlane| {
        let share = |s: &Segment| plane.membership(Vec3::from(s.point), s.width);
        (share(s) - share(t)).abs()
    };
    SUPPORT_MOST * planes.iter().map(leaves).fold(0.0, f32::max)
}
