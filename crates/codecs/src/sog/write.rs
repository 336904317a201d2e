//! Writing a SOG.

use std::io::Write;
use std::path::Path;

use motes_math::codebook::{codebook, nearest_in_codebook};
use motes_math::kmeans::{KmeansOptions, kmeans};
use motes_scene::Gaussians;
use rayon::prelude::*;

use super::super::morton::morton_order;
use super::super::options::{SogOptions, SplatWriteOptions};
use super::super::quantize::{sigmoid, smallest_three, unit, unorm8};
use super::archive::pack;
use super::images::{Pixels, encode};
use super::meta::{Asset, Files, Harmonics, Indexed, Means, Meta};
use super::{CODEBOOK, MOST_PALETTE, PALETTE_COLUMNS, ROTATION_TAG};
use motes_formats::atomic::write_error;
use motes_formats::error::Result;
use motes_formats::ply::RenderMode;

/// How much rare values of a codebook count, see [`codebook`].
const DENSITY: f64 = 0.5;
/// Log scales beyond are clamped: minus infinity has no place in a codebook.
const SCALE_LIMIT: f32 = 20.0;

pub(in super::super) fn write(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let refused = |error| write_error(path, error);
    let order = morton_order(gaussians);
    let mut images: Vec<(&str, Pixels)> = Vec::new();
    let (means, [low, high]) = positions(gaussians, &order);
    images.push(("means_l.webp", low));
    images.push(("means_u.webp", high));
    images.push(("quats.webp", rotations(gaussians, &order)));
    let (scale_book, scales) = scales(gaussians, &order);
    images.push(("scales.webp", scales));
    let (color_book, colors) = colors(gaussians, &order);
    images.push(("sh0.webp", colors));
    let mut sh_n = None;
    if gaussians.sh_degree > 0 {
        let (harmonics, palette, labels) = harmonics(gaussians, &order, &options.sog);
        images.push(("shN_centroids.webp", palette));
        images.push(("shN_labels.webp", labels));
        sh_n = Some(harmonics);
    }
    let files = |name: &str| vec![name.to_owned()];
    let meta = Meta {
        version: 2,
        asset: Asset { generator: concat!("motes ", env!("CARGO_PKG_VERSION")).into() },
        count: gaussians.len() as u64,
        model: (options.render_mode == Some(RenderMode::Mip)).then(|| "antialiased".into()),
        means,
        scales: Indexed { codebook: scale_book, files: files("scales.webp") },
        quats: Files { files: files("quats.webp") },
        sh0: Indexed { codebook: color_book, files: files("sh0.webp") },
        sh_n,
    };
    let mut packed: Vec<(&str, Vec<u8>)> = images
        .into_par_iter()
        .map(|(name, pixels)| Ok((name, encode(&pixels)?)))
        .collect::<std::io::Result<_>>()
        .map_err(refused)?;
    let meta = serde_json::to_vec(&meta).map_err(|error| refused(error.into()))?;
    packed.push(("meta.json", meta));
    writer.write_all(&pack(&packed).map_err(refused)?).map_err(refused)
}

/// An image with the pixel `of(row)` at each place of the order.
fn image(order: &[u32], of: impl Fn(usize) -> [u8; 4] + Sync) -> Pixels {
    let (width, height) = Pixels::size_for(order.len());
    // What is beyond the last Gaussian is opaque: alpha that varies costs room.
    let mut rgba = vec![0; 4 * width * height];
    rgba.par_chunks_exact_mut(4).enumerate().for_each(|(i, pixel)| {
        let value = order.get(i).map_or([0, 0, 0, 255], |row| of(*row as usize));
        pixel.copy_from_slice(&value);
    });
    Pixels { width, height, rgba }
}

/// Even steps of `sign(v) ln(1 + |v|)` between the lowest and the highest.
fn positions(gaussians: &Gaussians, order: &[u32]) -> (Means, [Pixels; 2]) {
    let logarithm = |v: f32| f64::from(v).signum() * f64::from(v).abs().ln_1p();
    let mut mins = [f64::INFINITY; 3];
    let mut maxs = [f64::NEG_INFINITY; 3];
    for mean in &gaussians.means {
        for axis in 0..3 {
            mins[axis] = mins[axis].min(logarithm(mean[axis]));
            maxs[axis] = maxs[axis].max(logarithm(mean[axis]));
        }
    }
    let step = |row: usize| -> [u16; 3] {
        std::array::from_fn(|axis| {
            let range = maxs[axis] - mins[axis];
            let share = (logarithm(gaussians.means[row][axis]) - mins[axis]) / range;
            // NaN, where all are equal, is 0.
            (share * 65535.0).round() as u16
        })
    };
    let bytes = |high: usize| {
        image(order, |row| {
            let [x, y, z] = step(row).map(|step| step.to_le_bytes()[high]);
            [x, y, z, 255]
        })
    };
    let images = [bytes(0), bytes(1)];
    let files = vec!["means_l.webp".into(), "means_u.webp".into()];
    (Means { mins, maxs, files }, images)
}

fn rotations(gaussians: &Gaussians, order: &[u32]) -> Pixels {
    image(order, |row| {
        let (largest, others) = smallest_three(unit(gaussians.rotations[row]));
        let [a, b, c] = others.map(|v| unorm8(v * std::f32::consts::FRAC_1_SQRT_2 + 0.5));
        [a, b, c, ROTATION_TAG + largest as u8]
    })
}

fn scales(gaussians: &Gaussians, order: &[u32]) -> (Vec<f32>, Pixels) {
    let clamped =
        |row: usize| gaussians.log_scales[row].map(|s| s.clamp(-SCALE_LIMIT, SCALE_LIMIT));
    let values: Vec<f32> = (0..gaussians.len()).flat_map(clamped).collect();
    let book = codebook(&values, CODEBOOK, DENSITY);
    let image = image(order, |row| {
        let [x, y, z] = clamped(row).map(|s| nearest_in_codebook(&book, s) as u8);
        [x, y, z, 255]
    });
    (padded(book), image)
}

fn colors(gaussians: &Gaussians, order: &[u32]) -> (Vec<f32>, Pixels) {
    let dc = |row: usize| {
        let sh = gaussians.sh_of(row);
        [sh[0], sh[1], sh[2]]
    };
    let values: Vec<f32> = (0..gaussians.len()).flat_map(dc).collect();
    let book = codebook(&values, CODEBOOK, DENSITY);
    let image = image(order, |row| {
        let [r, g, b] = dc(row).map(|v| nearest_in_codebook(&book, v) as u8);
        [r, g, b, unorm8(sigmoid(gaussians.opacity_logits[row]))]
    });
    (padded(book), image)
}

/// Readers expect 256 values.
fn padded(mut book: Vec<f32>) -> Vec<f32> {
    let last = book.last().copied().unwrap_or_default();
    book.resize(CODEBOOK, last);
    book
}

/// As many palette entries as other writers take: a power of two, at most one per Gaussian.
fn palette_size(count: usize) -> usize {
    (1usize << count.max(1).ilog2()).min(MOST_PALETTE)
}

fn harmonics(
    gaussians: &Gaussians,
    order: &[u32],
    options: &SogOptions,
) -> (Harmonics, Pixels, Pixels) {
    let coefficients = gaussians.sh_coefficients() - 1;
    let rest: Vec<f32> =
        (0..gaussians.len()).flat_map(|row| gaussians.sh_of(row)[3..].iter().copied()).collect();
    let wanted = options.palette.map_or_else(|| palette_size(order.len()), |size| size as usize);
    let clusters = kmeans(
        &rest,
        3 * coefficients,
        &KmeansOptions {
            clusters: wanted.clamp(1, MOST_PALETTE),
            iterations: options.iterations,
            probes: options.probes,
            seed: options.seed,
        },
    );
    drop(rest);
    let book = codebook(&clusters.centroids, CODEBOOK, DENSITY);
    let entries = clusters.centroids.len() / (3 * coefficients);
    let height = entries.div_ceil(PALETTE_COLUMNS).max(1);
    let width = PALETTE_COLUMNS * coefficients;
    // Entry after entry, 64 in a row of the image: the same order as the centroids.
    let mut rgba = vec![255; 4 * width * height];
    for (pixel, rgb) in rgba.chunks_exact_mut(4).zip(clusters.centroids.chunks_exact(3)) {
        for (byte, value) in pixel.iter_mut().zip(rgb) {
            *byte = nearest_in_codebook(&book, *value) as u8;
        }
    }
    let palette = Pixels { width, height, rgba };
    let labels = image(order, |row| {
        let [low, high, ..] = clusters.labels[row].to_le_bytes();
        [low, high, 0, 255]
    });
    let harmonics = Harmonics {
        count: entries as u64,
        bands: gaussians.sh_degree,
        codebook: padded(book),
        files: vec!["shN_centroids.webp".into(), "shN_labels.webp".into()],
    };
    (harmonics, palette, labels)
}
