//! Materials of Wavefront OBJ files.

use std::path::Path;

use motes_formats::capture::checked_relative_path;
use motes_formats::error::{FormatError, Result, quoted};

use super::model::{GRAY, ROUGHNESS};
use super::texture::{Affine, ImageCache, Look, TextureUse, Wrap};
use super::words::{floats, key_of};

/// A material and its name.
pub(super) struct Named {
    pub(super) name: String,
    /// Linear, as Blender reads and writes it. White under a texture, which takes its place there.
    pub(super) base_color_linear: [f32; 3],
    pub(super) roughness: f32,
    pub(super) metallic: f32,
    pub(super) look: Look,
}

impl Named {
    pub(super) fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            base_color_linear: GRAY,
            roughness: ROUGHNESS,
            metallic: 0.0,
            look: Look { opaque: true, ..Look::default() },
        }
    }
}

/// Materials of a library, a file beside the mesh.
pub(super) fn read(
    text: &str,
    path: &Path,
    images: &mut ImageCache<'_>,
    to: &mut Vec<Named>,
) -> Result<()> {
    let first = to.len();
    for (number, line) in text.lines().enumerate() {
        let (key, rest) = key_of(line);
        let place = || format!("line {}", number + 1);
        if key == "newmtl" {
            to.push(Named::new(rest));
            continue;
        }
        let Some(material) = to.get_mut(first..).and_then(<[Named]>::last_mut) else { continue };
        let values = || floats(rest, path, number);
        let one = || values().map(|v| v.first().copied().unwrap_or(0.0).clamp(0.0, 1.0));
        let mut image = || texture(rest, path, &place(), images);
        match key {
            "Kd" if material.look.base_color.is_none() => {
                let v = values()?;
                let [r, g, b] = [0, 1, 2].map(|i| v.get(i).or(v.first()).copied());
                let (Some(r), Some(g), Some(b)) = (r, g, b) else {
                    return Err(FormatError::invalid(path, place(), "Kd has no numbers"));
                };
                material.base_color_linear = [r, g, b].map(|v| v.clamp(0.0, 1.0));
            }
            // Beckmann's slope of a Phong exponent; only where nothing says it better.
            "Ns" if material.look.roughness.is_none() => {
                let exponent = values()?.first().copied().unwrap_or(0.0).max(0.0);
                material.roughness = (2.0 / (exponent + 2.0)).powf(0.25).clamp(0.0, 1.0);
            }
            "Pr" => material.roughness = one()?,
            "Pm" => material.metallic = one()?,
            "d" => material.look.transparency = 1.0 - one()?,
            "Tr" => material.look.transparency = one()?,
            "map_Kd" => {
                material.base_color_linear = [1.0; 3];
                material.look.base_color = Some(image()?);
            }
            "map_Pr" => {
                material.roughness = 1.0;
                material.look.roughness = Some(image()?);
            }
            "map_Pm" => {
                material.metallic = 1.0;
                material.look.metallic = Some(image()?);
            }
            "map_d" => material.look.opaque = false,
            _ => {}
        }
        if material.look.transparency > 0.0 {
            material.look.opaque = false;
        }
    }
    Ok(())
}

/// `[-OPTION VALUES ...] FILE`; of the options `-s` and `-o` move the texture and `-clamp` ends it.
fn texture(
    rest: &str,
    path: &Path,
    place: &str,
    images: &mut ImageCache<'_>,
) -> Result<TextureUse> {
    let mut transform = Affine::IDENTITY;
    let mut wrap = Wrap::Repeat;
    let mut left = rest.trim();
    while let Some(option) = left.strip_prefix('-') {
        let (name, mut after) = key_of(option);
        let mut values: Vec<f32> = Vec::new();
        let most = if ["s", "o", "t"].contains(&name) { 3 } else { 2 };
        while values.len() < most {
            let (word, next) = key_of(after);
            let on = ["on", "off"].contains(&word);
            match word.parse::<f32>() {
                // The last word is the file, whatever it looks like.
                Ok(value) if !next.is_empty() => values.push(value),
                _ if on && !next.is_empty() => {
                    wrap = if name == "clamp" && word == "on" { Wrap::Clamp } else { wrap };
                }
                _ if ["imfchan", "type"].contains(&name) && values.is_empty() => {}
                _ => break,
            }
            after = next;
            if on || ["imfchan", "type", "bm", "boost", "texres"].contains(&name) {
                break;
            }
        }
        let value = |k: usize, default: f32| values.get(k).copied().unwrap_or(default);
        match name {
            "s" => {
                (transform.0[0][0], transform.0[1][1]) = (value(0, 1.0), value(1, 1.0));
                // Texture coordinates were turned upside down.
                transform.0[1][2] = 1.0 - value(1, 1.0);
            }
            "o" => (transform.0[0][2], transform.0[1][2]) = (value(0, 0.0), -value(1, 0.0)),
            _ => {}
        }
        if after == left {
            break;
        }
        left = after;
    }
    let name = left.trim().replace('\\', "/");
    let texture = images.get(&name, || {
        let relative = checked_relative_path(path, place, &name)?;
        let file = path.parent().unwrap_or(Path::new("")).join(relative);
        let bytes = std::fs::read(&file).map_err(|error| {
            let cause = format!("the texture {} cannot be read: {error}", quoted(&name));
            FormatError::invalid(path, place, cause)
                .with_remedy("copy it beside the material library, or take the line out")
        })?;
        Ok((bytes.into(), file))
    })?;
    Ok(TextureUse { texture, set: 0, transform, wrap: [wrap; 2] })
}
