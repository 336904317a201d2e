//! JSON text for people: indented objects, one line per array of numbers.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;

/// JSON with two spaces of indentation and a line break at the end. An array stays on one line,
/// except that every object in it starts a line of its own: poses and parameters remain readable.
/// NaN and infinity, which JSON lacks, become null.
///
/// # Panics
/// When a map of the value has keys that are not strings.
pub fn to_pretty_json<T: Serialize>(value: &T) -> String {
    let mut bytes = Vec::new();
    let mut serializer = Serializer::with_formatter(&mut bytes, Pretty::default());
    let outcome = value.serialize(&mut serializer);
    assert!(outcome.is_ok(), "a document has string keys: {outcome:?}");
    bytes.push(b'\n');
    String::from_utf8_lossy(&bytes).into_owned()
}

/// What encloses the value that is written next.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Enclosing {
    Object { empty: bool },
    Array { broken: bool },
}

#[derive(Default)]
struct Pretty {
    stack: Vec<Enclosing>,
}

impl Pretty {
    fn new_line<W: Write + ?Sized>(&self, writer: &mut W) -> io::Result<()> {
        let broken = |e: &&Enclosing| !matches!(e, Enclosing::Array { broken: false });
        let depth = self.stack.iter().filter(broken).count();
        write!(writer, "\n{:1$}", "", 2 * depth)
    }
}

impl Formatter for Pretty {
    fn begin_array<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        self.stack.push(Enclosing::Array { broken: false });
        writer.write_all(b"[")
    }

    fn begin_array_value<W: Write + ?Sized>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        if first { Ok(()) } else { writer.write_all(b",") }
    }

    fn end_array<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.stack.pop() == Some(Enclosing::Array { broken: true }) {
            self.new_line(writer)?;
        }
        writer.write_all(b"]")
    }

    fn begin_object<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        if let Some(Enclosing::Array { broken }) = self.stack.last_mut() {
            *broken = true;
            self.new_line(writer)?;
        }
        self.stack.push(Enclosing::Object { empty: true });
        writer.write_all(b"{")
    }

    fn begin_object_key<W: Write + ?Sized>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        if let Some(Enclosing::Object { empty }) = self.stack.last_mut() {
            *empty = false;
        }
        if !first {
            writer.write_all(b",")?;
        }
        self.new_line(writer)
    }

    fn begin_object_value<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }

    fn end_object<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.stack.pop() == Some(Enclosing::Object { empty: false }) {
            self.new_line(writer)?;
        }
        writer.write_all(b"}")
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn arrays_of_numbers_stay_on_a_line() {
        let value = json!({
            "a": [1, 2.5, [3]], "b": [{"c": [0.1], "d": {}}, {"e": null}], "f": [], "g": {"h": 1},
        });
        let expected = r#"{
  "a": [1,2.5,[3]],
  "b": [
    {
      "c": [0.1],
      "d": {}
    },
    {
      "e": null
    }
  ],
  "f": [],
  "g": {
    "h": 1
  }
}
"#;
        let text = to_pretty_json(&value);
        assert_eq!(text, expected);
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }
}
