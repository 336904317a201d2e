//! A table of scores as Markdown.

use super::table::ScoreTable;

/// A pipe table, best values bold, notes below.
pub fn to_markdown(table: &ScoreTable) -> String {
    let mut text = String::from("| |");
    table.columns.iter().for_each(|column| text += &format!(" {} |", column.heading()));
    text += if table.has_spread() { " Runs |\n|---|" } else { "\n|---|" };
    text += &"---:|".repeat(table.columns.len() + usize::from(table.has_spread()));
    for row in &table.rows {
        text += &format!("\n| {} |", escape(&row.label));
        for (column, cell) in table.columns.iter().zip(&row.cells) {
            let words = cell.as_ref().map(|cell| cell.text(*column, ["**", "**"], "±"));
            text += &format!(" {} |", words.as_deref().unwrap_or("-"));
        }
        if table.has_spread() {
            text += &format!(" {} |", row.samples);
        }
    }
    text.push('\n');
    table.notes.iter().for_each(|note| text += &format!("\n{}\n", escape(note)));
    text
}

/// Text in which no character starts markup or ends a cell.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '\n' | '\r' => escaped.push(' '),
            '|' | '*' | '_' | '`' | '[' | ']' | '<' | '\\' => escaped.extend(['\\', c]),
            c => escaped.push(c),
        }
    }
    escaped
}
