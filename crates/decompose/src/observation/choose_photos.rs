//! Which photos of a large capture are looked at.

use glam::Vec3;
use motes_scene::{Pinhole, Pose};

use super::traced_surface::project;

/// Points of the scene that photos are judged by.
const POINTS: usize = 2000;
/// Photos of a point whose directions differ by more than this angle, radians, tell no more than at this angle.
const APART: f32 = 0.5;
/// Worth of the first photo of a point, in angles of [`APART`].
const FIRST: f32 = 3.0;

/// At most `most` of the photos, 0 for all, by index and in their order. Those of `always` are among them. The others are taken one by
/// one, always the one that tells most of the points: each point counts the angle to the nearest photo that shows it already, times
/// how finely this one shows it, 1 for the finest of all (a submodular cover; greedy choice reaches 1 - 1/e of the best, Nemhauser
/// et al. 1978). What hides a point is not looked at.
pub fn choose_photos(
    cameras: &[(Pinhole, Pose)],
    points: &[[f32; 3]],
    most: usize,
    always: &[usize],
) -> Vec<usize> {
    if most == 0 || cameras.len() <= most {
        return (0..cameras.len()).collect();
    }
    let finite = points.iter().map(|p| Vec3::from(*p)).filter(|p| p.is_finite());
    let all: Vec<Vec3> = finite.collect();
    let points: Vec<Vec3> =
        all.iter().step_by(all.len().div_ceil(POINTS).max(1)).copied().collect();
    let shown: Vec<Vec<Shown>> = cameras.iter().map(|camera| shown(camera, &points)).collect();
    let mut finest = vec![0.0f32; points.len()];
    shown.iter().flatten().for_each(|s| finest[s.point] = finest[s.point].max(s.fineness));
    let mut told: Vec<Vec<Vec3>> = vec![Vec::new(); points.len()];
    let mut chosen = vec![false; cameras.len()];
    let worth = |s: &Shown, told: &[Vec<Vec3>]| {
        let angles = told[s.point].iter().map(|d| d.angle_between(s.toward).min(APART) / APART);
        angles.fold(FIRST, f32::min) * s.fineness / finest[s.point]
    };
    for step in 0..most.max(always.len()) {
        let gain = |k: usize| shown[k].iter().map(|s| worth(s, &told)).sum::<f32>();
        let next = always.get(step).copied().or_else(|| {
            let open = (0..cameras.len()).filter(|&k| !chosen[k]).map(|k| (k, gain(k)));
            // The first of equals.
            open.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(k, _)| k)
        });
        let Some(next) = next else { break };
        if !std::mem::replace(&mut chosen[next], true) {
            shown[next].iter().for_each(|s| told[s.point].push(s.toward));
        }
    }
    (0..cameras.len()).filter(|&k| chosen[k]).collect()
}

/// A point in a photo.
struct Shown {
    point: usize,
    /// Unit vector from the point to the camera.
    toward: Vec3,
    /// Pixels per world unit.
    fineness: f32,
}

fn shown((camera, pose): &(Pinhole, Pose), points: &[Vec3]) -> Vec<Shown> {
    let eye = pose.center_in_world().as_vec3();
    let of = |(point, p): (usize, &Vec3)| {
        let (x, y, z) = project(camera, pose, *p)?;
        let is_inside = x >= 0.0 && y >= 0.0 && x < camera.width as f32 && y < camera.height as f32;
        let fineness = camera.fx as f32 / z;
        let toward = (eye - *p).normalize_or_zero();
        (is_inside && fineness.is_finite()).then_some(Shown { point, toward, fineness })
    };
    points.iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: usize, step: f64) -> Vec<(Pinhole, Pose)> {
        let camera = motes_testkit::small_camera(48, 32);
        (0..count).map(|k| (camera, motes_testkit::orbit_pose(k as f64 * step))).collect()
    }

    fn points() -> Vec<[f32; 3]> {
        motes_testkit::random_gaussians(300, 40, 0).means
    }

    #[test]
    fn few_photos_are_all_taken_and_many_are_spread() {
        let all = ring(40, 0.15);
        assert_eq!(choose_photos(&all, &points(), 0, &[]).len(), 40);
        assert_eq!(choose_photos(&all, &points(), 40, &[]).len(), 40);
        let chosen = choose_photos(&all, &points(), 10, &[]);
        assert_eq!(chosen.len(), 10);
        let widest = chosen.windows(2).map(|w| w[1] - w[0]).max();
        assert!(widest < Some(12), "no side is left out: {chosen:?}");
    }

    #[test]
    fn a_burst_from_one_side_is_worth_one_photo() {
        let mut all = ring(20, 1e-3);
        all.extend(ring(6, 1.0).into_iter().skip(1));
        let chosen = choose_photos(&all, &points(), 6, &[]);
        assert_eq!(chosen.iter().filter(|&&k| k < 20).count(), 1, "{chosen:?}");
    }

    #[test]
    fn photos_that_are_asked_for_stay_and_nothing_is_no_trouble() {
        let all = ring(20, 0.2);
        let chosen = choose_photos(&all, &points(), 3, &[7, 8, 7]);
        assert_eq!(chosen.len(), 3.min(chosen.len()));
        assert!(chosen.contains(&7) && chosen.contains(&8));
        for points in [vec![], vec![[f32::NAN; 3]; 4], vec![[1e30; 3]; 4]] {
            assert_eq!(choose_photos(&all, &points, 5, &[]).len(), 5);
        }
    }
}
