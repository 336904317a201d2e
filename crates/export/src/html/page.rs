//! The page as text: style, scripts, shaders, data.

use std::io::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use motes_figures::html::policy_element;
use serde::Serialize;

use super::manifest::{LightEntry, Manifest, PhotoEntry, PinholeEntry, SplatEntry, StartEntry};
use super::pack::{PackOptions, Packed, pack};
use super::{ViewerPage, ViewerSplat, start};

const PAGE: &str = include_str!("viewer/page.html");
const STYLE: &str = include_str!("viewer/page.css");
/// In this order: later ones use earlier ones.
const SCRIPTS: [&str; 7] = [
    include_str!("viewer/codec.js"),
    include_str!("viewer/sorter.js"),
    include_str!("viewer/camera.js"),
    include_str!("viewer/renderer.js"),
    include_str!("viewer/pointer.js"),
    include_str!("viewer/viewer.js"),
    include_str!("viewer/controls.js"),
];
const START: &str = include_str!("viewer/start.js");
const SHADERS: [(&str, &str); 6] = [
    ("gaussian", include_str!("viewer/gaussian.glsl")),
    ("full_vert", include_str!("viewer/full.vert.glsl")),
    ("shade_frag", include_str!("viewer/shade.frag.glsl")),
    ("splat_vert", include_str!("viewer/splat.vert.glsl")),
    ("splat_frag", include_str!("viewer/splat.frag.glsl")),
    ("show_frag", include_str!("viewer/show.frag.glsl")),
];

/// What went into a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HtmlSummary {
    /// The first splat and the one to compare with.
    pub splats: Vec<SplatSummary>,
    /// Embedded photos.
    pub photos: usize,
    /// Lights to turn.
    pub lights: usize,
}

/// What became of a splat.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SplatSummary {
    /// Gaussians on the page.
    pub gaussians: usize,
    /// Gaussians that no renderer shows.
    pub dropped: usize,
    /// Degree of their harmonics.
    pub sh_degree: u8,
    /// Bytes of text per Gaussian.
    pub bytes_per_gaussian: f64,
}

impl ViewerPage<'_> {
    /// Writes the page.
    ///
    /// # Errors
    /// What the writer refuses.
    pub fn write(
        &self,
        options: &PackOptions,
        writer: &mut dyn Write,
    ) -> std::io::Result<HtmlSummary> {
        let splats: Vec<(ViewerSplat<'_>, Packed)> = std::iter::once(self.splat)
            .chain(self.other)
            .map(|splat| (splat, pack(splat.gaussians, options)))
            .collect();
        let manifest = json(&self.manifest(&splats))?;
        let shaders = json(&std::collections::BTreeMap::from(SHADERS))?;
        let generator = concat!("motes ", env!("CARGO_PKG_VERSION"));
        let mut rest = PAGE;
        while let Some((before, after)) = rest.split_once("{{") {
            writer.write_all(before.as_bytes())?;
            let (name, after) = after.split_once("}}").unwrap_or((after, ""));
            match name {
                "generator" => writer.write_all(generator.as_bytes())?,
                "policy" => {
                    let policy = policy_element(&script(&shaders));
                    writer.write_all(policy.as_bytes())?;
                }
                "title" => writer.write_all(escaped(&self.title).as_bytes())?,
                "style" => writer.write_all(STYLE.as_bytes())?,
                "manifest" => writer.write_all(manifest.as_bytes())?,
                "data" => self.data(&splats, writer)?,
                "script" => writer.write_all(script(&shaders).as_bytes())?,
                _ => {}
            }
            rest = after;
        }
        writer.write_all(rest.as_bytes())?;
        Ok(self.summary(&splats))
    }

    fn manifest(&self, splats: &[(ViewerSplat<'_>, Packed)]) -> Manifest {
        let packed = &splats[0].1;
        let center = DVec3::from(packed.center.map(f64::from));
        let up = self.up_in_world.try_normalize().unwrap_or(DVec3::Z);
        let eye = start::eye(center, f64::from(packed.radius), up).to_array();
        Manifest {
            splats: splats.iter().map(|(s, p)| SplatEntry::new(p, s.antialias)).collect(),
            photos: self.photos.iter().map(PhotoEntry::new).collect(),
            lights: self.lights.iter().map(LightEntry::new).collect(),
            up: up.to_array(),
            center: center.to_array(),
            start: StartEntry { eye, pinhole: PinholeEntry::new(&start::pinhole()) },
            background: self.background,
        }
    }

    fn data(
        &self,
        splats: &[(ViewerSplat<'_>, Packed)],
        to: &mut dyn Write,
    ) -> std::io::Result<()> {
        for (s, (_, packed)) in splats.iter().enumerate() {
            for (b, block) in packed.blocks.iter().enumerate() {
                let text = STANDARD.encode(block);
                writeln!(to, r#"<script type="text/plain" id="splat-{s}-{b}">{text}</script>"#)?;
            }
        }
        for (p, photo) in self.photos.iter().enumerate() {
            let text = STANDARD.encode(&photo.jpeg);
            writeln!(to, r#"<script type="text/plain" id="photo-{p}">{text}</script>"#)?;
        }
        Ok(())
    }

    fn summary(&self, splats: &[(ViewerSplat<'_>, Packed)]) -> HtmlSummary {
        let one = |packed: &Packed| SplatSummary {
            gaussians: packed.count,
            dropped: packed.dropped,
            sh_degree: packed.sh_degree,
            bytes_per_gaussian: packed.blocks.iter().map(|b| b.len().div_ceil(3) * 4).sum::<usize>()
                as f64
                / packed.count.max(1) as f64,
        };
        HtmlSummary {
            splats: splats.iter().map(|(_, packed)| one(packed)).collect(),
            photos: self.photos.len(),
            lights: self.lights.len(),
        }
    }
}

/// JSON that no name of a user can end the script with.
fn json(value: &impl Serialize) -> std::io::Result<String> {
    Ok(serde_json::to_string(value)?.replace('<', "\\u003c"))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The text of the one `<script>` element.
fn script(shaders: &str) -> String {
    let parts: String = SCRIPTS.iter().chain([&START]).copied().collect();
    format!("\n\"use strict\";\n(() => {{\nconst SHADERS = {shaders};\n{parts}}})();\n")
}
