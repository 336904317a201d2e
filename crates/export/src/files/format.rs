//! Which product a command line asks for: the formats of Gaussians that can be written, and the table [`OTHERS`].

use std::path::Path;
use std::sync::LazyLock;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use motes_codecs::SplatFormat;
use motes_formats::colmap::Layout;
use motes_stage::StageError;
use serde::{Serialize, Serializer};

use super::CameraFormat;
use super::assets::Asset;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Gaussians in a file of this format.
    Splat(SplatFormat),
    /// Cameras and poses.
    Cameras(CameraFormat),
    /// A page, a mesh, a shadow.
    Asset(Asset),
}

/// A format beside those of Gaussians.
struct Other {
    format: ExportFormat,
    name: &'static str,
    /// A line for the help.
    about: &'static str,
    /// Ends of its names, none for a folder; `--format` does not write under the suffix of another.
    suffixes: &'static [&'static str],
    /// The end of a name that chooses it without `--format`.
    chosen_by: Option<&'static str>,
}

const OTHERS: [Other; 7] = [
    Other {
        format: ExportFormat::Cameras(CameraFormat::Transforms),
        name: "transforms",
        about: "nerfstudio transforms.json of --capture or --path",
        suffixes: &[".json"],
        chosen_by: Some("transforms.json"),
    },
    Other {
        format: ExportFormat::Cameras(CameraFormat::Colmap(Layout::Binary)),
        name: "colmap",
        about: "Folder with a binary COLMAP model of --capture or --path",
        suffixes: &[],
        chosen_by: None,
    },
    Other {
        format: ExportFormat::Cameras(CameraFormat::Colmap(Layout::Text)),
        name: "colmap-text",
        about: "Folder with a COLMAP model as text",
        suffixes: &[],
        chosen_by: None,
    },
    Other {
        format: ExportFormat::Cameras(CameraFormat::Gltf),
        name: "gltf-cameras",
        about: "glTF cameras of --capture or --path",
        suffixes: &[".gltf"],
        chosen_by: Some(".gltf"),
    },
    Other {
        format: ExportFormat::Asset(Asset::Html),
        name: "html",
        about: "One HTML page with a viewer",
        suffixes: &[".html", ".htm"],
        chosen_by: Some(".html"),
    },
    Other {
        format: ExportFormat::Asset(Asset::Mesh),
        name: "mesh",
        about: "Relightable mesh (.glb) of a scene folder, with its environment map",
        suffixes: &[".glb"],
        chosen_by: None,
    },
    Other {
        format: ExportFormat::Asset(Asset::ShadowPlane),
        name: "shadow-plane",
        about: "Shadow of a scene folder's objects as a textured plane (.glb) and an image",
        suffixes: &[".glb"],
        chosen_by: None,
    },
];

/// All that `--format` takes, in the order of the help.
static ALL: LazyLock<Vec<ExportFormat>> = LazyLock::new(|| {
    let splats = SplatFormat::ALL.iter().filter(|format| format.codec().is_writable());
    let others = OTHERS.iter().map(|other| other.format);
    splats.map(|format| ExportFormat::Splat(*format)).chain(others).collect()
});

/// Ends of names that mean an asset of another program which is not written, and what to write.
const NOT_WRITTEN: [(&str, &str, &str); 3] = [
    ("lod-meta.json", "a streamed SOG", "write a .sog bundle"),
    ("meta.json", "an unbundled SOG", "write a .sog bundle"),
    (".voxel.json", "a voxel octree", "write a mesh with --format mesh"),
];

/// Endings of files that hold models or pictures of other kinds.
const FOREIGN: [&str; 12] =
    ["fbx", "obj", "stl", "dae", "blend", "usd", "usdc", "usdz", "abc", "3ds", "ksplat", "x3d"];

impl ValueEnum for ExportFormat {
    fn value_variants<'a>() -> &'a [Self] {
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()).help(self.about()))
    }
}

impl Serialize for ExportFormat {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

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
        let chosen = |other: &&Other| other.chosen_by.is_some_and(|end| name.ends_with(end));
        if let Some(other) = OTHERS.iter().find(chosen) {
            return Ok(other.format);
        }
        let splat = SplatFormat::of_name(output).filter(|format| format.codec().is_writable());
        if let Some(format) = splat {
            return Ok(Self::Splat(format));
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
        let text =
            format!("--format {} does not write .{ending}: {}", self.name(), output.display());
        Err(StageError::usage(text).help(format!("end the name in {}", own.join(" or "))))
    }

    /// Its name in flags and reports.
    pub fn name(self) -> &'static str {
        self.row().map_or_else(|splat| splat.codec().name, |other| other.name)
    }

    fn about(self) -> &'static str {
        self.row().map_or_else(|splat| splat.codec().about, |other| other.about)
    }

    /// Ends of names of this format; none for a folder.
    fn suffixes(self) -> &'static [&'static str] {
        self.row().map_or_else(|splat| splat.codec().suffixes, |other| other.suffixes)
    }

    /// Its row of [`OTHERS`], or the format of Gaussians.
    fn row(self) -> Result<&'static Other, SplatFormat> {
        match self {
            Self::Splat(splat) => Err(splat),
            _ => Ok(OTHERS.iter().find(|other| other.format == self).unwrap_or(&OTHERS[0])),
        }
    }
}

/// Suffixes that choose a format.
fn suffixes() -> String {
    let written = motes_codecs::CODECS.iter().filter(|codec| codec.is_writable());
    written
        .flat_map(|codec| codec.suffixes)
        .copied()
        .chain(OTHERS.iter().filter_map(|other| other.chosen_by))
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_and_suffixes_reach_every_codec() {
        for splat in SplatFormat::ALL.iter().filter(|format| format.codec().is_writable()) {
            let format = <ExportFormat as ValueEnum>::from_str(splat.codec().name, false);
            assert_eq!(format, Ok(ExportFormat::Splat(*splat)));
            for suffix in splat.codec().suffixes {
                let path = format!("folder/name{suffix}");
                let chosen = ExportFormat::choose(None, Path::new(&path));
                assert_eq!(chosen, Ok(ExportFormat::Splat(*splat)));
            }
        }
        for other in &OTHERS {
            assert_eq!(ExportFormat::from_str(other.name, false), Ok(other.format));
            assert_eq!(other.format.name(), other.name);
        }
        let cameras = ExportFormat::choose(None, Path::new("x/transforms.json"));
        assert_eq!(cameras, Ok(ExportFormat::Cameras(CameraFormat::Transforms)));
        let page = ExportFormat::choose(None, Path::new("a.HTML"));
        assert_eq!(page, Ok(ExportFormat::Asset(Asset::Html)));
        let error = ExportFormat::choose(None, Path::new("a.obj")).unwrap_err().to_string();
        assert!(error.contains("names no format") && error.contains(".splat"), "{error}");
    }

    #[test]
    fn names_of_assets_that_are_not_written_are_refused() {
        for name in ["meta.json", "lod-meta.json", "scene.voxel.json"] {
            let error = ExportFormat::choose(None, Path::new(name)).unwrap_err();
            assert!(error.to_string().contains("not written"), "{name}: {error}");
        }
        let statistics = ExportFormat::Splat(SplatFormat::Statistics);
        assert_eq!(ExportFormat::choose(None, Path::new("columns.json")), Ok(statistics));
        assert_eq!(ExportFormat::choose(Some(statistics), Path::new("meta.json")), Ok(statistics));
    }

    #[test]
    fn a_format_does_not_go_under_the_suffix_of_another() {
        for (format, name, fits) in [
            ("mesh", "mesh.fbx", false),
            ("mesh", "mesh.glb", true),
            ("ply", "a.spz", false),
            ("compressed-ply", "a.ply", true),
            ("ply", "a.v2", true),
            ("ply", "a", true),
            ("colmap", "model.ply", true),
            ("html", "a.htm", true),
        ] {
            let format = ExportFormat::from_str(format, false).unwrap();
            let chosen = ExportFormat::choose(Some(format), Path::new(name));
            assert_eq!(chosen.is_ok(), fits, "{format:?} {name}");
        }
    }
}
