//! What a phone does to a picture: from radiance to the bytes of a photo, and the poses that are told of it.
//!
//! ```text
//! radiance x exposure -> motion -> defocus -> vignetting -> exposure and white balance -> noise -> sRGB -> tone curve -> 8 bits -> JPEG
//! ```

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use motes_formats::images::{encode_jpeg, read_image_from};
use motes_math::rng::keyed_rng;
use motes_math::srgb;
use motes_scene::{ImageF32, ImageU8, Pose};
use rand::RngExt;

use crate::cameras::Shot;
use crate::faults::Fault;

/// Standard deviation of a pose's rotation: about half a pixel at 500 pixels of focal length.
const ROTATION_DEG: f64 = 0.05;
/// Of its center, over the distance to the target.
const CENTER_SHARE: f64 = 1e-3;
const EXPOSURE_STOPS: f64 = 0.25;
const WHITE_BALANCE: f64 = 0.04;
const BLUR_PX: f32 = 0.6;
/// Longest way of a point of the picture while the shutter is open, pixels, and points along it that are averaged.
const MOTION_PX: f64 = 3.0;
const MOTION_STEPS: u32 = 13;
/// Electrons at white, a phone's small pixel, and of reading it.
const FULL_WELL: f32 = 3000.0;
const READ_NOISE: f32 = 4.0;
/// Share of the smoothstep in the tone curve.
const CONTRAST: f32 = 0.5;
const JPEG_QUALITY: u8 = 88;
const STREAM: u64 = 0xca3e;
/// Of its own, so that the numbers of the other faults stay as they are.
const MOTION_STREAM: u64 = 0xca3f;

/// A camera with its faults.
#[derive(Clone, Debug, Default)]
pub struct Camera {
    /// What is wrong with it.
    pub faults: Vec<Fault>,
    /// Key of all random numbers.
    pub seed: u64,
}

impl Camera {
    fn has(&self, fault: Fault) -> bool {
        self.faults.contains(&fault)
    }

    /// Photo `view` of `linear` values, 1 for white, with a lens of `focal` pixels.
    pub fn photo(&self, linear: &ImageF32, focal: f64, view: u64) -> ImageU8 {
        let mut rng = keyed_rng(self.seed, STREAM, 2 * view);
        let mut image = linear.clone();
        if self.has(Fault::MotionBlur) {
            let mut rng = keyed_rng(self.seed, MOTION_STREAM, view);
            let (length, angle) = (MOTION_PX * rng.random::<f64>(), PI * rng.random::<f64>());
            image = moved(&image, [length * angle.cos(), length * angle.sin()]);
        }
        if self.has(Fault::Defocus) {
            image = blurred(&image);
        }
        if self.has(Fault::Vignetting) {
            vignette(&mut image, focal as f32);
        }
        // Drawn always: one fault more leaves the numbers of the others as they are.
        let [stops, red, blue] = [(); 3].map(|()| normal(&mut rng));
        let drift = |fault, log: f64| if self.has(fault) { log.exp() as f32 } else { 1.0 };
        let exposure = drift(Fault::ExposureDrift, stops * EXPOSURE_STOPS * 2f64.ln());
        let balance = |log: f64| drift(Fault::WhiteBalanceDrift, log * WHITE_BALANCE);
        let gains = [exposure * balance(red), exposure, exposure * balance(blue)];
        for pixel in image.data.chunks_exact_mut(3) {
            for (value, gain) in pixel.iter_mut().zip(gains) {
                *value *= gain;
                if self.has(Fault::SensorNoise) {
                    let electrons = value.max(0.0) * FULL_WELL + READ_NOISE * READ_NOISE;
                    *value += normal(&mut rng) as f32 * electrons.sqrt() / FULL_WELL;
                }
            }
        }
        let developed = self.developed(&image);
        if !self.has(Fault::Jpeg) {
            return developed;
        }
        let bytes = encode_jpeg(&developed, JPEG_QUALITY);
        read_image_from(&bytes, std::path::Path::new("photo.jpg")).unwrap_or(developed)
    }

    /// The picture that the camera would show without noise and drift.
    pub fn developed(&self, linear: &ImageF32) -> ImageU8 {
        let data = linear.data.iter().map(|&v| self.encode(v)).collect();
        ImageU8::from_data(linear.width, linear.height, linear.channels, data)
    }

    /// The byte of a linear value, 1 for white.
    pub fn encode(&self, linear: f32) -> u8 {
        let v = srgb::encode_clipped(linear);
        let curve = if self.has(Fault::ToneCurve) { CONTRAST } else { 0.0 };
        let s = v * v * (3.0 - 2.0 * v);
        ((v + curve * (s - v)) * 255.0).round() as u8
    }

    /// The shots as they are told: with poses that are a little off.
    pub fn told(&self, shots: &[Shot], target: DVec3) -> Vec<Shot> {
        let mut told = shots.to_vec();
        if !self.has(Fault::PoseNoise) {
            return told;
        }
        for (shot, view) in told.iter_mut().zip(0u64..) {
            let mut rng = keyed_rng(self.seed, STREAM, 2 * view + 1);
            let mut off = || DVec3::from_array([(); 3].map(|()| normal(&mut rng)));
            let (turn, shift) = (off() * ROTATION_DEG.to_radians(), off());
            let center = shot.camera_from_world.center_in_world();
            let moved = center + shift * CENTER_SHARE * (center - target).length();
            let rotation = DQuat::from_scaled_axis(turn) * shot.camera_from_world.rotation;
            shot.camera_from_world = Pose { rotation, translation: -(rotation * moved) };
        }
        told
    }
}

/// Nearly normal, standard deviation 1: the sum of twelve (Irwin & Hall 1927).
fn normal(rng: &mut impl RngExt) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

fn vignette(image: &mut ImageF32, focal: f32) {
    let (w, h) = (image.width, image.height);
    for (i, pixel) in image.data.chunks_exact_mut(3).enumerate() {
        let (x, y) = ((i % w) as f32 + 0.5 - w as f32 / 2.0, (i / w) as f32 + 0.5 - h as f32 / 2.0);
        let cosine2 = focal * focal / (focal * focal + x * x + y * y);
        pixel.iter_mut().for_each(|v| *v *= cosine2 * cosine2);
    }
}

/// The mean of a picture along a way, which goes through every pixel by half. What is beyond the border is as the border.
fn moved(image: &ImageF32, way: [f64; 2]) -> ImageF32 {
    let (w, h, n) = (image.width, image.height, image.channels);
    let mut out = ImageF32::filled(w, h, n, 0.0);
    let at = |x: isize, y: isize, c: usize| {
        let (x, y) = (x.clamp(0, w as isize - 1) as usize, y.clamp(0, h as isize - 1) as usize);
        image.data[(y * w + x) * n + c]
    };
    for (i, value) in out.data.iter_mut().enumerate() {
        let (x, y, c) = (i / n % w, i / n / w, i % n);
        let tap = |step: u32| {
            let t = f64::from(step) / f64::from(MOTION_STEPS - 1) - 0.5;
            let (px, py) = (x as f64 + t * way[0], y as f64 + t * way[1]);
            let (left, top) = (px.floor() as isize, py.floor() as isize);
            let (fx, fy) = ((px - px.floor()) as f32, (py - py.floor()) as f32);
            let row = |y: isize| at(left, y, c) * (1.0 - fx) + at(left + 1, y, c) * fx;
            row(top) * (1.0 - fy) + row(top + 1) * fy
        };
        *value = (0..MOTION_STEPS).map(tap).sum::<f32>() / MOTION_STEPS as f32;
    }
    out
}

/// Gaussian blur, one axis after the other.
fn blurred(image: &ImageF32) -> ImageF32 {
    let weight = |d: i32| (-0.5 * (d as f32 / BLUR_PX).powi(2)).exp();
    let total: f32 = (-2..=2).map(weight).sum();
    let (w, h, n) = (image.width as i32, image.height as i32, image.channels);
    let pass = |from: &ImageF32, (dx, dy): (i32, i32)| {
        let mut to = from.clone();
        for (i, value) in to.data.iter_mut().enumerate() {
            let (x, y, c) = ((i / n) as i32 % w, (i / n) as i32 / w, i % n);
            let tap = |d: i32| {
                let (xx, yy) = ((x + d * dx).clamp(0, w - 1), (y + d * dy).clamp(0, h - 1));
                from.data[(yy * w + xx) as usize * n + c] * weight(d)
            };
            *value = (-2..=2).map(tap).sum::<f32>() / total;
        }
        to
    };
    pass(&pass(image, (1, 0)), (0, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(value: f32) -> ImageF32 {
        ImageF32::filled(48, 36, 3, value)
    }

    fn camera(faults: &[Fault]) -> Camera {
        Camera { faults: faults.to_vec(), seed: 7 }
    }

    fn mean(image: &ImageU8) -> f64 {
        image.data.iter().map(|v| f64::from(*v)).sum::<f64>() / image.data.len() as f64
    }

    #[test]
    fn a_camera_without_faults_encodes_and_nothing_else() {
        let photo = camera(&[]).photo(&gray(0.25), 40.0, 3);
        let expected = (srgb::encode(0.25f32) * 255.0).round() as u8;
        assert!(photo.data.iter().all(|v| *v == expected));
    }

    #[test]
    fn every_fault_changes_a_photo_and_one_more_leaves_the_others() {
        let mut ramp = gray(0.2);
        ramp.data.iter_mut().enumerate().for_each(|(i, v)| *v += (i / 3 % 48) as f32 / 80.0);
        let plain = camera(&[]).photo(&ramp, 40.0, 1);
        for fault in Fault::ALL.into_iter().filter(|f| *f != Fault::PoseNoise) {
            let photo = camera(&[fault]).photo(&ramp, 40.0, 1);
            assert!(photo != plain, "{fault:?}");
            assert!(photo == camera(&[fault]).photo(&ramp, 40.0, 1), "{fault:?} is not repeated");
        }
        let drift = |faults: &[Fault], view| mean(&camera(faults).photo(&ramp, 40.0, view));
        let means: Vec<f64> = (0..8).map(|v| drift(&[Fault::ExposureDrift], v)).collect();
        let (low, high) = means.iter().fold((255.0f64, 0.0f64), |(a, b), m| (a.min(*m), b.max(*m)));
        assert!(high - low > 8.0, "{means:?}");
        let both = drift(&[Fault::ExposureDrift, Fault::Jpeg], 2);
        assert!((both - means[2]).abs() < 1.0, "{both} {}", means[2]);
    }

    #[test]
    fn a_point_that_moves_is_a_line_of_the_same_light_about_its_place() {
        let mut point = gray(0.0);
        let middle = (18 * 48 + 24) * 3;
        point.data[middle..middle + 3].fill(1.0);
        let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
        for (i, v) in moved(&point, [3.0, 0.0]).data.iter().step_by(3).enumerate() {
            let off = [(i % 48) as f64 - 24.0, (i / 48) as f64 - 18.0];
            sum += f64::from(*v);
            for k in 0..2 {
                first[k] += f64::from(*v) * off[k];
                second[k] += f64::from(*v) * off[k] * off[k];
            }
        }
        assert!(
            (sum - 1.0).abs() < 1e-5 && first.iter().all(|f| f.abs() < 1e-5),
            "{sum} {first:?}"
        );
        // Even over three pixels: 3² / 12, and what linear interpolation adds.
        assert!(second[0] > 0.75 && second[0] < 1.2 && second[1] == 0.0, "{second:?}");
        let lengths: Vec<f64> = (0..40).map(|view| spread_of_motion(&point, view)).collect();
        assert!(lengths.iter().any(|l| *l < 0.3) && lengths.iter().any(|l| *l > 0.7));
    }

    /// Root of the second moments of a moved point of a photo, pixels.
    fn spread_of_motion(point: &ImageF32, view: u64) -> f64 {
        let photo = camera(&[Fault::MotionBlur]).photo(point, 40.0, view);
        let (mut sum, mut second) = (0.0, 0.0);
        for (i, v) in photo.data.iter().step_by(3).enumerate() {
            let light = f64::from(srgb::decode(f32::from(*v) / 255.0));
            let off = [(i % 48) as f64 - 24.0, (i / 48) as f64 - 18.0];
            sum += light;
            second += light * (off[0] * off[0] + off[1] * off[1]);
        }
        (second / sum).sqrt()
    }

    #[test]
    fn shot_noise_grows_with_the_light() {
        let spread = |value: f32| {
            let photo = camera(&[Fault::SensorNoise]).photo(&gray(value), 40.0, 0);
            let linear: Vec<f64> =
                photo.data.iter().map(|v| f64::from(srgb::decode(f32::from(*v) / 255.0))).collect();
            let mean = linear.iter().sum::<f64>() / linear.len() as f64;
            let square = linear.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            (square / linear.len() as f64).sqrt()
        };
        let expected = |v: f64| (v * 3000.0 + 16.0).sqrt() / 3000.0;
        for v in [0.1, 0.5] {
            let (found, wanted) = (spread(v as f32), expected(v));
            assert!((found / wanted - 1.0).abs() < 0.1, "{v}: {found} for {wanted}");
        }
    }

    #[test]
    fn told_poses_are_off_by_what_structure_from_motion_leaves() {
        let pose = Pose::look_at(DVec3::new(3.0, 0.0, 1.0), DVec3::ZERO, DVec3::Z).unwrap();
        let shot = Shot { name: "a".into(), camera_from_world: pose, size: (48, 36), focal: 40.0 };
        let shots = vec![shot; 64];
        let told = camera(&[Fault::PoseNoise]).told(&shots, DVec3::ZERO);
        let off =
            |s: &Shot| (s.camera_from_world.center_in_world() - pose.center_in_world()).length();
        let mean = told.iter().map(off).sum::<f64>() / 64.0;
        // The mean length of a normal vector is 1.6 standard deviations.
        assert!((mean / (1.6 * 1e-3 * 10f64.sqrt()) - 1.0).abs() < 0.2, "{mean}");
        assert!(camera(&[]).told(&shots, DVec3::ZERO).iter().all(|s| off(s) == 0.0));
    }
}
