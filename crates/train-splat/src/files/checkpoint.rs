//! A fit in progress on disk: safetensors with every number of [`FitState`].
//!
//! Tensors: the Gaussians in stored space (`means`, `rotations`, `log_scales`, `opacity_logits`,
//! `sh`), Adam's moments under `first/` and `second/`, `refine/pull`, `refine/seen`, `filter_3d`,
//! `exposure/values`, `exposure/first`, `exposure/second`, `exposure/steps`, `skip/baseline`, `background` (value
//! and moments of a learned color, then its steps), `scene` (extent, center and radius of the far
//! shell). Metadata: model (the components in effect and why), format, version, step, seed, options,
//! capture hash. Lengths are those of the unit world. There is no generator state: random numbers
//! are keyed by seed and step.

use std::collections::BTreeMap;
use std::path::Path;

use crate::{
    BackgroundColor, Exposures, FitOptions, FitState, MomentColumns, Moments, RefineStats,
    ScenePlace, SkipState,
};
use motes_formats::tensors::{TensorData, checksum, read_tensors, write_tensors};
use motes_formats::{FormatError, Result};
use motes_scene::Gaussians;

const FORMAT: &str = "motes/fit-checkpoint";
const VERSION: &str = "3.1";
/// CRC-32 of all the rest; files of version 3.0 have none.
const CHECKSUM: &str = "checksum";

/// A checkpoint and what it belongs to.
#[derive(Clone, Debug)]
pub(super) struct Checkpoint {
    /// The state of the fit.
    pub state: FitState,
    /// The options it runs with.
    pub options: FitOptions,
    /// The seed it runs with.
    pub seed: u64,
    /// SHA-256 of the capture document.
    pub capture_sha256: String,
}

/// Writes a checkpoint atomically.
///
/// # Errors
/// When a value is not finite or the file cannot be written.
pub(super) fn write_checkpoint(path: &Path, checkpoint: &Checkpoint) -> Result<()> {
    let s = &checkpoint.state;
    check_finite(s, path)?;
    let n = s.gaussians.len();
    let k = s.gaussians.sh_coefficients();
    let mut tensors = Vec::new();
    let mut put = |name: String, tensor| tensors.push((name, tensor));
    let mut columns = |prefix: &str, m: &MomentColumns| {
        let f32s = |shape: &[usize], values: &[f32]| TensorData::F32(shape.into(), values.into());
        put(format!("{prefix}means"), f32s(&[n, 3], m.means.as_flattened()));
        put(format!("{prefix}rotations"), f32s(&[n, 4], m.rotations.as_flattened()));
        put(format!("{prefix}log_scales"), f32s(&[n, 3], m.log_scales.as_flattened()));
        put(format!("{prefix}opacity_logits"), f32s(&[n], &m.opacity_logits));
        put(format!("{prefix}sh"), f32s(&[n, k, 3], &m.sh));
    };
    columns("", &columns_of(&s.gaussians));
    columns("first/", &s.moments.first);
    columns("second/", &s.moments.second);
    put("refine/pull".into(), TensorData::F32(vec![n], s.refine_stats.pull.clone()));
    put("refine/seen".into(), TensorData::U32(vec![n], s.refine_stats.seen.clone()));
    put("filter_3d".into(), TensorData::F32(vec![s.filter_3d.len()], s.filter_3d.clone()));
    let views = s.exposures.values.len();
    for (name, values) in [
        ("values", &s.exposures.values),
        ("first", &s.exposures.first),
        ("second", &s.exposures.second),
    ] {
        let flat = values.as_flattened().to_vec();
        put(format!("exposure/{name}"), TensorData::F32(vec![views, 6], flat));
    }
    put("exposure/steps".into(), TensorData::U64(vec![views], s.exposures.steps.clone()));
    put("skip/baseline".into(), TensorData::F32(vec![views], s.skip.baseline.clone()));
    let b = &s.background;
    let colors = [b.value, b.first, b.second].as_flattened().to_vec();
    put("background/values".into(), TensorData::F32(vec![3, 3], colors));
    put("background/steps".into(), TensorData::U64(vec![1], vec![b.steps]));
    put("scene".into(), TensorData::U64(vec![5], scene_bits(&s.scene).to_vec()));
    let model = serde_json::to_string(&s.model).unwrap_or_default();
    let options = serde_json::to_string(&checkpoint.options).unwrap_or_default();
    let metadata = [
        ("format", FORMAT.to_owned()),
        ("version", VERSION.to_owned()),
        ("step", s.step.to_string()),
        ("sh_degree", s.gaussians.sh_degree.to_string()),
        ("initial_gaussians", s.initial_gaussians.to_string()),
        ("model", model),
        ("gain_spread_bits", s.gain_spread.to_bits().to_string()),
        ("skip_eligible", s.skip.eligible.to_string()),
        ("skip_skipped", s.skip.skipped.to_string()),
        ("seed", checkpoint.seed.to_string()),
        ("options", options),
        ("capture_sha256", checkpoint.capture_sha256.clone()),
    ];
    let mut metadata: BTreeMap<String, String> =
        metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    let named = tensors.iter().map(|(name, tensor)| (name.as_str(), tensor));
    let sum = checksum(named, metadata.iter().map(|(key, value)| (key.as_str(), value.as_str())));
    metadata.insert(CHECKSUM.into(), sum.to_string());
    write_tensors(path, &tensors, &metadata)
}

/// Extent, center and radius of the shell, bit for bit.
fn scene_bits(scene: &ScenePlace) -> [u64; 5] {
    let [x, y, z] = scene.shell_center.to_array();
    [scene.extent, x, y, z, scene.shell_radius].map(f64::to_bits)
}

/// A fit that has gone to infinity cannot be continued, and one that was written so is broken.
fn check_finite(s: &FitState, path: &Path) -> Result<()> {
    let of = |m: &MomentColumns| {
        let arrays: [&[f32]; 5] = [
            m.means.as_flattened(),
            m.rotations.as_flattened(),
            m.log_scales.as_flattened(),
            &m.opacity_logits,
            &m.sh,
        ];
        arrays.into_iter().all(|values| values.iter().all(|v| !v.is_nan()))
    };
    let g = &s.gaussians;
    let colors = [s.background.value, s.background.first, s.background.second];
    for (what, is_finite) in [
        ("the Gaussians", g.invalid_rows().is_empty()),
        ("the first moments", of(&s.moments.first)),
        ("the second moments", of(&s.moments.second)),
        ("the exposures", s.exposures.values.as_flattened().iter().all(|v| v.is_finite())),
        ("the background", colors.as_flattened().iter().all(|v| v.is_finite())),
    ] {
        if !is_finite {
            let cause = format!("{what} have values that are not finite");
            return Err(FormatError::invalid(path, format!("step {}", s.step), cause)
                .with_remedy("train again; a smaller learning rate keeps a fit finite"));
        }
    }
    Ok(())
}

fn columns_of(g: &Gaussians) -> MomentColumns {
    MomentColumns {
        means: g.means.clone(),
        rotations: g.rotations.clone(),
        log_scales: g.log_scales.clone(),
        opacity_logits: g.opacity_logits.clone(),
        sh: g.sh.clone(),
    }
}

/// Reads a checkpoint back, bit for bit.
///
/// # Errors
/// When the file is not a checkpoint of this version or its arrays do not belong together.
pub(super) fn read_checkpoint(path: &Path) -> Result<Checkpoint> {
    let (tensors, metadata) = read_tensors(path)?;
    check_sum(&tensors, &metadata, path)?;
    let mut file = File { path, tensors, metadata };
    if file.text("format")? != FORMAT {
        return Err(file.invalid("metadata", "not a checkpoint of train-splat"));
    }
    let version = file.text("version")?;
    if version.split('.').next() != VERSION.split('.').next() {
        return Err(FormatError::not_supported(
            path,
            "metadata",
            format!("checkpoint version {version}"),
        )
        .with_remedy("continue it with the version of motes that wrote it"));
    }
    let sh_degree: u8 = file.number("sh_degree")?;
    if sh_degree > 4 {
        return Err(file.invalid("metadata", "the SH degree is above 4"));
    }
    let model = file.columns("")?;
    let moments = Moments { first: file.columns("first/")?, second: file.columns("second/")? };
    let gaussians = Gaussians {
        means: model.means,
        rotations: model.rotations,
        log_scales: model.log_scales,
        opacity_logits: model.opacity_logits,
        sh_degree,
        sh: model.sh,
        extra: Vec::new(),
    };
    let refine_stats =
        RefineStats { pull: file.f32s("refine/pull")?, seen: file.u32s("refine/seen")? };
    let exposures = Exposures {
        values: rows(file.f32s("exposure/values")?),
        first: rows(file.f32s("exposure/first")?),
        second: rows(file.f32s("exposure/second")?),
        steps: file.u64s("exposure/steps")?,
    };
    let skip = SkipState {
        baseline: file.f32s("skip/baseline")?,
        eligible: file.number("skip_eligible")?,
        skipped: file.number("skip_skipped")?,
    };
    let state = FitState {
        skip,
        step: file.number("step")?,
        moments,
        refine_stats,
        filter_3d: file.f32s("filter_3d")?,
        exposures,
        model: serde_json::from_str(&file.text("model")?)
            .map_err(|e| file.invalid("metadata model", &e.to_string()))?,
        background: file.background()?,
        gain_spread: f64::from_bits(file.number("gain_spread_bits")?),
        initial_gaussians: file.number("initial_gaussians")?,
        scene: file.scene()?,
        gaussians,
    };
    if !belongs_together(&state) {
        return Err(file.invalid("tensors", "the arrays differ in length"));
    }
    check_finite(&state, path)?;
    let options = serde_json::from_str(&file.text("options")?)
        .map_err(|e| file.invalid("metadata options", &e.to_string()))?;
    Ok(Checkpoint {
        state,
        options,
        seed: file.number("seed")?,
        capture_sha256: file.text("capture_sha256")?,
    })
}

fn check_sum(
    tensors: &BTreeMap<String, TensorData>,
    metadata: &BTreeMap<String, String>,
    path: &Path,
) -> Result<()> {
    let Some(said) = metadata.get(CHECKSUM) else { return Ok(()) };
    let named = tensors.iter().map(|(name, tensor)| (name.as_str(), tensor));
    let others = metadata.iter().filter(|(key, _)| key.as_str() != CHECKSUM);
    let found = checksum(named, others.map(|(key, value)| (key.as_str(), value.as_str())));
    if *said == found.to_string() {
        return Ok(());
    }
    Err(FormatError::invalid(path, "checksum", "the file was changed after it was written")
        .with_remedy("copy it again, or resume from another checkpoint"))
}

fn belongs_together(s: &FitState) -> bool {
    let (n, sh) = (s.gaussians.len(), s.gaussians.sh.len());
    let fits = |m: &MomentColumns| {
        m.means.len() == n
            && m.rotations.len() == n
            && m.log_scales.len() == n
            && m.opacity_logits.len() == n
            && m.sh.len() == sh
    };
    let views = s.exposures.values.len();
    s.gaussians.is_consistent()
        && fits(&s.moments.first)
        && fits(&s.moments.second)
        && s.refine_stats.pull.len() == n
        && s.refine_stats.seen.len() == n
        && (s.filter_3d.is_empty() || s.filter_3d.len() == n)
        && s.exposures.first.len() == views
        && s.exposures.second.len() == views
        && s.exposures.steps.len() == views
        && s.skip.baseline.len() == views
}

struct File<'a> {
    path: &'a Path,
    tensors: BTreeMap<String, TensorData>,
    metadata: BTreeMap<String, String>,
}

impl File<'_> {
    fn invalid(&self, place: &str, cause: &str) -> FormatError {
        FormatError::invalid(self.path, place, cause.to_owned())
            .with_remedy("give the checkpoint that train-splat saved")
    }

    fn text(&self, key: &str) -> Result<String> {
        let found = self.metadata.get(key).cloned();
        found.ok_or_else(|| self.invalid("metadata", &format!("\"{key}\" is missing")))
    }

    fn number<T: std::str::FromStr>(&self, key: &str) -> Result<T> {
        let text = self.text(key)?;
        text.parse()
            .map_err(|_| self.invalid("metadata", &format!("\"{key}\" is not a number: {text}")))
    }

    fn take(&mut self, name: &str) -> Result<TensorData> {
        let found = self.tensors.remove(name);
        found.ok_or_else(|| self.invalid("tensors", &format!("\"{name}\" is missing")))
    }

    fn f32s(&mut self, name: &str) -> Result<Vec<f32>> {
        match self.take(name)? {
            TensorData::F32(_, values) => Ok(values),
            _ => Err(self.invalid(name, "expected 32-bit floats")),
        }
    }

    fn u32s(&mut self, name: &str) -> Result<Vec<u32>> {
        match self.take(name)? {
            TensorData::U32(_, values) => Ok(values),
            _ => Err(self.invalid(name, "expected 32-bit integers")),
        }
    }

    fn u64s(&mut self, name: &str) -> Result<Vec<u64>> {
        match self.take(name)? {
            TensorData::U64(_, values) => Ok(values),
            _ => Err(self.invalid(name, "expected 64-bit integers")),
        }
    }

    fn scene(&mut self) -> Result<ScenePlace> {
        match self.u64s("scene")?[..] {
            [extent, x, y, z, radius] => Ok(ScenePlace {
                extent: f64::from_bits(extent),
                shell_center: [x, y, z].map(f64::from_bits).into(),
                shell_radius: f64::from_bits(radius),
            }),
            _ => Err(self.invalid("scene", "expected five numbers")),
        }
    }

    fn background(&mut self) -> Result<BackgroundColor> {
        let colors = rows::<3>(self.f32s("background/values")?);
        let steps = self.u64s("background/steps")?;
        match (&colors[..], &steps[..]) {
            (&[value, first, second], &[steps]) => {
                Ok(BackgroundColor { value, first, second, steps })
            }
            _ => Err(self.invalid("background", "expected three colors and a number of steps")),
        }
    }

    fn columns(&mut self, prefix: &str) -> Result<MomentColumns> {
        Ok(MomentColumns {
            means: rows(self.f32s(&format!("{prefix}means"))?),
            rotations: rows(self.f32s(&format!("{prefix}rotations"))?),
            log_scales: rows(self.f32s(&format!("{prefix}log_scales"))?),
            opacity_logits: self.f32s(&format!("{prefix}opacity_logits"))?,
            sh: self.f32s(&format!("{prefix}sh"))?,
        })
    }
}

/// Groups of `M`; a remainder makes the length wrong, which [`belongs_together`] reports.
fn rows<const M: usize>(values: Vec<f32>) -> Vec<[f32; M]> {
    values.as_chunks().0.to_vec()
}
