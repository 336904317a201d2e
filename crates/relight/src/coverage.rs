//! How much of a pixel is scene and not background.
//!
//! Blended alpha tells it at the rim of things. Inside of them it tells how dark they are: Gaussians are fitted over black, so a dark thing
//! may as well be half transparent, and a background that is brighter than black would shine through it. A pixel counts as inside where
//! nothing within a few pixels is open. Photos that no mask and no alpha channel hides a pixel of say more: all that they show is scene, and
//! only what Gaussians hardly touch is open, such as what no photo shows.

use rayon::prelude::*;

/// Blended alpha never reaches 1; from here on a pixel counts as covered.
const FULL_ALPHA: f32 = 0.95;
/// Least alpha around a pixel at which it begins to count as inside, and from which it is.
const INSIDE: [f32; 2] = [0.3, 0.5];
/// The same where the scene fills the photos.
const INSIDE_FILLED: [f32; 2] = [0.02, 0.06];
/// Pixels that a rim is blurred over, at least, and as a share of the longer side.
const RIM: usize = 3;
const RIM_SHARE: f32 = 1.0 / 160.0;

/// Of every pixel, 0 to 1, from its blended alpha, row by row.
pub(crate) fn coverage(alpha: &[f32], width: usize, height: usize, fills_photos: bool) -> Vec<f32> {
    let inside = if fills_photos { INSIDE_FILLED } else { INSIDE };
    let reach = RIM.max((RIM_SHARE * width.max(height) as f32).round() as usize);
    let rows = least_around(alpha, 1, reach, |i| (i % width, width));
    let least = least_around(&rows, width, reach, |i| (i / width, height));
    let of = |(alpha, least): (&f32, &f32)| {
        let own = (alpha / FULL_ALPHA).min(1.0);
        let t = ((least - inside[0]) / (inside[1] - inside[0])).clamp(0.0, 1.0);
        own + (1.0 - own) * t * t * (3.0 - 2.0 * t)
    };
    alpha.iter().zip(&least).map(of).collect()
}

/// The least of the values up to `reach` steps away, along the axis on which `place` says where a value stands and among how many.
fn least_around(
    values: &[f32],
    step: usize,
    reach: usize,
    place: impl Fn(usize) -> (usize, usize) + Sync,
) -> Vec<f32> {
    let least = |i: usize| {
        let (at, count) = place(i);
        let range = at.saturating_sub(reach)..(at + reach + 1).min(count);
        range.map(|k| values[i + k * step - at * step]).fold(f32::INFINITY, f32::min)
    };
    (0..values.len()).into_par_iter().with_min_len(1024).map(least).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inside_is_full_and_rims_keep_their_alpha() {
        let (width, height) = (40, 30);
        // A dark thing of alpha 0.7 with a soft right rim, beyond which all is open.
        let at = |x: usize| match x {
            0..20 => 0.7,
            20 => 0.35,
            _ => 0.0,
        };
        let alpha: Vec<f32> = (0..width * height).map(|i| at(i % width)).collect();
        let found = coverage(&alpha, width, height, false);
        assert!((0..height).all(|y| found[y * width] == 1.0 && found[y * width + 10] == 1.0));
        for x in [18, 20, 25] {
            assert_eq!(found[15 * width + x], at(x) / FULL_ALPHA, "{x}");
        }
        assert!(coverage(&[0.2; 9], 3, 3, false).iter().all(|c| *c == 0.2 / FULL_ALPHA));
        assert!(coverage(&[0.97; 9], 3, 3, false).iter().all(|c| *c == 1.0));
        assert!(coverage(&[], 0, 0, false).is_empty());
    }

    #[test]
    fn a_scene_that_fills_the_photos_is_dark_and_not_open() {
        assert!(coverage(&[0.2; 9], 3, 3, true).iter().all(|c| *c == 1.0));
        // Beyond what the photos show.
        assert!(coverage(&[0.0; 9], 3, 3, true).iter().all(|c| *c == 0.0));
        let least = coverage(&[0.01; 9], 3, 3, true);
        assert!(least.iter().all(|c| *c == 0.01 / FULL_ALPHA), "{least:?}");
    }
}
