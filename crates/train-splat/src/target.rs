//! Photos as the fit reads them: planar 8-bit images at several resolutions, with weights.

use crate::options::AlphaMode;
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use motes_math::resample::{Filter, resize};
use motes_raster::{Planes, ViewTransform};
use motes_scene::{ImageF32, ImageU8, Pinhole, Pose};

/// One photo handed to the fit.
#[derive(Clone, Debug)]
pub struct TrainingImage {
    /// Name of the view.
    pub name: String,
    /// Intrinsics at the photo's size.
    pub camera: Pinhole,
    /// Pose.
    pub camera_from_world: Pose,
    /// RGB or RGBA, sRGB-encoded, straight alpha. Shared: what reads photos need not copy them.
    pub image: Arc<ImageU8>,
    /// 1 channel; 0 = ignore the pixel.
    pub mask: Option<ImageU8>,
    /// Brightness over that of the model, from the photo's metadata; 1 when unknown.
    pub exposure_gain: f32,
}

/// A photo at one resolution.
#[derive(Clone, Debug)]
pub struct Target {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `[3, height, width]`, sRGB-encoded.
    pub rgb: Vec<u8>,
    /// `[height, width]`: 0 = ignore.
    pub weight: Option<Vec<u8>>,
    /// `[height, width]`: coverage to be reproduced by the fit.
    pub alpha: Option<Vec<u8>>,
}

/// A [`Target`] that is resampled when it is first read: a run that ends before it reaches a
/// photo or a resolution does not pay for it.
#[derive(Clone, Debug)]
pub struct LazyTarget {
    source: Arc<TrainingImage>,
    size: [usize; 2],
    alpha_mode: AlphaMode,
    built: OnceLock<Target>,
}

impl LazyTarget {
    /// Whether the pixels are there already.
    pub fn is_built(&self) -> bool {
        self.built.get().is_some()
    }
}

impl Deref for LazyTarget {
    type Target = Target;

    fn deref(&self) -> &Target {
        let [width, height] = self.size;
        self.built.get_or_init(|| Target::new(&self.source, width, height, self.alpha_mode))
    }
}

/// A training view at every resolution of the schedule.
#[derive(Clone, Debug)]
pub struct TrainingView {
    /// Name of the view.
    pub name: String,
    /// Brightness over that of the model, from the photo's metadata.
    pub exposure_gain: f32,
    /// One entry per scale of the schedule, same order.
    pub levels: Vec<(ViewTransform, LazyTarget)>,
}

impl TrainingView {
    /// Resamples the photo to `scales` (1 = its own size) with a Lanczos filter, when first read.
    pub fn new(image: &TrainingImage, scales: &[f64], alpha_mode: AlphaMode) -> Self {
        let source = Arc::new(image.clone());
        let levels = scales
            .iter()
            .map(|&scale| {
                let side = |length: usize| ((length as f64 * scale).round() as usize).max(1);
                let camera =
                    image.camera.resized(side(image.camera.width), side(image.camera.height));
                let target = LazyTarget {
                    source: Arc::clone(&source),
                    size: [camera.width, camera.height],
                    alpha_mode,
                    built: OnceLock::new(),
                };
                (ViewTransform::new(&camera, &image.camera_from_world), target)
            })
            .collect();
        Self { name: image.name.clone(), exposure_gain: image.exposure_gain, levels }
    }
}

impl Target {
    /// Resamples a photo to `width × height`.
    pub fn new(image: &TrainingImage, width: usize, height: usize, alpha_mode: AlphaMode) -> Self {
        let color = resized(&image.image, width, height);
        let count = width * height;
        let channels = color.channels;
        let plane = |c: usize| -> Vec<u8> {
            color.data.iter().skip(c).step_by(channels).copied().collect()
        };
        let rgb = (0..3).flat_map(|c| plane(c.min(channels - 1))).collect();
        let alpha = (channels == 4 && alpha_mode != AlphaMode::Ignore).then(|| plane(3));
        let mut weight =
            image.mask.as_ref().map(|mask| threshold(&resized(mask, width, height).data));
        if let (Some(alpha), AlphaMode::Mask) = (&alpha, alpha_mode) {
            let by_alpha = threshold(alpha);
            let both = weight.unwrap_or_else(|| vec![255; count]);
            weight = Some(both.iter().zip(by_alpha).map(|(a, b)| a & b).collect());
        }
        let alpha = alpha.filter(|_| alpha_mode == AlphaMode::Transparent);
        Self { width, height, rgb, weight, alpha }
    }

    /// Per channel `n, Σ x, Σ y, Σ x², Σ x y` of a rendering `x` (planes 0..3) and this photo `y`, over
    /// the pixels that count.
    pub(crate) fn brightness_sums(&self, render: &Planes, gain: f32) -> [[f64; 5]; 3] {
        std::array::from_fn(|c| {
            let mut sums = [0.0; 5];
            for y in 0..self.height {
                let pixels = render.row(c, y).iter().zip(self.row(c, y)).enumerate();
                for (x, (&a, &b)) in pixels {
                    let at = y * self.width + x;
                    if self.weight.as_ref().is_some_and(|w| w[at] == 0)
                        || self.alpha.as_ref().is_some_and(|a| a[at] < 255)
                    {
                        continue;
                    }
                    let (a, b) = (f64::from(gain * a), f64::from(b) / 255.0);
                    for (sum, term) in sums.iter_mut().zip([1.0, a, b, a * a, a * b]) {
                        *sum += term;
                    }
                }
            }
            sums
        })
    }

    /// Row `y` of channel `c`.
    pub fn row(&self, c: usize, y: usize) -> &[u8] {
        let start = (c * self.height + y) * self.width;
        &self.rgb[start..start + self.width]
    }
}

fn threshold(values: &[u8]) -> Vec<u8> {
    values.iter().map(|&v| if v >= 128 { 255 } else { 0 }).collect()
}

fn resized(image: &ImageU8, width: usize, height: usize) -> ImageU8 {
    if (image.width, image.height) == (width, height) {
        return image.clone();
    }
    let source = image.to_f32();
    let size = (image.width, image.height, image.channels);
    let data = resize(&source.data, size, (width, height), Filter::Lanczos3);
    ImageF32::from_data(width, height, image.channels, data).to_u8()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rgba() -> TrainingImage {
        let camera = Pinhole { fx: 9.0, fy: 9.0, cx: 4.0, cy: 2.0, width: 8, height: 4 };
        let data = (0..8 * 4).flat_map(|i| [i as u8, 100, 200, if i % 8 < 4 { 0 } else { 255 }]);
        TrainingImage {
            name: "a".into(),
            camera,
            camera_from_world: Pose::IDENTITY,
            image: ImageU8::from_data(8, 4, 4, data.collect()).into(),
            mask: None,
            exposure_gain: 1.0,
        }
    }

    #[test]
    fn alpha_modes_mean_what_they_say() {
        let image = rgba();
        let mask = Target::new(&image, 8, 4, AlphaMode::Mask);
        assert_eq!(mask.weight.unwrap()[2..6], [0, 0, 255, 255]);
        assert!(mask.alpha.is_none());
        let transparent = Target::new(&image, 8, 4, AlphaMode::Transparent);
        assert!(transparent.weight.is_none() && transparent.alpha.is_some());
        let ignore = Target::new(&image, 8, 4, AlphaMode::Ignore);
        assert!(ignore.weight.is_none() && ignore.alpha.is_none());
        assert_eq!(ignore.row(1, 3), [100; 8]);
    }

    #[test]
    fn levels_scale_the_camera_with_the_image() {
        let view = TrainingView::new(&rgba(), &[0.5, 1.0], AlphaMode::Ignore);
        let (transform, target) = &view.levels[0];
        assert!(!target.is_built());
        assert_eq!((target.width, target.height, transform.size), (4, 2, [4, 2]));
        assert_eq!(transform.focal, [4.5, 4.5]);
        assert!(target.is_built() && !view.levels[1].1.is_built());
    }
}
