//! Inputs that come first on the line need no flag: `render gaussians.ply`, `train-splat capture/`, `edit scene/`; and a folder
//! stands for the capture in it, there as behind `--capture`.
//!
//! What a file is decides which flag it stands for. Only words in front of the first flag count: behind a flag a word may be
//! its value.

use std::ffi::{OsStr, OsString};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, TypedValueParser as _};
use clap::{Arg, Command};
use motes_formats::decomposition::DECOMPOSITION_FILE;
use motes_formats::standard_stream::is_standard_stream;

/// The document in a folder that `import-colmap` wrote.
const CAPTURE: &str = "capture.json";
/// Bytes of a document in which its key `format` stands.
const OPENING_BYTES: u64 = 4096;

/// The flags that inputs may stand for, with what stands in the help.
const FLAGS: [(&str, &str); 5] = [
    ("capture", "a capture"),
    ("scene", "a scene folder"),
    ("gaussians", "Gaussians"),
    ("selection", "a selection"),
    ("plan", "an edit plan"),
];

/// The line with the flags of the inputs in front. A command that has positional arguments of its own keeps its line.
pub(crate) fn with_flags(command: &Command, arguments: &[OsString]) -> Vec<OsString> {
    if command.get_positionals().next().is_some() || arguments.is_empty() {
        return arguments.to_vec();
    }
    let mut line = vec![arguments[0].clone()];
    let mut rest = arguments[1..].iter();
    let mut given: Vec<&str> = Vec::new();
    while let Some(word) = rest.as_slice().first().filter(|word| is_input(word)) {
        let Some((flag, path)) = meaning(command, Path::new(word), &given) else { break };
        line.extend([OsString::from(format!("--{flag}")), path.into_os_string()]);
        given.push(flag);
        rest.next();
    }
    line.extend(rest.cloned());
    line
}

/// The command, whose `--capture` takes the folder of a capture for the document in it.
pub(crate) fn with_capture_folders(command: Command) -> Command {
    if !has(&command, "capture") {
        return command;
    }
    let document = |path: PathBuf| match path.join(CAPTURE) {
        inside if inside.is_file() => inside,
        _ => path,
    };
    command.mut_arg("capture", |flag| flag.value_parser(PathBufValueParser::new().map(document)))
}

/// A line of the help about inputs that need no flag; empty where none may.
pub(crate) fn help(command: &Command) -> String {
    let first = command.get_positionals().next();
    let known: Vec<&str> =
        FLAGS.iter().filter(|(flag, _)| has(command, flag)).map(|(_, what)| *what).collect();
    match (first, known.split_last()) {
        (None, Some((last, []))) => format!("{}\n", sentence(last)),
        (None, Some((last, others))) => {
            format!("{}\n", sentence(&format!("{} and {last}", others.join(", "))))
        }
        _ => String::new(),
    }
}

fn sentence(what: &str) -> String {
    let mut letters = what.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    format!("{first}{} may come first, without a flag.", letters.as_str())
}

/// A word that is no flag; `-` is standard input.
fn is_input(word: &OsStr) -> bool {
    is_standard_stream(Path::new(word))
        || !word.is_empty() && !word.to_string_lossy().starts_with('-')
}

fn has(command: &Command, flag: &str) -> bool {
    command.get_arguments().any(|argument: &Arg| argument.get_long() == Some(flag))
}

/// The flag that a file or folder stands for, and the path that it takes.
fn meaning(command: &Command, path: &Path, given: &[&str]) -> Option<(&'static str, PathBuf)> {
    let inside = |name: &str| path.join(name).is_file();
    let (kind, path) = match path.is_dir() {
        true if inside(DECOMPOSITION_FILE) => ("scene", path.to_owned()),
        true if inside(CAPTURE) => ("capture", path.join(CAPTURE)),
        true => ("scene", path.to_owned()),
        false => match format_of(path).as_deref() {
            Some("motes/capture") => ("capture", path.to_owned()),
            Some("motes/selection") => ("selection", path.to_owned()),
            Some("motes/edit-plan") => ("plan", path.to_owned()),
            Some("motes/decomposition") => ("scene", path.parent()?.to_owned()),
            Some(_) => return None,
            None if has(command, "gaussians") => ("gaussians", path.to_owned()),
            None => ("capture", path.to_owned()),
        },
    };
    let (flag, _) = FLAGS.iter().find(|(flag, _)| *flag == kind)?;
    (has(command, flag) && !given.contains(flag)).then_some((flag, path))
}

/// The key `format` of a JSON document; none for other files.
fn format_of(path: &Path) -> Option<String> {
    if !path.extension()?.eq_ignore_ascii_case("json") {
        return None;
    }
    let mut opening = Vec::new();
    // Not a pipe: what is read here is gone.
    let file = std::fs::File::open(path).ok().filter(|_| path.is_file())?;
    file.take(OPENING_BYTES).read_to_end(&mut opening).ok()?;
    let text = String::from_utf8_lossy(&opening);
    let value = text.split_once("\"format\"")?.1.trim_start().strip_prefix(':')?;
    Some(value.trim_start().strip_prefix('"')?.split('"').next()?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage() -> Command {
        let flag = |name: &'static str| Arg::new(name).long(name).num_args(1);
        Command::new("render").args(["gaussians", "scene", "capture", "output"].map(flag))
    }

    fn line(words: &[&str]) -> Vec<String> {
        let words: Vec<OsString> = words.iter().map(OsString::from).collect();
        let line = with_flags(&stage(), &words);
        line.into_iter().map(|word| word.into_string().unwrap()).collect()
    }

    #[test]
    fn a_folder_behind_the_flag_is_the_capture_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_str().unwrap();
        let read = |path: &str| {
            let found =
                with_capture_folders(stage()).get_matches_from(["render", "--capture", path]);
            found.get_one::<PathBuf>("capture").unwrap().clone()
        };
        assert_eq!(read(path), folder.path());
        std::fs::write(folder.path().join(CAPTURE), "{}").unwrap();
        assert_eq!(read(path), folder.path().join(CAPTURE));
        assert_eq!(read("other.json"), Path::new("other.json"));
    }

    #[test]
    fn what_a_file_is_decides_its_flag() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let capture = r#"{"format": "motes/capture", "version": "1.0"}"#;
        std::fs::create_dir(at("c")).unwrap();
        std::fs::create_dir(at("s")).unwrap();
        std::fs::write(at("c/capture.json"), capture).unwrap();
        std::fs::write(at("other.json"), capture).unwrap();
        std::fs::write(at("s/decomposition.json"), r#"{"format":"motes/decomposition"}"#).unwrap();
        std::fs::write(at("g.ply"), "ply").unwrap();
        assert_eq!(
            line(&["render", &at("g.ply"), &at("c"), "--output", "x"]),
            [
                "render",
                "--gaussians",
                &at("g.ply"),
                "--capture",
                &at("c/capture.json"),
                "--output",
                "x"
            ]
        );
        assert_eq!(line(&["render", &at("other.json")])[1], "--capture");
        assert_eq!(line(&["render", &at("s")]), ["render", "--scene", &at("s")]);
        assert_eq!(line(&["render", &at("s/decomposition.json")])[2], at("s"));
    }

    #[test]
    fn words_behind_a_flag_and_second_ones_of_a_kind_stay() {
        assert_eq!(
            line(&["render", "--output", "x", "g.ply"]),
            ["render", "--output", "x", "g.ply"]
        );
        assert_eq!(
            line(&["render", "a.ply", "b.ply"]),
            ["render", "--gaussians", "a.ply", "b.ply"],
            "the parser names the second"
        );
        let own = Command::new("export").arg(Arg::new("inputs").num_args(0..));
        let words: Vec<OsString> = ["export", "a.ply"].iter().map(OsString::from).collect();
        assert_eq!(with_flags(&own, &words), words);
        assert_eq!(help(&own), "");
    }

    #[test]
    fn the_help_names_what_may_come_first() {
        assert_eq!(
            help(&stage()),
            "A capture, a scene folder and Gaussians may come first, without a flag.\n"
        );
    }
}
