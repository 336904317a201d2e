//! Base color, roughness, metallic and normals against the true buffers.

use std::collections::BTreeMap;
use std::path::Path;

use glam::Vec3;
use motes_formats::exr_aov::open_exr;
use motes_math::metrics::psnr_from_mse;
use motes_math::srgb::encode_f64;
use motes_scene::{ImageF32, ImageU8};
use serde::{Deserialize, Serialize};

use super::align::{Align, FactorFit};
use super::pictures::PSNR_CAP_DB;
use super::truth_folder::{TruthBuffers, TruthFolder, channels};

/// Pixels next to a border of objects that do not count: their buffers are mixtures.
pub const SHRINK_PX: usize = 2;

/// Predicted buffers of a test view.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// Linear base color.
    pub base_color: ImageF32,
    /// 1 channel.
    pub roughness: ImageF32,
    /// 1 channel.
    pub metallic: ImageF32,
    /// World; 0 where there is none.
    pub normal: ImageF32,
}

impl Prediction {
    /// Reads `folder/<view>.exr`.
    ///
    /// # Errors
    /// When a channel or the file is missing, or it has another size.
    pub fn read(truth: &TruthFolder, view: &str, folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(format!("{view}.exr"));
        let image = open_exr(&path)?;
        truth.check(&path, (image.width, image.height))?;
        let of = |names: &[&[&str]]| channels(&path, &image, names);
        Ok(Self {
            base_color: of(&[&["base_color.R"], &["base_color.G"], &["base_color.B"]])?,
            roughness: of(&[&["roughness", "roughness.Y", "roughness.V"]])?,
            metallic: of(&[&["metallic", "metallic.Y", "metallic.V"]])?,
            normal: of(&[&["normal.X"], &["normal.Y"], &["normal.Z"]])?,
        })
    }
}

/// Scores of all test views.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct MaterialScores {
    /// Everything but the support.
    pub objects: RegionScores,
    /// What the objects stand on.
    pub support: RegionScores,
    /// Both.
    pub all: RegionScores,
    /// Mean of the angle between normals over whole masks, degrees: objects, support.
    pub whole_normal_mae_deg: [f64; 2],
    /// By name of the object.
    pub by_object: BTreeMap<String, RegionScores>,
}

/// Scores over the pixels of a mask, all test views together.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RegionScores {
    /// How many.
    pub pixels: usize,
    /// By alignment.
    pub base_color: BTreeMap<Align, BaseColorScore>,
    /// Mean squared error.
    pub roughness_mse: f64,
    /// Mean squared error.
    pub metallic_mse: f64,
    /// Mean of the predictions.
    pub mean_roughness: f64,
    /// Mean of the predictions.
    pub mean_metallic: f64,
    /// Mean of the truth.
    pub true_roughness: f64,
    /// Mean of the truth.
    pub true_metallic: f64,
    /// Mean angle, degrees.
    pub normal_mae_deg: f64,
}

/// Base color under one alignment.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct BaseColorScore {
    /// Of linear values, dB.
    pub psnr_linear_db: f64,
    /// Of sRGB-encoded values, dB.
    pub psnr_srgb_db: f64,
    /// What ours was multiplied with.
    pub factors: [f64; 3],
}

/// Scores predictions, one per test view.
///
/// # Errors
/// When a buffer of the truth is missing.
pub fn score(truth: &TruthFolder, predictions: &[Prediction]) -> anyhow::Result<MaterialScores> {
    let views: Vec<TruthBuffers> =
        truth.views.iter().map(|v| truth.buffers(v)).collect::<anyhow::Result<_>>()?;
    let inner: Vec<Vec<bool>> = views.iter().map(|v| away_from_borders(&v.ids)).collect();
    let region = |wanted: &dyn Fn(u8) -> bool, shrunk: bool| {
        let mut pixels = Vec::new();
        for (k, view) in views.iter().enumerate() {
            let counts = |&i: &usize| wanted(view.ids.data[i]) && (!shrunk || inner[k][i]);
            pixels.extend((0..view.ids.data.len()).filter(counts).map(|i| (k, i)));
        }
        of_pixels(&views, predictions, &pixels)
    };
    let mut by_object = BTreeMap::new();
    for object in &truth.objects {
        by_object.insert(object.name.clone(), region(&|id| id == object.id, true));
    }
    let whole = [region(&|id| id > 1, false), region(&|id| id == 1, false)];
    Ok(MaterialScores {
        objects: region(&|id| id > 1, true),
        support: region(&|id| id == 1, true),
        all: region(&|id| id > 0, true),
        whole_normal_mae_deg: whole.map(|r| r.normal_mae_deg),
        by_object,
    })
}

/// Whether all pixels within [`SHRINK_PX`] have the same id.
fn away_from_borders(ids: &ImageU8) -> Vec<bool> {
    let (w, h) = (ids.width, ids.height);
    let near = |c: usize, n: usize| c.saturating_sub(SHRINK_PX)..(c + SHRINK_PX + 1).min(n);
    let same = |x: usize, y: usize| {
        near(y, h).all(|v| near(x, w).all(|u| ids.data[v * w + u] == ids.data[y * w + x]))
    };
    (0..w * h).map(|i| same(i % w, i / w)).collect()
}

fn rgb(image: &ImageF32, i: usize) -> [f32; 3] {
    // What no number is counts as black.
    std::array::from_fn(|c| Some(image.data[3 * i + c]).filter(|v| v.is_finite()).unwrap_or(0.0))
}

fn of_pixels(
    views: &[TruthBuffers],
    predictions: &[Prediction],
    pixels: &[(usize, usize)],
) -> RegionScores {
    let mut out = RegionScores { pixels: pixels.len(), ..RegionScores::default() };
    if pixels.is_empty() {
        return out;
    }
    let n = pixels.len() as f64;
    let mut fit = FactorFit::default();
    for &(k, i) in pixels {
        let (t, p) = (&views[k], &predictions[k]);
        fit.add(rgb(&p.base_color, i), rgb(&t.albedo, i));
        let (r, m) = (f64::from(t.roughness.data[i]), f64::from(t.metallic.data[i]));
        let (pr, pm) = (f64::from(p.roughness.data[i]), f64::from(p.metallic.data[i]));
        out.roughness_mse += (r - pr).powi(2) / n;
        out.metallic_mse += (m - pm).powi(2) / n;
        out.mean_roughness += pr / n;
        out.mean_metallic += pm / n;
        out.true_roughness += r / n;
        out.true_metallic += m / n;
        let (a, b) = (Vec3::from(rgb(&t.normal, i)), Vec3::from(rgb(&p.normal, i)));
        let cosine = a.as_dvec3().normalize_or_zero().dot(b.as_dvec3().normalize_or_zero());
        out.normal_mae_deg += cosine.clamp(-1.0, 1.0).acos().to_degrees() / n;
    }
    for align in Align::ALL {
        let factors = fit.factors(align);
        let (mut linear, mut encoded) = (0.0, 0.0);
        for &(k, i) in pixels {
            let (t, p) = (rgb(&views[k].albedo, i), rgb(&predictions[k].base_color, i));
            for c in 0..3 {
                let ours = (f64::from(p[c]) * factors[c]).clamp(0.0, 1.0);
                let real = f64::from(t[c]);
                linear += (real - ours).powi(2);
                encoded +=
                    (encode_f64(real.clamp(0.0, 1.0)) - encode_f64(ours.clamp(0.0, 1.0))).powi(2);
            }
        }
        let db = |sum: f64| psnr_from_mse(sum / (3.0 * n)).min(PSNR_CAP_DB);
        let score =
            BaseColorScore { psnr_linear_db: db(linear), psnr_srgb_db: db(encoded), factors };
        out.base_color.insert(align, score);
    }
    out
}
