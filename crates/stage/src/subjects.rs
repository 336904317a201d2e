//! A program with several subjects, each with its own arguments: `report lab …`, `report relight …`.

use std::ffi::OsString;
use std::fmt::Display;
use std::process::ExitCode;

use clap::{Command, Parser};
use serde::Serialize;

use crate::run::{as_program, clap_message, command, guarded, print_or_fail, session};
use crate::{Context, ExitStatus, HasCommon, generate};

type Main = Box<dyn Fn(&[OsString], &str) -> ExitStatus>;

/// The subjects of a program, in the order of its help.
pub struct Subjects {
    name: &'static str,
    about: &'static str,
    all: Vec<(&'static str, Command, Main)>,
}

impl Subjects {
    /// A program of this name; `about` is its summary in one line.
    pub fn new(name: &'static str, about: &'static str) -> Self {
        Self { name, about, all: Vec::new() }
    }

    /// Adds a subject. `#[command(name = "...")]` of `A` must be `PROGRAM SUBJECT`.
    #[must_use]
    pub fn with<A, R>(
        mut self,
        subject: &'static str,
        run: fn(&A, &Context) -> anyhow::Result<R>,
    ) -> Self
    where
        A: Parser + Serialize + HasCommon + 'static,
        R: Serialize + Display + 'static,
    {
        let main = move |arguments: &[OsString], program: &str| session(arguments, program, run);
        let program = format!("motes {} {subject}", self.name);
        self.all.push((subject, command::<A>(&program).name(subject), Box::new(main)));
        self
    }

    /// Runs the subject that the first argument names, as [`crate::main`] runs a stage.
    pub fn main(self) -> ExitCode {
        let arguments: Vec<OsString> = std::env::args_os().collect();
        let program = format!("motes {}", self.name);
        guarded(program.clone(), || self.dispatch(&arguments, &program)).into()
    }

    fn dispatch(self, arguments: &[OsString], program: &str) -> ExitStatus {
        let first = arguments.get(1).and_then(|argument| argument.to_str());
        let chosen = self.all.iter().find(|(subject, ..)| Some(*subject) == first);
        if let Some((subject, _, main)) = chosen {
            // The usage line takes its name from the first word.
            let name = OsString::from(format!("{} {subject}", self.name));
            let words: Vec<OsString> =
                std::iter::once(name).chain(arguments[2..].iter().cloned()).collect();
            return main(&words, &format!("{program} {subject}"));
        }
        if first == Some("--summary") {
            return print_or_fail(program, &format!("{}\n", self.about));
        }
        let own = as_program(Command::new(self.name), program).about(self.about);
        let own = own
            .subcommand_required(true)
            .arg_required_else_help(true)
            .subcommands(self.all.into_iter().map(|(_, command, _)| command));
        if let Some(what) = generate::requested(arguments) {
            let text = generate::text(what, own).unwrap_or_default();
            return print_or_fail(program, &text);
        }
        match own.try_get_matches_from(arguments) {
            // A subject would have been found above.
            Ok(_) => ExitStatus::Failed,
            Err(error) => clap_message(program, &error),
        }
    }
}
