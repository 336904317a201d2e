//! Scores of one view.

use motes_math::metrics::{SsimBorder, fit_affine_rgb, psnr_from_mse, ssim, ssim_of_pixels};
use motes_scene::{ImageF32, ImageU8};

use crate::lpips::{Lpips, LpipsError};

/// PSNR of equal images, dB. The true value is infinite, which neither JSON nor a mean can hold;
/// 8-bit images that differ in one value of one pixel stay below it up to 30 megapixels.
pub const PSNR_CAP_DB: f64 = 128.0;

/// A photo to compare with.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// 3 channels, 8-bit sRGB-encoded, already over the background where it had alpha.
    pub rgb: ImageU8,
    /// Per pixel, row-major: whether it counts. `None`: all do.
    pub counted: Option<Vec<bool>>,
}

/// The protocol.
#[derive(Clone, Copy, Debug)]
pub struct ScoreOptions<'a> {
    /// How SSIM treats windows over the image border.
    pub ssim_border: SsimBorder,
    /// The network for LPIPS, when the user has weights.
    pub lpips: Option<&'a Lpips>,
}

/// Scores of one view. PSNRs are in dB and capped at [`PSNR_CAP_DB`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewScore {
    /// From the 8-bit render, as a PNG would hold it.
    pub psnr: f64,
    /// From the render before rounding, clamped to [0, 1].
    pub psnr_float: f64,
    /// After the affine RGB map that fits the render to the photo best, then clamped: what is
    /// left when exposure and white balance of the photo are taken out.
    pub psnr_color_corrected: f64,
    /// From the 8-bit render.
    pub ssim: f64,
    /// From the 8-bit render; masked-out pixels are equal in both images.
    pub lpips: Option<f64>,
    /// Share of pixels that count, in [0, 1].
    pub counted_share: f64,
}

/// Scores a render (3 channels, sRGB-encoded, any range) against its photo.
///
/// Only counted pixels enter PSNR and the color fit. For SSIM, masked-out pixels of the render
/// are replaced by the photo's and windows centered on counted pixels are averaged. Where no pixel
/// counts, the values are NaN.
///
/// # Errors
/// When LPIPS is asked for and the image is too small for its network.
///
/// # Panics
/// When the sizes differ.
pub fn score_view(
    photo: &Photo,
    render: &ImageF32,
    options: &ScoreOptions,
) -> Result<ViewScore, LpipsError> {
    let (width, height) = (photo.rgb.width, photo.rgb.height);
    assert_eq!((width, height), (render.width, render.height), "photo and render of one size");
    assert_eq!((photo.rgb.channels, render.channels), (3, 3), "RGB");
    let truth = photo.rgb.to_f32();
    // NaN would poison every mean; a renderer that makes one is scored as if it were black.
    let float: Vec<f32> = render.data.iter().map(|v| v.max(0.0).clamp(0.0, 1.0)).collect();
    let mut rounded = render.to_u8().to_f32();
    let counted = photo.counted.as_deref();

    let psnr = psnr_counted(&truth.data, &rounded.data, counted);
    let psnr_float = psnr_counted(&truth.data, &float, counted);
    let corrected = color_corrected(&float, &truth.data, counted);
    let psnr_color_corrected = psnr_counted(&truth.data, &corrected, counted);

    if let Some(counted) = counted {
        let pixels = rounded.data.chunks_exact_mut(3).zip(truth.data.chunks_exact(3));
        for ((render, truth), _) in pixels.zip(counted).filter(|(_, counted)| !**counted) {
            render.copy_from_slice(truth);
        }
    }
    let border = options.ssim_border;
    let ssim = match counted {
        None => ssim(&truth.data, &rounded.data, width, height, 3, border),
        Some(counted) => {
            ssim_of_pixels(&truth.data, &rounded.data, width, height, 3, border, counted)
        }
    };
    let lpips = options.lpips.map(|lpips| lpips.distance(&truth, &rounded)).transpose()?;
    let counted_pixels = counted.map_or(width * height, |c| c.iter().filter(|c| **c).count());
    let counted_share = counted_pixels as f64 / (width * height).max(1) as f64;
    Ok(ViewScore { psnr, psnr_float, psnr_color_corrected, ssim, lpips, counted_share })
}

fn psnr_counted(a: &[f32], b: &[f32], counted: Option<&[bool]>) -> f64 {
    let (mut sum, mut pixels) = (0.0, 0usize);
    for (i, (p, q)) in a.chunks_exact(3).zip(b.chunks_exact(3)).enumerate() {
        if counted.is_none_or(|counted| counted[i]) {
            pixels += 1;
            sum += p.iter().zip(q).map(|(p, q)| f64::from(p - q).powi(2)).sum::<f64>();
        }
    }
    if pixels == 0 {
        return f64::NAN;
    }
    psnr_from_mse(sum / (3 * pixels) as f64).min(PSNR_CAP_DB)
}

/// The render after the least-squares affine map of RGB onto the photo, clamped to [0, 1].
fn color_corrected(render: &[f32], photo: &[f32], counted: Option<&[bool]>) -> Vec<f32> {
    let weights: Option<Vec<f32>> =
        counted.map(|counted| counted.iter().map(|&c| f32::from(u8::from(c))).collect());
    let map = fit_affine_rgb(render, photo, weights.as_deref());
    let apply = |pixel: &[f32]| {
        let [r, g, b] = [pixel[0], pixel[1], pixel[2]].map(f64::from);
        map.map(|m| (m[0] * r + m[1] * g + m[2] * b + m[3]).clamp(0.0, 1.0) as f32)
    };
    render.chunks_exact(3).flat_map(apply).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: ScoreOptions = ScoreOptions { ssim_border: SsimBorder::Same, lpips: None };

    fn photo(width: usize, height: usize) -> Photo {
        let data = (0..width * height * 3).map(|i| 40 + ((i * 7919) % 151) as u8).collect();
        Photo { rgb: ImageU8::from_data(width, height, 3, data), counted: None }
    }

    fn offset(photo: &Photo, by: f32) -> ImageF32 {
        let mut render = photo.rgb.to_f32();
        render.data.iter_mut().for_each(|v| *v += by);
        render
    }

    #[test]
    fn equal_images_score_the_cap_and_one() {
        let photo = photo(16, 12);
        let score = score_view(&photo, &photo.rgb.to_f32(), &PLAIN).unwrap();
        assert_eq!((score.psnr, score.psnr_float), (PSNR_CAP_DB, PSNR_CAP_DB));
        assert!((score.ssim - 1.0).abs() < 1e-12);
        assert_eq!((score.lpips, score.counted_share), (None, 1.0));
    }

    #[test]
    fn rounding_tells_the_two_psnrs_apart() {
        let photo = photo(16, 12);
        // A quarter of an 8-bit step vanishes when rounded.
        let score = score_view(&photo, &offset(&photo, 0.25 / 255.0), &PLAIN).unwrap();
        assert_eq!(score.psnr, PSNR_CAP_DB);
        let expected = 20.0 * (255.0f64 / 0.25).log10();
        assert!((score.psnr_float - expected).abs() < 1e-3, "{}", score.psnr_float);
    }

    #[test]
    fn color_correction_takes_out_exposure_and_white_balance() {
        let photo = photo(24, 20);
        let mut render = photo.rgb.to_f32();
        for pixel in render.data.chunks_exact_mut(3) {
            let [r, g, b] = [pixel[0], pixel[1], pixel[2]];
            pixel.copy_from_slice(&[0.8 * r, 0.9 * g + 0.02, 0.7 * b + 0.1 * g]);
        }
        let score = score_view(&photo, &render, &PLAIN).unwrap();
        assert!(score.psnr < 25.0, "{score:?}");
        assert!(score.psnr_color_corrected > 80.0, "{score:?}");
    }

    #[test]
    fn masked_out_pixels_do_not_count() {
        let mut photo = photo(24, 20);
        photo.counted = Some((0..24 * 20).map(|i| i % 24 < 18).collect());
        let good = offset(&photo, 2.0 / 255.0);
        let mut bad = good.clone();
        for y in 0..20 {
            for x in 18..24 {
                bad.pixel_mut(x, y).fill(f32::NAN);
            }
        }
        let (good, bad) =
            (score_view(&photo, &good, &PLAIN).unwrap(), score_view(&photo, &bad, &PLAIN).unwrap());
        assert_eq!(good, bad);
        assert!((good.psnr - 20.0 * (255.0f64 / 2.0).log10()).abs() < 1e-3);
        assert!((good.counted_share - 0.75).abs() < 1e-12);
        photo.counted = Some(vec![false; 24 * 20]);
        let nothing = score_view(&photo, &photo.rgb.to_f32(), &PLAIN).unwrap();
        assert!(nothing.psnr.is_nan() && nothing.ssim.is_nan());
    }
}
