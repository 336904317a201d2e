//! A place in the tokens of an instruction.

use super::error::shown;
use super::tokens::{Kind, Token};

/// A place in the tokens; a rule that does not fit sets it back.
#[derive(Clone, Debug)]
pub(crate) struct Cursor<'a> {
    text: &'a str,
    tokens: &'a [Token],
    /// Index of the next token.
    pub(crate) at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(text: &'a str, tokens: &'a [Token]) -> Self {
        Self { text, tokens, at: 0 }
    }

    pub(crate) fn is_done(&self) -> bool {
        self.at >= self.tokens.len()
    }

    fn kind(&self, ahead: usize) -> Option<&'a Kind> {
        self.tokens.get(self.at + ahead).map(|token| &token.kind)
    }

    /// The word `ahead` tokens from here.
    pub(crate) fn word_at(&self, ahead: usize) -> Option<&'a str> {
        match self.kind(ahead)? {
            Kind::Word(word) => Some(word),
            _ => None,
        }
    }

    pub(crate) fn word(&self) -> Option<&'a str> {
        self.word_at(0)
    }

    pub(crate) fn number(&self) -> Option<f64> {
        match self.kind(0)? {
            Kind::Number(value) => Some(*value),
            _ => None,
        }
    }

    pub(crate) fn file(&self) -> Option<&'a str> {
        match self.kind(0)? {
            Kind::File(name) => Some(name),
            _ => None,
        }
    }

    pub(crate) fn mark(&self) -> Option<char> {
        match self.kind(0)? {
            Kind::Mark(mark) => Some(*mark),
            _ => None,
        }
    }

    pub(crate) fn step(&mut self) {
        self.at += 1;
    }

    /// Whether the words of `phrase` come next.
    pub(crate) fn sees(&self, phrase: &str) -> bool {
        phrase.split(' ').enumerate().all(|(k, word)| self.word_at(k) == Some(word))
    }

    /// Takes the words of `phrase` if they come next.
    pub(crate) fn eat(&mut self, phrase: &str) -> bool {
        let sees = self.sees(phrase);
        if sees {
            self.at += phrase.split(' ').count();
        }
        sees
    }

    /// Takes the first of the phrases that comes next.
    pub(crate) fn eat_any(&mut self, phrases: &[&'static str]) -> Option<&'static str> {
        phrases.iter().copied().find(|phrase| self.eat(phrase))
    }

    pub(crate) fn eat_mark(&mut self, mark: char) -> bool {
        let is = self.mark() == Some(mark);
        self.at += usize::from(is);
        is
    }

    /// Articles and pronouns that point at what was said.
    pub(crate) fn eat_article(&mut self) -> bool {
        self.eat_any(&[
            "the", "a", "an", "this", "that", "these", "those", "its", "their", "my", "our",
        ])
        .is_some()
    }

    /// The letters from token `from` to here, in quotes.
    pub(crate) fn since(&self, from: usize) -> String {
        shown(self.slice(from, self.at))
    }

    /// The letters from here to the next mark, in quotes.
    pub(crate) fn rest(&self) -> String {
        let ends = |token: &Token| matches!(token.kind, Kind::Mark(_));
        let left = &self.tokens[self.at.min(self.tokens.len())..];
        let length = left.iter().position(ends).unwrap_or(left.len());
        shown(self.slice(self.at, self.at + length.max(1)))
    }

    fn slice(&self, from: usize, to: usize) -> &'a str {
        let first = self.tokens.get(from).map_or(self.text.len(), |token| token.from);
        let last = self.tokens.get(to.max(1) - 1).map_or(self.text.len(), |token| token.to);
        self.text.get(first..last.max(first)).unwrap_or_default()
    }
}
