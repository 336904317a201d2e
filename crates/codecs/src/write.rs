//! One way out.

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use clap::ValueEnum;
use motes_scene::{ExposureResponse, Gaussians};
use serde::Serialize;

use super::r3dg;
use super::registry::SplatFormat;
use super::sog::SogOptions;
use super::spz::SpzOptions;
use motes_formats::atomic::write_checked;
use motes_formats::error::{FormatError, Result};
use motes_formats::finite;
use motes_formats::ply::{self, PlyColumns, PlyWriteOptions, RenderMode};

/// Which relative of INRIA's PLY is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlyLayout {
    /// INRIA's columns and all others.
    #[default]
    Motes,
    /// INRIA's columns alone.
    Inria,
    /// INRIA's and those of Relightable3DGaussian.
    R3dg,
    /// INRIA's without `scale_2`: each Gaussian loses its thinnest axis, which becomes its local z.
    #[value(name = "2dgs")]
    #[serde(rename = "2dgs")]
    Flat,
}

/// Options of all formats.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SplatWriteOptions {
    /// How the Gaussians want to be splatted.
    pub render_mode: Option<RenderMode>,
    /// How the brightness of photos follows their metadata.
    pub exposure_response: Option<ExposureResponse>,
    /// Comments, where the format has them.
    pub comments: Vec<String>,
    /// For PLY.
    pub layout: PlyLayout,
    /// For spz.
    pub spz: SpzOptions,
    /// For SOG.
    pub sog: SogOptions,
}

impl SplatWriteOptions {
    /// Lines that a PLY header of another layout gets.
    pub(super) fn ply_comments(&self) -> Vec<String> {
        let mode = self.render_mode.map(|mode| format!("SplatRenderMode: {}", mode.name()));
        let comments = self.comments.iter().cloned().chain(mode);
        comments.map(|text| text.replace(char::is_control, " ")).collect()
    }
}

/// Writes Gaussians. SH degrees that the format cannot hold are left out.
///
/// # Errors
/// Writing fails, a value is not finite, or the options ask for columns that the Gaussians do not have.
///
/// # Panics
/// When the arrays are not [consistent](Gaussians::is_consistent).
pub fn write_gaussians(
    path: &Path,
    format: SplatFormat,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
) -> Result<()> {
    finite::gaussians(path, gaussians)?;
    write_checked(path, |writer| write_gaussians_to(writer, format, gaussians, options, path))
}

/// Writes Gaussians to a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`write_gaussians`].
///
/// # Panics
/// As [`write_gaussians`].
pub fn write_gaussians_to(
    writer: &mut dyn Write,
    format: SplatFormat,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    name: &Path,
) -> Result<()> {
    assert!(gaussians.is_consistent(), "arrays of different lengths");
    let codec = format.codec();
    let Some(write) = codec.write else {
        let cause = format!("{} is read, but not written", codec.name);
        return Err(FormatError::not_supported(name, "", cause));
    };
    let gaussians = if gaussians.sh_degree > codec.max_sh_degree {
        Cow::Owned(gaussians.with_sh_degree(codec.max_sh_degree))
    } else {
        Cow::Borrowed(gaussians)
    };
    write(writer, &gaussians, options, name)
}

pub(super) fn write_ply(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let mut ply = PlyWriteOptions {
        render_mode: options.render_mode,
        exposure_response: options.exposure_response,
        comments: options.comments.clone(),
        columns: PlyColumns::All,
    };
    let gaussians = match options.layout {
        PlyLayout::Motes => Cow::Borrowed(gaussians),
        PlyLayout::Inria => {
            ply.columns = PlyColumns::Standard;
            Cow::Borrowed(gaussians)
        }
        PlyLayout::R3dg => Cow::Owned(r3dg::deactivated(gaussians).map_err(|column| {
            let cause = format!("R3DG's columns are materials, and the Gaussians have no {column}");
            FormatError::invalid(path, "layout r3dg", cause)
                .with_remedy("export a scene folder that decompose made, or take another --layout")
        })?),
        PlyLayout::Flat => {
            ply.columns = PlyColumns::Flat;
            // Viewers that know this comment draw flat Gaussians without dilation.
            ply.comments.push("SplatRenderMode: 2dgs".into());
            ply.render_mode = None;
            Cow::Owned(thinnest_last(gaussians))
        }
    };
    ply::write_gaussians_to(writer, &gaussians, &ply, path)
}

/// The same Gaussians with local axes renamed so that z is the thinnest.
fn thinnest_last(gaussians: &Gaussians) -> Gaussians {
    let mut turned = gaussians.clone();
    turned.extra.clear();
    for (rotation, scales) in turned.rotations.iter_mut().zip(&mut turned.log_scales) {
        let [a, b, c] = *scales;
        let half = 0.5;
        // A third of a turn about (1, 1, 1) renames the axes in a circle.
        let third = if a < b && a < c {
            *scales = [b, c, a];
            [half, half, half, half]
        } else if b < c {
            *scales = [c, a, b];
            [half, -half, -half, -half]
        } else {
            continue;
        };
        *rotation = product(*rotation, third);
    }
    turned
}

/// The product of quaternions `w, x, y, z`.
fn product(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Quat, Vec3};

    use super::*;

    #[test]
    fn renaming_the_axes_keeps_the_covariance() {
        for scales in [[-3.0, 0.5, 1.0], [0.5, -3.0, 1.0], [1.0, 0.5, -3.0], [0.0, 0.0, 0.0]] {
            let mut gaussians = Gaussians::empty(0);
            gaussians.rotations = vec![[0.8, 0.1, -0.5, 0.3]];
            gaussians.log_scales = vec![scales];
            let turned = thinnest_last(&gaussians);
            assert!(
                turned.log_scales[0][2] <= turned.log_scales[0][0].min(turned.log_scales[0][1])
            );
            let covariance = |g: &Gaussians| {
                let [w, x, y, z] = g.rotations[0];
                let r = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
                let s = Mat3::from_diagonal(Vec3::from_array(g.log_scales[0].map(f32::exp)));
                r * s * s * r.transpose()
            };
            let difference = covariance(&turned) - covariance(&gaussians);
            assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-5), "{difference}");
        }
    }
}
