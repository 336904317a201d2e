//! Texts to token numbers, as CLIP splits them.

use std::collections::HashMap;
use std::path::Path;

use serde_json::{Value, json};
use tokenizers::Tokenizer;

use crate::error::{DiffusionError, Result};
use crate::weights::read_json;

const BEGIN: &str = "<|startoftext|>";
const END: &str = "<|endoftext|>";
/// What becomes one piece before pairs are joined.
const PIECES: &str =
    r"<\|startoftext\|>|<\|endoftext\|>|'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+";
/// Chunks of a long text: a longer one says nothing that a model trained on one chunk would follow.
const MOST_CHUNKS: usize = 8;

/// The tokenizer of a text encoder that reads `longest` tokens at a time.
pub struct Tokens {
    tokenizer: Tokenizer,
    begin: u32,
    end: u32,
    padding: u32,
    longest: usize,
}

impl Tokens {
    /// The tokenizer in a folder: `vocab.json` and `merges.txt`, or `tokenizer.json`.
    ///
    /// # Errors
    /// The files are missing or of another kind of tokenizer.
    pub fn load(folder: &Path, longest: usize) -> Result<Self> {
        let help = "name the folder that has model_index.json, with all of its parts";
        let bad = |cause: String| DiffusionError::weights(cause, folder, help);
        let (vocabulary, merges) = words(folder)?;
        let number = |word: &str| {
            let found = vocabulary.get(word).copied();
            found.ok_or_else(|| bad(format!("no tokenizer of CLIP: it has no word {word}")))
        };
        let (begin, end) = (number(BEGIN)?, number(END)?);
        let padding = number(&padding(folder))?;
        let text = document(&vocabulary, &merges, [begin, end]).to_string();
        let tokenizer = Tokenizer::from_bytes(text)
            .map_err(|error| bad(format!("no tokenizer of CLIP ({error})")))?;
        Ok(Self { tokenizer, begin, end, padding, longest })
    }

    /// Token numbers of a text without the marks of its ends.
    ///
    /// # Errors
    /// A piece of the text is of no token.
    pub fn numbers(&self, text: &str) -> Result<Vec<u32>> {
        let encoded = self.tokenizer.encode(text, false).map_err(|error| {
            let help = "write it in other words";
            DiffusionError::request(format!("the prompt cannot be read ({error})"), help)
        })?;
        Ok(encoded.get_ids().to_vec())
    }

    /// A text that fits, with the marks of its ends, filled as the tokenizer fills.
    ///
    /// # Errors
    /// It does not fit.
    pub fn one(&self, text: &str) -> Result<Vec<u32>> {
        let numbers = self.numbers(text)?;
        let inner = self.longest - 2;
        if numbers.len() > inner {
            let cause = format!("the prompt has {} tokens, the model reads {inner}", numbers.len());
            return Err(DiffusionError::request(cause, "shorten the prompt"));
        }
        Ok(self.row(&numbers, self.padding))
    }

    /// A text of any length in chunks, each filled with the end mark.
    ///
    /// # Errors
    /// It has more chunks than the model takes.
    pub fn chunks(&self, text: &str) -> Result<Vec<Vec<u32>>> {
        let numbers = self.numbers(text)?;
        let inner = self.longest - 2;
        if numbers.len() > MOST_CHUNKS * inner {
            let (count, most) = (numbers.len(), MOST_CHUNKS * inner);
            let cause = format!("the prompt has {count} tokens; the model takes {most}");
            return Err(DiffusionError::request(cause, "shorten the prompt"));
        }
        if numbers.is_empty() {
            return Ok(vec![self.row(&[], self.end)]);
        }
        Ok(numbers.chunks(inner).map(|chunk| self.row(chunk, self.end)).collect())
    }

    fn row(&self, numbers: &[u32], padding: u32) -> Vec<u32> {
        let mut row = vec![self.begin];
        row.extend_from_slice(numbers);
        row.push(self.end);
        row.resize(self.longest, padding);
        row
    }
}

/// A tokenizer of CLIP in the format of its library: NFC, one space for many, small letters, pieces, bytes, pairs.
fn document(vocabulary: &HashMap<String, u32>, merges: &Merges, marks: [u32; 2]) -> Value {
    let mark = |(id, content): (u32, &str)| {
        json!({
            "id": id, "content": content, "special": true, "normalized": false,
            "single_word": false, "lstrip": false, "rstrip": false,
        })
    };
    json!({
        "version": "1.0",
        "added_tokens": [mark((marks[0], BEGIN)), mark((marks[1], END))],
        "normalizer": {"type": "Sequence", "normalizers": [
            {"type": "NFC"},
            {"type": "Replace", "pattern": {"Regex": r"\s+"}, "content": " "},
            {"type": "Lowercase"},
        ]},
        "pre_tokenizer": {"type": "Sequence", "pretokenizers": [
            {"type": "Split", "pattern": {"Regex": PIECES}, "behavior": "Removed", "invert": true},
            {"type": "ByteLevel", "add_prefix_space": false, "trim_offsets": true, "use_regex": true},
        ]},
        "model": {
            "type": "BPE", "unk_token": END, "continuing_subword_prefix": "",
            "end_of_word_suffix": "</w>", "fuse_unk": false, "vocab": vocabulary, "merges": merges,
        },
    })
}

type Merges = Vec<(String, String)>;

/// Numbers of words, and the pairs that are joined, the most frequent first.
fn words(folder: &Path) -> Result<(HashMap<String, u32>, Merges)> {
    let path = folder.join("merges.txt");
    if let Ok(text) = std::fs::read_to_string(&path) {
        let lines = text.lines().filter(|line| !line.starts_with("#version"));
        let merges = lines.filter_map(|line| line.split_once(' ')).map(owned).collect();
        return Ok((read_json(&folder.join("vocab.json"))?, merges));
    }
    let path = folder.join("tokenizer.json");
    let document: Value = read_json(&path)?;
    let bad = || {
        let help = "name the folder that has model_index.json, with all of its parts";
        DiffusionError::weights("no tokenizer of CLIP", &path, help)
    };
    let model = &document["model"];
    let vocabulary = serde_json::from_value(model["vocab"].clone()).map_err(|_| bad())?;
    let pair = |value: &Value| match value {
        Value::String(line) => line.split_once(' ').map(owned),
        Value::Array(pair) => match pair.as_slice() {
            [a, b] => Some(owned((a.as_str()?, b.as_str()?))),
            _ => None,
        },
        _ => None,
    };
    let merges = model["merges"].as_array().ok_or_else(bad)?;
    Ok((vocabulary, merges.iter().map(pair).collect::<Option<_>>().ok_or_else(bad)?))
}

fn owned((a, b): (&str, &str)) -> (String, String) {
    (a.to_owned(), b.to_owned())
}

/// What short texts are filled with.
fn padding(folder: &Path) -> String {
    let config = read_json::<Value>(&folder.join("tokenizer_config.json")).unwrap_or_default();
    let said = &config["pad_token"];
    let word = said.as_str().or_else(|| said["content"].as_str());
    word.unwrap_or(END).to_owned()
}
