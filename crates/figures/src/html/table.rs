//! Tables.

use std::fmt::Write as _;

use crate::svg_plot::escape;

/// A table with a caption. The first column names the row.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// What the table shows.
    pub caption: String,
    /// Column headings.
    pub columns: Vec<String>,
    /// Rows of cells, one per column.
    pub rows: Vec<Vec<Cell>>,
}

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    text: String,
    is_number: bool,
}

impl Cell {
    /// A text, aligned left.
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), is_number: false }
    }

    /// A number with fixed decimals, aligned right; a dash where there is none.
    pub fn number(value: impl Into<Option<f64>>, decimals: usize) -> Self {
        let value = value.into().filter(|v| v.is_finite());
        let text = value.map_or_else(|| "\u{2013}".to_owned(), |v| format!("{v:.decimals$}"));
        Self { text, is_number: true }
    }

    /// A count, aligned right, digits in groups of three.
    pub fn count(value: usize) -> Self {
        let digits = value.to_string();
        let mut text = String::new();
        for (i, digit) in digits.chars().enumerate() {
            if i > 0 && (digits.len() - i).is_multiple_of(3) {
                text.push('\u{202f}');
            }
            text.push(digit);
        }
        Self { text, is_number: true }
    }
}

impl Table {
    pub(super) fn write_html(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table>\n\
             <caption>{0}</caption>\n<thead><tr>",
            escape(&self.caption)
        );
        for (i, column) in self.columns.iter().enumerate() {
            let is_number = self.rows.iter().filter_map(|row| row.get(i)).any(|c| c.is_number);
            let class = if is_number { " class=\"number\"" } else { "" };
            let _ = write!(out, "<th scope=\"col\"{class}>{}</th>", escape(column));
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            out.push_str("<tr>");
            for (i, cell) in row.iter().enumerate() {
                let class = if cell.is_number { " class=\"number\"" } else { "" };
                let (open, close) = if i == 0 { ("th scope=\"row\"", "th") } else { ("td", "td") };
                let _ = write!(out, "<{open}{class}>{}</{close}>", escape(&cell.text));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody></table></div>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_fixed_and_missing_ones_a_dash() {
        assert_eq!(Cell::number(21.456, 2).text, "21.46");
        assert_eq!(Cell::number(None, 2).text, "\u{2013}");
        assert_eq!(Cell::number(f64::NAN, 2).text, "\u{2013}");
        assert_eq!(Cell::count(1_234_567).text, "1\u{202f}234\u{202f}567");
        assert_eq!(Cell::count(999).text, "999");
    }
}
