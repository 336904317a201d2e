//! The text header of a PLY file.

use std::io::BufRead;
use std::path::Path;

use super::scalar::{Encoding, Scalar};
use crate::error::{FormatError, Result, quoted};

/// A real header has some kilobytes; these bounds only stop hostile ones.
const MAX_LINE_BYTES: usize = 1 << 14;
const MAX_LINES: usize = 1 << 14;
const MAX_PROPERTIES: usize = 1 << 12;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PropertyKind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// A column of an element.
#[derive(Clone, Debug)]
pub struct Property {
    /// Name of the column.
    pub name: String,
    pub(crate) kind: PropertyKind,
    /// Header line, from 1.
    pub line: usize,
}

/// A table of the file: its rows follow the header, element after element.
#[derive(Clone, Debug)]
pub struct Element {
    /// Name of the table: `vertex`, `face`, ...
    pub name: String,
    /// Rows that the header claims.
    pub count: u64,
    /// Columns in the order of the file.
    pub properties: Vec<Property>,
    /// Header line, from 1.
    pub line: usize,
}

impl Element {
    /// Bytes of a row when every row has the same: no list property.
    pub(crate) fn fixed_row_bytes(&self) -> Option<usize> {
        self.properties
            .iter()
            .map(|p| match p.kind {
                PropertyKind::Scalar(scalar) => Some(scalar.size()),
                PropertyKind::List { .. } => None,
            })
            .sum()
    }

    /// The fewest bytes that a row can take.
    pub(crate) fn least_row_bytes(&self, encoding: Encoding) -> u64 {
        let least = |p: &Property| match (encoding, p.kind) {
            (Encoding::Ascii, _) => 2, // a digit and what separates it
            (_, PropertyKind::Scalar(scalar)) => scalar.size() as u64,
            (_, PropertyKind::List { count, .. }) => count.size() as u64,
        };
        self.properties.iter().map(least).sum()
    }

    /// The column of this name.
    pub fn property(&self, name: &str) -> Option<&Property> {
        self.properties.iter().find(|p| p.name == name)
    }
}

/// What stands before the rows.
#[derive(Clone, Debug)]
pub struct Header {
    pub(crate) encoding: Encoding,
    /// Tables in the order of the file.
    pub elements: Vec<Element>,
    /// Comments in order, without the word `comment`.
    pub comments: Vec<String>,
    /// Bytes up to and with the line `end_header`.
    pub(crate) bytes: u64,
    /// Lines up to and with `end_header`.
    pub(crate) lines: usize,
}

/// Reads lines, counting them.
struct Lines<'a> {
    reader: &'a mut dyn BufRead,
    path: &'a Path,
    line: usize,
    bytes: u64,
}

impl Lines<'_> {
    /// The next line without its end.
    fn next(&mut self) -> Result<Vec<u8>> {
        self.line += 1;
        let mut text = Vec::new();
        let mut limited = std::io::Read::take(&mut *self.reader, MAX_LINE_BYTES as u64);
        let read = limited
            .read_until(b'\n', &mut text)
            .map_err(|error| FormatError::io(self.path, error))?;
        self.bytes += read as u64;
        if text.last() != Some(&b'\n') {
            return Err(if read == MAX_LINE_BYTES {
                self.error(format!("the line has more than {MAX_LINE_BYTES} bytes"))
            } else {
                self.error("the file ends inside its header")
            });
        }
        text.pop();
        // Headers edited on Windows end their lines with CR LF.
        if text.last() == Some(&b'\r') {
            text.pop();
        }
        Ok(text)
    }

    fn error(&self, cause: impl Into<String>) -> FormatError {
        FormatError::invalid(self.path, format!("ply header line {}", self.line), cause)
    }
}

/// Parses the header and leaves `reader` at the first byte of the body. A byte order mark before
/// `ply` and CR LF line ends are accepted.
pub(crate) fn parse(reader: &mut dyn BufRead, path: &Path) -> Result<Header> {
    let mut lines = Lines { reader, path, line: 0, bytes: 0 };
    check_magic(&mut lines)?;
    let mut encoding = None;
    let mut header = Header {
        encoding: Encoding::Ascii,
        elements: Vec::new(),
        comments: Vec::new(),
        bytes: 0,
        lines: 0,
    };
    let mut properties = 0;
    loop {
        if lines.line >= MAX_LINES {
            return Err(lines.error(format!("the header has more than {MAX_LINES} lines")));
        }
        let text = lines.next()?;
        let mut words = text.split(|b| b" \t".contains(b)).filter(|word| !word.is_empty());
        match words.next() {
            None => {}
            Some(b"end_header") => break,
            Some(b"comment") => {
                let text = String::from_utf8_lossy(&text);
                let text = text.trim();
                let text = text.strip_prefix("comment").unwrap_or(text);
                header.comments.push(text.trim().to_owned());
            }
            Some(b"obj_info") => {}
            Some(b"format") => {
                if encoding.is_some() {
                    return Err(lines.error("a second format line"));
                }
                encoding = Some(parse_format(&lines, &mut words)?);
            }
            Some(b"element") => {
                let element = parse_element(&lines, &mut words)?;
                if header.elements.iter().any(|e| e.name == element.name) {
                    let cause = format!("a second element {}", quoted(&element.name));
                    return Err(lines.error(cause));
                }
                header.elements.push(element);
            }
            Some(b"property") => {
                properties += 1;
                if properties > MAX_PROPERTIES {
                    return Err(lines.error(format!("more than {MAX_PROPERTIES} properties")));
                }
                let property = parse_property(&lines, &mut words)?;
                let Some(element) = header.elements.last_mut() else {
                    return Err(lines.error("a property before the first element"));
                };
                if let Some(first) = element.property(&property.name) {
                    let (name, line) = (quoted(&property.name), first.line);
                    let cause = format!("property {name} was already declared on line {line}");
                    return Err(lines.error(cause));
                }
                element.properties.push(property);
            }
            Some(word) => {
                return Err(lines.error(format!("{} is not a PLY keyword", quoted(word))));
            }
        }
    }
    header.encoding = encoding
        .ok_or_else(|| FormatError::invalid(path, "ply header", "there is no format line"))?;
    (header.bytes, header.lines) = (lines.bytes, lines.line);
    Ok(header)
}

fn check_magic(lines: &mut Lines<'_>) -> Result<()> {
    let not_ply = |path: &Path, start: &[u8]| {
        let cause = if start.is_empty() {
            "the file is empty".to_owned()
        } else {
            // A plan of somebody else may name any file: what is in it stays there.
            "not a PLY file: it starts with other bytes than \"ply\"".to_owned()
        };
        FormatError::invalid(path, "byte 0", cause)
    };
    // Looked at before the first line is read: another kind of file may have no line end.
    let start = lines.reader.fill_buf().map_err(|error| FormatError::io(lines.path, error))?;
    let word = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    if !word.starts_with(b"ply") {
        return Err(not_ply(lines.path, start));
    }
    let text = lines.next()?;
    let word = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    if word.trim_ascii_end() == b"ply" { Ok(()) } else { Err(not_ply(lines.path, &text)) }
}

type Words<'w> = dyn Iterator<Item = &'w [u8]> + 'w;

fn parse_format(lines: &Lines<'_>, words: &mut Words<'_>) -> Result<Encoding> {
    let kind = words.next().unwrap_or_default();
    let encoding = match kind {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::LittleEndian,
        b"binary_big_endian" => Encoding::BigEndian,
        _ => {
            let cause = format!("the format is {}", quoted(kind));
            let known = "PLY has ascii, binary_little_endian and binary_big_endian";
            return Err(lines.error(cause).with_remedy(known));
        }
    };
    match words.next() {
        Some(b"1.0") => Ok(encoding),
        other => {
            let cause = format!("PLY version {} instead of 1.0", quoted(other.unwrap_or_default()));
            Err(lines.error(cause))
        }
    }
}

fn parse_element(lines: &Lines<'_>, words: &mut Words<'_>) -> Result<Element> {
    let (Some(name), Some(count)) = (words.next(), words.next()) else {
        return Err(lines.error("an element line is `element NAME COUNT`"));
    };
    let number = std::str::from_utf8(count).ok().and_then(|text| text.parse::<u64>().ok());
    let count =
        number.ok_or_else(|| lines.error(format!("the number of rows is {}", quoted(count))))?;
    let name = name_of(lines, name)?;
    Ok(Element { name, count, properties: Vec::new(), line: lines.line })
}

fn parse_property(lines: &Lines<'_>, words: &mut Words<'_>) -> Result<Property> {
    let scalar = |word: Option<&[u8]>| {
        let word = word.unwrap_or_default();
        Scalar::from_name(word)
            .ok_or_else(|| lines.error(format!("{} is not a PLY type", quoted(word))))
    };
    let first = words.next();
    let kind = if first == Some(b"list".as_slice()) {
        let (count, item) = (scalar(words.next())?, scalar(words.next())?);
        if !count.is_integer() {
            return Err(lines.error("the length of a list must be of an integer type"));
        }
        PropertyKind::List { count, item }
    } else {
        PropertyKind::Scalar(scalar(first)?)
    };
    let name = words.next().ok_or_else(|| lines.error("the property has no name"))?;
    Ok(Property { name: name_of(lines, name)?, kind, line: lines.line })
}

fn name_of(lines: &Lines<'_>, name: &[u8]) -> Result<String> {
    match std::str::from_utf8(name) {
        Ok(text) if !text.chars().any(char::is_control) => Ok(text.to_owned()),
        _ => Err(lines.error(format!("{} is not a name", quoted(name)))),
    }
}

#[cfg(test)]
mod tests;
