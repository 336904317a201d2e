//! Pictures of a world: buffers of what is seen, and radiance.

use glam::Vec3;
use motes_scene::ImageF32;
use motes_shading::sampling::{PointSet, unit_f64};
use rayon::prelude::*;

use crate::cameras::Shot;
use crate::denoise::{Noisy, denoise};
use crate::path::PathTracer;
use crate::world::World;

/// What every pixel sees; through glass, but for the object.
#[derive(Clone, Debug)]
pub struct Buffers {
    /// Base color, mean over the pixel; linear.
    pub albedo: ImageF32,
    /// Mean over the pixel.
    pub roughness: ImageF32,
    /// Mean over the pixel.
    pub metallic: ImageF32,
    /// Unit shading normal at the center, world.
    pub normal: ImageF32,
    /// z in the camera at the center, world units; infinite where nothing is.
    pub depth: ImageF32,
    /// Position at the center, world.
    pub position: ImageF32,
    /// Share of the pixel that shows anything.
    pub coverage: ImageF32,
    /// Object at the center, glass before what is behind it; 0 for nothing.
    pub ids: Vec<u8>,
}

const PIXEL_PURPOSE: u32 = 1;
/// Points per pixel for the means of the buffers.
const BUFFER_SAMPLES: u32 = 9;

fn jitter(seed: u64, item: u64, sample: u32, samples: u32) -> (f64, f64) {
    let p = PointSet::new(seed, item, PIXEL_PURPOSE, samples).point(sample);
    (unit_f64(p[1]), unit_f64(p[2]))
}

/// The buffers of a view.
pub fn buffers(world: &World, shot: &Shot) -> Buffers {
    let (w, h) = shot.size;
    let rows: Vec<Vec<([f32; 13], u8)>> = (0..h)
        .into_par_iter()
        .map(|y| (0..w).map(|x| buffer_pixel(world, shot, x, y)).collect())
        .collect();
    let pixels: Vec<&([f32; 13], u8)> = rows.iter().flatten().collect();
    let image = |first: usize, n: usize| {
        let data = pixels.iter().flat_map(|p| p.0[first..first + n].to_vec()).collect();
        ImageF32::from_data(w, h, n, data)
    };
    Buffers {
        albedo: image(0, 3),
        roughness: image(3, 1),
        metallic: image(4, 1),
        normal: image(5, 3),
        depth: image(8, 1),
        position: image(9, 3),
        coverage: image(12, 1),
        ids: pixels.iter().map(|p| p.1).collect(),
    }
}

fn buffer_pixel(world: &World, shot: &Shot, x: usize, y: usize) -> ([f32; 13], u8) {
    let mut out = [0.0; 13];
    for i in 0..BUFFER_SAMPLES {
        let (dx, dy) = (f64::from(i % 3) + 0.5, f64::from(i / 3) + 0.5);
        let ray = shot.ray(x as f64 + dx / 3.0, y as f64 + dy / 3.0).0;
        let Some(seen) = world.see_through_glass(&ray) else { continue };
        out[12] += 1.0 / BUFFER_SAMPLES as f32;
        let m = seen.point.material;
        let values = m.base_color_linear.to_array().into_iter().chain([m.roughness, m.metallic]);
        out.iter_mut().zip(values).for_each(|(o, v)| *o += v / BUFFER_SAMPLES as f32);
    }
    let (ray, length) = shot.ray(x as f64 + 0.5, y as f64 + 0.5);
    let Some(seen) = world.see_through_glass(&ray) else {
        out[8] = f32::INFINITY;
        return (out, 0);
    };
    out[5..8].copy_from_slice(&seen.point.shading_normal.to_array());
    out[8] = (f64::from(seen.distance) / length) as f32;
    out[9..12].copy_from_slice(&seen.point.position.to_array());
    (out, seen.object)
}

/// Radiance of a view with `samples` paths per pixel, denoised; `view` keys its random numbers.
pub fn radiance(
    tracer: &PathTracer,
    shot: &Shot,
    guide: &Buffers,
    samples: u32,
    (seed, view): (u64, u64),
) -> ImageF32 {
    let (w, h) = shot.size;
    let rows: Vec<Vec<(Vec3, f32)>> = (0..h)
        .into_par_iter()
        .map(|y| {
            (0..w)
                .map(|x| {
                    let item = (view << 32) | (y * w + x) as u64;
                    let (mut sum, mut squares) = (Vec3::ZERO, 0.0);
                    for i in 0..samples {
                        let (dx, dy) = jitter(seed, item, i, samples);
                        let (ray, _) = shot.ray(x as f64 + dx, y as f64 + dy);
                        let l = tracer.radiance(ray, item, i, samples);
                        sum += l;
                        squares += l.element_sum() * l.element_sum() / 9.0;
                    }
                    let n = samples as f32;
                    let mean = sum / n;
                    let spread = squares / n - (mean.element_sum() / 3.0).powi(2);
                    (mean, spread.max(0.0) / (n - 1.0).max(1.0))
                })
                .collect()
        })
        .collect();
    let pixels = rows.into_iter().flatten();
    let (means, variances): (Vec<Vec3>, Vec<f32>) = pixels.unzip();
    denoise(&Noisy { means, variances }, guide)
}
