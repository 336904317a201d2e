//! A file in memory that is read from front to back.

use std::path::Path;

use motes_formats::error::{FormatError, Result};

/// Where the reader stands in the bytes of a file.
pub(crate) struct Bytes<'a> {
    data: &'a [u8],
    at: usize,
    path: &'a Path,
}

impl<'a> Bytes<'a> {
    pub(crate) fn new(data: &'a [u8], path: &'a Path) -> Self {
        Self { data, at: 0, path }
    }

    /// Bytes that are left.
    pub(crate) fn left(&self) -> usize {
        self.data.len() - self.at
    }

    pub(crate) fn place(&self) -> String {
        format!("byte {}", self.at)
    }

    /// The next `count` bytes; `what` names them in the error.
    pub(crate) fn take(&mut self, count: u64, what: &str) -> Result<&'a [u8]> {
        let left = self.left() as u64;
        if count > left {
            let cause = format!("{what} take {count} bytes, but only {left} are left");
            return Err(FormatError::invalid(self.path, self.place(), cause).with_remedy(
                "the file is incomplete, or a number in it was damaged: copy or export it again",
            ));
        }
        let taken = &self.data[self.at..self.at + count as usize];
        self.at += count as usize;
        Ok(taken)
    }

    pub(crate) fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64, what)?);
        Ok(array)
    }

    pub(crate) fn u32(&mut self, what: &str) -> Result<u32> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, what: &str) -> Result<u64> {
        self.array(what).map(u64::from_le_bytes)
    }
}

/// The f32 at a byte of a row that is known to be long enough.
pub(crate) fn f32_at(row: &[u8], at: usize) -> f32 {
    f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]])
}

/// The u16 at a byte of a row that is known to be long enough.
pub(crate) fn u16_at(row: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([row[at], row[at + 1]])
}

/// The u32 at a byte of a row that is known to be long enough.
pub(crate) fn u32_at(row: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]])
}
