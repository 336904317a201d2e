//! A table of scores as CSV (RFC 4180): a header, then a line per row, numbers in full.

use super::table::ScoreTable;

/// `label,samples`, then mean and standard deviation of each column; an empty field was not measured.
pub fn to_csv(table: &ScoreTable) -> String {
    let mut text = String::from("label,samples");
    for column in &table.columns {
        text += &format!(",{0},{0}_deviation", column.key());
    }
    for row in &table.rows {
        text += &format!("\r\n{},{}", quoted(&row.label), row.samples);
        for cell in &row.cells {
            let mean = cell.as_ref().map(|cell| cell.mean.to_string()).unwrap_or_default();
            let deviation = cell.as_ref().and_then(|cell| cell.deviation);
            text += &format!(",{mean},{}", deviation.map(|d| d.to_string()).unwrap_or_default());
        }
    }
    text + "\r\n"
}

/// A field; one that a spreadsheet would read as a formula is kept from it by an apostrophe.
fn quoted(field: &str) -> String {
    let field = match field.chars().next() {
        Some('=' | '+' | '-' | '@') => format!("'{field}"),
        _ => field.to_owned(),
    };
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field
    }
}
