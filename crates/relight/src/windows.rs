//! Windows of a room: what burns out far behind everything.
//!
//! A window that photos show clipped has next to nothing that would tell its place. Its Gaussians lie anywhere behind the room, and shine
//! there whatever light is asked for. In a scene with lamps they are sky: the new light shows in their place.

use glam::Vec3;
use motes_math::luminance::luminance;
use motes_math::median::quantile;
use motes_math::srgb;
use motes_scene::{Gaussians, Surface};

/// Captured linear luminance from which on something was clipped: the mean exposure of the photos may be less than that of the one that
/// shows it.
const CLIPPED: f32 = 0.8;
/// Distance from the middle of the surface over that of nearly all of it from which on nothing is part of the room.
const FAR: f32 = 2.0;
/// Share of the surface that is nearly all of it.
const NEARLY_ALL: f32 = 0.99;

/// The share of sky of every Gaussian with windows as sky, where the surface has lamps.
pub(crate) fn with_windows(
    gaussians: &Gaussians,
    surface: &Surface,
    sky: Option<Vec<f32>>,
) -> Option<Vec<f32>> {
    if !surface.shines() {
        return sky;
    }
    let Some((middle, size)) = extent(surface) else { return sky };
    let is_window = |i: usize| {
        (Vec3::from(gaussians.means[i]) - middle).length() > FAR * size
            && is_clipped(gaussians, i as u32)
    };
    let windows: Vec<usize> = (0..gaussians.len()).filter(|&i| is_window(i)).collect();
    if windows.is_empty() {
        return sky;
    }
    let mut sky = sky.unwrap_or_else(|| vec![0.0; gaussians.len()]);
    windows.into_iter().for_each(|i| sky[i] = 1.0);
    Some(sky)
}

/// Whether photos show a Gaussian clipped, by its captured color as a mean over directions.
pub(crate) fn is_clipped(gaussians: &Gaussians, i: u32) -> bool {
    let linear = gaussians.mean_color(i as usize).map(|v| srgb::decode(v.clamp(0.0, 1.0)));
    luminance(linear) >= CLIPPED
}

/// Middle of the vertices, and the distance of nearly all of them from it.
fn extent(surface: &Surface) -> Option<(Vec3, f32)> {
    let middle = |axis: usize| {
        let mut all: Vec<f32> = surface.vertices.iter().map(|v| v[axis]).collect();
        quantile(&mut all, 0.5)
    };
    let middle = Vec3::new(middle(0)?, middle(1)?, middle(2)?);
    let mut all: Vec<f32> =
        surface.vertices.iter().map(|v| (Vec3::from(*v) - middle).length()).collect();
    Some((middle, quantile(&mut all, NEARLY_ALL)?))
}

#[cfg(test)]
mod tests {
    use motes_math::sh::SH_C0;

    use super::*;

    /// White near and far, gray far; and a surface about the middle.
    fn sky(emission: f32, sky: Option<Vec<f32>>) -> Option<Vec<f32>> {
        let colors = [1.0f32, 1.0, 0.5];
        let gaussians = Gaussians {
            means: vec![[0.5, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 9.0, 0.0]],
            sh: colors.iter().flat_map(|v| [(v - 0.5) / SH_C0 as f32; 3]).collect(),
            ..Gaussians::empty(0)
        };
        let vertices: Vec<[f32; 3]> = (0..100)
            .map(|i| [(i % 10) as f32 - 4.5, (i / 10) as f32 - 4.5, 0.0].map(|v| v / 4.5))
            .collect();
        let emission_linear = vec![[emission; 3]; vertices.len()];
        let surface = Surface { vertices, emission_linear, ..Surface::default() };
        with_windows(&gaussians, &surface, sky)
    }

    #[test]
    fn what_is_clipped_far_behind_a_room_with_lamps_is_sky() {
        assert_eq!(sky(3.0, None), Some(vec![0.0, 1.0, 0.0]));
        assert_eq!(sky(3.0, Some(vec![0.3, 0.2, 0.1])), Some(vec![0.3, 1.0, 0.1]));
    }

    #[test]
    fn without_lamps_nothing_changes() {
        assert_eq!(sky(0.0, None), None);
        assert_eq!(sky(0.0, Some(vec![0.3, 0.2, 0.1])), Some(vec![0.3, 0.2, 0.1]));
        let nothing = with_windows(&Gaussians::empty(0), &Surface::default(), None);
        assert_eq!(nothing, None);
    }
}
