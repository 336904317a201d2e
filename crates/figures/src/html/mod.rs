//! Self-contained HTML pages: one file, no network, pictures inlined as data URLs.
//!
//! A page is readable without JavaScript and by keyboard alone, follows the reader's light or
//! dark setting, and prints. Every text that comes from a file passes [`escape`].

mod compare;
mod link;
mod policy;
mod table;

use std::fmt::Write as _;

use base64::Engine as _;
use motes_formats::images::{encode_jpeg, encode_png};
use motes_scene::ImageU8;

pub use compare::{Comparison, Layer};
pub use link::{Link, relative_url};
pub use policy::{policy_element, policy_of_server};
pub use table::{Cell, Table};

use crate::svg_plot::{LinePlot, escape};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A page under construction: blocks from top to bottom.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
    comparisons: usize,
}

impl Page {
    /// A page with a title and one sentence under it.
    pub fn new(title: &str, lead: &str) -> Self {
        let body = format!("<h1>{}</h1>\n<p class=\"lead\">{}</p>\n", escape(title), escape(lead));
        Self { title: title.to_owned(), body, comparisons: 0 }
    }

    /// A section heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(text));
    }

    /// A paragraph of plain text; `code spans` between backquotes are set in monospace.
    pub fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", with_code_spans(text));
    }

    /// A bulleted list of plain texts.
    pub fn list(&mut self, items: &[String]) {
        self.body.push_str("<ul>\n");
        for item in items {
            let _ = writeln!(self.body, "<li>{}</li>", with_code_spans(item));
        }
        self.body.push_str("</ul>\n");
    }

    /// Links to files that lie beside the page.
    pub fn links(&mut self, links: &[Link]) {
        self.body.push_str("<ul class=\"links\">\n");
        for link in links {
            let (url, label) = (escape(&link.url), escape(&link.label));
            let _ = writeln!(self.body, "<li><a href=\"{url}\">{label}</a></li>");
        }
        self.body.push_str("</ul>\n");
    }

    /// A table.
    pub fn table(&mut self, table: &Table) {
        table.write_html(&mut self.body);
    }

    /// A plot; nothing when it has no point.
    pub fn plot(&mut self, plot: &LinePlot) {
        if let Some(svg) = plot.to_svg() {
            let _ = writeln!(self.body, "<figure>{svg}</figure>");
        }
    }

    /// Pictures of several views, each to flip and slide between.
    pub fn comparisons(&mut self, comparisons: &[Comparison]) {
        self.body.push_str("<div class=\"views\">\n");
        for comparison in comparisons {
            comparison.write_html(&mut self.body, self.comparisons);
            self.comparisons += 1;
        }
        self.body.push_str("</div>\n");
    }

    /// A picture with its description, at most as wide as the page.
    pub fn picture(&mut self, url: &str, description: &str, caption: &str) {
        let _ = writeln!(
            self.body,
            "<figure><img src=\"{url}\" alt=\"{}\"><figcaption>{}</figcaption></figure>",
            escape(description),
            escape(caption)
        );
    }

    /// The names and values of a protocol.
    pub fn definitions(&mut self, pairs: &[(String, String)]) {
        self.body.push_str("<dl>\n");
        for (name, value) in pairs {
            let _ =
                writeln!(self.body, "<dt>{}</dt><dd>{}</dd>", escape(name), with_code_spans(value));
        }
        self.body.push_str("</dl>\n");
    }

    /// The finished document.
    pub fn finish(self) -> String {
        let title = escape(&self.title);
        let script = format!("\n{SCRIPT}");
        let policy = policy_element(&script);
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{policy}\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{}\
             </main>\n<script>{script}</script>\n</body>\n</html>\n",
            self.body
        )
    }
}

/// A picture as a data URL: JPEG for what a camera or a renderer made.
pub fn jpeg_url(image: &ImageU8) -> String {
    data_url("jpeg", &encode_jpeg(image, 92))
}

/// A picture as a data URL without loss, for diagrams and color scales.
pub fn png_url(image: &ImageU8) -> String {
    data_url("png", &encode_png(image))
}

fn data_url(kind: &str, bytes: &[u8]) -> String {
    let base64 = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!("data:image/{kind};base64,{base64}")
}

fn with_code_spans(text: &str) -> String {
    let mut out = String::new();
    for (i, part) in text.split('`').enumerate() {
        let part = escape(part);
        if i % 2 == 1 {
            let _ = write!(out, "<code>{part}</code>");
        } else {
            out.push_str(&part);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_needs_nothing_from_outside_and_escapes_names() {
        let mut page = Page::new("Report <of> \"x\"", "One sentence & more.");
        page.paragraph("Run `a < b` now");
        page.table(&Table {
            caption: "t".into(),
            columns: vec!["view".into()],
            rows: vec![vec![Cell::text("<script>alert(1)</script>")]],
        });
        let red = ImageU8::from_data(2, 1, 3, vec![255, 0, 0, 0, 0, 0]);
        page.picture(&png_url(&red), "two pixels", "caption");
        let html = page.finish();
        assert!(html.contains("Report &lt;of&gt; &quot;x&quot;"));
        assert!(html.contains("<code>a &lt; b</code>"));
        assert!(!html.contains("<script>alert"));
        for outside in ["http://", "https://", "@import", "url(", " src=\"/", "<link"] {
            assert!(!html.contains(outside), "{outside}");
        }
    }

    #[test]
    fn data_urls_hold_the_picture() {
        let image = ImageU8::filled(3, 2, 3, 77);
        let url = png_url(&image);
        let base64 = url.strip_prefix("data:image/png;base64,").unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(base64).unwrap();
        assert_eq!(bytes, encode_png(&image));
        assert!(jpeg_url(&image).starts_with("data:image/jpeg;base64,/9j/"));
    }
}
