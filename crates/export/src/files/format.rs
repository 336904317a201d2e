//! Which product a command line asks for: the table from suffixes to makers.

use std::path::Path;

use clap::ValueEnum;
use motes_codecs::SplatFormat;
use motes_formats::colmap::Layout;
use motes_stage::StageError;
use serde::Serialize;

use super::CameraFormat;
use super::assets::Asset;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExportFormat {
    /// Gaussians as PLY, see --layout
    Ply,
    /// PlayCanvas compressed PLY
    CompressedPly,
    /// antimatter15 .splat
    Splat,
    /// Niantic .spz, see --spz-version
    Spz,
    /// PlayCanvas SOG
    Sog,
    /// Binary glTF with KHR_gaussian_splatting
    Glb,
    /// OpenUSD text with a ParticleField3DGaussianSplat
    Usda,
    /// A table with a line per Gaussian
    Csv,
    /// Statistics of each column as JSON
    Statistics,
    /// nerfstudio transforms.json of --capture or --path
    Transforms,
    /// Folder with a binary COLMAP model of --capture or --path
    Colmap,
    /// Folder with a COLMAP model as text
    ColmapText,
    /// glTF cameras of --capture or --path
    GltfCameras,
    /// One HTML page with a viewer
    Html,
    /// Relightable mesh (.glb) of a scene folder, with its environment map
    Mesh,
    /// Shadow of a scene folder's objects as a textured plane (.glb) and an image
    ShadowPlane,
}

/// Who makes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Product {
    /// Gaussians in a file of this format.
    Splat(SplatFormat),
    /// Cameras and poses.
    Cameras(CameraFormat),
    /// A page, a mesh, a shadow.
    Asset(Asset),
}

/// Formats beside those of Gaussians, with the ends of file names that choose them.
const OTHERS: [(&str, ExportFormat); 3] = [
    (".html", ExportFormat::Html),
    ("transforms.json", ExportFormat::Transforms),
    (".gltf", ExportFormat::GltfCameras),
];

/// Ends of names that mean an asset of another program which is not written, and what to write.
const NOT_WRITTEN: [(&str, &str, &str); 3] = [
    ("lod-meta.json", "a streamed SOG", "write a .sog bundle"),
    ("meta.json", "an unbundled SOG", "write a .sog bundle"),
    (".voxel.json", "a voxel octree", "write a mesh with --format mesh"),
];

/// Endings of files that hold models or pictures of other kinds.
const FOREIGN: [&str; 12] =
    ["fbx", "obj", "stl", "dae", "blend", "usd", "usdc", "usdz", "abc", "3ds", "ksplat", "x3d"];

impl ExportFormat {
    /// The format that `--format` or the end of the file name says.
    ///
    /// # Errors
    /// When neither says one, or the name promises another file than is written.
    pub fn choose(given: Option<Self>, output: &Path) -> Result<Self, StageError> {
        let name = output.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        if let Some(format) = given {
            return format.agrees_with(&name, output).map(|()| format);
        }
        if let Some((_, asset, remedy)) = NOT_WRITTEN.iter().find(|(end, ..)| name.ends_with(end)) {
            let text =
                format!("the name means {asset}, which is not written: {}", output.display());
            let help = format!("{remedy}, or --format statistics for statistics of the columns");
            return Err(StageError::usage(text).help(help));
        }
        if let Some((_, format)) = OTHERS.iter().find(|(suffix, _)| name.ends_with(suffix)) {
            return Ok(*format);
        }
        if let Some(format) = SplatFormat::of_name(output).and_then(Self::of_splat) {
            return Ok(format);
        }
        let text = format!("the suffix names no format: {}", output.display());
        Err(StageError::usage(text).help(format!("take one of {}, or --format", suffixes())))
    }

    /// Whether the end of a file name may stand for this format: its own, or none that is known.
    fn agrees_with(self, name: &str, output: &Path) -> Result<(), StageError> {
        let own = self.suffixes();
        let Some((_, ending)) = name.rsplit_once('.') else { return Ok(()) };
        let is_own = own.iter().any(|suffix| suffix.ends_with(&format!(".{ending}")));
        let of_codec =
            motes_codecs::CODECS.iter().any(|c| c.suffixes.contains(&&*format!(".{ending}")));
        if own.is_empty() || is_own || !(of_codec || FOREIGN.contains(&ending)) {
            return Ok(());
        }
        let named = self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
        let text = format!("--format {named} does not write .{ending}: {}", output.display());
        Err(StageError::usage(text).help(format!("end the name in {}", own.join(" or "))))
    }

    /// Ends of names of this format; none for a folder.
    fn suffixes(self) -> Vec<&'static str> {
        match self.product() {
            Product::Splat(format) => format.codec().suffixes.to_vec(),
            Product::Cameras(CameraFormat::Colmap(_)) => Vec::new(),
            Product::Cameras(CameraFormat::Transforms) => vec![".json"],
            Product::Cameras(CameraFormat::Gltf) => vec![".gltf"],
            Product::Asset(Asset::Html) => vec![".html", ".htm"],
            Product::Asset(Asset::Mesh | Asset::ShadowPlane) => vec![".glb"],
        }
    }

    fn of_splat(format: SplatFormat) -> Option<Self> {
        Self::value_variants().iter().copied().find(|own| own.product() == Product::Splat(format))
    }

    /// Who makes it.
    pub fn product(self) -> Product {
        let splat = match self {
            Self::Ply => SplatFormat::Ply,
            Self::CompressedPly => SplatFormat::CompressedPly,
            Self::Splat => SplatFormat::Splat,
            Self::Spz => SplatFormat::Spz,
            Self::Sog => SplatFormat::Sog,
            Self::Glb => SplatFormat::Glb,
            Self::Usda => SplatFormat::Usda,
            Self::Csv => SplatFormat::Csv,
            Self::Statistics => SplatFormat::Statistics,
            Self::Transforms => return Product::Cameras(CameraFormat::Transforms),
            Self::Colmap => return Product::Cameras(CameraFormat::Colmap(Layout::Binary)),
            Self::ColmapText => return Product::Cameras(CameraFormat::Colmap(Layout::Text)),
            Self::GltfCameras => return Product::Cameras(CameraFormat::Gltf),
            Self::Html => return Product::Asset(Asset::Html),
            Self::Mesh => return Product::Asset(Asset::Mesh),
            Self::ShadowPlane => return Product::Asset(Asset::ShadowPlane),
        };
        Product::Splat(splat)
    }
}

/// Suffixes that choose a format.
fn suffixes() -> String {
    let written = motes_codecs::CODECS.iter().filter(|codec| codec.is_writable());
    written
        .flat_map(|codec| codec.suffixes)
        .copied()
        .chain(OTHERS.map(|(suffix, _)| suffix))
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use motes_codecs::CODECS;

    use super::*;

    #[test]
    fn flags_and_suffixes_reach_every_codec() {
        for codec in CODECS.iter().filter(|codec| codec.is_writable()) {
            let format = <ExportFormat as ValueEnum>::from_str(codec.name, false);
            assert_eq!(format.map(ExportFormat::product), Ok(Product::Splat(codec.format)));
            for suffix in codec.suffixes {
                let path = format!("folder/name{suffix}");
                let chosen = ExportFormat::choose(None, Path::new(&path));
                assert_eq!(chosen.map(ExportFormat::product), Ok(Product::Splat(codec.format)));
            }
        }
        let cameras = ExportFormat::choose(None, Path::new("x/transforms.json"));
        assert_eq!(cameras, Ok(ExportFormat::Transforms));
        let page = ExportFormat::choose(None, Path::new("a.HTML")).map(ExportFormat::product);
        assert_eq!(page, Ok(Product::Asset(Asset::Html)));
        let error = ExportFormat::choose(None, Path::new("a.obj")).unwrap_err().to_string();
        assert!(error.contains("names no format") && error.contains(".splat"), "{error}");
    }

    #[test]
    fn names_of_assets_that_are_not_written_are_refused() {
        for name in ["meta.json", "lod-meta.json", "scene.voxel.json"] {
            let error = ExportFormat::choose(None, Path::new(name)).unwrap_err();
            assert!(error.to_string().contains("not written"), "{name}: {error}");
        }
        let statistics = ExportFormat::choose(None, Path::new("columns.json"));
        assert_eq!(statistics, Ok(ExportFormat::Statistics));
        let asked = Some(ExportFormat::Statistics);
        assert_eq!(
            ExportFormat::choose(asked, Path::new("meta.json")),
            Ok(ExportFormat::Statistics)
        );
    }

    #[test]
    fn a_format_does_not_go_under_the_suffix_of_another() {
        for (format, name, fits) in [
            (ExportFormat::Mesh, "mesh.fbx", false),
            (ExportFormat::Mesh, "mesh.glb", true),
            (ExportFormat::Ply, "a.spz", false),
            (ExportFormat::CompressedPly, "a.ply", true),
            (ExportFormat::Ply, "a.v2", true),
            (ExportFormat::Ply, "a", true),
            (ExportFormat::Colmap, "model.ply", true),
            (ExportFormat::Html, "a.htm", true),
        ] {
            let chosen = ExportFormat::choose(Some(format), Path::new(name));
            assert_eq!(chosen.is_ok(), fits, "{format:?} {name}");
        }
    }
}
