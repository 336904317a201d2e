//! The protocol as a document and as words.

use motes_formats::metrics::{LpipsProtocol, Protocol, PsnrProtocol, SsimProtocol};

use super::EvaluationOptions;
use crate::lpips::{Lpips, LpipsRange};
use crate::score::PSNR_CAP_DB;
use render::model::ViewExposure;

/// Everything that the numbers depend on beside the inputs.
///
/// `size_px` is the common size of the images, when they have one.
pub fn protocol(
    options: &EvaluationOptions,
    lpips: Option<&Lpips>,
    size_px: Option<[u64; 2]>,
) -> Protocol {
    Protocol {
        split_rule: "the splits that the capture names".into(),
        size_px,
        resize_filter: "none".into(),
        background: options.background.0.map(f64::from),
        view_exposure: Some(
            match options.view_exposure {
                ViewExposure::Metadata => {
                    "renders of Gaussians that were fitted so have the brightness that the photo's \
                     exposure time, ISO speed and f-number name; no pixel of the photo is used"
                }
                ViewExposure::Model => "renders are as bright as the Gaussians",
            }
            .into(),
        ),
        masks: "masked-out pixels (mask below 128) are excluded from PSNR, from the color fit and \
                from the mean of SSIM; for the windows of SSIM and for LPIPS they are made equal in \
                both images"
            .into(),
        mean: "mean over views of the scores of each view, every view weighing the same".into(),
        psnr: PsnrProtocol {
            peak: 1.0,
            encoding: "sRGB".into(),
            bits: 8,
            cap_db: PSNR_CAP_DB,
            color_correction: "affine map of RGB (3x4) from render to photo by least squares, then \
                               clamped to [0, 1]"
                .into(),
        },
        ssim: SsimProtocol {
            window_px: 11,
            sigma_px: 1.5,
            k1: 0.01,
            k2: 0.03,
            border: options.ssim_border.name().into(),
        },
        lpips: lpips.map(|lpips| LpipsProtocol {
            network: lpips.net().name().into(),
            input_range: match lpips.range() {
                LpipsRange::Symmetric => "[-1, 1]".into(),
                LpipsRange::Unit => "[0, 1]".into(),
            },
            weights_sha256: lpips.weights_sha256().into(),
        }),
        lpips_reason: lpips.is_none().then(|| "no weights were given (--lpips-weights)".into()),
    }
}

/// Names and values for a page.
pub fn protocol_words(protocol: &Protocol) -> Vec<(String, String)> {
    let [r, g, b] = protocol.background;
    let size = match protocol.size_px {
        Some([width, height]) => format!("{width} x {height} px"),
        None => "the sizes of the capture's images".into(),
    };
    let (psnr, ssim) = (&protocol.psnr, &protocol.ssim);
    let border = match ssim.border.as_str() {
        "same" => "same: windows over the border see zeros, every pixel counts",
        _ => "valid: only windows that lie inside the image count",
    };
    let lpips = match (&protocol.lpips, &protocol.lpips_reason) {
        (Some(lpips), _) => format!(
            "{}, RGB in {}, 8-bit render, weights with SHA-256 {}",
            lpips.network, lpips.input_range, lpips.weights_sha256
        ),
        (None, Some(reason)) => format!("not measured: {reason}"),
        (None, None) => "not measured".into(),
    };
    [
        ("split", protocol.split_rule.clone()),
        ("size", format!("{size}; resize filter: {}", protocol.resize_filter)),
        ("background", format!("r {r}, g {g}, b {b}, sRGB-encoded")),
        ("mean", protocol.mean.clone()),
        (
            "PSNR",
            format!(
                "RGB in [0, {}], {}-encoded, all counted pixels and channels, render rounded to {} \
                 bit; float: clamped, not rounded; {} dB for equal images",
                psnr.peak, psnr.encoding, psnr.bits, psnr.cap_db
            ),
        ),
        ("color-corrected", psnr.color_correction.clone()),
        (
            "SSIM",
            format!(
                "{0}x{0} Gaussian window, sigma {1}, K1 {2}, K2 {3}, mean over R, G, B, 8-bit \
                 render; border {border}",
                ssim.window_px, ssim.sigma_px, ssim.k1, ssim.k2
            ),
        ),
        ("LPIPS", lpips),
        ("masks", protocol.masks.clone()),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}
