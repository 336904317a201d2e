//! A table of scores as LaTeX.

use super::table::{Column, ScoreTable};

/// A `tabular` with rules of the package booktabs, best values bold, notes as comments.
pub fn to_latex(table: &ScoreTable) -> String {
    let mut text: String =
        table.notes.iter().map(|note| format!("% {}\n", note.replace(['\n', '\r'], " "))).collect();
    let count = table.columns.len() + usize::from(table.has_spread());
    text += &format!("\\begin{{tabular}}{{l{}}}\n\\toprule\n", "r".repeat(count));
    table.columns.iter().for_each(|column| text += &format!(" & {}", heading(*column)));
    text += if table.has_spread() { " & Runs \\\\\n\\midrule\n" } else { " \\\\\n\\midrule\n" };
    for row in &table.rows {
        text += &escape(&row.label);
        for (column, cell) in table.columns.iter().zip(&row.cells) {
            text += &format!(
                " & {}",
                cell.as_ref().map_or("--".into(), |c| c.text(
                    *column,
                    ["\\textbf{", "}"],
                    "$\\pm$"
                ))
            );
        }
        if table.has_spread() {
            text += &format!(" & {}", row.samples);
        }
        text += " \\\\\n";
    }
    text + "\\bottomrule\n\\end{tabular}\n"
}

fn heading(column: Column) -> String {
    let arrow = match column {
        Column::Psnr | Column::PsnrColorCorrected | Column::Ssim => " $\\uparrow$",
        Column::Lpips => " $\\downarrow$",
        Column::Gap | Column::Gaussians => "",
    };
    format!("{}{arrow}", column.heading())
}

/// Text in which no character is a command.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '\n' | '\r' => escaped.push(' '),
            '\\' => escaped.push_str("\\textbackslash{}"),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', c]),
            c => escaped.push(c),
        }
    }
    escaped
}
