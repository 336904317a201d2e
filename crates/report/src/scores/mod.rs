//! Scores of several runs as one table: mean and spread of each row, in three formats.

mod csv;
mod latex;
mod markdown;
mod table;

pub use csv::to_csv;
pub use latex::to_latex;
pub use markdown::to_markdown;
pub use table::{Cell, Column, Row, Sample, ScoreTable};

#[cfg(test)]
mod tests;
