//! Links from a page to files beside it.

use std::fmt::Write as _;
use std::path::{Component, Path};

/// A line that leads to a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// What the reader sees.
    pub label: String,
    /// Where it leads, relative to the page.
    pub url: String,
}

/// The URL of a file relative to a folder; both paths absolute and of one root. Bytes that mean something in a URL are
/// percent-encoded (RFC 3986), so that a file name can be no scheme, query or fragment.
pub fn relative_url(folder: &Path, file: &Path) -> String {
    let words = |path: &Path| -> Vec<String> {
        let named = |part: Component<'_>| match part {
            Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
            _ => None,
        };
        path.components().filter_map(named).collect()
    };
    let (folder, file) = (words(folder), words(file));
    let common = folder.iter().zip(&file).take_while(|(a, b)| a == b).count();
    let up = folder[common..].iter().map(|_| "..".to_owned());
    let down = file[common..].iter().map(|name| percent_encoded(name));
    up.chain(down).collect::<Vec<_>>().join("/")
}

fn percent_encoded(name: &str) -> String {
    let mut text = String::new();
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                text.push(byte.into());
            }
            _ => {
                let _ = write!(text, "%{byte:02X}");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_go_up_and_down_and_are_no_scheme() {
        let url = |folder: &str, file: &str| relative_url(Path::new(folder), Path::new(file));
        assert_eq!(url("/a/b", "/a/b/20/model.html"), "20/model.html");
        assert_eq!(url("/a/b/c", "/a/x y#?.html"), "../../x%20y%23%3F.html");
        assert_eq!(url("/a", "/a/javascript:alert(1)"), "javascript%3Aalert%281%29");
    }
}
