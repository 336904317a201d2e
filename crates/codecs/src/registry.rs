//! What a codec is, and the list of them.

use std::io::Write;
use std::path::Path;

use motes_formats::error::Result;
use motes_formats::ply::GaussianFile;
use motes_scene::Gaussians;

use super::CODECS;
use super::options::SplatWriteOptions;

/// A format that holds Gaussians, or is made of them.
#[derive(Debug)]
pub struct Codec {
    /// Its name in flags and reports.
    pub name: &'static str,
    /// A line for the help.
    pub about: &'static str,
    /// Endings of file names, in lower case with their dot.
    pub suffixes: &'static [&'static str],
    /// Highest SH degree that it can hold.
    pub max_sh_degree: u8,
    /// Whether it keeps every value of the standard columns, to the rounding of f32.
    pub lossless: bool,
    /// Whether it keeps columns beyond the standard ones.
    pub keeps_extra_columns: bool,
    /// What a file of it lacks, for the manual.
    pub loses: &'static str,
    /// Versions that are read and that are written, for the manual, where there are several.
    pub versions: [&'static str; 2],
    /// Whether a file that starts with these bytes is of this format; never, where only the name tells.
    pub(crate) starts: fn(&[u8]) -> bool,
    pub(crate) read: Input,
    pub(crate) write: Option<Writer>,
}

/// How a format is read.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Input {
    /// Not at all.
    None,
    /// As PLY, whose header tells which layout it is.
    Ply,
    /// From all bytes.
    Bytes(Reader),
}

pub(crate) type Reader = fn(&[u8], &Path) -> Result<GaussianFile>;
pub(crate) type Writer = fn(&mut dyn Write, &Gaussians, &SplatWriteOptions, &Path) -> Result<()>;

impl Codec {
    /// What most formats have in common.
    pub(crate) const DEFAULT: Self = Self {
        name: "",
        about: "",
        suffixes: &[],
        max_sh_degree: 3,
        lossless: false,
        keeps_extra_columns: false,
        loses: "",
        versions: ["", ""],
        starts: |_| false,
        read: Input::None,
        write: None,
    };

    /// Whether files of this format can be read as Gaussians.
    pub fn is_readable(&self) -> bool {
        !matches!(self.read, Input::None)
    }

    /// Whether files of this format can be written.
    pub fn is_writable(&self) -> bool {
        self.write.is_some()
    }

    /// Its row of the table in `docs/formats/splats.md`.
    pub fn manual_row(&self) -> String {
        let suffixes: Vec<String> = self.suffixes.iter().map(|s| format!("`{s}`")).collect();
        let [read, written] = [self.is_readable(), self.is_writable()];
        let cell = |can: bool, versions: &'static str| match (can, versions) {
            (false, _) => "no",
            (true, "") => "yes",
            (true, versions) => versions,
        };
        format!(
            "| `{}` | {} | {} | {} | {} | {} |",
            self.name,
            suffixes.join(", "),
            cell(read, self.versions[0]),
            cell(written, self.versions[1]),
            self.max_sh_degree,
            self.loses
        )
    }
}

/// Declares [`SplatFormat`] and [`CODECS`].
macro_rules! codecs {
    ($($(#[$doc:meta])* $variant:ident = $module:ident::$codec:ident,)*) => {
        /// A format that holds Gaussians, or is made of them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum SplatFormat {
            $($(#[$doc])* $variant,)*
        }

        impl SplatFormat {
            /// Every format.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];
        }

        /// Every format, in the order of [`SplatFormat`].
        pub static CODECS: &[&Codec] = &[$(&$module::$codec,)*];
    };
}
pub(crate) use codecs;

impl super::SplatFormat {
    /// What it is called, who reads and who writes it.
    pub fn codec(self) -> &'static Codec {
        CODECS[self as usize]
    }

    /// The format whose suffix, the longest that fits, ends the file name.
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let fitting = Self::ALL.iter().flat_map(|format| {
            let fits = format.codec().suffixes.iter().filter(|suffix| name.ends_with(**suffix));
            fits.map(|suffix| (suffix.len(), *format))
        });
        fitting.max_by_key(|(length, _)| *length).map(|(_, format)| format)
    }
}
