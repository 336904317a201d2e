use motes_scene::{Pinhole, Pose};

use super::*;
use crate::SimdLevel;
use crate::options::{Modifiers, RenderOptions};

/// One pixel alone, splat by splat: depth of the mean and of the median, and the normal.
fn of_pixel(seen: &Seen<'_>, list: row::List<'_>, at: [f32; 2]) -> PixelAovs {
    let slope = |k: usize| (at[k] - seen.view.principal[k]) / seen.view.focal[k];
    let ray = Vec3::new(slope(0), slope(1), 1.0);
    let mut transmittance = 1.0f32;
    let (mut depth, mut weights, mut normal, mut median) = (0.0f32, 0.0f32, Vec3::ZERO, 0.0f32);
    for (splat, shape) in row::splats(list, seen.shapes) {
        let degree = seen.parameters.exp_degree.into();
        let Some(alpha) = splat.alpha_at(at[0], at[1], degree) else { continue };
        let weight = alpha * transmittance;
        let at = shape.depth(ray, splat.depth);
        depth += weight * at;
        normal += weight * shape.normal;
        weights += weight;
        let next = transmittance - weight;
        if transmittance > 0.5 && next <= 0.5 {
            median = at;
        }
        transmittance = next;
        if transmittance < seen.parameters.transmittance_min {
            break;
        }
    }
    let depth_expected = if weights > 0.0 { depth / weights } else { 0.0 };
    PixelAovs { depth_expected, depth_median: median, normal: normal.normalize_or_zero() }
}

#[test]
fn pixels_side_by_side_have_what_each_has_alone_to_the_bit_with_all_instructions() {
    use SimdLevel::{Avx2, Avx512, Baseline, Best, Sse42};
    let gaussians = motes_testkit::random_gaussians(700, 41, 0);
    let camera = Pinhole { width: 61, height: 43, fx: 50.0, fy: 52.0, cx: 30.0, cy: 21.0 };
    let pose: Pose = motes_testkit::orbit_pose(0.4);
    for (tile_size, exp_degree) in [(8, 3), (16, 4), (32, 5)] {
        for simd in [Best, Avx512, Avx2, Sse42, Baseline] {
            let mut options = RenderOptions::default();
            options.parameters.tile_size = tile_size;
            options.parameters.exp_degree = exp_degree;
            if simd.level().is_none() {
                continue;
            }
            options.parameters.simd = simd;
            let parameters = &options.parameters;
            let view = ViewTransform::new(&camera, &pose);
            let mut frame = Frame::new();
            frame.forward(&gaussians, &view, &Modifiers::default(), &options);
            let shapes = shapes(&frame, &gaussians, &view);
            let seen = Seen { shapes: &shapes, view: &view, parameters };
            let all = tile_aovs(&frame, &gaussians, &view, parameters);
            let mut covered = 0;
            for (i, at) in (0..61 * 43).map(|i| (i, [i % 61, i / 61])) {
                let list = frame.bins().list_at(at[0], at[1]);
                let alone = of_pixel(&seen, list, at.map(|v| v as f32 + 0.5));
                let together = PixelAovs {
                    depth_expected: all.depth_expected.data[i],
                    depth_median: all.depth_median.data[i],
                    normal: Vec3::from_slice(&all.normal_in_world.data[3 * i..]),
                };
                assert_eq!(alone, together, "{at:?} {simd:?} {tile_size}");
                covered += usize::from(alone.depth_median > 0.0);
            }
            assert!(covered > 300, "{covered}");
        }
    }
}
