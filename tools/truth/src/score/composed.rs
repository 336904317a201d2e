//! Composed scenes against path-traced truth: in the asset's pixels, where its shadow falls, and everywhere.

use std::path::Path;

use anyhow::Context as _;
use motes_formats::images::read_image;
use motes_math::metrics::psnr_from_mse;
use motes_math::srgb;
use motes_scene::ImageU8;
use serde::Serialize;

use super::pictures::PSNR_CAP_DB;
use super::truth_folder::TruthFolder;

/// Change of linear luminance, over that without the asset, from which a pixel is in the shadow region.
const SHADOW: f32 = 0.1;

/// PSNR over the pixels of a region of all views, dB; none where the region is empty.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ComposedScores {
    /// Where the truth shows the asset.
    pub asset_db: Option<f64>,
    /// Where the truth is at least a tenth darker or brighter for the asset, beside it.
    pub shadow_db: Option<f64>,
    /// Everywhere.
    pub whole_db: Option<f64>,
    /// Share of the pixels that show the asset.
    pub asset_share: f64,
    /// Share of the pixels in the shadow region.
    pub shadow_share: f64,
}

/// Scores PNG pictures of the test views. `with` is the truth with the asset, whose id in it is `object`; `without` the truth without.
///
/// # Errors
/// When a picture is missing or has another size.
pub fn score(
    with: &TruthFolder,
    without: &TruthFolder,
    object: u8,
    folder: &Path,
) -> anyhow::Result<ComposedScores> {
    let mut sums = [(0.0f64, 0.0f64); 3];
    for view in &with.views {
        let read = |folder: &Path| -> anyhow::Result<ImageU8> {
            let path = folder.join(format!("{view}.png"));
            let image = read_image(&path)?;
            let found = (image.width, image.height);
            anyhow::ensure!(
                found == with.size,
                "{}: {found:?}, not {:?}",
                path.display(),
                with.size
            );
            Ok(image)
        };
        let truth = read(&with.root.join("test/capture"))?;
        let bare = read(&without.root.join("test/capture"))?;
        let ours = read(folder)?;
        let ids = with.ids(view).context("ids")?;
        for i in 0..truth.width * truth.height {
            let at = |image: &ImageU8| {
                let p = &image.data[image.channels * i..image.channels * i + 3];
                [0, 1, 2].map(|c| f32::from(p[c]) / 255.0)
            };
            let (t, b, o) = (at(&truth), at(&bare), at(&ours));
            let off = (0..3).map(|c| f64::from(t[c] - o[c]).powi(2)).sum::<f64>() / 3.0;
            let luminance = |p: [f32; 3]| motes_math::luminance::luminance(p.map(srgb::decode));
            let change = (luminance(t) - luminance(b)).abs() / luminance(b).max(0.01);
            let is_asset = ids.data[i] == object;
            let regions = [is_asset, !is_asset && change > SHADOW, true];
            for (sum, counts) in sums.iter_mut().zip(regions) {
                if counts {
                    sum.0 += off;
                    sum.1 += 1.0;
                }
            }
        }
    }
    let db = |(sum, n): (f64, f64)| (n > 0.0).then(|| psnr_from_mse(sum / n).min(PSNR_CAP_DB));
    let all = sums[2].1.max(1.0);
    Ok(ComposedScores {
        asset_db: db(sums[0]),
        shadow_db: db(sums[1]),
        whole_db: db(sums[2]),
        asset_share: sums[0].1 / all,
        shadow_share: sums[1].1 / all,
    })
}
