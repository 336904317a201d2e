//! Photos of phones in a container that is not read: refused, since a solver would leave them out in silence.

use std::collections::BTreeSet;
use std::path::Path;

use motes_scene::stem_of;

use crate::error::{IngestError, Result};
use crate::files::locate_image::is_image;

const SUFFIXES: [&str; 3] = ["heic", "heif", "avif"];

/// Refuses HEIC and AVIF files without a converted photo of the same name beside them. `names` are those of all files below
/// `photos`, `/` between parts.
pub(super) fn refuse(photos: &Path, names: &[String]) -> Result<()> {
    let suffix = |name: &str| name.rsplit_once('.').map_or("", |n| n.1).to_owned();
    let converted: BTreeSet<&str> =
        names.iter().filter(|name| is_image(name)).map(|name| stem_of(name)).collect();
    let mut left = names.iter().filter(|name| {
        SUFFIXES.contains(&suffix(name).to_lowercase().as_str())
            && !converted.contains(stem_of(name))
    });
    let Some(first) = left.next() else { return Ok(()) };
    let path = photos.join(first);
    let folder = path.parent().unwrap_or(photos).display().to_string().replace('\'', "'\\''");
    let each = suffix(first);
    Err(IngestError::bad_input(
        format!(
            "{} photos are HEIC or AVIF, which is not read: {}",
            left.count() + 1,
            path.display()
        ),
        format!(
            "convert them: cd '{folder}' && for f in *.{each}; do heif-convert -q 95 \"$f\" \"${{f%.*}}.jpg\"; done \
             (Debian: libheif-examples; on macOS: sips -s format jpeg *.{each} --out .)"
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photos_of_phones_are_not_left_out_in_silence() {
        let refusal = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
            refuse(Path::new("it's"), &names).err().map(|error| format!("{error:?}"))
        };
        assert_eq!(refusal(&["a.jpg", "b/c.png", "notes.txt"]), None);
        assert_eq!(refusal(&["a.jpg", "a.HEIC", "b/c.png", "b/c.avif"]), None, "converted");
        let said = refusal(&["a.jpg", "b/a.HEIC", "b/c.heif"]).unwrap_or_default();
        assert!(said.contains("2 photos are HEIC") && said.contains("it's/b/a.HEIC"), "{said}");
        assert!(said.contains(r"for f in *.HEIC; do heif-convert"), "{said}");
    }
}
