//! Sums of contributions per label against the f64 reference.

use motes_raster::reference::{ReferenceGaussians, render_reference};
use motes_raster::{Antialias, NO_LABEL, RenderOptions, label_votes};
use motes_testkit::{orbit_pose, random_gaussians, small_camera};

#[test]
fn votes_are_the_contributions_of_the_reference() {
    let (n, labels) = (40usize, 5usize);
    let gaussians = random_gaussians(3, n, 0);
    let (camera, pose) = (small_camera(50, 37), orbit_pose(0.4));
    let label = |p: usize| match p % 11 {
        10 => NO_LABEL,
        k => (k % labels) as u32,
    };
    let of: Vec<u32> = (0..50 * 37).map(label).collect();
    let options = RenderOptions::default();
    let votes = label_votes(&gaussians, &camera, &pose, &options, &of, labels, 0.0);
    assert_eq!(votes.offsets.len(), labels + 1);
    // A picture in which one Gaussian is white and the others are black shows its contributions.
    let mut reference = ReferenceGaussians::new(&gaussians);
    let mut seen = 0;
    for i in 0..n {
        for (k, sh) in reference.sh.iter_mut().enumerate() {
            *sh = (if k / 3 == i { 0.5 } else { -0.5 }) / 0.282_094_791_773_878_14;
        }
        let picture = render_reference(&reference, &camera, &pose, [0.0; 3], Antialias::Classic);
        let mut expected = vec![0.0; labels];
        for (p, color) in picture.iter().enumerate() {
            if let Some(sum) = expected.get_mut(of[p] as usize) {
                *sum += color[0];
            }
        }
        for (l, expected) in expected.iter().enumerate() {
            let got = votes.of(l).find(|e| e.0 == i as u32).map_or(0.0, |e| f64::from(e.1));
            seen += usize::from(got > 0.1);
            // One contribution at the 1/255 cut-off may flip.
            assert!((got - expected).abs() < 5e-3, "Gaussian {i} label {l}: {got} {expected}");
        }
    }
    assert!(seen > 50, "{seen}");
}

#[test]
fn nothing_to_vote_on_is_fine() {
    let camera = small_camera(8, 8);
    let none = random_gaussians(1, 0, 0);
    let (pose, options) = (orbit_pose(0.0), RenderOptions::default());
    let votes = label_votes(&none, &camera, &pose, &options, &[0; 64], 1, 0.0);
    assert_eq!((votes.offsets.as_slice(), votes.weights.len()), (&[0, 0][..], 0));
    let all = random_gaussians(1, 9, 0);
    let votes = label_votes(&all, &camera, &pose, &options, &[NO_LABEL; 64], 0, 0.0);
    assert_eq!(votes.offsets, [0]);
}
