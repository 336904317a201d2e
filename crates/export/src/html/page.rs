//! The page as text: style, scripts, shaders, data.

use std::io::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use motes_figures::html::{policy_element, policy_of_server};
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
        let packed: Vec<&Packed> = splats.iter().map(|(_, packed)| packed).collect();
        let manifest = json(&self.manifest_of(&packed))?;
        let script = script(START)?;
        fill(&self.title, STYLE, &script, writer, |name, writer| match name {
            "policy" => writer.write_all(policy_element(&script).as_bytes()),
            "data" => self.data(&manifest, &splats, writer),
            _ => Ok(()),
        })?;
        Ok(self.summary(&splats))
    }

    /// What the scripts of the page know, as JSON, for a server: `packed` is the splat and, when there is one, the other.
    ///
    /// # Panics
    /// When nothing is packed.
    pub fn manifest(&self, packed: &[&Packed]) -> serde_json::Value {
        // Numbers and texts always are JSON.
        serde_json::to_value(self.manifest_of(packed)).unwrap_or_default()
    }

    fn manifest_of(&self, all: &[&Packed]) -> Manifest {
        let packed = all[0];
        let splats = std::iter::once(self.splat).chain(self.other).zip(all);
        let center = DVec3::from(packed.center.map(f64::from));
        let up = self.up_in_world.try_normalize().unwrap_or(DVec3::Z);
        let eye = start::eye(center, f64::from(packed.radius), up).to_array();
        Manifest {
            splats: splats.map(|(s, p)| SplatEntry::new(p, s.antialias)).collect(),
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
        manifest: &str,
        splats: &[(ViewerSplat<'_>, Packed)],
        to: &mut dyn Write,
    ) -> std::io::Result<()> {
        writeln!(to, r#"<script type="application/json" id="manifest">{manifest}</script>"#)?;
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

/// What a page that a server feeds has beside the viewer.
#[derive(Clone, Copy, Debug)]
pub struct PageParts<'a> {
    /// CSS after that of the viewer.
    pub style: &'a str,
    /// HTML after the panel of the viewer.
    pub body: &'a str,
    /// Rows of the table of the help.
    pub keys: &'a str,
    /// JavaScript after that of the viewer, in its scope; it starts the page.
    pub script: &'a str,
}

/// A page that reads Gaussians and photos from the server that it came from.
#[derive(Clone, Debug)]
pub struct ServedPage {
    /// The page.
    pub html: String,
    /// Its content security policy, for the header.
    pub policy: String,
}

impl ServedPage {
    /// The viewer with more parts. Its script makes a `Viewer` with a manifest and a source of blocks and photos.
    pub fn new(title: &str, parts: &PageParts<'_>) -> Self {
        let script = script(parts.script).unwrap_or_default();
        let style = format!("{STYLE}{}", parts.style);
        let mut html = Vec::new();
        let more = |name: &str, writer: &mut dyn Write| match name {
            "more" => writer.write_all(parts.body.as_bytes()),
            "keys" => writer.write_all(parts.keys.as_bytes()),
            _ => Ok(()),
        };
        // Writing to memory does not fail.
        let _ = fill(title, &style, &script, &mut html, more);
        let html = String::from_utf8_lossy(&html).into_owned();
        Self { html, policy: policy_of_server(&script) }
    }
}

/// The page with its parts; `more` writes those that pages differ in.
fn fill(
    title: &str,
    style: &str,
    script: &str,
    writer: &mut dyn Write,
    mut more: impl FnMut(&str, &mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let generator = concat!("motes ", env!("CARGO_PKG_VERSION"));
    let mut rest = PAGE;
    while let Some((before, after)) = rest.split_once("{{") {
        writer.write_all(before.as_bytes())?;
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        match name {
            "generator" => writer.write_all(generator.as_bytes())?,
            "title" => writer.write_all(escaped(title).as_bytes())?,
            "style" => writer.write_all(style.as_bytes())?,
            "script" => writer.write_all(script.as_bytes())?,
            name => more(name, writer)?,
        }
        rest = after;
    }
    writer.write_all(rest.as_bytes())
}

/// JSON that no name of a user can end the script with.
fn json(value: &impl Serialize) -> std::io::Result<String> {
    Ok(serde_json::to_string(value)?.replace('<', "\\u003c"))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The text of the one `<script>` element, which ends with the script that starts the page.
fn script(start: &str) -> std::io::Result<String> {
    let shaders = json(&std::collections::BTreeMap::from(SHADERS))?;
    let parts: String = SCRIPTS.iter().chain([&start]).copied().collect();
    Ok(format!("\n\"use strict\";\n(() => {{\nconst SHADERS = {shaders};\n{parts}}})();\n"))
}
