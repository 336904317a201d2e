//! The external program.

use std::path::Path;
use std::process::{Command, Stdio};

use motes_formats::FormatError;
use motes_formats::images::{read_image, write_png};
use motes_scene::ImageF32;
use thiserror::Error;

/// A command line that edits a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Editor {
    words: Vec<String>,
    prompt: String,
}

/// Why the editor failed.
#[derive(Debug, Error)]
pub enum EditorError {
    /// The command line has an open quote or no word.
    #[error("the command line of the editor is empty or has an open quote: {0}")]
    Words(String),
    /// It cannot be started.
    #[error("cannot start {program}: {source}")]
    Start {
        /// Its first word.
        program: String,
        /// What the system answered.
        source: std::io::Error,
    },
    /// It ended with an error.
    #[error("the editor failed on {view} ({status}): {said}")]
    Failed {
        /// The view.
        view: String,
        /// How it ended.
        status: String,
        /// The last line of its error output.
        said: String,
    },
    /// It ended well, but there is no picture.
    #[error("the editor wrote no picture for {view} at the place that {{output}} stands for")]
    NoPicture {
        /// The view.
        view: String,
    },
    /// The picture that it wrote has another size.
    #[error("the editor made {width} x {height} pixels of {view}: pictures keep their size")]
    Size {
        /// The view.
        view: String,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A picture cannot be written or read.
    #[error(transparent)]
    Picture(#[from] FormatError),
}

impl Editor {
    /// Splits a command line at spaces, outside of `'...'` and `"..."`.
    ///
    /// # Errors
    /// A quote is not closed, or there is no word.
    pub fn new(command: &str, prompt: &str) -> Result<Self, EditorError> {
        let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
        for c in command.chars() {
            match (quote, c) {
                (Some(open), _) if c == open => quote = None,
                (None, '\'' | '"') => {
                    quote = Some(c);
                    word.get_or_insert_with(String::new);
                }
                (None, c) if c.is_whitespace() => words.extend(word.take()),
                _ => word.get_or_insert_with(String::new).push(c),
            }
        }
        words.extend(word);
        if quote.is_some() || words.is_empty() {
            return Err(EditorError::Words(command.to_owned()));
        }
        Ok(Self { words, prompt: prompt.to_owned() })
    }

    /// The edited picture of a view.
    ///
    /// # Errors
    /// The program cannot be started, fails, or writes no picture of the same size.
    pub fn edit(
        &self,
        original: &ImageF32,
        current: &ImageF32,
        view: &str,
    ) -> Result<ImageF32, EditorError> {
        let io = |source| FormatError::io(Path::new("temporary folder"), source);
        let folder = tempfile::tempdir().map_err(io)?;
        let at = |name: &str| folder.path().join(name);
        write_png(&at("input.png"), &original.to_u8())?;
        write_png(&at("current.png"), &current.to_u8())?;
        let filled = |word: &String| {
            word.replace("{input}", &at("input.png").to_string_lossy())
                .replace("{current}", &at("current.png").to_string_lossy())
                .replace("{output}", &at("output.png").to_string_lossy())
                .replace("{view}", view)
                .replace("{prompt}", &self.prompt)
        };
        let words: Vec<String> = self.words.iter().map(filled).collect();
        let start = |source| EditorError::Start { program: words[0].clone(), source };
        let done = Command::new(&words[0])
            .args(&words[1..])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .output()
            .map_err(start)?;
        if !done.status.success() {
            let text = String::from_utf8_lossy(&done.stderr);
            let said = text.lines().rfind(|l| !l.trim().is_empty()).unwrap_or("it said nothing");
            let (view, status) = (view.to_owned(), done.status.to_string());
            return Err(EditorError::Failed { view, status, said: said.trim().to_owned() });
        }
        if !at("output.png").exists() {
            return Err(EditorError::NoPicture { view: view.to_owned() });
        }
        let image = read_image(&at("output.png"))?;
        let (width, height) = (image.width, image.height);
        if (width, height) != (original.width, original.height) {
            return Err(EditorError::Size { view: view.to_owned(), width, height });
        }
        let data = image.to_f32();
        let rgb = data.data.chunks_exact(data.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
        Ok(ImageF32::from_data(width, height, 3, rgb))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_outside_of_quotes() {
        let words = |text: &str| Editor::new(text, "").map(|e| e.words);
        assert_eq!(words("a  'b c' d\"e f\" ''").unwrap(), ["a", "b c", "de f", ""]);
        assert!(words("a 'b").is_err() && words("  ").is_err());
    }

    #[test]
    fn a_copy_changes_nothing_and_failures_are_told() {
        let image = ImageF32::filled(6, 4, 3, 0.5);
        let copy = Editor::new("cp {input} {output}", "").unwrap();
        let edited = copy.edit(&image, &image, "a").unwrap();
        assert!(edited.data.iter().all(|v| (v - 0.5).abs() < 3e-3));
        for (command, says) in [
            ("no-such-program-here {input} {output}", "cannot start no-such-program-here"),
            (
                "sh -c 'echo no light >&2; exit 3' {input} {output}",
                "failed on a (exit status: 3): no light",
            ),
            ("true {input} {output}", "wrote no picture for a"),
        ] {
            let error = Editor::new(command, "").unwrap().edit(&image, &image, "a").unwrap_err();
            assert!(error.to_string().contains(says), "{command}: {error}");
        }
    }
}
