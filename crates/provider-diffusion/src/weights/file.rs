//! Tensors of a safetensors file, read one at a time.

use std::cell::RefCell;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use half::{bf16, f16};
use safetensors::tensor::{Dtype, Metadata};

use super::{AGAIN, Shapes};
use crate::error::{DiffusionError, Result};

const MOST_HEADER_BYTES: u64 = 100 << 20;

/// A safetensors file whose header was read.
pub struct TensorFile {
    /// Where it lies.
    pub path: PathBuf,
    layout: Metadata,
    begin: u64,
    file: RefCell<File>,
}

impl TensorFile {
    /// Reads the header, and compares what it promises with the length of the file.
    ///
    /// # Errors
    /// There is no such file, or it is another kind of file, cut short, or empty.
    pub fn open(path: &Path) -> Result<Self> {
        let bad = |cause: &str, help: &str| DiffusionError::weights(cause, path, help);
        if path.is_dir() {
            return Err(bad("a folder where a file is due", "name the .safetensors file in it"));
        }
        let unreadable = |e: std::io::Error| bad(&format!("cannot be read ({e})"), AGAIN);
        let mut file = File::open(path).map_err(unreadable)?;
        let size = file.metadata().map_err(unreadable)?.len();
        let mut first = Vec::new();
        file.by_ref().take(8).read_to_end(&mut first).map_err(unreadable)?;
        let length = <[u8; 8]>::try_from(first.as_slice()).map_or(0, u64::from_le_bytes);
        if !(2..=MOST_HEADER_BYTES.min(size.saturating_sub(8))).contains(&length) {
            return Err(other_kind(&first, path));
        }
        let mut header = vec![0; length as usize];
        file.read_exact(&mut header).map_err(unreadable)?;
        let layout: Metadata = serde_json::from_slice(&header)
            .map_err(|e| bad(&format!("no safetensors file ({e})"), AGAIN))?;
        let due = 8 + length + layout.data_len() as u64;
        if due != size {
            let cause = format!("the file is cut short or has a tail: {size} bytes, {due} are due");
            return Err(bad(&cause, AGAIN));
        }
        if layout.offset_keys().is_empty() {
            return Err(bad("the file has no tensors", AGAIN));
        }
        Ok(Self { path: path.into(), layout, begin: 8 + length, file: RefCell::new(file) })
    }

    /// The shape of a tensor; empty where there is none.
    pub fn shape(&self, name: &str) -> &[usize] {
        self.layout.info(name).map_or(&[], |info| &info.shape)
    }

    /// Shapes by name.
    pub fn shapes(&self) -> Shapes {
        let keys = self.layout.offset_keys();
        keys.into_iter().map(|name| (name.clone(), self.shape(&name).to_vec())).collect()
    }

    /// The values of a tensor.
    ///
    /// # Errors
    /// There is none of this name, it holds no floating-point numbers, or one that is not finite.
    pub fn read(&self, name: &str) -> Result<Vec<f32>> {
        let bad = |cause: String| DiffusionError::weights(cause, &self.path, AGAIN);
        let info =
            self.layout.info(name).ok_or_else(|| bad(format!("there is no tensor {name}")))?;
        let (from, to) = info.data_offsets;
        let mut bytes = vec![0; to - from];
        let mut file = self.file.borrow_mut();
        file.seek(SeekFrom::Start(self.begin + from as u64))
            .and_then(|_| file.read_exact(&mut bytes))
            .map_err(|e| bad(format!("cannot be read ({e})")))?;
        let values = match info.dtype {
            Dtype::F32 => decoded(&bytes, f32::from_le_bytes),
            Dtype::F64 => decoded(&bytes, |b| f64::from_le_bytes(b) as f32),
            Dtype::F16 => decoded(&bytes, |b| f16::from_le_bytes(b).to_f32()),
            Dtype::BF16 => decoded(&bytes, |b| bf16::from_le_bytes(b).to_f32()),
            other => {
                let cause = format!("the tensor {name} has elements of type {other:?}");
                let help = "take weights of 16 or 32 bits (fp16, bf16, fp32), not quantized ones";
                return Err(DiffusionError::weights(cause, &self.path, help));
            }
        };
        if !values.iter().all(|v| v.is_finite()) {
            return Err(bad(format!("the tensor {name} has values that are not finite")));
        }
        Ok(values)
    }
}

/// What a file is that begins so, and is no safetensors file.
fn other_kind(first: &[u8], path: &Path) -> DiffusionError {
    if first.starts_with(b"PK\x03\x04") || first.starts_with(b"\x80\x02") {
        let help = "take the .safetensors file of the same weights, or convert it with safetensors.torch.save_file";
        return DiffusionError::weights("a pickled checkpoint, which could run code", path, help);
    }
    if first.starts_with(b"version ") {
        let cause = "a pointer of Git LFS, not the weights";
        return DiffusionError::weights(cause, path, "git lfs pull in its folder");
    }
    DiffusionError::weights("no safetensors file, or one that is cut short", path, AGAIN)
}

fn decoded<const N: usize>(bytes: &[u8], decode: impl Fn([u8; N]) -> f32) -> Vec<f32> {
    bytes.as_chunks::<N>().0.iter().map(|chunk| decode(*chunk)).collect()
}
