//! OpenUSD text with a `ParticleField3DGaussianSplat` (usdVol, OpenUSD 26.03), which is written only.
//!
//! Positions, orientations `(w, x, y, z)`, scales (linear), opacities (0 to 1) and harmonics, particle after particle,
//! degree 0 first. Axes are right, up, back, as USD's cameras have them.

use std::fmt::Write as _;
use std::io::Write;
use std::ops::Range;
use std::path::Path;

use motes_scene::Gaussians;

use super::axes::Flip;
use super::options::SplatWriteOptions;
use super::quantize::{sigmoid, unit};
use super::registry::Codec;
use super::rows::write_blocks;
use motes_formats::atomic::write_error;
use motes_formats::error::Result;

pub(super) static CODEC: Codec = Codec {
    name: "usda",
    about: "OpenUSD text with a ParticleField3DGaussianSplat",
    suffixes: &[".usda"],
    lossless: true,
    loses: "rounding; other columns",
    write: Some(write),
    ..Codec::DEFAULT
};

fn write(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    _: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let flip = Flip::ABOUT_X;
    let write_all = |writer: &mut dyn Write| -> std::io::Result<()> {
        writer.write_all(
            b"#usda 1.0\n(\n    defaultPrim = \"Splat\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n\
            def ParticleField3DGaussianSplat \"Splat\"\n{\n",
        )?;
        let extent = extent(gaussians);
        writeln!(writer, "    float3[] extent = [{}, {}]", tuple(&extent[0]), tuple(&extent[1]))?;
        array(writer, gaussians, "point3f[] positions", &|i, text| {
            text.push_str(&tuple(&flip.point(gaussians.means[i])));
        })?;
        array(writer, gaussians, "quatf[] orientations", &|i, text| {
            text.push_str(&tuple(&flip.rotation(unit(gaussians.rotations[i]))));
        })?;
        array(writer, gaussians, "float3[] scales", &|i, text| {
            text.push_str(&tuple(&gaussians.log_scales[i].map(f32::exp)));
        })?;
        array(writer, gaussians, "float[] opacities", &|i, text| {
            let _ = write!(text, "{}", sigmoid(gaussians.opacity_logits[i]));
        })?;
        let degree = gaussians.sh_degree;
        writeln!(writer, "    uniform int radiance:sphericalHarmonicsDegree = {degree}")?;
        let name = "float3[] radiance:sphericalHarmonicsCoefficients";
        array(writer, gaussians, name, &|i, text| {
            for (k, rgb) in gaussians.sh_of(i).chunks_exact(3).enumerate() {
                let sign = flip.sh_sign(k);
                if k > 0 {
                    text.push_str(", ");
                }
                text.push_str(&tuple(&[sign * rgb[0], sign * rgb[1], sign * rgb[2]]));
            }
        })?;
        writer.write_all(
            b"    uniform token projectionModeHint = \"perspective\"\n    \
            uniform token sortingModeHint = \"zDepth\"\n}\n",
        )
    };
    write_all(writer).map_err(|error| write_error(path, error))
}

fn array(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    name: &str,
    append: &(dyn Fn(usize, &mut String) + Sync),
) -> std::io::Result<()> {
    write!(writer, "    {name} = [")?;
    let encode = |rows: Range<usize>, bytes: &mut Vec<u8>| {
        let mut text = String::new();
        for i in rows {
            if i > 0 {
                text.push_str(", ");
            }
            append(i, &mut text);
        }
        bytes.extend(text.into_bytes());
    };
    write_blocks(writer, gaussians.len(), encode)?;
    writer.write_all(b"]\n")
}

/// Box around three standard deviations of every Gaussian.
fn extent(gaussians: &Gaussians) -> [[f32; 3]; 2] {
    let mut extent = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    for (mean, scales) in gaussians.means.iter().zip(&gaussians.log_scales) {
        let reach = 3.0 * scales.iter().fold(f32::NEG_INFINITY, |a, s| a.max(*s)).exp();
        let mean = Flip::ABOUT_X.point(*mean);
        for axis in 0..3 {
            extent[0][axis] = extent[0][axis].min(mean[axis] - reach);
            extent[1][axis] = extent[1][axis].max(mean[axis] + reach);
        }
    }
    extent
}

fn tuple(values: &[f32]) -> String {
    let mut text = String::from("(");
    for (i, value) in values.iter().enumerate() {
        let separator = if i > 0 { ", " } else { "" };
        let _ = write!(text, "{separator}{value}");
    }
    text.push(')');
    text
}
