//! Text to words, numbers, names of files and marks.

use super::error::{Misread, shown};

/// Longer instructions are refused: a sentence has some hundred letters.
pub const MAX_LETTERS: usize = 2000;

/// What a token is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    /// Lower case, without hyphens.
    Word(String),
    /// Finite.
    Number(f64),
    /// As it was typed.
    File(String),
    /// `,` `;` `.` or `%`.
    Mark(char),
}

/// A token and where its letters are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Token {
    pub(crate) kind: Kind,
    /// Bytes of the instruction.
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// Suffixes of what can be inserted.
const SUFFIXES: [&str; 12] =
    ["glb", "gltf", "obj", "ply", "spz", "splat", "ksplat", "sog", "usdz", "exr", "hdr", "json"];

/// The tokens of an instruction.
///
/// # Errors
/// It is empty, longer than [`MAX_LETTERS`], or has signs that are no words.
pub(crate) fn tokens(text: &str) -> Result<Vec<Token>, Misread> {
    if text.chars().nth(MAX_LETTERS).is_some() {
        let cause = format!("the instruction has more than {MAX_LETTERS} letters");
        return Err(Misread::new(cause, "say it in sentences, one command after another"));
    }
    let mut found = Vec::new();
    let mut at = 0;
    for chunk in text.split(char::is_whitespace) {
        let from = at;
        at = from
            + chunk.len()
            + text[from + chunk.len()..].chars().next().map_or(0, char::len_utf8);
        chunk_tokens(chunk, from, &mut found)?;
    }
    if !found.iter().any(|token| !matches!(token.kind, Kind::Mark(_))) {
        return Err(Misread::new(
            "the instruction is empty",
            "say what to change, as in \"move the ball to the right\"",
        ));
    }
    Ok(found)
}

/// Quotes and brackets around a word.
fn is_wrapping(c: char) -> bool {
    matches!(c, '"' | '\'' | '(' | ')' | '“' | '”' | '‘' | '’' | '«' | '»')
}

fn chunk_tokens(chunk: &str, from: usize, found: &mut Vec<Token>) -> Result<(), Misread> {
    let inner = chunk.trim_start_matches(is_wrapping);
    let from = from + chunk.len() - inner.len();
    let inner = inner.trim_end_matches(is_wrapping);
    let name = inner.trim_end_matches([',', ';', '.', '!', '?', ':']).trim_end_matches(is_wrapping);
    let is_file = name.rsplit_once('.').is_some_and(|(stem, suffix)| {
        !stem.is_empty() && SUFFIXES.contains(&suffix.to_ascii_lowercase().as_str())
    });
    if is_file || name.contains('/') || name.contains('\\') {
        found.push(Token { kind: Kind::File(name.into()), from, to: from + name.len() });
        return marks(&inner[name.len()..], from + name.len(), found);
    }
    let mut rest = inner;
    let mut at = from;
    while !rest.is_empty() {
        let length = one_token(rest, at, found)?;
        rest = &rest[length..];
        at += length;
    }
    Ok(())
}

fn marks(text: &str, from: usize, found: &mut Vec<Token>) -> Result<(), Misread> {
    let mut at = from;
    while at < from + text.len() {
        at += one_token(&text[at - from..], at, found)?;
    }
    Ok(())
}

/// Adds the token that `text` begins with; its length in bytes.
fn one_token(text: &str, at: usize, found: &mut Vec<Token>) -> Result<usize, Misread> {
    let Some(first) = text.chars().next() else { return Ok(0) };
    let mut add = |kind, length: usize| {
        found.push(Token { kind, from: at, to: at + length });
        length
    };
    let second_is_digit = text[first.len_utf8()..].starts_with(|c: char| c.is_ascii_digit());
    if first.is_ascii_digit() || (matches!(first, '-' | '+' | '.') && second_is_digit) {
        let body = text[1..].find(|c: char| !(c.is_ascii_digit() || c == '.'));
        let digits = &text[..body.map_or(text.len(), |end| end + 1)];
        let digits = digits.trim_end_matches('.');
        return match digits.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(add(Kind::Number(value), digits.len())),
            _ => Err(Misread::new(
                format!("{} is no number", shown(digits)),
                "write it as in 20 or 0.5",
            )),
        };
    }
    if first.is_alphabetic() {
        let end = text.find(|c: char| !(c.is_alphabetic() || c == '\'' || c == '’'));
        let word = &text[..end.unwrap_or(text.len())];
        let plain = word.trim_end_matches("'s").trim_end_matches("’s");
        return Ok(add(Kind::Word(plain.replace(['\'', '’'], "").to_lowercase()), word.len()));
    }
    Ok(match first {
        ',' | ';' | '%' => add(Kind::Mark(first), 1),
        '.' | '!' | '?' | ':' => add(Kind::Mark('.'), 1),
        '&' => add(Kind::Word("and".into()), 1),
        '°' => add(Kind::Word("degrees".into()), first.len_utf8()),
        '×' => add(Kind::Word("x".into()), first.len_utf8()),
        '-' | '–' | '—' | '_' | '…' => first.len_utf8(),
        c if is_wrapping(c) => c.len_utf8(),
        c => {
            let text = shown(&c.to_string());
            return Err(Misread::new(
                format!("the sign {text} means nothing here"),
                "write words and numbers",
            ));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> Vec<String> {
        let show = |token: Token| match token.kind {
            Kind::Word(word) => word,
            Kind::Number(value) => value.to_string(),
            Kind::File(name) => format!("<{name}>"),
            Kind::Mark(mark) => mark.to_string(),
        };
        tokens(text).unwrap().into_iter().map(show).collect()
    }

    #[test]
    fn words_numbers_files_and_marks_are_told_apart() {
        assert_eq!(said("Move it 20cm, please."), ["move", "it", "20", "cm", ",", "please", "."]);
        assert_eq!(
            said("swap \"the sofa\" for My-Sofa.glb."),
            ["swap", "the", "sofa", "for", "<My-Sofa.glb>", "."]
        );
        assert_eq!(
            said("golden-hour 1.5x -3% 90°"),
            ["golden", "hour", "1.5", "x", "-3", "%", "90", "degrees"]
        );
        assert_eq!(said("the chair's legs"), ["the", "chair", "legs"]);
        assert_eq!(said("déplacer  ../a/b"), ["déplacer", "<../a/b>"]);
    }

    #[test]
    fn places_are_bytes_of_the_instruction() {
        let text = "été  «move» 3 m";
        for token in tokens(text).unwrap() {
            assert!(text.get(token.from..token.to).is_some(), "{token:?}");
        }
    }

    #[test]
    fn nothing_too_much_and_strange_signs_are_refused() {
        for bad in ["", "  \n", "...", "move \u{1}", "make it 😀", &"a ".repeat(MAX_LETTERS)] {
            assert!(tokens(bad).is_err(), "{bad}");
        }
    }
}
