//! What a command line of `motes` asks for.

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;
use std::process::{Command, ExitCode};

use crate::find::Finder;
use crate::{catalog, completions};

const USAGE: &str = "\
motes - from photos to Gaussian splats, one small program per step

Usage: motes STAGE [OPTIONS]      run a stage
       motes help [STAGE]         this text, or the manual of a stage
       motes which STAGE          print the path of the program that would run
       motes list                 print the names of the stages, one per line
       motes completions SHELL    print completions for bash, zsh or fish
";

const FAILED: u8 = 1;
const USAGE_ERROR: u8 = 2;

/// Runs what the arguments after the program name ask for.
pub(crate) fn run(mut arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let verb = arguments.next();
    let rest: Vec<OsString> = arguments.collect();
    let finder = Finder::from_environment();
    let verb = verb.as_deref().map(|v| v.to_string_lossy().into_owned());
    match (verb.as_deref(), rest.as_slice()) {
        (None | Some("help" | "--help" | "-h"), []) => print(&overview(&finder)),
        (Some("--version" | "-V"), []) => print(&format!("motes {}\n", env!("CARGO_PKG_VERSION"))),
        (Some("list"), []) => print(
            &catalog::available(&finder).into_iter().map(|s| s.name + "\n").collect::<String>(),
        ),
        (Some("help"), [stage]) => match locate(&finder, &stage.to_string_lossy()) {
            Ok(path) => become_stage(&path, &stage.to_string_lossy(), &["--help".into()]),
            Err(code) => code,
        },
        (Some("which"), [stage]) => match locate(&finder, &stage.to_string_lossy()) {
            Ok(path) => print(&format!("{}\n", path.display())),
            Err(code) => code,
        },
        (Some("completions"), [shell]) => {
            match completions::script(&finder, &shell.to_string_lossy()) {
                Some(script) => print(&script),
                None => {
                    complain(
                        "completions are for bash, zsh or fish",
                        Some("motes completions bash"),
                    );
                    ExitCode::from(USAGE_ERROR)
                }
            }
        }
        (Some("help" | "which" | "list" | "completions"), _) => {
            complain("too many or too few arguments", Some("motes help"));
            ExitCode::from(USAGE_ERROR)
        }
        (Some(stage), rest) => run_stage(&finder, stage, rest),
        (None, _) => ExitCode::from(USAGE_ERROR),
    }
}

/// Becomes the stage; a stage that was renamed is found under its earlier name, too, unless a
/// program of that name exists.
fn run_stage(finder: &Finder, stage: &str, rest: &[OsString]) -> ExitCode {
    if finder.find(stage).is_none()
        && let Some((now, subject)) = catalog::renamed(stage)
        && let Some(path) = finder.find(now)
    {
        let mut arguments = vec![OsString::from(subject)];
        arguments.extend_from_slice(rest);
        return become_stage(&path, now, &arguments);
    }
    match locate(finder, stage) {
        Ok(path) => become_stage(&path, stage, rest),
        Err(code) => code,
    }
}

fn locate(finder: &Finder, stage: &str) -> Result<std::path::PathBuf, ExitCode> {
    if let Some(path) = finder.find(stage) {
        return Ok(path);
    }
    let stages = catalog::available(finder);
    let nearest = catalog::nearest(stage, &stages);
    let help =
        nearest.map_or("motes help".to_owned(), |name| format!("did you mean motes {name}?"));
    let what = if stage.starts_with('-') { "option" } else { "stage" };
    complain(&format!("there is no {what} \"{stage}\""), Some(&help));
    Err(ExitCode::from(USAGE_ERROR))
}

/// Runs the stage in place of this process, so that signals and the exit code are its own.
fn become_stage(path: &Path, stage: &str, arguments: &[OsString]) -> ExitCode {
    let mut command = Command::new(path);
    command.args(arguments).env("MOTES_INVOKED_AS", format!("motes {stage}"));
    replace_process(&mut command).unwrap_or_else(|error| {
        complain(&format!("cannot run {stage} ({error}): {}", path.display()), None);
        ExitCode::from(FAILED)
    })
}

#[cfg(unix)]
fn replace_process(command: &mut Command) -> io::Result<ExitCode> {
    use std::os::unix::process::CommandExt as _;
    Err(command.exec())
}

#[cfg(not(unix))]
fn replace_process(command: &mut Command) -> io::Result<ExitCode> {
    let code = command.status()?.code().unwrap_or(i32::from(FAILED));
    Ok(ExitCode::from(u8::try_from(code).unwrap_or(FAILED)))
}

fn overview(finder: &Finder) -> String {
    let stages = catalog::available(finder);
    let mut text = USAGE.to_owned();
    let width = stages.iter().map(|stage| stage.name.len()).max().unwrap_or(0).max(16);
    for group in catalog::GROUPS {
        let members: Vec<_> = stages.iter().filter(|stage| stage.group == *group).collect();
        if members.is_empty() {
            continue;
        }
        text.push_str(&format!("\n{group}\n"));
        for stage in members {
            let summary = finder.find(&stage.name).and_then(|path| summary(&path));
            text.push_str(
                format!("  {:width$} {}", stage.name, summary.unwrap_or_default()).trim_end(),
            );
            text.push('\n');
        }
    }
    text
}

/// The one line that a stage says about itself.
fn summary(path: &Path) -> Option<String> {
    let output = Command::new(path).arg("--summary").stdin(std::process::Stdio::null()).output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).lines().next()?.to_owned())
}

fn print(text: &str) -> ExitCode {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => ExitCode::from(FAILED),
        _ => ExitCode::SUCCESS,
    }
}

fn complain(text: &str, help: Option<&str>) {
    let help = help.map(|help| format!("help: {help}\n")).unwrap_or_default();
    let _ = io::stderr().write_all(format!("motes: {text}\n{help}").as_bytes());
}
