//! The body of a PLY file as blocks of packed rows.
//!
//! Whatever the encoding, a row arrives as the bytes of its scalar properties one after another:
//! text is converted to little-endian bytes, list properties are left out.

use std::io::{BufRead, ErrorKind, Read};
use std::path::Path;

use super::header::{Element, Header, PropertyKind};
use super::scalar::{Encoding, Scalar};
use crate::error::{FormatError, Result, quoted};

/// Bytes of a block: two of them stay in a shared cache, and handing one to other threads costs little beside reading it.
const BLOCK_BYTES: usize = 1 << 22;
/// Bytes of an ascii row, list included.
const MAX_LINE_BYTES: u64 = 1 << 24;

/// Position of a scalar property in a packed row.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Bytes from the start of the row.
    pub offset: usize,
    /// Type of the number.
    pub scalar: Scalar,
}

/// Bytes of a packed row.
pub fn packed_row_bytes(element: &Element) -> usize {
    fields(element).map(|(_, field)| field.scalar.size()).sum()
}

/// The scalar properties of an element with their positions.
pub fn fields(element: &Element) -> impl Iterator<Item = (&str, Field)> {
    let mut offset = 0;
    element.properties.iter().filter_map(move |property| match property.kind {
        PropertyKind::List { .. } => None,
        PropertyKind::Scalar(scalar) => {
            let field = Field { offset, scalar };
            offset += scalar.size();
            Some((property.name.as_str(), field))
        }
    })
}

/// Reads the elements of a body in their order.
pub struct Body<'a> {
    reader: &'a mut dyn BufRead,
    path: &'a Path,
    encoding: Encoding,
    /// Offset in the file of the next byte.
    byte: u64,
    /// Lines before the next byte; only counted in ascii files.
    line: usize,
}

impl<'a> Body<'a> {
    /// `reader` stands behind the header. With `file_bytes`, the size of the whole file, a header
    /// that promises more rows than fit is refused before anything is allocated.
    pub fn new(
        reader: &'a mut dyn BufRead,
        path: &'a Path,
        header: &Header,
        file_bytes: Option<u64>,
    ) -> Result<Self> {
        // The last row of a text file may lack its line end.
        let spare = u128::from(header.encoding == Encoding::Ascii);
        let mut least = u128::from(header.bytes);
        for element in &header.elements {
            let row = u128::from(element.least_row_bytes(header.encoding));
            least += u128::from(element.count) * row;
            if file_bytes.is_some_and(|size| least > u128::from(size) + spare) {
                let (name, count) = (quoted(&element.name), element.count);
                let cause = format!(
                    "the header promises {count} rows of element {name}, at least {least} bytes in all, but the file has {}",
                    file_bytes.unwrap_or_default()
                );
                let place = format!("ply header line {}", element.line);
                return Err(FormatError::invalid(path, place, cause).with_remedy(
                    "the file is incomplete, or its header was damaged: copy or export it again",
                ));
            }
        }
        let (encoding, byte, line) = (header.encoding, header.bytes, header.lines);
        Ok(Self { reader, path, encoding, byte, line })
    }

    /// Offset in the file of the next byte.
    pub(super) fn position(&self) -> u64 {
        self.byte
    }

    /// Whether packed rows hold big-endian values.
    pub fn is_big_endian(&self) -> bool {
        self.encoding == Encoding::BigEndian
    }

    /// Hands all rows of the next element to `take_block`, some thousand at a time. While it works on a block, the next is read.
    pub fn read(
        &mut self,
        element: &Element,
        take_block: &mut (dyn FnMut(&[u8]) -> Result<()> + Send),
    ) -> Result<()> {
        if element.count == 0 {
            return Ok(());
        }
        let rows_per_block = (BLOCK_BYTES / packed_row_bytes(element).max(1)).max(1) as u64;
        let rows_from = |row: u64| rows_per_block.min(element.count - row);
        let (mut block, mut next) = (Vec::new(), Vec::new());
        let mut row = rows_from(0);
        self.read_block(element, 0, row, &mut block)?;
        while row < element.count {
            let mut taken = Ok(());
            let read = rayon::in_place_scope(|scope| {
                scope.spawn(|_| taken = take_block(&block));
                self.read_block(element, row, rows_from(row), &mut next)
            });
            // What is wrong further ahead in the file comes first.
            taken?;
            read?;
            std::mem::swap(&mut block, &mut next);
            row += rows_from(row);
        }
        take_block(&block)
    }

    /// Replaces `block` by the next `rows` rows.
    fn read_block(
        &mut self,
        element: &Element,
        row: u64,
        rows: u64,
        block: &mut Vec<u8>,
    ) -> Result<()> {
        if self.encoding != Encoding::Ascii && element.fixed_row_bytes().is_some() {
            // Filled whole: nothing is cleared that is written over.
            block.resize(rows as usize * packed_row_bytes(element), 0);
            return self.exact(block, element, row);
        }
        block.clear();
        for i in row..row + rows {
            match self.encoding {
                Encoding::Ascii => self.text_row(element, i, block)?,
                _ => self.binary_row(element, i, block)?,
            }
        }
        Ok(())
    }

    /// Passes over the next element.
    pub fn skip(&mut self, element: &Element) -> Result<()> {
        if element.properties.is_empty() {
            return Ok(());
        }
        match element.fixed_row_bytes() {
            Some(size) if self.encoding != Encoding::Ascii => {
                let bytes = u128::from(element.count) * size as u128;
                self.pass_over(bytes, element, 0)
            }
            _ => self.read(element, &mut |_| Ok(())),
        }
    }

    /// Fails unless nothing but white space follows: more data means that the header does not
    /// describe the body, and then the values read are wrong too.
    pub fn end(&mut self) -> Result<()> {
        loop {
            let rest = self.reader.fill_buf().map_err(|error| FormatError::io(self.path, error))?;
            if rest.is_empty() {
                return Ok(());
            }
            if let Some(at) = rest.iter().position(|b| !b.is_ascii_whitespace() && *b != 0) {
                let place = format!("byte {}", self.byte + at as u64);
                let cause = "there is data after the last row: header and body do not match";
                return Err(FormatError::invalid(self.path, place, cause).with_remedy(
                    "a binary file that was copied in text mode looks like this; copy it again",
                ));
            }
            let passed = rest.len();
            self.byte += passed as u64;
            self.reader.consume(passed);
        }
    }

    fn text_row(&mut self, element: &Element, row: u64, block: &mut Vec<u8>) -> Result<()> {
        let mut text = Vec::new();
        while text.trim_ascii().is_empty() {
            text.clear();
            let mut limited = (&mut *self.reader).take(MAX_LINE_BYTES);
            let read = limited
                .read_until(b'\n', &mut text)
                .map_err(|error| FormatError::io(self.path, error))?;
            if read == 0 {
                return Err(self.ends_early(element, row));
            }
            self.byte += read as u64;
            self.line += 1;
        }
        let fault = |cause: String| {
            Err(FormatError::invalid(self.path, format!("line {}", self.line), cause))
        };
        let Ok(text) = std::str::from_utf8(&text) else {
            return fault("binary data in a PLY file that says it is ascii".into());
        };
        let mut tokens = text.split_ascii_whitespace();
        let expected = element.properties.len();
        for property in &element.properties {
            let mut value = |scalar: Scalar, bytes: &mut Vec<u8>| {
                let Some(token) = tokens.next() else {
                    return Err(format!("the row ends before its {expected} properties do"));
                };
                let problem =
                    || format!("property {} is {}", quoted(&property.name), quoted(token));
                scalar.encode_text(token, bytes).ok_or_else(problem)
            };
            let outcome = match property.kind {
                PropertyKind::Scalar(scalar) => value(scalar, block),
                PropertyKind::List { count, item } => (|| {
                    let mut bytes = Vec::new();
                    value(count, &mut bytes)?;
                    let length = count.decode(&bytes, false);
                    let mut i = 0.0;
                    while i < length {
                        bytes.clear();
                        value(item, &mut bytes)?;
                        i += 1.0;
                    }
                    Ok(())
                })(),
            };
            if let Err(cause) = outcome {
                return fault(cause);
            }
        }
        if tokens.next().is_some() {
            return fault(format!("the row has more values than its {expected} properties take"));
        }
        Ok(())
    }

    fn binary_row(&mut self, element: &Element, row: u64, block: &mut Vec<u8>) -> Result<()> {
        for property in &element.properties {
            match property.kind {
                PropertyKind::Scalar(scalar) => self.append(scalar.size(), block, element, row)?,
                PropertyKind::List { count, item } => {
                    let mut bytes = [0; 8];
                    self.exact(&mut bytes[..count.size()], element, row)?;
                    let length = count.decode(&bytes, self.is_big_endian());
                    if length < 0.0 {
                        let place = format!("byte {}", self.byte - count.size() as u64);
                        let cause = format!("list {} has {length} items", quoted(&property.name));
                        return Err(FormatError::invalid(self.path, place, cause));
                    }
                    self.pass_over(length as u128 * item.size() as u128, element, row)?;
                }
            }
        }
        Ok(())
    }

    /// Fills `bytes` with what comes next.
    pub(super) fn exact(&mut self, bytes: &mut [u8], element: &Element, row: u64) -> Result<()> {
        let mut read = 0;
        while read < bytes.len() {
            match self.reader.read(&mut bytes[read..]) {
                Ok(0) => break,
                Ok(more) => read += more,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(FormatError::io(self.path, error)),
            }
        }
        self.byte += read as u64;
        if read < bytes.len() {
            let whole = read.checked_div(packed_row_bytes(element)).unwrap_or(0);
            return Err(self.ends_early(element, row + whole as u64));
        }
        Ok(())
    }

    /// Appends the next `count` bytes, a value or a few.
    fn append(
        &mut self,
        count: usize,
        block: &mut Vec<u8>,
        element: &Element,
        row: u64,
    ) -> Result<()> {
        let start = block.len();
        block.resize(start + count, 0);
        self.exact(&mut block[start..], element, row)
    }

    pub(super) fn pass_over(&mut self, bytes: u128, element: &Element, row: u64) -> Result<()> {
        let wanted = u64::try_from(bytes).unwrap_or(u64::MAX);
        let mut limited = (&mut *self.reader).take(wanted);
        let passed = std::io::copy(&mut limited, &mut std::io::sink())
            .map_err(|error| FormatError::io(self.path, error))?;
        self.byte += passed;
        if passed < wanted { Err(self.ends_early(element, row)) } else { Ok(()) }
    }

    fn ends_early(&self, element: &Element, row: u64) -> FormatError {
        let (name, count) = (quoted(&element.name), element.count);
        let cause = format!("the file ends in row {row} of the {count} rows of element {name}");
        FormatError::invalid(self.path, format!("byte {}", self.byte), cause)
            .with_remedy("the file is incomplete: copy or export it again")
    }
}
