//! Reading a SOG.

use std::path::Path;

use motes_scene::Gaussians;

use super::super::quantize::{from_smallest_three, logit_of_byte};
use super::super::rows::{check_rows, with_room};
use super::archive::Archive;
use super::images::{Pixels, decode};
use super::meta::{Meta, Version};
use super::{MOST_PALETTE, PALETTE_COLUMNS, ROTATION_TAG, fault};
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::{GaussianFile, RenderMode};

/// Reads an archive.
pub(in super::super) fn read(data: &[u8], path: &Path) -> Result<GaussianFile> {
    let mut archive = Archive::open(data, path)?;
    let meta = archive.read("meta.json")?;
    read_files(&meta, &mut archive, data.len(), path)
}

/// Reads `meta.json` and the images beside it.
pub(in super::super) fn read_folder(meta: &[u8], path: &Path) -> Result<GaussianFile> {
    let mut folder = Archive::Folder(path.parent().unwrap_or(Path::new("")).to_owned());
    let low = parse(meta, path)?.means.files;
    let packed = low.first().map_or(Ok(0), |name| folder.read(name).map(|bytes| bytes.len()))?;
    read_files(meta, &mut folder, packed, path)
}

/// `packed`: bytes of the archive, or of the image of positions, which compress least.
fn read_files(
    meta: &[u8],
    archive: &mut Archive<'_>,
    packed: usize,
    path: &Path,
) -> Result<GaussianFile> {
    let meta = parse(meta, path)?;
    let bands = meta.sh_n.as_ref().map_or(0, |harmonics| harmonics.bands);
    let mut image = |files: &[String], i: usize, count: u64| -> Result<Pixels> {
        let name = files.get(i).ok_or_else(|| fault(path, "meta.json", "an image has no name"))?;
        let bytes = archive.read(name)?;
        check_rows(path, "meta.json", meta.count, bands, packed)?;
        decode(&bytes, count, path, name)
    };
    let low = image(&meta.means.files, 0, meta.count)?;
    let high = image(&meta.means.files, 1, meta.count)?;
    let rotations = image(&meta.quats.files, 0, meta.count)?;
    let scales = image(&meta.scales.files, 0, meta.count)?;
    let colors = image(&meta.sh0.files, 0, meta.count)?;
    let palette = match &meta.sh_n {
        Some(harmonics) if harmonics.bands > 0 => {
            let coefficients = (usize::from(harmonics.bands) + 1).pow(2) - 1;
            let rows = harmonics.count.div_ceil(PALETTE_COLUMNS as u64);
            let columns = PALETTE_COLUMNS * coefficients;
            let name = harmonics.files.first().map_or("shN", String::as_str);
            let texels = image(&harmonics.files, 0, rows * columns as u64)?;
            if texels.width != columns {
                let cause =
                    format!("the palette is {} pixels wide instead of {columns}", texels.width);
                return Err(fault(path, name, cause));
            }
            let labels = image(&harmonics.files, 1, meta.count)?;
            Some((harmonics, coefficients, texels, labels))
        }
        _ => None,
    };
    let degree = palette.as_ref().map_or(0, |(harmonics, ..)| harmonics.bands);
    let mut gaussians = with_room(meta.count as usize, degree);
    for i in 0..meta.count as usize {
        append(
            &mut gaussians,
            &meta,
            [&low, &high, &rotations, &scales, &colors].map(|p| p.pixel(i)),
        );
        let Some((harmonics, coefficients, texels, labels)) = &palette else { continue };
        let [low, high, ..] = labels.pixel(i);
        let label = usize::from(u16::from_le_bytes([low, high]));
        if label as u64 >= harmonics.count {
            let cause =
                format!("Gaussian {i} has label {label} of a palette of {}", harmonics.count);
            return Err(fault(path, "shN labels", cause));
        }
        let first = label / PALETTE_COLUMNS * texels.width + label % PALETTE_COLUMNS * coefficients;
        for k in 0..*coefficients {
            let [r, g, b, _] = texels.pixel(first + k);
            gaussians.sh.extend([r, g, b].map(|v| entry(&harmonics.codebook, v)));
        }
    }
    let render_mode = Some(match meta.model.as_deref() {
        Some("antialiased") => RenderMode::Mip,
        _ => RenderMode::Default,
    });
    Ok(GaussianFile { render_mode, ..GaussianFile::new(gaussians, Vec::new()) })
}

fn entry(codebook: &[f32], index: u8) -> f32 {
    // Shorter codebooks are checked on entry; the last value stands for what is beyond.
    codebook[usize::from(index).min(codebook.len() - 1)]
}

fn append(to: &mut Gaussians, meta: &Meta, [low, high, rotation, scale, color]: [[u8; 4]; 5]) {
    to.means.push(std::array::from_fn(|axis| {
        let step = u16::from_le_bytes([low[axis], high[axis]]);
        let (min, max) = (meta.means.mins[axis], meta.means.maxs[axis]);
        let value = min + (max - min) * f64::from(step) / 65535.0;
        (value.signum() * value.abs().exp_m1()) as f32
    }));
    let [a, b, c, tag] = rotation;
    to.rotations.push(match tag.checked_sub(ROTATION_TAG) {
        Some(largest) => {
            let small =
                |byte: u8| (f32::from(byte) / 255.0 * 2.0 - 1.0) * std::f32::consts::FRAC_1_SQRT_2;
            from_smallest_three(usize::from(largest), [small(a), small(b), small(c)])
        }
        None => [1.0, 0.0, 0.0, 0.0],
    });
    let [x, y, z, _] = scale;
    to.log_scales.push([x, y, z].map(|v| entry(&meta.scales.codebook, v)));
    let [r, g, b, opacity] = color;
    to.sh.extend([r, g, b].map(|v| entry(&meta.sh0.codebook, v)));
    to.opacity_logits.push(logit_of_byte(opacity));
}

fn parse(bytes: &[u8], path: &Path) -> Result<Meta> {
    let bad = |error: serde_json::Error| {
        fault(path, "meta.json", format!("not the JSON of a SOG: {error}"))
    };
    let version: Version = serde_json::from_slice(bytes).map_err(bad)?;
    if version.version != Some(2) {
        let said = version.version.map_or("1 (without a number)".into(), |v| v.to_string());
        let cause = format!("SOG version {said}; version 2 is known");
        return Err(FormatError::not_supported(path, "meta.json", cause)
            .with_remedy("convert the file with splat-transform"));
    }
    let meta: Meta = serde_json::from_slice(bytes).map_err(bad)?;
    let bad = |cause: String| Err(fault(path, "meta.json", cause));
    if meta.count > u64::from(u32::MAX) {
        return bad(format!("{} Gaussians are more than the 2^32 - 1 that fit", meta.count));
    }
    let books = [&meta.scales.codebook, &meta.sh0.codebook];
    let harmonics = meta.sh_n.as_ref();
    if books.into_iter().chain(harmonics.map(|h| &h.codebook)).any(Vec::is_empty) {
        return bad("a codebook is empty".into());
    }
    if let Some(harmonics) = harmonics
        && (harmonics.bands > 3 || harmonics.count > MOST_PALETTE as u64)
    {
        return bad(format!("{} bands, a palette of {}", harmonics.bands, harmonics.count));
    }
    Ok(meta)
}
