//! The files of a rendered frame: PNG, EXR channels, previews of AOVs.

use super::options::{DepthRange, FrameFormat, PictureFormat, PreviewAov};
use motes_formats::exr_aov::AovChannel;
use motes_math::srgb;
use motes_raster::Rendering;
use motes_scene::{ImageF32, ImageU8};

use motes_figures::colormap::colormap;

/// Which files a frame becomes.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFiles {
    /// 8-bit sRGB color over the background.
    pub png: bool,
    /// All channels.
    pub exr: bool,
    /// Previews beside them.
    pub previews: Vec<PreviewAov>,
}

impl FrameFiles {
    /// The files that the options ask for.
    pub fn new(format: &FrameFormat) -> Self {
        let mut previews = format.aov.clone();
        previews.dedup();
        Self {
            png: format.format != PictureFormat::Exr,
            exr: format.format != PictureFormat::Png,
            previews,
        }
    }

    /// Whether depth and normals must be rendered.
    pub fn need_aovs(&self) -> bool {
        self.exr || self.previews.iter().any(|aov| *aov != PreviewAov::Alpha)
    }
}

impl PreviewAov {
    /// Part of the file name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Alpha => "alpha",
        }
    }
}

/// The channels of a rendering.
///
/// `R`, `G`, `B` are linear Rec.709: the sRGB-encoded picture decoded, over the background, in half
/// precision unless a value is beyond its range; `A` is the coverage. `depth.Z` is the expected and `depth_median.Z` the median depth along the camera
/// axis (panoramas: along the ray), world units, 0 where nothing is. `normal.X`, `.Y`, `.Z` are in
/// world axes.
pub fn exr_channels(rendering: &Rendering) -> Vec<AovChannel> {
    let plane = |image: &ImageF32, c: usize| -> Vec<f32> {
        image.data.iter().skip(c).step_by(image.channels).copied().collect()
    };
    let linear = [0, 1, 2].map(|c| plane(&rendering.color, c).into_iter().map(linear).collect());
    let fits = fits_half(&linear);
    let mut channels: Vec<AovChannel> = ["R", "G", "B"]
        .into_iter()
        .zip(linear)
        .map(|(name, values)| match fits {
            true => AovChannel::half(name, &values),
            false => AovChannel::float(name, values),
        })
        .collect();
    channels.push(AovChannel::half("A", &plane(&rendering.alpha, 0)));
    if let Some(aovs) = &rendering.aovs {
        channels.push(AovChannel::float("depth.Z", plane(&aovs.depth_expected, 0)));
        channels.push(AovChannel::float("depth_median.Z", plane(&aovs.depth_median, 0)));
        for (c, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
            channels.push(AovChannel::float(name, plane(&aovs.normal_in_world, c)));
        }
    }
    channels
}

/// Whether half floats hold a picture: nothing overflows, and the brightest value is not so dark
/// that its digits are those of subnormal numbers.
fn fits_half(planes: &[Vec<f32>; 3]) -> bool {
    let brightest = planes.iter().flatten().fold(0.0f32, |max, v| max.max(v.abs()));
    brightest == 0.0 || (1e-3..=65_504.0).contains(&brightest)
}

/// Linear value of an sRGB-encoded one; what single precision cannot hold becomes its largest value.
fn linear(encoded: f32) -> f32 {
    srgb::decode(encoded).clamp(f32::MIN, f32::MAX)
}

/// 2nd and 98th percentile of the expected depth where something is; `None` where nothing is or
/// depth was not rendered.
pub fn depth_range(rendering: &Rendering) -> Option<DepthRange> {
    let depths = &rendering.aovs.as_ref()?.depth_expected.data;
    let mut depths: Vec<f32> = depths.iter().copied().filter(|d| *d > 0.0).collect();
    depths.sort_by(f32::total_cmp);
    let at = |share: f64| depths.get((share * (depths.len().max(1) - 1) as f64) as usize).copied();
    let (near, far) = (at(0.02)?, at(0.98)?);
    Some(DepthRange { near, far: far.max(near * 1.001) })
}

/// The preview of an AOV; `None` when it was not rendered. 1 or 3 channels.
pub fn preview(rendering: &Rendering, aov: PreviewAov, range: DepthRange) -> Option<ImageU8> {
    let (width, height) = (rendering.alpha.width, rendering.alpha.height);
    match aov {
        PreviewAov::Alpha => Some(rendering.alpha.to_u8()),
        PreviewAov::Normal => {
            let normals = &rendering.aovs.as_ref()?.normal_in_world;
            let data = normals.data.iter().map(|n| (0.5 + 0.5 * n) * 255.0);
            let data = data.map(|v| v.max(0.0).clamp(0.0, 255.0).round() as u8).collect();
            Some(ImageU8::from_data(width, height, 3, data))
        }
        PreviewAov::Depth => {
            let depths = &rendering.aovs.as_ref()?.depth_expected;
            let color = |&depth: &f32| {
                if depth > 0.0 {
                    let t = (range.far - depth) / (range.far - range.near);
                    // The lowest tenth stays free, so that far is not taken for nothing.
                    colormap(0.1 + 0.9 * f64::from(t.clamp(0.0, 1.0)))
                } else {
                    [0; 3]
                }
            };
            Some(ImageU8::from_data(width, height, 3, depths.data.iter().flat_map(color).collect()))
        }
    }
}

#[cfg(test)]
mod tests {
    use motes_formats::exr_aov::AovSamples;
    use motes_raster::Aovs;

    use super::*;

    fn rendering() -> Rendering {
        let image = |channels, data| ImageF32::from_data(2, 1, channels, data);
        Rendering {
            color: image(3, vec![0.0, 0.5, 1.0, 1.5, -0.5, 0.04]),
            alpha: image(1, vec![0.0, 1.0]),
            aovs: Some(Aovs {
                depth_expected: image(1, vec![0.0, 4.0]),
                depth_median: image(1, vec![0.0, 5.0]),
                normal_in_world: image(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, -1.0]),
            }),
        }
    }

    #[test]
    fn color_is_decoded_and_data_is_not() {
        let channels = exr_channels(&rendering());
        let of = |name: &str| channels.iter().find(|c| c.name == name).unwrap().to_f32();
        assert!((of("G")[0] - 0.214_041).abs() < 1e-4, "sRGB 0.5 is linear 0.214");
        assert!((of("B")[0] - 1.0).abs() < 1e-6 && of("R")[1] > 2.5 && of("G")[1] < 0.0);
        assert_eq!((of("A")[1], of("depth.Z")[1], of("depth_median.Z")[1]), (1.0, 4.0, 5.0));
        assert_eq!((of("normal.Y")[1], of("normal.Z")[1]), (1.0, -1.0));
        let is_half = |c: &&AovChannel| matches!(c.samples, AovSamples::F16(_));
        let halves: Vec<_> = channels.iter().filter(is_half).map(|c| c.name.as_str()).collect();
        assert_eq!(halves, ["R", "G", "B", "A"]);
    }

    #[test]
    fn previews_show_near_brighter_and_nothing_black() {
        let mut rendering = rendering();
        rendering.aovs.as_mut().unwrap().depth_expected.data = vec![2.0, 8.0];
        let range = DepthRange { near: 2.0, far: 8.0 };
        let depth = preview(&rendering, PreviewAov::Depth, range).unwrap();
        let sum = |x: usize| depth.pixel(x, 0).iter().map(|&v| u32::from(v)).sum::<u32>();
        assert!(sum(0) > sum(1) && sum(1) > 0);
        let normal = preview(&rendering, PreviewAov::Normal, range).unwrap();
        assert_eq!(normal.pixel(1, 0), [128, 255, 0]);
        let alpha = preview(&rendering, PreviewAov::Alpha, range).unwrap();
        assert_eq!(alpha.data, [0, 255]);
        rendering.aovs = None;
        assert!(preview(&rendering, PreviewAov::Depth, range).is_none());
        assert!(depth_range(&rendering).is_none());
    }

    #[test]
    fn the_depth_range_ignores_empty_pixels() {
        let range = depth_range(&rendering()).unwrap();
        assert!(range.near == 4.0 && range.far > 4.0);
    }
}
