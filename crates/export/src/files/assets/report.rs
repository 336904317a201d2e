//! What is said about an asset.

use std::fmt;
use std::path::PathBuf;

use crate::html::HtmlSummary;
use crate::mesh::MeshSummary;
use crate::shadow::ShadowSummary;
use serde::Serialize;

use super::Asset;

/// The report.
#[derive(Clone, Debug, Serialize)]
pub struct AssetReport {
    /// What was made.
    pub format: Asset,
    /// The product, and what lies beside it.
    pub files: Vec<PathBuf>,
    /// Bytes of the product; null for standard output.
    pub bytes: Option<u64>,
    /// CPU seconds of all threads; null where the system does not tell.
    pub cpu_seconds: Option<f64>,
    /// What is in it.
    pub contents: Option<AssetDetails>,
}

/// What is in an asset.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum AssetDetails {
    /// Of a page.
    Html(HtmlSummary),
    /// Of a mesh.
    Mesh(MeshSummary),
    /// Of a shadow.
    Shadow(ShadowSummary),
}

impl AssetReport {
    pub(super) fn new(
        format: Asset,
        files: Vec<PathBuf>,
        contents: Option<AssetDetails>,
        cpu_seconds: Option<f64>,
    ) -> Self {
        let bytes = files.first().and_then(|f| std::fs::metadata(f).ok()).map(|found| found.len());
        Self { format, files, bytes, cpu_seconds, contents }
    }
}

impl fmt::Display for AssetReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.files.iter().map(|file| file.display().to_string()).collect();
        write!(f, "{}", names.join(", "))?;
        if let Some(bytes) = self.bytes {
            write!(f, ": {:.2} MB", bytes as f64 / 1e6)?;
        }
        match &self.contents {
            Some(AssetDetails::Html(html)) => html_text(html, f),
            Some(AssetDetails::Mesh(mesh)) => mesh_text(mesh, f),
            Some(AssetDetails::Shadow(shadow)) => shadow_text(shadow, f),
            None => Ok(()),
        }
    }
}

fn html_text(html: &HtmlSummary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for splat in &html.splats {
        write!(
            f,
            "\n{} Gaussians of SH degree {}, {:.1} bytes each",
            splat.gaussians, splat.sh_degree, splat.bytes_per_gaussian
        )?;
        if splat.dropped > 0 {
            write!(f, "; {} that no renderer shows were left out", splat.dropped)?;
        }
    }
    write!(f, "\n{} photos, {} lights", html.photos, html.lights)
}

fn mesh_text(mesh: &MeshSummary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(
        f,
        "\n{} of {} triangles, {} vertices, moved by about {:.2e}",
        mesh.triangles, mesh.triangles_of_surface, mesh.vertices, mesh.decimation_error
    )?;
    if mesh.charts > 0 {
        write!(
            f,
            "\n{} charts on {:.0} % of the texture, a texel is {:.2e}; {:.0} % of them from Gaussians",
            mesh.charts,
            100.0 * mesh.utilization,
            mesh.texel,
            100.0 * mesh.from_gaussians
        )?;
    }
    Ok(())
}

fn shadow_text(shadow: &ShadowSummary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let [width, height] = shadow.size;
    write!(
        f,
        "\na plane of {width:.3} x {height:.3} at height {:.4}, {} triangles above it, darkest {:.3}",
        shadow.ground_height, shadow.occluders, shadow.darkest
    )
}
