//! What all JSON documents share: the two opening keys, the versioning rule, the layout of text,
//! the schemas.
//!
//! A document starts with `"format": "motes/NAME"` and `"version": "MAJOR.MINOR"`. An unknown
//! major version is an error. A newer minor version may have keys that this program does not
//! know: they are ignored and reported. Errors name the file, the place as a JSON pointer with line and
//! column, the cause and where the keys are described. Ranges are those of the schema ([`out_of_range`]).

pub mod pointer;
mod pretty;
mod ranges;

use std::io::Read;
use std::path::Path;

use schemars::{JsonSchema, schema_for};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::atomic::write_atomic;
use crate::error::{FormatError, Result, quoted};

pub use pretty::to_pretty_json;
pub use ranges::{OutOfRange, out_of_range};

use pointer::{offset, pointer_at, pointer_of};

/// Documents larger than this are refused before they are parsed: a capture of 100 000 views has
/// some 50 MB.
const MAX_BYTES: u64 = 1 << 30;

/// A kind of JSON document.
pub trait Document: Serialize + DeserializeOwned + JsonSchema {
    /// The value of `format`.
    const FORMAT: &'static str;
    /// Major version that this program reads and writes.
    const MAJOR: u32;
    /// Newest minor version that this program knows.
    const MINOR: u32;

    /// The value of `version` that is written.
    fn version() -> String {
        format!("{}.{}", Self::MAJOR, Self::MINOR)
    }
}

/// A document and what a reader should know about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Parsed<T> {
    /// The document.
    pub document: T,
    /// Sentences about keys that were ignored.
    pub warnings: Vec<String>,
}

/// Reads a document.
///
/// # Errors
/// The file cannot be read, is not JSON, is another document or of another major version, or
/// lacks a key or holds a value of another type or out of the range that the schema declares.
pub fn read_document<T: Document>(path: &Path) -> Result<Parsed<T>> {
    let io = |error| FormatError::io(path, error);
    if path.is_dir() {
        let cause = format!("this is a folder, not a {} document", T::FORMAT);
        return Err(FormatError::invalid(path, "", cause));
    }
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MAX_BYTES {
        let cause = format!("the document has more than {MAX_BYTES} bytes");
        return Err(FormatError::not_supported(path, "", cause));
    }
    parse_document(&bytes, path)
}

/// Parses a document that is in memory; `name` stands for the file in errors.
///
/// # Errors
/// As [`read_document`].
pub fn parse_document<T: Document>(bytes: &[u8], name: &Path) -> Result<Parsed<T>> {
    #[derive(Deserialize)]
    struct Opening {
        format: Option<Value>,
        version: Option<Value>,
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.trim_ascii().is_empty() {
        return Err(FormatError::invalid(name, "byte 0", "the file is empty"));
    }
    // The derived readers would take a list of values for an object.
    if bytes.trim_ascii_start().first() == Some(&b'[') {
        let cause = format!("this is not a JSON object, so not a {} document", T::FORMAT);
        return Err(FormatError::invalid(name, "byte 0", cause));
    }
    let opening: Opening =
        serde_json::from_slice(bytes).map_err(|error| syntax_error(bytes, name, &error))?;
    let minor = check_opening::<T>(opening.format.as_ref(), opening.version.as_ref(), name)?;
    let mut unknown = Vec::new();
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let mut track = serde_path_to_error::Track::new();
    let tracked = serde_path_to_error::Deserializer::new(&mut deserializer, &mut track);
    let read = serde_ignored::deserialize(tracked, |key| {
        if unknown.len() < 5 {
            unknown.push(quoted(key.to_string()));
        }
    });
    let document: T = match read {
        Ok(document) => document,
        Err(error) if error.is_data() => {
            let place = place_of(&pointer_of(&track.path()), &error);
            return Err(FormatError::invalid(name, place, brief(&error)).with_remedy(help::<T>()));
        }
        Err(error) => return Err(syntax_error(bytes, name, &error)),
    };
    deserializer.end().map_err(|error| syntax_error(bytes, name, &error))?;
    check_ranges(&document, name)?;
    let mut warnings = Vec::new();
    if !unknown.is_empty() {
        let why = if minor > T::MINOR { " of a newer version" } else { "" };
        warnings.push(format!(
            "unknown keys{why} in {} were ignored: {}",
            name.display(),
            unknown.join(", ")
        ));
    }
    Ok(Parsed { document, warnings })
}

/// The minor version, when the two opening keys are those of `T`; `name` stands for the file in errors.
///
/// # Errors
/// It is another document or another major version.
pub fn check_opening<T: Document>(
    format: Option<&Value>,
    version: Option<&Value>,
    name: &Path,
) -> Result<u32> {
    if format.and_then(Value::as_str) != Some(T::FORMAT) {
        let found = format.map_or("is missing".into(), |found| format!("is {}", short(found)));
        let cause = format!("the key \"format\" {found}, this is not a {} document", T::FORMAT);
        return Err(FormatError::invalid(name, "/format", cause));
    }
    check_version::<T>(version, name)
}

/// A value of a document as it may appear in a message.
fn short(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(MOST_QUOTED) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// The minor version, when the major one is ours.
fn check_version<T: Document>(version: Option<&Value>, path: &Path) -> Result<u32> {
    let parts = version.and_then(Value::as_str).and_then(|text| text.split_once('.'));
    let numbers = parts.and_then(|(a, b)| Some((a.parse::<u32>().ok()?, b.parse::<u32>().ok()?)));
    let Some((major, minor)) = numbers else {
        let found = version.map_or("missing".into(), short);
        let cause = format!("the key \"version\" must be like \"{}\", it is {found}", T::version());
        return Err(FormatError::invalid(path, "/version", cause));
    };
    if major == T::MAJOR {
        return Ok(minor);
    }
    let cause = format!("version {major}.{minor} of {} is not known", T::FORMAT);
    let remedy = if major > T::MAJOR {
        format!("use motes {major} or newer, or write the file again with this version")
    } else {
        "write the file again with this version".to_owned()
    };
    Err(FormatError::not_supported(path, "/version", cause).with_remedy(remedy))
}

/// Writes a document with two spaces of indentation and a line break at the end.
///
/// # Errors
/// Writing fails.
pub fn write_document<T: Document>(path: &Path, document: &T) -> Result<()> {
    let text = to_pretty_json(document);
    write_atomic(path, |writer| writer.write_all(text.as_bytes()))
}

/// Compares the values of a document with the ranges that its schema declares; `name` stands for the file in errors.
///
/// # Errors
/// The first value out of range.
pub fn check_ranges<T: Document>(document: &T, name: &Path) -> Result<()> {
    let value = serde_json::to_value(document)
        .map_err(|error| FormatError::invalid(name, "", error.to_string()))?;
    match out_of_range(&schema::<T>().1, &value) {
        None => Ok(()),
        Some(OutOfRange { pointer, cause }) => {
            Err(FormatError::invalid(name, pointer, cause).with_remedy(help::<T>()))
        }
    }
}

/// The error of bytes that are not JSON: place as a JSON pointer with line and column.
pub fn syntax_error(bytes: &[u8], path: &Path, error: &serde_json::Error) -> FormatError {
    let at = offset(bytes, error.line(), error.column());
    let place = place_of(&pointer_at(bytes, at.saturating_sub(1)), error);
    let cause = match error.classify() {
        serde_json::error::Category::Syntax => format!("not JSON: {}", brief(error)),
        serde_json::error::Category::Eof => format!("the document ends early: {}", brief(error)),
        _ => brief(error),
    };
    FormatError::invalid(path, place, cause)
}

/// JSON pointer, line and column.
fn place_of(pointer: &str, error: &serde_json::Error) -> String {
    let place = format!("{pointer} line {} column {}", error.line(), error.column());
    place.trim_start().to_owned()
}

/// Characters of the document that a message quotes, and of what it expected there.
const MOST_QUOTED: usize = 60;
const MOST_EXPECTED: usize = 160;

/// The message of the JSON reader without the place, and without more than a few words of the document.
pub fn brief(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let text = match text.rfind(" at line ") {
        Some(end) if error.line() > 0 => &text[..end],
        _ => &text,
    };
    let cut = |text: &str, most: usize| match text.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    };
    match text.rfind(", expected ") {
        Some(at) => cut(&text[..at], MOST_QUOTED) + &cut(&text[at..], MOST_EXPECTED),
        None => cut(text, MOST_QUOTED + MOST_EXPECTED),
    }
}

/// Where the keys of a document are described.
fn help<T: Document>() -> String {
    let name = T::FORMAT.trim_start_matches("motes/");
    format!("docs/formats/schema/{name}-v{}.schema.json describes every key", T::MAJOR)
}

/// The JSON Schema of a document and the name of its schema file.
pub fn schema<T: Document>() -> (String, Value) {
    let name = T::FORMAT.trim_start_matches("motes/");
    let mut schema = schema_for!(T).to_value();
    schema["$id"] = Value::from(format!("{}-v{}", T::FORMAT, T::MAJOR));
    schema["properties"]["format"]["const"] = Value::from(T::FORMAT);
    schema["properties"]["version"]["pattern"] = Value::from(format!("^{}\\.[0-9]+$", T::MAJOR));
    schema["properties"]["version"]["examples"] = Value::from(vec![T::version()]);
    (format!("{name}-v{}", T::MAJOR), schema)
}

#[cfg(test)]
mod tests;
