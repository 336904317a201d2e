//! Embeddings of pictures, made once and kept on disk.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use motes_formats::selection::sha256_of_bytes;
use motes_formats::tensors::{TensorData, read_tensors, write_tensors};
use motes_scene::ImageU8;

use crate::model::Model;
use crate::{Frame, SamError};

/// Changes whenever an embedding becomes another one for the same picture and weights.
const VERSION: u32 = 1;
/// Kept embeddings take no more than this, bytes; those that were not used for the longest time go first.
const MOST_BYTES: u64 = 2 << 30;

pub(crate) type Embeddings = Vec<(String, TensorData)>;

impl Model {
    /// Runs the encoder.
    pub(crate) fn embed(&self, picture: &ImageU8, frame: &Frame) -> Result<Embeddings, SamError> {
        let resized = frame.resized(picture);
        let (shape, values) = match self.takes_colors {
            true => (vec![frame.filled.1, frame.filled.0, 3], resized),
            false => {
                let tensor = frame.tensor(self.convention, &resized);
                (vec![1, 3, self.side, self.side], tensor)
            }
        };
        let names = self.convention.embeddings();
        let input = self.encoder.input_names().into_iter().next().unwrap_or_default();
        let found = self.encoder.run(&[(&input, TensorData::F32(shape, values))], names)?;
        Ok(names.iter().map(|name| (*name).to_owned()).zip(found).collect())
    }
}

/// A folder of embeddings.
pub(crate) struct Kept {
    folder: PathBuf,
    encoder_sha256: String,
}

impl Kept {
    pub(crate) fn new(folder: &Path, encoder_sha256: &str) -> Self {
        Self { folder: folder.to_owned(), encoder_sha256: encoder_sha256.to_owned() }
    }

    fn path(&self, picture_sha256: &str) -> PathBuf {
        let key = format!("{VERSION} {} {picture_sha256}", self.encoder_sha256);
        self.folder.join(format!("{}.safetensors", &sha256_of_bytes(key.as_bytes())[..32]))
    }

    /// The embeddings of a picture; none when they are not there or not whole, so that they are made again.
    pub(crate) fn find(&self, picture_sha256: &str, names: &[&str]) -> Option<Embeddings> {
        let path = self.path(picture_sha256);
        let (mut tensors, _) = read_tensors(&path).ok()?;
        let mut take = |name: &&str| {
            let tensor = tensors.remove(*name)?;
            tensor.as_f32()?.iter().all(|v| v.is_finite()).then(|| ((*name).to_owned(), tensor))
        };
        let found: Option<Embeddings> = names.iter().map(&mut take).collect();
        let file = fs::File::options().append(true).open(&path);
        let _ = file.and_then(|file| file.set_modified(SystemTime::now()));
        found
    }

    /// Keeps embeddings. Where that fails nothing is kept: this run has them.
    pub(crate) fn keep(&self, picture_sha256: &str, embeddings: &Embeddings) {
        let path = self.path(picture_sha256);
        // A folder that cannot be written costs time, nothing else.
        let _ = write_tensors(&path, embeddings, &BTreeMap::new());
        prune(&self.folder, MOST_BYTES);
    }
}

/// Removes the files that were not used for the longest time until `most` bytes are left. What cannot be removed stays.
fn prune(folder: &Path, most: u64) {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_ours = entry.path().extension().is_some_and(|end| end == "safetensors");
        let Ok(meta) = entry.metadata() else { continue };
        if let (true, Ok(used)) = (is_ours && meta.is_file(), meta.modified()) {
            files.push((used, entry.path(), meta.len()));
        }
    }
    files.sort_by(|a, b| b.cmp(a));
    let mut sum = 0u64;
    for (_, path, bytes) in files {
        sum = sum.saturating_add(bytes);
        if sum > most {
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn embeddings_survive_and_are_those_of_one_picture_and_one_model() {
        let folder = tempfile::tempdir().unwrap();
        let kept = Kept::new(folder.path(), "weights");
        let tensor = TensorData::F32(vec![1, 2], vec![0.5, -1.0]);
        let embeddings = vec![("a".to_owned(), tensor)];
        kept.keep("picture", &embeddings);
        assert_eq!(kept.find("picture", &["a"]), Some(embeddings));
        assert_eq!(kept.find("picture", &["a", "b"]), None);
        assert_eq!(kept.find("other", &["a"]), None);
        assert_eq!(Kept::new(folder.path(), "other").find("picture", &["a"]), None);
        let file = fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
        fs::write(&file, "half").unwrap();
        assert_eq!(kept.find("picture", &["a"]), None);
        prune(folder.path(), 3);
        assert!(!file.exists());
    }
}
