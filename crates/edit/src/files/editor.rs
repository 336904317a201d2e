//! The external program.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};

use motes_formats::FormatError;
use motes_formats::images::{read_image, write_png};
use motes_protocol::{POLL, end_group, split_words};
use motes_scene::ImageF32;

use super::provider_editor::rgb;
use crate::stylize::{EditorError, Picture, PictureEditor, Round};

/// Bytes of its error output, from the end, among which the last line is looked for.
const KEPT_BYTES: u64 = 4096;

/// A command line that edits a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Editor {
    words: Vec<String>,
}

impl PictureEditor for Editor {
    fn edit(
        &self,
        prompt: &str,
        pictures: &[Picture<'_>],
        _round: Round,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<ImageF32>, EditorError> {
        pictures.iter().map(|picture| self.edit_one(prompt, picture, stopped)).collect()
    }
}

impl Editor {
    /// Splits a command line at spaces, outside of `'...'` and `"..."`.
    ///
    /// # Errors
    /// A quote is not closed, or there is no word.
    pub(crate) fn new(command: &str) -> Result<Self, EditorError> {
        match split_words(command) {
            Some(words) if !words.is_empty() => Ok(Self { words }),
            _ => Err(EditorError::Words(command.to_owned())),
        }
    }

    /// The edited picture of a view.
    ///
    /// # Errors
    /// The program cannot be started, fails, or writes no picture of the same size; the user asked to stop, which ends
    /// the program, too.
    fn edit_one(
        &self,
        prompt: &str,
        picture: &Picture<'_>,
        stopped: &dyn Fn() -> bool,
    ) -> Result<ImageF32, EditorError> {
        let Picture { view, original, current } = *picture;
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
                .replace("{prompt}", prompt)
        };
        let words: Vec<String> = self.words.iter().map(filled).collect();
        let errors = at("errors.txt");
        let status = self.run(&words, &errors, stopped)?;
        if !status.success() {
            let said = last_line(&errors).unwrap_or_else(|| "it said nothing".into());
            let (view, status) = (view.to_owned(), status.to_string());
            return Err(EditorError::Failed { view, status, said });
        }
        if !at("output.png").exists() {
            return Err(EditorError::NoPicture { view: view.to_owned() });
        }
        let image = read_image(&at("output.png"))?;
        let (width, height) = (image.width, image.height);
        if (width, height) != (original.width, original.height) {
            return Err(EditorError::Size { view: view.to_owned(), width, height });
        }
        Ok(rgb(&image))
    }

    /// Runs the program to its end, or until the user asks to stop. What it says goes to the file `errors`.
    fn run(
        &self,
        words: &[String],
        errors: &Path,
        stopped: &dyn Fn() -> bool,
    ) -> Result<ExitStatus, EditorError> {
        let io = |source| FormatError::io(errors, source);
        let start = |source| EditorError::Start { program: words[0].clone(), source };
        let mut command = Command::new(&words[0]);
        command
            .args(&words[1..])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(errors).map_err(io)?);
        // A group of its own, so that what it starts can be ended with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(start)?;
        loop {
            let ended = child.try_wait().map_err(start)?;
            if stopped() {
                end_group(&mut child);
                return Err(EditorError::Stopped);
            }
            match ended {
                Some(status) => return Ok(status),
                None => std::thread::sleep(POLL),
            }
        }
    }
}

/// The last line with words of a file, of which only the end is read: a program may have said a lot.
fn last_line(path: &Path) -> Option<String> {
    let mut file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(KEPT_BYTES))).ok()?;
    let mut bytes = Vec::new();
    file.take(KEPT_BYTES).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let line = text.lines().rfind(|line| !line.trim().is_empty())?;
    Some(line.trim().chars().take(200).collect())
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn words_are_split_outside_of_quotes() {
        let words = |text: &str| Editor::new(text).map(|e| e.words);
        assert_eq!(words("a  'b c' d\"e f\" ''").unwrap(), ["a", "b c", "de f", ""]);
        assert!(words("a 'b").is_err() && words("  ").is_err());
    }

    #[test]
    fn a_copy_changes_nothing_and_failures_are_told() {
        let image = ImageF32::filled(6, 4, 3, 0.5);
        let picture = Picture { view: "a", original: &image, current: &image };
        let copy = Editor::new("cp {input} {output}").unwrap();
        let edited = copy.edit_one("", &picture, &|| false).unwrap();
        assert!(edited.data.iter().all(|v| (v - 0.5).abs() < 3e-3));
        for (command, says) in [
            ("no-such-program-here {input} {output}", "cannot start no-such-program-here"),
            (
                "sh -c 'echo no light >&2; exit 3' {input} {output}",
                "failed on a (exit status: 3): no light",
            ),
            ("true {input} {output}", "wrote no picture for a"),
        ] {
            let editor = Editor::new(command).unwrap();
            let error = editor.edit_one("", &picture, &|| false).unwrap_err();
            assert!(error.to_string().contains(says), "{command}: {error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn an_interruption_ends_the_program_and_what_it_started() {
        let image = ImageF32::filled(6, 4, 3, 0.5);
        let dir = tempfile::tempdir().unwrap();
        let late = dir.path().join("late");
        let command = format!("sh -c 'sleep 3; touch {}; sleep 60' {{input}}", late.display());
        let started = Instant::now();
        let stopped = || started.elapsed() > Duration::from_millis(300);
        let picture = Picture { view: "a", original: &image, current: &image };
        let error = Editor::new(&command).unwrap().edit_one("", &picture, &stopped);
        assert!(matches!(error, Err(EditorError::Stopped)));
        assert!(started.elapsed() < Duration::from_secs(10));
        std::thread::sleep(Duration::from_millis(3200));
        assert!(!late.exists(), "it goes on after its end");
    }
}
