//! Pictures against the true ones.

use std::collections::BTreeMap;
use std::path::Path;

use motes_formats::exr_aov::open_exr;
use motes_math::metrics::{SsimBorder, psnr_from_mse, ssim};
use motes_math::srgb;
use motes_scene::ImageU8;
use serde::{Deserialize, Serialize};

use super::align::{Align, FactorFit};
use super::truth_folder::{TruthFolder, channels};
use crate::photos::encode;

/// PSNR of pictures that are the same.
pub const PSNR_CAP_DB: f64 = 99.0;

/// Scores of the test views under one light.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct PictureScores {
    /// By alignment.
    pub aligned: BTreeMap<Align, AlignedPictures>,
}

/// Scores under one alignment.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AlignedPictures {
    /// Mean of the views, dB.
    pub psnr_db: f64,
    /// Mean of the views.
    pub ssim: f64,
    /// What ours was multiplied with, linear.
    pub factors: [f64; 3],
    /// PSNR of every view, dB.
    pub views_psnr_db: BTreeMap<String, f64>,
}

/// A picture in linear light, not clipped where the EXR beside it tells more.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Three values per pixel.
    pub data: Vec<f32>,
}

/// Linear values of an 8-bit picture.
pub fn decoded(image: &ImageU8) -> Vec<f32> {
    image.data.iter().map(|&v| srgb::decode(f32::from(v) / 255.0)).collect()
}

/// Our picture of a view: the PNG, or the channels `R G B` of an EXR where that is all there is.
///
/// # Errors
/// When there is neither, or of another size.
pub fn ours(truth: &TruthFolder, folder: &Path, view: &str) -> anyhow::Result<Linear> {
    let exr = folder.join(format!("{view}.exr"));
    let png = folder.join(format!("{view}.png"));
    if exr.exists() && !png.exists() {
        let image = open_exr(&exr)?;
        truth.check(&exr, (image.width, image.height))?;
        let mut rgb = channels(&exr, &image, &[&["R"], &["G"], &["B"]])?;
        truth.black_out(view, &mut rgb.data)?;
        return Ok(Linear { data: rgb.data });
    }
    Ok(Linear { data: decoded(&truth.picture(folder, view)?) })
}

/// Scores the pictures of `folder` against those of `what` in the truth.
///
/// # Errors
/// When a picture is missing or has another size.
pub fn score(truth: &TruthFolder, what: &str, folder: &Path) -> anyhow::Result<PictureScores> {
    let mut pairs = Vec::new();
    let mut fit = FactorFit::default();
    for view in &truth.views {
        let real = truth.picture(&truth.root.join(what), view)?;
        let linear = decoded(&real);
        let ours = ours(truth, folder, view)?;
        let counted = truth
            .mask(view)?
            .map_or(real.width * real.height, |mask| mask.iter().filter(|counts| **counts).count());
        for (o, t) in ours.data.chunks_exact(3).zip(linear.chunks_exact(3)) {
            // Clipped values are no proportion of anything.
            if o.iter().chain(t).all(|v| *v < 0.99) {
                fit.add([o[0], o[1], o[2]], [t[0], t[1], t[2]]);
            }
        }
        pairs.push((view, real, ours, counted));
    }
    let mut scores = PictureScores::default();
    for align in Align::ALL {
        let factors = fit.factors(align);
        let mut row = AlignedPictures { factors, ..AlignedPictures::default() };
        for (view, real, ours, counted) in &pairs {
            let scaled = scaled(&ours.data, factors);
            let (psnr, similarity) = compare(real, &scaled, *counted);
            row.views_psnr_db.insert((*view).clone(), psnr);
            row.psnr_db += psnr / pairs.len() as f64;
            row.ssim += similarity / pairs.len() as f64;
        }
        scores.aligned.insert(align, row);
    }
    Ok(scores)
}

/// Linear values times factors, clipped and encoded to 8 bits.
pub fn scaled(linear: &[f32], factors: [f64; 3]) -> Vec<u8> {
    let f = factors.map(|f| f as f32);
    linear.iter().enumerate().map(|(i, v)| encode(v * f[i % 3])).collect()
}

/// PSNR over the pixels that count and SSIM over all; the others are the same in both.
fn compare(real: &ImageU8, ours: &[u8], counted: usize) -> (f64, f64) {
    let unit = |v: &[u8]| -> Vec<f32> { v.iter().map(|&v| f32::from(v) / 255.0).collect() };
    let (a, b) = (unit(&real.data), unit(ours));
    let mse = a.iter().zip(&b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
        / (3 * counted).max(1) as f64;
    let similarity = ssim(&a, &b, real.width, real.height, 3, SsimBorder::Valid);
    (psnr_from_mse(mse).min(PSNR_CAP_DB), similarity)
}
