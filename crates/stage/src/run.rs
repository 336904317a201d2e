//! The life of a stage, from arguments to exit code.

use std::any::Any;
use std::ffi::OsString;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::LazyLock;

use clap::Parser;
use serde::Serialize;
use serde_json::{Value, json};

use crate::config::Merged;
use crate::context::DryRun;
use crate::error::{Explanation, explain, status_of};
use crate::{
    CommonArgs, Context, ExitStatus, HasCommon, ProgressMode, StageError, config, generate, habits,
    interrupt, leading_inputs, log, memory, panics, provenance, revision, stdout,
};

/// Set by the dispatcher, so that usage lines show what the user typed.
pub const INVOKED_AS_VARIABLE: &str = "MOTES_INVOKED_AS";

/// `0.1.0`, or `0.1.0 (commit)`.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    revision::git().map_or_else(|| version.to_owned(), |commit| format!("{version} ({commit})"))
});

/// Runs a stage: parses arguments, prepares logging, threads and interruption, calls `run`,
/// prints its report, writes the run record, and turns errors and panics into exit codes.
///
/// `#[command(name = "...")]` of `A` must be the stage's name.
pub fn main<A, R>(run: fn(&A, &Context) -> anyhow::Result<R>) -> ExitCode
where
    A: Parser + Serialize + HasCommon,
    R: Serialize + Display,
{
    let arguments: Vec<OsString> = std::env::args_os().collect();
    let name = A::command().get_name().to_owned();
    let program = format!("motes {name}");
    guarded(program.clone(), || session(&arguments, &program, run)).into()
}

/// What `work` returns; a panic is said in one line and is a failure.
pub(crate) fn guarded(program: String, work: impl FnOnce() -> ExitStatus) -> ExitStatus {
    panics::install(program);
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload: Box<dyn Any + Send>| {
        // The hook has spoken already. Dropping a payload may panic too.
        std::mem::forget(payload);
        ExitStatus::Failed
    })
}

/// [`main`] for a stage that reads a document of its own: `--print-schema` anywhere on the line prints its JSON Schema.
pub fn main_with_schema<A, R>(
    run: fn(&A, &Context) -> anyhow::Result<R>,
    schema: fn() -> String,
) -> ExitCode
where
    A: Parser + Serialize + HasCommon,
    R: Serialize + Display,
{
    if std::env::args_os().skip(1).any(|argument| argument == "--print-schema") {
        let program = format!("motes {}", A::command().get_name());
        return print_or_fail(&program, &schema()).into();
    }
    main(run)
}

pub(crate) fn command<A: Parser + HasCommon>(program: &str) -> clap::Command {
    let command = crate::help_order::experts_last(A::command());
    let mut command = leading_inputs::with_capture_folders(command);
    let first = leading_inputs::help(&command);
    if !first.is_empty() {
        let rest = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        command = command.after_help(format!("{first}\n{rest}"));
    }
    crate::short_help::shorten(as_program(command, program), A::BASIC)
}

/// The command with our version, under the name that the user typed.
pub(crate) fn as_program(command: clap::Command, program: &str) -> clap::Command {
    let command = command.version(VERSION.as_str()).max_term_width(100);
    // Only our own dispatcher's name is believed: the variable is inherited by child processes.
    let rest = |typed: &str| program.strip_prefix(typed).map(str::to_owned);
    match std::env::var(INVOKED_AS_VARIABLE).ok().and_then(|typed| rest(&typed)) {
        Some(subject) if subject.is_empty() || subject.starts_with(' ') => {
            command.bin_name(program)
        }
        _ => command,
    }
}

pub(crate) fn session<A, R>(
    arguments: &[OsString],
    program: &str,
    run: fn(&A, &Context) -> anyhow::Result<R>,
) -> ExitStatus
where
    A: Parser + Serialize + HasCommon,
    R: Serialize + Display,
{
    if let Some(odd) = arguments.iter().find(|argument| argument.to_str().is_none()) {
        // Found now, not when the product is there and its report cannot be written.
        let text = format!("reports cannot name what is not UTF-8: {}", odd.to_string_lossy());
        let error = StageError::usage(text).help("rename the file, or give a link to it");
        return fail(program, &error.into());
    }
    let (args, from_config) = match parse::<A>(arguments, program) {
        Ok(Parsed::Run(args, from_config)) => (args, from_config),
        Ok(Parsed::Print(text)) => return print_or_fail(program, &text),
        Ok(Parsed::Clap(error)) => return clap_message(program, &error),
        Err(error) => return fail(program, &error),
    };
    let common = args.common().clone();
    if let Err(error) = prepare(&common, program) {
        return fail(program, &error);
    }
    let mut context = Context::new(program.to_owned(), common);
    context.from_config = from_config;
    match run(&args, &context) {
        Ok(report) => finish(&args, &report, &context, arguments),
        Err(error) if error.is::<DryRun>() => {
            let report = error.downcast::<DryRun>().ok().and_then(|done| done.report);
            dry_run_done(&context, report)
        }
        Err(_) if stdout::reader_is_gone() => ExitStatus::Done,
        Err(error) => {
            context.remove_empty_folders();
            fail(program, &error)
        }
    }
}

enum Parsed<A> {
    /// Arguments, and the ids of those that a config file set.
    Run(A, Vec<String>),
    Print(String),
    Clap(clap::Error),
}

fn parse<A>(arguments: &[OsString], program: &str) -> anyhow::Result<Parsed<A>>
where
    A: Parser + Serialize + HasCommon,
{
    let command = command::<A>(program);
    if arguments.get(1).is_some_and(|a| a == "--summary") {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        return Ok(Parsed::Print(about + "\n"));
    }
    if let Some(what) = generate::requested(arguments) {
        return Ok(Parsed::Print(generate::text(what, command)?));
    }
    let line = habits::spelled(&command, arguments, A::HABITS);
    let line = leading_inputs::with_flags(&command, &line);
    let merged = match config::config_path(&line) {
        Some(path) => config::merged(&command, &line, &path)?,
        None => Merged { line, from_config: Vec::new() },
    };
    let line = config::with_preset(&command, merged.line, A::PRESETS);
    let parsed = command.try_get_matches_from(line).and_then(|mut matches| {
        A::from_arg_matches_mut(&mut matches)
            .map_err(|e| e.format(&mut self::command::<A>(program)))
    });
    let args = match parsed {
        Ok(args) => args,
        Err(error) => return Ok(Parsed::Clap(error)),
    };
    if args.common().dump_config {
        return Ok(Parsed::Print(serde_json::to_string_pretty(&args)? + "\n"));
    }
    if let Some(what) = args.common().generate {
        return Ok(Parsed::Print(generate::text(what, self::command::<A>(program))?));
    }
    Ok(Parsed::Run(args, merged.from_config))
}

fn prepare(common: &CommonArgs, program: &str) -> anyhow::Result<()> {
    log::emit_events(common.progress == ProgressMode::Json);
    log::install(common, program)?;
    interrupt::install(program.to_owned());
    let limit = common.max_memory.or_else(memory::available_bytes);
    if let Some(limit) = limit {
        motes_formats::budget::limit_memory(limit);
    }
    let threads = threads_to_use(common.threads);
    if threads < common.threads {
        let text = format!(
            "--threads {}: this machine runs {threads} at a time, and so many are used",
            common.threads
        );
        tracing::warn!("{text}");
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| anyhow::anyhow!("cannot start {threads} worker threads ({e})"))
}

/// More threads than cores make nothing faster; thousands of them take all memory for their stacks.
fn threads_to_use(asked: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    if asked == 0 { cores } else { asked.min(cores) }
}

fn finish<A: Serialize, R: Serialize + Display>(
    args: &A,
    report: &R,
    context: &Context,
    arguments: &[OsString],
) -> ExitStatus {
    let program = &context.program;
    if let Some(error) = stdout::failure() {
        return fail(program, &lost_output(&error));
    }
    if !context.common.no_provenance
        && let Err(error) = provenance::write(context, arguments, args, report)
    {
        return fail(program, &error);
    }
    if let Err(status) = show(report, context) {
        return status;
    }
    match context.missed_gates() {
        None => ExitStatus::Done,
        Some(gate) => {
            say(program, &gate);
            ExitStatus::GateNotMet
        }
    }
}

/// Report to stdout as JSON, to stderr as an event or as text.
fn show<R: Serialize + Display>(report: &R, context: &Context) -> Result<(), ExitStatus> {
    let text = serde_json::to_string(report)
        .map_err(|error| fail(&context.program, &anyhow::Error::from(error)))?;
    if context.common.json {
        match print_or_fail(&context.program, &format!("{text}\n")) {
            ExitStatus::Done => {}
            status => return Err(status),
        }
    }
    if context.common.progress == ProgressMode::Json {
        let report: Value = serde_json::from_str(&text).unwrap_or(Value::Null);
        log::event(&json!({ "event": "report", "report": report }));
    } else if !context.common.quiet && !context.common.json {
        let text = report.to_string();
        if !text.is_empty() {
            log::print(text.trim_end());
        }
    }
    Ok(())
}

fn dry_run_done(context: &Context, report: Option<(String, Value)>) -> ExitStatus {
    let outputs = context.lock().outputs.clone();
    if context.common.json {
        let outputs: Vec<_> = outputs.iter().map(|path| path.to_string_lossy()).collect();
        let mut plan: Value = json!({ "dry_run": true, "outputs": outputs });
        if let Some((_, report)) = report {
            plan["report"] = report;
        }
        return print_or_fail(&context.program, &format!("{plan}\n"));
    }
    if let Some((text, _)) = report
        && !context.common.quiet
    {
        log::print(text.trim_end());
    }
    for path in outputs {
        log::print(&format!("{}: would write {}", context.program, path.display()));
    }
    ExitStatus::Done
}

pub(crate) fn print_or_fail(program: &str, text: &str) -> ExitStatus {
    match stdout::print(text) {
        Err(error) if !stdout::reader_is_gone() => fail(program, &lost_output(&error)),
        _ => ExitStatus::Done,
    }
}

fn lost_output(error: &dyn Display) -> anyhow::Error {
    anyhow::anyhow!("cannot write to standard output ({error})")
}

fn fail(program: &str, error: &anyhow::Error) -> ExitStatus {
    say(program, &explain(error));
    status_of(error)
}

/// What a terminal shows of a message: its input may be quoted in it, however long that is.
fn shortened(text: &str) -> String {
    const MOST: usize = 1500;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

fn say(program: &str, explanation: &Explanation) {
    let Explanation { text, help } = explanation;
    let text = shortened(text);
    let help = help.as_ref().map(|help| format!("\nhelp: {}", shortened(help))).unwrap_or_default();
    log::print(&format!("{program}: {text}{help}"));
}

/// Help and version go to stdout; a wrong command line is said in the voice of the stage.
pub(crate) fn clap_message(program: &str, error: &clap::Error) -> ExitStatus {
    let text = error.render();
    if !error.use_stderr() {
        return print_or_fail(program, &text.to_string());
    }
    let text = text.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text).trim_end();
    say(program, &Explanation { text: text.to_owned(), help: None });
    StageError::usage("").status()
}
