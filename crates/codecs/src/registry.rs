//! The formats: what they are called, who reads and who writes them.

use std::io::Write;
use std::path::Path;

use motes_scene::Gaussians;

use super::write::SplatWriteOptions;
use super::{compressed_ply, dot_splat, gltf, ksplat, sog, spz, table, usda, write};
use motes_formats::error::Result;
use motes_formats::ply::GaussianFile;

/// A format that holds Gaussians, or is made of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SplatFormat {
    /// INRIA's PLY and its relatives.
    Ply,
    /// PlayCanvas's compressed PLY.
    CompressedPly,
    /// antimatter15's `.splat`.
    Splat,
    /// Niantic's `.spz`.
    Spz,
    /// PlayCanvas's SOG.
    Sog,
    /// mkkellogg's `.ksplat`.
    Ksplat,
    /// Binary glTF with `KHR_gaussian_splatting`.
    Glb,
    /// glTF with `KHR_gaussian_splatting`, its buffers inside or beside it.
    Gltf,
    /// OpenUSD text.
    Usda,
    /// Columns as text.
    Csv,
    /// Statistics of the columns.
    Statistics,
}

type Reader = fn(&[u8], &Path) -> Result<GaussianFile>;
type Writer = fn(&mut dyn Write, &Gaussians, &SplatWriteOptions, &Path) -> Result<()>;

/// One format of the table [`CODECS`].
pub struct Codec {
    /// The format.
    pub format: SplatFormat,
    /// Its name in flags and reports.
    pub name: &'static str,
    /// Endings of file names, in lower case with their dot.
    pub suffixes: &'static [&'static str],
    /// Highest SH degree that it can hold.
    pub max_sh_degree: u8,
    /// Whether it keeps every value of the standard columns, to the rounding of f32.
    pub lossless: bool,
    /// Whether it keeps columns beyond the standard ones.
    pub keeps_extra_columns: bool,
    pub(super) read: Option<Reader>,
    pub(super) write: Option<Writer>,
}

impl Codec {
    /// Whether files of this format can be read as Gaussians.
    pub fn is_readable(&self) -> bool {
        let is_ply = [SplatFormat::Ply, SplatFormat::CompressedPly].contains(&self.format);
        self.read.is_some() || is_ply
    }

    /// Whether files of this format can be written.
    pub fn is_writable(&self) -> bool {
        self.write.is_some()
    }
}

/// Every format.
pub static CODECS: &[Codec] = &[
    Codec {
        format: SplatFormat::Ply,
        name: "ply",
        suffixes: &[".ply"],
        max_sh_degree: 4,
        lossless: true,
        keeps_extra_columns: true,
        // Streams, see `ply::open_gaussians`.
        read: None,
        write: Some(write::write_ply),
    },
    Codec {
        format: SplatFormat::CompressedPly,
        name: "compressed-ply",
        suffixes: &[".compressed.ply"],
        max_sh_degree: 3,
        lossless: false,
        keeps_extra_columns: false,
        // Told from other PLY files by its header.
        read: None,
        write: Some(compressed_ply::write),
    },
    Codec {
        format: SplatFormat::Splat,
        name: "splat",
        suffixes: &[".splat"],
        max_sh_degree: 0,
        lossless: false,
        keeps_extra_columns: false,
        read: Some(dot_splat::read),
        write: Some(dot_splat::write),
    },
    Codec {
        format: SplatFormat::Spz,
        name: "spz",
        suffixes: &[".spz"],
        max_sh_degree: 4,
        lossless: false,
        keeps_extra_columns: false,
        read: Some(spz::read),
        write: Some(spz::write),
    },
    Codec {
        format: SplatFormat::Sog,
        name: "sog",
        suffixes: &[".sog"],
        max_sh_degree: 3,
        lossless: false,
        keeps_extra_columns: false,
        read: Some(sog::read),
        write: Some(sog::write),
    },
    Codec {
        format: SplatFormat::Ksplat,
        name: "ksplat",
        suffixes: &[".ksplat"],
        max_sh_degree: 3,
        lossless: false,
        keeps_extra_columns: false,
        read: Some(ksplat::read),
        write: None,
    },
    Codec {
        format: SplatFormat::Glb,
        name: "glb",
        suffixes: &[".glb"],
        max_sh_degree: 3,
        lossless: true,
        keeps_extra_columns: true,
        read: Some(gltf::read),
        write: Some(gltf::write),
    },
    Codec {
        format: SplatFormat::Gltf,
        name: "gltf",
        suffixes: &[".gltf"],
        max_sh_degree: 3,
        lossless: true,
        keeps_extra_columns: true,
        read: Some(gltf::read),
        write: None,
    },
    Codec {
        format: SplatFormat::Usda,
        name: "usda",
        suffixes: &[".usda"],
        max_sh_degree: 3,
        lossless: true,
        keeps_extra_columns: false,
        read: None,
        write: Some(usda::write),
    },
    Codec {
        format: SplatFormat::Csv,
        name: "csv",
        suffixes: &[".csv"],
        max_sh_degree: 4,
        lossless: true,
        keeps_extra_columns: true,
        read: None,
        write: Some(table::write_csv),
    },
    Codec {
        format: SplatFormat::Statistics,
        name: "statistics",
        suffixes: &[".json"],
        max_sh_degree: 4,
        lossless: false,
        keeps_extra_columns: true,
        read: None,
        write: Some(table::write_statistics),
    },
];

impl SplatFormat {
    /// Its row of the table.
    ///
    /// # Panics
    /// Never: every format has a row.
    pub fn codec(self) -> &'static Codec {
        let found = CODECS.iter().find(|codec| codec.format == self);
        found.unwrap_or_else(|| unreachable!("{self:?} has no row in CODECS"))
    }

    /// The format whose suffix, the longest that fits, ends the file name.
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let fitting = CODECS.iter().flat_map(|codec| {
            let fits = codec.suffixes.iter().filter(|suffix| name.ends_with(**suffix));
            fits.map(|suffix| (suffix.len(), codec.format))
        });
        fitting.max_by_key(|(length, _)| *length).map(|(_, format)| format)
    }
}
