//! Results of inverse rendering against a ground-truth folder.
//!
//! Base color and light are known up to a factor that the photos do not tell, so everything with a
//! scale is scored three times: as it is, with one factor, with a factor per channel
//! ([`align`]). `docs/benchmarks/protocol.md` states the protocol.

pub mod align;
pub mod composed;
pub mod markdown;
pub mod materials;
pub mod pictures;
pub mod sheet;
pub mod spheres;
pub mod tearing;
pub mod truth_folder;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use self::align::Align;
use self::materials::{MaterialScores, Prediction};
use self::pictures::PictureScores;
use self::truth_folder::TruthFolder;

/// What was made from the photos of a ground-truth folder.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// Pictures of the test views by the splat, under the light of the photos.
    pub splat: Option<PathBuf>,
    /// Pictures of the test views by the decomposed scene, under its own light.
    pub capture: Option<PathBuf>,
    /// Pictures of the test views under another light, by the name of the light.
    pub relit: BTreeMap<String, PathBuf>,
    /// EXR buffers of the test views: `base_color.R` .., `roughness`, `metallic`, `normal.X` ...
    pub buffers: Option<PathBuf>,
}

/// All scores of one set of results.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Scores {
    /// Name of the scene.
    pub scene: String,
    /// Sentences that say how the numbers were made.
    pub protocol: Vec<String>,
    /// The splat's pictures against the held-out photos.
    pub splat: Option<PictureScores>,
    /// The decomposed scene's pictures under its own light against the held-out photos.
    pub capture: Option<PictureScores>,
    /// Relit pictures, by light.
    pub relit: BTreeMap<String, PictureScores>,
    /// Mean over the lights, by alignment.
    pub relit_mean: BTreeMap<Align, PictureMean>,
    /// Materials and normals.
    pub materials: Option<MaterialScores>,
}

/// Means of several pictures.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct PictureMean {
    /// Mean of PSNR over views, then lights, dB.
    pub psnr_db: f64,
    /// Mean of SSIM.
    pub ssim: f64,
    /// The worst light's PSNR, dB.
    pub worst_psnr_db: f64,
}

/// Scores everything that is there.
///
/// # Errors
/// When a file is missing or has another size than the truth.
pub fn score(truth: &TruthFolder, results: &Results) -> anyhow::Result<Scores> {
    let pictures = |what: &str, folder: &Option<PathBuf>| {
        let of = |folder: &PathBuf| pictures::score(truth, what, folder);
        folder.as_ref().map(of).transpose()
    };
    let mut scores = Scores {
        scene: truth.title.clone(),
        protocol: protocol(truth),
        splat: pictures("test/capture", &results.splat)?,
        capture: pictures("test/capture", &results.capture)?,
        ..Scores::default()
    };
    for (light, folder) in &results.relit {
        let of = pictures::score(truth, &format!("test/relight_{light}"), folder)?;
        scores.relit.insert(light.clone(), of);
    }
    if !scores.relit.is_empty() {
        for align in Align::ALL {
            scores.relit_mean.insert(align, mean(&scores.relit, align));
        }
    }
    if let Some(folder) = &results.buffers {
        let read = |view: &String| Prediction::read(truth, view, folder);
        let views = truth.views.iter().map(read).collect::<anyhow::Result<Vec<_>>>()?;
        scores.materials = Some(materials::score(truth, &views)?);
    }
    Ok(scores)
}

fn mean(lights: &BTreeMap<String, PictureScores>, align: Align) -> PictureMean {
    let of: Vec<_> = lights.values().filter_map(|l| l.aligned.get(&align)).collect();
    let n = of.len().max(1) as f64;
    PictureMean {
        psnr_db: of.iter().map(|m| m.psnr_db).sum::<f64>() / n,
        ssim: of.iter().map(|m| m.ssim).sum::<f64>() / n,
        worst_psnr_db: of.iter().map(|m| m.psnr_db).fold(f64::INFINITY, f64::min),
    }
}

fn protocol(truth: &TruthFolder) -> Vec<String> {
    vec![
        format!("{} test views of {} x {} pixels; PSNR and SSIM of 8-bit sRGB pictures, mean over views, then lights", truth.views.len(), truth.size.0, truth.size.1),
        "none: as delivered; scalar: one factor per light for all views; channel: one factor per light and channel".into(),
        "factors of pictures: least squares in linear light over pixels that are clipped in neither picture, applied before clipping and encoding".into(),
        "factors of base color: least squares in linear over the pixels scored; PSNR of base color in linear and of its sRGB encoding (peak 1)".into(),
        format!("materials and normals: masks shrunk by {} px from borders of objects; objects are ids above 1, the support is id 1; normals also over whole masks", materials::SHRINK_PX),
        "a pixel without a normal counts as 90 degrees".into(),
    ]
}
