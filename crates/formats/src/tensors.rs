//! Named arrays in a safetensors file: what checkpoints and network weights are kept in.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

use safetensors::tensor::{Dtype, Metadata};
use serde_json::{Map, Value, json};

use crate::atomic::write_atomic;
use crate::error::{FormatError, Result, quoted};

/// The safetensors document allows no longer header.
const MAX_HEADER_BYTES: u64 = 100_000_000;
/// Name under which the document keeps the metadata.
const METADATA: &str = "__metadata__";

/// A dense array, row-major: shape and values.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "one variant per element type")]
pub enum TensorData {
    U8(Vec<usize>, Vec<u8>),
    U32(Vec<usize>, Vec<u32>),
    U64(Vec<usize>, Vec<u64>),
    I64(Vec<usize>, Vec<i64>),
    F32(Vec<usize>, Vec<f32>),
    F64(Vec<usize>, Vec<f64>),
}

impl TensorData {
    /// The shape; its product is the number of values. Empty for a single value.
    pub fn shape(&self) -> &[usize] {
        match self {
            Self::U8(shape, _)
            | Self::U32(shape, _)
            | Self::U64(shape, _)
            | Self::I64(shape, _)
            | Self::F32(shape, _)
            | Self::F64(shape, _) => shape,
        }
    }

    /// The values as f32; `None` for another type.
    pub fn as_f32(&self) -> Option<&[f32]> {
        if let Self::F32(_, values) = self { Some(values) } else { None }
    }

    fn dtype(&self) -> (&'static str, usize) {
        match self {
            Self::U8(..) => ("U8", 1),
            Self::U32(..) => ("U32", 4),
            Self::U64(..) => ("U64", 8),
            Self::I64(..) => ("I64", 8),
            Self::F32(..) => ("F32", 4),
            Self::F64(..) => ("F64", 8),
        }
    }

    fn count(&self) -> usize {
        match self {
            Self::U8(_, v) => v.len(),
            Self::U32(_, v) => v.len(),
            Self::U64(_, v) => v.len(),
            Self::I64(_, v) => v.len(),
            Self::F32(_, v) => v.len(),
            Self::F64(_, v) => v.len(),
        }
    }

    fn write(&self, writer: &mut dyn Write) -> std::io::Result<()> {
        match self {
            Self::U8(_, v) => writer.write_all(v),
            Self::U32(_, v) => v.iter().try_for_each(|x| writer.write_all(&x.to_le_bytes())),
            Self::U64(_, v) => v.iter().try_for_each(|x| writer.write_all(&x.to_le_bytes())),
            Self::I64(_, v) => v.iter().try_for_each(|x| writer.write_all(&x.to_le_bytes())),
            Self::F32(_, v) => v.iter().try_for_each(|x| writer.write_all(&x.to_le_bytes())),
            Self::F64(_, v) => v.iter().try_for_each(|x| writer.write_all(&x.to_le_bytes())),
        }
    }
}

/// CRC-32 of tensors and texts, in the order of their names: what a disk or a copy changed does not pass for a fit.
pub fn checksum<'a>(
    tensors: impl IntoIterator<Item = (&'a str, &'a TensorData)>,
    metadata: impl IntoIterator<Item = (&'a str, &'a str)>,
) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    let mut sorted: Vec<(&str, &TensorData)> = tensors.into_iter().collect();
    sorted.sort_by_key(|(name, _)| *name);
    for (name, tensor) in sorted {
        crc.update(name.as_bytes());
        crc.update(format!("{:?}", (tensor.dtype().0, tensor.shape())).as_bytes());
        let mut buffered = BufWriter::with_capacity(1 << 16, CrcWriter(&mut crc));
        // Nothing here can fail: it is all in memory.
        let _ = tensor.write(&mut buffered);
        let _ = buffered.flush();
    }
    let mut texts: Vec<(&str, &str)> = metadata.into_iter().collect();
    texts.sort_unstable();
    for (key, value) in texts {
        crc.update(key.as_bytes());
        crc.update(value.as_bytes());
    }
    crc.finalize()
}

struct CrcWriter<'c>(&'c mut crc32fast::Hasher);

impl Write for CrcWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Tensors by name, and text by key.
pub type Tensors = (BTreeMap<String, TensorData>, BTreeMap<String, String>);

/// Writes tensors. The same input gives the same bytes: largest element type first (so that every
/// tensor is aligned), then by name.
///
/// # Errors
/// Writing fails.
///
/// # Panics
/// When a shape does not match its number of values, or a name is used twice or reserved.
pub fn write_tensors(
    path: &Path,
    tensors: &[(String, TensorData)],
    metadata: &BTreeMap<String, String>,
) -> Result<()> {
    let mut sorted: Vec<&(String, TensorData)> = tensors.iter().collect();
    sorted.sort_by_key(|(name, tensor)| (std::cmp::Reverse(tensor.dtype().1), name));
    let mut header = Map::new();
    if !metadata.is_empty() {
        header.insert(METADATA.into(), json!(metadata));
    }
    let mut end = 0;
    for (name, tensor) in &sorted {
        let (dtype, size) = tensor.dtype();
        assert_eq!(tensor.shape().iter().product::<usize>(), tensor.count(), "shape of {name}");
        let start = end;
        end += tensor.count() * size;
        let info = json!({"dtype": dtype, "shape": tensor.shape(), "data_offsets": [start, end]});
        let twice = header.insert(name.clone(), info);
        assert!(twice.is_none() && name != METADATA, "tensor name {name} is taken");
    }
    let mut header = Value::Object(header).to_string();
    // Spaces up to a multiple of 8 keep the data aligned in a memory map.
    while !header.len().is_multiple_of(8) {
        header.push(' ');
    }
    write_atomic(path, |writer| {
        writer.write_all(&(header.len() as u64).to_le_bytes())?;
        writer.write_all(header.as_bytes())?;
        sorted.iter().try_for_each(|(_, tensor)| tensor.write(writer))
    })
}

/// Reads all tensors and the metadata.
///
/// # Errors
/// The file cannot be read, is not a safetensors file, is not as long as its header says, or holds
/// an element type other than those of [`TensorData`].
pub fn read_tensors(path: &Path) -> Result<Tensors> {
    let io = |error| FormatError::io(path, error);
    let file = File::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    read_tensors_from(BufReader::with_capacity(1 << 18, file), size, path)
}

/// Reads tensors from a stream of `size` bytes; `name` stands for the file in errors.
///
/// # Errors
/// As [`read_tensors`].
pub fn read_tensors_from(mut reader: impl Read, size: u64, name: &Path) -> Result<Tensors> {
    let path = name;
    let io = |error| FormatError::io(path, error);
    let invalid = |place: &str, cause: String| FormatError::invalid(path, place, cause);
    let mut length = [0; 8];
    reader.read_exact(&mut length).map_err(io)?;
    let header_bytes = u64::from_le_bytes(length);
    if header_bytes > MAX_HEADER_BYTES.min(size.saturating_sub(8)) {
        let cause =
            format!("not a safetensors file: a header of {header_bytes} bytes does not fit");
        return Err(invalid("byte 0", cause));
    }
    let mut header = vec![0; header_bytes as usize];
    reader.read_exact(&mut header).map_err(io)?;
    let layout: Metadata = serde_json::from_slice(&header)
        .map_err(|error| invalid("safetensors header", error.to_string()))?;
    let expected = 8 + header_bytes + layout.data_len() as u64;
    if expected != size {
        let cause = format!("the header describes {expected} bytes, but the file has {size}");
        return Err(invalid("safetensors header", cause));
    }
    let mut tensors = BTreeMap::new();
    for name in layout.offset_keys() {
        let Some(info) = layout.info(&name) else { continue };
        // Bounded: offsets are contiguous and end at the size of the file.
        let mut bytes = vec![0; info.data_offsets.1 - info.data_offsets.0];
        reader.read_exact(&mut bytes).map_err(io)?;
        let shape = info.shape.clone();
        let tensor = match info.dtype {
            Dtype::U8 => TensorData::U8(shape, bytes),
            Dtype::U32 => TensorData::U32(shape, values(&bytes, u32::from_le_bytes)),
            Dtype::U64 => TensorData::U64(shape, values(&bytes, u64::from_le_bytes)),
            Dtype::I64 => TensorData::I64(shape, values(&bytes, i64::from_le_bytes)),
            Dtype::F32 => TensorData::F32(shape, values(&bytes, f32::from_le_bytes)),
            Dtype::F64 => TensorData::F64(shape, values(&bytes, f64::from_le_bytes)),
            other => {
                let cause = format!("elements of type {other:?}");
                let place = format!("tensor {}", quoted(&name));
                return Err(FormatError::not_supported(path, place, cause));
            }
        };
        tensors.insert(name, tensor);
    }
    let metadata = layout.metadata().iter().flatten();
    Ok((tensors, metadata.map(|(k, v)| (k.clone(), v.clone())).collect()))
}

fn values<const N: usize, T>(bytes: &[u8], decode: fn([u8; N]) -> T) -> Vec<T> {
    let (chunks, _) = bytes.as_chunks::<N>();
    chunks.iter().map(|chunk| decode(*chunk)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<(String, TensorData)> {
        vec![
            ("bytes".into(), TensorData::U8(vec![3], vec![1, 2, 255])),
            ("means".into(), TensorData::F32(vec![2, 2], vec![0.1, f32::NAN, -0.0, 4.0])),
            ("step".into(), TensorData::U64(vec![], vec![u64::MAX])),
            ("a".into(), TensorData::I64(vec![1], vec![-7])),
            ("empty".into(), TensorData::F64(vec![0, 5], vec![])),
            ("ids".into(), TensorData::U32(vec![2], vec![7, u32::MAX])),
        ]
    }

    #[test]
    fn tensors_survive_and_the_bytes_do_not_depend_on_the_order() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.safetensors"), dir.path().join("b.safetensors"));
        let metadata: BTreeMap<_, _> =
            (0..20).map(|i| (format!("key {i}"), format!("{{\"value\": {i}}}"))).collect();
        let mut tensors = sample();
        write_tensors(&a, &tensors, &metadata).unwrap();
        tensors.reverse();
        write_tensors(&b, &tensors, &metadata).unwrap();
        assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
        let (read, read_metadata) = read_tensors(&a).unwrap();
        assert_eq!(read_metadata, metadata);
        assert_eq!(read.len(), tensors.len());
        for (name, tensor) in &tensors {
            // NaN equals nothing, its text does.
            assert_eq!(format!("{:?}", read[name]), format!("{tensor:?}"));
        }
        // Another reader of the same format agrees.
        let bytes = std::fs::read(&a).unwrap();
        let peer = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        assert_eq!(peer.tensor("means").unwrap().shape(), [2, 2]);
        assert_eq!(peer.tensor("ids").unwrap().data()[..4], 7u32.to_le_bytes());
    }

    #[test]
    fn a_checksum_hears_of_every_change_and_of_no_order() {
        let metadata = |value| [("step", value), ("a", "b")];
        let sum = |tensors: &[(String, TensorData)], value| {
            checksum(tensors.iter().map(|(name, t)| (name.as_str(), t)), metadata(value))
        };
        let mut tensors = sample();
        let first = sum(&tensors, "1");
        tensors.reverse();
        assert_eq!(sum(&tensors, "1"), first);
        assert_ne!(sum(&tensors, "2"), first);
        let TensorData::U32(_, ids) = &mut tensors[0].1 else { panic!() };
        ids[0] += 1;
        assert_ne!(sum(&tensors, "1"), first);
    }

    #[test]
    fn files_of_other_writers_are_read() {
        let data = [1.5f32, 2.5].map(f32::to_le_bytes).concat();
        let view = safetensors::tensor::TensorView::new(Dtype::F32, vec![2], &data).unwrap();
        let bytes = safetensors::serialize([("w", view)], None).unwrap();
        let (read, _) = read_tensors_from(&bytes[..], bytes.len() as u64, Path::new("w")).unwrap();
        assert_eq!(read["w"].as_f32(), Some(&[1.5, 2.5][..]));
        let short = bytes.len() as u64 - 1;
        assert!(read_tensors_from(&bytes[..short as usize], short, Path::new("w")).is_err());
    }
}
