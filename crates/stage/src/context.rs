//! What a stage asks of its surroundings while it runs.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime};

use motes_formats::atomic;
use motes_formats::run_record::RunInput;
use motes_formats::standard_stream::is_standard_stream;

use crate::error::Explanation;
use crate::progress::Display;
use crate::stdout::Stdout;
use crate::{CommonArgs, Progress, StageError, fingerprint, interrupt};

/// Ends of names that promise another format than JSON.
const OTHER_THAN_JSON: [&str; 9] =
    ["csv", "tsv", "md", "html", "htm", "tex", "yaml", "toml", "xlsx"];

/// Handed to a stage's `run`: outputs, inputs, progress, interruption.
#[derive(Debug)]
pub struct Context {
    pub(crate) program: String,
    pub(crate) common: CommonArgs,
    /// Ids of the options that `--config` set.
    pub(crate) from_config: Vec<String>,
    pub(crate) started: SystemTime,
    pub(crate) clock: Instant,
    pub(crate) state: Mutex<State>,
}

#[derive(Debug, Default)]
pub(crate) struct State {
    pub(crate) inputs: Vec<RunInput>,
    pub(crate) outputs: Vec<PathBuf>,
    /// Inputs and what will be replaced, by full path: nothing may be both.
    read: Vec<PathBuf>,
    replaced: Vec<PathBuf>,
    pub(crate) warnings: Vec<String>,
    pub(crate) gates_missed: Vec<String>,
    /// Folders that were not there before, outermost first.
    made_folders: Vec<PathBuf>,
}

/// Returned by [`Context::stop_if_dry_run`]; ends the stage with exit code 0.
#[derive(Debug, Default, thiserror::Error)]
#[error("dry run: nothing was done")]
pub(crate) struct DryRun {
    /// What would come of it, as text and as JSON.
    pub(crate) report: Option<(String, serde_json::Value)>,
}

impl Context {
    pub(crate) fn new(program: String, common: CommonArgs) -> Self {
        let (started, clock) = (SystemTime::now(), Instant::now());
        let from_config = Vec::new();
        Self { program, common, from_config, started, clock, state: Mutex::default() }
    }

    /// A context for tests and tools that call a stage's library code without [`crate::main`]:
    /// quiet, replaces outputs, writes no run record.
    pub fn quiet(program: &str) -> Self {
        let common = CommonArgs {
            quiet: true,
            overwrite: true,
            no_provenance: true,
            ..CommonArgs::default()
        };
        Self::new(program.to_owned(), common)
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Claims a path for an output before any work. Makes its folder (and takes it
    /// away again when the stage fails and left it empty); the first claimed path is the product
    /// that the run record lies beside. `-` is standard output and passes unchanged.
    ///
    /// # Errors
    /// [`StageError::Usage`] when something is there already (a file, or a folder that is not
    /// empty) and `--overwrite` was not given, when two outputs share a path, or when it is an
    /// input, too; an I/O error when the folder cannot be made or written to.
    pub fn output(&self, path: impl AsRef<Path>) -> anyhow::Result<PathBuf> {
        let path = path.as_ref();
        let shown = path.display();
        if self.lock().outputs.iter().any(|other| other == path) {
            return Err(
                StageError::usage(format!("two outputs have the same path: {shown}")).into()
            );
        }
        if is_standard_stream(path) {
            if self.common.json {
                let text = "standard output cannot hold both the report and the product: -";
                return Err(StageError::usage(text).help("give --output a file").into());
            }
        } else {
            self.guard(path)?;
            self.keeps_inputs(path)?;
            self.prepare_folder(path)?;
        }
        self.lock().outputs.push(path.to_owned());
        Ok(path.to_owned())
    }

    /// [`Context::output`] of a document that is JSON whatever it is called: a name that promises
    /// another format is refused.
    ///
    /// # Errors
    /// As [`Context::output`]; when the name ends like a table, a page or a text.
    pub fn json_output(&self, path: impl AsRef<Path>) -> anyhow::Result<PathBuf> {
        let path = path.as_ref();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if ending.is_some_and(|e| OTHER_THAN_JSON.contains(&e.as_str())) {
            let text = format!("this product is JSON, not what its name says: {}", path.display());
            return Err(StageError::usage(text).help("end the name in .json").into());
        }
        self.output(path)
    }

    /// Checks that the files of a folder that was claimed with [`Self::output`] replace no input.
    ///
    /// # Errors
    /// [`StageError::Usage`] when one does.
    pub fn output_files(&self, folder: &Path, files: &[&str]) -> Result<(), StageError> {
        files.iter().try_for_each(|file| self.keeps_inputs(&folder.join(file)))
    }

    fn keeps_inputs(&self, path: &Path) -> Result<(), StageError> {
        let Ok(full) = path.canonicalize() else { return Ok(()) };
        let mut state = self.lock();
        if state.read.contains(&full) && is_replaced(&full) {
            return Err(both(path));
        }
        state.replaced.push(full);
        Ok(())
    }

    fn guard(&self, path: &Path) -> Result<(), StageError> {
        let shown = path.display();
        if path.as_os_str().is_empty() {
            return Err(StageError::usage("the output path is empty"));
        }
        let taken = match std::fs::symlink_metadata(path) {
            Err(_) => false,
            Ok(meta) if meta.is_dir() => {
                atomic::remove_stale(path);
                std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some())
            }
            Ok(_) => true,
        };
        // A device (/dev/null, a pipe) is written through, not replaced.
        let is_special = std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir());
        if taken && !is_special && !self.common.overwrite {
            return Err(StageError::usage(format!("output exists already: {shown}"))
                .help("choose another path or pass --overwrite"));
        }
        if !taken && !self.common.overwrite {
            atomic::claim_free(path);
        }
        Ok(())
    }

    fn prepare_folder(&self, path: &Path) -> anyhow::Result<()> {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if self.common.dry_run || folder == Path::new("/dev") {
            return Ok(());
        }
        let shown = folder.display();
        let missing = |f: &&Path| !f.as_os_str().is_empty() && !f.exists();
        let made: Vec<&Path> = folder.ancestors().take_while(missing).collect();
        self.lock().made_folders.extend(made.iter().rev().map(PathBuf::from));
        std::fs::create_dir_all(folder)
            .map_err(|e| anyhow::anyhow!("cannot make the output folder ({e}): {shown}"))?;
        // Better now than after an hour of work.
        atomic::can_write_into(folder)
            .map_err(|e| anyhow::anyhow!("cannot write to the output folder ({e}): {shown}"))?;
        Ok(())
    }

    /// After a failure: removes the folders that [`Self::output`] made and nothing was put into.
    pub(crate) fn remove_empty_folders(&self) {
        for folder in self.lock().made_folders.drain(..).rev() {
            // One that is not empty stays, which is what this call does with it.
            let _ = std::fs::remove_dir(folder);
        }
    }

    /// Declares an input: checks that it is there and notes its SHA-256 for the run record.
    /// `role` is the word of the flag (`capture`, `gaussians`, `photos`).
    ///
    /// # Errors
    /// [`StageError::BadInput`] when it is missing or cannot be read.
    pub fn input(&self, role: &str, path: impl AsRef<Path>) -> anyhow::Result<()> {
        let path = path.as_ref();
        let shown = path.to_string_lossy().into_owned();
        let mut input = RunInput { role: role.to_owned(), path: shown, sha256: None };
        if !is_standard_stream(path) {
            let failed = |e: io::Error| {
                let shown = path.display();
                let text = match e.kind() {
                    io::ErrorKind::NotFound => format!("{role}: no such file or folder: {shown}"),
                    _ => format!("{role}: cannot read ({e}): {shown}"),
                };
                StageError::bad_input(text)
            };
            let kind = std::fs::metadata(path).map_err(failed)?;
            let hashed = !self.common.no_provenance && (kind.is_file() || kind.is_dir());
            if hashed {
                input.sha256 = Some(fingerprint::of_path(path).map_err(failed)?);
            }
        }
        let mut state = self.lock();
        if let Ok(full) = path.canonicalize() {
            if state.replaced.contains(&full) && is_replaced(&full) {
                return Err(both(path).into());
            }
            state.read.push(full);
        }
        state.inputs.push(input);
        Ok(())
    }

    /// Hex SHA-256 of a declared input, when it was noted.
    pub fn sha256_of_input(&self, path: &Path) -> Option<String> {
        let shown = path.to_string_lossy();
        self.lock().inputs.iter().find(|input| input.path == shown)?.sha256.clone()
    }

    /// Standard output for a product written to `-`. When its reader goes away the stage may
    /// return the error; that ends with exit code 0.
    pub fn stdout(&self) -> Stdout {
        Stdout::new()
    }

    /// Shows the progress of a loop; `total` 0 when the number of steps is not known.
    pub fn progress(&self, label: &str, total: u64) -> Progress {
        let display = Display::choose(self.common.progress, self.common.quiet);
        Progress::new(&self.program, label, total, display)
    }

    /// Whether the user asked to stop (Ctrl-C, SIGTERM). A stage that calls this promises to
    /// save what it can and end soon; for one that never does, Ctrl-C ends the process at once.
    pub fn interrupted(&self) -> bool {
        interrupt::asked()
    }

    /// [`StageError::Interrupted`] when the user asked to stop: for loops with nothing to save.
    ///
    /// # Errors
    /// Only that one.
    pub fn check_interrupted(&self) -> Result<(), StageError> {
        if self.interrupted() { Err(StageError::interrupted("interrupted")) } else { Ok(()) }
    }

    /// Tells the user about something that may be wrong; kept in the run record.
    pub fn warn(&self, text: impl Into<String>) {
        let text = text.into();
        tracing::warn!("{text}");
        self.lock().warnings.push(text);
    }

    /// Notes that the result misses a bound of the user's. The stage goes on and returns its
    /// report; the exit code will be 4.
    pub fn gate_not_met(&self, text: impl Into<String>) {
        self.lock().gates_missed.push(text.into());
    }

    /// Ends a dry run: call it after inputs and options were checked and outputs were claimed,
    /// before the work.
    ///
    /// # Errors
    /// In a dry run, one that ends the stage with exit code 0.
    pub fn stop_if_dry_run(&self) -> anyhow::Result<()> {
        if self.common.dry_run { Err(DryRun::default().into()) } else { Ok(()) }
    }

    /// As [`Self::stop_if_dry_run`], for a stage that did all its work in memory: says what would come of it.
    ///
    /// # Errors
    /// In a dry run, one that ends the stage with exit code 0.
    pub fn stop_if_dry_run_with<R: serde::Serialize + std::fmt::Display>(
        &self,
        report: &R,
    ) -> anyhow::Result<()> {
        if !self.common.dry_run {
            return Ok(());
        }
        let value = serde_json::to_value(report)?;
        Err(DryRun { report: Some((report.to_string(), value)) }.into())
    }

    /// Whether the option `id` (`--max-steps` is `max_steps`) was set by `--config`, not by the user's own words.
    pub fn is_from_config(&self, id: &str) -> bool {
        self.from_config.iter().any(|set| set == id)
    }

    /// Whether no run record is wanted, nor what only it needs.
    pub fn skips_provenance(&self) -> bool {
        self.common.no_provenance
    }

    /// Whether nothing may be written.
    pub fn dry_run(&self) -> bool {
        self.common.dry_run
    }

    /// Worker threads in use.
    pub fn threads(&self) -> usize {
        rayon::current_num_threads()
    }

    /// Seconds since the stage began.
    pub fn elapsed_seconds(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    /// CPU seconds of this process and its finished children so far, where the system tells.
    pub fn cpu_seconds(&self) -> Option<f64> {
        crate::resources::cpu_seconds()
    }

    /// Peak resident memory so far in bytes, where the system tells.
    pub fn peak_memory_bytes(&self) -> Option<u64> {
        crate::resources::peak_memory_bytes()
    }

    pub(crate) fn missed_gates(&self) -> Option<Explanation> {
        let gates = self.lock().gates_missed.join("; ");
        (!gates.is_empty()).then_some(Explanation { text: gates, help: None })
    }
}

/// Whether writing there takes away what was there: a device or a pipe stays what it is.
fn is_replaced(full: &Path) -> bool {
    full.is_file() || full.is_dir()
}

fn both(path: &Path) -> StageError {
    StageError::usage(format!("this is an input, and would be replaced: {}", path.display()))
        .help("write to another path")
}

#[cfg(test)]
mod tests;
