//! Words of a Markdown page, without its code, link targets and comments.

/// A word of prose and its line, counted from 1. An empty word is a break (punctuation, code) that
/// no phrase reaches across; the end of a line is none.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) text: String,
    pub(crate) line: usize,
}

/// Words of a Markdown page in lower case. Fenced blocks, code spans, link targets and HTML
/// comments are left out.
pub(crate) fn words_of_markdown(markdown: &str) -> Vec<Word> {
    words(&prose(markdown))
}

/// Words of plain text in lower case.
pub(crate) fn words(text: &str) -> Vec<Word> {
    let mut found: Vec<Word> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let mut word = String::new();
        for c in line.chars().chain(std::iter::once(' ')) {
            if c.is_alphanumeric() || c == '\'' {
                word.extend(c.to_lowercase());
                continue;
            }
            if !word.is_empty() {
                found.push(Word { text: std::mem::take(&mut word), line: i + 1 });
            }
            if !c.is_whitespace() {
                found.push(Word { text: String::new(), line: i + 1 });
            }
        }
    }
    found
}

/// The page with everything that is not prose replaced by `|`. Lines stay where they are.
pub(crate) fn prose(markdown: &str) -> String {
    let mut kept = String::new();
    let (mut in_block, mut in_comment) = (false, false);
    for line in markdown.lines() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if !in_block {
            let line = without_comments(line, &mut in_comment);
            for (i, piece) in line.split('`').enumerate() {
                kept.push_str(if i % 2 == 0 { piece } else { "|" });
            }
        }
        kept.push('\n');
    }
    without_targets(&kept)
}

fn without_comments(line: &str, inside: &mut bool) -> String {
    let mut kept = String::new();
    let mut rest = line;
    loop {
        let mark = if *inside { "-->" } else { "<!--" };
        let Some((before, after)) = rest.split_once(mark) else { break };
        if !*inside {
            kept.push_str(before);
            kept.push('|');
        }
        *inside = !*inside;
        rest = after;
    }
    if !*inside {
        kept.push_str(rest);
    }
    kept
}

fn without_targets(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        kept.push_str(before);
        kept.push('|');
        rest = after.split_once(')').map_or("", |(_, tail)| tail);
    }
    kept.push_str(rest);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(markdown: &str) -> String {
        let words = words_of_markdown(markdown).into_iter();
        words.map(|w| format!("{}@{}", w.text, w.line)).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn code_comments_and_targets_are_not_prose() {
        let text = "One `code` two\n```\nblock\n```\n[link](a/b.md) <!-- note\nmore --> end\n";
        let found = shown(text);
        for word in ["one@1", "two@1", "link@5", "end@6"] {
            assert!(found.contains(word), "{found}");
        }
        for word in ["code", "block", "b@", "note", "more"] {
            assert!(!found.contains(word), "{word}: {found}");
        }
    }

    #[test]
    fn punctuation_breaks_and_line_ends_do_not() {
        assert_eq!(shown("a, b\nc"), "a@1 @1 b@1 c@2");
    }
}
