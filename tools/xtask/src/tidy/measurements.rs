//! Measured numbers and dates live in `docs/benchmarks`, so that manuals do not age.

use super::prose::{prose, words};
use super::vocabulary::is_page;
use crate::problem::Problem;
use crate::sources::Source;

/// What only a record says.
const PHRASES: [&str; 7] = [
    "was measured",
    "were measured",
    "measured on",
    "tried and left out",
    "load average",
    "shared cores",
    "shared virtual machine",
];
const CPU_UNITS: [&str; 4] = ["s", "second", "seconds", "minutes"];

pub(super) fn check(source: &Source) -> Vec<Problem> {
    if !is_page(&source.path) {
        return Vec::new();
    }
    let text = prose(&source.text);
    let lines = text.lines().enumerate();
    lines
        .filter_map(|(i, line)| {
            let what = found(line)?;
            let text = format!("{what}: measurements and dates belong in docs/benchmarks");
            Some(Problem::error(&source.path, i + 1, text))
        })
        .collect()
}

fn found(line: &str) -> Option<String> {
    let lower = line.to_lowercase();
    if let Some(phrase) = PHRASES.iter().find(|phrase| lower.contains(*phrase)) {
        return Some(format!("\"{phrase}\""));
    }
    if let Some(date) = date(line) {
        return Some(format!("the date {date}"));
    }
    cpu_time(line).or_else(|| decibels(line))
}

fn date(line: &str) -> Option<&str> {
    let is_date = |text: &str| {
        text.bytes().enumerate().all(|(i, b)| match i {
            0 => b == b'2',
            4 | 7 => b == b'-',
            _ => b.is_ascii_digit(),
        })
    };
    (0..line.len().saturating_sub(9)).filter_map(|i| line.get(i..i + 10)).find(|text| is_date(text))
}

/// A number before `CPU s`, `CPU-s`, `CPU seconds`, `CPU minutes`.
fn cpu_time(line: &str) -> Option<String> {
    let words: Vec<String> =
        words(line).into_iter().map(|w| w.text).filter(|w| !w.is_empty()).collect();
    let found = words
        .windows(3)
        .find(|w| is_number(&w[0]) && w[1] == "cpu" && CPU_UNITS.contains(&w[2].as_str()))?;
    Some(format!("\"{}\"", found.join(" ")))
}

/// A score such as `26.86 dB`. Criteria are whole (`psnr>=25`) or small (`0.05 dB`).
fn decibels(line: &str) -> Option<String> {
    let mut before = "";
    for word in line.split_whitespace() {
        let unit = word.trim_end_matches(|c: char| !c.is_alphanumeric());
        let number: Option<f64> = before.trim_start_matches('(').parse().ok();
        if unit == "dB" && before.contains('.') && number.is_some_and(|n| n >= 10.0) {
            return Some(format!("\"{before} dB\""));
        }
        before = word;
    }
    None
}

fn is_number(word: &str) -> bool {
    word.bytes().all(|b| b.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        let source = Source { path: path.into(), text: text.into() };
        check(&source).into_iter().map(|problem| problem.line).collect()
    }

    #[test]
    fn records_in_a_manual_are_found() {
        let text = "It takes 3.1 CPU-s.\n2026-11-21, later\nscores (26.86 dB) so\nwas measured\n";
        assert_eq!(lines("docs/a.md", text), [1, 2, 3, 4]);
        assert!(lines("docs/benchmarks/a.md", text).is_empty());
    }

    #[test]
    fn criteria_formats_and_code_are_fine() {
        let text = "must bring 0.05 dB, equal images 128 dB\n`2026-11-21` CPU seconds per phase\n\
                    ```\n26.86 dB\n```\n[x](benchmarks/2026-11-21-a.md)\n";
        assert!(lines("docs/a.md", text).is_empty(), "{:?}", lines("docs/a.md", text));
    }
}
