//! Which files the weights are.

use std::fs;
use std::path::{Path, PathBuf};

use motes_formats::selection::{sha256_of_bytes, sha256_of_file};

use crate::SamError;

/// Weights larger than this are none of SAM: ViT-H has 2.6 GB.
const MOST_BYTES: u64 = 8 << 30;

/// The files of a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Weights {
    /// The encoder.
    pub encoder: PathBuf,
    /// The decoder.
    pub decoder: PathBuf,
}

impl Weights {
    /// The encoder and decoder at `model`: a folder with one of each, or one of both beside the other. `decoder` names the decoder
    /// where names do not tell.
    ///
    /// # Errors
    /// There is none, there are several, or the file is none.
    pub fn find(model: &Path, decoder: Option<&Path>) -> Result<Self, SamError> {
        let problem =
            |cause: &str, path: &Path| SamError::NoPair { cause: cause.into(), path: path.into() };
        if let Some(decoder) = decoder {
            let of = |path: &Path| match path.is_file() {
                true => Ok(path.to_owned()),
                false => Err(problem("this is not a file", path)),
            };
            return Ok(Self { encoder: of(model)?, decoder: of(decoder)? });
        }
        if model.is_dir() {
            let files = onnx_files(model);
            let (decoders, encoders): (Vec<_>, Vec<_>) = files
                .into_iter()
                .filter(|f| is_encoder(f) || is_decoder(f))
                .partition(|f| is_decoder(f));
            let encoder = only(encoders, "vision_encoder.onnx", "encoder", model)?;
            let decoder = only(decoders, "prompt_encoder_mask_decoder.onnx", "decoder", model)?;
            return Ok(Self { encoder, decoder });
        }
        if !model.is_file() {
            return Err(problem("there is no such file or folder", model));
        }
        let folder = model.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let wants_encoder = is_decoder(model);
        let is_other = |f: &PathBuf| if wants_encoder { is_encoder(f) } else { is_decoder(f) };
        let others: Vec<PathBuf> = onnx_files(folder).into_iter().filter(is_other).collect();
        let what = if wants_encoder { "encoder" } else { "decoder" };
        let other = nearest(model, others).ok_or_else(|| {
            problem(&format!("there is no {what} beside this file, or several"), model)
        })?;
        let (encoder, decoder) = match wants_encoder {
            true => (other, model.to_owned()),
            false => (model.to_owned(), other),
        };
        Ok(Self { encoder, decoder })
    }

    /// SHA-256 of a file of weights and of the data that lie beside it.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn sha256(path: &Path) -> Result<String, SamError> {
        let own = sha256_of_file(path)?;
        let data = external(path);
        if !data.is_file() {
            return Ok(own);
        }
        Ok(sha256_of_bytes(format!("{own} {}", sha256_of_file(&data)?).as_bytes()))
    }

    /// Refuses what would not fit in memory.
    pub(crate) fn check_size(path: &Path) -> Result<(), SamError> {
        let bytes = |path: &Path| fs::metadata(path).map_or(0, |meta| meta.len());
        let total = bytes(path).saturating_add(bytes(&external(path)));
        if total <= MOST_BYTES {
            return Ok(());
        }
        let (path, help) = (path.to_owned(), "SAM has at most 3 GB");
        Err(SamError::Load { cause: format!("{total} bytes"), path, help })
    }
}

/// Where exporters put weights that do not fit into an ONNX file.
fn external(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".data");
    name.into()
}

fn onnx_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_onnx = |path: &PathBuf| path.extension().is_some_and(|end| end == "onnx");
    let mut files: Vec<PathBuf> = entries.filter(is_onnx).collect();
    files.sort();
    files
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// `prompt_encoder_mask_decoder.onnx` is a decoder.
fn is_decoder(path: &Path) -> bool {
    name(path).contains("decoder")
}

fn is_encoder(path: &Path) -> bool {
    !is_decoder(path) && name(path).contains("encoder")
}

/// The file that is meant among several precisions of it.
fn only(files: Vec<PathBuf>, usual: &str, what: &str, folder: &Path) -> Result<PathBuf, SamError> {
    let problem = |cause: String| SamError::NoPair { cause, path: folder.into() };
    if let Some(found) = files.iter().find(|file| name(file) == usual) {
        return Ok(found.clone());
    }
    match files.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(problem(format!("this folder has no .onnx file with \"{what}\" in its name"))),
        many => {
            let names: Vec<String> = many.iter().take(4).map(|file| name(file)).collect();
            Err(problem(format!("this folder has several {what}s: {}", names.join(", "))))
        }
    }
}

/// The one whose name begins most like that of `file`, when one does.
fn nearest(file: &Path, others: Vec<PathBuf>) -> Option<PathBuf> {
    let shared = |other: &Path| {
        name(other).bytes().zip(name(file).bytes()).take_while(|(a, b)| a == b).count()
    };
    let most = others.iter().map(|other| shared(other)).max()?;
    let mut best = others.into_iter().filter(|other| shared(other) == most);
    best.next().filter(|_| best.next().is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        names.iter().for_each(|name| fs::write(folder.path().join(name), name).unwrap());
        folder
    }

    #[test]
    fn a_pair_is_found_in_a_folder_and_beside_a_file() {
        let files =
            ["vision_encoder.onnx", "vision_encoder_int8.onnx", "prompt_encoder_mask_decoder.onnx"];
        let dir = folder(&files);
        let found = Weights::find(dir.path(), None).unwrap();
        assert_eq!(found.encoder, dir.path().join(files[0]));
        assert_eq!(found.decoder, dir.path().join(files[2]));
        let files = ["b.encoder.onnx", "b.decoder.onnx", "h.encoder.onnx", "h.decoder.onnx"];
        let dir = folder(&files);
        let found = Weights::find(&dir.path().join("h.encoder.onnx"), None).unwrap();
        assert_eq!(found.decoder, dir.path().join("h.decoder.onnx"));
        let found = Weights::find(&dir.path().join("b.decoder.onnx"), None).unwrap();
        assert_eq!(found.encoder, dir.path().join("b.encoder.onnx"));
        let error = Weights::find(dir.path(), None).unwrap_err().to_string();
        assert!(error.contains("several encoders: b.encoder.onnx, h.encoder.onnx"), "{error}");
    }

    #[test]
    fn what_is_no_pair_is_told() {
        let dir = folder(&["sam.onnx"]);
        for (path, says) in [
            (dir.path().to_owned(), "no .onnx file with \"encoder\""),
            (dir.path().join("sam.onnx"), "no decoder beside this file"),
            (dir.path().join("none.onnx"), "no such file or folder"),
        ] {
            let error = Weights::find(&path, None).unwrap_err().to_string();
            assert!(error.contains(says) && error.contains("--decoder"), "{error}");
        }
    }
}
