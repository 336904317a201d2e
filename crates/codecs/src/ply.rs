//! INRIA's PLY and its relatives, see `docs/formats/gaussians-ply.md`.

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use motes_scene::Gaussians;

use super::options::{PlyLayout, SplatWriteOptions};
use super::r3dg;
use super::registry::{Codec, Input};
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::{self, PlyColumns, PlyWriteOptions};

pub(super) static CODEC: Codec = Codec {
    name: "ply",
    about: "Gaussians as PLY, see --layout",
    suffixes: &[".ply"],
    max_sh_degree: 4,
    lossless: true,
    keeps_extra_columns: true,
    loses: "nothing",
    starts: |start| start.starts_with(b"ply") || start.starts_with(b"\xef\xbb\xbfply"),
    read: Input::Ply,
    write: Some(write),
    ..Codec::DEFAULT
};

fn write(
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
