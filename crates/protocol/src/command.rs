//! The command line of a provider, and where its program lies.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::ProviderError;

/// Characters of a command line that messages quote.
const MOST_QUOTED: usize = 100;

/// A program and its first arguments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProviderCommand {
    /// What the user typed, for messages.
    pub name: String,
    pub(crate) program: PathBuf,
    pub(crate) arguments: Vec<String>,
}

impl ProviderCommand {
    /// The program that a command line names. A first word without `/` is first looked for as `motes-provider-WORD`: in the folders
    /// of `MOTES_STAGE_PATH`, beside this program, in `../libexec/motes` and on `PATH`; then as a program of that name on `PATH`.
    ///
    /// # Errors
    /// A quote is not closed, there is no word, or no such program.
    pub fn new(command: &str) -> Result<Self, ProviderError> {
        let words = split_words(command).ok_or_else(|| ProviderError::Words(command.to_owned()))?;
        let mut words = words.into_iter();
        let first = words.next().ok_or_else(|| ProviderError::Words(command.to_owned()))?;
        let program = find(&first).ok_or_else(|| ProviderError::NotFound(first.clone()))?;
        let name = match command.trim().char_indices().nth(MOST_QUOTED) {
            Some((end, _)) => format!("{}…", &command.trim()[..end]),
            None => command.trim().to_owned(),
        };
        Ok(Self { name, program, arguments: words.collect() })
    }

    /// Of a program whose place is known.
    pub fn of_program(program: &Path, arguments: &[String]) -> Self {
        let name = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy();
        Self { name: name.into(), program: program.into(), arguments: arguments.into() }
    }

    /// The same with more arguments.
    #[must_use]
    pub fn with_arguments(mut self, more: impl IntoIterator<Item = String>) -> Self {
        self.arguments.extend(more);
        self
    }

    pub(crate) fn to_command(&self, more: &[&OsStr]) -> std::process::Command {
        let mut command = std::process::Command::new(&self.program);
        command.args(&self.arguments).args(more);
        command
    }
}

/// Splits a command line at white space, outside of `'...'` and `"..."`; no shell is involved. None when a quote is not closed.
pub fn split_words(command: &str) -> Option<Vec<String>> {
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
    quote.is_none().then_some(words)
}

/// The program of a stage: NAME in a folder of `MOTES_STAGE_PATH`, beside this program or in `../libexec/motes`, else `motes-NAME` on
/// `PATH`, as `motes NAME` finds it.
pub fn stage_program(name: &str) -> Option<PathBuf> {
    let suffix = std::env::consts::EXE_SUFFIX;
    let plain = stage_folders().map(|folder| folder.join(format!("{name}{suffix}")));
    let prefixed = listed("PATH").into_iter();
    let prefixed = prefixed.map(|folder| folder.join(format!("motes-{name}{suffix}")));
    plain.chain(prefixed).find(|candidate| is_program(candidate))
}

fn listed(variable: &str) -> Vec<PathBuf> {
    let value = std::env::var_os(variable).unwrap_or_default();
    std::env::split_paths(&value).filter(|folder| !folder.as_os_str().is_empty()).collect()
}

/// Folders of programs of this house.
fn stage_folders() -> impl Iterator<Item = PathBuf> {
    let here = std::env::current_exe().and_then(|exe| exe.canonicalize()).ok();
    let here = here.as_deref().and_then(Path::parent);
    let beside = here.map(|here| [here.to_owned(), here.join("../libexec/motes")]);
    listed("MOTES_STAGE_PATH").into_iter().chain(beside.into_iter().flatten())
}

fn find(first: &str) -> Option<PathBuf> {
    if first.contains('/') {
        let path = PathBuf::from(first);
        return is_program(&path).then_some(path);
    }
    let ours = format!("motes-provider-{first}{}", std::env::consts::EXE_SUFFIX);
    let path = listed("PATH");
    let ours = stage_folders().chain(path.clone()).map(|folder| folder.join(&ours));
    let plain = format!("{first}{}", std::env::consts::EXE_SUFFIX);
    let plain = path.into_iter().map(|folder| folder.join(&plain));
    let candidates: Vec<PathBuf> = ours.chain(plain).collect();
    candidates.into_iter().find(|candidate| is_program(candidate))
}

fn is_program(path: &Path) -> bool {
    let Ok(meta) = std::fs::metadata(path) else { return false };
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        meta.is_file() && meta.permissions().mode() & 0o111 != 0
    }
    #[cfg(not(unix))]
    meta.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_outside_of_quotes() {
        let words = |text: &str| split_words(text);
        assert_eq!(words("a  'b c' d\"e f\" ''").unwrap(), ["a", "b c", "de f", ""]);
        assert_eq!(words("a 'b"), None);
        assert!(matches!(ProviderCommand::new("  "), Err(ProviderError::Words(_))));
        assert!(matches!(ProviderCommand::new("a 'b"), Err(ProviderError::Words(_))));
    }

    #[test]
    fn nothing_is_given_to_a_shell() {
        let command = ProviderCommand::new("true ; touch x $(touch y) | z").unwrap();
        assert_eq!(command.arguments, [";", "touch", "x", "$(touch", "y)", "|", "z"]);
        assert!(matches!(
            ProviderCommand::new("no-such-program-here x"),
            Err(ProviderError::NotFound(_))
        ));
    }
}
