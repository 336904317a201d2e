//! Sparse points as structure from motion would leave them: visible surface points with tracks.

use glam::Vec3;
use motes_math::rng::keyed_rng;
use motes_shading::tracing::{Ray, offset_origin};
use rand::RngExt;

use crate::photos::Photos;
use crate::world::World;

/// Points per photo.
const PER_VIEW: usize = 240;
/// Photos that see a point, at most.
const LONGEST_TRACK: usize = 6;
/// Standard deviation of a keypoint, pixels.
const NOISE_PX: f64 = 0.4;
const STREAM: u64 = 0x9017;

/// A point with the photos that see it.
#[derive(Clone, Debug)]
pub struct SparsePoint {
    /// World, with the error that its keypoints leave.
    pub position: Vec3,
    /// 8-bit sRGB.
    pub color: [u8; 3],
    /// Mean distance of keypoint and projection, pixels.
    pub error: f64,
    /// Photo and pixel.
    pub track: Vec<(usize, [f64; 2])>,
}

/// Points that at least three photos see.
pub(crate) fn sparse_points(world: &World, photos: &Photos, seed: u64) -> Vec<SparsePoint> {
    let mut points = Vec::new();
    for (view, shot) in photos.shots[..photos.train].iter().enumerate() {
        let mut rng = keyed_rng(seed, STREAM, view as u64);
        let (w, h) = shot.size;
        for _ in 0..PER_VIEW {
            let pixel = [rng.random::<f64>() * w as f64, rng.random::<f64>() * h as f64];
            let Some(seen) = world.see(&shot.ray(pixel[0], pixel[1]).0) else { continue };
            let (p, n) = (seen.point.position, seen.point.geometric_normal);
            let mut others: Vec<usize> = (0..photos.train).filter(|&i| i != view).collect();
            // Nearest cameras first: they match best.
            let center = |i: usize| photos.shots[i].camera_from_world.center_in_world();
            others.sort_by(|&a, &b| {
                (center(a) - center(view)).length().total_cmp(&(center(b) - center(view)).length())
            });
            let mut track = vec![(view, pixel)];
            for i in others {
                let Some(at) = photos.shots[i].project(p) else { continue };
                let to = center(i).as_vec3() - p;
                let ray = Ray::new(offset_origin(p, n, to.normalize(), 0.0), to.normalize());
                let open = n.dot(to) > 0.2 * to.length() && !world.occluded(&ray);
                if open && track.len() < LONGEST_TRACK {
                    track.push((i, at));
                }
            }
            if track.len() < 3 {
                continue;
            }
            let mut normal =
                || (0..6).map(|_| rng.random::<f64>() - 0.5).sum::<f64>() * 2f64.sqrt();
            for (_, at) in &mut track {
                at.iter_mut().for_each(|v| *v += NOISE_PX * normal());
            }
            // A keypoint's error over the focal length is an angle; depth suffers more.
            let reach = (center(view).as_vec3() - p).length() / shot.focal as f32;
            let off = Vec3::from_array(std::array::from_fn(|_| normal() as f32));
            let spread = 1.5 * NOISE_PX as f32 * reach / (track.len() as f32).sqrt();
            let position = p + off * spread;
            let (x, y) = ((pixel[0] as usize).min(w - 1), (pixel[1] as usize).min(h - 1));
            let color = photos.pixel(view, x, y);
            let error = |(i, at): &(usize, [f64; 2])| {
                let q = photos.shots[*i].project(position).unwrap_or(*at);
                (q[0] - at[0]).hypot(q[1] - at[1])
            };
            let error = track.iter().map(error).sum::<f64>() / track.len() as f64;
            points.push(SparsePoint { position, color, error, track });
        }
    }
    points
}
