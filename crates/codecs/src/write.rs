//! One way out.

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use motes_scene::Gaussians;

use super::SplatFormat;
use super::options::SplatWriteOptions;
use motes_formats::atomic::write_checked;
use motes_formats::error::{FormatError, Result};
use motes_formats::finite;

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
