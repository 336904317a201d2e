//! Event files of TensorBoard: scalars against steps, appended while a fit runs.
//!
//! A record of a TFRecord file is the length of its bytes (u64), the masked CRC-32C of that length (u32), the bytes, and their
//! masked CRC-32C (u32), little-endian. The bytes are a protocol buffer `Event`: 1 `wall_time` (double), 2 `step` (int64),
//! 3 `file_version` (string, the first record alone), 5 `summary`, whose 1 `value` holds 1 `tag` and 2 `simple_value` (float).
//! Source: tensorflow/core/lib/io/record_writer.h, tensorflow/core/util/event.proto, framework/summary.proto.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::error::{FormatError, Result};

const FILE_VERSION: &str = "brain.Event:2";
/// CRC-32C, reflected.
const CASTAGNOLI: u32 = 0x82f6_3b78;
/// So that the CRC of bytes that hold a CRC is not a constant.
const MASK_DELTA: u32 = 0xa282_ead8;
/// Types of fields of a protocol buffer.
const VARINT: u64 = 0;
const FIXED64: u64 = 1;
const BYTES: u64 = 2;
const FIXED32: u64 = 5;

/// An event file that is being written. A reader that follows it sees whole records.
#[derive(Debug)]
pub struct EventFile {
    file: File,
    path: PathBuf,
}

impl EventFile {
    /// Starts a file of its own in a folder, which is made where it is missing; what is there already stays.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn create(folder: &Path) -> Result<Self> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |error| FormatError::io(&path, error)
        };
        std::fs::create_dir_all(folder).map_err(failed(folder))?;
        let seconds = now() as u64;
        for number in 0.. {
            let path = folder.join(format!("events.out.tfevents.{seconds}.motes.{number}"));
            match File::options().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    let mut events = Self { file, path };
                    events.append(&event(now(), 0, &version()))?;
                    return Ok(events);
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(failed(&path)(error)),
            }
        }
        Err(FormatError::invalid(folder, "", "the folder is full"))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends scalars of a step, each under its tag; those that are not finite are kept as they are.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn scalars(&mut self, step: u64, scalars: &[(&str, f64)]) -> Result<()> {
        let mut summary = Vec::new();
        for (tag, value) in scalars {
            let mut entry = Vec::new();
            bytes_field(&mut entry, 1, tag.as_bytes());
            varint(&mut entry, 2 << 3 | FIXED32);
            entry.extend((*value as f32).to_le_bytes());
            bytes_field(&mut summary, 1, &entry);
        }
        let mut field = Vec::new();
        bytes_field(&mut field, 5, &summary);
        self.append(&event(now(), step, &field))
    }

    /// In one call of the system: a run that is stopped leaves no half record.
    fn append(&mut self, event: &[u8]) -> Result<()> {
        let length = (event.len() as u64).to_le_bytes();
        let mut record = length.to_vec();
        record.extend(masked_crc(&length).to_le_bytes());
        record.extend(event);
        record.extend(masked_crc(event).to_le_bytes());
        self.file.write_all(&record).map_err(|error| FormatError::io(&self.path, error))
    }
}

/// Seconds since 1970.
fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64())
}

fn version() -> Vec<u8> {
    let mut field = Vec::new();
    bytes_field(&mut field, 3, FILE_VERSION.as_bytes());
    field
}

/// An event with one more field.
fn event(wall_time: f64, step: u64, field: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    varint(&mut bytes, 1 << 3 | FIXED64);
    bytes.extend(wall_time.to_le_bytes());
    varint(&mut bytes, 2 << 3 | VARINT);
    varint(&mut bytes, step);
    bytes.extend(field);
    bytes
}

fn bytes_field(to: &mut Vec<u8>, number: u64, bytes: &[u8]) {
    varint(to, number << 3 | BYTES);
    varint(to, bytes.len() as u64);
    to.extend(bytes);
}

/// Seven bits a byte, the lowest first; the highest bit says that more follow.
fn varint(to: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        to.push(value as u8 | 0x80);
        value >>= 7;
    }
    to.push(value as u8);
}

fn masked_crc(bytes: &[u8]) -> u32 {
    crc32c(bytes).rotate_right(15).wrapping_add(MASK_DELTA)
}

/// Bit by bit: records have some hundred bytes, and come a few a second.
fn crc32c(bytes: &[u8]) -> u32 {
    let bit = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ CASTAGNOLI } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| bit(crc)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // RFC 3720, B.4, and the check value of the catalogue of CRCs.
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
        assert_eq!(crc32c(&[0xff; 32]), 0x62a8_ab43);
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
    }

    #[test]
    fn bytes_are_those_that_tensorboard_writes() {
        // `Event(wall_time=1.5, step=300, summary=Summary(value=[Value(tag="a", simple_value=2)]))`.
        let mut value = Vec::new();
        bytes_field(&mut value, 1, &[0x0a, 1, b'a', 0x15, 0, 0, 0, 0x40]);
        let mut field = Vec::new();
        bytes_field(&mut field, 5, &value);
        let expected =
            b"\x09\0\0\0\0\0\0\xf8\x3f\x10\xac\x02\x2a\x0a\x0a\x08\x0a\x01a\x15\0\0\0\x40";
        assert_eq!(event(1.5, 300, &field), expected);
    }

    #[test]
    fn two_files_of_one_second_stand_side_by_side() {
        let folder = tempfile::tempdir().unwrap();
        let first = EventFile::create(folder.path()).unwrap();
        let second = EventFile::create(folder.path()).unwrap();
        assert_ne!(first.path(), second.path());
        // Length and its sum, then the double, the step 0, the version and the sum of all.
        assert_eq!(std::fs::read(first.path()).unwrap().len(), 12 + 9 + 2 + 15 + 4);
    }
}
