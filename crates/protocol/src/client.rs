//! The stage's side of the protocol.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use motes_formats::documents::{Parsed, parse_document, read_document, write_document};
use motes_formats::error::quoted;
use motes_formats::images::image_dimensions;
use motes_formats::provider::{
    ModelDescription, ProviderDescription, ProviderKind, ProviderReply, ProviderRequest, Task,
};
use serde::Serialize;

use crate::answers::Answers;
use crate::checks;
use crate::process::{Patience, run};
use crate::server::Server;
use crate::{ProviderCommand, ProviderError};

/// What a provider is granted to describe itself: it may load its model for that, seconds.
const DESCRIBE_S: f64 = 120.0;

/// A provider that described itself.
pub struct Provider {
    command: ProviderCommand,
    /// What it says about itself.
    pub description: ProviderDescription,
    seconds: f64,
    answers: Option<Answers>,
    server: Option<Server>,
    used: ProviderUse,
}

/// Who answered, for reports and run records.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ProviderUse {
    /// Name of the program.
    pub name: String,
    /// Its version.
    pub program_version: String,
    /// Its models, with the licenses of their weights.
    pub models: Vec<ModelDescription>,
    /// Answers of the program in this run.
    pub answered: u64,
    /// Answers that were kept from earlier runs.
    pub kept: u64,
}

impl Provider {
    /// Starts the program with `--describe`. `seconds` is the limit of each answer; answers are kept in `answers` where a folder
    /// is given.
    ///
    /// # Errors
    /// The program cannot be started, fails, does not keep the protocol or does not do `kind`.
    pub fn open(
        command: ProviderCommand,
        kind: ProviderKind,
        seconds: f64,
        answers: Option<&Path>,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Self, ProviderError> {
        let description = describe(&command, seconds.min(DESCRIBE_S), stopped)?;
        if !description.kinds.contains(&kind) {
            let names: Vec<&str> = description.kinds.iter().map(|kind| kind.name()).collect();
            let cause = format!("does not do {}", kind.name());
            let help = format!("it does {}: name another one", names.join(", "));
            return Err(ProviderError::Unable { name: command.name, cause, help });
        }
        let used = ProviderUse {
            name: description.name.clone(),
            program_version: description.program_version.clone(),
            models: description.models.clone(),
            ..ProviderUse::default()
        };
        let answers = answers.map(|folder| Answers::new(folder, &description));
        Ok(Self { command, description, seconds, answers, server: None, used })
    }

    /// Who answered so far.
    pub fn used(&self) -> &ProviderUse {
        &self.used
    }

    /// The checked reply to a request whose files lie in `folder`; what the reply names lies there, too. The program stays for the
    /// next request.
    ///
    /// # Errors
    /// A picture has a size that the provider does not take; the program fails, is late, does not keep the protocol, or answers
    /// what nobody asked for: another size, values that are not finite, files that are not there; the user asked to stop.
    pub fn ask(
        &mut self,
        folder: &Path,
        request: &ProviderRequest,
        stopped: &dyn Fn() -> bool,
    ) -> Result<ProviderReply, ProviderError> {
        let path = self.prepare(folder, request)?;
        let key = match &self.answers {
            Some(answers) => Some(answers.key(folder, request)?),
            None => None,
        };
        if let (Some(answers), Some(key)) = (&self.answers, &key)
            && let Some(reply) = answers.find(key, folder, request)
        {
            self.used.kept += 1;
            return Ok(reply);
        }
        let patience = Patience { seconds: self.seconds, stopped };
        let server = match &mut self.server {
            Some(server) => server,
            none => none.insert(Server::start(&self.command)?),
        };
        let said = match server.ask(&path, patience) {
            Ok(said) => said,
            Err(error) => {
                // What comes next would be the answer to this.
                self.server = None;
                return Err(error);
            }
        };
        let reply = self.reply(folder, request, &said)?;
        self.used.answered += 1;
        if let (Some(answers), Some(key)) = (&self.answers, &key) {
            answers.keep(key, folder, &reply);
        }
        Ok(reply)
    }

    /// As [`Self::ask`], by a program that is started for this request alone; nothing is kept.
    ///
    /// # Errors
    /// As [`Self::ask`].
    pub fn ask_once(
        &self,
        folder: &Path,
        request: &ProviderRequest,
        stopped: &dyn Fn() -> bool,
    ) -> Result<ProviderReply, ProviderError> {
        let path = self.prepare(folder, request)?;
        let patience = Patience { seconds: self.seconds, stopped };
        let line = [OsStr::new("--request"), path.as_os_str()];
        let ended = run(&self.command, &line, ("request", "a request"), patience)?;
        let ended = ended.checked(&self.command.name, "a request")?;
        if !ended.stdout.trim_ascii().is_empty() {
            let said = quoted(ended.stdout.trim_ascii());
            return Err(self.broken(format!("it writes to standard output: {said}")));
        }
        self.reply(folder, request, &folder.join("reply.json"))
    }

    fn prepare(&self, folder: &Path, request: &ProviderRequest) -> Result<PathBuf, ProviderError> {
        let path = folder.join("request.json");
        let ProviderDescription { smallest_side_px: least, largest_side_px: most, .. } =
            self.description;
        for file in request.files(&path)?.into_iter().collect::<BTreeSet<_>>() {
            if file.extension().is_some_and(|end| end == "exr") {
                continue;
            }
            let (width, height) = image_dimensions(&folder.join(&file))?;
            let (short, long) = (width.min(height) as u64, width.max(height) as u64);
            if short < least || long > most {
                let cause = format!("does not take pictures of {width}x{height} pixels");
                let help = format!("it takes sides from {least} to {most} pixels");
                return Err(ProviderError::Unable { name: self.command.name.clone(), cause, help });
            }
        }
        self.makes(request)?;
        // What an earlier request left is no answer to this one.
        let stale = folder.join("reply.json");
        if stale.exists() {
            std::fs::remove_file(&stale).map_err(|e| motes_formats::FormatError::io(&stale, e))?;
        }
        write_document(&path, request)?;
        Ok(path)
    }

    /// Whether the maps that are asked for are among those that the provider makes.
    fn makes(&self, request: &ProviderRequest) -> Result<(), ProviderError> {
        let Task::Predict(task) = &request.task else { return Ok(()) };
        let made = &self.description.quantities;
        let odd = task.quantities.iter().find(|q| !made.is_empty() && !made.contains(q));
        let Some(odd) = odd else { return Ok(()) };
        let names: Vec<&str> = made.iter().map(|quantity| quantity.name()).collect();
        let cause = format!("does not predict {}", odd.name());
        let help = format!("it predicts {}: ask for these alone", names.join(", "));
        Err(ProviderError::Unable { name: self.command.name.clone(), cause, help })
    }

    fn reply(
        &self,
        folder: &Path,
        request: &ProviderRequest,
        said: &Path,
    ) -> Result<ProviderReply, ProviderError> {
        let due = folder.join("reply.json");
        let same = |a: &Path, b: &Path| a == b || a.canonicalize().ok() == b.canonicalize().ok();
        if !due.is_file() {
            return Err(self.broken("it left no reply.json beside the request".into()));
        }
        if !same(&due, said) {
            let cause = format!("its reply {} does not lie beside the request", said.display());
            return Err(self.broken(cause));
        }
        let told = |error: motes_formats::FormatError| self.broken(first_line(&error.to_string()));
        let Parsed { document, warnings } = read_document::<ProviderReply>(&due).map_err(told)?;
        warnings.iter().for_each(|warning| tracing::debug!("{}: {warning}", self.command.name));
        checks::check(folder, folder, request, &document).map_err(|cause| self.broken(cause))?;
        Ok(document)
    }

    fn broken(&self, cause: String) -> ProviderError {
        ProviderError::Protocol { name: self.command.name.clone(), cause }
    }
}

fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().to_owned()
}

/// What a provider says about itself.
pub(crate) fn describe(
    command: &ProviderCommand,
    seconds: f64,
    stopped: &dyn Fn() -> bool,
) -> Result<ProviderDescription, ProviderError> {
    let job = ("describe", "describing itself");
    let ended = run(command, &[OsStr::new("--describe")], job, Patience { seconds, stopped })?;
    let ended = ended.checked(&command.name, "--describe")?;
    let parsed = parse_document::<ProviderDescription>(&ended.stdout, Path::new("--describe"));
    let broken = |error: motes_formats::FormatError| ProviderError::Protocol {
        name: command.name.clone(),
        cause: first_line(&error.to_string()),
    };
    Ok(parsed.map_err(broken)?.document)
}
