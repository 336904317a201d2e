//! Lanes against one Gaussian at a time, at every instruction set.

use fearless_simd::dispatch;
use motes_testkit::{orbit_pose, random_gaussians, small_camera};

use super::*;
use crate::gradients::GaussianGradients;
use crate::lanes::tests::levels;
use crate::parameters::RasterParameters;
use rayon::prelude::*;

/// Not a multiple of any number of lanes.
const COUNT: usize = 1003;

struct Case {
    gaussians: Gaussians,
    filter_3d: Vec<f32>,
    options: RenderOptions,
    view: ViewTransform,
}

impl Case {
    fn new(degree: u8, limit: Option<u8>, filtered: bool, antialias: Antialias) -> Self {
        let mut gaussians = random_gaussians(40 + u64::from(degree), COUNT, degree);
        // Broken ones between the others.
        gaussians.means[17] = [f32::NAN; 3];
        gaussians.rotations[21] = [0.0; 4];
        gaussians.log_scales[33] = [90.0, f32::NAN, 0.0];
        gaussians.opacity_logits[40] = f32::NEG_INFINITY;
        let stride = 3 * gaussians.sh_coefficients();
        gaussians.sh[50 * stride] = f32::INFINITY;
        gaussians.sh[51 * stride] = f32::NAN;
        let filter_3d = (0..COUNT).map(|i| if i % 3 == 0 { 0.0 } else { 0.02 }).collect();
        let parameters = RasterParameters { sort: Sorting::Tile, ..RasterParameters::default() };
        let options = RenderOptions {
            sh_degree_limit: limit,
            antialias,
            parameters,
            ..RenderOptions::default()
        };
        // Close, so that some lie behind it and beside the picture.
        let mut pose = orbit_pose(0.4);
        pose.translation.z -= 1.6;
        let view = ViewTransform::new(&small_camera(120, 90), &pose);
        Self { gaussians, filter_3d: if filtered { filter_3d } else { Vec::new() }, options, view }
    }

    fn modifiers(&self) -> Modifiers<'_> {
        Modifiers::with_filter(&self.filter_3d)
    }

    fn expected(&self) -> Vec<Splat> {
        let cutoffs = Cutoffs::new(&self.options);
        let of =
            |i| project(&self.view, &self.gaussians, i, &self.modifiers(), &self.options, &cutoffs);
        (0..COUNT).map(of).collect()
    }
}

fn cases() -> Vec<Case> {
    let mip = Antialias::Mip;
    let mut cases: Vec<Case> =
        (0..=4).map(|degree| Case::new(degree, None, degree % 2 == 0, mip)).collect();
    cases.push(Case::new(3, Some(1), true, Antialias::Classic));
    cases
}

/// Relative to the larger of a value and of what it is a difference of.
fn close(a: f32, b: f32, unit: f32) -> bool {
    (a - b).abs() <= 2e-5 * b.abs().max(unit)
}

#[test]
fn projection_in_lanes_is_that_of_one_gaussian() {
    for (c, case) in cases().iter().enumerate() {
        let expected = case.expected();
        let visible = expected.iter().filter(|splat| splat.is_visible()).count();
        assert!(visible > COUNT / 4 && visible < COUNT, "{visible} visible");
        for level in levels() {
            let mut got = vec![Splat::INVISIBLE; COUNT];
            let (view, g, modifiers) = (&case.view, &case.gaussians, case.modifiers());
            dispatch!(level, simd => crate::project::project(
                simd, view, g, 0, &modifiers, &case.options, &mut got,
            ));
            for (i, (got, expected)) in got.iter().zip(&expected).enumerate() {
                assert_eq!(got.is_visible(), expected.is_visible(), "{c} {level:?} {i}");
                for (k, (a, b)) in got.values().iter().zip(expected.values()).enumerate() {
                    let unit = if k < 2 { expected.half_height.max(1.0) } else { 1.0 };
                    assert!(close(*a, b, unit), "{c} {level:?} {i}, value {k}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn the_chain_in_lanes_is_that_of_one_gaussian() {
    for (c, case) in cases().iter().enumerate() {
        let (view, g, modifiers, options) =
            (&case.view, &case.gaussians, case.modifiers(), &case.options);
        let splats = case.expected();
        let mut moments: Vec<[f32; MOMENTS]> = (0..COUNT)
            .map(|i| std::array::from_fn(|k| (i as f32 * 1.7 + k as f32 * 2.3).sin() * 1e-3))
            .collect();
        moments[5] = [f32::NAN; MOMENTS];
        moments[7][6] = f32::INFINITY;
        for level in levels() {
            let mut got = GaussianGradients::default();
            got.resize(g);
            got.sh.fill(f32::NAN);
            got.par_chunks_mut(COUNT).for_each(|mut rows| {
                dispatch!(level, simd => crate::project_backward::project_backward(
                    simd, view, g, 0, &modifiers, options, &splats, &moments, &mut rows,
                ));
            });
            let stride = 3 * g.sh_coefficients();
            for i in 0..COUNT {
                assert_eq!(got.seen[i], splats[i].is_visible());
                let mut sh = vec![0.0; stride];
                let (splat, m) = (&splats[i], &moments[i]);
                let row = match splat.is_visible() {
                    true => project_backward(view, g, i, &modifiers, options, splat, m, &mut sh),
                    false => RowGradient::default(),
                };
                let check = |name: &str, a: &[f32], b: &[f32]| {
                    let size = b.iter().fold(0.0f32, |size, v| size.max(v.abs()));
                    for (a, b) in a.iter().zip(b) {
                        let near = (a - b).abs() <= 1e-4 * size + 1e-9;
                        assert!(near, "{c} {level:?} {i} {name}: {a} {b}, size {size}");
                    }
                };
                check("mean", &got.means[i], &row.mean);
                check("rotation", &got.rotations[i], &row.rotation);
                check("log scale", &got.log_scales[i], &row.log_scale);
                check("opacity", &[got.opacity_logits[i]], &[row.opacity_logit]);
                check("norm", &[got.center_norm[i]], &[row.center_norm]);
                check("sh", &got.sh[i * stride..(i + 1) * stride], &sh);
            }
        }
    }
}
