//! The checks, one function each.

use std::ffi::OsStr;
use std::path::Path;

use motes_formats::FormatError;
use motes_formats::provider::{ProviderReply, ProviderRequest, Task};

use super::{END, Outcome, Subject, request};
use crate::process::{Patience, last_words, run};
use crate::server::Server;
use crate::{Provider, ProviderError};

/// Neither square nor a power of two.
const SIZE: (usize, usize) = (48, 34);

type Found = Result<Outcome, ProviderError>;

impl Subject<'_> {
    fn provider(&self) -> Result<Provider, ProviderError> {
        Provider::open(self.command.clone(), self.kind, self.seconds, None, self.stopped)
    }

    /// A request that it can answer: of the maps, those that it makes.
    fn request(
        &self,
        folder: &Path,
        size: (usize, usize),
    ) -> Result<ProviderRequest, ProviderError> {
        let mut request = request(self.kind, folder, size)?;
        let made = &self.description.quantities;
        if let Task::Predict(task) = &mut request.task
            && !made.is_empty()
        {
            task.quantities.clone_from(made);
        }
        Ok(request)
    }

    /// An ordinary size that the provider takes.
    fn size(&self) -> (usize, usize) {
        let fits = |v: usize| {
            let (least, most) =
                (self.description.smallest_side_px, self.description.largest_side_px);
            (v as u64).clamp(least, most.max(least)) as usize
        };
        (fits(SIZE.0), fits(SIZE.1))
    }

    fn patience(&self) -> Patience<'_> {
        Patience { seconds: self.seconds, stopped: self.stopped }
    }
}

pub(super) fn one_pixel(subject: &Subject<'_>, folder: &Path) -> Found {
    let least = subject.description.smallest_side_px;
    if least > 1 {
        return Ok(Outcome::Skipped(format!("it takes sides from {least} pixels")));
    }
    let request = subject.request(folder, (1, 1))?;
    subject.provider()?.ask_once(folder, &request, subject.stopped)?;
    Ok(Outcome::Passed)
}

pub(super) fn picture(subject: &Subject<'_>, folder: &Path) -> Found {
    let request = subject.request(folder, subject.size())?;
    subject.provider()?.ask_once(folder, &request, subject.stopped)?;
    Ok(Outcome::Passed)
}

pub(super) fn alike(subject: &Subject<'_>, folder: &Path) -> Found {
    if !subject.description.deterministic {
        return Ok(Outcome::Skipped("it does not call itself deterministic".into()));
    }
    let provider = subject.provider()?;
    let mut answers = Vec::new();
    for name in ["first", "second"] {
        let folder = made(folder, name)?;
        let request = subject.request(&folder, subject.size())?;
        let reply = provider.ask_once(&folder, &request, subject.stopped)?;
        answers.push(contents(&folder, &reply)?);
    }
    Ok(same(&answers[0], &answers[1], "the second answer differs from the first"))
}

/// A request that is JSON and no request.
const BAD: &str =
    r#"{"format": "motes/provider-request", "version": "1.0", "task": {"dream": {}}}"#;

pub(super) fn bad_request(subject: &Subject<'_>, folder: &Path) -> Found {
    let path = bad(folder)?;
    let line = [OsStr::new("--request"), path.as_os_str()];
    let ended = run(subject.command, &line, ("request", "a bad request"), subject.patience())?;
    let said = ended.stderr.lines().filter(|line| !line.trim().is_empty());
    let said = said.filter(|line| !line.starts_with("help:")).count();
    let fail = |text: String| Ok(Outcome::Failed(text));
    if ended.status.code() != Some(2) {
        return fail(format!("{} on a bad request: {}", ended.status, last_words(&ended.stderr)));
    }
    if folder.join("reply.json").exists() || !ended.stdout.trim_ascii().is_empty() {
        return fail("it answers a bad request".into());
    }
    if said != 1 {
        return fail(format!("it says {said} lines about a bad request, not one"));
    }
    Ok(Outcome::Passed)
}

pub(super) fn serves(subject: &Subject<'_>, folder: &Path) -> Found {
    let mut provider = subject.provider()?;
    let (once, served) = (made(folder, "once")?, made(folder, "served")?);
    let request_once = subject.request(&once, subject.size())?;
    let first = provider.ask_once(&once, &request_once, subject.stopped)?;
    let request_served = subject.request(&served, subject.size())?;
    let second = provider.ask(&served, &request_served, subject.stopped)?;
    if !subject.description.deterministic {
        return Ok(Outcome::Passed);
    }
    let (first, second) = (contents(&once, &first)?, contents(&served, &second)?);
    Ok(same(&first, &second, "what it serves differs from what it answers"))
}

pub(super) fn serves_on(subject: &Subject<'_>, folder: &Path) -> Found {
    let good = made(folder, "good")?;
    let path = bad(&made(folder, "bad")?)?;
    let mut server = Server::start(subject.command)?;
    match server.ask(&path, subject.patience()) {
        Err(ProviderError::Failed { status, .. }) if status == "code 2" => {}
        Err(error) => return Err(error),
        Ok(_) => return Ok(Outcome::Failed("it answers a bad request".into())),
    }
    let request = subject.request(&good, subject.size())?;
    let path = good.join("request.json");
    motes_formats::documents::write_document(&path, &request)?;
    server.ask(&path, subject.patience())?;
    server.close();
    match server.wait(END) {
        Some(status) if status.success() => Ok(Outcome::Passed),
        Some(status) => Ok(Outcome::Failed(format!("{status} at the end of its input"))),
        None => Ok(Outcome::Failed("it does not end when its input ends".into())),
    }
}

pub(super) fn ends(subject: &Subject<'_>, folder: &Path) -> Found {
    let request = subject.request(folder, subject.size())?;
    let path = folder.join("request.json");
    motes_formats::documents::write_document(&path, &request)?;
    let mut server = Server::start(subject.command)?;
    server.ask(&path, subject.patience())?;
    terminate(server.id());
    match server.wait(END) {
        Some(_) => Ok(Outcome::Passed),
        None => Ok(Outcome::Failed(format!("it works on {END:?} after SIGTERM"))),
    }
}

#[cfg(unix)]
fn terminate(id: u32) {
    if let Ok(id) = i32::try_from(id) {
        let id = nix::unistd::Pid::from_raw(id);
        let _ = nix::sys::signal::kill(id, nix::sys::signal::Signal::SIGTERM);
    }
}

#[cfg(not(unix))]
fn terminate(_: u32) {}

fn made(folder: &Path, name: &str) -> Result<std::path::PathBuf, ProviderError> {
    let folder = folder.join(name);
    std::fs::create_dir_all(&folder).map_err(|error| FormatError::io(&folder, error))?;
    Ok(folder)
}

fn bad(folder: &Path) -> Result<std::path::PathBuf, ProviderError> {
    let path = folder.join("request.json");
    std::fs::write(&path, BAD).map_err(|error| FormatError::io(&path, error))?;
    Ok(path)
}

/// The result and the bytes of its files.
fn contents(folder: &Path, reply: &ProviderReply) -> Result<(String, Vec<Vec<u8>>), ProviderError> {
    let mut bytes = Vec::new();
    for file in reply.files(&folder.join("reply.json"))? {
        let path = folder.join(file);
        bytes.push(std::fs::read(&path).map_err(|error| FormatError::io(&path, error))?);
    }
    Ok((motes_formats::documents::to_pretty_json(&reply.result), bytes))
}

fn same<T: PartialEq>(a: &T, b: &T, otherwise: &str) -> Outcome {
    if a == b { Outcome::Passed } else { Outcome::Failed(otherwise.into()) }
}
