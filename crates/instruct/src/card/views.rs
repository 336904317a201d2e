//! Which views show an object best.

use motes_formats::scene_card::ObjectDocument;
use motes_raster::{RenderOptions, render};
use motes_scene::Pinhole;

use super::CardInput;

/// Longer side of the pictures that are counted, pixels.
const SIDE: usize = 96;
/// Views that a card names.
const MOST: usize = 3;
/// Share of a picture below which an object is not seen.
const LEAST: f64 = 1e-3;

/// Names the views that show most of each object, behind whatever covers it: its share of the picture. Three objects at a time are drawn
/// white in a channel each, everything else black.
pub(super) fn best_views(input: &CardInput<'_>, objects: &mut [ObjectDocument]) {
    let Some((capture, _)) = input.capture else { return };
    let pinholes: Vec<Option<Pinhole>> =
        capture.views.iter().map(|v| capture.cameras[v.camera].as_pinhole()).collect();
    let options = RenderOptions { antialias: input.antialias, ..RenderOptions::default() };
    for (group, objects) in objects.chunks_mut(3).enumerate() {
        let labeled = &input.labeled[3 * group..];
        let painted = input.gaussians.colored(|row| {
            [0, 1, 2].map(|c| {
                let belongs = labeled.get(c).is_some_and(|l| l.selection.contains(row));
                if belongs { 1.0 } else { 0.0 }
            })
        });
        let mut shares: Vec<Vec<(f64, usize)>> = vec![Vec::new(); objects.len()];
        for (view, full) in pinholes.iter().enumerate() {
            let Some(full) = full else { continue };
            let camera = small(full);
            let pose = capture.views[view].camera_from_world;
            let picture = render(&painted, &camera, &pose, &options).color;
            for (c, shares) in shares.iter_mut().enumerate() {
                let seen: f64 = picture.data.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum();
                shares.push((seen / picture.pixel_count() as f64, view));
            }
        }
        for (object, mut shares) in objects.iter_mut().zip(shares) {
            shares.retain(|(share, _)| *share > LEAST);
            shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let name = |(_, view): &(f64, usize)| capture.views[*view].name.clone();
            object.views = shares.iter().take(MOST).map(name).collect();
        }
    }
}

fn small(camera: &Pinhole) -> Pinhole {
    let factor = SIDE as f64 / camera.width.max(camera.height) as f64;
    let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
    camera.resized(side(camera.width), side(camera.height))
}
