//! The JSON pointer (RFC 6901) of a place in a text that may be broken there.

/// A container that is open at some byte.
enum Open {
    /// Index of the item.
    List(usize),
    /// Key of the value, once it was read.
    Object(Option<String>),
}

/// Pointer to the value that byte `end` of `text` lies in, from what was opened before it.
pub fn pointer_at(text: &[u8], end: usize) -> String {
    let mut open: Vec<Open> = Vec::new();
    let text = &text[..end.min(text.len())];
    let mut at = 0;
    let mut last_string = None;
    while let Some(&byte) = text.get(at) {
        match byte {
            b'"' => {
                let start = at + 1;
                at = start;
                while text.get(at).is_some_and(|b| *b != b'"') {
                    at += if text[at] == b'\\' { 2 } else { 1 };
                }
                let bytes = &text[start..at.min(text.len())];
                last_string = Some(String::from_utf8_lossy(bytes).into_owned());
            }
            b'[' => open.push(Open::List(0)),
            b'{' => open.push(Open::Object(None)),
            b']' | b'}' => {
                open.pop();
            }
            b':' => {
                if let Some(Open::Object(key)) = open.last_mut() {
                    *key = last_string.take();
                }
            }
            b',' => match open.last_mut() {
                Some(Open::List(index)) => *index += 1,
                Some(Open::Object(key)) => *key = None,
                None => {}
            },
            _ => {}
        }
        at += 1;
    }
    let mut pointer = String::new();
    for container in &open {
        match container {
            Open::List(index) => pointer.push_str(&format!("/{index}")),
            Open::Object(Some(key)) => {
                pointer.push('/');
                pointer.push_str(&escaped(key));
            }
            Open::Object(None) => {}
        }
    }
    pointer
}

/// Pointer of the path that a deserializer had come to.
pub fn pointer_of(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    let mut pointer = String::new();
    for segment in path {
        match segment {
            Segment::Seq { index } => pointer.push_str(&format!("/{index}")),
            Segment::Map { key } => pointer.push_str(&format!("/{}", escaped(key))),
            Segment::Enum { .. } | Segment::Unknown => {}
        }
    }
    pointer
}

/// A key as a part of a pointer.
pub fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// Byte of a line and a column, both from 1.
pub fn offset(text: &[u8], line: usize, column: usize) -> usize {
    let lines = text.split_inclusive(|b| *b == b'\n').take(line.saturating_sub(1));
    lines.map(<[u8]>::len).sum::<usize>() + column.saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_is_found_before_what_is_broken() {
        let text = br#"{"a": [1, {"b~/": "x,]", "c": [0, NaN]}]}"#;
        let at = text.windows(3).position(|w| w == b"NaN").unwrap();
        assert_eq!(pointer_at(text, at), "/a/1/c/1");
        let at = text.windows(2).position(|w| w == b",]").unwrap();
        assert_eq!(pointer_at(text, at), "/a/1/b~0~1");
        assert_eq!(pointer_at(text, 10_000), "");
        assert_eq!(pointer_at(b"\"open \\", 7), "");
        assert_eq!(offset(b"ab\ncd", 2, 2), 4);
    }
}
